//! Reads the file that names the people who may command: who they are, their roles, and where their
//! keys are.
//!
//! The vehicle reads all keys. A station reads its operator's only, so the others need not be
//! present.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::dialect::TdRole;
use crate::key_file::{KeyFile, KeyFileError};
use crate::signing::{Key, OPERATORS};

/// The longest name of an operator, bytes: as many as TD_OPERATOR carries.
pub const NAME_LEN: usize = 16;

/// Why a crew file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum CrewFileError {
    #[error("crew file {path}")]
    Read { path: PathBuf, source: std::io::Error },
    /// Not TOML of this shape.
    #[error("crew file {path}: {source}")]
    Parse { path: PathBuf, source: toml::de::Error },
    #[error("crew file {path}: {why}")]
    Wrong { path: PathBuf, why: String },
    #[error(transparent)]
    Key(#[from] KeyFileError),
}

/// How many people an arming and a start take.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    OnePerson,
    TwoPerson,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum RoleName {
    RangeSafety,
    Flight,
    Pad,
    Observer,
}

/// The file as it is written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    mode: Mode,
    operator: Vec<Person>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Person {
    name: String,
    role: RoleName,
    /// The number of the key; none for an observer.
    link: Option<u8>,
    key: Option<PathBuf>,
}

/// A person of the crew. Observers have no key and no number.
#[derive(Debug, Clone, PartialEq)]
pub struct Member {
    pub name: String,
    pub role: TdRole,
    /// The number of the key, and its file.
    pub key: Option<(u8, PathBuf)>,
}

/// The people of one launch.
#[derive(Debug, Clone, PartialEq)]
pub struct CrewFile {
    pub path: PathBuf,
    pub mode: Mode,
    pub members: Vec<Member>,
}

impl CrewFile {
    /// Reads a file. Keys are named relative to its folder; they are not read here.
    ///
    /// # Errors
    /// It cannot be read, or a person in it is wrong; the message names the person and what would
    /// be accepted.
    pub fn open(path: &Path) -> Result<Self, CrewFileError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| CrewFileError::Read { path: path.to_owned(), source })?;
        Self::from_toml(&text, path)
    }

    /// Reads the text of a file at this path.
    ///
    /// # Errors
    /// As [`CrewFile::open`].
    pub fn from_toml(text: &str, path: &Path) -> Result<Self, CrewFileError> {
        let written: Written =
            toml::from_str(text).map_err(|source| CrewFileError::Parse { path: path.to_owned(), source })?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let wrong = |why| CrewFileError::Wrong { path: path.to_owned(), why };
        let members: Vec<Member> = written
            .operator
            .into_iter()
            .map(|person| person.checked(folder))
            .collect::<Result<_, _>>()
            .map_err(wrong)?;
        let crew = Self { path: path.to_owned(), mode: written.mode, members };
        crew.check().map_err(wrong)?;
        Ok(crew)
    }

    fn check(&self) -> Result<(), String> {
        for (place, member) in self.members.iter().enumerate() {
            let before = &self.members[..place];
            let number = member.key.as_ref().map(|(number, _)| *number);
            if let Some(other) = before.iter().find(|other| other.name == member.name) {
                return Err(format!("two operators are called `{}`", other.name));
            }
            let same =
                |other: &&Member| number.is_some() && other.key.as_ref().map(|(other, _)| *other) == number;
            if let (Some(other), Some(number)) = (before.iter().find(same), number) {
                return Err(format!("`{}` and `{}` both have link = {number}", other.name, member.name));
            }
        }
        let with_keys = self.members.iter().filter(|member| member.key.is_some());
        let roles: BTreeSet<u8> = with_keys.map(|member| member.role as u8).collect();
        let needed = if self.mode == Mode::TwoPerson { 2 } else { 1 };
        if roles.len() < needed {
            let words = "needs operators with keys of at least";
            return Err(format!("{words} {needed} different roles, found {}", roles.len()));
        }
        Ok(())
    }

    /// Reads every operator's key, by number.
    ///
    /// # Errors
    /// A key cannot be read, other users can read it, or two operators have the same key.
    pub fn keys(&self) -> Result<BTreeMap<u8, Key>, CrewFileError> {
        let mut keys = BTreeMap::new();
        for (number, path) in self.members.iter().filter_map(|member| member.key.as_ref()) {
            let key = KeyFile::read_key(path)?;
            if keys.values().any(|other| *other == key) {
                let why = format!("{} is also another operator's key", path.display());
                return Err(CrewFileError::Wrong { path: self.path.clone(), why });
            }
            keys.insert(*number, key);
        }
        Ok(keys)
    }

    /// The member of this name.
    ///
    /// # Errors
    /// Unknown name; the message lists all names.
    pub fn member(&self, name: &str) -> Result<&Member, CrewFileError> {
        self.members.iter().find(|member| member.name == name).ok_or_else(|| {
            let names: Vec<&str> = self.members.iter().map(|member| member.name.as_str()).collect();
            let why = format!("no operator `{name}`; there are {}", names.join(", "));
            CrewFileError::Wrong { path: self.path.clone(), why }
        })
    }
}

impl Person {
    fn checked(self, folder: &Path) -> Result<Member, String> {
        let Self { name, role, link, key } = self;
        let fits =
            !name.is_empty() && name.len() <= NAME_LEN && name.chars().all(|letter| !letter.is_control());
        if !fits {
            return Err(format!("name `{}`: must have 1 to {NAME_LEN} bytes", name.escape_debug()));
        }
        let role = match role {
            RoleName::RangeSafety => TdRole::TD_ROLE_RANGE_SAFETY,
            RoleName::Flight => TdRole::TD_ROLE_FLIGHT,
            RoleName::Pad => TdRole::TD_ROLE_PAD,
            RoleName::Observer => TdRole::TD_ROLE_OBSERVER,
        };
        let key = match (role, link, key) {
            (TdRole::TD_ROLE_OBSERVER, None, None) => None,
            (TdRole::TD_ROLE_OBSERVER, ..) => {
                return Err(format!("`{name}` is an observer: without link and key"));
            }
            (_, Some(number), Some(path)) if OPERATORS.contains(&number) => Some((number, folder.join(path))),
            (_, Some(number), Some(_)) => {
                let (first, last) = (OPERATORS.start(), OPERATORS.end());
                return Err(format!("`{name}`: link = {number} must be {first} to {last}"));
            }
            _ => return Err(format!("`{name}` needs link (1 to 15) and key (a file)")),
        };
        Ok(Member { name, role, key })
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::PermissionsExt as _;

    use super::*;

    const TWO: &str = r#"
        mode = "two-person"
        [[operator]]
        name = "Ann"
        role = "range-safety"
        link = 1
        key = "ann.key"
        [[operator]]
        name = "Bob"
        role = "flight"
        link = 2
        key = "keys/bob.key"
        [[operator]]
        name = "Cy"
        role = "observer"
    "#;

    fn read(text: &str) -> Result<CrewFile, String> {
        CrewFile::from_toml(text, Path::new("/launch/crew.toml")).map_err(|error| error.to_string())
    }

    #[test]
    fn a_crew_has_names_roles_and_the_places_of_its_keys() {
        let crew = read(TWO).unwrap();
        assert_eq!(crew.mode, Mode::TwoPerson);
        let bob = crew.member("Bob").unwrap();
        assert_eq!(bob.role, TdRole::TD_ROLE_FLIGHT);
        assert_eq!(bob.key, Some((2, PathBuf::from("/launch/keys/bob.key"))));
        assert_eq!(crew.member("Cy").unwrap().key, None);
        let nobody = crew.member("Eve").unwrap_err().to_string();
        assert!(nobody.contains("no operator `Eve`; there are Ann, Bob, Cy"), "{nobody}");
    }

    #[test]
    fn what_is_wrong_is_refused_by_name() {
        let cases = [
            ("role = \"flight\"", "role = \"pilot\"", "unknown variant `pilot`"),
            ("role = \"flight\"", "role = \"range-safety\"", "at least 2 different roles, found 1"),
            ("link = 2", "link = 1", "`Ann` and `Bob` both have link = 1"),
            ("link = 2", "link = 16", "`Bob`: link = 16 must be 1 to 15"),
            ("link = 2\n", "", "`Bob` needs link (1 to 15) and key (a file)"),
            ("name = \"Bob\"", "name = \"Ann\"", "two operators are called `Ann`"),
            ("name = \"Bob\"", "name = \"A name that is too long\"", "must have 1 to 16 bytes"),
            (
                "role = \"observer\"",
                "role = \"observer\"\nlink = 3",
                "`Cy` is an observer: without link and key",
            ),
            ("mode", "people = 3\nmode", "unknown field `people`"),
        ];
        for (right, wrong, words) in cases {
            let error = read(&TWO.replacen(right, wrong, 1)).unwrap_err();
            assert!(error.contains("/launch/crew.toml") && error.contains(words), "{error}");
        }
    }

    #[test]
    fn a_key_that_two_have_or_that_others_can_read_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("crew.toml");
        std::fs::create_dir(folder.path().join("keys")).unwrap();
        let (ann, bob) = (folder.path().join("ann.key"), folder.path().join("keys/bob.key"));
        KeyFile::create(&ann).unwrap();
        std::fs::copy(&ann, &bob).unwrap();
        let crew = CrewFile::from_toml(TWO, &path).unwrap();
        assert!(crew.keys().unwrap_err().to_string().contains("bob.key is also another operator's key"));
        std::fs::remove_file(&bob).unwrap();
        KeyFile::create(&bob).unwrap();
        assert_eq!(crew.keys().unwrap().keys().copied().collect::<Vec<_>>(), [1, 2]);
        std::fs::set_permissions(&bob, std::fs::Permissions::from_mode(0o640)).unwrap();
        assert!(crew.keys().unwrap_err().to_string().contains("chmod 600"));
    }
}

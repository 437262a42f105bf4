//! The keys of a station: the one that all share, and that of the operator who sits here.

use anyhow::Context as _;
use protocol::book::BookKey;
use protocol::crew_file::CrewFile;
use protocol::dialect::TdRole;
use protocol::key_file::KeyFile;
use protocol::signing::Signing;

use crate::cli::Cli;
use crate::model::two_person::KeyOwner;

/// A key file with its timestamps, what it signs and checks, and whose it is.
pub(super) struct KeyRing {
    pub(super) key: Option<(KeyFile, Signing)>,
    pub(super) owner: Option<KeyOwner>,
    /// Signs the station's book; `None` without a key.
    pub(super) book_key: Option<BookKey>,
    /// The people of the crew by name, with their roles; empty without a crew.
    pub(super) roles: Vec<(String, TdRole)>,
}

impl KeyRing {
    /// Reads the keys. An operator's frames have timestamps of their own, beside their key.
    ///
    /// # Errors
    /// A file cannot be read, others can read it, or the crew has nobody of this name.
    pub(super) fn open(cli: &Cli) -> anyhow::Result<Self> {
        let Some(shared) = cli.key.as_deref() else {
            anyhow::ensure!(
                cli.crew.is_none(),
                "--crew needs --key, the key that vehicle and stations share"
            );
            return Ok(Self { key: None, owner: None, book_key: None, roles: Vec::new() });
        };
        let crew = cli.crew.as_deref().map(CrewFile::open).transpose()?;
        let people = crew.iter().flat_map(|crew| &crew.members);
        let roles = people.map(|member| (member.name.clone(), member.role)).collect();
        let member = match (&crew, cli.operator.as_deref()) {
            (Some(crew), Some(name)) => Some(crew.member(name)?),
            _ => None,
        };
        let Some((member, (number, path))) = member.and_then(|member| Some((member, member.key.as_ref()?)))
        else {
            let book_key = Some(BookKey::of(&KeyFile::read_key(shared)?));
            return Ok(Self { key: Some(KeyFile::open(shared, "ground")?), owner: None, book_key, roles });
        };
        let (file, signing) =
            KeyFile::open(path, "ground").with_context(|| format!("the timestamps of {}", member.name))?;
        let signing = signing.as_operator(*number, KeyFile::read_key(shared)?);
        let book_key = Some(BookKey::of(&KeyFile::read_key(path)?));
        let owner = KeyOwner { number: *number, name: member.name.clone() };
        Ok(Self { key: Some((file, signing)), owner: Some(owner), book_key, roles })
    }
}

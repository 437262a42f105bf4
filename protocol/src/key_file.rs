//! Key files: the only place a signing key lives, and beside it what must be remembered of timestamps.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read as _, Write as _};
use std::os::unix::fs::{OpenOptionsExt as _, PermissionsExt as _};
use std::path::{Path, PathBuf};

use crate::signing::{Key, Memory, MemoryError, Signing};

/// For the owner alone.
const MODE: u32 = 0o600;
/// What is appended to remembered timestamps before they are written anew.
const APPENDED_MOST: usize = 64 << 10;
/// Anything for group or others.
const OTHERS: u32 = 0o077;

/// Why a key file is not used.
#[derive(Debug, thiserror::Error)]
pub enum KeyFileError {
    /// It cannot be read or written.
    #[error("key file {path}")]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// Others may read or change it.
    #[error("key file {path}: mode {mode:03o} lets others at the key; run `chmod 600 {path}`")]
    Permissions {
        /// The file.
        path: PathBuf,
        /// Its permission bits.
        mode: u32,
    },
    /// It holds no key.
    #[error("key file {path}: must be 64 hexadecimal digits; `onboard-sim keygen` makes one")]
    NoKey {
        /// The file.
        path: PathBuf,
    },
    /// The timestamps beside it make no sense. That is no fresh start: whoever was heard could be replayed.
    #[error("timestamp file {path}: {why}; delete it only if nobody can have recorded the runs before")]
    Memory {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        why: MemoryError,
    },
}

/// A key file in use.
#[derive(Debug)]
pub struct KeyFile {
    stamps_path: PathBuf,
    /// What the file says, to the end of its last line.
    written: Memory,
    /// The file, once this run has written it, and how much was appended since.
    appending: Option<(File, usize)>,
}

impl KeyFile {
    /// Makes a new key, random by the system, in a new file for its owner alone.
    ///
    /// # Errors
    /// The file exists, or cannot be written.
    pub fn create(path: &Path) -> Result<(), KeyFileError> {
        let mut bytes = [0; Key::LEN];
        File::open("/dev/urandom")
            .and_then(|mut random| random.read_exact(&mut bytes))
            .map_err(|source| KeyFileError::Io { path: path.to_owned(), source })?;
        Self::create_with(path, &Key::new(bytes))
    }

    /// Puts this key into a new file for its owner alone.
    ///
    /// # Errors
    /// The file exists, or cannot be written.
    pub fn create_with(path: &Path, key: &Key) -> Result<(), KeyFileError> {
        let failed = |source| KeyFileError::Io { path: path.to_owned(), source };
        let mut file =
            OpenOptions::new().write(true).create_new(true).mode(MODE).open(path).map_err(failed)?;
        writeln!(file, "{}", key.to_hex()).and_then(|()| file.sync_all()).map_err(failed)
    }

    /// Reads a key and what `user` remembers beside it (`FILE.USER.stamps`): vehicle and ground may share a key on
    /// one machine, but not a memory.
    ///
    /// # Errors
    /// The file cannot be read, others can read it, or it holds no key; or what is remembered makes no sense.
    pub fn open(path: &Path, user: &str) -> Result<(Self, Signing), KeyFileError> {
        let failed = |source| KeyFileError::Io { path: path.to_owned(), source };
        let mut file = File::open(path).map_err(failed)?;
        let mode = file.metadata().map_err(failed)?.permissions().mode() & 0o777;
        if mode & OTHERS != 0 {
            return Err(KeyFileError::Permissions { path: path.to_owned(), mode });
        }
        let no_key = || KeyFileError::NoKey { path: path.to_owned() };
        let mut text = String::new();
        file.read_to_string(&mut text).map_err(|error| match error.kind() {
            io::ErrorKind::InvalidData => no_key(),
            _ => failed(error),
        })?;
        let key = Key::from_hex(text.trim_end()).ok_or_else(no_key)?;
        let mut stamps_path = path.as_os_str().to_owned();
        stamps_path.push(format!(".{user}.stamps"));
        let stamps_path = PathBuf::from(stamps_path);
        let memory = match fs::read_to_string(&stamps_path) {
            Ok(text) => Memory::from_text(&text)
                .map_err(|why| KeyFileError::Memory { path: stamps_path.clone(), why })?,
            Err(error) if error.kind() == io::ErrorKind::NotFound => Memory::default(),
            Err(source) => return Err(KeyFileError::Io { path: stamps_path, source }),
        };
        let file = Self { stamps_path, written: memory.clone(), appending: None };
        Ok((file, Signing::new(key, memory)))
    }

    /// Remembers timestamps, so that they outlive this process, however it ends. Cheap enough to be done before anything
    /// that was believed is acted on: a line of some thirty bytes for each stream that was heard.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn remember(&mut self, memory: &Memory) -> Result<(), KeyFileError> {
        let lines = memory.lines_since(&self.written);
        if lines.is_empty() {
            return Ok(());
        }
        // One write: of a process that is killed all of it is in the file or nothing.
        if let Some((file, appended)) = &mut self.appending
            && *appended < APPENDED_MOST
            && file.write_all(lines.as_bytes()).is_ok()
        {
            *appended += lines.len();
            self.written.catch_up(memory);
            return Ok(());
        }
        self.appending = None;
        self.appending = Some((self.write_anew(memory)?, 0));
        self.written = memory.clone();
        Ok(())
    }

    /// Whole or not at all. What could not be appended is not tried again there: it may have been cut off.
    fn write_anew(&self, memory: &Memory) -> Result<File, KeyFileError> {
        let mut beside = self.stamps_path.clone().into_os_string();
        beside.push(".new");
        let write = || {
            let mut file =
                OpenOptions::new().write(true).create(true).truncate(true).mode(MODE).open(&beside)?;
            file.write_all(memory.to_text().as_bytes())?;
            fs::rename(&beside, &self.stamps_path)?;
            Ok(file)
        };
        write().map_err(|source| KeyFileError::Io { path: self.stamps_path.clone(), source })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dialect::{HEARTBEAT_DATA, MavMessage};
    use crate::frame::Encoder;
    use crate::identity::GROUND;

    #[test]
    fn a_new_key_is_its_owner_s_alone_and_no_file_is_overwritten() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("flight.key");
        KeyFile::create(&path).unwrap();
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
        let text = fs::read_to_string(&path).unwrap();
        assert!(Key::from_hex(text.trim_end()).is_some());
        assert!(matches!(KeyFile::create(&path), Err(KeyFileError::Io { .. })));
        assert_eq!(fs::read_to_string(&path).unwrap(), text);
        for mode in [0o640, 0o604, 0o620, 0o602, 0o610] {
            fs::set_permissions(&path, fs::Permissions::from_mode(mode)).unwrap();
            let error = KeyFile::open(&path, "ground").unwrap_err().to_string();
            assert!(error.contains("chmod 600") && error.contains("flight.key"), "{error}");
        }
    }

    #[test]
    fn what_is_no_key_is_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bad.key");
        for content in [&b""[..], b"hello", &[0xFF; 64]] {
            let mut file =
                OpenOptions::new().write(true).create(true).truncate(true).mode(MODE).open(&path).unwrap();
            file.write_all(content).unwrap();
            let error = KeyFile::open(&path, "ground").unwrap_err();
            assert!(matches!(error, KeyFileError::NoKey { .. }), "{error}");
        }
        assert!(KeyFile::open(&folder.path().join("none"), "ground").is_err());
    }

    #[test]
    fn timestamps_are_found_again() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("flight.key");
        KeyFile::create(&path).unwrap();
        let (mut file, mut signing) = KeyFile::open(&path, "vehicle").unwrap();
        let beat = Encoder::new(GROUND).encode(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
        let signed = signing.sign(&beat, 0, 1_000);
        signing.check(&signed, 1_000).unwrap();
        file.remember(&signing.memory()).unwrap();
        let (_, mut restarted) = KeyFile::open(&path, "vehicle").unwrap();
        assert!(restarted.check(&signed, 0).is_err(), "replayed after the restart");
        fs::write(folder.path().join("flight.key.vehicle.stamps"), "nonsense").unwrap();
        let error = KeyFile::open(&path, "vehicle").unwrap_err().to_string();
        assert!(error.contains("flight.key.vehicle.stamps") && error.contains("nonsense"), "{error}");
    }

    /// What a power cut leaves of a file that was just written.
    #[test]
    fn an_empty_file_of_timestamps_is_no_fresh_start() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("flight.key");
        KeyFile::create(&path).unwrap();
        let stamps = folder.path().join("flight.key.ground.stamps");
        for nothing in ["", "\n", "heard 1 1 0 5\n", "our"] {
            fs::write(&stamps, nothing).unwrap();
            let error = KeyFile::open(&path, "ground").unwrap_err();
            assert!(matches!(error, KeyFileError::Memory { .. }), "{error}");
            assert!(error.to_string().contains("flight.key.ground.stamps"), "{error}");
        }
    }

    /// A run that is killed has no last words: what it was told before must be in the file.
    #[test]
    fn every_frame_that_was_remembered_outlives_a_kill() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("flight.key");
        KeyFile::create(&path).unwrap();
        let (_, mut vehicle) = KeyFile::open(&path, "vehicle").unwrap();
        let mut encoder = Encoder::new(GROUND);
        let mut beat = || encoder.encode(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
        let (mut file, mut ground) = KeyFile::open(&path, "ground").unwrap();
        // More than is appended before the file is written anew.
        let mut longest = 0;
        for number in 0..5_000 {
            let signed = vehicle.sign(&beat(), 0, 1_000 + 300 * number);
            ground.check(&signed, 1_000 + 300 * number).unwrap();
            file.remember(&ground.memory()).unwrap();
            longest =
                longest.max(fs::metadata(folder.path().join("flight.key.ground.stamps")).unwrap().len());
            if number % 500 == 0 {
                let (_, mut restarted) = KeyFile::open(&path, "ground").unwrap();
                let again = restarted.check(&signed, 1_000);
                assert_eq!(again, Err(crate::signing::Rejection::Replayed), "frame {number}");
                restarted.check(&vehicle.sign(&beat(), 0, 0), 1_000).unwrap();
            }
        }
        assert!(longest < 2 * APPENDED_MOST as u64, "{longest} bytes");
    }

    #[test]
    fn a_passphrase_makes_the_key_of_its_sha_256() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("flight.key");
        KeyFile::create_with(&path, &Key::from_passphrase("abc")).unwrap();
        // FIPS 180-2, appendix B.1.
        let digest = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(fs::read_to_string(&path).unwrap().trim_end(), digest);
    }
}

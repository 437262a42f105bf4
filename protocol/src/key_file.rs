//! Stores a signing key in a file, and the timestamps to remember beside it.
//!
//! A thread writes the timestamps, because a disk may stall for seconds and an abort must not wait
//! for it.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read as _, Write as _};
use std::os::unix::fs::{OpenOptionsExt as _, PermissionsExt as _};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use crate::background::Background;
use crate::signing::{Key, Memory, MemoryError, Signing};

/// Only the owner may read and write.
const OWNER_ONLY: u32 = 0o600;
/// Number of appended bytes after which the timestamp file is rewritten.
const APPEND_LIMIT_BYTES: usize = 64 << 10;
/// How long a caller waits for the disk, once: a working one takes some 0.05 ms, and an abort may
/// be late by 100 ms.
const STORED_WITHIN: Duration = Duration::from_millis(50);
/// The permission bits of group and others.
const GROUP_AND_OTHERS: u32 = 0o077;

/// Why a key file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum KeyFileError {
    /// It cannot be read or written.
    #[error("key file {path}")]
    Io {
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    #[error("key file {path} exists already and is kept; use it, or give another name for a second key")]
    Exists { path: PathBuf },
    /// Other users may read or change it.
    #[error("key file {path}: mode {mode:03o} gives other users access to the key; run `chmod 600 {path}`")]
    Permissions { path: PathBuf, mode: u32 },
    /// It does not contain a key.
    #[error("key file {path}: must be 64 hexadecimal digits, not all 0; `onboard-sim keygen` makes a key")]
    NoKey { path: PathBuf },
    /// The timestamps beside it cannot be parsed. Starting without them would make a replay
    /// possible.
    #[error("timestamp file {path}: {why}; delete it only if nobody can have recorded earlier runs")]
    Memory { path: PathBuf, why: MemoryError },
    /// The disk stalls; the timestamps are written once it continues.
    #[error("timestamp file {path}: the disk stalls")]
    Late { path: PathBuf },
}

/// The timestamps beside a key.
#[derive(Debug)]
pub struct KeyFile {
    stamps_path: PathBuf,
    file: Arc<Mutex<StampFile>>,
    /// Started with the first timestamps.
    writer: Option<Background<(), Result<(), KeyFileError>>>,
}

/// The timestamp file as the writing thread sees it.
#[derive(Debug)]
struct StampFile {
    stamps_path: PathBuf,
    /// Content of the timestamp file up to its last complete line.
    written: Memory,
    /// The timestamp file, once this run has written it, and how many bytes were appended since.
    appending: Option<(File, usize)>,
}

impl KeyFile {
    /// Creates a new file, readable only by its owner, with a random key from the operating system.
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

    /// Creates a new file, readable only by its owner, with this key.
    ///
    /// # Errors
    /// The file exists, or cannot be written.
    pub fn create_with(path: &Path, key: &Key) -> Result<(), KeyFileError> {
        let failed = |source| KeyFileError::Io { path: path.to_owned(), source };
        let opened = OpenOptions::new().write(true).create_new(true).mode(OWNER_ONLY).open(path);
        let mut file = opened.map_err(|source| match source.kind() {
            io::ErrorKind::AlreadyExists => KeyFileError::Exists { path: path.to_owned() },
            _ => failed(source),
        })?;
        writeln!(file, "{}", key.to_hex()).and_then(|()| file.sync_all()).map_err(failed)
    }

    /// Reads a key and the timestamps of `user` beside it (`FILE.USER.stamps`). Vehicle and ground
    /// may use one key file on the same machine, with separate timestamps.
    ///
    /// # Errors
    /// The file cannot be read, other users can read it, or it contains no key; or the timestamps
    /// cannot be parsed.
    pub fn open(path: &Path, user: &str) -> Result<(Self, Signing), KeyFileError> {
        let key = Self::read_key(path)?;
        let stamps_path = path.with_added_extension(format!("{user}.stamps"));
        let memory = match fs::read_to_string(&stamps_path) {
            Ok(text) => Memory::from_text(&text)
                .map_err(|why| KeyFileError::Memory { path: stamps_path.clone(), why })?,
            Err(error) if error.kind() == io::ErrorKind::NotFound => Memory::default(),
            Err(source) => return Err(KeyFileError::Io { path: stamps_path, source }),
        };
        let file = StampFile { stamps_path: stamps_path.clone(), written: memory.clone(), appending: None };
        let file = Self { stamps_path, file: Arc::new(Mutex::new(file)), writer: None };
        Ok((file, Signing::new(key, memory)))
    }

    /// Reads a key without timestamps.
    ///
    /// # Errors
    /// The file cannot be read, other users can read it, or it contains no key.
    pub fn read_key(path: &Path) -> Result<Key, KeyFileError> {
        let failed = |source| KeyFileError::Io { path: path.to_owned(), source };
        let mut file = File::open(path).map_err(failed)?;
        let mode = file.metadata().map_err(failed)?.permissions().mode() & 0o777;
        if mode & GROUP_AND_OTHERS != 0 {
            return Err(KeyFileError::Permissions { path: path.to_owned(), mode });
        }
        let no_key = || KeyFileError::NoKey { path: path.to_owned() };
        let mut text = String::new();
        file.read_to_string(&mut text).map_err(|error| match error.kind() {
            io::ErrorKind::InvalidData => no_key(),
            _ => failed(error),
        })?;
        let is_drawn = |key: &Key| key.secret() != &[0; Key::LEN];
        Key::from_hex(text.trim_end()).filter(is_drawn).ok_or_else(no_key)
    }

    /// Stores timestamps, so that they survive this process however it ends. It is cheap enough to
    /// be called before every accepted frame is acted on: it writes a line of some thirty bytes for
    /// each stream. It waits 50 ms for the disk at most, and not at all while the disk still writes
    /// what came before.
    ///
    /// # Errors
    /// The file cannot be written, or the disk stalls.
    pub fn remember(&mut self, memory: &Memory) -> Result<(), KeyFileError> {
        if self.writer.is_none() {
            let failed = |source| KeyFileError::Io { path: self.stamps_path.clone(), source };
            self.writer = Some(Background::start("timestamps").map_err(failed)?);
        }
        let Some(writer) = &self.writer else { return Ok(()) };
        let had_stalled = !writer.wait(Duration::ZERO);
        let (file, memory) = (Arc::clone(&self.file), memory.clone());
        writer.queue((), move || file.lock().unwrap_or_else(PoisonError::into_inner).remember(&memory));
        if had_stalled || !writer.wait(STORED_WITHIN) {
            return Err(KeyFileError::Late { path: self.stamps_path.clone() });
        }
        std::iter::from_fn(|| writer.outcome()).last().unwrap_or(Ok(()))
    }
}

impl StampFile {
    fn remember(&mut self, memory: &Memory) -> Result<(), KeyFileError> {
        let lines = memory.lines_since(&self.written);
        if lines.is_empty() {
            return Ok(());
        }
        // One write call: if the process is killed, the file contains all of it or nothing.
        if let Some((file, appended)) = &mut self.appending
            && *appended < APPEND_LIMIT_BYTES
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

    /// Writes a new file and then renames it, so that it is complete or absent. A file to which
    /// appending failed is replaced as well: its last line may have been cut off.
    fn write_anew(&self, memory: &Memory) -> Result<File, KeyFileError> {
        let beside = self.stamps_path.with_added_extension("new");
        let write = || {
            let mut file =
                OpenOptions::new().write(true).create(true).truncate(true).mode(OWNER_ONLY).open(&beside)?;
            file.write_all(memory.to_text().as_bytes())?;
            // A power cut after the rename must not leave an empty file.
            file.sync_data()?;
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
    fn a_new_key_is_readable_by_its_owner_only_and_overwrites_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("flight.key");
        KeyFile::create(&path).unwrap();
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
        let text = fs::read_to_string(&path).unwrap();
        assert!(Key::from_hex(text.trim_end()).is_some());
        assert!(matches!(KeyFile::create(&path), Err(KeyFileError::Exists { .. })));
        assert_eq!(fs::read_to_string(&path).unwrap(), text);
        for mode in [0o640, 0o604, 0o620, 0o602, 0o610] {
            fs::set_permissions(&path, fs::Permissions::from_mode(mode)).unwrap();
            let error = KeyFile::open(&path, "ground").unwrap_err().to_string();
            assert!(error.contains("chmod 600") && error.contains("flight.key"), "{error}");
        }
    }

    #[test]
    fn a_file_without_a_key_is_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bad.key");
        for content in [&b""[..], b"hello", &[0xFF; 64]] {
            let mut file = OpenOptions::new()
                .write(true)
                .create(true)
                .truncate(true)
                .mode(OWNER_ONLY)
                .open(&path)
                .unwrap();
            file.write_all(content).unwrap();
            let error = KeyFile::open(&path, "ground").unwrap_err();
            assert!(matches!(error, KeyFileError::NoKey { .. }), "{error}");
        }
        assert!(KeyFile::open(&folder.path().join("none"), "ground").is_err());
    }

    /// Stores the timestamps, however busy the machine is.
    fn remember(file: &mut KeyFile, signing: &Signing) {
        let stored = file.remember(&signing.memory());
        assert!(matches!(stored, Ok(()) | Err(KeyFileError::Late { .. })), "{stored:?}");
        assert!(file.writer.as_ref().unwrap().wait(Duration::from_mins(1)));
    }

    #[test]
    fn timestamps_survive_a_restart() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("flight.key");
        KeyFile::create(&path).unwrap();
        let (mut file, mut signing) = KeyFile::open(&path, "vehicle").unwrap();
        let beat = Encoder::new(GROUND).encode(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
        let signed = signing.sign(&beat, 0, 1_000);
        signing.check(&signed, 1_000).unwrap();
        remember(&mut file, &signing);
        let (_, mut restarted) = KeyFile::open(&path, "vehicle").unwrap();
        assert!(restarted.check(&signed, 0).is_err(), "the frame was accepted again after the restart");
        fs::write(folder.path().join("flight.key.vehicle.stamps"), "nonsense").unwrap();
        let error = KeyFile::open(&path, "vehicle").unwrap_err().to_string();
        assert!(error.contains("flight.key.vehicle.stamps") && error.contains("nonsense"), "{error}");
    }

    /// A power cut leaves such a file if it was just written.
    #[test]
    fn an_empty_timestamp_file_is_refused() {
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

    /// A killed process cannot store anything at its end, so everything must be in the file before.
    #[test]
    fn every_stored_timestamp_survives_a_kill() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("flight.key");
        KeyFile::create(&path).unwrap();
        let (_, mut vehicle) = KeyFile::open(&path, "vehicle").unwrap();
        let mut encoder = Encoder::new(GROUND);
        let mut beat = || encoder.encode(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
        let (mut file, mut ground) = KeyFile::open(&path, "ground").unwrap();
        // There are more frames than are appended before a rewrite.
        let mut longest = 0;
        for number in 0..5_000 {
            let signed = vehicle.sign(&beat(), 0, 1_000 + 300 * number);
            ground.check(&signed, 1_000 + 300 * number).unwrap();
            remember(&mut file, &ground);
            longest =
                longest.max(fs::metadata(folder.path().join("flight.key.ground.stamps")).unwrap().len());
            if number % 500 == 0 {
                let (_, mut restarted) = KeyFile::open(&path, "ground").unwrap();
                let again = restarted.check(&signed, 1_000);
                assert_eq!(again, Err(crate::signing::Rejection::Replayed), "frame {number}");
                restarted.check(&vehicle.sign(&beat(), 0, 0), 1_000).unwrap();
            }
        }
        assert!(longest < 2 * APPEND_LIMIT_BYTES as u64, "{longest} bytes");
    }

    /// The new file is a pipe: opening it takes until somebody reads. A caller that waited each
    /// time would take five seconds.
    #[test]
    fn a_stalling_disk_is_reported_and_not_waited_for() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("flight.key");
        KeyFile::create(&path).unwrap();
        let pipe = folder.path().join("flight.key.ground.stamps.new");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let (mut file, mut signing) = KeyFile::open(&path, "ground").unwrap();
        let beat = Encoder::new(GROUND).encode(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
        let _ = signing.sign(&beat, 0, 1_000);
        // The first call waits in vain: what it was given is not stored.
        for _ in 0..1_000 {
            let late = file.remember(&signing.memory()).unwrap_err();
            assert!(matches!(late, KeyFileError::Late { .. }), "{late}");
        }
        // It continues; the pipe cannot be synced, and then a file takes its place.
        let mut disk = File::open(&pipe).unwrap();
        fs::remove_file(&pipe).unwrap();
        disk.read_to_end(&mut Vec::new()).unwrap();
        drop(file);
        let stored = fs::read_to_string(folder.path().join("flight.key.ground.stamps")).unwrap();
        assert_eq!(stored, signing.memory().to_text());
    }

    #[test]
    fn the_key_of_a_passphrase_is_its_sha_256() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("flight.key");
        KeyFile::create_with(&path, &Key::from_passphrase("abc")).unwrap();
        // FIPS 180-2, appendix B.1.
        let digest = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(fs::read_to_string(&path).unwrap().trim_end(), digest);
    }
}

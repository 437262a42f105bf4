//! Keeps finished flights in a file, so that a run that was stopped can be continued.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufRead as _, BufReader, Read as _, Write as _};
use std::path::Path;

use protocol::log::build::build_info;
use serde::{Deserialize, Serialize};

use super::{Found, Outcome};

/// The outcomes known so far, by what was flown and by which build.
#[derive(Debug, Default)]
pub struct GateState {
    known: BTreeMap<String, Outcome>,
    file: Option<File>,
}

/// A line of the file.
#[derive(Serialize, Deserialize)]
struct Line {
    key: String,
    outcome: Outcome,
}

/// How every line begins that is not empty.
const LINE_BEGINS: &str = "{\"key\":";

impl GateState {
    /// A state in memory only.
    pub fn in_memory() -> Self {
        Self::default()
    }

    /// A state in a file, continued if the file exists. What another build or another content left there is not used.
    ///
    /// # Errors
    /// The file cannot be read or written, or holds something else; then it is left as it is.
    pub fn open(path: &Path) -> io::Result<Self> {
        let mut file = File::options().read(true).append(true).create(true).open(path)?;
        let mut known = BTreeMap::new();
        for line in BufReader::new(file.try_clone()?).lines() {
            let line = line?;
            // The last line of a killed run may be incomplete; its flight is then flown again.
            if let Ok(Line { key, outcome }) = serde_json::from_str(&line) {
                known.insert(key, outcome);
            } else if !(line.starts_with(LINE_BEGINS) || LINE_BEGINS.starts_with(&line)) {
                let words = "holds something else than the state of a gate; give another file";
                return Err(io::Error::new(io::ErrorKind::InvalidData, words));
            }
        }
        // An incomplete line must not be joined with the next one.
        writeln!(file)?;
        Ok(Self { known, file: Some(file) })
    }

    /// The outcome of this key, if it is known.
    pub(super) fn outcome(&self, key: &str) -> Option<&Outcome> {
        self.known.get(key)
    }

    pub(super) fn note(&mut self, key: String, outcome: Outcome) -> io::Result<()> {
        let line = Line { key, outcome };
        if let Some(file) = &mut self.file {
            writeln!(file, "{}", serde_json::to_string(&line)?)?;
        }
        self.known.insert(line.key, line.outcome);
        Ok(())
    }
}

/// Identifies a flight, its content and this build.
pub(super) fn key(found: &Found) -> io::Result<String> {
    let mut digest = FNV_START;
    let files: &[&str] = if found.number.is_some() {
        &["manifest.json", "mission.toml", "dispersion.toml", "flights.csv"]
    } else {
        &[""]
    };
    for name in files {
        let path = if name.is_empty() { found.path.clone() } else { found.path.join(name) };
        digest = fnv(digest, &mut File::open(path)?)?;
    }
    let build = build_info()
        .into_iter()
        .fold(FNV_START, |digest, (fact, value)| fact.bytes().chain(value.bytes()).fold(digest, fnv_byte));
    Ok(format!("{} {digest:016x} {build:016x}", found.name))
}

/// Names a flight by its content.
pub(super) fn name_of<'a>(parts: impl IntoIterator<Item = &'a [u8]>) -> String {
    let digest = parts.into_iter().flatten().copied().fold(FNV_START, fnv_byte);
    format!("{digest:016x}")
}

const FNV_START: u64 = 0xcbf2_9ce4_8422_2325;

/// FNV-1a, 64 bits: tells files apart, but does not protect against forgery.
fn fnv(mut digest: u64, input: &mut File) -> io::Result<u64> {
    let mut buffer = vec![0; 1 << 16];
    loop {
        let count = input.read(&mut buffer)?;
        if count == 0 {
            return Ok(digest);
        }
        digest = buffer[..count].iter().copied().fold(digest, fnv_byte);
    }
}

fn fnv_byte(digest: u64, byte: u8) -> u64 {
    (digest ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
}

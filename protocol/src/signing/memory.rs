//! The timestamps that must survive a restart, as lines of text to which further lines may be appended.

use alloc::borrow::ToOwned as _;
use alloc::collections::BTreeMap;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use super::timestamp::{MAX_STAMP, STAMPS_PER_S};
use crate::identity::Address;

/// Stored timestamps are this far ahead of the ones in use, so that no timestamp is used twice after a restart.
pub(super) const LEAD: u64 = 5 * STAMPS_PER_S;
/// At most this many streams of one key are remembered. Only holders of the key can begin one.
pub(super) const MAX_STREAMS: usize = 64;
/// The shared key and fifteen operators'.
const MAX_KEYS: usize = 16;

/// Why remembered timestamps cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MemoryError {
    /// A line cannot be parsed.
    #[error("`{0}` is neither `ours STAMP`, `clock STAMP` nor `heard SYSTEM COMPONENT LINK STAMP`")]
    Line(String),
    /// The timestamp of the last frame that was sent is missing.
    #[error("the line `ours STAMP` is missing, so recorded frames could be replayed")]
    NoOwnStamp,
}

/// The timestamps that must survive a restart: our own, our clock's, and those of each stream that was heard.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Memory {
    /// The last timestamp that was used for signing, plus a margin: see [`super::Signing::memory`].
    pub(super) ours: u64,
    /// The latest time that our own clock has shown.
    pub(super) clock: u64,
    pub(super) streams: BTreeMap<(Address, u8), u64>,
}

impl Memory {
    pub fn to_text(&self) -> String {
        [self.own_lines()].into_iter().chain(self.streams.iter().map(heard)).collect()
    }

    /// Returns the lines that update `other`, an older memory, to this one. While the margin of the own timestamps is
    /// at least half left, they are not written again.
    pub fn lines_since(&self, other: &Self) -> String {
        let news = self.streams.iter().filter(|(stream, stamp)| other.streams.get(stream) != Some(stamp));
        let own = (self.ours > other.ours + LEAD / 2).then(|| self.own_lines());
        news.map(heard).chain(own).collect()
    }

    fn own_lines(&self) -> String {
        format!("ours {}\nclock {}\n", self.ours, self.clock)
    }

    /// Notes that what [`Memory::lines_since`] returned was written, so that it is not written again.
    pub fn catch_up(&mut self, with: &Self) {
        if with.ours > self.ours + LEAD / 2 {
            (self.ours, self.clock) = (with.ours, with.clock);
        }
        self.streams.clone_from(&with.streams);
    }

    /// Parses the lines of a timestamp file; later lines override earlier ones. An incomplete last line was cut off
    /// while it was written. Its frame was not acted on, so the line is ignored.
    ///
    /// # Errors
    /// A line cannot be parsed, or the own timestamp is missing.
    pub fn from_text(text: &str) -> Result<Self, MemoryError> {
        let mut memory = Self::default();
        let mut has_ours = false;
        for line in text.split_inclusive('\n') {
            match line.strip_suffix('\n') {
                Some(line) => {
                    memory.read_line(line).ok_or_else(|| MemoryError::Line(line.to_owned()))?;
                    has_ours |= line.starts_with("ours ");
                }
                None if has_ours => {}
                None => return Err(MemoryError::Line(line.to_owned())),
            }
        }
        if has_ours { Ok(memory) } else { Err(MemoryError::NoOwnStamp) }
    }

    fn read_line(&mut self, line: &str) -> Option<()> {
        let words: Vec<&str> = line.split(' ').collect();
        let stamp = |word: &str| word.parse().ok().filter(|stamp| *stamp <= MAX_STAMP);
        match words[..] {
            ["ours", ours] => self.ours = stamp(ours)?,
            ["clock", clock] => self.clock = stamp(clock)?,
            ["heard", system, component, link, heard] => {
                let [system_id, component_id, link_id] =
                    [system.parse().ok()?, component.parse().ok()?, link.parse().ok()?];
                let stream = (Address { system_id, component_id }, link_id);
                if self.streams.len() >= MAX_KEYS * MAX_STREAMS && !self.streams.contains_key(&stream) {
                    return None;
                }
                self.streams.insert(stream, stamp(heard)?);
            }
            _ => return None,
        }
        Some(())
    }
}

fn heard((stream, stamp): (&(Address, u8), &u64)) -> String {
    let (Address { system_id, component_id }, link_id) = stream;
    format!("heard {system_id} {component_id} {link_id} {stamp}\n")
}

//! What must outlive a restart: the last timestamps, as lines of text to which further lines may be appended.

use std::collections::BTreeMap;

use super::{LEAD, MAX_STAMP, MAX_STREAMS};
use crate::identity::Address;

/// Why remembered timestamps are of no use.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum MemoryError {
    /// A line makes no sense.
    #[error("`{0}` is neither `ours STAMP`, `clock STAMP` nor `heard SYSTEM COMPONENT LINK STAMP`")]
    Line(String),
    /// There is not even the timestamp of what was sent last.
    #[error("it does not say what was sent last (`ours STAMP`): what was heard before could be replayed")]
    Nothing,
}

/// What must outlive a restart: the last timestamps.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Memory {
    /// What was signed last, and ahead of it: see [`super::Signing::memory`].
    pub(super) ours: u64,
    /// The latest time that our own clock showed.
    pub(super) clock: u64,
    pub(super) streams: BTreeMap<(Address, u8), u64>,
}

impl Memory {
    /// As lines of text.
    pub fn to_text(&self) -> String {
        [self.own_lines()].into_iter().chain(self.streams.iter().map(heard)).collect()
    }

    /// The lines that bring another memory, which is not newer, up to this one. Nothing while the timestamps of what is
    /// sent are covered for half of their lead.
    pub fn lines_since(&self, other: &Self) -> String {
        let news = self.streams.iter().filter(|(stream, stamp)| other.streams.get(stream) != Some(stamp));
        let own = (self.ours > other.ours + LEAD / 2).then(|| self.own_lines());
        news.map(heard).chain(own).collect()
    }

    fn own_lines(&self) -> String {
        format!("ours {}\nclock {}\n", self.ours, self.clock)
    }

    /// Takes over what [`Memory::lines_since`] wrote down, so that it is not written again.
    pub fn catch_up(&mut self, with: &Self) {
        if with.ours > self.ours + LEAD / 2 {
            (self.ours, self.clock) = (with.ours, with.clock);
        }
        self.streams.clone_from(&with.streams);
    }

    /// Reads those lines; later ones count. A last line without its end was cut off while it was written, and what it
    /// was to remember was not acted on.
    ///
    /// # Errors
    /// A line makes no sense, or there is none.
    pub fn from_text(text: &str) -> Result<Self, MemoryError> {
        let mut memory = Self::default();
        let mut knows_ours = false;
        for line in text.split_inclusive('\n') {
            match line.strip_suffix('\n') {
                Some(line) => {
                    memory.read_line(line).ok_or_else(|| MemoryError::Line(line.to_owned()))?;
                    knows_ours |= line.starts_with("ours ");
                }
                None if knows_ours => {}
                None => return Err(MemoryError::Line(line.to_owned())),
            }
        }
        if knows_ours { Ok(memory) } else { Err(MemoryError::Nothing) }
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
                if self.streams.len() >= MAX_STREAMS && !self.streams.contains_key(&stream) {
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

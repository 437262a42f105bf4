//! The end of the station's book, and how much of it the vehicle keeps.

use std::time::Duration;

use protocol::book::{SignedHead, shown};

/// The end of the book, as the station last signed it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct BookState {
    /// `None` before the first signature, and without a book.
    pub head: Option<SignedHead>,
    /// Whether the station has a key to sign with.
    pub is_signed: bool,
    /// How many entries the vehicle has confirmed to keep the end of.
    pub kept: u32,
    /// When the end was last sent to the vehicle.
    pub(crate) sent_at: Option<Duration>,
}

impl BookState {
    /// The number of entries and the beginning of the head, as `replay audit --head` takes it.
    pub fn short(&self) -> Option<String> {
        let head = self.head?.head;
        Some(format!("{}:{}", head.entries, shown(&head.hash)))
    }
}

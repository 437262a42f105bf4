//! Writes the station's book into its log, and signs its end.

use std::time::Duration;

use protocol::book::{Book, BookKey, CLOSED, Head, Line, OPENED, SignedHead};
use protocol::log::record::Record;

use crate::model::action::BookLine;

/// How often the end is signed at most.
const SIGNED_EVERY: Duration = Duration::from_secs(2);

/// The book of this run.
pub(super) struct StationBook {
    book: Book,
    key: Option<BookKey>,
    /// The last signed end, and when it was signed.
    signed: Option<(Head, Duration)>,
}

impl StationBook {
    /// Opens a book. `about` says who writes it. Returns the book and its first record.
    pub(super) fn open(key: Option<BookKey>, about: &str, unix_ns: u64) -> (Self, Record) {
        let key_words = match &key {
            Some(key) => format!("signed with the key of public key {}", key.public()),
            None => "not signed: the station has no key".to_owned(),
        };
        let mut book = Self { book: Book::default(), key, signed: None };
        let text = format!("{about}; {key_words}");
        let record = book.enter_line(&Line { unix_ns, kind: OPENED, who: "", text: &text });
        (book, record)
    }

    pub(super) fn enter(&mut self, line: &BookLine, unix_ns: u64) -> Record {
        self.enter_line(&Line { unix_ns, kind: &line.kind, who: &line.who, text: &line.text })
    }

    fn enter_line(&mut self, line: &Line) -> Record {
        Record::BookEntry(self.book.enter(line))
    }

    /// Enters that the run ends.
    pub(super) fn close(&mut self, unix_ns: u64) -> Record {
        self.enter_line(&Line { unix_ns, kind: CLOSED, who: "", text: "the station ends" })
    }

    /// Signs the end if it has changed and the last signature is old enough. Returns it with its record.
    pub(super) fn sign_if_due(&mut self, now: Duration) -> Option<(SignedHead, Record)> {
        let waits = |at: &Duration| now.saturating_sub(*at) < SIGNED_EVERY;
        if self.signed.as_ref().is_some_and(|(_, at)| waits(at)) {
            return None;
        }
        self.sign(now)
    }

    /// Signs the end if it has changed.
    pub(super) fn sign(&mut self, now: Duration) -> Option<(SignedHead, Record)> {
        let head = self.book.head()?;
        if self.signed.is_some_and(|(signed, _)| signed == head) {
            return None;
        }
        self.signed = Some((head, now));
        let signed = match &self.key {
            Some(key) => key.sign(head),
            None => SignedHead { head, signature: [0; 64] },
        };
        let record = Record::BookHead(signed.record(self.key.as_ref().map(BookKey::public)));
        Some((signed, record))
    }

    pub(super) fn is_signed(&self) -> bool {
        self.key.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::signing::Key;

    #[test]
    fn the_end_is_signed_only_when_it_has_changed_and_not_too_often() {
        let key = BookKey::of(&Key::new([3; 32]));
        let (mut book, first) = StationBook::open(Some(key.clone()), "station 255/190", 1);
        assert!(matches!(&first, Record::BookEntry(entry) if entry.text.contains(&key.public().to_string())));
        let (signed, _) = book.sign_if_due(Duration::ZERO).unwrap();
        assert!(key.public().signed(&signed) && signed.head.entries == 1);
        assert!(book.sign_if_due(Duration::from_secs(9)).is_none());
        let line = BookLine { kind: "key".to_owned(), who: "Ann".to_owned(), text: "A".to_owned() };
        book.enter(&line, 2);
        assert!(book.sign_if_due(Duration::from_secs(1)).is_none(), "too soon");
        let (signed, _) = book.sign_if_due(Duration::from_secs(10)).unwrap();
        assert_eq!(signed.head.entries, 2);
        book.close(3);
        assert!(book.sign(Duration::from_secs(10)).is_some(), "the last one is signed at once");
    }
}

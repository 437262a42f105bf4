//! The books of ground stations: proven, or what is broken is named.

use std::path::{Path, PathBuf};

use protocol::book::{Book, BookKey, CLOSED, Line, OPENED, SignedHead};
use protocol::dialect::MavMessage;
use protocol::frame::Encoder;
use protocol::identity::{GROUND, VEHICLE};
use protocol::log::record::{Direction, RawFrame, Record};
use protocol::log::v1::{BookEntry, BookHead};
use protocol::log::writer::{LogHeader, LogWriter};
use protocol::signing::Key;
use replay::verify::book::{AuditFound, audit_logs};

/// Entries of a station's book, and the heads that it reported to the vehicle.
struct Day {
    entries: Vec<BookEntry>,
    heads: Vec<BookHead>,
    reported: Vec<SignedHead>,
    key: BookKey,
}

fn day(arms: &str, secret: u8) -> Day {
    let key = BookKey::of(&Key::new([secret; 32]));
    let mut book = Book::default();
    let opened = format!("station 255/190; public key {}", key.public());
    let lines = [
        (OPENED, "", opened.as_str()),
        ("signed", "Ann", "step 1"),
        ("commanded", arms, "ARM"),
        ("acknowledged", arms, "ARM accepted"),
        (CLOSED, "", "the station ends"),
    ];
    let (mut entries, mut heads, mut reported) = (Vec::new(), Vec::new(), Vec::new());
    for (place, (kind, who, text)) in lines.into_iter().enumerate() {
        entries.push(book.enter(&Line { unix_ns: place as u64, kind, who, text }));
        let signed = key.sign(book.head().expect("an entry"));
        heads.push(signed.record());
        reported.push(signed);
    }
    Day { entries, heads, reported, key }
}

fn written(path: &Path, records: impl IntoIterator<Item = Record>) -> PathBuf {
    let mut writer =
        LogWriter::new(std::fs::File::create_new(path).expect("a new file"), &LogHeader::default())
            .expect("a log");
    for (place, record) in records.into_iter().enumerate() {
        writer.write(&record, place as u64).expect("a record");
    }
    writer.finish().expect("a record");
    path.to_owned()
}

fn ground_log(path: &Path, day: &Day) -> PathBuf {
    let entries = day.entries.iter().cloned().map(Record::BookEntry);
    written(path, entries.chain(day.heads.iter().cloned().map(Record::BookHead)))
}

fn vehicle_log(path: &Path, reported: &[SignedHead]) -> PathBuf {
    let mut encoder = Encoder::new(GROUND);
    let frames = reported.iter().map(|head| {
        let frame = encoder.encode(&MavMessage::TD_BOOK_HEAD(head.message(VEHICLE)));
        let link = "udpin:0.0.0.0:14550".to_owned();
        let bytes = frame.for_log().expect("a record");
        Record::RawFrame(RawFrame { direction: Direction::Rx, endpoint: "vehicle", link, bytes })
    });
    written(path, frames.collect::<Vec<_>>())
}

fn audited(logs: &[&PathBuf]) -> AuditFound {
    audit_logs(logs, None).expect("logs")
}

#[test]
fn a_complete_book_is_proven_and_printed_in_order() {
    let folder = tempfile::tempdir().unwrap();
    let day = day("Bob", 1);
    let ground = ground_log(&folder.path().join("g.mcap"), &day);
    let vehicle = vehicle_log(&folder.path().join("v.mcap"), &day.reported[..4]);
    let found = audited(&[&ground, &vehicle]);
    let book = &found.books[0];
    assert!(found.is_proven(), "{found:?}");
    assert_eq!((book.entries, book.signed, book.witnessed, book.closed), (5, 5, 4, true));
    assert_eq!(book.story[2], "00:00:00 commanded: ARM (Bob)");
    assert!(audited(&[&ground]).is_proven(), "closed, and signed to its end");
    let found = audit_logs(&[&ground], Some(day.key.public())).unwrap();
    assert!(found.is_proven() && found.books[0].key_is_trusted, "{found:?}");
}

#[test]
fn an_edited_and_a_forged_book_are_not_proven() {
    let folder = tempfile::tempdir().unwrap();
    let truth = day("Bob", 1);
    let vehicle = vehicle_log(&folder.path().join("v.mcap"), &truth.reported);
    let mut edited = day("Bob", 1);
    "Eve".clone_into(&mut edited.entries[2].who);
    let log = ground_log(&folder.path().join("edited.mcap"), &edited);
    let found = audited(&[&log]);
    assert!(!found.is_proven());
    assert!(found.books[0].broken.as_ref().unwrap().contains("from 2 to 2 was changed"), "{found:?}");
    // Signed again with another key: its first entry differs, and the vehicle's book is missing.
    let log = ground_log(&folder.path().join("forged.mcap"), &day("Eve", 2));
    let found = audited(&[&log, &vehicle]);
    assert!(!found.is_proven() && found.missing.len() == 1, "{found:?}");
    assert!(!audit_logs(&[&log], Some(truth.key.public())).unwrap().is_proven());
}

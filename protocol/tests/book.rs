//! The book: whatever is done to it afterwards is found.

use proptest::prelude::*;
use protocol::book::{
    Audit, Book, BookKey, Broken, CLOSED, Head, Line, OPENED, PublicKey, RecordedHead, SignedHead, audit,
};
use protocol::log::v1::BookEntry;
use protocol::signing::Key;

fn key(byte: u8) -> BookKey {
    BookKey::of(&Key::new([byte; 32]))
}

struct Written {
    entries: Vec<BookEntry>,
    /// After every third entry; in the log, and in that of the vehicle.
    station: Vec<RecordedHead>,
    vehicle: Vec<RecordedHead>,
}

fn book(texts: &[String], key: &BookKey) -> Written {
    let mut book = Book::default();
    let opened = format!("station 255/190, public key {}", key.public());
    let lines = texts.iter().map(|text| ("commanded", "Ann", text.as_str()));
    let lines = [(OPENED, "", opened.as_str())].into_iter().chain(lines).chain([(CLOSED, "", "ended")]);
    let mut written = Written { entries: Vec::new(), station: Vec::new(), vehicle: Vec::new() };
    for (place, (kind, who, text)) in lines.enumerate() {
        written.entries.push(book.enter(&Line { unix_ns: 1_000 + place as u64, kind, who, text }));
        let signed = key.sign(book.head().expect("an entry"));
        if place % 3 == 0 || kind == CLOSED {
            written.station.push(RecordedHead { from: "the log".to_owned(), by_vehicle: false, signed });
            written.vehicle.push(RecordedHead { from: "the vehicle".to_owned(), by_vehicle: true, signed });
        }
    }
    written
}

fn check(written: &Written, trusted: Option<PublicKey>) -> Audit {
    audit(&written.entries, &[&written.station[..], &written.vehicle].concat(), trusted)
}

fn texts() -> impl Strategy<Value = Vec<String>> {
    prop::collection::vec(".{0,20}", 1..12)
}

proptest! {
    #[test]
    fn an_untouched_book_is_proven_to_its_end(texts in texts()) {
        let written = book(&texts, &key(1));
        let found = check(&written, Some(key(1).public()));
        let entries = written.entries.len() as u32;
        prop_assert_eq!(found.broken, None);
        prop_assert_eq!((found.signed, found.witnessed, found.closed), (entries, entries, true));
    }

    /// The entries that are named are those since the last hash that fits.
    #[test]
    fn an_edit_of_any_field_is_found(texts in texts(), at in any::<prop::sample::Index>(), field in 0..4_u8) {
        let mut written = book(&texts, &key(1));
        let number = at.index(written.entries.len());
        let entry = &mut written.entries[number];
        match field {
            0 => entry.text.push('x'),
            1 => entry.who.push('x'),
            2 => entry.kind.push('x'),
            _ => entry.unix_ns += 1,
        }
        // The key in the first entry may have been changed.
        let found = check(&written, Some(key(1).public()));
        let named = match found.broken {
            Some(Broken::Changed { first, last, .. }) => (first..=last).contains(&(number as u32)),
            Some(Broken::NoBeginning | Broken::OtherKey { .. }) => number == 0,
            _ => false,
        };
        prop_assert!(named, "{:?}", found.broken);
        prop_assert!((found.signed as usize) <= number && (found.witnessed as usize) <= number);
    }

    #[test]
    fn an_entry_that_was_taken_out_is_named(texts in texts(), at in any::<prop::sample::Index>()) {
        let mut written = book(&texts, &key(1));
        let number = at.index(written.entries.len() - 1);
        written.entries.remove(number);
        let expected = if number == 0 {
            Broken::NoBeginning
        } else {
            Broken::Missing { number: number as u32, found: number as u32 + 1 }
        };
        prop_assert_eq!(check(&written, None).broken, Some(expected));
    }

    /// Somebody changes an entry and computes every hash again.
    #[test]
    fn another_book_fits_no_hash_that_was_signed(texts in texts(), at in any::<prop::sample::Index>()) {
        let written = book(&texts, &key(1));
        let mut forged_texts = texts.clone();
        forged_texts[at.index(texts.len())].push('x');
        // With the hashes that were signed; signed again with another key, and the vehicle knows
        // better; without the vehicle, and the auditor has the key.
        let kept = Written { entries: book(&forged_texts, &key(1)).entries, ..book(&texts, &key(1)) };
        let is_changed = matches!(check(&kept, None).broken, Some(Broken::Changed { .. }));
        prop_assert!(is_changed);
        let other = Written { vehicle: written.vehicle, ..book(&forged_texts, &key(2)) };
        prop_assert!(check(&other, None).broken.is_some());
        let alone = Written { vehicle: Vec::new(), ..other };
        let found = check(&alone, Some(key(1).public()));
        let is_another = matches!(found.broken, Some(Broken::OtherKey { .. }));
        prop_assert!(is_another, "{:?}", found.broken);
    }

    #[test]
    fn a_cut_book_is_detected_from_the_heads_in_the_vehicle_log(texts in texts(), left in any::<prop::sample::Index>()) {
        let mut written = book(&texts, &key(1));
        let whole = written.entries.len() as u32;
        let left = 1 + left.index(written.entries.len() - 1) as u32;
        written.entries.truncate(left as usize);
        written.station.retain(|head| head.signed.head.entries <= left);
        let expected = Broken::Cut { entries: left, from: "the vehicle".to_owned(), signed: found_after(left, whole) };
        prop_assert_eq!(check(&written, None).broken, Some(expected));
        // Without the vehicle it only shows that the book was not closed.
        written.vehicle.clear();
        let alone = check(&written, None);
        prop_assert!(alone.broken.is_none() && !alone.closed);
    }

    #[test]
    fn no_records_cause_a_panic(numbers in prop::collection::vec(any::<u32>(), 0..5), byte in any::<u8>()) {
        let entry = |number: &u32| BookEntry { number: *number, kind: OPENED.to_owned(), ..BookEntry::default() };
        let entries: Vec<BookEntry> = numbers.iter().map(entry).collect();
        let heads = numbers.iter().map(|number| {
            let head = Head { book: 0, entries: *number, hash: [byte; 32] };
            let signed = SignedHead { head, signature: [byte; 64] };
            RecordedHead { from: String::new(), by_vehicle: byte % 2 == 0, signed }
        });
        let _ = audit(&entries, &heads.collect::<Vec<_>>(), PublicKey::from_bytes(&[byte; 32]));
    }
}

/// The first hash that the vehicle has after this many entries.
fn found_after(left: u32, whole: u32) -> u32 {
    (left + 1..=whole).find(|entries| (entries - 1) % 3 == 0 || *entries == whole).unwrap_or(whole)
}

#[test]
fn a_key_is_derived_always_the_same_way_and_survives_as_text() {
    let public = key(7).public();
    assert_eq!(PublicKey::from_hex(&public.to_string()), Some(public));
    assert_ne!(public, key(8).public());
    assert_eq!(PublicKey::from_hex("no key"), None);
}

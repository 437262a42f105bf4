//! The book: whatever is done to it afterwards is found.

use proptest::prelude::*;
use protocol::book::{Audit, Book, BookKey, Broken, CLOSED, Known, Line, OPENED, PublicKey, audit};
use protocol::log::v1::{BookEntry, BookHead};
use protocol::signing::Key;

fn key(byte: u8) -> BookKey {
    BookKey::of(&Key::new([byte; 32]))
}

struct Written {
    entries: Vec<BookEntry>,
    heads: Vec<BookHead>,
    /// What a vehicle was told, after every third entry.
    told: Vec<Known>,
}

fn book(texts: &[String], key: &BookKey) -> Written {
    let mut book = Book::default();
    let opened = format!("station 255/190, public key {}", key.public());
    let lines = texts.iter().map(|text| ("commanded", "Ann", text.as_str()));
    let lines = [(OPENED, "", opened.as_str())].into_iter().chain(lines).chain([(CLOSED, "", "ended")]);
    let mut written = Written { entries: Vec::new(), heads: Vec::new(), told: Vec::new() };
    for (place, (kind, who, text)) in lines.enumerate() {
        written.entries.push(book.enter(&Line { unix_ns: 1_000 + place as u64, kind, who, text }));
        let head = key.sign(book.head().expect("an entry"));
        if place % 3 == 0 || kind == CLOSED {
            written.heads.push(head.record(Some(key.public())));
            written.told.push(Known { from: "the vehicle".to_owned(), signed: head });
        }
    }
    written
}

fn check(written: &Written, pinned: Option<PublicKey>) -> Audit {
    audit(&written.entries, &written.heads, &written.told, pinned)
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
        prop_assert_eq!(&found.broken, &[]);
        prop_assert_eq!((found.proof.signed, found.proof.witnessed, found.proof.closed), (entries, entries, true));
    }

    /// The named entry is the first that was touched.
    #[test]
    fn an_edit_of_any_field_is_found_at_its_entry(texts in texts(), at in any::<prop::sample::Index>(), field in 0..5_u8) {
        let mut written = book(&texts, &key(1));
        let number = at.index(written.entries.len());
        let entry = &mut written.entries[number];
        match field {
            0 => entry.text.push('x'),
            1 => entry.who.push('x'),
            2 => entry.kind.push('x'),
            3 => entry.unix_ns += 1,
            _ => entry.hash[5] ^= 1,
        }
        let expected = match (number, field) {
            (0, 2) => Broken::NoBeginning,
            _ => Broken::Changed { number: number as u32 },
        };
        let found = check(&written, None);
        // A changed first entry may name no key any more; a changed link is told all the same.
        prop_assert!(found.broken.contains(&expected), "{:?}", found.broken);
        prop_assert!((found.proof.signed as usize) <= number && (found.proof.witnessed as usize) <= number);
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
        let found = check(&written, None);
        prop_assert_eq!(found.broken.first(), Some(&expected));
    }

    /// Somebody changes an entry and computes every hash anew, keeping the heads that were signed.
    #[test]
    fn a_recomputed_chain_is_found_by_the_signed_heads(texts in texts(), at in any::<prop::sample::Index>()) {
        let written = book(&texts, &key(1));
        let mut forged_texts = texts.clone();
        forged_texts[at.index(texts.len())].push('x');
        let forged = book(&forged_texts, &key(1)).entries;
        // Without the vehicle.
        let found = audit(&forged, &written.heads, &[], None);
        prop_assert!(matches!(found.broken[..], [Broken::OtherHistory { .. }]), "{:?}", found.broken);
        // Signed again with a key of their own, the old heads thrown away: the vehicle knows better, and so does
        // whoever knows the key.
        let other = book(&forged_texts, &key(2));
        let found = audit(&other.entries, &other.heads, &written.told, None);
        prop_assert!(!found.broken.is_empty());
        let found = audit(&other.entries, &other.heads, &[], Some(key(1).public()));
        prop_assert!(matches!(found.broken[0], Broken::OtherKey { .. }), "{:?}", found.broken);
    }

    #[test]
    fn a_cut_book_is_found_by_what_the_vehicle_knows(texts in texts(), left in any::<prop::sample::Index>()) {
        let mut written = book(&texts, &key(1));
        let whole = written.entries.len() as u32;
        let left = 1 + left.index(written.entries.len() - 1) as u32;
        written.entries.truncate(left as usize);
        written.heads.retain(|head| head.entries <= left);
        let found = check(&written, None);
        let expected = Broken::Cut { entries: left, from: "the vehicle".to_owned(), known: found_after(left, whole) };
        prop_assert_eq!(&found.broken, &[expected]);
        // Without the vehicle it only shows that the book was not closed.
        let alone = audit(&written.entries, &written.heads, &[], None);
        prop_assert!(alone.broken.is_empty() && !alone.proof.closed);
    }

    #[test]
    fn no_records_cause_a_panic(
        numbers in prop::collection::vec(any::<u32>(), 0..5),
        bytes in prop::collection::vec(any::<u8>(), 0..70),
    ) {
        let entries: Vec<BookEntry> = numbers.iter().map(|number| BookEntry {
            number: *number,
            kind: OPENED.to_owned(),
            hash: bytes.clone(),
            previous: bytes.clone(),
            ..BookEntry::default()
        }).collect();
        let heads: Vec<BookHead> = numbers.iter().map(|number| BookHead {
            entries: *number,
            hash: bytes.clone(),
            signature: bytes.clone(),
            public_key: bytes.clone(),
            ..BookHead::default()
        }).collect();
        let _ = audit(&entries, &heads, &[], PublicKey::from_bytes(&bytes));
    }
}

/// The first head that the vehicle was told after this many entries.
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

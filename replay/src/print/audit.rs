//! Prints an audit for people.

use std::io::{self, Write};

use super::shown;
use crate::audit::{AuditFound, BookFound};

/// Writes what is proven of each book, or what is broken.
///
/// # Errors
/// The output failed.
pub fn print_audit(found: &AuditFound, output: &mut impl Write) -> io::Result<()> {
    for book in &found.books {
        print_book(book, output)?;
    }
    for missing in &found.missing {
        writeln!(
            output,
            "MISSING: {}: its log is not among these, or its first entry was changed",
            shown(missing)
        )?;
    }
    if found.books.is_empty() {
        writeln!(output, "no book in these logs: only a ground station of this version writes one")?;
    }
    Ok(())
}

fn print_book(book: &BookFound, output: &mut impl Write) -> io::Result<()> {
    let verdict = if book.is_proven() {
        "PROVEN"
    } else if book.broken.is_empty() {
        "NOT PROVEN TO ITS END"
    } else {
        "BROKEN"
    };
    writeln!(output, "{}: {verdict}: {} entries, head {}", shown(&book.log), book.entries, book.head)?;
    for broken in &book.broken {
        writeln!(output, "  BROKEN: {}", shown(broken))?;
    }
    match &book.public_key {
        Some(key) if book.key_is_trusted => writeln!(output, "  signed with the given key {key}")?,
        Some(key) => writeln!(output, "  signed with {key}; --public-key says that it is the station's")?,
        None => writeln!(output, "  not signed: the station had no key")?,
    }
    writeln!(
        output,
        "  {} entries under a signature, {} known to a vehicle, {}",
        book.signed,
        book.witnessed,
        if book.closed {
            "closed by the station"
        } else {
            "not closed: the station was stopped, or the book was cut"
        }
    )?;
    match &book.damage {
        Some(damage) => writeln!(output, "  the log is damaged: {}", shown(damage)),
        None => Ok(()),
    }
}

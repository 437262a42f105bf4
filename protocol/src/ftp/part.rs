//! What is remembered of an unfinished download, as a text in a file beside the pieces.

use alloc::borrow::ToOwned as _;
use alloc::format;
use alloc::string::String;
use core::fmt::Write as _;

use super::ranges::Ranges;

/// The first line, with the version of the text.
const FIRST_LINE: &str = "touchdown download 1";

/// An unfinished download.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Part {
    /// The path on the vehicle.
    pub path: String,
    pub len: u32,
    /// The checksum of the whole file, if the vehicle has told it.
    pub crc: Option<u32>,
    /// The bytes that are there.
    pub have: Ranges,
}

/// Why a text is no memory of a download.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PartError {
    /// It begins otherwise.
    #[error("the first line is not `{FIRST_LINE}`")]
    FirstLine,
    #[error("no line `{0}`")]
    Missing(&'static str),
    #[error("`{0}` cannot be read")]
    Unreadable(&'static str),
}

impl Part {
    /// The text of it.
    pub fn to_text(&self) -> String {
        let mut text = format!("{FIRST_LINE}\npath {}\nlength {}\n", self.path, self.len);
        if let Some(crc) = self.crc {
            // Writing into a String cannot fail.
            let _ = writeln!(text, "crc {crc:08x}");
        }
        text.push_str("have");
        for range in self.have.iter() {
            let _ = write!(text, " {}-{}", range.start, range.end);
        }
        text.push_str("\nend\n");
        text
    }

    /// Reads such a text. A text that was cut is refused, because its last range may be wrong.
    ///
    /// # Errors
    /// It is none.
    pub fn from_text(text: &str) -> Result<Self, PartError> {
        let mut lines = text.lines();
        if lines.next() != Some(FIRST_LINE) {
            return Err(PartError::FirstLine);
        }
        let mut lines = lines.peekable();
        let path = lines
            .next()
            .and_then(|line| line.strip_prefix("path "))
            .ok_or(PartError::Missing("path"))?
            .to_owned();
        let len: u32 = lines
            .next()
            .and_then(|line| line.strip_prefix("length "))
            .ok_or(PartError::Missing("length"))?
            .parse()
            .map_err(|_number| PartError::Unreadable("length"))?;
        let crc = match lines.peek().and_then(|line| line.strip_prefix("crc ")) {
            None => None,
            Some(crc) => {
                let crc = u32::from_str_radix(crc, 16).map_err(|_number| PartError::Unreadable("crc"))?;
                lines.next();
                Some(crc)
            }
        };
        let listed =
            lines.next().and_then(|line| line.strip_prefix("have")).ok_or(PartError::Missing("have"))?;
        let mut have = Ranges::default();
        for range in listed.split_whitespace() {
            let ends =
                range.split_once('-').and_then(|(from, to)| Some((from.parse().ok()?, to.parse().ok()?)));
            match ends {
                Some((from, to)) if from < to && to <= len => have.add(from..to),
                _ => return Err(PartError::Unreadable("have")),
            };
        }
        if lines.next() != Some("end") {
            return Err(PartError::Missing("end"));
        }
        Ok(Self { path, len, crc, have })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn part(crc: Option<u32>) -> Part {
        let mut have = Ranges::default();
        have.add(0..239);
        have.add(478..1000);
        Part { path: "/log/flight.mcap".to_owned(), len: 1000, crc, have }
    }

    #[test]
    fn a_download_is_remembered_and_a_cut_memory_is_refused() {
        for crc in [None, Some(0x0012_ABCD)] {
            let text = part(crc).to_text();
            assert_eq!(Part::from_text(&text), Ok(part(crc)));
            for cut in 0..text.len() - 1 {
                assert!(Part::from_text(&text[..cut]).is_err(), "{cut}");
            }
        }
        assert_eq!(
            Part::from_text("touchdown download 1\npath /a\nlength 5\nhave 0-6\nend\n"),
            Err(PartError::Unreadable("have"))
        );
    }

    proptest! {
        #[test]
        fn no_text_panics(text in "(touchdown download 1\n)?(path [a-z]*\n)?(length [0-9]{0,12}\n)?(crc [0-9a-g]{0,9}\n)?(have[ 0-9-]{0,30}\n)?.{0,20}") {
            let _ = Part::from_text(&text);
        }
    }
}

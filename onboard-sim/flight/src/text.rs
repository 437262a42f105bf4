//! Texts for the crew in fixed memory: no frame allocates.

use core::fmt::{Arguments, Result, Write};

use arrayvec::ArrayString;

/// A text of at most 256 bytes; the longest of a nominal flight has 74.
pub type Text = ArrayString<256>;

/// Writes the beginning of what does not fit.
struct Cut<'a>(&'a mut Text);

impl Write for Cut<'_> {
    fn write_str(&mut self, part: &str) -> Result {
        self.0.push_str(&part[..part.floor_char_boundary(self.0.remaining_capacity())]);
        Ok(())
    }
}

/// Returns a formatted text, cut off if it is too long.
pub fn formatted(words: Arguments<'_>) -> Text {
    let mut text = Text::new();
    let _ = Cut(&mut text).write_fmt(words);
    text
}

/// `format!` into a [`Text`].
#[macro_export]
macro_rules! text {
    ($($part:tt)*) => { $crate::text::formatted(format_args!($($part)*)) };
}
pub use crate::text;

//! Texts for the crew in fixed memory: no frame allocates.

use core::fmt::{Arguments, Write as _};

/// A text of at most 256 bytes; the longest of a nominal flight has 95.
pub type Text = arrayvec::ArrayString<256>;

/// Returns a formatted text. A part that does not fit is left out.
pub(crate) fn formatted(words: Arguments<'_>) -> Text {
    let mut text = Text::new();
    let _ = text.write_fmt(words);
    text
}

/// `format!` into a [`Text`].
macro_rules! text {
    ($($part:tt)*) => { $crate::text::formatted(format_args!($($part)*)) };
}
pub(crate) use text;

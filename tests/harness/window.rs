//! What a terminal's window shows, and what else the program asked of it.

use std::num::NonZeroU16;

/// A window's cells, and every byte that made them.
pub struct Window {
    parser: vt100::Parser<Asked>,
    bytes: Vec<u8>,
    /// So many of the bytes have become cells.
    shown: usize,
    closed: bool,
}

/// U+FFFD, for what is no character. The parser drops it; every terminal shows it in a cell of its own.
const NO_CHARACTER: &[u8] = "\u{fffd}".as_bytes();
/// Shown in its place.
const SHOWN_FOR_IT: &[u8] = b"?";

/// What a program can ask of a terminal besides cells.
#[derive(Debug, Default)]
struct Asked {
    bells: usize,
    titles: usize,
    clipboard: usize,
    resizes: usize,
}

impl vt100::Callbacks for Asked {
    fn audible_bell(&mut self, _: &mut vt100::Screen) {
        self.bells += 1;
    }

    fn set_window_icon_name(&mut self, _: &mut vt100::Screen, _name: &[u8]) {
        self.titles += 1;
    }

    fn set_window_title(&mut self, _: &mut vt100::Screen, _title: &[u8]) {
        self.titles += 1;
    }

    fn copy_to_clipboard(&mut self, _: &mut vt100::Screen, _kind: &[u8], _data: &[u8]) {
        self.clipboard += 1;
    }

    fn paste_from_clipboard(&mut self, _: &mut vt100::Screen, _kind: &[u8]) {
        self.clipboard += 1;
    }

    fn resize(&mut self, _: &mut vt100::Screen, _size: (u16, u16)) {
        self.resizes += 1;
    }
}

impl Window {
    pub(crate) fn new((columns, rows): (u16, u16)) -> Self {
        let (rows, columns) = cells((columns, rows));
        let parser = vt100::Parser::new_with_callbacks(rows, columns, 0, Asked::default());
        Self { parser, bytes: Vec::new(), shown: 0, closed: false }
    }

    pub(crate) fn take(&mut self, bytes: &[u8]) {
        self.bytes.extend_from_slice(bytes);
        let mut rest = &self.bytes[self.shown..];
        while let Some(at) = rest.windows(NO_CHARACTER.len()).position(|found| found == NO_CHARACTER) {
            self.parser.process(&rest[..at]);
            self.parser.process(SHOWN_FOR_IT);
            rest = &rest[at + NO_CHARACTER.len()..];
        }
        // Its last bytes may be yet to come.
        let begun = (1..NO_CHARACTER.len()).rev().find(|length| rest.ends_with(&NO_CHARACTER[..*length]));
        let (now, later) = rest.split_at(rest.len() - begun.unwrap_or(0));
        self.parser.process(now);
        self.shown = self.bytes.len() - later.len();
    }

    pub(crate) fn resize(&mut self, size: (u16, u16)) {
        let (rows, columns) = cells(size);
        self.parser.set_size(rows, columns);
    }

    pub(crate) fn close(&mut self) {
        self.closed = true;
    }

    /// The rows from the top, without the blanks at their ends.
    pub fn rows(&self) -> Vec<String> {
        let (_, columns) = self.parser.screen().size();
        self.parser.screen().rows(0, columns.get()).map(|row| row.trim_end().to_owned()).collect()
    }

    /// The first row with these words.
    pub fn row_with(&self, words: &str) -> Option<String> {
        self.rows().into_iter().find(|row| row.contains(words))
    }

    /// Whether some row holds these words.
    pub fn shows(&self, words: &str) -> bool {
        self.row_with(words).is_some()
    }

    /// Everything that was ever written to it.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// How often it was to ring.
    pub fn bells(&self) -> usize {
        self.parser.callbacks().bells
    }

    /// How often a title, the clipboard or another size was asked for: what this program never asks for.
    pub fn liberties(&self) -> usize {
        let asked = self.parser.callbacks();
        asked.titles + asked.clipboard + asked.resizes
    }

    /// Whether a program holds the screen: the alternate one, or no cursor.
    pub fn is_taken(&self) -> bool {
        self.parser.screen().alternate_screen() || self.parser.screen().hide_cursor()
    }

    /// Whether a program has asked that what is pasted comes between marks.
    pub fn wants_pastes_marked(&self) -> bool {
        self.parser.screen().bracketed_paste()
    }

    /// Whether the last program on it has ended.
    pub fn is_closed(&self) -> bool {
        self.closed
    }
}

/// Rows and columns. A window of nought cells does not exist.
fn cells((columns, rows): (u16, u16)) -> (NonZeroU16, NonZeroU16) {
    let some = |count| NonZeroU16::new(count).unwrap_or(NonZeroU16::MIN);
    (some(rows), some(columns))
}

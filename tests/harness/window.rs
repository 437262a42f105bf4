//! The content of a terminal's window, and the program's requests to the terminal.

use std::num::NonZeroU16;

/// A window's cells and every byte that was written to it.
pub struct Window {
    parser: vt100::Parser<Requests>,
    bytes: Vec<u8>,
    /// This many of the bytes have been processed.
    shown: usize,
    closed: bool,
}

/// U+FFFD, the replacement character. The parser drops it, but every terminal shows it in a cell.
const REPLACEMENT: &[u8] = "\u{fffd}".as_bytes();
/// What replaces it.
const SHOWN_INSTEAD: &[u8] = b"?";

/// What a program can ask a terminal to do besides showing cells.
#[derive(Debug, Default)]
struct Requests {
    bells: usize,
    titles: usize,
    clipboard: usize,
    resizes: usize,
}

impl vt100::Callbacks for Requests {
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
        let parser = vt100::Parser::new_with_callbacks(rows, columns, 0, Requests::default());
        Self { parser, bytes: Vec::new(), shown: 0, closed: false }
    }

    pub(crate) fn take(&mut self, bytes: &[u8]) {
        self.bytes.extend_from_slice(bytes);
        let mut rest = &self.bytes[self.shown..];
        while let Some(at) = rest.windows(REPLACEMENT.len()).position(|found| found == REPLACEMENT) {
            self.parser.process(&rest[..at]);
            self.parser.process(SHOWN_INSTEAD);
            rest = &rest[at + REPLACEMENT.len()..];
        }
        // The rest of a replacement character may arrive later.
        let begun = (1..REPLACEMENT.len()).rev().find(|length| rest.ends_with(&REPLACEMENT[..*length]));
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

    /// The rows from the top, without trailing blanks.
    pub fn rows(&self) -> Vec<String> {
        let (_, columns) = self.parser.screen().size();
        self.parser.screen().rows(0, columns.get()).map(|row| row.trim_end().to_owned()).collect()
    }

    /// The first row that contains these words.
    pub fn row_with(&self, words: &str) -> Option<String> {
        self.rows().into_iter().find(|row| row.contains(words))
    }

    /// The row with the facts about a command.
    pub fn facts_about(&self, command: &str) -> Option<String> {
        // Beside the key of the abort there may be no room for its time.
        let whole = self.row_with(&format!(" {command:<6} commanded "));
        whole.or_else(|| self.row_with(&format!(" {command} x")))
    }

    /// Whether a row contains these words.
    pub fn shows(&self, words: &str) -> bool {
        self.row_with(words).is_some()
    }

    /// Everything that was ever written to it.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// How often the program rang the bell.
    pub fn bells(&self) -> usize {
        self.parser.callbacks().bells
    }

    /// How often the program requested a title, the clipboard or another size, which it should
    /// never do.
    pub fn forbidden_requests(&self) -> usize {
        let requests = self.parser.callbacks();
        requests.titles + requests.clipboard + requests.resizes
    }

    /// Whether a program uses the alternate screen or hides the cursor.
    pub fn is_held(&self) -> bool {
        self.parser.screen().alternate_screen() || self.parser.screen().hide_cursor()
    }

    /// Whether a program has requested brackets around pasted text.
    pub fn has_bracketed_paste(&self) -> bool {
        self.parser.screen().bracketed_paste()
    }

    /// Whether the last program on the terminal has ended.
    pub fn is_closed(&self) -> bool {
        self.closed
    }
}

/// Rows and columns, each at least one.
fn cells((columns, rows): (u16, u16)) -> (NonZeroU16, NonZeroU16) {
    let some = |count| NonZeroU16::new(count).unwrap_or(NonZeroU16::MIN);
    (some(rows), some(columns))
}

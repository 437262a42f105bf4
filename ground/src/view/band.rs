//! The band of a page: the one number or word of the present moment in large letters, and beside it
//! two or three others.

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};

use super::theme::Ink;
use super::{STALE_MARK, TextRole, Theme, draw_line, fixed};
use crate::model::Sample;

/// Rows of the band on a small, a middling and a large screen: a label, the letters, a line.
const ROWS: [u16; 3] = [6, 7, 10];
/// From these columns and rows on a screen counts as middling, and as large.
const MIDDLING: (u16, u16) = (116, 34);
const LARGE: (u16, u16) = (180, 46);
/// Columns between two numbers, at least.
const GAP: u16 = 2;

/// How large the screen of a page is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Room {
    Small,
    Middling,
    Large,
}

impl Room {
    pub fn of(area: Rect) -> Self {
        let holds = |(columns, rows)| area.width >= columns && area.height >= rows;
        match () {
            () if holds(LARGE) => Self::Large,
            () if holds(MIDDLING) => Self::Middling,
            () => Self::Small,
        }
    }
}

/// A word or number with its name.
#[derive(Debug, Clone)]
pub struct Item {
    /// Its name and unit; may be empty.
    pub label: String,
    pub text: String,
    /// Its width; of a number the greatest, so that nothing moves when it changes.
    pixels: u16,
    pub role: TextRole,
    /// A prediction has its colour.
    is_predicted: bool,
}

/// A word with its label.
pub fn word(label: &str, text: &str, role: TextRole) -> Item {
    let (label, text) = (label.to_owned(), text.to_uppercase());
    let pixels = columns(&text).count() as u16;
    Item { label, text, pixels, role, is_predicted: false }
}

/// A number with its name and unit; the name of a stale one is marked.
pub fn number(label: &str, value: Option<Sample<f64>>, decimals: usize, letters: u16, now: Duration) -> Item {
    let (mark, role) = match value {
        None => ("", TextRole::Label),
        Some(value) if value.is_stale(now) => (STALE_MARK, TextRole::Stale),
        Some(_) => ("", TextRole::Title),
    };
    let text = |decimals| value.map_or_else(|| "--".to_owned(), |value| fixed(value.value, decimals));
    // A number too long for its place loses its decimals, never its first digits.
    let fits = |text: &String| text.len() <= usize::from(letters);
    let text = Some(text(decimals)).filter(fits).or_else(|| Some(text(0)).filter(fits));
    let text = text.unwrap_or_else(|| "many".to_owned());
    let label = format!("{mark}{label}");
    Item { label, text: text.to_uppercase(), pixels: letters * DIGIT_PIXELS, role, is_predicted: false }
}

impl Item {
    #[must_use]
    pub fn predicted(self) -> Self {
        Self { is_predicted: true, ..self }
    }
}

/// The alphabet: each letter as often as it is wide, and under it its rows of pixels. A zero
/// is open, so that it is no eight.
const ALPHABET: &str = include_str!("letters.txt");
/// Pixels of a digit with the gap behind it.
const DIGIT_PIXELS: u16 = 5;

/// Rows of pixels of the alphabet. The last one is below the feet of the letters, for a comma. A
/// point is wide, not high: it is not read as a comma, nor as a part of the digit beside it.
const PIXEL_ROWS: usize = 6;

/// The columns of pixels of a text, each with a gap between two letters behind its last one.
fn columns(text: &str) -> impl Iterator<Item = [bool; PIXEL_ROWS]> {
    let mut lines = ALPHABET.lines().map(str::as_bytes);
    let names = lines.next().unwrap_or_default();
    let rows: [&[u8]; PIXEL_ROWS] = std::array::from_fn(|_| lines.next().unwrap_or_default());
    let column = move |place: usize| rows.map(|row| row.get(place) == Some(&b'#'));
    let blank = |letter: u8| if letter == b' ' { b'_' } else { letter };
    text.bytes().map(blank).flat_map(move |letter| {
        let of_it = (0..names.len()).filter(move |place| names[*place] == letter);
        of_it.map(column).chain([[false; PIXEL_ROWS]])
    })
}

/// Size of a pixel: columns, and halves of a row.
type Size = (u16, u16);
const NARROW: Size = (1, 1);
/// The main item and the others on a small, a middling and a large screen.
const SIZES: [[Size; 2]; 3] = [[(2, 1), NARROW], [(2, 2), NARROW], [(3, 3), (2, 2)]];

/// Rows of a letter.
const fn rows_of((_, halves): Size) -> u16 {
    (5 * halves).div_ceil(2)
}

/// Draws the main item at the left with the line under it, the others to its right, and returns the
/// area below.
pub fn draw_band(
    (main, below, others): (&Item, Line<'static>, &[Item]),
    theme: Theme,
    frame: &mut Frame,
    area: Rect,
) -> Rect {
    let room = Room::of(frame.area());
    let rows = ROWS[room as usize].min(area.height);
    let band = Rect { height: rows, ..area };
    let rest = Rect { y: area.y + rows, height: area.height - rows, ..area };
    frame.buffer_mut().set_style(band, theme.raised());
    if rows < ROWS[0] {
        return rest;
    }
    let [size, other_size] = SIZES[room as usize];
    let others_columns: u16 = others.iter().map(|item| width(item, other_size) + GAP).sum();
    let begin = |size| 1 + width(main, size) + GAP;
    // The last row is below the letters, or behind tall ones.
    let behind = |size: Size| if 1 + rows_of(size) < rows { 0 } else { begin(size) };
    let fits = |size: &Size| {
        begin(*size) + others_columns <= area.width && behind(*size) + below.width() as u16 <= area.width
    };
    // Beside three others at 80 columns it is taller, not wider.
    let size = [size, (1, 2)].into_iter().find(fits).unwrap_or(NARROW);
    letters(main, size, theme, frame, Rect { x: band.x + 1, width: band.width - 1, ..band });
    let (begin, behind) = (begin(size), behind(size));
    let at = Rect { x: band.x + behind, y: band.bottom() - 1, width: band.width - behind, height: 1 };
    draw_line(frame, at, below);
    let spare = area.width.saturating_sub(begin + others_columns);
    let gap = GAP + spare / (others.len() as u16 + 1);
    let mut x = area.x + begin + spare / (others.len() as u16 + 1);
    for item in others {
        let columns = width(item, other_size);
        let at = Rect { x, width: columns, ..band }.intersection(band);
        letters(item, other_size, theme, frame, at);
        x += columns + gap;
    }
    rest
}

/// Draws a word as large as the area allows. Returns the rows taken.
pub fn draw_word(item: &Item, theme: Theme, frame: &mut Frame, area: Rect) -> u16 {
    let fits = |size: &Size| item.pixels * size.0 <= area.width && rows_of(*size) * 5 <= area.height;
    let size = [(3, 3), (2, 2), (1, 2)].into_iter().find(fits).unwrap_or(NARROW);
    let rows = rows_of(size).min(area.height);
    let at = Rect { x: area.x + 1, width: area.width.saturating_sub(1), height: rows, ..area };
    big(item, size, theme, frame, at);
    rows
}

fn width(item: &Item, size: Size) -> u16 {
    (item.pixels * size.0).max(item.label.chars().count() as u16)
}

fn letters(item: &Item, size: Size, theme: Theme, frame: &mut Frame, at: Rect) {
    let style = theme.raised().patch(theme.style(TextRole::Label));
    draw_line(frame, at, Line::styled(item.label.clone(), style));
    let below = Rect { y: at.y + 1, height: at.height.saturating_sub(1).min(rows_of(size)), ..at };
    big(item, size, theme, frame, below);
}

fn big(item: &Item, size: Size, theme: Theme, frame: &mut Frame, at: Rect) {
    let mut style = theme.style(item.role);
    if item.is_predicted && item.role == TextRole::Title {
        style = style.fg(theme.ink(Ink::Predicted));
    }
    let (width, halves) = size;
    if item.pixels * width > at.width + width || (theme.ascii && size == NARROW) {
        // Small halves of a row cannot be distinguished in ASCII.
        let spaced: String = item.text.chars().flat_map(|letter| [letter, ' ']).collect();
        let middle = Rect { y: at.y + 1, height: 1, ..at }.intersection(at);
        return draw_line(frame, middle, Line::from(Span::styled(spaced, style)));
    }
    if style.bg.is_some() || item.role == TextRole::Alarm {
        // Its background is one area around the letters, or they look torn.
        let (x, y) = (at.x.saturating_sub(1), at.y.saturating_sub(1));
        let ground = Rect { x, y, width: 1 + (item.pixels * width).min(at.width), height: 1 + at.height };
        frame.buffer_mut().set_style(ground, style);
    }
    for (place, column) in columns(&item.text).enumerate() {
        let pixel = |half: u16| column.get(usize::from(half / halves)) == Some(&true);
        for row in 0..at.height {
            let symbol = match (pixel(2 * row), pixel(2 * row + 1)) {
                (true, true) => "█",
                (true, false) => "▀",
                (false, true) => "▄",
                (false, false) => continue,
            };
            let x = at.x + place as u16 * width;
            frame.buffer_mut().set_string(x, at.y + row, symbol.repeat(width.into()), style);
        }
    }
}

#[cfg(test)]
mod tests {
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;
    use ratatui::buffer::Buffer;

    use super::*;
    use crate::view::theme::Palette;

    /// The drawn letters of a text: of each its columns of half cells. Letters are apart by an
    /// empty column; what is no larger than one half cell is taken for noise, as from afar.
    fn glyphs(text: &str, size: Size) -> Vec<Vec<Vec<bool>>> {
        let mut terminal = Terminal::new(TestBackend::new(80, 8)).expect("a terminal of memory");
        let theme = Theme { palette: Palette::Dark, ascii: false };
        let item = word("", text, TextRole::Title);
        let area = Rect { x: 0, y: 0, width: 80, height: rows_of(size) };
        let buffer = terminal.draw(|frame| big(&item, size, theme, frame, area)).expect("drawn").buffer;
        let halves = |buffer: &Buffer, x: u16| {
            let symbols = (0..area.height).map(|y| buffer[(x, y)].symbol());
            symbols.flat_map(|symbol| ["█▀", "█▄"].map(|inked| inked.contains(symbol))).collect::<Vec<_>>()
        };
        let columns: Vec<Vec<bool>> = (0..area.width).map(|x| halves(buffer, x)).collect();
        let is_ink = |column: &Vec<bool>| column.contains(&true);
        let runs = columns.chunk_by(|one, next| is_ink(one) == is_ink(next)).filter(|run| is_ink(&run[0]));
        let inked = |run: &[Vec<bool>]| run.iter().flatten().filter(|half| **half).count();
        runs.filter(|run| inked(run) > 1).map(<[_]>::to_vec).collect()
    }

    /// A point that is a single half cell would be lost, and 2.1 read as 21.
    #[test]
    fn every_number_is_read_back_from_its_large_digits() {
        for size in [NARROW, (1, 2), (2, 1), (2, 2), (3, 3)] {
            let templates = "0123456789.".chars().map(|letter| (letter, glyphs(&letter.to_string(), size)));
            let templates: Vec<_> = templates.collect();
            for tenths in 0..=999_u32 {
                let text = fixed(f64::from(tenths) / 10.0, 1);
                let letter = |glyph: &Vec<Vec<bool>>| {
                    let mut found = templates.iter().filter(|(_, drawn)| drawn.as_slice() == [glyph.clone()]);
                    found.next().map_or('?', |(letter, _)| *letter)
                };
                let read: String = glyphs(&text, size).iter().map(letter).collect();
                assert_eq!(read, text, "{size:?}");
            }
        }
    }

    /// From afar a zero must not look like an eight, and every letter of the large words is in the
    /// alphabet.
    #[test]
    fn no_two_letters_look_alike_but_zero_and_o() {
        let all: Vec<char> = ('0'..='9').chain('A'..='Z').chain(".-+:?".chars()).collect();
        let drawn = |letter: char| columns(&letter.to_string()).collect::<Vec<_>>();
        for (place, one) in all.iter().enumerate() {
            assert!(drawn(*one).len() > 1, "{one} is drawn");
            let alike: Vec<_> =
                all[place + 1..].iter().filter(|other| drawn(**other) == drawn(*one)).collect();
            assert_eq!(alike, if *one == '0' { vec![&'O'] } else { Vec::new() }, "{one}");
        }
    }
}

//! Writes what changed on the screen in few bytes, for a slow line.
//!
//! The backend of ratatui says both colours of a cell whenever one of them changes, 20 bytes of which half say nothing new, and
//! goes from row to row, where panels beside each other have other colours. This one writes next what costs least, the way of
//! the cursor and the new colours together; says what is new in one sequence, and nothing about the letters of a blank. In flight
//! that is less than half the bytes. Each frame stands for itself, so that what another program writes between two is no more than
//! a blot.

use std::collections::BTreeMap;
use std::io;
use std::io::Write;

use ratatui::backend::{Backend, ClearType, CrosstermBackend, WindowSize};
use ratatui::buffer::Cell;
use ratatui::layout::{Position, Size};
use ratatui::style::{Color, Modifier};
use ratatui::text::Span;

/// ratatui's own backend, except for the cells.
#[derive(Debug)]
pub struct DiffBackend<W: Write> {
    pub terminal: CrosstermBackend<W>,
    /// The rightmost column that was ever drawn. Behind the last one of the terminal the cursor stands where it likes.
    rightmost: u16,
    cursor_is_hidden: bool,
    /// What stands on the terminal.
    shown: BTreeMap<Place, Cell>,
}

impl<W: Write> DiffBackend<W> {
    pub fn new(terminal: CrosstermBackend<W>) -> Self {
        Self { terminal, rightmost: 0, cursor_is_hidden: false, shown: BTreeMap::new() }
    }
}

/// Each modifier that a theme uses, and the codes that set it and take it back (ECMA-48, 8.3.117).
const MODIFIERS: [(Modifier, u8, u8); 3] =
    [(Modifier::BOLD, 1, 22), (Modifier::ITALIC, 3, 23), (Modifier::REVERSED, 7, 27)];

/// The codes of a colour; `base` is 30 for letters and 40 for the background.
fn codes(colour: Color, base: u8) -> Vec<u8> {
    match colour {
        Color::Indexed(number) => vec![base + 8, 5, number],
        Color::Black => vec![base],
        Color::White => vec![base + 67],
        Color::Red => vec![base + 1],
        Color::Green => vec![base + 2],
        Color::Yellow => vec![base + 3],
        Color::Magenta => vec![base + 5],
        Color::Cyan => vec![base + 6],
        // No theme has others.
        _ => vec![base + 9],
    }
}

/// The bytes of another colour of the letters, as in `ESC [38;5;75m`, of another background, and of another modifier.
const CHANGE_BYTES: [usize; 3] = [10, 10, 4];

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Style {
    fore: Color,
    back: Color,
    modifier: Modifier,
}

impl Style {
    /// What has to be said after another style.
    fn codes_after(&self, said: &Self) -> Vec<u8> {
        let mut new = Vec::new();
        for (flag, set, unset) in MODIFIERS {
            match (said.modifier.contains(flag), self.modifier.contains(flag)) {
                (false, true) => new.push(set),
                (true, false) => new.push(unset),
                _ => {}
            }
        }
        if self.fore != said.fore {
            new.extend(codes(self.fore, 30));
        }
        if self.back != said.back {
            new.extend(codes(self.back, 40));
        }
        new
    }

    /// About how many bytes that takes.
    fn bytes_after(&self, said: &Self) -> usize {
        let changes = [self.fore != said.fore, self.back != said.back, self.modifier != said.modifier];
        changes.into_iter().zip(CHANGE_BYTES).map(|(changes, bytes)| usize::from(changes) * bytes).sum()
    }
}

/// A row and a column.
type Place = (u16, u16);

/// How the cursor gets to a place: from row to row and along from where it stands, or at once.
#[derive(Debug, Clone, Copy)]
enum Way {
    AtOnce(Place),
    Along { rows: i16, columns: i16 },
}

/// The bytes of `ESC [ NUMBER LETTER`; one step needs no number, and none no sequence.
fn sequence_bytes(number: u16) -> usize {
    match number {
        0 => 0,
        1 => 3,
        _ => 4 + number.ilog10() as usize,
    }
}

impl Way {
    /// The shortest one. Nothing is known of the cursor without `from`.
    fn shortest(from: Option<Place>, to: Place) -> Self {
        let at_once = Self::AtOnce(to);
        let Some((row, column)) = from else { return at_once };
        let along = Self::Along {
            rows: to.0.wrapping_sub(row).cast_signed(),
            columns: to.1.wrapping_sub(column).cast_signed(),
        };
        if along.bytes() < at_once.bytes() { along } else { at_once }
    }

    fn bytes(self) -> usize {
        match self {
            Self::AtOnce((row, column)) => {
                sequence_bytes(row + 1).max(4) + sequence_bytes(column + 1).max(4) - 2
            }
            Self::Along { rows, columns } => {
                let vertical = if rows > 0 {
                    usize::from(rows.unsigned_abs())
                } else {
                    sequence_bytes(rows.unsigned_abs())
                };
                vertical + sequence_bytes(columns.unsigned_abs())
            }
        }
    }

    /// `between` is what the cells between are, if it may be written.
    fn write(self, out: &mut impl Write, between: &str) -> io::Result<()> {
        let (rows, columns) = match self {
            Self::AtOnce((row, column)) => return write!(out, "\x1b[{};{}H", row + 1, column + 1),
            Self::Along { rows, columns } => (rows, columns),
        };
        // Backspaces would save 2 % of the bytes; but nobody could tell them from those of a hostile text.
        // A line feed does nothing but go down, because the terminal is in raw mode.
        (0..rows).try_for_each(|_| out.write_all(b"\n"))?;
        steps(out, rows.min(0).unsigned_abs(), 'A')?;
        if !between.is_empty() && between.len() < sequence_bytes(columns.unsigned_abs()) {
            return out.write_all(between.as_bytes());
        }
        steps(out, columns.unsigned_abs(), if columns < 0 { 'D' } else { 'C' })
    }
}

fn steps(out: &mut impl Write, number: u16, letter: char) -> io::Result<()> {
    match number {
        0 => Ok(()),
        1 => write!(out, "\x1b[{letter}"),
        _ => write!(out, "\x1b[{number}{letter}"),
    }
}

/// Of so many runs the next is chosen. All of them would save 0.3 % of the bytes, and take 6 times as long for a new page at
/// 300x90, 150 ms on a busy machine.
const NEXT_OF: usize = 64;

/// Cells of one style beside each other.
#[derive(Debug)]
struct Run {
    style: Style,
    /// Nothing but blanks, which have a background alone.
    is_blank: bool,
    /// A single letter of more columns than one.
    is_wide: bool,
    from: Place,
    columns: u16,
    symbols: String,
}

impl Run {
    /// Where the cursor stands behind it; behind the last column of the terminal, and behind a letter that terminals do not
    /// all give the same columns, that is not sure.
    fn end(&self, rightmost: u16) -> Option<Place> {
        let (row, column) = self.from;
        Some((row, column + self.columns)).filter(|(_, column)| !self.is_wide && *column <= rightmost)
    }

    /// The style in which it is written after another.
    fn style_after(&self, said: &Style) -> Style {
        if self.is_blank {
            Style { back: self.style.back, fore: said.fore, modifier: said.modifier - Modifier::REVERSED }
        } else {
            self.style
        }
    }
}

/// Whether it takes one column, as every letter of ours.
fn is_narrow(cell: &Cell) -> bool {
    cell.symbol().is_ascii() || Span::raw(cell.symbol()).width() == 1
}

/// The cells as runs, from row to row. Blanks belong to the letters beside them, whatever colour these have.
fn runs<'a>(content: impl Iterator<Item = (u16, u16, &'a Cell)>) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for (column, row, cell) in content {
        let style = Style { fore: cell.fg, back: cell.bg, modifier: cell.modifier };
        let is_blank = cell.symbol() == " " && !cell.modifier.contains(Modifier::REVERSED);
        let is_wide = !is_narrow(cell);
        let beside = runs.last_mut().filter(|run| {
            let one_back = run.style.back == style.back;
            let blank_fits = is_blank && !run.style.modifier.contains(Modifier::REVERSED)
                || run.is_blank && !style.modifier.contains(Modifier::REVERSED);
            !is_wide
                && run.end(u16::MAX) == Some((row, column))
                && (run.style == style || one_back && blank_fits)
        });
        let Some(run) = beside else {
            let symbols = cell.symbol().to_owned();
            runs.push(Run { style, is_blank, is_wide, from: (row, column), columns: 1, symbols });
            continue;
        };
        if run.is_blank {
            (run.style, run.is_blank) = (style, is_blank);
        }
        run.columns += 1;
        run.symbols.push_str(cell.symbol());
    }
    runs
}

/// Over more columns the shortest way is never to write them again.
const BETWEEN_MAX: u16 = 3;

/// What the cells between the cursor and a place to its right show, if that can be written in this style.
fn between(shown: &BTreeMap<Place, Cell>, cursor: Option<Place>, (row, to): Place, style: &Style) -> String {
    let from = cursor.map_or(to, |(_, column)| column);
    if to.saturating_sub(from) > BETWEEN_MAX {
        return String::new();
    }
    let fits = |cell: &&Cell| {
        let is_blank = cell.symbol() == " " && !(cell.modifier | style.modifier).contains(Modifier::REVERSED);
        is_narrow(cell)
            && cell.bg == style.back
            && (is_blank || cell.fg == style.fore && cell.modifier == style.modifier)
    };
    let cells: Option<Vec<&Cell>> = (from..to).map(|column| shown.get(&(row, column)).filter(fits)).collect();
    cells.unwrap_or_default().into_iter().map(Cell::symbol).collect()
}

impl<W: Write> Backend for DiffBackend<W> {
    type Error = io::Error;

    fn draw<'a, I: Iterator<Item = (u16, u16, &'a Cell)>>(&mut self, content: I) -> io::Result<()> {
        let content: Vec<_> = content.collect();
        for (column, row, cell) in &content {
            self.shown.insert((*row, *column), (*cell).clone());
            if !is_narrow(cell) {
                // Its second half: nothing is known of it.
                self.shown.remove(&(*row, *column + 1));
            }
        }
        let mut left = runs(content.into_iter());
        if left.is_empty() {
            return Ok(());
        }
        self.rightmost = left.iter().map(|run| run.from.1 + run.columns - 1).fold(self.rightmost, u16::max);
        let out = &mut self.terminal;
        let mut said = Style { fore: Color::Reset, back: Color::Reset, modifier: Modifier::empty() };
        let mut cursor = None;
        // The nearest of the same style; if there is none left, the cheapest. Of equal ones the first.
        let cost = |run: &Run, said: &Style, cursor| {
            Way::shortest(cursor, run.from).bytes() + run.style_after(said).bytes_after(said)
        };
        loop {
            let cheapest = |same: bool| {
                let runs = left.iter().enumerate().filter(|(_, run)| !same || run.style_after(&said) == said);
                runs.take(NEXT_OF).min_by_key(|(_, run)| cost(run, &said, cursor)).map(|(place, _)| place)
            };
            let Some(next) = cheapest(true).or_else(|| cheapest(false)) else { break };
            let run = left.remove(next);
            let style = run.style_after(&said);
            let codes: Vec<String> = style.codes_after(&said).iter().map(u8::to_string).collect();
            if !codes.is_empty() {
                write!(out, "\x1b[{}m", codes.join(";"))?;
            }
            said = style;
            Way::shortest(cursor, run.from).write(out, &between(&self.shown, cursor, run.from, &style))?;
            cursor = run.end(self.rightmost);
            out.write_all(run.symbols.as_bytes())?;
        }
        write!(out, "\x1b[m")
    }

    fn hide_cursor(&mut self) -> io::Result<()> {
        // ratatui asks for it with every frame.
        if std::mem::replace(&mut self.cursor_is_hidden, true) { Ok(()) } else { self.terminal.hide_cursor() }
    }

    fn show_cursor(&mut self) -> io::Result<()> {
        self.cursor_is_hidden = false;
        self.terminal.show_cursor()
    }

    fn get_cursor_position(&mut self) -> io::Result<Position> {
        self.terminal.get_cursor_position()
    }

    fn set_cursor_position<P: Into<Position>>(&mut self, position: P) -> io::Result<()> {
        self.terminal.set_cursor_position(position)
    }

    fn clear(&mut self) -> io::Result<()> {
        (self.rightmost, self.cursor_is_hidden) = (0, false);
        self.shown.clear();
        self.terminal.clear()
    }

    fn clear_region(&mut self, clear_type: ClearType) -> io::Result<()> {
        self.terminal.clear_region(clear_type)
    }

    fn size(&self) -> io::Result<Size> {
        self.terminal.size()
    }

    fn window_size(&mut self) -> io::Result<WindowSize> {
        self.terminal.window_size()
    }

    fn flush(&mut self) -> io::Result<()> {
        Backend::flush(&mut self.terminal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_new_is_said() {
        let cell = |symbol: &str, style: ratatui::style::Style| {
            let mut cell = Cell::default();
            cell.set_symbol(symbol).set_style(style);
            cell
        };
        let (plain, bold) =
            (ratatui::style::Style::new().fg(Color::Indexed(75)).bg(Color::Indexed(233)), Modifier::BOLD);
        let other = plain.fg(Color::Indexed(79));
        let cells = [
            cell("a", plain),
            cell("b", other),
            cell(" ", plain.add_modifier(bold)),
            cell("c", plain),
            cell("d", other.add_modifier(bold)),
        ];
        let places = [(3, 1), (4, 1), (5, 1), (9, 1), (0, 2)];
        let (x, y) = (cell("x", other), cell("y", other));
        // The b between the two is written again, which is shorter than a step of the cursor.
        let beside_b = [((3, 1), &x), ((5, 1), &y)];
        let mut written = Vec::new();
        let mut terminal = DiffBackend::new(CrosstermBackend::new(&mut written));
        terminal.draw(places.into_iter().zip(&cells).map(|((x, y), cell)| (x, y, cell))).unwrap();
        terminal.draw(beside_b.into_iter().map(|((x, y), cell)| (x, y, cell))).unwrap();
        let first = "\x1b[38;5;75;48;5;233m\x1b[2;4Ha\x1b[5Cc\x1b[38;5;79m\x1b[2;5Hb \x1b[1m\n\x1b[6Dd\x1b[m";
        let second = "\x1b[38;5;79;48;5;233m\x1b[2;4Hxby\x1b[m";
        assert_eq!(String::from_utf8(written).unwrap(), format!("{first}{second}"));
    }
}

//! Writes what changed on the screen in few bytes, for a slow line.
//!
//! The backend of ratatui says both colours of a cell whenever one of them changes, 20 bytes of which half say nothing new, and
//! says them in the order of the rows, where panels beside each other have other colours. This one writes the cells of one style
//! after those of another, says what is new in one sequence, nothing about the letters of a blank, and moves the cursor by the
//! shortest way. In flight that is half the bytes.

use std::io;
use std::io::Write;

use ratatui::backend::{Backend, ClearType, CrosstermBackend, WindowSize};
use ratatui::buffer::Cell;
use ratatui::layout::{Position, Size};
use ratatui::style::{Color, Modifier};

/// ratatui's own backend, except for the cells.
#[derive(Debug)]
pub struct Thrifty<W: Write> {
    pub terminal: CrosstermBackend<W>,
    /// The rightmost column that was ever drawn. Behind the last one of the terminal the cursor stands where it likes.
    rightmost: u16,
}

impl<W: Write> Thrifty<W> {
    pub fn new(terminal: CrosstermBackend<W>) -> Self {
        Self { terminal, rightmost: 0 }
    }
}

/// Each modifier that a theme uses, and the codes that set it and take it back (ECMA-48, 8.3.117).
const MODIFIERS: [(Modifier, u8, u8); 3] =
    [(Modifier::BOLD, 1, 22), (Modifier::ITALIC, 3, 23), (Modifier::REVERSED, 7, 27)];

/// The codes of a colour; `base` is 30 for letters and 40 for the background.
fn codes(colour: Color, base: u8) -> Vec<u8> {
    match colour {
        Color::Indexed(number) => vec![base + 8, 5, number],
        Color::Red => vec![base + 1],
        Color::Green => vec![base + 2],
        Color::Yellow => vec![base + 3],
        Color::Magenta => vec![base + 5],
        Color::Cyan => vec![base + 6],
        // No theme has others.
        _ => vec![base + 9],
    }
}

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

    fn write(self, out: &mut impl Write) -> io::Result<()> {
        let (rows, columns) = match self {
            Self::AtOnce((row, column)) => return write!(out, "\x1b[{};{}H", row + 1, column + 1),
            Self::Along { rows, columns } => (rows, columns),
        };
        // A line feed does nothing but go down, because the terminal is in raw mode.
        (0..rows).try_for_each(|_| out.write_all(b"\n"))?;
        steps(out, rows.min(0).unsigned_abs(), 'A')?;
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

/// Cells of one style beside each other.
#[derive(Debug)]
struct Run {
    style: Style,
    from: Place,
    columns: u16,
    symbols: String,
}

impl Run {
    /// Where the cursor stands behind it; behind the last column of the terminal that is not sure.
    fn end(&self, rightmost: u16) -> Option<Place> {
        let (row, column) = self.from;
        Some((row, column + self.columns)).filter(|(_, column)| *column <= rightmost)
    }
}

/// The cells, those of one style after those of another, the styles with one background after those with another.
fn by_style<'a>(content: impl Iterator<Item = (u16, u16, &'a Cell)>) -> Vec<Run> {
    let mut cells: Vec<(usize, u16, u16, &str)> = Vec::new();
    let mut styles: Vec<Style> = Vec::new();
    let mut before: Option<(u16, u16, usize)> = None;
    for (x, y, cell) in content {
        let style = Style { fore: cell.fg, back: cell.bg, modifier: cell.modifier };
        let is_blank = cell.symbol() == " " && !cell.modifier.contains(Modifier::REVERSED);
        // A blank has only a background: it goes on in the style before it, or in one that is known.
        let fits = |known: &Style| known.back == style.back && !known.modifier.contains(Modifier::REVERSED);
        let beside = before.filter(|(row, column, place)| *row == y && *column == x && fits(&styles[*place]));
        let known = match beside {
            Some((.., place)) if is_blank => Some(place),
            _ if is_blank => styles.iter().position(fits),
            _ => styles.iter().position(|known| *known == style),
        };
        let place = known.unwrap_or_else(|| {
            styles.push(style);
            styles.len() - 1
        });
        before = Some((y, x + 1, place));
        cells.push((place, y, x, cell.symbol()));
    }
    // Both in the order in which they first come.
    let back = |place: usize| styles.iter().position(|style| style.back == styles[place].back);
    cells.sort_by_key(|(place, y, x, _)| (back(*place), *place, *y, *x));
    let mut runs: Vec<Run> = Vec::new();
    for (place, row, column, symbol) in cells {
        let style = styles[place];
        match runs.last_mut().filter(|run| run.style == style && run.end(u16::MAX) == Some((row, column))) {
            Some(run) => {
                run.columns += 1;
                run.symbols.push_str(symbol);
            }
            None => runs.push(Run { style, from: (row, column), columns: 1, symbols: symbol.to_owned() }),
        }
    }
    runs
}

impl<W: Write> Backend for Thrifty<W> {
    type Error = io::Error;

    fn draw<'a, I: Iterator<Item = (u16, u16, &'a Cell)>>(&mut self, content: I) -> io::Result<()> {
        let mut runs = by_style(content);
        let ends = runs.iter().map(|run| run.from.1 + run.columns - 1);
        self.rightmost = ends.fold(self.rightmost, u16::max);
        let out = &mut self.terminal;
        let mut said = Style { fore: Color::Reset, back: Color::Reset, modifier: Modifier::empty() };
        let mut cursor = None;
        for of_a_style in runs.chunk_by_mut(|one, next| one.style == next.style) {
            for done in 0..of_a_style.len() {
                // The nearest next; of equal ones the first.
                let left = &mut of_a_style[done..];
                let near = |run: &&Run| Way::shortest(cursor, run.from).bytes();
                if let Some(nearest) =
                    left.iter().enumerate().min_by_key(|(_, run)| near(run)).map(|(place, _)| place)
                {
                    left[..=nearest].rotate_right(1);
                }
                let Run { style, from, symbols, .. } = &left[0];
                Way::shortest(cursor, *from).write(out)?;
                cursor = left[0].end(self.rightmost);
                let codes: Vec<String> = style.codes_after(&said).iter().map(u8::to_string).collect();
                if !codes.is_empty() {
                    write!(out, "\x1b[{}m", codes.join(";"))?;
                }
                said = *style;
                out.write_all(symbols.as_bytes())?;
            }
        }
        if runs.is_empty() { Ok(()) } else { write!(out, "\x1b[m") }
    }

    fn hide_cursor(&mut self) -> io::Result<()> {
        self.terminal.hide_cursor()
    }

    fn show_cursor(&mut self) -> io::Result<()> {
        self.terminal.show_cursor()
    }

    fn get_cursor_position(&mut self) -> io::Result<Position> {
        self.terminal.get_cursor_position()
    }

    fn set_cursor_position<P: Into<Position>>(&mut self, position: P) -> io::Result<()> {
        self.terminal.set_cursor_position(position)
    }

    fn clear(&mut self) -> io::Result<()> {
        self.rightmost = 0;
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
        let mut written = Vec::new();
        let places = [(3, 1), (4, 1), (5, 1), (9, 1), (0, 2)];
        Thrifty::new(CrosstermBackend::new(&mut written))
            .draw(places.into_iter().zip(&cells).map(|((x, y), cell)| (x, y, cell)))
            .unwrap();
        let expected =
            "\x1b[2;4H\x1b[38;5;75;48;5;233ma\x1b[5Cc\x1b[2;5H\x1b[38;5;79mb \n\x1b[6D\x1b[1md\x1b[m";
        assert_eq!(String::from_utf8(written).unwrap(), expected);
    }
}

//! Writes what changed on the screen in few bytes, for a slow line. The backend of ratatui writes
//! both colours of a cell whenever one of them changes, 20 bytes of which half are redundant, and
//! goes from row to row, where panels beside each other have other colours. This one writes all
//! cells of a style together, moves the cursor the shortest way, and writes no letter colour for a
//! blank. In flight that is less than half the bytes. Each frame is independent, so that output of
//! another program between two frames leaves only a blot.

use std::io;
use std::io::Write;

use crossterm::queue;
use crossterm::terminal::{BeginSynchronizedUpdate, EndSynchronizedUpdate};
use ratatui::backend::{Backend, ClearType, CrosstermBackend, WindowSize};
use ratatui::buffer::{Cell, CellWidth as _};
use ratatui::layout::{Position, Size};
use ratatui::style::{Color, Modifier};
use rustix::termios::tcgetwinsize;

use crate::view::theme::Depth;

/// ratatui's own backend, except for the cells.
#[derive(Debug)]
pub struct DiffBackend<W: Write> {
    pub terminal: CrosstermBackend<W>,
    pub depth: Depth,
    /// The rightmost column that was drawn since the screen was cleared. Behind the last one of the
    /// terminal the cursor stands where it likes.
    rightmost: u16,
    cursor_is_hidden: bool,
    /// Whether the terminal erases with the last background, as all do but GNU Screen.
    pub erases: bool,
}

impl<W: Write> DiffBackend<W> {
    pub fn new(terminal: CrosstermBackend<W>) -> Self {
        Self { terminal, depth: Depth::default(), rightmost: 0, cursor_is_hidden: false, erases: true }
    }
}

/// Each modifier that a theme uses, and the codes that set it and take it back (ECMA-48, 8.3.117).
const MODIFIERS: [(Modifier, u8, u8); 3] =
    [(Modifier::BOLD, 1, 22), (Modifier::ITALIC, 3, 23), (Modifier::REVERSED, 7, 27)];

/// The codes of a colour; `base` is 30 for letters and 40 for the background.
fn codes(colour: Color, base: u8) -> Vec<u8> {
    match colour {
        // The first eight, and the eight bright ones (ECMA-48, SGR; aixterm).
        Color::Indexed(number @ 0..8) => vec![base + number],
        Color::Indexed(number @ 8..16) => vec![base + 60 + number - 8],
        Color::Indexed(number) => vec![base + 8, 5, number],
        Color::Rgb(red, green, blue) => vec![base + 8, 2, red, green, blue],
        Color::Black => vec![base],
        Color::White => vec![base + 67],
        // No theme and no picture has others.
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
    /// The codes that change another style into this one.
    fn codes_after(&self, written: &Self) -> Vec<u8> {
        let mut new = Vec::new();
        for (flag, set, unset) in MODIFIERS {
            match (written.modifier.contains(flag), self.modifier.contains(flag)) {
                (false, true) => new.push(set),
                (true, false) => new.push(unset),
                _ => {}
            }
        }
        if self.fore != written.fore {
            new.extend(codes(self.fore, 30));
        }
        if self.back != written.back {
            new.extend(codes(self.back, 40));
        }
        new
    }
}

/// Cells of one style beside each other.
#[derive(Debug)]
struct Run {
    style: Style,
    /// Nothing but blanks, which have a background alone.
    is_blank: bool,
    /// A row and a column.
    from: (u16, u16),
    columns: u16,
    symbols: String,
}

impl Run {
    /// Whether every terminal gives it the same columns: not a letter of two, which is a run of its
    /// own.
    fn is_narrow(&self) -> bool {
        self.symbols.chars().count() == usize::from(self.columns)
    }
}

/// The cells as runs, from row to row. Blanks belong to the letters beside them, whatever colour
/// these have.
fn runs<'a>(content: impl Iterator<Item = (u16, u16, &'a Cell)>, depth: Depth) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for (column, row, cell) in content {
        let (fore, back) = (depth.shown(cell.fg, false), depth.shown(cell.bg, true));
        let style = Style { fore, back, modifier: cell.modifier };
        let is_blank = cell.symbol() == " " && !cell.modifier.contains(Modifier::REVERSED);
        let columns = cell.cell_width().max(1);
        let beside = runs.last_mut().filter(|run| {
            let one_back = run.style.back == style.back
                && !(run.style.modifier | style.modifier).contains(Modifier::REVERSED);
            columns == 1
                && run.is_narrow()
                && run.from == (row, column.wrapping_sub(run.columns))
                && (run.style == style || one_back && (is_blank || run.is_blank))
        });
        match beside {
            Some(run) => {
                if run.is_blank {
                    (run.style, run.is_blank) = (style, is_blank);
                }
                run.columns += columns;
                run.symbols.push_str(cell.symbol());
            }
            None => runs.push(Run {
                style,
                is_blank,
                from: (row, column),
                columns,
                symbols: cell.symbol().to_owned(),
            }),
        }
    }
    runs
}

fn steps(number: u16, letter: char) -> String {
    match number {
        0 => String::new(),
        1 => format!("\x1b[{letter}"),
        _ => format!("\x1b[{number}{letter}"),
    }
}

/// The shortest way of the cursor.
fn way(cursor: Option<(u16, u16)>, (row, column): (u16, u16)) -> String {
    let at_once = format!("\x1b[{};{}H", row + 1, column + 1);
    // A line feed does nothing but go down, because the terminal is in raw mode.
    let along = cursor.map(|from| {
        let down = match from.0.saturating_sub(row) {
            0 => "\n".repeat(usize::from(row - from.0)),
            up => steps(up, 'A'),
        };
        let (right, left) = (column.saturating_sub(from.1), from.1.saturating_sub(column));
        down + &steps(right, 'C') + &steps(left, 'D')
    });
    along.filter(|along| along.len() < at_once.len()).unwrap_or(at_once)
}

/// From so many blanks on it is shorter to erase the cells and to step over them (ECMA-48, ECH and
/// CUF).
const ERASED_FROM: usize = 12;

/// Writes letters, and erases many blanks.
fn write_symbols(out: &mut impl Write, symbols: &str, erases: bool) -> io::Result<()> {
    if !erases {
        return out.write_all(symbols.as_bytes());
    }
    let letters = symbols.trim_start_matches(' ');
    let blanks = symbols.len() - letters.len();
    if blanks >= ERASED_FROM {
        write!(out, "\x1b[{blanks}X\x1b[{blanks}C")?;
    } else {
        out.write_all(&symbols.as_bytes()[..blanks])?;
    }
    let end = letters.find(&" ".repeat(ERASED_FROM)).unwrap_or(letters.len());
    out.write_all(&letters.as_bytes()[..end])?;
    if end < letters.len() { write_symbols(out, &letters[end..], erases) } else { Ok(()) }
}

impl<W: Write> Backend for DiffBackend<W> {
    type Error = io::Error;

    fn draw<'a, I: Iterator<Item = (u16, u16, &'a Cell)>>(&mut self, content: I) -> io::Result<()> {
        let runs = runs(content, self.depth);
        if runs.is_empty() {
            return Ok(());
        }
        let mut styles: Vec<Style> = Vec::new();
        for run in &runs {
            if !styles.contains(&run.style) {
                styles.push(run.style);
            }
        }
        self.rightmost = runs.iter().map(|run| run.from.1 + run.columns - 1).fold(self.rightmost, u16::max);
        let out = &mut self.terminal;
        queue!(out, BeginSynchronizedUpdate)?;
        let mut written = Style { fore: Color::Reset, back: Color::Reset, modifier: Modifier::empty() };
        let mut cursor = None;
        // The next style is the one that takes the fewest codes.
        while let Some(next) = (0..styles.len()).min_by_key(|next| styles[*next].codes_after(&written).len())
        {
            let style = styles.remove(next);
            let codes: Vec<String> = style.codes_after(&written).iter().map(u8::to_string).collect();
            if !codes.is_empty() {
                write!(out, "\x1b[{}m", codes.join(";"))?;
            }
            written = style;
            for run in runs.iter().filter(|run| run.style == style) {
                out.write_all(way(cursor, run.from).as_bytes())?;
                // What is erased has the background, which is not that of reversed letters.
                write_symbols(
                    out,
                    &run.symbols,
                    self.erases && !style.modifier.contains(Modifier::REVERSED),
                )?;
                let (row, column) = run.from;
                let is_sure = column + run.columns <= self.rightmost && run.is_narrow();
                cursor = is_sure.then_some((row, column + run.columns));
            }
        }
        write!(out, "\x1b[m")?;
        queue!(out, EndSynchronizedUpdate)
    }

    fn hide_cursor(&mut self) -> io::Result<()> {
        // ratatui calls this with every frame.
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
        self.clear_region(ClearType::All)
    }

    // ratatui calls this before the first frame of another size.
    fn clear_region(&mut self, clear_type: ClearType) -> io::Result<()> {
        if clear_type == ClearType::All {
            (self.rightmost, self.cursor_is_hidden) = (0, false);
        }
        self.terminal.clear_region(clear_type)
    }

    fn size(&self) -> io::Result<Size> {
        // Not the size that crossterm returns: it opens /dev/tty for every frame, and opening a
        // file may stall.
        let size = tcgetwinsize(io::stdout())?;
        let size = Size::new(size.ws_col, size.ws_row);
        // A terminal that does not know its size, as some serial consoles, has that of a VT100.
        Ok(if size.width == 0 || size.height == 0 { Size::new(80, 24) } else { size })
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
    fn a_terminal_of_24_bits_gets_the_parts_of_a_colour() {
        let mut cell = Cell::default();
        cell.set_symbol("x").set_style(ratatui::style::Style::new().fg(Color::Indexed(75)));
        let mut written = Vec::new();
        let mut terminal = DiffBackend::new(CrosstermBackend::new(&mut written));
        terminal.depth = Depth::True;
        terminal.draw([(0, 0, &cell)].into_iter()).unwrap();
        let written = String::from_utf8(written).unwrap();
        assert!(written.contains("\x1b[38;2;116;192;255m\x1b[1;1Hx\x1b[m"), "{written:?}");
    }

    /// What is erased has the colours of the terminal, not those of reversed letters.
    #[test]
    fn blanks_of_reversed_letters_are_written_and_16_colours_have_their_own_codes() {
        let style = ratatui::style::Style::new().fg(Color::Indexed(79)).bg(Color::Indexed(124));
        for (modifier, blanks) in
            [(Modifier::REVERSED, " ".repeat(14)), (Modifier::BOLD, "\x1b[14X".to_owned())]
        {
            let mut cell = Cell::default();
            cell.set_style(style.add_modifier(modifier));
            let mut written = Vec::new();
            let mut terminal = DiffBackend::new(CrosstermBackend::new(&mut written));
            terminal.depth = Depth::Sixteen;
            terminal.draw((0..14).map(|column| (column, 0, &cell))).unwrap();
            let written = String::from_utf8(written).unwrap();
            assert!(written.contains(&blanks) && written.contains(";92;41m"), "{written:?}");
        }
    }

    /// Behind a full row of the narrower terminal the cursor's place is not known.
    #[test]
    fn a_terminal_that_became_narrower_is_drawn_in_the_right_columns() {
        let mut cell = Cell::default();
        cell.set_symbol("x");
        let mut written = Vec::new();
        let mut terminal = DiffBackend::new(CrosstermBackend::new(&mut written));
        terminal.draw([(99, 0, &cell)].into_iter()).unwrap();
        terminal.clear_region(ClearType::All).unwrap();
        let full_row = (0..79).map(|column| (column, 0, &cell));
        terminal.draw(full_row.chain([(18, 1, &cell)])).unwrap();
        let written = String::from_utf8(written).unwrap();
        assert!(written.contains("\x1b[2;19Hx"), "{written:?}");
    }

    #[test]
    fn only_changed_attributes_are_written() {
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
        let beside_b = [((3, 1), &x), ((5, 1), &y)];
        let mut written = Vec::new();
        let mut terminal = DiffBackend::new(CrosstermBackend::new(&mut written));
        terminal.draw(places.into_iter().zip(&cells).map(|((x, y), cell)| (x, y, cell))).unwrap();
        terminal.draw(beside_b.into_iter().map(|((x, y), cell)| (x, y, cell))).unwrap();
        let (begin, end) = ("\x1b[?2026h", "\x1b[?2026l");
        let first = "\x1b[38;5;75;48;5;233m\x1b[2;4Ha\x1b[5Cc\x1b[38;5;79m\x1b[2;5Hb \x1b[1m\n\x1b[6Dd\x1b[m";
        let second = "\x1b[38;5;79;48;5;233m\x1b[2;4Hx\x1b[Cy\x1b[m";
        assert_eq!(String::from_utf8(written).unwrap(), format!("{begin}{first}{end}{begin}{second}{end}"));
    }
}

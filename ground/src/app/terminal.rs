//! Writes what changed on the screen in few bytes, for a slow line.
//!
//! The backend of ratatui goes from row to row, where panels beside each other have other colours, and says both colours of a cell
//! whenever one of them changes. This one writes cells of one style one after the other, and says only what is new. In flight that
//! is little more than half the bytes. Each frame stands for itself, so that what another program writes between two is no more
//! than a blot.

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
}

/// Each modifier that a theme uses, and the code that sets it (ECMA-48, 8.3.117).
const MODIFIERS: [(Modifier, u8); 3] = [(Modifier::BOLD, 1), (Modifier::ITALIC, 3), (Modifier::REVERSED, 7)];

/// The number of a colour; `None` for the terminal's own. No theme has others.
fn number(colour: Color) -> Option<u8> {
    if let Color::Indexed(number) = colour { Some(number) } else { None }
}

/// The code of a colour; `base` is 30 for letters and 40 for the background.
fn code(colour: Option<u8>, base: u8) -> String {
    colour.map_or_else(|| (base + 9).to_string(), |number| format!("{};5;{number}", base + 8))
}

impl<W: Write> Backend for DiffBackend<W> {
    type Error = io::Error;

    fn draw<'a, I: Iterator<Item = (u16, u16, &'a Cell)>>(&mut self, content: I) -> io::Result<()> {
        let style = |cell: &Cell| (number(cell.bg), number(cell.fg), cell.modifier);
        let mut cells: Vec<_> = content.collect();
        cells.sort_by_key(|(column, row, cell)| {
            let (back, fore, modifier) = style(cell);
            (back, fore, modifier.bits(), *row, *column)
        });
        let out = &mut self.terminal;
        let mut said = (None, None, Modifier::empty());
        let mut cursor = None;
        for (column, row, cell) in cells {
            match cursor {
                Some(at) if at == (column, row) => {}
                Some(at) if at == (column.saturating_sub(1), row) => out.write_all(b"\x1b[C")?,
                Some((from, same)) if same == row && from < column => write!(out, "\x1b[{}C", column - from)?,
                _ => write!(out, "\x1b[{};{}H", row + 1, column + 1)?,
            }
            // Terminals do not all give a wide letter the same columns.
            cursor = (Span::raw(cell.symbol()).width() == 1).then_some((column + 1, row));
            let (back, fore, modifier) = style(cell);
            let mut codes = Vec::new();
            // Of a blank only the background is seen.
            let is_blank = cell.symbol() == " " && !(modifier | said.2).contains(Modifier::REVERSED);
            if !is_blank && modifier != said.2 {
                said = (None, None, modifier);
                codes.push("0".to_owned());
                let set = MODIFIERS.into_iter().filter(|(flag, _)| modifier.contains(*flag));
                codes.extend(set.map(|(_, code)| code.to_string()));
            }
            if !is_blank && fore != said.1 {
                said.1 = fore;
                codes.push(code(fore, 30));
            }
            if back != said.0 {
                said.0 = back;
                codes.push(code(back, 40));
            }
            if !codes.is_empty() {
                write!(out, "\x1b[{}m", codes.join(";"))?;
            }
            out.write_all(cell.symbol().as_bytes())?;
        }
        write!(out, "\x1b[m")
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
        let style = |colour| ratatui::style::Style::new().fg(Color::Indexed(colour)).bg(Color::Indexed(233));
        let cell = |symbol: &str, style: ratatui::style::Style| {
            let mut cell = Cell::default();
            cell.set_symbol(symbol).set_style(style);
            cell
        };
        let cells = [
            (3, 1, cell("a", style(75))),
            (4, 1, cell("b", style(79))),
            (5, 1, cell(" ", style(75))),
            (9, 1, cell("c", style(75))),
            (0, 2, cell("d", style(79).add_modifier(Modifier::BOLD))),
        ];
        let mut written = Vec::new();
        let mut terminal = DiffBackend { terminal: CrosstermBackend::new(&mut written) };
        terminal.draw(cells.iter().map(|(column, row, cell)| (*column, *row, cell))).unwrap();
        let first = "\x1b[2;4H\x1b[38;5;75;48;5;233ma\x1b[C \x1b[3Cc";
        let second = "\x1b[2;5H\x1b[38;5;79mb\x1b[3;1H\x1b[0;1;38;5;79;48;5;233md\x1b[m";
        assert_eq!(String::from_utf8(written).unwrap(), format!("{first}{second}"));
    }
}

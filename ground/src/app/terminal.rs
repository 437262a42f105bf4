//! Writes what changed on the screen in few bytes, for a slow line.
//!
//! The backend of ratatui says both colours of a cell whenever one of them changes, 20 bytes of which half say nothing new. This one
//! says in one sequence what is new, nothing about the letters of a blank, and moves along a row in 4 bytes instead of 8.

use std::io;
use std::io::Write;

use ratatui::backend::{Backend, ClearType, CrosstermBackend, WindowSize};
use ratatui::buffer::Cell;
use ratatui::layout::{Position, Size};
use ratatui::style::{Color, Modifier};

/// ratatui's own backend, except for the cells.
#[derive(Debug)]
pub struct Thrifty<W: Write>(pub CrosstermBackend<W>);

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

impl<W: Write> Backend for Thrifty<W> {
    type Error = io::Error;

    fn draw<'a, I: Iterator<Item = (u16, u16, &'a Cell)>>(&mut self, content: I) -> io::Result<()> {
        let out = &mut self.0;
        let (mut fore, mut back, mut modifier) = (Color::Reset, Color::Reset, Modifier::empty());
        let mut next = None;
        for (x, y, cell) in content {
            match next {
                Some((row, column)) if row == y && column == x => {}
                Some((row, column)) if row == y && column < x => write!(out, "\x1b[{}C", x - column)?,
                _ => write!(out, "\x1b[{};{}H", y + 1, x + 1)?,
            }
            next = Some((y, x + 1));
            let mut said = Vec::new();
            let is_blank = cell.symbol() == " " && !(cell.modifier | modifier).contains(Modifier::REVERSED);
            if !is_blank {
                for (flag, set, unset) in MODIFIERS {
                    match (modifier.contains(flag), cell.modifier.contains(flag)) {
                        (false, true) => said.push(set),
                        (true, false) => said.push(unset),
                        _ => {}
                    }
                }
                modifier = cell.modifier;
                if cell.fg != fore {
                    said.extend(codes(cell.fg, 30));
                    fore = cell.fg;
                }
            }
            if cell.bg != back {
                said.extend(codes(cell.bg, 40));
                back = cell.bg;
            }
            if !said.is_empty() {
                let said: Vec<String> = said.iter().map(u8::to_string).collect();
                write!(out, "\x1b[{}m", said.join(";"))?;
            }
            write!(out, "{}", cell.symbol())?;
        }
        if next.is_some() { write!(out, "\x1b[m") } else { Ok(()) }
    }

    fn hide_cursor(&mut self) -> io::Result<()> {
        self.0.hide_cursor()
    }

    fn show_cursor(&mut self) -> io::Result<()> {
        self.0.show_cursor()
    }

    fn get_cursor_position(&mut self) -> io::Result<Position> {
        self.0.get_cursor_position()
    }

    fn set_cursor_position<P: Into<Position>>(&mut self, position: P) -> io::Result<()> {
        self.0.set_cursor_position(position)
    }

    fn clear(&mut self) -> io::Result<()> {
        self.0.clear()
    }

    fn clear_region(&mut self, clear_type: ClearType) -> io::Result<()> {
        self.0.clear_region(clear_type)
    }

    fn size(&self) -> io::Result<Size> {
        self.0.size()
    }

    fn window_size(&mut self) -> io::Result<WindowSize> {
        self.0.window_size()
    }

    fn flush(&mut self) -> io::Result<()> {
        Backend::flush(&mut self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ratatui::style::Style;

    #[test]
    fn only_what_is_new_is_said() {
        let cell = |symbol: &str, style: Style| {
            let mut cell = Cell::default();
            cell.set_symbol(symbol).set_style(style);
            cell
        };
        let (plain, bold) = (Style::new().fg(Color::Indexed(75)).bg(Color::Indexed(233)), Modifier::BOLD);
        let cells = [
            cell("a", plain),
            cell("b", plain.fg(Color::Indexed(79))),
            cell(" ", plain.add_modifier(bold)),
            cell("c", plain.fg(Color::Indexed(79)).add_modifier(bold)),
            cell("d", plain.fg(Color::Reset)),
        ];
        let mut written = Vec::new();
        let places = [(3, 1), (4, 1), (5, 1), (9, 1), (0, 2)];
        Thrifty(CrosstermBackend::new(&mut written))
            .draw(places.into_iter().zip(&cells).map(|((x, y), cell)| (x, y, cell)))
            .unwrap();
        let expected =
            "\x1b[2;4H\x1b[38;5;75;48;5;233ma\x1b[38;5;79mb \x1b[3C\x1b[1mc\x1b[3;1H\x1b[22;39md\x1b[m";
        assert_eq!(String::from_utf8(written).unwrap(), expected);
    }
}

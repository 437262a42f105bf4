//! Writes what changed on the screen in few bytes, for a slow line.
//!
//! The backend of ratatui says both colours of a cell whenever one of them changes, 20 bytes of which half say nothing new, and
//! says them in the order of the rows, where panels beside each other have other colours. This one writes the cells of one style
//! after those of another, says what is new in one sequence, nothing about the letters of a blank, and moves along a row in 4
//! bytes instead of 8. In flight that is half the bytes.

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

/// The cells, those of one style after those of another, in the order in which the styles first come.
fn by_style<'a>(content: impl Iterator<Item = (u16, u16, &'a Cell)>) -> Vec<(u16, u16, Style, &'a str)> {
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
    cells.sort_by_key(|(place, y, x, _)| (*place, *y, *x));
    cells.into_iter().map(|(place, y, x, symbol)| (x, y, styles[place], symbol)).collect()
}

impl<W: Write> Backend for Thrifty<W> {
    type Error = io::Error;

    fn draw<'a, I: Iterator<Item = (u16, u16, &'a Cell)>>(&mut self, content: I) -> io::Result<()> {
        let out = &mut self.0;
        let mut said = Style { fore: Color::Reset, back: Color::Reset, modifier: Modifier::empty() };
        let mut next = None;
        for (x, y, style, symbol) in by_style(content) {
            match next {
                Some((row, column)) if row == y && column == x => {}
                Some((row, column)) if row == y && column + 1 == x => write!(out, "\x1b[C")?,
                Some((row, column)) if row == y && column < x => write!(out, "\x1b[{}C", x - column)?,
                _ => write!(out, "\x1b[{};{}H", y + 1, x + 1)?,
            }
            next = Some((y, x + 1));
            let codes: Vec<String> = style.codes_after(&said).iter().map(u8::to_string).collect();
            if !codes.is_empty() {
                write!(out, "\x1b[{}m", codes.join(";"))?;
            }
            said = style;
            write!(out, "{symbol}")?;
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
        Thrifty(CrosstermBackend::new(&mut written))
            .draw(places.into_iter().zip(&cells).map(|((x, y), cell)| (x, y, cell)))
            .unwrap();
        let expected =
            "\x1b[2;4H\x1b[38;5;75;48;5;233ma\x1b[5Cc\x1b[2;5H\x1b[38;5;79mb \x1b[3;1H\x1b[1md\x1b[m";
        assert_eq!(String::from_utf8(written).unwrap(), expected);
    }
}

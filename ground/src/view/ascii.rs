//! The same screen for a terminal without Unicode (`LANG=C`, a vt100): every cell one ASCII character.

use ratatui::buffer::Buffer;

/// First cell of the braille patterns; their low eight bits are the dots.
const BRAILLE: u32 = 0x2800;

/// Replaces what is not ASCII, cell by cell, so that nothing moves.
pub fn flatten(buffer: &mut Buffer) {
    for cell in &mut buffer.content {
        if !cell.symbol().is_ascii() {
            let symbol = cell.symbol().chars().next().map_or(' ', ascii);
            cell.set_char(symbol);
        }
    }
}

fn ascii(c: char) -> char {
    match c {
        '─' | '━' => '-',
        '│' | '┃' | '▐' | '▌' => '|',
        '┌' | '┐' | '└' | '┘' | '├' | '┤' | '┬' | '┴' | '┼' => '+',
        '█' => '#',
        '▀' => '"',
        '▄' => '_',
        '°' => 'd',
        '·' => '.',
        '↑' => '^',
        '↓' => 'v',
        '→' => '>',
        '←' => '<',
        _ => match u32::from(c).checked_sub(BRAILLE) {
            Some(dots @ 0..=0xFF) => match dots.count_ones() {
                0 => ' ',
                1..=2 => '.',
                3..=5 => ':',
                _ => '#',
            },
            _ => '?',
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ratatui::layout::Rect;
    use ratatui::style::Style;

    #[test]
    fn every_cell_becomes_ascii_and_none_moves() {
        let mut buffer = Buffer::empty(Rect::new(0, 0, 12, 1));
        buffer.set_string(0, 0, "a─│┌←⣿⠁⠀é█z", Style::new());
        flatten(&mut buffer);
        let text: String = buffer.content.iter().map(ratatui::buffer::Cell::symbol).collect();
        assert_eq!(text, "a-|+<#. ?#z ");
    }
}

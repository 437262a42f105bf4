//! Converts a drawn screen to ASCII, cell by cell, for terminals without Unicode (`LANG=C`, a vt100).

use ratatui::buffer::Buffer;

/// The first braille pattern; the low eight bits of a pattern are its dots.
const BRAILLE: u32 = 0x2800;

/// Replaces every character that is not ASCII, cell by cell, so that nothing moves.
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
        '█' | '▙' | '▛' | '▜' | '▟' | '▇' => '#',
        '▀' => '"',
        '▄' | '▁' | '▂' | '▃' => '_',
        '°' => 'd',
        '·' | '▖' | '▗' | '▘' | '▝' => '.',
        '•' => '*',
        '▚' | '▞' => '%',
        '▅' | '▆' => '=',
        '↑' => '^',
        '↓' => 'v',
        '→' | '…' => '>',
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

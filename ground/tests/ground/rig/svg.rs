//! Draws a screen of a terminal in memory as an SVG picture.

use std::fmt::Write as _;

use ratatui::buffer::{Buffer, Cell};
use ratatui::style::{Color, Modifier};

/// Pixels of a cell, and where the letters stand in it.
const CELL: (u16, u16) = (9, 18);
const BASELINE: u16 = 14;

/// The sixteen colours of a usual terminal.
const SIXTEEN: [[u8; 3]; 16] = [
    [0, 0, 0],
    [205, 49, 49],
    [13, 188, 121],
    [229, 229, 16],
    [36, 114, 200],
    [188, 63, 188],
    [17, 168, 205],
    [229, 229, 229],
    [102, 102, 102],
    [241, 76, 76],
    [35, 209, 139],
    [245, 245, 67],
    [59, 142, 234],
    [214, 112, 214],
    [41, 184, 219],
    [255, 255, 255],
];

/// Red, green and blue of a colour; `None` for the terminal's own.
pub(crate) fn rgb(colour: Color) -> Option<[u8; 3]> {
    let level = |part: u8| if part == 0 { 0 } else { 55 + 40 * part };
    match colour {
        Color::Reset => None,
        Color::Indexed(number @ 232..) => Some([8 + 10 * (number - 232); 3]),
        Color::Indexed(number @ 16..=231) => {
            let place = number - 16;
            Some([level(place / 36), level(place / 6 % 6), level(place % 6)])
        }
        Color::Indexed(number) => Some(SIXTEEN[usize::from(number)]),
        Color::Red => Some(SIXTEEN[1]),
        Color::Green => Some(SIXTEEN[2]),
        Color::Yellow => Some(SIXTEEN[3]),
        Color::Magenta => Some(SIXTEEN[5]),
        Color::Cyan => Some(SIXTEEN[6]),
        other => panic!("no theme uses {other}"),
    }
}

/// Colour of the letters and of the background.
pub(crate) fn colours(cell: &Cell) -> ([u8; 3], [u8; 3]) {
    let (fore, back) = (rgb(cell.fg).unwrap_or(SIXTEEN[7]), rgb(cell.bg).unwrap_or(SIXTEEN[0]));
    if cell.modifier.contains(Modifier::REVERSED) { (back, fore) } else { (fore, back) }
}

/// The quarters of a cell that a block covers, as parts of its width and height; `None` for other characters.
fn quarters(symbol: &str) -> Option<&'static [(f32, f32, f32, f32)]> {
    Some(match symbol {
        "█" => &[(0.0, 0.0, 1.0, 1.0)],
        "▀" => &[(0.0, 0.0, 1.0, 0.5)],
        "▄" => &[(0.0, 0.5, 1.0, 0.5)],
        "▌" => &[(0.0, 0.0, 0.5, 1.0)],
        "▐" => &[(0.5, 0.0, 0.5, 1.0)],
        "▘" => &[(0.0, 0.0, 0.5, 0.5)],
        "▝" => &[(0.5, 0.0, 0.5, 0.5)],
        "▖" => &[(0.0, 0.5, 0.5, 0.5)],
        "▗" => &[(0.5, 0.5, 0.5, 0.5)],
        "▚" => &[(0.0, 0.0, 0.5, 0.5), (0.5, 0.5, 0.5, 0.5)],
        "▞" => &[(0.5, 0.0, 0.5, 0.5), (0.0, 0.5, 0.5, 0.5)],
        "▙" => &[(0.0, 0.0, 0.5, 1.0), (0.5, 0.5, 0.5, 0.5)],
        "▛" => &[(0.0, 0.0, 1.0, 0.5), (0.0, 0.5, 0.5, 0.5)],
        "▜" => &[(0.0, 0.0, 1.0, 0.5), (0.5, 0.5, 0.5, 0.5)],
        "▟" => &[(0.5, 0.0, 0.5, 1.0), (0.0, 0.5, 0.5, 0.5)],
        _ => return None,
    })
}

/// The screen as a picture. Blocks are drawn as shapes, so that they join whatever the font.
pub(crate) fn picture(buffer: &Buffer) -> String {
    let (width, height) = (buffer.area.width * CELL.0, buffer.area.height * CELL.1);
    let hex = |[red, green, blue]: [u8; 3]| format!("#{red:02x}{green:02x}{blue:02x}");
    let page = colours(&buffer.content[0]).1;
    let svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" \
         font-family=\"DejaVu Sans Mono,Menlo,Consolas,monospace\" font-size=\"15\">\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"{}\"/>\n",
        hex(page)
    );
    let (mut shapes, mut texts) = (String::new(), String::new());
    for (row, cells) in buffer.content.chunks(usize::from(buffer.area.width)).enumerate() {
        let y = row as u16 * CELL.1;
        let mut at = 0;
        for run in cells.chunk_by(|one, next| colours(one) == colours(next) && one.modifier == next.modifier)
        {
            let (fore, back) = colours(&run[0]);
            let (x, columns) = (at * CELL.0, run.len() as u16 * CELL.0);
            if back != page {
                let _ = writeln!(
                    shapes,
                    "<rect x=\"{x}\" y=\"{y}\" width=\"{columns}\" height=\"{}\" fill=\"{}\"/>",
                    CELL.1,
                    hex(back)
                );
            }
            let mut path = String::new();
            let mut text = String::new();
            for (place, cell) in run.iter().enumerate() {
                let left = f32::from(x + place as u16 * CELL.0);
                match quarters(cell.symbol()) {
                    None => text.push_str(cell.symbol()),
                    Some(parts) => {
                        text.push(' ');
                        for (dx, dy, w, h) in parts {
                            let (w, h) = (w * f32::from(CELL.0), h * f32::from(CELL.1));
                            let (dx, dy) =
                                (left + dx * f32::from(CELL.0), f32::from(y) + dy * f32::from(CELL.1));
                            let _ = write!(path, "M{dx} {dy}h{w}v{h}h-{w}z");
                        }
                    }
                }
            }
            if !path.is_empty() {
                let _ = writeln!(shapes, "<path d=\"{path}\" fill=\"{}\"/>", hex(fore));
            }
            let begin = text.len() - text.trim_start().len();
            let trimmed = text.trim();
            if !trimmed.is_empty() {
                let (x, length) = (x + begin as u16 * CELL.0, trimmed.chars().count() as u16 * CELL.0);
                let bold =
                    if run[0].modifier.contains(Modifier::BOLD) { " font-weight=\"bold\"" } else { "" };
                // Several spaces would become one.
                let escaped = trimmed
                    .replace(' ', "\u{a0}")
                    .replace('&', "&amp;")
                    .replace('<', "&lt;")
                    .replace('>', "&gt;");
                let stretched =
                    if length > CELL.0 { format!(" textLength=\"{length}\"") } else { String::new() };
                let _ = writeln!(
                    texts,
                    "<text x=\"{x}\" y=\"{}\"{stretched} fill=\"{}\"{bold}>{escaped}</text>",
                    y + BASELINE,
                    hex(fore)
                );
            }
            at += run.len() as u16;
        }
    }
    svg + &shapes + &texts + "</svg>\n"
}

//! The QR code of a place (ISO/IEC 18004): a phone's camera reads it from the terminal, and the
//! phone shows the way.

use qrcode::render::{Renderer, unicode::Dense1x2};
use qrcode::{EcLevel, QrCode};
use ratatui::style::{Color, Style};
use ratatui::text::Line;

use crate::model::Degrees;

/// Rows of the code with a margin of two light modules, and with one. The standard asks for 4; a
/// phone's camera needs fewer, and a terminal is small.
const ROWS: [u16; 2] = [15, 14];
/// Its columns with the wider margin.
pub const COLUMNS: u16 = 29;

/// The code of a place as a `geo:` address (RFC 5870), two modules of height in a row; empty
/// without so many rows. Black on white whatever the theme is, because a camera expects that.
pub fn code(place: Degrees, rows: u16) -> Vec<Line<'static>> {
    let margin = match ROWS.iter().position(|needs| *needs <= rows) {
        Some(narrower) => 2 - narrower as u32,
        None => return Vec::new(),
    };
    let address = format!("geo:{:.6},{:.6}", place.latitude, place.longitude);
    let Ok(code) = QrCode::with_error_correction_level(address, EcLevel::L) else { return Vec::new() };
    let drawn = Renderer::<Dense1x2>::new(&code.to_colors(), code.width(), margin).build();
    let style = Style::new().fg(Color::Black).bg(Color::White);
    drawn.lines().map(|row| Line::styled(row.to_owned(), style)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Read by another implementation, from the cells as a camera sees them.
    #[test]
    fn val_rqrr_reads_the_place() {
        for (latitude, longitude, address) in [
            (35.347, -117.809, "geo:35.347000,-117.809000"),
            (-0.5, 179.999_999_6, "geo:-0.500000,180.000000"),
            (-84.123_456_7, -179.5, "geo:-84.123457,-179.500000"),
        ] {
            let rows: Vec<Vec<char>> = code(Degrees { latitude, longitude }, 20)
                .iter()
                .map(|line| line.to_string().chars().collect())
                .collect();
            assert_eq!((rows.len(), rows[0].len()), (15, 29), "{address}");
            // 4 pixels a module.
            let pixel = |x: usize, y: usize| {
                let cell = rows[y / 8].get(x / 4).copied().unwrap_or(' ');
                let is_upper = y % 8 < 4;
                if cell == '█' || (cell == '▀' && is_upper) || (cell == '▄' && !is_upper) {
                    0
                } else {
                    255
                }
            };
            let mut image = rqrr::PreparedImage::prepare_from_greyscale(4 * 29, 8 * 15, pixel);
            let grids = image.detect_grids();
            assert_eq!(grids.len(), 1, "{address}");
            assert_eq!(grids[0].decode().unwrap().1, address);
        }
    }
}

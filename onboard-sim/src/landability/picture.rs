//! Draws a map as an SVG picture.

use std::io::{self, Write};

use super::{Axis, Finding, Map};

const CELL_PX: usize = 14;
const LEFT_PX: usize = 70;
const TOP_PX: usize = 40;
const BOTTOM_PX: usize = 70;
const RIGHT_PX: usize = 20;

/// Writes the picture. A tooltip on every cell shows its values and its touchdown speed.
///
/// # Errors
/// The output cannot be written.
pub fn write_svg(map: &Map, profile_name: &str, out: &mut impl Write) -> io::Result<()> {
    let (inner_width, inner_height) = (CELL_PX * map.x.count, CELL_PX * map.y.count);
    let width = (LEFT_PX + inner_width + RIGHT_PX).max(420);
    let height = TOP_PX + inner_height + BOTTOM_PX;
    writeln!(
        out,
        r#"<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" font-family="sans-serif" font-size="12">"#
    )?;
    writeln!(out, r#"<rect width="{width}" height="{height}" fill="white"/>"#)?;
    let title = escaped(profile_name);
    writeln!(out, r#"<text x="{LEFT_PX}" y="24" font-size="14">Where {title} can land</text>"#)?;
    for (place, cell) in map.cells.iter().enumerate() {
        let (column, row) = (place % map.x.count, place / map.x.count);
        let x_px = LEFT_PX + CELL_PX * column;
        let y_px = TOP_PX + CELL_PX * (map.y.count - 1 - row);
        writeln!(
            out,
            r#"<rect x="{x_px}" y="{y_px}" width="{CELL_PX}" height="{CELL_PX}" fill="{}"><title>{} {:.3}, {} {:.3}: {}, {:.2} m/s</title></rect>"#,
            colour(cell.finding),
            map.x.quantity.label(),
            map.x.value(column),
            map.y.quantity.label(),
            map.y.value(row),
            cell.finding.name(),
            cell.touchdown_speed_m_s
        )?;
    }
    let base_px = TOP_PX + inner_height;
    for (value, x_px) in ends(map.x, LEFT_PX, LEFT_PX + inner_width) {
        writeln!(out, r#"<text x="{x_px}" y="{}" text-anchor="middle">{value:.3}</text>"#, base_px + 16)?;
    }
    for (value, y_px) in ends(map.y, base_px, TOP_PX + 10) {
        writeln!(out, r#"<text x="{}" y="{y_px}" text-anchor="end">{value:.3}</text>"#, LEFT_PX - 6)?;
    }
    let middle_px = LEFT_PX + inner_width / 2;
    writeln!(
        out,
        r#"<text x="{middle_px}" y="{}" text-anchor="middle">{}</text>"#,
        base_px + 16,
        map.x.quantity.label()
    )?;
    let side_px = TOP_PX + inner_height / 2;
    writeln!(
        out,
        r#"<text x="16" y="{side_px}" text-anchor="middle" transform="rotate(-90 16 {side_px})">{}</text>"#,
        map.y.quantity.label()
    )?;
    let legend = [Finding::Lands, Finding::Misses, Finding::NotLandable];
    for (place, finding) in legend.into_iter().enumerate() {
        let x_px = LEFT_PX + 110 * place;
        let y_px = base_px + 34;
        writeln!(out, r#"<rect x="{x_px}" y="{y_px}" width="12" height="12" fill="{}"/>"#, colour(finding))?;
        writeln!(out, r#"<text x="{}" y="{}">{}</text>"#, x_px + 18, y_px + 11, finding.name())?;
    }
    writeln!(out, "</svg>")
}

/// Also different in greyscale: light, middle, dark.
fn colour(finding: Finding) -> &'static str {
    match finding {
        Finding::Lands => "#7fc97f",
        Finding::Misses => "#e6a23c",
        Finding::NotLandable => "#5b4b6b",
    }
}

fn ends(axis: Axis, first_px: usize, last_px: usize) -> [(f64, usize); 2] {
    [(axis.value(0), first_px), (axis.value(axis.count - 1), last_px)]
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

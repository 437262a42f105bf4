//! Draws a map as an SVG picture.

use super::{Axis, Finding, Map};
use crate::figure::{CellAxis, Cells, FigureError, cells_svg};

/// The map as SVG, below a title.
///
/// # Errors
/// An axis is not finite.
pub fn svg(map: &Map, title: &str) -> Result<String, FigureError> {
    let axis = |axis: Axis| CellAxis {
        label: axis.quantity.label().to_owned(),
        first: axis.from,
        last: axis.to,
        count: axis.count,
    };
    let cells: Vec<usize> = map.cells.iter().map(|cell| cell.finding as usize).collect();
    let kinds = Finding::ALL.map(|finding| (finding.name(), finding.colour()));
    cells_svg(title, &Cells { x: axis(map.x), y: axis(map.y), kinds: &kinds, cells: &cells })
}

//! A map: coloured cells over two quantities.

use plotters::chart::ChartBuilder;
use plotters::element::Rectangle;
use plotters::style::{Color as _, RGBColor};

use super::legend::Legend;
use super::{Drawn, FONT, FigureError, drawn, number};

/// Size of the axes' area, px.
const MAP_PX: (u32, u32) = (760, 520);

/// An axis: evenly spaced values in the middles of the cells.
#[derive(Debug, Clone, PartialEq)]
pub struct CellAxis {
    pub label: String,
    pub first: f64,
    pub last: f64,
    pub count: usize,
}

/// What to draw.
#[derive(Debug, Clone, PartialEq)]
pub struct Cells<'a> {
    pub x: CellAxis,
    pub y: CellAxis,
    /// Names and colours (red, green, blue) of the kinds of cells.
    pub kinds: &'a [(&'a str, [u8; 3])],
    /// The kind of each cell, row by row, the first row at the first value of `y`.
    pub cells: &'a [usize],
}

impl CellAxis {
    /// The two edges of a cell.
    fn edges(&self, place: usize) -> (f64, f64) {
        let step = self.step();
        let middle = self.first + step * place as f64;
        (middle - 0.5 * step, middle + 0.5 * step)
    }

    fn step(&self) -> f64 {
        let steps = self.count.saturating_sub(1);
        if steps == 0 { 1.0 } else { (self.last - self.first) / steps as f64 }
    }

    /// The outer edges, in ascending order.
    fn ends(&self) -> (f64, f64) {
        let (from, to) = (self.edges(0).0, self.edges(self.count.saturating_sub(1)).1);
        (from.min(to), from.max(to))
    }
}

/// The map as SVG.
///
/// # Errors
/// An axis is not finite.
pub fn cells_svg(title: &str, map: &Cells<'_>) -> Result<String, FigureError> {
    let (width_px, height_px) = MAP_PX;
    let colour = |kind: usize| {
        let [red, green, blue] = map.kinds.get(kind).map_or([0; 3], |(_, colour)| *colour);
        RGBColor(red, green, blue)
    };
    let legend = Legend::new(map.kinds.iter().map(|(name, _)| (*name).to_owned()).collect(), width_px);
    drawn(title, (width_px, height_px + legend.height_px()), |root| -> Drawn {
        let (upper, lower) = root.split_vertically(height_px);
        let ((left, right), (bottom, top)) = (map.x.ends(), map.y.ends());
        if ![left, right, bottom, top].iter().all(|end| end.is_finite()) {
            return Err("an axis is not finite".into());
        }
        let mut chart = ChartBuilder::on(&upper)
            .margin(14)
            .x_label_area_size(46)
            .y_label_area_size(66)
            .build_cartesian_2d(left..right, bottom..top)?;
        chart.draw_series(map.cells.iter().enumerate().map(|(place, kind)| {
            let (from, to) = map.x.edges(place % map.x.count);
            let (below, above) = map.y.edges(place / map.x.count);
            Rectangle::new([(from, below), (to, above)], colour(*kind).filled())
        }))?;
        chart
            .configure_mesh()
            .disable_mesh()
            .x_label_formatter(&number((left, right)))
            .y_label_formatter(&number((bottom, top)))
            .label_style(FONT)
            .axis_desc_style(FONT)
            .x_desc(map.x.label.clone())
            .y_desc(map.y.label.clone())
            .draw()?;
        legend.draw(&lower, |area, place, (left, middle)| {
            let corners = [(left + 4, middle - 7), (left + 20, middle + 7)];
            area.draw(&Rectangle::new(corners, colour(place).filled()))?;
            Ok(())
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cell_is_drawn_and_every_kind_is_named() {
        let axis = |label: &str, last| CellAxis { label: label.to_owned(), first: 0.0, last, count: 3 };
        let map = Cells {
            x: axis("tilt, deg", 10.0),
            y: axis("wind, m/s", 4.0),
            kinds: &[("lands", [1, 2, 3]), ("misses", [4, 5, 6])],
            cells: &[0, 1, 1, 0, 0, 1, 1, 1, 1],
        };
        let svg = cells_svg("a & b", &map).unwrap();
        for text in ["a &amp; b", "tilt, deg", "wind, m/s", "lands", "misses"] {
            assert!(svg.contains(text), "{text}");
        }
        // Each once more in the legend.
        assert_eq!([svg.matches("#010203").count(), svg.matches("#040506").count()], [3 + 1, 6 + 1]);
        let broken = Cells { x: axis("", f64::NAN), ..map };
        assert!(cells_svg("", &broken).is_err());
    }
}

//! Curves in panels side by side, with one legend.

use plotters::chart::ChartBuilder;
use plotters::element::{Cross, PathElement};
use plotters::series::{DashedLineSeries, LineSeries};
use plotters::style::{BLACK, Color as _, RGBColor, ShapeStyle};

use super::legend::Legend;
use super::{Area, COLOURS, Drawn, FONT, FigureError, drawn, number};

/// Size of a panel, px: one of several, and one alone.
const PANEL_PX: (u32, u32) = (400, 340);
const LONE_PANEL_PX: (u32, u32) = (720, 500);
/// Length of the dashes and of the gaps, px.
const DASH_PX: (i32, i32) = (8, 5);
/// Room beside the outermost points, of the extent.
const ROOM: f64 = 0.06;

/// A curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// In the legend; curves of one name share their entry.
    pub name: String,
    /// Which colour, counted from 0.
    pub colour: usize,
    pub dashed: bool,
    /// In the panel's own units.
    pub points: Vec<(f64, f64)>,
}

/// One pair of axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    pub x_label: String,
    pub y_label: String,
    pub lines: Vec<Line>,
    /// Crosses, each with the colour of a curve.
    pub crosses: Vec<(f64, f64, usize)>,
}

/// Panels in rows of `columns`, below a title. `cross_name` says what the crosses are.
///
/// # Errors
/// A panel has no finite point.
pub fn lines_svg(
    title: &str,
    panels: &[Panel],
    columns: usize,
    cross_name: Option<&str>,
) -> Result<String, FigureError> {
    let (panel_width_px, panel_height_px) = if panels.len() == 1 { LONE_PANEL_PX } else { PANEL_PX };
    let rows = panels.len().div_ceil(columns.max(1));
    let (width_px, panels_px) = (columns as u32 * panel_width_px, rows as u32 * panel_height_px);
    let mut named: Vec<&Line> = Vec::new();
    for line in panels.iter().flat_map(|panel| &panel.lines) {
        if !named.iter().any(|known| known.name == line.name) {
            named.push(line);
        }
    }
    let names = named.iter().map(|line| line.name.clone()).chain(cross_name.map(str::to_owned));
    let legend = Legend::new(names.collect(), width_px);
    drawn(title, (width_px, panels_px + legend.height_px()), |root| {
        let (upper, lower) = root.split_vertically(panels_px);
        for (area, panel) in upper.split_evenly((rows, columns)).iter().zip(panels) {
            draw_panel(area, panel)?;
        }
        legend.draw(&lower, |area, entry, place| draw_sample(area, named.get(entry).copied(), place))
    })
}

fn draw_panel(area: &Area<'_>, panel: &Panel) -> Drawn {
    let points = || {
        let of_lines = panel.lines.iter().flat_map(|line| line.points.iter().copied());
        of_lines.chain(panel.crosses.iter().map(|(x, y, _)| (*x, *y)))
    };
    let x = extent(points().map(|point| point.0)).ok_or("no finite point")?;
    let y = extent(points().map(|point| point.1)).ok_or("no finite point")?;
    let mut chart = ChartBuilder::on(area)
        .margin(12)
        .x_label_area_size(42)
        .y_label_area_size(62)
        .build_cartesian_2d(x.0..x.1, y.0..y.1)?;
    chart
        .configure_mesh()
        .x_labels(7)
        .y_labels(8)
        .x_label_formatter(&number(x))
        .y_label_formatter(&number(y))
        .label_style(FONT)
        .axis_desc_style(FONT)
        .x_desc(panel.x_label.clone())
        .y_desc(panel.y_label.clone())
        .light_line_style(RGBColor(245, 245, 245))
        .bold_line_style(RGBColor(222, 222, 222))
        .draw()?;
    for line in &panel.lines {
        let points = line.points.iter().copied();
        if line.dashed {
            let (dash_px, gap_px) = DASH_PX;
            chart.draw_series(DashedLineSeries::new(points, dash_px, gap_px, style(line.colour)))?;
        } else {
            chart.draw_series(LineSeries::new(points, style(line.colour)))?;
        }
    }
    let crosses = panel.crosses.iter().map(|(x, y, colour)| Cross::new((*x, *y), 5, style(*colour)));
    chart.draw_series(crosses)?;
    Ok(())
}

/// A piece of a curve, or a cross.
fn draw_sample(area: &Area<'_>, line: Option<&Line>, (left, middle): (i32, i32)) -> Drawn {
    let Some(line) = line else {
        area.draw(&Cross::new((left + 10, middle), 5, BLACK.stroke_width(2)))?;
        return Ok(());
    };
    let pieces = if line.dashed { vec![(0, 8), (12, 20)] } else { vec![(0, 20)] };
    for (from, to) in pieces {
        area.draw(&PathElement::new([(left + from, middle), (left + to, middle)], style(line.colour)))?;
    }
    Ok(())
}

fn style(colour: usize) -> ShapeStyle {
    COLOURS[colour % COLOURS.len()].stroke_width(2)
}

/// Least and most with some room; `None` without a finite value.
fn extent(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let (least, most) = values
        .filter(|value| value.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), value| (least.min(value), most.max(value)));
    let room = if most > least { ROOM * (most - least) } else { 0.5 };
    (least <= most).then_some((least - room, most + room))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panel(points: Vec<(f64, f64)>) -> Panel {
        let line = Line { name: "a < b".to_owned(), colour: 0, dashed: false, points };
        let (x_label, y_label) = ("time, s".to_owned(), "height, m".to_owned());
        Panel { x_label, y_label, lines: vec![line], crosses: vec![(0.5, 0.5, 0)] }
    }

    #[test]
    fn a_figure_names_its_axes_and_curves_and_a_curve_without_points_is_refused() {
        let panels = [panel(vec![(0.0, 0.0), (1.0, 2.0)]), panel(vec![(0.0, 1.0), (1.0, 1.0)])];
        let svg = lines_svg("Fig. 0", &panels, 2, Some("paper")).unwrap();
        for text in ["Fig. 0", "time, s", "height, m", "a &lt; b", "paper"] {
            assert!(svg.contains(text), "{text}");
        }
        assert_eq!(svg.matches("a &lt; b").count(), 1);
        let empty = Panel { crosses: vec![], ..panel(vec![(f64::NAN, 1.0)]) };
        let error = lines_svg("Fig. 0", &[empty], 1, None).unwrap_err();
        assert_eq!(error.to_string(), "cannot draw the figure 'Fig. 0': no finite point");
    }
}

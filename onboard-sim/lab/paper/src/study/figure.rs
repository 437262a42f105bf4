//! Figures as SVG, drawn with `plotters`: the best maintained plotting crate that writes SVG
//! without fonts, images or a browser (three small crates, 6 s of a build); ticks, axes and
//! escaping are its own.

use std::collections::BTreeSet;

use plotters::backend::SVGBackend;
use plotters::chart::{ChartBuilder, ChartContext};
use plotters::coord::Shift;
use plotters::coord::cartesian::Cartesian2d;
use plotters::coord::types::RangedCoordf64;
use plotters::drawing::{DrawingArea, IntoDrawingArea as _};
use plotters::element::{Cross, EmptyElement, PathElement, Text};
use plotters::series::{DashedLineSeries, LineSeries};
use plotters::style::{BLACK, Color as _, RGBColor, ShapeStyle, TRANSPARENT, WHITE};

/// A figure cannot be drawn: its axes are not finite, or too small for their labels.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("cannot draw the figure '{title}': {reason}")]
pub(crate) struct FigureError {
    title: String,
    reason: String,
}

/// Okabe and Ito's colours that differ for every kind of colour vision, and in grey; and a grey.
const COLOURS: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(0, 0, 0),
    FAINT,
];
const FAINT: RGBColor = RGBColor(130, 130, 130);

/// Font and size, px, of titles and of everything else.
const TITLE_FONT: (&str, i32) = ("sans-serif", 18);
const FONT: (&str, i32) = ("sans-serif", 13);

/// Height of the title, px.
const TITLE_PX: u32 = 34;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;
type Drawn<T = ()> = Result<T, Box<dyn std::error::Error>>;

/// The SVG of what a function draws on a white ground of this size, px, below a title.
fn drawn(
    title: &str,
    size_px: (u32, u32),
    draw: impl FnOnce(&Area<'_>) -> Drawn,
) -> Result<String, FigureError> {
    let mut svg = String::new();
    let (width_px, height_px) = size_px;
    let all = || -> Drawn {
        let root = SVGBackend::with_string(&mut svg, (width_px, TITLE_PX + height_px)).into_drawing_area();
        root.fill(&WHITE)?;
        draw(&root.titled(title, TITLE_FONT)?)?;
        root.present()?;
        Ok(())
    };
    all().map_err(|error| FigureError { title: title.to_owned(), reason: error.to_string() })?;
    Ok(svg)
}

/// Axes over two ranges, with ticks and names.
fn axes<'a, 'b>(
    area: &'a Area<'b>,
    [x, y]: [(f64, f64); 2],
    [x_label, y_label]: [&str; 2],
) -> Drawn<Chart<'a, 'b>> {
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
        .x_desc(x_label)
        .y_desc(y_label)
        .light_line_style(TRANSPARENT)
        .bold_line_style(RGBColor(222, 222, 222))
        .draw()?;
    Ok(chart)
}

/// Writes a tick with the decimals that its axis needs.
fn number((from, to): (f64, f64)) -> impl Fn(&f64) -> String {
    let decimals = (1.0 - libm::floor(libm::log10((to - from) / 2.0))).clamp(0.0, 6.0) as usize;
    move |value| {
        let text = format!("{value:.decimals$}");
        let short = if decimals > 0 { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
        if short == "-0" { "0".to_owned() } else { short.to_owned() }
    }
}

/// Width of a sample, of an entry of the legend and of the margin, and height of a row, px.
const SAMPLE_PX: i32 = 26;
const ENTRY_PX: u32 = 230;
const LEFT_PX: i32 = 16;
const ROW_PX: u32 = 24;

/// Length of the dashes and of the gaps, px.
const DASH_PX: (i32, i32) = (8, 5);
/// Room beside the outermost points, of the extent.
const ROOM: f64 = 0.06;

/// A curve.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Line {
    /// In the legend; curves of one name share their entry.
    pub(crate) name: String,
    /// Which colour, counted from 0.
    pub(crate) colour: usize,
    pub(crate) dashed: bool,
    /// In the panel's own units.
    pub(crate) points: Vec<(f64, f64)>,
}

/// One pair of axes.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Panel {
    pub(crate) x_label: String,
    pub(crate) y_label: String,
    pub(crate) lines: Vec<Line>,
    /// Places of several kinds, each kind with its name. All panels of a figure have the same
    /// kinds.
    pub(crate) kinds: Vec<(String, Vec<(f64, f64)>)>,
    /// Crosses, each with the colour of a curve.
    pub(crate) crosses: Vec<(f64, f64, usize)>,
}

/// Panels in rows of `columns`, smaller ones if there are several, below a title. `cross_name` says
/// what the crosses are.
///
/// # Errors
/// A panel has no finite point, or is too small.
pub(crate) fn lines_svg(
    title: &str,
    panels: &[Panel],
    columns: usize,
    cross_name: Option<&str>,
) -> Result<String, FigureError> {
    let (panel_width_px, panel_height_px) = if panels.len() == 1 { (720, 500) } else { (400, 340) };
    let rows = panels.len().div_ceil(columns.max(1));
    let (width_px, panels_px) = (columns as u32 * panel_width_px, rows as u32 * panel_height_px);
    let mut names = BTreeSet::new();
    let mut lines: Vec<&Line> = panels.iter().flat_map(|panel| &panel.lines).collect();
    lines.retain(|line| names.insert(&line.name));
    let kinds = panels.first().map_or(&[][..], |panel| &panel.kinds);
    let names = kinds.iter().map(|(name, _)| name).chain(lines.iter().map(|line| &line.name));
    let names: Vec<&str> = names.map(String::as_str).chain(cross_name).collect();
    let per_row = width_px / ENTRY_PX;
    let legend_px = (names.len() as u32).div_ceil(per_row) * ROW_PX;
    drawn(title, (width_px, panels_px + legend_px), |root| {
        let (upper, lower) = root.split_vertically(panels_px);
        for (area, panel) in upper.split_evenly((rows, columns)).iter().zip(panels) {
            draw_panel(area, panel)?;
        }
        for ((entry, name), place) in names.iter().enumerate().zip(0..) {
            let left = LEFT_PX + (ENTRY_PX * (place % per_row)).cast_signed();
            let middle = (ROW_PX * (place / per_row) + ROW_PX / 2).cast_signed();
            match entry.checked_sub(kinds.len()) {
                None => lower.draw(&(EmptyElement::at((left + 10, middle)) + mark(entry)))?,
                Some(line) => draw_sample(&lower, lines.get(line).copied(), (left, middle))?,
            }
            lower.draw(&Text::new(*name, (left + SAMPLE_PX, middle - 7), FONT))?;
        }
        Ok(())
    })
}

fn draw_panel(area: &Area<'_>, panel: &Panel) -> Drawn {
    let points = || {
        let of_lines = panel.lines.iter().flat_map(|line| line.points.iter().copied());
        let of_kinds = panel.kinds.iter().flat_map(|(_, places)| places.iter().copied());
        of_lines.chain(of_kinds).chain(panel.crosses.iter().map(|(x, y, _)| (*x, *y)))
    };
    let x = extent(points().map(|point| point.0)).ok_or("no finite point")?;
    let y = extent(points().map(|point| point.1)).ok_or("no finite point")?;
    let mut chart = axes(area, [x, y], [&panel.x_label, &panel.y_label])?;
    for (kind, (_, places)) in panel.kinds.iter().enumerate() {
        let finite = places.iter().filter(|(x, y)| x.is_finite() && y.is_finite());
        chart.draw_series(finite.map(|place| EmptyElement::at(*place) + mark(kind)))?;
    }
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

/// The mark of a kind: no meaning is in a colour alone.
fn mark(kind: usize) -> PathElement<(i32, i32)> {
    const SHAPES: [&[(i32, i32)]; 4] = [
        &[(-3, -3), (3, -3), (3, 3), (-3, 3), (-3, -3)],
        &[(-4, -4), (4, 4), (0, 0), (-4, 4), (4, -4)],
        &[(0, -4), (4, 3), (-4, 3), (0, -4)],
        &[(-5, 0), (5, 0), (0, 0), (0, -5), (0, 5)],
    ];
    PathElement::new(SHAPES[kind % SHAPES.len()], COLOURS[kind % COLOURS.len()].stroke_width(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_have_the_decimals_of_their_axis() {
        assert_eq!(number((0.0, 5.0))(&2.5), "2.5");
        assert_eq!(number((0.0, 5.0))(&-0.0), "0");
        assert_eq!(number((0.0, 300.0))(&120.0), "120");
        assert_eq!(number((-0.02, 0.02))(&0.005), "0.005");
    }

    fn panel(points: Vec<(f64, f64)>) -> Panel {
        let line = Line { name: "a < b".to_owned(), colour: 0, dashed: false, points };
        let (x_label, y_label) = ("time, s".to_owned(), "height, m".to_owned());
        Panel { x_label, y_label, lines: vec![line], crosses: vec![(0.5, 0.5, 0)], ..Panel::default() }
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

    #[test]
    fn the_legend_names_every_kind_once() {
        let kinds = || {
            vec![
                ("settles".to_owned(), vec![(1.0, 2.0), (3.0, f64::NAN)]),
                ("a < b".to_owned(), vec![(-40.0, 5.0)]),
            ]
        };
        let panels = [(); 2].map(|()| Panel { kinds: kinds(), ..Panel::default() });
        let svg = lines_svg("falls", &panels, 2, None).unwrap();
        for text in ["settles", "a &lt; b"] {
            assert_eq!(svg.matches(text).count(), 1, "{text}");
        }
    }
}

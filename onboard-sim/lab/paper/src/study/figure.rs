//! Figures as SVG, drawn with `plotters`: the best maintained plotting crate that writes SVG without fonts, images or a browser
//! (three small crates, 6 s of a build); ticks, axes and escaping are its own.

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
    if ![x.0, x.1, y.0, y.1].iter().all(|end| end.is_finite()) {
        return Err("an axis is not finite".into());
    }
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

/// Width of a letter and of a sample with the room around it, px. SVG does not tell how wide a text is.
const LETTER_PX: i32 = 7;
const SAMPLE_PX: i32 = 26;
const GAP_PX: i32 = 18;
const LEFT_PX: i32 = 16;
const ROW_PX: i32 = 24;
/// Letters of a name that count.
const LONGEST: i32 = 1000;

/// Names at their places.
struct Legend {
    names: Vec<String>,
    /// Left end and middle of each name's sample, px.
    places: Vec<(i32, i32)>,
}

impl Legend {
    /// Names in rows of a width, px.
    fn new(names: Vec<String>, width_px: u32) -> Self {
        let (mut left_px, mut row) = (LEFT_PX, 0);
        let mut place = |name: &String| {
            let letters = i32::try_from(name.chars().count()).unwrap_or(LONGEST).min(LONGEST);
            let entry_px = SAMPLE_PX + LETTER_PX * letters + GAP_PX;
            if left_px > LEFT_PX && left_px + entry_px > width_px.cast_signed() {
                (left_px, row) = (LEFT_PX, row + 1);
            }
            let place = (left_px, row * ROW_PX + ROW_PX / 2);
            left_px += entry_px;
            place
        };
        let places = names.iter().map(&mut place).collect();
        Self { names, places }
    }

    /// Height of all rows, px.
    fn height_px(&self) -> u32 {
        let last = self.places.last().map_or(0, |(_, middle)| middle + ROW_PX / 2);
        last as u32 + ROW_PX as u32 / 2
    }

    /// Draws every name behind what `sample` draws for it from a place, px.
    fn draw(&self, area: &Area<'_>, mut sample: impl FnMut(&Area<'_>, usize, (i32, i32)) -> Drawn) -> Drawn {
        for (entry, (name, (left, middle))) in self.names.iter().zip(&self.places).enumerate() {
            sample(area, entry, (*left, *middle))?;
            area.draw(&Text::new(name.clone(), (left + SAMPLE_PX, middle - 7), FONT))?;
        }
        Ok(())
    }
}

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
    /// Places of several kinds, each kind with its name. All panels of a figure have the same kinds.
    pub(crate) kinds: Vec<(String, Vec<(f64, f64)>)>,
    /// Crosses, each with the colour of a curve.
    pub(crate) crosses: Vec<(f64, f64, usize)>,
}

/// Panels in rows of `columns`, smaller ones if there are several, below a title. `cross_name` says what the crosses are.
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
    let mut named: Vec<&Line> = Vec::new();
    for line in panels.iter().flat_map(|panel| &panel.lines).filter(|line| !line.name.is_empty()) {
        if !named.iter().any(|known| known.name == line.name) {
            named.push(line);
        }
    }
    let kinds = panels.first().map_or(&[][..], |panel| &panel.kinds);
    let names = kinds.iter().map(|(name, _)| name).chain(named.iter().map(|line| &line.name));
    let legend = Legend::new(names.cloned().chain(cross_name.map(str::to_owned)).collect(), width_px);
    drawn(title, (width_px, panels_px + legend.height_px()), |root| {
        let (upper, lower) = root.split_vertically(panels_px);
        for (area, panel) in upper.split_evenly((rows, columns)).iter().zip(panels) {
            draw_panel(area, panel)?;
        }
        legend.draw(&lower, |area, entry, (left, middle)| match entry.checked_sub(kinds.len()) {
            None => Ok(area.draw(&(EmptyElement::at((left + 10, middle)) + mark(entry)))?),
            Some(line) => draw_sample(area, named.get(line).copied(), (left, middle)),
        })
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

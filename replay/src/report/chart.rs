//! A line chart as SVG, in the colours of the page.

use onboard_sim::figure::{Line, Panel, ends, plotted_px, sized_lines_svg};

use super::html::escaped;

const WIDTH_PX: u32 = 520;
const HEIGHT_PX: u32 = 260;
/// Height of a tall picture, which is placed next to three others.
const TALL_PX: u32 = 800;
/// Most points drawn for one line; more points than pixels cannot be seen.
const POINTS_MAX: usize = 1200;
/// Samples that are this many times the usual gap apart are not joined.
const FAR_GAPS: f64 = 5.0;
/// A line whose values differ by less than this share says nothing.
const NOTHING: f64 = 1e-9;

/// The classes of lines, in the order of the figure's colours.
const CLASSES: [&str; 6] = ["a", "b", "c", "d", "", "thin"];
/// What the figure writes, and what the page has in its place: its style gives colours in light and in dark.
const THEME: [(&str, &str); 14] = [
    ("stroke=\"#0072B2\"", "class=\"l a\""),
    ("stroke=\"#D55E00\"", "class=\"l b\""),
    ("stroke=\"#009E73\"", "class=\"l c\""),
    ("stroke=\"#CC79A7\"", "class=\"l d\""),
    ("stroke=\"#828282\"", "class=\"thin\""),
    ("stroke=\"#B3261E\"", "class=\"limit\""),
    ("fill=\"#B3261E\"", "class=\"sign\""),
    ("fill=\"#FDEBD0\"", "class=\"hot\""),
    ("fill=\"#E8ECF5\"", "class=\"cool\""),
    ("stroke=\"#DEDEDE\"", "class=\"grid\""),
    ("stroke=\"#000000\"", "class=\"frame\""),
    ("fill=\"#000000\"", "class=\"text\""),
    ("fill=\"#FFFFFF\"", "class=\"ground\""),
    ("xmlns=\"http://www.w3.org/2000/svg\"", ""),
];

/// A line of the figure. Its class is `a` to `d`, or `thin`; an empty name is not in the legend.
pub(super) fn line(name: &str, class: &str, points: Vec<(f64, f64)>) -> Line {
    let colour = CLASSES.iter().position(|known| *known == class).unwrap_or(0);
    Line { name: name.to_owned(), colour, dashed: false, points }
}

/// A picture: a panel of the figure, and how it stands on the page.
#[derive(Clone, Default)]
pub(super) struct Chart {
    pub(super) title: String,
    pub(super) panel: Panel,
    /// Whether the x axis is no time: a path may turn back on it.
    pub(super) own_x: bool,
    /// Whether the chart takes the whole width of the page.
    pub(super) full: bool,
}

impl Chart {
    /// A picture without a time axis.
    pub(super) fn new(title: &str, [x_label, y_label]: [&str; 2], lines: Vec<Line>) -> Self {
        let [title, x_label, y_label] = [title, x_label, y_label].map(str::to_owned);
        Self { title, panel: Panel { x_label, y_label, lines, ..Panel::default() }, own_x: true, full: false }
    }

    /// The chart, or nothing if there is no point to draw.
    pub(super) fn svg(&self) -> String {
        let spread = |axis: fn(&(f64, f64)) -> f64| {
            let points = self.panel.lines.iter().flat_map(|line| &line.points);
            let finite = points.filter(|(x, y)| x.is_finite() && y.is_finite()).map(axis);
            let ends =
                finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), value| (a.min(value), b.max(value)));
            (ends.1 - ends.0, ends.0.abs().max(ends.1.abs()))
        };
        let ((width, _), (height, largest)) = (spread(|point| point.0), spread(|point| point.1));
        let says_nothing = height <= NOTHING * largest;
        if !(width.is_finite() && height.is_finite()) || (says_nothing && !self.panel.equal_scales) {
            return String::new();
        }
        // A path in equal scales that is taller than wide gets a tall picture.
        let (class, size_px) = match (self.panel.equal_scales, self.full) {
            (true, true) if height > width => ("tall", (WIDTH_PX, TALL_PX)),
            (true, true) => ("full", (2 * WIDTH_PX, 2 * HEIGHT_PX)),
            (true, false) => ("square", (WIDTH_PX, 2 * HEIGHT_PX)),
            (false, true) => ("full", (2 * WIDTH_PX, HEIGHT_PX)),
            (false, false) => ("", (WIDTH_PX, HEIGHT_PX)),
        };
        let lines = self.panel.lines.iter().flat_map(|line| self.pieces(line)).collect();
        let panel = Panel { lines, ..self.panel.clone() };
        let measured = ends(&panel, size_px);
        let Ok(svg) = sized_lines_svg(&self.title, &[panel], 1, None, size_px) else {
            return String::new();
        };
        let svg = THEME.into_iter().fold(svg, |svg, (written, shown)| svg.replace(written, shown));
        // What the reader's pointer needs to tell times and values from pixels.
        let over_time = if self.own_x || self.panel.equal_scales { None } else { measured };
        let scales = over_time.map_or_else(String::new, |[x, y]| {
            let [left, top, right, bottom] = plotted_px(size_px);
            format!(
                " data-x=\"{:.4} {:.4}\" data-y=\"{:.6} {:.6}\" data-px=\"{left} {top} {right} {bottom}\"",
                x.0, x.1, y.0, y.1
            )
        });
        format!(
            "<figure class=\"{class}\" role=\"img\" aria-label=\"{}\"{scales}>{svg}</figure>\n",
            escaped(&self.title)
        )
    }

    /// The pieces of a line: nothing is known at a gap, and between samples that are much further apart than usual.
    fn pieces(&self, line: &Line) -> Vec<Line> {
        let is_path = self.panel.equal_scales || self.own_x;
        let far = if is_path { f64::INFINITY } else { usual_gap(&line.points) * FAR_GAPS };
        let points = thinned(&line.points);
        let is_joined =
            |a: &(f64, f64), b: &(f64, f64)| b.0 - a.0 <= far && a.1.is_finite() && b.1.is_finite();
        let known = |piece: &&[(f64, f64)]| piece[0].0.is_finite() && piece[0].1.is_finite();
        let piece = |piece: &[(f64, f64)]| {
            let mut points = piece.to_vec();
            // A line of no length, which its round ends show as a dot.
            points.extend(piece.first().filter(|_| piece.len() == 1));
            Line { name: line.name.clone(), points, ..*line }
        };
        points.chunk_by(is_joined).filter(known).map(piece).collect()
    }
}

/// The median of the distances between neighbouring points along x.
fn usual_gap(points: &[(f64, f64)]) -> f64 {
    let mut gaps: Vec<f64> = points.windows(2).map(|pair| pair[1].0 - pair[0].0).collect();
    gaps.retain(|gap| gap.is_finite());
    gaps.sort_by(f64::total_cmp);
    // Thinned points are further apart.
    let thinning = points.len().div_ceil(POINTS_MAX).max(1) as f64;
    gaps.get(gaps.len() / 2).map_or(f64::INFINITY, |gap| gap * thinning)
}

/// At most [`POINTS_MAX`] points, including the highest and lowest of every stretch.
fn thinned(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    if points.len() <= POINTS_MAX {
        return points.to_vec();
    }
    let mut kept = Vec::new();
    for stretch in points.chunks(points.len().div_ceil(POINTS_MAX / 2)) {
        let lowest = (0..stretch.len()).min_by(|a, b| stretch[*a].1.total_cmp(&stretch[*b].1));
        let highest = (0..stretch.len()).max_by(|a, b| stretch[*a].1.total_cmp(&stretch[*b].1));
        if let (Some(a), Some(b)) = (lowest, highest) {
            kept.push(stretch[a.min(b)]);
            kept.push(stretch[a.max(b)]);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_line(points: Vec<(f64, f64)>) -> Chart {
        let panel = Panel { lines: vec![line("", "a", points)], ..Panel::default() };
        Chart { panel, ..Chart::default() }
    }

    #[test]
    fn peaks_survive_the_thinning_and_gaps_stay_gaps() {
        let mut points: Vec<(f64, f64)> = (0..100_000).map(|k| (f64::from(k), 0.0)).collect();
        points[77_777].1 = 9.0;
        let kept = thinned(&points);
        assert!(kept.len() <= POINTS_MAX && kept.contains(&(77_777.0, 9.0)));
        let svg = with_line(vec![(0.0, 1.0), (1.0, 3.0), (2.0, f64::NAN), (3.0, 2.0), (4.0, 1.0)]).svg();
        assert_eq!(svg.matches("class=\"l a\"").count(), 2, "{svg}");
        assert!(!svg.contains("NaN"), "{svg}");
        assert_eq!(Chart::default().svg(), "");
    }

    #[test]
    fn a_steep_path_in_one_scale_is_a_tall_picture() {
        let path = |height_m: f64| {
            let mut chart = with_line(vec![(0.0, 0.0), (10.0, height_m)]);
            (chart.panel.equal_scales, chart.full) = (true, true);
            chart.svg()
        };
        assert!(path(110.0).starts_with("<figure class=\"tall\""));
        assert!(path(5.0).starts_with("<figure class=\"full\""));
    }

    /// Two samples that are far apart do not become a ramp between them.
    #[test]
    fn samples_that_are_far_apart_are_not_joined() {
        let mut points: Vec<(f64, f64)> = (0..20).map(|k| (f64::from(k), f64::from(k % 3))).collect();
        points.extend((100..120).map(|k| (f64::from(k), f64::from(k % 2))));
        assert_eq!(with_line(points).svg().matches("class=\"l a\"").count(), 2);
    }

    #[test]
    fn a_line_that_says_nothing_is_not_drawn() {
        assert_eq!(with_line((0..9).map(|k| (f64::from(k), 4.0)).collect()).svg(), "");
        assert!(!with_line((0..9).map(|k| (f64::from(k), -1e-7 * f64::from(k))).collect()).svg().is_empty());
    }
}

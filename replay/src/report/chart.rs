//! A line chart as SVG.

use super::html::{escaped, put};

const WIDTH: f64 = 520.0;
const HEIGHT: f64 = 260.0;
/// Height of a tall picture, which is placed next to three others.
const TALL: f64 = 800.0;
const LEFT: f64 = 56.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 52.0;
const BOTTOM: f64 = 36.0;
/// Most points drawn for one line; more points than pixels cannot be seen.
const POINTS_MAX: usize = 1200;

/// Width of a digit, pixels.
const LETTER: f64 = 6.6;
/// Samples that are this many times the usual gap apart are not joined.
const FAR_GAPS: f64 = 5.0;
/// A line whose values differ by less than this share says nothing.
const NOTHING: f64 = 1e-9;

/// A line of a chart.
pub(super) struct Line {
    /// Its name in the legend; empty for none.
    pub(super) name: &'static str,
    /// `a` to `d`, or `thin`.
    pub(super) class: &'static str,
    pub(super) points: Vec<(f64, f64)>,
}

#[derive(Default)]
pub(super) struct Chart {
    pub(super) title: String,
    pub(super) x_label: &'static str,
    pub(super) y_label: &'static str,
    pub(super) lines: Vec<Line>,
    /// Horizontal limits.
    pub(super) limits: Vec<f64>,
    /// Places with their labels.
    pub(super) places: Vec<(f64, f64, &'static str)>,
    /// Vertical marks and their labels.
    pub(super) marks: Vec<(f64, &'static str)>,
    /// Whether the x axis is no time: a path may turn back on it.
    pub(super) own_x: bool,
    /// Whether both axes have the same scale.
    pub(super) equal_scales: bool,
    /// Whether the chart takes the whole width of the page.
    pub(super) full: bool,
}

impl Chart {
    /// The chart, or nothing if there is no point to draw.
    pub(super) fn svg(&self) -> String {
        let finite = || {
            let all = self.lines.iter().flat_map(|line| line.points.iter());
            all.filter(|(x, y)| x.is_finite() && y.is_finite())
        };
        if !self.equal_scales && self.says_nothing() {
            return String::new();
        }
        let Some((x_from, x_to)) = extent(finite().map(|point| point.0)) else {
            return String::new();
        };
        let values = finite().map(|point| point.1).chain(self.limits.iter().copied());
        let Some((y_from, y_to)) = extent(values) else {
            return String::new();
        };
        // A path in equal scales that is taller than wide gets a tall picture.
        let tall = self.equal_scales && self.full && y_to - y_from > x_to - x_from;
        let width = if self.full && !tall { 2.0 * WIDTH } else { WIDTH };
        let height = match (self.equal_scales, tall) {
            (_, true) => TALL,
            (true, false) => 2.0 * HEIGHT,
            (false, false) => HEIGHT,
        };
        let mut y = padded(Axis { from: y_from, to: y_to, at: (height - BOTTOM, TOP) });
        let mut x = Axis { from: x_from, to: x_to, at: (room_for_labels(&y), width - RIGHT) };
        if self.equal_scales {
            x = padded(x);
            equalise(&mut x, &mut y);
        }
        let class = match (tall, self.full) {
            (true, _) => " class=\"tall\"",
            (false, true) => " class=\"full\"",
            (false, false) if self.equal_scales => " class=\"square\"",
            (false, false) => "",
        };
        let mut svg = format!(
            "<figure{class}><svg viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{0}\">\n\
             <text class=\"title\" x=\"8\" y=\"16\">{0}</text>\n",
            escaped(&self.title)
        );
        self.draw_axes(x, y, &mut svg);
        self.draw_lines(x, y, &mut svg);
        self.draw_legend(width, &mut svg);
        svg.push_str("</svg></figure>\n");
        svg
    }

    /// Whether no line has two different values.
    fn says_nothing(&self) -> bool {
        let varies = |line: &Line| {
            let finite = line.points.iter().map(|point| point.1).filter(|value| value.is_finite());
            let (least, most) =
                finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), value| (a.min(value), b.max(value)));
            most - least > NOTHING * most.abs().max(least.abs())
        };
        !self.lines.iter().any(varies)
    }

    fn draw_axes(&self, x: Axis, y: Axis, svg: &mut String) {
        let (left, right) = x.at;
        let (bottom, top) = y.at;
        let (ticks, decimals) = y.ticks();
        for value in ticks {
            let at = y.place(value);
            put(
                svg,
                format_args!(
                    "<path class=\"grid\" d=\"M{left} {at:.1}H{right}\"/><text x=\"{:.1}\" y=\"{:.1}\" \
                 text-anchor=\"end\">{}</text>\n",
                    left - 5.0,
                    at + 4.0,
                    number(value, decimals)
                ),
            );
        }
        let (ticks, decimals) = x.ticks();
        for value in ticks {
            let at = x.place(value);
            put(
                svg,
                format_args!(
                    "<path class=\"grid\" d=\"M{at:.1} {top}V{bottom}\"/><text x=\"{at:.1}\" y=\"{:.1}\" \
                 text-anchor=\"middle\">{}</text>\n",
                    bottom + 14.0,
                    number(value, decimals)
                ),
            );
        }
        for limit in &self.limits {
            let at = y.place(*limit);
            put(svg, format_args!("<path class=\"limit\" d=\"M{left} {at:.1}H{right}\"/>\n"));
        }
        for (place, (px, py, word)) in self.places.iter().enumerate() {
            let (at, up) = (x.place(*px), y.place(*py));
            let (anchor, shift) = if at > 0.7 * right { ("end", -7.0) } else { ("start", 7.0) };
            // Labels of neighbouring places stand below and above them, and none on the axis.
            let below = place % 2 == 0 && up < bottom - 16.0;
            let lower = if below { 13.0 } else { -5.0 };
            put(
                svg,
                format_args!(
                    "<circle class=\"place\" cx=\"{at:.1}\" cy=\"{up:.1}\" r=\"3.5\"/><text class=\"label\" x=\"{:.1}\" \
                 y=\"{:.1}\" text-anchor=\"{anchor}\">{}</text>\n",
                    at + shift,
                    up + lower,
                    escaped(word)
                ),
            );
        }
        for (value, word) in self.marks.iter().filter(|(value, _)| (x.from..=x.to).contains(value)) {
            let at = x.place(*value);
            let (anchor, shift) = if at > 0.8 * right { ("end", -3.0) } else { ("start", 3.0) };
            put(
                svg,
                format_args!(
                    "<path class=\"mark\" d=\"M{at:.1} {top}V{bottom}\"/><text x=\"{:.1}\" y=\"{:.1}\" \
                 text-anchor=\"{anchor}\">{}</text>\n",
                    at + shift,
                    top - 5.0,
                    escaped(word)
                ),
            );
        }
        put(
            svg,
            format_args!(
                "<path class=\"frame\" d=\"M{left} {top}V{bottom}H{right}\"/>\
             <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>\
             <text x=\"8\" y=\"32\">{}</text>\n",
                right,
                bottom + 30.0,
                escaped(self.x_label),
                escaped(self.y_label)
            ),
        );
    }

    fn draw_lines(&self, x: Axis, y: Axis, svg: &mut String) {
        for line in &self.lines {
            let mut path = String::new();
            // Nothing is known between samples that are much further apart than usual.
            let far = if self.equal_scales || self.own_x {
                f64::INFINITY
            } else {
                usual_gap(&line.points) * FAR_GAPS
            };
            let mut last: Option<f64> = None;
            for (px, py) in thinned(&line.points) {
                if !(px.is_finite() && py.is_finite()) {
                    last = None;
                    continue;
                }
                let joined = last.is_some_and(|last| px - last <= far);
                let (at, up) = (x.place(px), y.place(py));
                if joined {
                    put(&mut path, format_args!("L{at:.1} {up:.1}"));
                } else {
                    // A line of no length, which its round ends show as a dot.
                    put(&mut path, format_args!("M{at:.1} {up:.1}h0"));
                }
                last = Some(px);
            }
            let class = if line.class == "thin" { "thin".to_owned() } else { format!("l {}", line.class) };
            put(svg, format_args!("<path class=\"{class}\" d=\"{path}\"/>\n"));
        }
    }

    fn draw_legend(&self, picture_width: f64, svg: &mut String) {
        let named: Vec<&Line> = self.lines.iter().filter(|line| !line.name.is_empty()).collect();
        if named.len() < 2 {
            return;
        }
        let mut at = picture_width - RIGHT;
        for line in named.into_iter().rev() {
            let width = 6.2 * line.name.len() as f64;
            at -= width;
            put(svg, format_args!("<text x=\"{at:.1}\" y=\"32\">{}</text>", escaped(line.name)));
            at -= 24.0;
            let class = if line.class == "thin" { "thin".to_owned() } else { format!("l {}", line.class) };
            put(svg, format_args!("<path class=\"{class}\" d=\"M{at:.1} 28h20\"/>\n"));
            at -= 10.0;
        }
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

/// Room at the left for the widest label of an axis, pixels.
fn room_for_labels(y: &Axis) -> f64 {
    let (ticks, decimals) = y.ticks();
    let widest = ticks.iter().map(|value| number(*value, decimals).len()).max().unwrap_or(0);
    LEFT.max(12.0 + LETTER * widest as f64)
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

/// One axis of a chart.
#[derive(Clone, Copy)]
pub(super) struct Axis {
    pub(super) from: f64,
    pub(super) to: f64,
    /// Pixels at both ends.
    pub(super) at: (f64, f64),
}

impl Axis {
    pub(super) fn place(&self, value: f64) -> f64 {
        self.at.0 + (value - self.from) / (self.to - self.from) * (self.at.1 - self.at.0)
    }

    /// Round numbers in the axis, five or so, and their decimals.
    pub(super) fn ticks(&self) -> (Vec<f64>, usize) {
        let step = round_step((self.to - self.from) / 5.0);
        let first = (self.from / step).ceil();
        let count = ((self.to - first * step) / step).floor().clamp(0.0, 20.0) as usize;
        let decimals = (-libm::log10(step) + 1e-9).ceil().clamp(0.0, 9.0) as usize;
        ((0..=count).map(|k| (first + k as f64) * step).collect(), decimals)
    }
}

/// 1, 2 or 5 times a power of ten.
fn round_step(rough: f64) -> f64 {
    if !(rough > 0.0 && rough.is_finite()) {
        return 1.0;
    }
    let power = libm::pow(10.0, libm::floor(libm::log10(rough)));
    let mantissa = rough / power;
    let nice = [1.0, 2.0, 5.0].into_iter().find(|nice| mantissa <= *nice).unwrap_or(10.0);
    nice * power
}

/// The lowest and the highest; a single value is widened.
pub(super) fn extent(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let bounds = values.fold(None, |bounds: Option<(f64, f64)>, value| {
        Some(bounds.map_or((value, value), |(from, to)| (from.min(value), to.max(value))))
    });
    // A range whose width is not a finite number cannot be drawn.
    let bounds = bounds.filter(|(from, to)| (to - from).is_finite());
    bounds.map(|(from, to)| if to - from > 1e-12 { (from, to) } else { (from - 0.5, to + 0.5) })
}

/// With some room at both ends.
pub(super) fn padded(axis: Axis) -> Axis {
    let room = 0.06 * (axis.to - axis.from);
    Axis { from: axis.from - room, to: axis.to + room, ..axis }
}

/// Widens the axis that has more pixels a unit until both have the same.
pub(super) fn equalise(x: &mut Axis, y: &mut Axis) {
    let scale = |axis: &Axis| (axis.at.1 - axis.at.0).abs() / (axis.to - axis.from);
    let wanted = scale(x).min(scale(y));
    for axis in [x, y] {
        let middle = 0.5 * (axis.from + axis.to);
        let half = 0.5 * (axis.at.1 - axis.at.0).abs() / wanted;
        (axis.from, axis.to) = (middle - half, middle + half);
    }
}

/// A number on an axis.
pub(super) fn number(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    // Rounding can give a negative zero.
    if text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.') {
        format!("{:.decimals$}", 0.0)
    } else {
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peaks_survive_the_thinning_and_gaps_stay_gaps() {
        let mut points: Vec<(f64, f64)> = (0..100_000).map(|k| (f64::from(k), 0.0)).collect();
        points[77_777].1 = 9.0;
        let kept = thinned(&points);
        assert!(kept.len() <= POINTS_MAX && kept.contains(&(77_777.0, 9.0)));
        let points = vec![(0.0, 1.0), (1.0, f64::NAN), (2.0, 2.0)];
        let chart = Chart { lines: vec![Line { name: "", class: "a", points }], ..Chart::default() };
        let svg = chart.svg();
        assert_eq!(svg.matches("class=\"l a\"").count(), 1);
        assert!(!svg.contains("NaN"), "{svg}");
        assert_eq!(Chart::default().svg(), "");
    }

    #[test]
    fn a_steep_path_in_one_scale_is_a_tall_picture() {
        let path = |height_m: f64| Chart {
            lines: vec![Line { name: "", class: "a", points: vec![(0.0, 0.0), (10.0, height_m)] }],
            equal_scales: true,
            full: true,
            ..Chart::default()
        };
        assert!(path(110.0).svg().starts_with("<figure class=\"tall\"><svg viewBox=\"0 0 520 800\""));
        assert!(path(5.0).svg().starts_with("<figure class=\"full\"><svg viewBox=\"0 0 1040 520\""));
    }

    fn with_line(points: Vec<(f64, f64)>) -> Chart {
        Chart { lines: vec![Line { name: "", class: "a", points }], ..Chart::default() }
    }

    /// Two samples that are far apart do not become a ramp between them.
    #[test]
    fn samples_that_are_far_apart_are_not_joined() {
        let mut points: Vec<(f64, f64)> = (0..20).map(|k| (f64::from(k), f64::from(k % 3))).collect();
        points.extend((100..120).map(|k| (f64::from(k), f64::from(k % 2))));
        let svg = with_line(points).svg();
        let path = svg.split("class=\"l a\" d=\"").nth(1).unwrap().split('"').next().unwrap();
        assert_eq!(path.matches('M').count(), 2, "{path}");
    }

    #[test]
    fn a_line_that_says_nothing_is_not_drawn_and_a_sign_has_its_room() {
        assert_eq!(with_line((0..9).map(|k| (f64::from(k), 4.0)).collect()).svg(), "");
        let svg = with_line((0..9).map(|k| (f64::from(k), -1e-7 * f64::from(k))).collect()).svg();
        let label = svg.split("text-anchor=\"end\">-").next().unwrap();
        let x: f64 = label.rsplit("<text x=\"").next().unwrap().split('"').next().unwrap().parse().unwrap();
        let digits = svg.split("text-anchor=\"end\">-").nth(1).unwrap().split('<').next().unwrap().len() + 1;
        assert!(x > LETTER * digits as f64 - 4.0, "{digits} letters end at {x}");
    }

    fn axis(from: f64, to: f64) -> Axis {
        Axis { from, to, at: (0.0, 100.0) }
    }

    #[test]
    fn ticks_are_round_and_inside() {
        for (from, to) in [(0.0, 10.0), (-0.37, 0.41), (1e-6, 3e-6), (-250.0, 1e4)] {
            let (ticks, _) = axis(from, to).ticks();
            assert!((3..=11).contains(&ticks.len()), "{from} to {to}: {ticks:?}");
            assert!(ticks.iter().all(|tick| (from - 1e-9..=to + 1e-9).contains(tick)));
        }
        assert_eq!(round_step(0.03).to_bits(), 0.05_f64.to_bits());
        assert_eq!(number(-0.0, 1), "0.0");
    }
}

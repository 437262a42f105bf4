//! A picture of the page: an SVG in the page's colours, which stands without a script and on paper.
//!
//! What is drawn lies in an inner picture in tenths of a pixel: it is cut at its frame, and a part
//! of the time is another `viewBox`. The script reads its values from the lines themselves.

use super::html::escaped;
use super::track::{Series, Span};

/// Room for ticks to the left and below, beside the last tick, for the findings' numbers, and for a
/// row of names, px.
const LEFT: f64 = 44.0;
const BELOW: f64 = 18.0;
const RIGHT: f64 = 10.0;
const ABOVE: f64 = 16.0;
const ROW: f64 = 13.0;
/// Largest width of a letter, px: SVG does not measure text.
const LETTER: f64 = 7.0;
/// Units of the inner picture in a px.
const FINE: f64 = 10.0;
/// Points that lie so near to the line without them are left out, and those between two that are so
/// near in time, units.
const UNSEEN: f64 = 3.0;
const NARROW: f64 = 4.0;
/// Samples that are this many times the mean gap apart are not joined.
const FAR_GAPS: f64 = 5.0;
/// A line whose values differ by less than this share is constant.
const NOTHING: f64 = 1e-9;
/// Extent of an axis, over that of the outermost points.
const ROOM: f64 = 1.12;

/// The axes of a picture over time.
pub(super) const TIME: &str = "time";

/// A line: its name, if it is not alone, and its class in the page's style: `a` to `d`, `thin` and
/// others.
#[derive(Clone)]
pub(super) struct Line {
    name: String,
    class: &'static str,
    pub(super) points: Series,
}

pub(super) fn line(name: &str, class: &'static str, points: Series) -> Line {
    Line { name: name.to_owned(), class, points }
}

/// A picture.
#[derive(Clone, Default)]
pub(super) struct Chart {
    pub(super) title: String,
    /// [`TIME`]; two numbers, which of north, east and height is to the right and which up, in one
    /// scale; or neither.
    pub(super) axes: &'static str,
    /// What is to the right.
    pub(super) x_name: &'static str,
    /// Of what is drawn, instead of the usual size, px.
    pub(super) size_px: Option<(f64, f64)>,
    pub(super) lines: Vec<Line>,
    pub(super) limits: Vec<f64>,
    /// Times with their names.
    pub(super) marks: Vec<(f64, String)>,
    /// Where the findings begin, in their order.
    pub(super) signs: Vec<f64>,
    pub(super) spans: Vec<Span>,
    /// Whether the spans' names stand above.
    pub(super) named: bool,
    /// Points with their classes and names, which stand beside them, or of a path in the legend.
    pub(super) places: Vec<(f64, f64, &'static str, String)>,
    /// In the corner: to the right, up, and its words.
    pub(super) arrow: Option<(f64, f64, String)>,
}

/// The ends of the axes, and the size that they have on the page, px.
struct Frame {
    x: (f64, f64),
    y: (f64, f64),
    size_px: (f64, f64),
}

impl Frame {
    fn x_px(&self, x: f64) -> f64 {
        (x - self.x.0) / (self.x.1 - self.x.0) * self.size_px.0
    }

    fn y_px(&self, y: f64) -> f64 {
        (self.y.1 - y) / (self.y.1 - self.y.0) * self.size_px.1
    }

    fn has(&self, x: f64) -> bool {
        (self.x.0..=self.x.1).contains(&x)
    }
}

impl Chart {
    /// Its place on the page: the words of its title before the unit.
    pub(super) fn id(&self) -> String {
        self.title.split(',').next().unwrap_or_default().to_lowercase().replace(' ', "-")
    }

    /// The picture, or nothing if there is nothing to see.
    pub(super) fn svg(&self) -> String {
        let Some(frame) = self.frame() else { return String::new() };
        let ((from, to), (least, most), (width, height)) = (frame.x, frame.y, frame.size_px);
        let (above, beside) = self.beside(&frame);
        let (mut values, mut legend) = (self.behind(&frame), String::new());
        for line in self.lines.iter().filter(|line| !line.points.is_empty()) {
            let (class, value) = (line.class, if self.axes == TIME { "<i></i>" } else { "" });
            values
                .extend([format!("<path class=\"l {class}\" d=\"{}\"/>", self.drawn(&line.points, &frame))]);
            legend.extend([format!(" <span class=\"{class}\">{}{value}</span>", escaped(&line.name))]);
        }
        for (.., kind, name) in self.places.iter().filter(|_| self.axes != TIME) {
            legend.extend([format!(" <span class=\"{kind}\">{}</span>", escaped(name))]);
        }
        let wind =
            self.arrow.iter().map(|(.., words)| format!(" <span class=\"wind\">{}</span>", escaped(words)));
        legend.extend(wind);
        format!(
            "<figure id=\"{}\" data-axes=\"{}\" data-x=\"{from:.4} {to:.4}\" data-y=\"{least:.6} {most:.6}\"><figcaption><b>{}</b>{legend}\
             </figcaption><svg viewBox=\"0 0 {} {}\"><g transform=\"translate({LEFT} {above})\"><svg class=\"plot\" width=\"{width}\" \
             height=\"{height}\" viewBox=\"0 0 {} {}\" preserveAspectRatio=\"none\">{values}</svg>{beside}</g></svg></figure>\n",
            escaped(&self.id()),
            self.axes,
            escaped(&self.title),
            LEFT + width + RIGHT,
            above + height + BELOW,
            FINE * width,
            FINE * height,
        )
    }

    /// The axes that show every point; `None` without two that differ.
    fn frame(&self) -> Option<Frame> {
        let size_px = self.size_px.unwrap_or((348.0, 130.0));
        let of_lines = self.lines.iter().flat_map(|line| line.points.iter().copied());
        let points: Vec<(f64, f64)> = of_lines.chain(self.places.iter().map(|(x, y, ..)| (*x, *y))).collect();
        let x = extent(points.iter().map(|point| point.0))?;
        let y = extent(points.iter().map(|point| point.1).chain(self.limits.iter().copied()))?;
        let of = |(least, most): (f64, f64)| {
            if most - least > NOTHING * least.abs().max(most.abs()) { most - least } else { 0.0 }
        };
        let around = |(a, b): (f64, f64), all: f64| (0.5 * (a + b - ROOM * all), 0.5 * (a + b + ROOM * all));
        // Of the ground a line may be upright, and both axes have one scale.
        let scale = (of(x) / size_px.0).max(of(y) / size_px.1);
        if self.axes.contains(' ') {
            let [x, y] = [around(x, scale * size_px.0), around(y, scale * size_px.1)];
            return (scale > 0.0).then_some(Frame { x, y, size_px });
        }
        (of(x) > 0.0 && of(y) > 0.0).then(|| Frame { x, y: around(y, of(y)), size_px })
    }

    /// What lies behind the lines: spans, grid, limits, marks and findings.
    fn behind(&self, frame: &Frame) -> String {
        let (wide, high) = (FINE * frame.size_px.0, FINE * frame.size_px.1);
        let across = |y: f64| format!("M0 {:.0}h{wide}", FINE * frame.y_px(y));
        let up = |x: f64| format!("M{:.0} 0v{high}", FINE * frame.x_px(x));
        let span = |Span { from, to, shade, .. }: &Span| {
            let [from, to] = [from, to].map(|x| (FINE * frame.x_px(*x)).clamp(0.0, wide));
            format!("<path class=\"{shade}\" d=\"M{from:.0} 0H{to:.0}V{high}H{from:.0}z\"/>")
        };
        let grid = ticks(frame.y, frame.size_px.1).into_iter().map(|(y, _)| across(y));
        let grid = grid.chain(ticks(frame.x, frame.size_px.0).into_iter().map(|(x, _)| up(x)));
        let marks = self.marks.iter().map(|(x, _)| up(*x));
        let signs = self.signs.iter().filter(|x| frame.has(**x)).map(|x| up(*x));
        let limits = self.limits.iter().map(|y| across(*y)).chain(signs);
        let paths =
            [("grid", grid.collect::<String>()), ("markline", marks.collect()), ("limit", limits.collect())];
        let paths = paths.map(|(class, path)| format!("<path class=\"{class}\" d=\"{path}\"/>"));
        self.spans.iter().filter(|span| !span.shade.is_empty()).map(span).chain(paths).collect()
    }

    /// What stands beside the lines, and how much of it above them, px: names, ticks, numbers and
    /// places.
    fn beside(&self, frame: &Frame) -> (f64, String) {
        let (width, height) = frame.size_px;
        let name_px = width - LETTER * (self.x_name.len() + 1) as f64;
        let mut drawn = text("end", [width, height + 14.0], None, self.x_name);
        let beside = ticks(frame.y, height).into_iter();
        drawn.extend(beside.map(|(y, words)| text("end", [-5.0, frame.y_px(y) + 4.0], None, &words)));
        let below = ticks(frame.x, width).into_iter().map(|(x, words)| (frame.x_px(x), words));
        let below = below.filter(|(x_px, _)| *x_px < name_px);
        drawn.extend(below.map(|(x_px, words)| text("tick middle", [x_px, height + 14.0], None, &words)));
        // Names that begin, or end, at a time: each takes the first row that is free from there on.
        let mut in_rows = |names: &mut dyn Iterator<Item = (f64, &str)>, class: &str, first_px: f64| {
            let mut free_px: Vec<f64> = Vec::new();
            for (x, name) in names.filter(|(x, _)| frame.has(*x)) {
                let (x_px, long_px) = (frame.x_px(x), LETTER * name.len() as f64);
                let (side, from_px) =
                    if x_px + long_px > width { ("end", x_px - long_px) } else { ("", x_px) };
                let row = free_px.iter().position(|free| *free <= from_px).unwrap_or(free_px.len());
                free_px.resize(free_px.len().max(row + 1), 0.0);
                free_px[row] = from_px + long_px;
                drawn +=
                    &text(&format!("{class} {side}"), [x_px, first_px - ROW * row as f64], Some(x), name);
            }
            free_px.len() as f64
        };
        let spans = self.spans.iter().filter(|span| self.named && span.to > frame.x.0);
        let mut spans = spans.map(|span| (span.from.max(frame.x.0), span.name.as_str()));
        let rows = in_rows(&mut spans, "phase", -ABOVE - 4.0);
        in_rows(&mut self.marks.iter().map(|(x, name)| (*x, name.as_str())), "mark", height - 4.0);
        for (x, y, kind, name) in &self.places {
            let ([x_px, y_px], at) = ([frame.x_px(*x), frame.y_px(*y)], (self.axes == TIME).then_some(*x));
            drawn += &dot(kind, [x_px, y_px], at);
            if at.is_some() {
                drawn += &text("name", [x_px, y_px - 7.0], at, name);
            }
        }
        let mut last = [f64::NEG_INFINITY, 0.0];
        for (number, x) in (1..).zip(&self.signs).filter(|(_, x)| frame.has(**x)) {
            let x_px = frame.x_px(*x);
            last = [x_px, if x_px - last[0] < ABOVE { last[1] + ABOVE } else { -0.5 * ABOVE }];
            drawn += &dot("sign", last, Some(*x));
            drawn += &text("number middle", [x_px, last[1] + 4.0], Some(*x), &number.to_string());
        }
        if let Some((right, up, _)) = &self.arrow {
            let turned = libm::atan2(*right, *up).to_degrees();
            let (at, path) = (format!("translate(18 16) rotate({turned:.0})"), "M0 11V-11M-4-5L0-12L4-5");
            drawn.extend([format!("<path class=\"arrow\" transform=\"{at}\" d=\"{path}\"/>")]);
        }
        (ROW * rows + ABOVE, drawn)
    }

    /// A line as a path. Nothing is known at a gap, and between samples that are much further apart
    /// than usual.
    fn drawn(&self, points: &[(f64, f64)], frame: &Frame) -> String {
        let (far, narrow) = match (self.axes, points) {
            (TIME, [first, .., last]) => ((last.0 - first.0) / points.len() as f64 * FAR_GAPS, NARROW),
            _ => (f64::INFINITY, f64::NEG_INFINITY),
        };
        let is_joined =
            |a: &(f64, f64), b: &(f64, f64)| b.0 - a.0 <= far && a.1.is_finite() && b.1.is_finite();
        let fine = |(x, y): &(f64, f64)| [frame.x_px(*x), frame.y_px(*y)].map(|px| (FINE * px).round());
        let mut path = String::new();
        for piece in
            points.chunk_by(is_joined).filter(|piece| piece[0].0.is_finite() && piece[0].1.is_finite())
        {
            let points: Vec<[f64; 2]> = piece.iter().map(fine).collect();
            let mut seen = vec![points[0]];
            put_seen(&points, narrow, &mut seen);
            // A line of no length, which its round ends show as a dot.
            seen.extend((seen.len() == 1).then_some(points[0]));
            path.push('M');
            path.extend(seen.into_iter().map(|[x, y]| format!("{x} {y} ")));
        }
        path
    }
}

/// Words at a place, px, and at a time that a part of the time moves.
fn text(class: &str, [x, y]: [f64; 2], time_s: Option<f64>, words: &str) -> String {
    let (time, words) = (moved(time_s), escaped(words));
    format!("<text class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\"{time}>{words}</text>")
}

fn dot(class: &str, [x, y]: [f64; 2], time_s: Option<f64>) -> String {
    format!("<circle class=\"{class}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"1\"{}/>", moved(time_s))
}

fn moved(time_s: Option<f64>) -> String {
    time_s.map_or_else(String::new, |time_s| format!(" data-t=\"{time_s:.3}\""))
}

/// Least and most; `None` without a finite value.
fn extent(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let finite = values.filter(|value| value.is_finite()).map(|value| (value, value));
    finite.reduce(|(least, most), (value, _)| (least.min(value), most.max(value)))
}

/// Round values of an axis with their words, about one each 55 px; a value up needs less room than
/// one to the right.
fn ticks((from, to): (f64, f64), px: f64) -> Vec<(f64, String)> {
    let rough = (to - from) * 55.0_f64.min(0.3 * px) / px;
    let ten = libm::pow(10.0, libm::floor(libm::log10(rough)));
    let step = ten * [1.0, 2.0, 5.0].into_iter().find(|digit| digit * ten >= rough).unwrap_or(10.0);
    let decimals = (-libm::floor(libm::log10(step * 1.001))).clamp(0.0, 6.0) as usize;
    let values = ((from / step).ceil() as i64..=(to / step).floor() as i64).map(|k| k as f64 * step);
    values.map(|value| (value, format!("{:.decimals$}", value + 0.0))).collect()
}

/// Appends the points after the first without which the line would be drawn elsewhere (D. H.
/// Douglas and T. K. Peucker, 1973).
fn put_seen(points: &[[f64; 2]], narrow: f64, seen: &mut Vec<[f64; 2]>) {
    let [first, .., last] = points else { return };
    let [along, down] = [last[0] - first[0], last[1] - first[1]];
    let off = |point: &[f64; 2]| {
        let [x, y] = [point[0] - first[0], point[1] - first[1]];
        let share = ((x * along + y * down) / (along * along + down * down).max(1.0)).clamp(0.0, 1.0);
        libm::hypot(x - share * along, y - share * down)
    };
    match points.iter().map(off).enumerate().max_by(|a, b| a.1.total_cmp(&b.1)) {
        Some((place, off)) if off > UNSEEN && along > narrow => {
            put_seen(&points[..=place], narrow, seen);
            put_seen(&points[place..], narrow, seen);
        }
        _ => seen.push(*last),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_line(points: Series) -> Chart {
        Chart {
            title: "A < b, m".to_owned(),
            axes: TIME,
            lines: vec![line("c", "a", points)],
            ..Chart::default()
        }
    }

    #[test]
    fn peaks_survive_the_thinning_and_gaps_stay_gaps() {
        let mut points: Series = (0..100_000).map(|k| (f64::from(k), 0.0)).collect();
        points[77_777].1 = 9.0;
        let svg = with_line(points).svg();
        // From the lower end of the picture to its upper one, less the room beside the outermost
        // points.
        assert!(
            svg.len() < 3_000 && svg.contains(" d=\"M0 1230 2707 1230 2707 70 2707 1230 3480 1230 \""),
            "{svg}"
        );
        // Noise is no more than its picture has room for.
        let noise =
            with_line((0..100_000).map(|k| (f64::from(k), libm::sin(f64::from(k) * f64::from(k)))).collect())
                .svg();
        assert!(noise.len() < 40_000, "{}", noise.len());
        let svg = with_line(vec![(0.0, 1.0), (1.0, 3.0), (2.0, f64::NAN), (3.0, 2.0), (4.0, 1.0)]).svg();
        let path = svg.split_once("class=\"l a\" d=\"").unwrap().1.split_once('"').unwrap().0;
        assert_eq!(path.matches('M').count(), 2, "{path}");
        assert!(!svg.contains("NaN") && svg.contains("<b>A &lt; b, m</b>"), "{svg}");
        assert_eq!(Chart::default().svg(), "");
    }

    /// Both axes of the ground have one scale: 10 by 110 in 348 by 130 px becomes 298 wide, and
    /// some room.
    #[test]
    fn a_path_over_the_ground_is_drawn_in_one_scale() {
        let chart = Chart { axes: "1 2", ..with_line(vec![(0.0, 0.0), (10.0, 110.0)]) };
        let Frame { x, y, size_px } = chart.frame().unwrap();
        assert!((((x.1 - x.0) / size_px.0) / ((y.1 - y.0) / size_px.1) - 1.0).abs() < 1e-12);
        assert!(x.0 < -100.0 && x.1 > 110.0 && y.0 < 0.0 && y.1 > 110.0, "{x:?} {y:?}");
    }

    /// Two samples that are far apart do not become a ramp between them.
    #[test]
    fn samples_that_are_far_apart_are_not_joined() {
        let mut points: Series = (0..20).map(|k| (f64::from(k), f64::from(k % 3))).collect();
        points.extend((100..120).map(|k| (f64::from(k), f64::from(k % 2))));
        let chart = with_line(points);
        let drawn = chart.drawn(&chart.lines[0].points, &chart.frame().unwrap());
        assert_eq!(drawn.matches('M').count(), 2, "{drawn}");
    }

    #[test]
    fn a_constant_line_is_not_drawn() {
        assert_eq!(with_line((0..9).map(|k| (f64::from(k), 4.0)).collect()).svg(), "");
        assert!(!with_line((0..9).map(|k| (f64::from(k), -1e-7 * f64::from(k))).collect()).svg().is_empty());
    }

    #[test]
    fn ticks_are_round_and_have_the_decimals_of_their_axis() {
        let words =
            |from, to| ticks((from, to), 348.0).into_iter().map(|(_, words)| words).collect::<Vec<_>>();
        assert_eq!(words(0.0, 24.0), ["0", "5", "10", "15", "20"]);
        assert_eq!(words(-0.02, 0.021), ["-0.02", "-0.01", "0.00", "0.01", "0.02"]);
        assert_eq!(words(16.1, 19.9), ["17", "18", "19"]);
    }

    /// Of two spans too short for their names each name has its row, and two findings at one time
    /// their heights.
    #[test]
    fn names_and_numbers_do_not_cover_each_other() {
        let span = |from: f64, name: &str| Span { from, to: from + 0.1, name: name.to_owned(), shade: "hot" };
        let mut chart = with_line(vec![(0.0, 0.0), (20.0, 1.0)]);
        (chart.spans, chart.named) = (vec![span(4.0, "IGNITION"), span(4.1, "POWERED")], true);
        chart.signs = vec![5.0, 5.1, f64::NAN];
        let svg = chart.svg();
        let height = |words: &str| {
            let before = svg.split_once(&format!(">{words}</text>")).unwrap().0;
            before.rsplit_once(" y=\"").unwrap().1.split_once('"').unwrap().0.to_owned()
        };
        assert_ne!(height("IGNITION"), height("POWERED"));
        assert_ne!(height("1"), height("2"));
        assert!(!svg.contains("NaN") && !svg.contains(">3</text>"), "{svg}");
    }
}

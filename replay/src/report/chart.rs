//! A picture of the page: an SVG in the page's colours, which stands without a script and on paper.
//!
//! What is drawn lies in an inner picture in tenths of a pixel: it is cut at its frame, and a part of the time is another
//! `viewBox`. The script reads its values from the lines themselves.

use super::html::{escaped, put};
use super::track::{Series, Span};

/// Room for ticks to the left and below, beside the last tick, for the findings' numbers, and for a row of names, px.
const LEFT: f64 = 44.0;
const BELOW: f64 = 18.0;
const RIGHT: f64 = 10.0;
const ABOVE: f64 = 16.0;
const ROW: f64 = 13.0;
/// Width of a letter, px, at most: SVG does not tell.
const LETTER: f64 = 7.0;
/// Units of the inner picture in a px.
const FINE: f64 = 10.0;
/// Points of a line for each px of its picture; more cannot be seen.
const POINTS_PX: f64 = 2.0;
/// Points that lie so near to the line without them are left out, units.
const UNSEEN: f64 = 3.0;
/// Samples that are this many times the usual gap apart are not joined.
const FAR_GAPS: f64 = 5.0;
/// A line whose values differ by less than this share says nothing.
const NOTHING: f64 = 1e-9;
/// Room beside the outermost points, of their extent.
const ROOM: f64 = 0.06;

/// What the axes of a picture are.
#[derive(Clone, Copy, Default, PartialEq)]
pub(super) enum Axes {
    /// Time and a value.
    #[default]
    Time,
    /// Of north, east and height one to the right and one up, in one scale.
    Ground([usize; 2]),
    /// Neither.
    Own,
}

/// A line: its name, if it is not alone, and its class in the page's style.
#[derive(Clone)]
pub(super) struct Line {
    name: String,
    class: &'static str,
    pub(super) points: Series,
}

/// A line of a class: `a` to `d`, `thin`, and others of the page's style.
pub(super) fn line(name: &str, class: &'static str, points: Series) -> Line {
    Line { name: name.to_owned(), class, points }
}

/// A picture.
#[derive(Clone, Default)]
pub(super) struct Chart {
    pub(super) title: String,
    pub(super) axes: Axes,
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
    /// Points with their classes and names.
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
        let (width, height) = frame.size_px;
        let (above, beside) = self.beside(&frame);
        let (mut values, mut legend) = (String::new(), String::new());
        for Line { name, class, points } in self.lines.iter().filter(|line| !line.points.is_empty()) {
            put(
                &mut values,
                format_args!("<path class=\"l {class}\" d=\"{}\"/>", self.drawn(points, &frame)),
            );
            let value = if self.axes == Axes::Time { "<i></i>" } else { "" };
            put(&mut legend, format_args!(" <span class=\"{class}\">{}{value}</span>", escaped(name)));
        }
        let scales = match self.axes {
            Axes::Time => "data-axes=\"time\"".to_owned(),
            Axes::Ground([right, up]) => format!("data-axes=\"{right} {up}\""),
            Axes::Own => String::new(),
        };
        let ((from, to), (least, most)) = (frame.x, frame.y);
        format!(
            "<figure id=\"{}\" {scales} data-x=\"{from:.4} {to:.4}\" data-y=\"{least:.6} {most:.6}\"><figcaption><b>{}</b>{legend}\
             </figcaption><svg viewBox=\"0 0 {} {}\"><g transform=\"translate({LEFT} {above})\"><svg class=\"plot\" width=\"{width}\" \
             height=\"{height}\" viewBox=\"0 0 {} {}\" preserveAspectRatio=\"none\">{}{values}</svg>{beside}</g></svg></figure>\n",
            escaped(&self.id()),
            escaped(&self.title),
            LEFT + width + RIGHT,
            above + height + BELOW,
            FINE * width,
            FINE * height,
            self.behind(&frame),
        )
    }

    /// The axes that show every point; `None` without two that differ.
    fn frame(&self) -> Option<Frame> {
        let size_px = self.size_px.unwrap_or((348.0, 130.0));
        let of_lines = self.lines.iter().flat_map(|line| line.points.iter().copied());
        let points: Vec<(f64, f64)> = of_lines.chain(self.places.iter().map(|(x, y, ..)| (*x, *y))).collect();
        let x = extent(points.iter().map(|point| point.0))?;
        let y = extent(points.iter().map(|point| point.1).chain(self.limits.iter().copied()))?;
        let room = |(least, most): (f64, f64)| (least - ROOM * (most - least), most + ROOM * (most - least));
        let is_flat = |(least, most): (f64, f64)| most - least <= NOTHING * least.abs().max(most.abs());
        match self.axes {
            _ if is_flat(x) && is_flat(y) => None,
            Axes::Ground(_) => {
                let scale = ((x.1 - x.0) / size_px.0).max((y.1 - y.0) / size_px.1) * (1.0 + 2.0 * ROOM);
                let around = |(least, most): (f64, f64), px: f64| {
                    (0.5 * (least + most - scale * px), 0.5 * (least + most + scale * px))
                };
                Some(Frame { x: around(x, size_px.0), y: around(y, size_px.1), size_px })
            }
            _ if is_flat(x) || is_flat(y) => None,
            _ => Some(Frame { x, y: room(y), size_px }),
        }
    }

    /// What lies behind the lines: spans, grid, limits, marks and findings.
    fn behind(&self, frame: &Frame) -> String {
        let (wide, high) = (FINE * frame.size_px.0, FINE * frame.size_px.1);
        let mut drawn = String::new();
        for Span { from, to, shade, .. } in self.spans.iter().filter(|span| !span.shade.is_empty()) {
            let [from, to] = [from, to].map(|x| (FINE * frame.x_px(*x)).clamp(0.0, wide));
            put(
                &mut drawn,
                format_args!(
                    "<rect class=\"{shade}\" x=\"{from:.0}\" width=\"{:.0}\" height=\"{high}\"/>",
                    to - from
                ),
            );
        }
        let across = |y: f64| format!("M0 {:.0}h{wide}", FINE * frame.y_px(y));
        let up = |x: f64| format!("M{:.0} 0v{high}", FINE * frame.x_px(x));
        let grid = ticks(frame.y, frame.size_px.1).into_iter().map(|(y, _)| across(y));
        let upright = ticks(frame.x, frame.size_px.0).into_iter().map(|(x, _)| up(x));
        let marks = self.marks.iter().map(|(x, _)| up(*x));
        let limits = self.limits.iter().map(|y| across(*y));
        let signs = self.signs.iter().filter(|x| frame.has(**x)).map(|x| up(*x));
        for (class, path) in [
            ("grid", grid.chain(upright).collect::<String>()),
            ("markline", marks.collect()),
            ("limit", limits.chain(signs).collect()),
        ] {
            if !path.is_empty() {
                put(&mut drawn, format_args!("<path class=\"{class}\" d=\"{path}\"/>"));
            }
        }
        drawn
    }

    /// What stands beside the lines, and how much of it above them, px: names, ticks, numbers and places.
    fn beside(&self, frame: &Frame) -> (f64, String) {
        let (width, height) = frame.size_px;
        let mut drawn = String::new();
        for (y, words) in ticks(frame.y, height) {
            text(&mut drawn, "end", [-5.0, frame.y_px(y) + 4.0], None, &words);
        }
        let name_px = width - LETTER * (self.x_name.len() + 1) as f64;
        for (x, words) in ticks(frame.x, width).into_iter().filter(|(x, _)| frame.x_px(*x) < name_px) {
            text(&mut drawn, "tick middle", [frame.x_px(x), height + 14.0], None, &words);
        }
        text(&mut drawn, "end", [width, height + 14.0], None, self.x_name);
        // Names that begin, or end, at a time: each takes the first row that is free from there on.
        let mut named = |names: Vec<(f64, &str)>, class: &str, y_of_row: &dyn Fn(f64) -> f64| {
            let mut free_px: Vec<f64> = Vec::new();
            for (x, name) in names.into_iter().filter(|(x, _)| frame.has(*x)) {
                let (x_px, long_px) = (frame.x_px(x), LETTER * name.len() as f64);
                let (side, from_px) =
                    if x_px + long_px > width { ("end", x_px - long_px) } else { ("", x_px) };
                let row = free_px.iter().position(|free| *free <= from_px).unwrap_or(free_px.len());
                free_px.resize(free_px.len().max(row + 1), 0.0);
                free_px[row] = from_px + long_px;
                text(&mut drawn, &format!("{class} {side}"), [x_px, y_of_row(row as f64)], Some(x), name);
            }
            free_px.len() as f64
        };
        let seen = self.spans.iter().filter(|span| self.named && span.to > frame.x.0);
        let spans = seen.map(|span| (span.from.max(frame.x.0), span.name.as_str()));
        let rows = named(spans.collect(), "phase", &|row| -ABOVE - 4.0 - ROW * row);
        let marks = self.marks.iter().map(|(x, name)| (*x, name.as_str()));
        named(marks.collect(), "mark", &|row| height - 4.0 - ROW * row);
        let mut last = [f64::NEG_INFINITY, 0.0];
        for (number, x) in (1..).zip(&self.signs).filter(|(_, x)| frame.has(**x)) {
            let x_px = frame.x_px(*x);
            last = [x_px, if x_px - last[0] < ABOVE { last[1] + ABOVE } else { -0.5 * ABOVE }];
            dot(&mut drawn, "sign", last, Some(*x));
            text(&mut drawn, "number middle", [x_px, last[1] + 4.0], Some(*x), &number.to_string());
        }
        let mut taken: Vec<[f64; 2]> =
            self.places.iter().map(|(x, y, ..)| [frame.x_px(*x), frame.y_px(*y)]).collect();
        for (x, y, kind, name) in &self.places {
            let [x_px, y_px] = [frame.x_px(*x), frame.y_px(*y)];
            dot(&mut drawn, kind, [x_px, y_px], None);
            // Of four places the first where no other name or place is.
            let long_px = LETTER * name.len() as f64;
            let sides = [(6.0, -7.0), (6.0, 15.0), (-6.0 - long_px, -7.0), (-6.0 - long_px, 15.0)];
            let is_free = |(right, down): &(f64, f64)| {
                let (from, to, at) = (x_px + right, x_px + right + long_px, y_px + down - 4.0);
                let crosses = |[x, y]: &[f64; 2]| (from..=to).contains(x) && (y - at).abs() < 9.0;
                from >= 0.0 && to <= width + RIGHT && !taken.iter().any(crosses)
            };
            let (right, down) = sides.into_iter().find(is_free).unwrap_or(sides[0]);
            taken.extend(
                [0.0, 0.25, 0.5, 0.75, 1.0].map(|share| [x_px + right + share * long_px, y_px + down - 4.0]),
            );
            let (class, x_px) = if right < 0.0 { ("name end", x_px - 6.0) } else { ("name", x_px + right) };
            text(&mut drawn, class, [x_px, y_px + down], None, name);
        }
        if let Some((right, up, words)) = &self.arrow {
            let turned = libm::atan2(*right, *up).to_degrees();
            text(&mut drawn, "name", [4.0, 42.0], None, words);
            put(
                &mut drawn,
                format_args!(
                    "<path class=\"arrow\" transform=\"translate(18 16) rotate({turned:.0})\" d=\"M0 11V-11M-4-5L0-12L4-5\"/>"
                ),
            );
        }
        (ROW * rows + ABOVE, drawn)
    }

    /// A line as a path. Nothing is known at a gap, and between samples that are much further apart than usual.
    fn drawn(&self, points: &[(f64, f64)], frame: &Frame) -> String {
        let far = if self.axes == Axes::Time { usual_gap(points) * FAR_GAPS } else { f64::INFINITY };
        let is_joined =
            |a: &(f64, f64), b: &(f64, f64)| b.0 - a.0 <= far && a.1.is_finite() && b.1.is_finite();
        let stretch = (points.len() as f64 / (POINTS_PX * frame.size_px.0)).ceil() as usize;
        let fine =
            |(x, y): (f64, f64)| [FINE * frame.x_px(x), FINE * frame.y_px(y)].map(|at| at.round() as i64);
        let mut path = String::new();
        for piece in
            points.chunk_by(is_joined).filter(|piece| piece[0].0.is_finite() && piece[0].1.is_finite())
        {
            let points: Vec<[i64; 2]> = thinned(piece, stretch).into_iter().map(fine).collect();
            let mut before = points[0];
            put(&mut path, format_args!("M{} {}l", before[0], before[1]));
            // A line of no length, which its round ends show as a dot.
            let mut seen = if points.len() > 1 { Vec::new() } else { points.clone() };
            put_seen(&points, &mut seen);
            for [x, y] in seen {
                let (right, down) = (x - before[0], y - before[1]);
                let space = if path.ends_with('l') || right < 0 { "" } else { " " };
                let between = if down < 0 { "" } else { " " };
                put(&mut path, format_args!("{space}{right}{between}{down}"));
                before = [x, y];
            }
        }
        path
    }
}

/// Words at a place, px, and at a time that a part of the time moves.
fn text(drawn: &mut String, class: &str, [x, y]: [f64; 2], time_s: Option<f64>, words: &str) {
    let (time, words) = (moved(time_s), escaped(words));
    put(drawn, format_args!("<text class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\"{time}>{words}</text>"));
}

fn dot(drawn: &mut String, class: &str, [x, y]: [f64; 2], time_s: Option<f64>) {
    put(
        drawn,
        format_args!("<circle class=\"{class}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"1\"{}/>", moved(time_s)),
    );
}

fn moved(time_s: Option<f64>) -> String {
    time_s.map_or_else(String::new, |time_s| format!(" data-t=\"{time_s:.3}\""))
}

/// Least and most; `None` without a finite value.
fn extent(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let ends = values
        .filter(|value| value.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), value| (least.min(value), most.max(value)));
    (ends.0 <= ends.1).then_some(ends)
}

/// Round values of an axis with their words, about one each 55 px; a value up needs less room than one to the right.
fn ticks((from, to): (f64, f64), px: f64) -> Vec<(f64, String)> {
    let rough = (to - from) * 55.0_f64.min(0.3 * px) / px;
    let ten = libm::pow(10.0, libm::floor(libm::log10(rough)));
    let step = [1.0, 2.0, 5.0, 10.0].map(|digit| digit * ten).into_iter().find(|step| *step >= rough);
    let step = step.unwrap_or(10.0 * ten);
    let decimals = (-libm::floor(libm::log10(step * 1.001))).clamp(0.0, 6.0) as usize;
    let (first, last) = ((from / step).ceil() as i64, (to / step).floor() as i64);
    (first..=last)
        .map(|k| k as f64 * step)
        .map(|value| (value, format!("{:.decimals$}", value + 0.0)))
        .collect()
}

/// The median of the distances between neighbouring points along x.
fn usual_gap(points: &[(f64, f64)]) -> f64 {
    let mut gaps: Vec<f64> = points.windows(2).map(|pair| pair[1].0 - pair[0].0).collect();
    gaps.retain(|gap| gap.is_finite());
    gaps.sort_by(f64::total_cmp);
    gaps.get(gaps.len() / 2).copied().unwrap_or(f64::INFINITY)
}

/// The ends, the highest and the lowest of every stretch of points.
fn thinned(points: &[(f64, f64)], stretch: usize) -> Vec<(f64, f64)> {
    if stretch <= 2 {
        return points.to_vec();
    }
    let of = |part: &[(f64, f64)]| {
        let of_size = |pick: fn(f64, f64) -> f64| part.iter().map(|point| point.1).reduce(pick);
        let (least, most) = (of_size(f64::min), of_size(f64::max));
        let kept = part.iter().filter(|point| Some(point.1) == least || Some(point.1) == most).copied();
        kept.collect::<Vec<_>>()
    };
    points.chunks(2 * stretch).flat_map(of).collect()
}

/// Appends the points after the first without which the line would be drawn elsewhere (D. H. Douglas and T. K. Peucker, 1973).
fn put_seen(points: &[[i64; 2]], seen: &mut Vec<[i64; 2]>) {
    let [first, .., last] = points else { return };
    let from_first = |[x, y]: &[i64; 2]| [x - first[0], y - first[1]].map(|difference| difference as f64);
    let [along, down] = from_first(last);
    let square = along * along + down * down;
    let off = |point: &[i64; 2]| {
        let [x, y] = from_first(point);
        let share = if square > 0.0 { ((x * along + y * down) / square).clamp(0.0, 1.0) } else { 0.0 };
        libm::hypot(x - share * along, y - share * down)
    };
    match points.iter().map(off).enumerate().max_by(|a, b| a.1.total_cmp(&b.1)) {
        Some((place, off)) if off > UNSEEN => {
            put_seen(&points[..=place], seen);
            put_seen(&points[place..], seen);
        }
        _ => seen.push(*last),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_line(points: Series) -> Chart {
        Chart { title: "A < b, m".to_owned(), lines: vec![line("c", "a", points)], ..Chart::default() }
    }

    #[test]
    fn peaks_survive_the_thinning_and_gaps_stay_gaps() {
        let mut points: Series = (0..100_000).map(|k| (f64::from(k), 0.0)).collect();
        points[77_777].1 = 9.0;
        let thin = thinned(&points, 500);
        assert!(thin.contains(&(77_777.0, 9.0)));
        let svg = with_line(points).svg();
        // From the lower end of the picture to its upper one, less the room beside the outermost points.
        assert!(svg.len() < 3_000 && svg.contains("-1160"), "{svg}");
        let svg = with_line(vec![(0.0, 1.0), (1.0, 3.0), (2.0, f64::NAN), (3.0, 2.0), (4.0, 1.0)]).svg();
        let path = svg.split_once("class=\"l a\" d=\"").unwrap().1.split_once('"').unwrap().0;
        assert_eq!(path.matches('M').count(), 2, "{path}");
        assert!(!svg.contains("NaN") && svg.contains("<b>A &lt; b, m</b>"), "{svg}");
        assert_eq!(Chart::default().svg(), "");
    }

    /// Both axes of the ground have one scale: 10 by 110 in 348 by 130 px becomes 298 wide, and some room.
    #[test]
    fn a_path_over_the_ground_is_drawn_in_one_scale() {
        let chart = Chart { axes: Axes::Ground([1, 2]), ..with_line(vec![(0.0, 0.0), (10.0, 110.0)]) };
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
    fn a_line_that_says_nothing_is_not_drawn() {
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

    /// Of two spans too short for their names each name has its row, and two findings at one time their heights.
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

//! Pictures of a campaign, as SVG; and the frame, axes and scales of a picture for others.

use core::fmt::{self, Write};

use flight::vehicle::mission::LegLimits;

use crate::row::Row;
use crate::statistics::sorted;
use crate::summary::numbers;

/// Width of a picture.
pub const WIDTH: f64 = 520.0;
/// Height of a picture.
pub const HEIGHT: f64 = 400.0;
/// Left margin.
pub const LEFT: f64 = 60.0;
/// Right margin.
pub const RIGHT: f64 = 20.0;
/// Top margin.
pub const TOP: f64 = 40.0;
/// Bottom margin.
pub const BOTTOM: f64 = 60.0;
/// Bars of a histogram.
const BARS: usize = 40;
/// Values beyond this fraction at each end go into the last bar, so that one crash does not hide the rest.
const TAIL_SHARE: f64 = 0.005;

/// File names and titles of the pictures.
pub const PICTURES: [(&str, &str); 4] = [
    ("touchdown.svg", "Where they touched down"),
    ("vertical-speed.svg", "Vertical speed at contact"),
    ("ignition-height.svg", "Height at the first thrust"),
    ("tilt.svg", "Tilt at contact"),
];

/// Every picture, in the order of [`PICTURES`].
pub fn pictures(rows: &[Row], legs: &LegLimits) -> [String; 4] {
    let [scatter_title, speed_title, height_title, tilt_title] = PICTURES.map(|(_, title)| title);
    [
        drawn(|out| scatter(rows, scatter_title, out)),
        drawn(|out| {
            let values = sorted(numbers(rows, "touchdown_vertical_m_s").map(f64::abs));
            histogram(&values, speed_title, "vertical speed, m/s", Some(legs.vertical_m_s), out)
        }),
        drawn(|out| {
            let values = sorted(numbers(rows, "onset_height_m"));
            histogram(&values, height_title, "height of the feet, m", None, out)
        }),
        drawn(|out| {
            let values = sorted(numbers(rows, "touchdown_tilt_deg"));
            histogram(&values, tilt_title, "tilt, degrees", Some(legs.tilt_deg), out)
        }),
    ]
}

/// A picture with a white ground.
pub fn drawn(draw: impl FnOnce(&mut String) -> fmt::Result) -> String {
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{HEIGHT}\" \
         font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"white\"/>\n"
    );
    // Writing to a String cannot fail.
    let _ = draw(&mut out);
    out.push_str("</svg>\n");
    out
}

/// One axis of a picture: its values and their positions.
#[derive(Clone, Copy)]
pub struct Scale {
    /// First value.
    pub from: f64,
    /// Last value.
    pub to: f64,
    /// Position of the first value.
    pub from_px: f64,
    /// Position of the last value.
    pub to_px: f64,
}

impl Scale {
    /// Position of a value.
    pub fn px(&self, value: f64) -> f64 {
        self.from_px + (value - self.from) / (self.to - self.from) * (self.to_px - self.from_px)
    }

    /// A round step between marks that gives four to nine marks.
    fn step(&self) -> f64 {
        let rough = (self.to - self.from) / 8.0;
        let power = libm::pow(10.0, libm::floor(libm::log10(rough)));
        let steps = [1.0, 2.0, 5.0, 10.0].map(|step| step * power);
        steps.into_iter().find(|step| *step >= rough).unwrap_or(10.0 * power)
    }

    fn marks(self) -> impl Iterator<Item = f64> {
        let step = self.step();
        let first = libm::ceil(self.from / step) as i64;
        (first..).map(move |mark| mark as f64 * step).take_while(move |value| *value <= self.to + 1e-9 * step)
    }
}

/// Title, axes and marks.
///
/// # Errors
/// The output cannot be written.
pub fn frame(x: Scale, y: Scale, labels: [&str; 3], out: &mut String) -> fmt::Result {
    framed([x, y], y.marks(), labels, out)
}

/// The same without marks on the vertical axis, for an axis of names.
///
/// # Errors
/// The output cannot be written.
pub fn frame_of_names(x: Scale, y: Scale, labels: [&str; 3], out: &mut String) -> fmt::Result {
    framed([x, y], core::iter::empty(), labels, out)
}

fn framed(
    [x, y]: [Scale; 2],
    y_marks: impl Iterator<Item = f64>,
    [title, x_label, y_label]: [&str; 3],
    out: &mut String,
) -> fmt::Result {
    writeln!(out, r#"<text x="{LEFT}" y="24" font-size="14">{title}</text>"#)?;
    for value in x.marks() {
        let px = x.px(value);
        writeln!(
            out,
            r##"<line x1="{px:.1}" y1="{:.1}" x2="{px:.1}" y2="{:.1}" stroke="#ddd"/>"##,
            y.to_px, y.from_px
        )?;
        let base = y.from_px + 16.0;
        writeln!(out, r#"<text x="{px:.1}" y="{base:.1}" text-anchor="middle">{}</text>"#, plain(value))?;
    }
    for value in y_marks {
        let px = y.px(value);
        writeln!(
            out,
            r##"<line x1="{:.1}" y1="{px:.1}" x2="{:.1}" y2="{px:.1}" stroke="#ddd"/>"##,
            x.from_px, x.to_px
        )?;
        let side = x.from_px - 6.0;
        writeln!(
            out,
            r#"<text x="{side:.1}" y="{:.1}" text-anchor="end">{}</text>"#,
            px + 4.0,
            plain(value)
        )?;
    }
    let (middle, base) = (0.5 * (x.from_px + x.to_px), y.from_px + 36.0);
    writeln!(out, r#"<text x="{middle:.1}" y="{base:.1}" text-anchor="middle">{x_label}</text>"#)?;
    let side = 0.5 * (y.from_px + y.to_px);
    writeln!(
        out,
        r#"<text x="16" y="{side:.1}" text-anchor="middle" transform="rotate(-90 16 {side:.1})">{y_label}</text>"#
    )
}

/// A mark's value without rounding errors.
fn plain(value: f64) -> f64 {
    libm::round(value * 1e6) / 1e6
}

/// The marks differ in shape, too, so that they can be distinguished in grey.
fn scatter(rows: &[Row], title: &str, out: &mut String) -> fmt::Result {
    let places: Vec<(f64, f64, &Row)> = rows
        .iter()
        .filter_map(|row| Some((row.touchdown_x_m?, row.touchdown_y_m?, row)))
        .filter(|(x_m, y_m, _)| x_m.is_finite() && y_m.is_finite())
        .collect();
    let far_m = places.iter().fold(1.0, |far: f64, (x_m, y_m, _)| far.max(x_m.abs()).max(y_m.abs())) * 1.05;
    let size = HEIGHT - TOP - BOTTOM;
    let x = Scale { from: -far_m, to: far_m, from_px: LEFT, to_px: LEFT + size };
    let y = Scale { from: -far_m, to: far_m, from_px: TOP + size, to_px: TOP };
    frame(x, y, [title, "world x, m from the pad", "world y, m"], out)?;
    for (x_m, y_m, row) in places {
        let (x_px, y_px) = (x.px(x_m), y.px(y_m));
        let colour = if row.strict { "#1b7837" } else { "#e6a23c" };
        let label = if row.failure.is_empty() { "landed" } else { &row.failure };
        if row.legs {
            write!(
                out,
                r#"<circle cx="{x_px:.1}" cy="{y_px:.1}" r="2.2" fill="{colour}" fill-opacity="0.7">"#
            )?;
            writeln!(out, "<title>flight {}: {label}</title></circle>", row.number)?;
        } else {
            let (left, right, up, down) = (x_px - 3.0, x_px + 3.0, y_px - 3.0, y_px + 3.0);
            write!(
                out,
                r##"<path d="M{left:.1} {up:.1}L{right:.1} {down:.1}M{left:.1} {down:.1}L{right:.1} {up:.1}" stroke="#5b4b6b">"##
            )?;
            writeln!(out, "<title>flight {}: {label}</title></path>", row.number)?;
        }
    }
    let legend_px = LEFT + size + 16.0;
    for (place, (colour, words)) in
        [("#1b7837", "strict"), ("#e6a23c", "legs"), ("#5b4b6b", "not landed (cross)")]
            .into_iter()
            .enumerate()
    {
        let y_px = TOP + 14.0 + 20.0 * place as f64;
        writeln!(out, r#"<circle cx="{legend_px}" cy="{:.1}" r="4" fill="{colour}"/>"#, y_px - 4.0)?;
        writeln!(out, r#"<text x="{:.1}" y="{y_px:.1}">{words}</text>"#, legend_px + 10.0)?;
    }
    Ok(())
}

fn histogram(values: &[f64], title: &str, label: &str, limit: Option<f64>, out: &mut String) -> fmt::Result {
    let tail = libm::floor(TAIL_SHARE * values.len() as f64) as usize;
    let (Some(least), Some(most)) = (values.get(tail), values.iter().rev().nth(tail)) else {
        return writeln!(out, r#"<text x="{LEFT}" y="24" font-size="14">{title}: no flight has one</text>"#);
    };
    let (from, to) = (least.min(limit.unwrap_or(*least)), most.max(limit.unwrap_or(*most)));
    let room = if to > from { 0.02 * (to - from) } else { 0.5 };
    let (from, to) = (from - room, to + room);
    let mut bars = [0_usize; BARS];
    for value in values {
        let place = (value.clamp(from, to) - from) / (to - from) * BARS as f64;
        bars[(place as usize).min(BARS - 1)] += 1;
    }
    let tallest = bars.iter().max().copied().unwrap_or(1).max(1) as f64;
    let x = Scale { from, to, from_px: LEFT, to_px: WIDTH - RIGHT };
    let y = Scale { from: 0.0, to: tallest, from_px: HEIGHT - BOTTOM, to_px: TOP };
    frame(x, y, [title, label, "flights"], out)?;
    let width_px = (x.to_px - x.from_px) / BARS as f64;
    for (place, count) in bars.iter().enumerate().filter(|(_, count)| **count > 0) {
        let (x_px, y_px) = (x.from_px + place as f64 * width_px, y.px(*count as f64));
        let height_px = y.from_px - y_px;
        let low = from + (to - from) * place as f64 / BARS as f64;
        let high = from + (to - from) * (place + 1) as f64 / BARS as f64;
        writeln!(
            out,
            r##"<rect x="{x_px:.1}" y="{y_px:.1}" width="{:.1}" height="{height_px:.1}" fill="#4575b4"><title>{low:.3} to {high:.3}: {count}</title></rect>"##,
            width_px - 1.0
        )?;
    }
    if let Some(limit) = limit {
        let px = x.px(limit);
        writeln!(
            out,
            r##"<line x1="{px:.1}" y1="{:.1}" x2="{px:.1}" y2="{:.1}" stroke="#b2182b" stroke-dasharray="5 3"/>"##,
            y.to_px, y.from_px
        )?;
        let above = y.to_px - 4.0;
        writeln!(
            out,
            r##"<text x="{px:.1}" y="{above:.1}" text-anchor="middle" fill="#b2182b">legs</text>"##
        )?;
    }
    Ok(())
}

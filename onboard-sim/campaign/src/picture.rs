//! Pictures of a campaign, as SVG.

use flight::vehicle::mission::LegLimits;

use crate::figure::{Bar, FigureError, Places, bars_svg, places_svg};
use crate::row::Row;
use crate::statistics::sorted;
use crate::summary::numbers;

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
pub fn pictures(rows: &[Row], legs: &LegLimits) -> [Result<String, FigureError>; 4] {
    let [scatter, speed, height, tilt] = PICTURES.map(|(_, title)| title);
    let places = |is: fn(&Row) -> bool| {
        let rows = rows.iter().filter(|row| is(row));
        rows.filter_map(|row| Some([row.touchdown_x_m?, row.touchdown_y_m?])).collect()
    };
    let kinds = [
        ("not landed", places(|row| !row.legs)),
        ("landed on its legs", places(|row| row.legs && !row.strict)),
        ("strictly", places(|row| row.legs && row.strict)),
    ];
    let values = |column| sorted(numbers(rows, column).map(f64::abs));
    [
        places_svg(scatter, &Places { kinds: &kinds, circles: &[] }),
        histogram(&values("touchdown_vertical_m_s"), speed, "vertical speed, m/s", Some(legs.vertical_m_s)),
        histogram(&values("onset_height_m"), height, "height of the feet, m", None),
        histogram(&values("touchdown_tilt_deg"), tilt, "tilt, degrees", Some(legs.tilt_deg)),
    ]
}

fn histogram(values: &[f64], title: &str, label: &str, limit: Option<f64>) -> Result<String, FigureError> {
    let tail = libm::floor(TAIL_SHARE * values.len() as f64) as usize;
    let mark = limit.map(|limit| ("limit of the legs", limit));
    let (Some(from), Some(to)) = (values.get(tail), values.iter().rev().nth(tail)) else {
        return bars_svg(&format!("{title}: no flight has one"), [label, "flights"], &[], &[], mark);
    };
    let width = if to > from { (to - from) / BARS as f64 } else { 1.0 };
    let mut counts = [0_u32; BARS];
    for value in values {
        let place = (value.clamp(*from, *to) - from) / width;
        counts[(place as usize).min(BARS - 1)] += 1;
    }
    let bar = |(place, count): (usize, &u32)| {
        let left = from + width * place as f64;
        Bar { x: [left, left + width], y: [0.0, f64::from(*count)], kind: 0, text: String::new() }
    };
    let bars: Vec<Bar> = counts.iter().enumerate().filter(|(_, count)| **count > 0).map(bar).collect();
    bars_svg(title, [label, "flights"], &["flights"], &bars, mark)
}

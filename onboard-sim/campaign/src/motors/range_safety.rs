//! The side of a card for the range safety officer: who stands where in which wind, and what an abort does.

use core::fmt::Write as _;

use flight::vehicle::mission::StartPoint;

use crate::hazard::{Impact, Radius, Rule, Way, keep_out_m, widest};
use crate::statistics::Share;

/// A rate or a radius that rests on fewer flights is not told.
pub const FEWEST: u64 = 100;
/// The launch crew stands so far outside of the circle, m.
const BESIDE_M: f64 = 10.0;

/// What the flights in one wind tell.
#[derive(Debug, Clone, PartialEq)]
pub struct InWind {
    /// Mean wind 10 m above the ground.
    pub wind_m_s: f64,
    /// Landed on their legs, of the flights as planned.
    pub landed: Option<Share>,
    pub circle: Option<Circle>,
}

/// Nobody stands in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circle {
    /// Radius about the pad: what flights and rule ask for in this wind and in less.
    pub keep_out_m: f64,
    /// The way of ending that reaches farthest, with its flights.
    pub way: Way,
    pub radius: Radius,
    /// The farthest that any flight came down downwind, across the wind and upwind, m.
    pub farthest_m: [f64; 3],
}

impl Circle {
    /// Where the launch crew stands, upwind of the pad, m.
    pub fn crew_m(&self) -> f64 {
        self.keep_out_m + BESIDE_M
    }
}

/// What flights tell of each wind, in rising order.
pub fn in_winds(flown: &[(f64, Vec<Impact>)], rule: &Rule) -> Vec<InWind> {
    let mut least_m: f64 = 0.0;
    let in_wind = |(wind_m_s, impacts): &(f64, Vec<Impact>)| {
        let planned = || impacts.iter().filter(|impact| impact.way == Way::AsPlanned);
        let landed = planned().filter(|impact| impact.landed).count();
        let landed = Share::new(landed as u64, planned().count() as u64);
        let enough = landed.of >= FEWEST;
        let widest = widest(impacts).filter(|(_, radius)| enough && radius.flights as u64 >= FEWEST);
        let circle = widest.map(|(way, radius)| {
            least_m = least_m.max(keep_out_m(&radius, rule));
            Circle { keep_out_m: least_m, way, radius, farthest_m: farthest_m(impacts) }
        });
        InWind { wind_m_s: *wind_m_s, landed: enough.then_some(landed), circle }
    };
    flown.iter().map(in_wind).collect()
}

fn farthest_m(impacts: &[Impact]) -> [f64; 3] {
    let places = || impacts.iter().filter_map(Impact::in_wind_m);
    let most = |of: fn([f64; 2]) -> f64| places().map(of).fold(0.0, f64::max);
    [most(|[along_m, _]| along_m), most(|[_, across_m]| across_m.abs()), most(|[along_m, _]| -along_m)]
}

/// The strongest of these winds up to which at least nine tenths as many flights land as in the calmest one; `None` if too few
/// flights tell of it.
pub fn limit_m_s(winds: &[InWind]) -> Option<f64> {
    const KEPT: f64 = 0.9;
    let calmest = winds.first()?.landed?;
    let may_fly = |wind: &&InWind| {
        wind.circle.is_some() && wind.landed.is_some_and(|landed| landed.share >= KEPT * calmest.share)
    };
    winds.iter().take_while(may_fly).last().map(|wind| wind.wind_m_s)
}

/// What an abort does: when, and what happens. The words are those of SAFETY.md.
pub const ABORTS: [[&str; 2]; 7] = [
    ["on the pad, in the countdown", "disarmed, both motors inhibited; keep away for 60 s"],
    ["below a drone", "inhibited; it stays on the drone"],
    [
        "commanded to light, before the lift-off",
        "the ascent motor's igniter is switched off, disarmed, both motors inhibited; keep away for 60 s, because it had current. \
         A disarm does the same. If the motor has lit, or lights late, the next row",
    ],
    [
        "under the ascent motor, and coasting",
        "the ascent motor cannot be stopped; the landing motor is inhibited, and the parachute opens at apogee",
    ],
    ["falling, with room for the parachute (80 to 120 m for mk2)", "landing motor inhibited, parachute"],
    [
        "falling, below that height",
        "it burns if every check for the ignition passes, else inhibited with open fins: an impact",
    ],
    [
        "landing motor lit",
        "it cannot be stopped, and there is never a parachute under thrust: the vehicle lands on the ground below it instead of \
         at the pad",
    ],
];

/// The rows of [`ABORTS`] for flights that begin so.
pub fn aborts(start: StartPoint) -> Vec<[&'static str; 2]> {
    let before: &[usize] = match start {
        StartPoint::Pad => &[0, 2, 3],
        StartPoint::Apogee => &[0],
        StartPoint::Drone => &[1],
    };
    before.iter().chain(&[4, 5, 6]).map(|row| ABORTS[*row]).collect()
}

/// Half the side of the plan and the radius of its widest circle, in its own units.
const HALF: f64 = 100.0;
const WIDEST: f64 = 70.0;
/// Where the names of the circles stand on them, from the crosswind line towards downwind, degrees: so that they do not overlap.
const NAMED_DEG: [f64; 4] = [15.0, 165.0, 50.0, 130.0];

/// The circles from above, to scale, with the line downwind. `wind_from_deg` is where the wind comes from, clockwise from north,
/// which is up then; without it up is downwind. `None` without a circle.
pub fn plan(winds: &[InWind], wind_from_deg: Option<f64>) -> Option<String> {
    let circles: Vec<(f64, &Circle)> =
        winds.iter().filter_map(|wind| Some((wind.wind_m_s, wind.circle.as_ref()?))).collect();
    let scale = WIDEST / circles.last()?.1.keep_out_m;
    let to_deg = wind_from_deg.map(|from_deg| (from_deg + 180.0) % 360.0);
    let (sin, cos) = libm::sincos(to_deg.unwrap_or(0.0).to_radians());
    // From downwind, and to the right of that; the plan's y goes down.
    let at = |along: f64, right: f64| [along * sin + right * cos, right * sin - along * cos];
    let text =
        |[x, y]: [f64; 2], words: &str| format!("<text x=\"{x:.1}\" y=\"{:.1}\">{words}</text>", y + 2.5);
    let line = |class: &str, from: [f64; 2], to: [f64; 2]| {
        let [[x1, y1], [x2, y2]] = [from, to];
        format!("<line class=\"{class}\" x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\"/>")
    };
    let (mut lines, mut names) = (String::new(), String::new());
    for (place, (wind_m_s, circle)) in circles.iter().enumerate() {
        let radius = scale * circle.keep_out_m;
        let _ = write!(lines, "<circle r=\"{radius:.1}\"/>");
        let [x, y] = at(-scale * circle.crew_m() - 1.0, 0.0);
        let _ = write!(lines, "<circle class=\"crew\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2\"/>");
        // Circles of one size have one name.
        if circles.get(place + 1).is_none_or(|(_, next)| next.keep_out_m > circle.keep_out_m) {
            let (ahead, right) = libm::sincos(NAMED_DEG[place % NAMED_DEG.len()].to_radians());
            names += &text(
                at(radius * ahead, radius * right),
                &format!("{wind_m_s} m/s: {:.0} m", circle.keep_out_m),
            );
        }
    }
    let tip = HALF - 14.0;
    lines += &line("downwind", [0.0; 2], at(tip, 0.0));
    lines += &line("downwind", at(tip - 6.0, -4.0), at(tip, 0.0));
    lines += &line("downwind", at(tip - 6.0, 4.0), at(tip, 0.0));
    lines += &line("", [-3.0, -3.0], [3.0, 3.0]);
    lines += &line("", [-3.0, 3.0], [3.0, -3.0]);
    let downwind =
        to_deg.map_or_else(|| "downwind".to_owned(), |to_deg| format!("downwind, {to_deg:03.0}\u{b0}"));
    names += &text(at(HALF - 7.0, 0.0), &downwind);
    names += &text(at(-HALF + 7.0, 0.0), "launch crew, upwind");
    if to_deg.is_some() {
        names += &text([HALF - 8.0, -HALF + 18.0], "N");
        lines += &line("", [HALF - 8.0, -HALF + 12.0], [HALF - 8.0, -HALF + 2.0]);
        lines += &line("", [HALF - 11.0, -HALF + 6.0], [HALF - 8.0, -HALF + 2.0]);
        lines += &line("", [HALF - 5.0, -HALF + 6.0], [HALF - 8.0, -HALF + 2.0]);
    }
    let side = 2.0 * HALF;
    Some(format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"-{HALF} -{HALF} {side} {side}\">{lines}{names}</svg>"
    ))
}

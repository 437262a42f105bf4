//! The side of a card for the range safety officer: safe distances by wind, and the effects of an
//! abort.

use core::fmt::Write as _;

use flight::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;
use flight::vehicle::launch::Launch;
use flight::vehicle::mission::{Mission, StartPoint};

use protocol::motion::Degrees;

use super::sheet::words_of;
use crate::hazard::{Case, Impact, Radius, Rule, exclusion_m, landed_as_planned, lift_off_kg, widest};
use crate::statistics::Landings;

/// Fewest flights behind a stated rate, and behind a radius without an upper end.
pub const FEWEST: u64 = 100;
/// Distance of the launch crew outside of the circle, m.
const BESIDE_M: f64 = 10.0;

/// Results of the flights in one wind.
#[derive(Debug, Clone, PartialEq)]
pub struct InWind {
    /// Mean wind 10 m above the ground.
    pub wind_m_s: f64,
    /// Flights behind the rate, or else behind the radius, and how many are needed, where they are
    /// too few.
    pub too_few: Option<[u64; 2]>,
    /// How the flights as planned landed.
    pub landed: Option<Landings>,
    pub circle: Option<Circle>,
}

/// A keep-out circle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circle {
    /// Radius about the landing pad required by flights and rule, in this wind and in less.
    pub exclusion_m: f64,
    /// The case with the farthest impacts, with its flights.
    pub case: Case,
    pub radius: Radius,
    /// The farthest impacts of all flights downwind, across the wind and upwind, m.
    pub farthest_m: [f64; 3],
}

impl Circle {
    /// Distance of the launch crew, upwind of the pad, m.
    pub fn crew_m(&self) -> f64 {
        self.exclusion_m + BESIDE_M
    }
}

/// Results in each wind, in rising order.
pub fn in_winds(flown: &[(f64, Vec<Impact>)], rule: &Rule) -> Vec<InWind> {
    let mut least_m: f64 = 0.0;
    let in_wind = |(wind_m_s, impacts): &(f64, Vec<Impact>)| {
        let landed = landed_as_planned(impacts);
        let enough = landed.stands.of >= FEWEST;
        let widest = widest(impacts);
        let [rated, held] = [landed.stands.of, widest.map_or(0, |(_, radius)| radius.flights as u64)];
        let too_few =
            [[rated, FEWEST], [held, Radius::FEWEST]].into_iter().find(|[flown, needed]| flown < needed);
        let widest = widest.filter(|_| enough && held >= FEWEST);
        let circle = widest.map(|(case, radius)| {
            least_m = least_m.max(exclusion_m(&radius, rule));
            Circle { exclusion_m: least_m, case, radius, farthest_m: farthest_m(impacts) }
        });
        InWind { wind_m_s: *wind_m_s, too_few, landed: enough.then_some(landed), circle }
    };
    flown.iter().map(in_wind).collect()
}

fn farthest_m(impacts: &[Impact]) -> [f64; 3] {
    let places = || impacts.iter().filter_map(Impact::in_wind_m);
    let most = |of: fn([f64; 2]) -> f64| places().map(of).fold(0.0, f64::max);
    [most(|[along_m, _]| along_m), most(|[_, across_m]| across_m.abs()), most(|[along_m, _]| -along_m)]
}

/// Strongest wind in which the codes permit a launch, m/s: 20 mph (rule 9 of the NAR High Power
/// Rocket Safety Code and of the NAR Model Rocket Safety Code, August 2012).
pub const PERMITTED_M_S: f64 = 8.9;

/// The strongest of these winds that is permitted, and up to which at least nine tenths as many
/// flights land as in the calmest one; `None` with too few flights.
pub fn limit_m_s(winds: &[InWind]) -> Option<f64> {
    const SHARE: f64 = 0.9;
    let calmest = winds.first()?.landed?;
    // A radius without an upper end has no safe outside.
    let ends = |circle: Circle| circle.exclusion_m.is_finite() && circle.radius.high_m.is_some();
    let may_fly = |wind: &&InWind| {
        wind.wind_m_s <= PERMITTED_M_S
            && wind.circle.is_some_and(ends)
            && wind.landed.is_some_and(|landed| landed.stands.share >= SHARE * calmest.stands.share)
    };
    winds.iter().take_while(may_fly).last().map(|wind| wind.wind_m_s)
}

/// Mean thrust of the first half second over the weight, at the lift-off.
pub fn thrust_to_weight(mission: &Mission, launch: &Launch) -> f64 {
    const FIRST_S: f64 = 0.5;
    let weight_n = lift_off_kg(mission, Some(launch)) * STANDARD_GRAVITY_M_S2;
    launch.booster.motor_curve.mean_thrust_n(0.0, FIRST_S) / weight_n
}

/// How far the stack's centre of pressure lies behind its centre of gravity at the lift-off, in
/// diameters of the body.
pub fn calibres(mission: &Mission, launch: &Launch) -> f64 {
    let (booster, mass, body) = (&launch.booster, &mission.airframe.mass, &mission.airframe.body);
    let propellant_kg = booster.motor_curve.propellant_mass_kg();
    let centre = |of: &[(f64, f64)]| {
        of.iter().map(|(weight, at_m)| weight * at_m).sum::<f64>()
            / of.iter().map(|(weight, _)| weight).sum::<f64>()
    };
    let gravity_m = centre(&[
        (mass.loaded_kg, mass.loaded_cg_station_m),
        (booster.dry_kg, booster.cg_station_m),
        (propellant_kg, booster.propellant_station_m),
    ]);
    let pressure_m =
        centre(&[booster.nose, booster.fin_force].map(|force| (force.slope_per_rad, force.station_m)));
    (gravity_m - pressure_m) / body.diameter_m
}

/// Effects of an abort, by time, for flights with this start, or for all; with the height of the
/// feet from which a parachute opens.
pub fn aborts(start: Option<StartPoint>, height: &str) -> Vec<Vec<String>> {
    let only = |of: &[StartPoint]| start.is_none_or(|start| of.contains(&start)).then(String::new);
    words_of(
        "aborts",
        &[
            ("ground", only(&[StartPoint::Pad, StartPoint::Apogee])),
            ("drone", only(&[StartPoint::Drone])),
            ("rail", only(&[StartPoint::Pad])),
            ("chute", Some(height.to_owned())),
        ],
    )
}

/// Half the width and half the height of the plan, the distance of the farthest crew in it, and the
/// length of its line, in the plan's units.
const HALF: [f64; 2] = [140.0, 98.0];
const WIDEST: f64 = 72.0;
const LINE: f64 = 84.0;
/// Directions from the pad to the names of the circles in turn, downwind and across the wind: no
/// two names of four circles overlap.
const NAMED: [[f64; 2]; 4] = [[0.0, 1.0], [0.0, -1.0], [0.71, 0.71], [0.71, -0.71]];

/// Dashes of the circles in turn, so that they differ without colour.
const DASHES: [&str; 4] = ["none", "7 2", "2 2", "7 2 2 2"];

/// The circles of the permitted winds from above, to scale, with the line downwind. `wind_from_deg`
/// is the direction of the wind, clockwise from north, which is up then; without it up is downwind.
/// `None` without a circle.
///
/// The lines of the field, as points north and east, m, are drawn where north is known. The
/// position of the pad is written beside.
pub fn plan(
    winds: &[InWind],
    wind_from_deg: Option<f64>,
    field: &[(&str, Vec<(f64, f64)>)],
    pad: Degrees,
) -> Option<String> {
    let limit_m_s = limit_m_s(winds)?;
    let may_fly = winds.iter().filter(|wind| wind.wind_m_s <= limit_m_s);
    let circles: Vec<(f64, &Circle)> =
        may_fly.filter_map(|wind| Some((wind.wind_m_s, wind.circle.as_ref()?))).collect();
    let scale = WIDEST / circles.last()?.1.crew_m();
    let (sin, cos) = libm::sincos(wind_from_deg.map_or(0.0, |from_deg| from_deg + 180.0).to_radians());
    // From downwind, and to the right of that; the plan's y goes down.
    let at = |along: f64, right: f64| [along * sin + right * cos, right * sin - along * cos];
    // Words beyond an end of the line need more room where they stand beside it.
    let beyond = |end: f64, half: f64| at(end + (8.0 + half * sin.abs()) * end.signum(), 0.0);
    let text = |[x, y]: [f64; 2], anchor: &str, words: &str| {
        let y = y + 3.0;
        format!("<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{words}</text>")
    };
    let line = |class: &str, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2]| {
        format!("<line class=\"{class}\" x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\"/>")
    };
    let (mut lines, mut names) = (String::new(), String::new());
    for (kind, points) in field.iter().filter(|_| wind_from_deg.is_some()) {
        let points = points.iter().map(|(north, east)| format!("{:.1},{:.1}", scale * east, -scale * north));
        let points = points.collect::<Vec<_>>().join(" ");
        let _ = write!(lines, "<polyline class=\"{kind}\" points=\"{points}\"/>");
    }
    for (place, (wind_m_s, circle)) in circles.iter().enumerate() {
        let radius = scale * circle.exclusion_m;
        let dashes = DASHES[place % DASHES.len()];
        let _ = write!(lines, "<circle r=\"{radius:.1}\" stroke-dasharray=\"{dashes}\"/>");
        let [x, y] = at(-scale * circle.crew_m() - 1.0, 0.0);
        let _ = write!(lines, "<circle class=\"crew\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2\"/>");
        let [along, right] = NAMED[place % NAMED.len()].map(|share| (radius + 2.0) * share);
        let beside = at(along, right);
        let anchor = match beside[0] / radius {
            x if x.abs() < 0.5 => "middle",
            x if x < 0.0 => "end",
            _ => "start",
        };
        names += &text(beside, anchor, &format!("{wind_m_s} m/s"));
    }
    for from in [at(0.0, 0.0), at(LINE - 6.0, -4.0), at(LINE - 6.0, 4.0)] {
        lines += &line("downwind", from, at(LINE, 0.0));
    }
    lines += &line("", [-3.0, -3.0], [3.0, 3.0]);
    lines += &line("", [-3.0, 3.0], [3.0, -3.0]);
    names += &text(beyond(LINE, 20.0), "middle", "downwind");
    names += &text(beyond(-WIDEST - 3.0, 24.0), "middle", "launch crew");
    let [half_x, half_y] = HALF;
    let Degrees { latitude, longitude } = pad;
    let position = format!("pad {latitude:.5}, {longitude:.5}");
    names += &text([2.0 - half_x, half_y - 8.0], "start", &position);
    if wind_from_deg.is_some() {
        let tip = [half_x - 8.0, 3.0 - half_y];
        names += &text([tip[0], tip[1] + 17.0], "middle", "N");
        for (x, y) in [(0.0, 11.0), (-3.0, 5.0), (3.0, 5.0)] {
            lines += &line("", [tip[0] + x, tip[1] + y], tip);
        }
    }
    let (width, height) = (2.0 * half_x, 2.0 * half_y);
    Some(format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"-{half_x} -{half_y} {width} {height}\">{lines}{names}</svg>"
    ))
}

//! Impact areas of a vehicle for each case of a flight, which determine the safe distance of
//! people.
//!
//! Each flight is flown as drawn. Copies of it are aborted under way, each at a moment drawn evenly
//! from one part of that flight, or get a fault before it acts. A vehicle that lifts off
//! uncommanded is a separate flight with the same draws.

use core::fmt;
use std::collections::BTreeMap;

use flight::computer::AbortEffect;
use flight::rules::outputs::PyroOutput;
use flight::rules::phase::Phase;
use flight::rules::verdict::Landing;
use flight::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;
use flight::vehicle::launch::Launch;
use flight::vehicle::mission::{Mission, StartPoint};
use flight::vehicle::site::Site;
use flight::vehicle::thrust_curve::ThrustCurve;
use nalgebra::Vector3;
use serde::Serialize;
use serde_json::{Value, json};
use sim::draw::{Chance, draw};
use sim::fault::TimedFault;
use sim::recipe::Recipe;
use sim::sortie::{SetUpError, Sortie};
use sim::world::ground::RestOutcome;
use sim::world::plant::LONG_STRIDE;
use sim::world::wind::Wind;
use sim::world::{Actuators, Fault};
use statrs::distribution::{Binomial, DiscreteCDF as _};

use crate::run::{RunError, in_parallel};
use crate::statistics::Landings;

/// The share of the flights that a radius must contain.
const HELD: f64 = 0.99;
/// Each end of a 95 % interval.
const TAIL: f64 = 0.025;
/// A flight that is still in the air after this is given up, s; it counts as infinitely far.
const LONGEST_S: f64 = 900.0;
/// Time after the first contact at which sliding ends, s.
const SLIDES_S: f64 = 5.0;
/// Any number that no other draw uses.
const OF_HAZARD: u64 = 0x4a2a_0000_0000_0005;

flight::numbered_enum! {
/// A case in which a flight can end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Case {
    AsPlanned = "as planned",
    /// Aborted in the boost or in the coast: the parachute opens at apogee, the longest way under
    /// it.
    AbortInAscent = "aborted in boost, coast",
    /// Aborted at apogee, of a flight that begins there.
    ParachuteFromApogee = "parachute from apogee",
    /// Aborted in the descent, with room for the parachute.
    AbortInDescent = "aborted in the descent",
    /// Aborted before the ignition, too low for the parachute: it burns or hits the ground.
    AbortTooLow = "aborted below commit",
    /// Aborted under the landing motor.
    AbortUnderThrust = "aborted under thrust",
    NoLight = "landing motor not ignited",
    NoSeparation = "booster stays on",
    /// A disarmed vehicle lifts off.
    Uncommanded = "uncommanded lift-off",
    /// The booster separates. No fin opens, no parachute, and no motor ignites.
    Ballistic = "ballistic",
    /// Nothing happens any more after the lift-off, as with a dead flight computer.
    BallisticWithBooster = "ballistic, with booster",
    /// The booster without its parachute: along its axis or tumbling, whichever carries it farther.
    Booster = "spent booster, ballistic",
}
}

impl Case {
    /// The one start from which it happens; `None`: it happens from all.
    const fn start(self) -> Option<StartPoint> {
        match self {
            Self::AbortInAscent
            | Self::NoSeparation
            | Self::Uncommanded
            | Self::BallisticWithBooster
            | Self::Booster => Some(StartPoint::Pad),
            Self::ParachuteFromApogee => Some(StartPoint::Apogee),
            _ => None,
        }
    }

    /// The faults of the case; none for the nominal flight.
    const fn faults(self) -> &'static [&'static str] {
        match self {
            Self::NoLight => &["no-light@0"],
            Self::NoSeparation => &["separation-fails@0"],
            Self::Ballistic => &[
                "no-light@0",
                "parachute-fails@0",
                "fin-stuck:0@0",
                "fin-stuck:1@0",
                "fin-stuck:2@0",
                "fin-stuck:3@0",
            ],
            Self::BallisticWithBooster => &["separation-fails@0", "parachute-fails@0"],
            _ => &[],
        }
    }

    /// The cases of a mission's flights.
    pub fn of(mission: &Mission) -> Vec<Self> {
        let happens = |case: &Self| case.start().is_none_or(|start| start == mission.start.at);
        Self::ALL.into_iter().filter(happens).collect()
    }

    /// A copy of the nominal flight in this phase gets the faults of the case: they act later.
    fn breaks(self, phase: Phase) -> bool {
        let falls = !phase.before_apogee();
        if self == Self::NoLight {
            return falls && phase != Phase::Deploy;
        }
        !self.faults().is_empty() && (falls || phase == Phase::Coast)
    }

    /// Whether the nominal flight is needed beyond its apogee.
    fn needs_descent(self) -> bool {
        let leaves = [Self::AbortInAscent, Self::ParachuteFromApogee, Self::Booster].contains(&self);
        self == Self::NoLight || self.faults().is_empty() && !leaves
    }

    /// The abort of a flight at this moment would end it so.
    fn aborts(self, phase: Phase, effect: AbortEffect) -> bool {
        match self {
            Self::AbortInAscent => effect == AbortEffect::ChuteAtApogee,
            Self::ParachuteFromApogee => phase == Phase::Deploy,
            Self::AbortInDescent => effect == AbortEffect::ChuteNow,
            Self::AbortTooLow => {
                let falls = matches!(phase, Phase::Deploy | Phase::AeroDescent | Phase::LandArmed);
                falls && matches!(effect, AbortEffect::Burn | AbortEffect::Impact { .. })
            }
            Self::AbortUnderThrust => {
                // The thrust is confirmed a quarter of a second after it has begun.
                matches!(phase, Phase::Ignition | Phase::Powered)
                    && matches!(effect, AbortEffect::LandInPlace | AbortEffect::LandUpright)
            }
            _ => false,
        }
    }
}

/// Impact of a flight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Impact {
    pub case: Case,
    /// Number of the flight.
    pub number: u64,
    /// Place from the pad, m along world x and y; `None` if it was still in the air after a quarter
    /// of an hour.
    pub place_m: Option<[f64; 2]>,
    /// Where the wind of this flight blows to, from world x towards y.
    pub downwind_rad: f64,
    pub landing: Landing,
    pub course: Course,
}

/// Further values of a flight for people on the ground.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Course {
    /// Greatest height of the centre of gravity above the pad, m.
    pub highest_m: f64,
    /// Speed at the end of the rail, m/s; for a flight observed from its rail on.
    pub rail_m_s: Option<f64>,
    /// Lowest height of the feet in the fall from which an abort would still have opened the
    /// parachute, m.
    pub chute_down_to_m: Option<f64>,
    /// Height of the feet when the landing motor got its current, m.
    pub ignition_m: Option<f64>,
    /// From the ejection of the parachute to the ground, s.
    pub canopy_s: Option<f64>,
    /// It is not upright at the end: it tipped over, or its body struck the ground.
    pub lies: bool,
    /// Where the stack stood, m, and its speed a frame ago, m/s, while it is on its rail.
    on_rail: Option<(Vector3<f64>, f64)>,
}

impl Course {
    fn note(&mut self, flight: &Sortie) {
        let (world, computer) = (flight.world(), flight.computer());
        let (state, phase) = (world.state(), computer.mode().phase);
        self.highest_m = self.highest_m.max(state.position_m.z);
        self.lies = world.rest().is_some_and(|rest| rest.outcome != RestOutcome::Upright);
        let ejected_s = world.parachute_ejected_s();
        let down_s = world.touchdown().map(|touchdown| touchdown.time_s);
        self.canopy_s = down_s.zip(ejected_s).map(|(down_s, ejected_s)| down_s - ejected_s);
        if world.thrust_begins_s().is_some() {
            self.ignition_m.get_or_insert(world.height_m());
        }
        if !phase.before_apogee() && computer.abort_effect() == AbortEffect::ChuteNow {
            self.chute_down_to_m = Some(world.height_m());
        }
        if let Some(launch) = flight.mission().launched().filter(|_| world.booster_attached()) {
            let speed_m_s = libm::sqrt(state.velocity_m_s.norm_squared());
            let (stood_m, last_m_s) = *self.on_rail.get_or_insert((state.position_m, speed_m_s));
            let travelled_m = libm::sqrt((state.position_m - stood_m).norm_squared());
            if travelled_m < launch.rail.length_m {
                self.on_rail = Some((stood_m, speed_m_s));
            } else {
                self.rail_m_s.get_or_insert(last_m_s);
            }
        }
    }
}

impl Impact {
    /// Distance from the pad, m.
    pub fn distance_m(&self) -> f64 {
        self.place_m.map_or(f64::INFINITY, |[x_m, y_m]| libm::hypot(x_m, y_m))
    }

    /// Place from the pad, m downwind and, left of that, across the wind.
    pub fn in_wind_m(&self) -> Option<[f64; 2]> {
        let [x_m, y_m] = self.place_m?;
        let (sin, cos) = libm::sincos(self.downwind_rad);
        Some([x_m * cos + y_m * sin, y_m * cos - x_m * sin])
    }
}

/// A radius about the pad, m.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Radius {
    pub flights: usize,
    /// The least radius that holds 99 % of these flights.
    pub holds_m: f64,
    /// Ends of the 95 % interval of the radius that holds 99 % of all flights there could be. Fewer
    /// than [`Radius::FEWEST`] flights have no upper end.
    pub low_m: f64,
    pub high_m: Option<f64>,
    pub farthest_m: f64,
}

impl Radius {
    /// Fewest flights with an upper end: 0.99^368 is less than 0.025.
    pub const FEWEST: u64 = 368;

    /// The radius of distances, m; `None` without any. The ends are order statistics: the number of
    /// n flights that come down inside the true radius is binomial (W. J. Conover, Practical
    /// Nonparametric Statistics, section 3.2), for any distribution of the distances.
    pub fn of(mut distances_m: Vec<f64>) -> Option<Self> {
        distances_m.sort_by(f64::total_cmp);
        let (flights, farthest_m) = (distances_m.len(), *distances_m.last()?);
        let inside = Binomial::new(HELD, flights as u64).ok()?;
        // The k-th nearest is beyond the true radius with the probability that fewer than k are
        // inside of it.
        let fewer_than = |k: usize| k.checked_sub(1).map_or(0.0, |most| inside.cdf(most as u64));
        let lowest = (1..=flights).rev().find(|k| fewer_than(*k) <= TAIL);
        let highest = (1..=flights).find(|k| fewer_than(*k) >= 1.0 - TAIL);
        let held = libm::ceil(HELD * flights as f64 - 1e-9) as usize;
        Some(Self {
            flights,
            holds_m: distances_m[held.max(1) - 1],
            low_m: lowest.map_or(0.0, |k| distances_m[k - 1]),
            high_m: highest.map(|k| distances_m[k - 1]),
            farthest_m,
        })
    }

    /// The radius of one case, from the impacts of many.
    pub fn of_case(impacts: &[Impact], case: Case) -> Option<Self> {
        Self::of(impacts.iter().filter(|impact| impact.case == case).map(Impact::distance_m).collect())
    }

    /// The safe radius according to these flights: the upper end, or the farthest.
    pub fn outside_m(&self) -> f64 {
        self.high_m.map_or(self.farthest_m, |high_m| high_m.max(self.holds_m))
    }
}

/// How many flights are flown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Flights {
    /// Flights as planned, and of every case that comes half as far as the farthest.
    pub survey: u64,
    /// Flights of the cases that reached nearly as far as the farthest.
    pub of_widest: u64,
}

/// Share of the farthest distance from which a case counts among the widest, by its farthest
/// flight in the survey.
const NEARLY: f64 = 0.9;
/// Flights after which a case that has not come half as far as the farthest ends its survey.
const GLANCE: u64 = 25;
const HALF: f64 = 0.5;

/// [`study`] of each recipe. `done` gets how many flights of all are flown, of about how many.
///
/// # Errors
/// A flight cannot be set up.
pub fn studies(
    recipes: &[Recipe],
    flights: Flights,
    done: &(dyn Fn(usize, usize) + Sync),
) -> Result<Vec<Vec<Impact>>, RunError> {
    let mut before = 0;
    let of_each = (1..=recipes.len()).rev().zip(recipes).map(|(left, recipe)| {
        let impacts = study(recipe, flights, &|flown, of| done(before + flown, before + left * of))?;
        before += impacts.len();
        Ok(impacts)
    });
    of_each.collect()
}

/// Flies every case of a recipe's mission, and the widest ones as often as requested. `done`
/// gets the number of flights flown, and of all, assuming that the widest cases so far stay
/// the widest.
///
/// Dropping a case does not weaken the upper end of a radius. An upper end needs more flights than
/// the default survey has, so it is computed only once, after all flights. A lower end may be that
/// of any of the three stages; each of them has the stated error.
///
/// # Errors
/// A flight cannot be set up.
pub fn study(
    recipe: &Recipe,
    flights: Flights,
    done: &(dyn Fn(usize, usize) + Sync),
) -> Result<Vec<Impact>, RunError> {
    let Flights { survey, of_widest } = Flights { survey: flights.survey.min(flights.of_widest), ..flights };
    let mut cases = Case::of(&recipe.mission);
    let fly_some = |cases: &[Case], numbers: core::ops::Range<u64>, show: &(dyn Fn(usize) + Sync)| {
        let numbers: Vec<u64> = numbers.collect();
        let one = |number: &u64| {
            fly(recipe, cases, *number).map_err(|source| RunError::Fly { number: *number, source })
        };
        let flown = in_parallel(&numbers, one, &|flown| show(flown * cases.len()));
        Ok::<_, RunError>(flown.into_iter().collect::<Result<Vec<_>, _>>()?.concat())
    };
    let (mut impacts, mut from) = (Vec::<Impact>::new(), 0);
    // The rate of landings needs all flights of the survey.
    let stages = [(survey.min(GLANCE), 0.0, true), (survey, HALF, true), (of_widest, NEARLY, false)];
    for (to, share, rate) in stages {
        let farthest_m = |case: Case| {
            let of_case = impacts.iter().filter(|impact| impact.case == case);
            of_case.map(Impact::distance_m).fold(0.0, f64::max)
        };
        let overall_m = cases.iter().map(|case| farthest_m(*case)).fold(0.0, f64::max);
        let reaches = |share: f64, case: &Case| farthest_m(*case) >= share * overall_m;
        cases.retain(|case| reaches(share, case) || rate && *case == Case::AsPlanned);
        let before = impacts.len();
        // Before the first flights every case would be among the widest.
        let likely = cases.iter().filter(|case| before > 0 && reaches(NEARLY, case)).count().max(1);
        let of = before + (to - from) as usize * cases.len() + (of_widest - to) as usize * likely;
        impacts.extend(fly_some(&cases, from..to, &|flown| done(before + flown, of))?);
        from = to;
    }
    Ok(impacts)
}

/// The safe radius according to the flights: the widest of all cases, with its case; `None`
/// without flights.
pub fn widest(impacts: &[Impact]) -> Option<(Case, Radius)> {
    let radii = Case::ALL.into_iter().filter_map(|case| Some((case, Radius::of_case(impacts, case)?)));
    // Of cases with equal reach the one with an upper end.
    let key = |radius: &Radius| (radius.outside_m(), radius.high_m.is_some());
    radii.max_by(|one, two| {
        let ((one_m, one_ends), (two_m, two_ends)) = (key(&one.1), key(&two.1));
        one_m.total_cmp(&two_m).then(one_ends.cmp(&two_ends))
    })
}

/// Where flights in one wind come down, as JSON: by case, and the distance of people, m.
pub fn json(wind_m_s: f64, impacts: &[Impact], rule: &Rule) -> Value {
    let of_case = |case: Case| Some((case.name(), Radius::of_case(impacts, case)?));
    let cases: BTreeMap<_, _> = Case::ALL.into_iter().filter_map(of_case).collect();
    let widest = widest(impacts);
    json!({
        "wind_m_s": wind_m_s, "cases": cases, "widest": widest.map(|(case, _)| case.name()),
        "exclusion_m": widest.map(|(_, radius)| exclusion_m(&radius, rule)),
        "as_planned": landed_as_planned(impacts),
    })
}

/// Exclusion distance, m: the larger one of flights and rule, rounded up to ten metres.
pub fn exclusion_m(radius: &Radius, rule: &Rule) -> f64 {
    10.0 * libm::ceil(radius.outside_m().max(rule.distance_m()) / 10.0)
}

/// Flies flight `number` of a recipe in some cases.
///
/// # Errors
/// The flight cannot be set up.
pub fn fly(recipe: &Recipe, cases: &[Case], number: u64) -> Result<Vec<Impact>, SetUpError> {
    let mut impacts = Vec::with_capacity(cases.len());
    let drawn = draw(&recipe.mission, &recipe.dispersion, recipe.seed, number);
    let downwind_rad = drawn.truth.wind_towards_rad;
    let mut add = |case: Case, (place_m, course), landing| {
        impacts.push(Impact { case, number, place_m, downwind_rad, landing, course });
    };
    let (alone, beside): (Vec<Case>, Vec<Case>) = cases.iter().partition(|case| **case == Case::Uncommanded);
    if !beside.is_empty() {
        let begin = |case: &Case| Branch { case: *case, copy: None, frames: 0 };
        let mut branches: Vec<Branch> = beside.iter().map(begin).collect();
        let mut chance = Chance::of(recipe.seed ^ OF_HAZARD, number);
        let mut flight = Sortie::new(recipe, number)?;
        let (mut attached, mut booster) = (flight.world().booster_attached(), None);
        let to_the_ground = beside.iter().any(|case| case.needs_descent());
        let planned = come_down(&mut flight, |flight| {
            let computer = flight.computer();
            let (phase, effect) = (computer.mode().phase, computer.abort_effect());
            for branch in &mut branches {
                if branch.case.aborts(phase, effect) {
                    branch.take(flight, &mut chance);
                } else if branch.copy.is_none() && branch.case.breaks(phase) {
                    branch.copy = Some(Box::new(flight.clone()));
                }
            }
            if attached && !flight.world().booster_attached() {
                booster = spent_booster_m(flight);
            }
            attached = flight.world().booster_attached();
            to_the_ground || phase.before_apogee() || phase == Phase::Deploy
        });
        for branch in branches {
            match (branch.case, branch.copy) {
                (Case::AsPlanned, _) => add(Case::AsPlanned, planned, flight.outcome().landing),
                (Case::Booster, _) => {
                    if let Some(place_m) = booster {
                        add(Case::Booster, (Some(place_m), Course::default()), Landing::default());
                    }
                }
                (case, Some(mut copy)) => {
                    let faults: Vec<TimedFault> =
                        case.faults().iter().filter_map(|fault| fault.parse().ok()).collect();
                    if faults.is_empty() {
                        copy.abort();
                    }
                    for fault in &faults {
                        copy.break_down(&fault.breakage);
                    }
                    let down = come_down(&mut copy, |_| true);
                    add(case, down, copy.outcome().landing);
                }
                // This flight had no such part.
                (_, None) => {}
            }
        }
    }
    for case in alone {
        let mut flight = uncommanded(recipe, number)?;
        let down = come_down(&mut flight, |_| true);
        add(case, down, flight.outcome().landing);
    }
    let place_of = |case: Case| cases.iter().position(|one| *one == case);
    impacts.sort_by_key(|impact| place_of(impact.case));
    Ok(impacts)
}

/// How the flights as planned landed.
pub fn landed_as_planned(impacts: &[Impact]) -> Landings {
    let planned = impacts.iter().filter(|impact| impact.case == Case::AsPlanned);
    Landings::of(planned.map(|impact| impact.landing))
}

/// A copy of a flight, to be aborted or to get a fault.
struct Branch {
    case: Case,
    copy: Option<Box<Sortie>>,
    frames: u64,
}

impl Branch {
    /// Retains this frame or the stored one, with equal probability for all (J. S. Vitter, Random
    /// Sampling with a Reservoir, 1985). At apogee the first one is retained.
    fn take(&mut self, flight: &Sortie, chance: &mut Chance) {
        self.frames += 1;
        let first = self.case == Case::ParachuteFromApogee;
        let selected = if first { self.frames == 1 } else { chance.unit() * (self.frames as f64) < 1.0 };
        if selected {
            self.copy = Some(Box::new(flight.clone()));
        }
    }
}

/// Flies until the vehicle is at rest; `look` examines every frame before it is flown, and decides
/// whether to go on. Returns the impact position, m, and the course.
fn come_down(flight: &mut Sortie, mut look: impl FnMut(&Sortie) -> bool) -> (Option<[f64; 2]>, Course) {
    let mut course = Course::default();
    let goes_on = |flight: &Sortie| {
        let world = flight.world();
        let slides = world.touchdown().is_none_or(|touchdown| world.time_s() < touchdown.time_s + SLIDES_S);
        world.rest().is_none() && slides && world.time_s() < LONGEST_S && world.state().is_finite()
    };
    while goes_on(flight) && look(flight) {
        course.note(flight);
        let last = *flight.computer().commands();
        flight.step();
        // The computer has nothing to decide any more: its commands stay as they are.
        if last.outputs.is_on(PyroOutput::Parachute) && *flight.computer().commands() == last {
            let held = Actuators { gimbal_rad: last.gimbal_rad, fins_rad: last.fins_rad, ..Actuators::NONE };
            while goes_on(flight) {
                course.note(flight);
                flight.world_mut().advance(&held, LONG_STRIDE);
            }
        }
    }
    let place_m = flight.world().state().position_m;
    let down = flight.world().touchdown().is_some() && flight.world().state().is_finite();
    course.note(flight);
    (down.then_some([place_m.x, place_m.y]), course)
}

/// A vehicle on its pad, disarmed, when its ascent motor ignites.
fn uncommanded(recipe: &Recipe, number: u64) -> Result<Sortie, SetUpError> {
    /// The self-test is over by then, s.
    const READY_S: f64 = 60.0;
    let mut flight = Sortie::on_the_pad(recipe, number)?.without_rehearsal();
    while flight.computer().mode().phase == Phase::Safe && flight.world().time_s() < READY_S {
        flight.step();
    }
    flight.world_mut().inject(&Fault::AscentSelfLights);
    Ok(flight)
}

/// Impact position of a booster just separated, m; without a parachute, as a point mass in the mean
/// wind. `None` without a booster.
fn spent_booster_m(flight: &Sortie) -> Option<[f64; 2]> {
    let (mission, world) = (flight.mission(), flight.world());
    let booster = &mission.launch.as_ref()?.booster;
    let (body, state) = (&mission.airframe.body, world.state());
    let (nose, mass_kg) = (state.nose_in_world(), booster.dry_kg);
    // The charge pushed the two apart.
    let apart_m_s = booster.separation_impulse_n_s * (1.0 / world.mass().mass_kg + 1.0 / mass_kg);
    let along_m2 = booster.stack_drag_coefficient * body.reference_area_m2;
    let across_m2 = body.crossflow_drag_coefficient * body.diameter_m * booster.length_m;
    let fallen = [along_m2, across_m2].map(|drag_area_m2| {
        let velocity_m_s = state.velocity_m_s - nose * apart_m_s;
        fallen_m(state.position_m, velocity_m_s, drag_area_m2 / mass_kg, &mission.site, world.wind())
    });
    fallen.into_iter().max_by(|one, two| libm::hypot(one[0], one[1]).total_cmp(&libm::hypot(two[0], two[1])))
}

/// Impact position of a point mass with a drag area for each kilogram, m^2/kg, m.
fn fallen_m(
    mut place_m: Vector3<f64>,
    mut velocity_m_s: Vector3<f64>,
    drag_area_m2_kg: f64,
    site: &Site,
    wind: &Wind,
) -> [f64; 2] {
    const STEP_S: f64 = 0.005;
    while place_m.z > 0.0 {
        let air_m_s = velocity_m_s - wind.mean_m_s(place_m.z);
        let density_kg_m3 = site.air_at_m(place_m.z).density_kg_m3;
        let speed_m_s = libm::sqrt(air_m_s.norm_squared());
        let acceleration = air_m_s * (-0.5 * density_kg_m3 * drag_area_m2_kg * speed_m_s)
            - Vector3::z() * STANDARD_GRAVITY_M_S2;
        place_m += velocity_m_s * STEP_S + acceleration * (0.5 * STEP_S * STEP_S);
        velocity_m_s += acceleration * STEP_S;
    }
    [place_m.x, place_m.y]
}

/// Requirement of a national association, independent of the flights.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rule {
    /// Least distance of people from the pad, feet.
    pub feet: f64,
    /// Total impulse of all motors, N s.
    pub impulse_n_s: f64,
    /// More than one motor.
    pub complex: bool,
    /// The model rocket code holds, and not that of high power.
    pub model: bool,
}

impl Rule {
    /// Source of the distances.
    pub const SOURCE: &str = "NAR High Power Rocket Safety Code (August 2012), minimum distance table; NAR Model Rocket Safety \
        Code, rule 5; both as tabled on lunar.org/wp/?p=98";

    /// The rule for a mission with all its motors. A model rocket has up to 160 N s, 125 g of
    /// propellant and 1,500 g.
    pub fn of(mission: &Mission) -> Self {
        let booster = mission.launched();
        let booster = booster.map(|launch| &launch.booster);
        let motors = || {
            [Some(&mission.motor_curve), booster.map(|booster| &booster.motor_curve)].into_iter().flatten()
        };
        let impulse_n_s: f64 = motors().map(ThrustCurve::total_impulse_n_s).sum();
        let propellant_kg: f64 = motors().map(ThrustCurve::propellant_mass_kg).sum();
        let mass_kg = lift_off_kg(mission, mission.launched());
        let model = impulse_n_s <= 160.0 && propellant_kg <= 0.125 && mass_kg <= 1.5;
        let complex = booster.is_some();
        let feet = if model {
            if impulse_n_s <= 20.0 { 15.0 } else { 30.0 }
        } else {
            high_power_ft(impulse_n_s, complex)
        };
        Self { feet, impulse_n_s, complex, model }
    }

    /// The distance, m.
    pub fn distance_m(&self) -> f64 {
        0.3048 * self.feet
    }
}

/// Mass of a mission's vehicle with its booster, if it has one, kg.
pub fn lift_off_kg(mission: &Mission, launch: Option<&Launch>) -> f64 {
    let booster = launch.map(|launch| &launch.booster);
    let booster_kg = booster.map_or(0.0, |booster| booster.dry_kg + booster.motor_curve.propellant_mass_kg());
    mission.airframe.mass.loaded_kg + booster_kg
}

/// Least distance of people by the total impulse, N s, feet.
fn high_power_ft(impulse_n_s: f64, complex: bool) -> f64 {
    /// Up to this impulse, N s: the distance from a rocket with one motor, and from one with more,
    /// feet.
    const TABLE: [(f64, [f64; 2]); 6] = [
        (1_280.0, [100.0, 200.0]),
        (2_560.0, [200.0, 300.0]),
        (5_120.0, [300.0, 500.0]),
        (10_240.0, [500.0, 1_000.0]),
        (20_480.0, [1_000.0, 1_500.0]),
        (f64::INFINITY, [1_500.0, 2_000.0]),
    ];
    let row = TABLE
        .iter()
        .find(|(most_n_s, _)| impulse_n_s <= *most_n_s)
        .map_or([f64::INFINITY; 2], |(_, feet)| *feet);
    row[usize::from(complex)]
}

impl fmt::Display for Rule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let motors = if self.complex { "two motors, a complex rocket" } else { "one motor" };
        let code = if self.model { "model rocket" } else { "high power" };
        write!(
            f,
            "{:.0} m ({:.0} ft): NAR, {code}, {:.0} N s, {motors}",
            libm::ceil(self.distance_m()),
            self.feet,
            self.impulse_n_s
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 0.99^367 = 0.02501 and 0.99^368 = 0.02476: 368 flights are the fewest of which the farthest
    /// is an upper end. Of 400 flights fewer than 393 are inside with a probability of 0.0507,
    /// fewer than 392 with 0.0206.
    #[test]
    fn val_binomial_the_interval_of_a_radius() {
        let distances = |count: u32| (1..=count).map(f64::from).collect::<Vec<f64>>();
        assert_eq!(Radius::of(distances(367)).unwrap().high_m, None);
        assert_eq!(Radius::of(distances(368)).unwrap().high_m, Some(368.0));
        let radius = Radius::of(distances(400)).unwrap();
        assert_eq!((radius.flights, radius.holds_m, radius.farthest_m), (400, 396.0, 400.0));
        assert_eq!((radius.low_m, radius.high_m), (392.0, Some(400.0)));
        assert_eq!(Radius::of(vec![]), None);
        // A flight that never landed is inside no radius.
        assert!(Radius::of(vec![1.0, f64::INFINITY]).unwrap().outside_m().is_infinite());
    }

    /// 80 m high at 10 m/s: sqrt(160 / 9.80665) = 4.0392 s. With much drag it drifts with the wind:
    /// 10 m/s, and a sink of sqrt(2 * 9.80665 / 1.225) = 4.0 m/s for 1 m^2/kg.
    #[test]
    fn val_hand_a_point_mass_falls_and_drifts() {
        let start_m = Vector3::new(3.0, -2.0, 80.0);
        let calm = Wind::new(0.0, 0.0, 0.0, 0);
        let [x_m, y_m] = fallen_m(start_m, Vector3::new(10.0, 0.0, 0.0), 0.0, &Site::default(), &calm);
        assert!((x_m - 43.39).abs() < 0.1 && (y_m + 2.0).abs() < 1e-9, "{x_m} {y_m}");
        let even = Wind::new(10.0, 0.0, 0.0, 0).over_height(0.0, 0.0);
        let [x_m, _] = fallen_m(start_m, Vector3::zeros(), 1.0, &Site::default(), &even);
        assert!((x_m - 203.0).abs() < 6.0, "{x_m}");
    }

    #[test]
    fn val_nar_distances_by_impulse() {
        for (impulse_n_s, one, several) in [
            (160.0, 100.0, 200.0),
            (1_280.0, 100.0, 200.0),
            (1_280.01, 200.0, 300.0),
            (5_000.0, 300.0, 500.0),
            (10_000.0, 500.0, 1_000.0),
            (20_000.0, 1_000.0, 1_500.0),
            (40_000.0, 1_500.0, 2_000.0),
        ] {
            let found = [false, true].map(|complex| high_power_ft(impulse_n_s, complex));
            assert!(
                (found[0] - one).abs() < 1e-9 && (found[1] - several).abs() < 1e-9,
                "{impulse_n_s} {found:?}"
            );
        }
        let of = |name: &str| flight::vehicles::mission::builtin(name).unwrap().unwrap();
        let mut mk2 = of("mk2");
        assert_eq!((Rule::of(&mk2).feet, Rule::of(&mk2).complex), (100.0, false));
        mk2.start.at = StartPoint::Pad;
        assert_eq!((Rule::of(&mk2).feet, Rule::of(&mk2).complex), (200.0, true));
        assert_eq!((Rule::of(&of("vlr")).feet, Rule::of(&of("vlr")).model), (30.0, true));
    }
}

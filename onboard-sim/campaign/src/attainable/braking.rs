//! The least and the greatest fall of a landing burn in one dimension.
//!
//! At every instant the acceleration lies between a soft and a hard one: the extremes over tilt and fins at that speed.
//! (At high speed a lean brakes harder than an upright vehicle: the body across the air gives more drag than the thrust
//! loses.) So the velocity over time lies between bang-bang paths. The least fall brakes hard from the first thrust on; a
//! vehicle that stops before the thrust has fallen through the weight hovers there, just above the ground, or climbs if
//! even the softest braking is more than its weight. The greatest fall brakes softly first and hard later, and touches
//! down at the limit of the legs, some time after the thrust has fallen through the weight: a later touchdown falls
//! farther at the end, but has to be slower before. In between any fall is possible.

use flight::vehicle::atmosphere::{Air, STANDARD_GRAVITY_M_S2};
use world::vertical::Vertical;

/// Length of a step, s. The midpoint rule's error is below a centimetre over a burn.
const STEP_S: f64 = 0.02;
/// Time after the burn that is looked at, s. A vehicle at rest then falls to the legs' limit (1 m/s) in a tenth of that.
const AFTER_S: f64 = 1.0;
/// Tilts tried for the hardest and softest braking. Between them a parabola is laid through three.
const TILTS: usize = 17;
/// Times of touchdown tried for the greatest fall, between which a parabola is laid, too.
const ENDS: usize = 16;
/// Speed beyond which a path backwards in time is not followed, m/s: no vehicle falls so fast.
const FASTEST_M_S: f64 = 150.0;
/// Halvings of the burn in the search for the earliest stop.
const HALVINGS: usize = 12;

/// Height, m, and vertical velocity, m/s.
type State = (f64, f64);

/// Which extreme of the acceleration.
#[derive(Clone, Copy, PartialEq)]
enum Brake {
    Soft,
    Hard,
}

/// The least fall from a state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Least {
    pub(super) fallen_m: f64,
    /// Whether a landing ends it. Otherwise it ends where the vehicle is slowest.
    pub(super) lands: bool,
}

/// One vehicle in its burn.
pub(super) struct Braking {
    vertical: Vertical,
    /// Mean thrust, N, and mass, kg, of each step.
    steps: Vec<(f64, f64)>,
    /// Cosine of the tilts, its square, and the cube of the sine.
    tilts: [[f64; 3]; TILTS],
    leg_m_s: f64,
    /// When the thrust falls through the weight for the last time, s.
    carried_until_s: f64,
    ground_density_kg_m3: f64,
    density_gradient_kg_m4: f64,
    /// Paths that brake hard until they touch down at the limit of the legs: time of touchdown, s, and the state at each
    /// step before it.
    endings: Vec<(f64, Vec<State>)>,
}

impl Braking {
    /// From the largest tilt, rad, and the legs' limit, m/s. `None` if the thrust never exceeds the weight.
    pub(super) fn new(vertical: Vertical, (tilt_max_rad, leg_m_s): (f64, f64)) -> Option<Self> {
        let burn = vertical.burn();
        let count = libm::ceil((burn.lasts_s() + AFTER_S) / STEP_S) as usize;
        let at_s = |step: usize| step as f64 * STEP_S;
        let steps: Vec<(f64, f64)> = (0..count)
            .map(|step| {
                // Simpson's rule.
                let [from_n, middle_n, to_n] =
                    [0.0, 0.5, 1.0].map(|share| burn.thrust_n(at_s(step) + share * STEP_S));
                let mass_kg = vertical.mass_kg(at_s(step) + 0.5 * STEP_S);
                ((from_n + 4.0 * middle_n + to_n) / 6.0, mass_kg)
            })
            .collect();
        let surplus_n =
            |time_s: f64| burn.thrust_n(time_s) - vertical.mass_kg(time_s) * STANDARD_GRAVITY_M_S2;
        let last = (0..count).rfind(|step| surplus_n(at_s(*step)) > 0.0)?;
        let (before_n, after_n) = (surplus_n(at_s(last)), surplus_n(at_s(last + 1)));
        let carried_until_s = at_s(last) + STEP_S * before_n / (before_n - after_n);
        let tilts = core::array::from_fn(|i| {
            let (sin, cos) = libm::sincos(tilt_max_rad * i as f64 / (TILTS - 1) as f64);
            [cos, cos * cos, sin * sin * sin]
        });
        // The height of a burn changes the density by half a per cent: linear is enough.
        let air = Air::at_height_m(vertical.cg_above_feet_m());
        let mut braking = Self {
            vertical,
            steps,
            tilts,
            leg_m_s,
            carried_until_s,
            ground_density_kg_m3: air.density_kg_m3,
            density_gradient_kg_m4: air.density_gradient_kg_m4(),
            endings: Vec::new(),
        };
        // A vehicle that still stands in the air then is the last to reach the limit of the legs.
        let latest_s = braking.slow_until_s(carried_until_s, 0.0);
        let share = |end: usize| end as f64 / (ENDS - 1) as f64;
        braking.endings = (0..ENDS)
            .map(|end| carried_until_s + share(end) * (latest_s - carried_until_s))
            .map(|end_s| (end_s, braking.back_from(end_s, (0.0, -leg_m_s), Brake::Hard)))
            .collect();
        Some(braking)
    }

    /// The extreme vertical acceleration in a step, m/s^2.
    fn acceleration_m_s2(&self, step: usize, (height_m, vertical_m_s): State, brake: Brake) -> f64 {
        let (thrust_n, mass_kg) = self.steps[step];
        let density_kg_m3 = self.ground_density_kg_m3 + self.density_gradient_kg_m4 * height_m;
        let drag = self.vertical.drag(density_kg_m3, vertical_m_s, thrust_n);
        // The drag of a falling vehicle pushes upwards.
        let upwards = if vertical_m_s < 0.0 { 1.0 } else { -1.0 };
        let [closed_n, open_n] = drag.fins_n;
        let fins_n = if (brake == Brake::Hard) == (upwards > 0.0) { open_n } else { closed_n };
        // The largest of the forces if hard, of their negatives if soft.
        let sign = if brake == Brake::Hard { 1.0 } else { -1.0 };
        let [thrust_n, body_n, across_n] =
            [thrust_n, upwards * drag.body_n, upwards * drag.across_n].map(|force_n| sign * force_n);
        let forces_n = self.tilts.map(|[cos, cos2, sin3]| thrust_n * cos + body_n * cos2 + across_n * sin3);
        (sign * largest(&forces_n) + upwards * fins_n) / mass_kg - STANDARD_GRAVITY_M_S2
    }

    /// The state after a time within a step, s; a negative time goes back.
    fn moved(&self, step: usize, (height_m, vertical_m_s): State, time_s: f64, brake: Brake) -> State {
        let half_s = 0.5 * time_s;
        let gained_m_s2 = self.acceleration_m_s2(step, (height_m, vertical_m_s), brake);
        let midway = (height_m + half_s * vertical_m_s, vertical_m_s + half_s * gained_m_s2);
        let midway_m_s2 = self.acceleration_m_s2(step, midway, brake);
        (height_m + time_s * midway.1, vertical_m_s + time_s * midway_m_s2)
    }

    /// The state at the end of each step, on the way from a time on; the first is at the end of the step of that time.
    fn onwards(
        &self,
        from_s: f64,
        from: State,
        brake: Brake,
    ) -> impl Iterator<Item = (usize, f64, State)> + '_ {
        let first = (libm::floor(from_s / STEP_S) as usize).min(self.steps.len() - 1);
        let mut state = from;
        (first..self.steps.len()).map(move |step| {
            let passes_s = if step == first { (step + 1) as f64 * STEP_S - from_s } else { STEP_S };
            state = self.moved(step, state, passes_s, brake);
            (step + 1, passes_s, state)
        })
    }

    /// The states at the steps' beginnings on the way to a state at a time, as far back as the speed is sensible; the first
    /// of them is the earliest.
    fn back_from(&self, end_s: f64, end: State, brake: Brake) -> Vec<State> {
        let last = (libm::ceil(end_s / STEP_S) as usize).clamp(1, self.steps.len()) - 1;
        let too_fast = (0.0, -f64::INFINITY);
        let mut path = vec![too_fast; last + 1];
        // One state beyond, so that paths can meet within the last step.
        path.push(self.moved(last, end, (last + 1) as f64 * STEP_S - end_s, brake));
        let (mut state, mut at_s) = (end, end_s);
        for step in (0..=last).rev() {
            let begins_s = step as f64 * STEP_S;
            state = self.moved(step, state, begins_s - at_s, brake);
            at_s = begins_s;
            if state.1 < -FASTEST_M_S {
                break;
            }
            path[step] = state;
        }
        path
    }

    /// Until when hard braking keeps a vehicle within the limit of the legs, s, from a time and a velocity on.
    fn slow_until_s(&self, from_s: f64, vertical_m_s: f64) -> f64 {
        let mut before_m_s = vertical_m_s;
        for (step, passed_s, (_, after_m_s)) in self.onwards(from_s, (0.0, vertical_m_s), Brake::Hard) {
            if after_m_s < -self.leg_m_s {
                let share = (before_m_s + self.leg_m_s) / (before_m_s - after_m_s);
                return step as f64 * STEP_S - (1.0 - share) * passed_s;
            }
            before_m_s = after_m_s;
        }
        self.steps.len() as f64 * STEP_S
    }

    /// The least fall of a vehicle whose thrust begins in a state.
    pub(super) fn least_fall(&self, height_m: f64, vertical_m_s: f64) -> Least {
        let from_m = height_m;
        let mut before = (height_m, vertical_m_s);
        if vertical_m_s >= 0.0 {
            return self.stopped(0.0, before, 0.0);
        }
        for (step, passed_s, after) in self.onwards(0.0, before, Brake::Hard) {
            let to_s = step as f64 * STEP_S;
            let share_at = |time_s: f64| (1.0 - (to_s - time_s) / passed_s).max(0.0);
            let share_of =
                |m_s: f64| if before.1 < m_s { (m_s - before.1) / (after.1 - before.1) } else { 0.0 };
            let height_at = |share: f64| before.0 + share * (after.0 - before.0);
            let carried = share_at(self.carried_until_s);
            if after.1 >= 0.0 && share_of(0.0) <= carried {
                let share = share_of(0.0);
                let stops_s = to_s - (1.0 - share) * passed_s;
                return self.stopped(from_m - height_at(share), (from_m, vertical_m_s), stops_s);
            }
            if carried <= 1.0 {
                // Both within this step: slow enough, and not carried any more.
                let slow = share_of(-self.leg_m_s);
                if slow <= 1.0 && (before.1 >= -self.leg_m_s || after.1 >= -self.leg_m_s) {
                    return Least { fallen_m: from_m - height_at(slow.max(carried)), lands: true };
                }
                if after.1 <= before.1 {
                    return Least { fallen_m: from_m - before.0, lands: false };
                }
            }
            before = after;
        }
        Least { fallen_m: from_m - before.0, lands: false }
    }

    /// The least fall of a vehicle that stops at a time at the earliest, after falling that far from a state: until there
    /// if it can land from there, otherwise until the earliest stop from which it can.
    fn stopped(&self, fallen_m: f64, from: State, stops_s: f64) -> Least {
        let comes_down =
            |stops_s: f64| self.most_fall_m(stops_s, 0.0, 0.0).is_some_and(|fall_m| fall_m >= 0.0);
        if comes_down(stops_s) {
            return Least { fallen_m, lands: true };
        }
        let (mut early_s, mut late_s) = (stops_s, self.carried_until_s);
        for _ in 0..HALVINGS {
            let middle_s = 0.5 * (early_s + late_s);
            *(if comes_down(middle_s) { &mut late_s } else { &mut early_s }) = middle_s;
        }
        let ending = self.back_from(late_s, (0.0, 0.0), Brake::Soft);
        match self.joined_m(0.0, from, Brake::Hard, &ending) {
            Some(fallen_m) => Least { fallen_m, lands: true },
            // Even the softest braking stops the vehicle too early.
            None => Least { fallen_m, lands: false },
        }
    }

    /// The greatest fall to a landing from a state at a time, m; `None` if it cannot become slow enough.
    pub(super) fn most_fall_m(&self, from_s: f64, height_m: f64, vertical_m_s: f64) -> Option<f64> {
        let from = (height_m, vertical_m_s);
        let soft: Vec<(usize, f64, State)> = self.onwards(from_s, from, Brake::Soft).collect();
        let falls_m: Vec<Option<f64>> = self
            .endings
            .iter()
            .map(|(_, ending)| joined_m(from_s, from, soft.iter().copied(), ending))
            .collect();
        // A strong motor: not even soft braking all the way reaches the limit of the legs before it.
        let slow_m = soft
            .iter()
            .position(|(step, _, state)| {
                *step as f64 * STEP_S >= self.carried_until_s && state.1 <= -self.leg_m_s
            })
            .filter(|place| {
                let before = place.checked_sub(1).map_or(from, |place| soft[place].2);
                before.1 > -self.leg_m_s
            })
            .map(|place| height_m - soft[place].2.0);
        peak(&falls_m).into_iter().chain(slow_m).reduce(f64::max)
    }

    /// The fall from a state until an ending, first braking in one way until the ending's velocity is met.
    fn joined_m(&self, from_s: f64, from: State, brake: Brake, ending: &[State]) -> Option<f64> {
        joined_m(from_s, from, self.onwards(from_s, from, brake), ending)
    }
}

/// The fall along a path until its velocity meets an ending's, and then along the ending, m; `None` if they do not meet.
fn joined_m(
    from_s: f64,
    from: State,
    path: impl Iterator<Item = (usize, f64, State)>,
    ending: &[State],
) -> Option<f64> {
    let first = libm::floor(from_s / STEP_S) as usize;
    let share = from_s / STEP_S - first as f64;
    let (early, late) = (ending.get(first)?, ending.get(first + 1)?);
    let mix = |one: f64, two: f64, share: f64| if share > 0.0 { one + share * (two - one) } else { one };
    let mut other = (mix(early.0, late.0, share), mix(early.1, late.1, share));
    let mut own = from;
    let mut apart_m_s = own.1 - other.1;
    if apart_m_s.abs() < 1e-9 {
        return Some(from.0 - own.0 + other.0);
    }
    for (step, _, after) in path {
        let other_after = *ending.get(step)?;
        let after_m_s = after.1 - other_after.1;
        if after_m_s.is_finite() && apart_m_s * after_m_s <= 0.0 {
            let share = apart_m_s / (apart_m_s - after_m_s);
            return Some(from.0 - mix(own.0, after.0, share) + mix(other.0, other_after.0, share));
        }
        (own, other, apart_m_s) = (after, other_after, after_m_s);
    }
    None
}

/// The largest of values at equal distances, with a parabola through it and its neighbours.
fn largest(values: &[f64; TILTS]) -> f64 {
    let (place, most) = values.iter().enumerate().fold((0, f64::NEG_INFINITY), |best, (place, value)| {
        if *value > best.1 { (place, *value) } else { best }
    });
    if place == 0 || place == TILTS - 1 {
        return most;
    }
    most + above_m(values[place - 1], most, values[place + 1])
}

/// The same of values of which some are missing.
fn peak(values: &[Option<f64>]) -> Option<f64> {
    let found = values.iter().enumerate().filter_map(|(place, value)| Some((place, (*value)?)));
    let (place, most) = found.reduce(|best, next| if next.1 > best.1 { next } else { best })?;
    let beside = |place: Option<usize>| values.get(place?).copied().flatten();
    Some(match (beside(place.checked_sub(1)), beside(Some(place + 1))) {
        (Some(left), Some(right)) => most + above_m(left, most, right),
        _ => most,
    })
}

/// How far the top of a parabola lies above its middle value, which is the largest of three.
fn above_m(left: f64, middle: f64, right: f64) -> f64 {
    let curve = 2.0 * middle - left - right;
    if curve > 0.0 { (right - left) * (right - left) / (8.0 * curve) } else { 0.0 }
}

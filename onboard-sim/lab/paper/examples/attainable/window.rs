//! The heights of the ignition command from which a flight lands, found with bang-bang paths.

use flight::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;
use flight::vehicle::mission::Mission;
use flight::vehicle::rigid::RigidState;
use sim::draw::Draw;

use crate::vertical::Vertical;

/// Heights of the feet at the ignition command, m, from which a landing exists.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Window {
    pub(crate) low_m: f64,
    pub(crate) high_m: f64,
}

impl Window {
    /// Whether the flight lands from this command height.
    pub(crate) fn contains(&self, height_m: f64) -> bool {
        (self.low_m..=self.high_m).contains(&height_m)
    }
}

/// Command heights tried if none of the usual kind lands, between the lowest one and apogee. Only
/// vehicles that are still gaining speed have such landings, and for them the window is metres
/// wide.
const TRIED: usize = 24;

/// The window of a flight whose fall begins in this state; `None` if it lands from no height.
pub(crate) fn window(mission: &Mission, drawn: &Draw, fall: &RigidState) -> Option<Window> {
    let curve = drawn.truth.curve(mission).ok()?;
    let vertical = Vertical::new(&mission.site, &mission.airframe, curve.as_ref(), &drawn.truth);
    let apogee_m = fall.position_m.z - vertical.cg_above_feet_m();
    let vertical_m_s = fall.velocity_m_s.z.min(0.0);
    let fall = Fall::new(&vertical, apogee_m, vertical_m_s, drawn.truth.ignition_delay_s)?;
    let limits = (mission.powered.tilt_max_deg.to_radians(), mission.leg_limits.vertical_m_s);
    let braking = Braking::new(vertical, limits)?;
    let search = Search { fall, braking };
    // On the ground every command is too late. From apogee it is usually too early.
    let low_m = root(|height_m| search.above_lowest_m(height_m), 0.0, apogee_m)?;
    if search.lands(low_m + ROUNDING_M) {
        let high_m = root(|height_m| search.above_highest_m(height_m), low_m, apogee_m).unwrap_or(apogee_m);
        return Some(Window { low_m, high_m });
    }
    let at_m = |tried: usize| low_m + (apogee_m - low_m) * tried as f64 / TRIED as f64;
    let first = (1..=TRIED).find(|tried| search.lands(at_m(*tried)))?;
    let last = (first..=TRIED).take_while(|tried| search.lands(at_m(*tried))).last()?;
    let edge_m = |inside: usize, outside: usize| {
        let (mut inside_m, mut outside_m) = (at_m(inside), at_m(outside));
        while (inside_m - outside_m).abs() > ROUNDING_M {
            let middle_m = 0.5 * (inside_m + outside_m);
            *(if search.lands(middle_m) { &mut inside_m } else { &mut outside_m }) = middle_m;
        }
        inside_m
    };
    let high_m = if last == TRIED { apogee_m } else { edge_m(last, last + 1) };
    Some(Window { low_m: edge_m(first, first - 1), high_m })
}

/// Rounding of the heights, m: far below the difference that decides a landing (a metre of height
/// is 0.2 m/s at the ground).
const ROUNDING_M: f64 = 1e-3;

struct Search {
    fall: Fall,
    braking: Braking,
}

impl Search {
    /// Height at the first thrust above the lowest from which the vehicle stops before the ground,
    /// m. It grows with the command height: a higher command comes at a lower speed.
    fn above_lowest_m(&self, command_m: f64) -> f64 {
        let (height_m, vertical_m_s) = self.fall.onset(command_m);
        height_m - self.braking.least_fall(height_m, vertical_m_s).fallen_m
    }

    /// Height at the first thrust above the highest from which the vehicle falls far enough, m.
    fn above_highest_m(&self, command_m: f64) -> f64 {
        let (height_m, vertical_m_s) = self.fall.onset(command_m);
        let most_m = self.braking.most_fall_m(0.0, height_m, vertical_m_s);
        most_m.map_or(height_m, |most_m| height_m - most_m)
    }

    fn lands(&self, command_m: f64) -> bool {
        let (height_m, vertical_m_s) = self.fall.onset(command_m);
        let least = self.braking.least_fall(height_m, vertical_m_s);
        let most_m = self.braking.most_fall_m(0.0, height_m, vertical_m_s);
        // At the edge both falls are the same one, integrated forwards and backwards.
        least.lands
            && least.fallen_m <= height_m + ROUNDING_M
            && most_m.is_some_and(|most_m| height_m <= most_m + ROUNDING_M)
    }
}

/// The command height inside most windows, m, and the number of windows around it; `None` without
/// windows. Among equally good heights it is the middle of the lowest stretch.
pub(crate) fn best_height_m(windows: &[Window]) -> Option<(f64, u64)> {
    // Where windows begin (first at equal heights) and end, in order.
    let mut edges: Vec<(f64, bool)> =
        windows.iter().flat_map(|window| [(window.low_m, false), (window.high_m, true)]).collect();
    edges.sort_by(|one, two| one.0.total_cmp(&two.0).then(one.1.cmp(&two.1)));
    let (mut around, mut best): (u64, Option<(f64, u64)>) = (0, None);
    for (index, (height_m, ends)) in edges.iter().enumerate() {
        if *ends {
            around -= 1;
            continue;
        }
        around += 1;
        if best.is_none_or(|(_, most)| around > most) {
            let next_m = edges.get(index + 1).map_or(*height_m, |(next_m, _)| *next_m);
            best = Some((0.5 * (height_m + next_m), around));
        }
    }
    best
}

/// Length of a step, s. The midpoint rule is then right to a millimetre over the fall, and to a
/// centimetre over a burn.
const STEP_S: f64 = 0.02;
/// Longest fall that is followed, s. From 300 m it takes 11 s.
const LONGEST_S: f64 = 120.0;

/// Height of the feet, m, and vertical velocity, m/s, at equal times since apogee, past the ground
/// by the igniter's delay.
struct Fall {
    states: Vec<(f64, f64)>,
    delay_s: f64,
}

impl Fall {
    /// The fall from a height of the feet, m, and a vertical velocity that is not upwards, m/s.
    /// `None` if it does not reach the ground.
    fn new(vertical: &Vertical, height_m: f64, vertical_m_s: f64, delay_s: f64) -> Option<Self> {
        let mass_kg = vertical.mass_kg(-1.0);
        let acceleration_m_s2 = |height_m: f64, vertical_m_s: f64| {
            let air = vertical.site.air_at_m(height_m + vertical.cg_above_feet_m());
            let drag = vertical.drag(air.density_kg_m3, vertical_m_s, 0.0);
            drag.at_n([0.0, 1.0], 1.0) / mass_kg - STANDARD_GRAVITY_M_S2
        };
        let (mut height_m, mut vertical_m_s) = (height_m, vertical_m_s);
        let mut states = vec![(height_m, vertical_m_s)];
        let mut left_s = delay_s + 2.0 * STEP_S;
        while left_s > 0.0 {
            let midway_m_s = vertical_m_s + 0.5 * STEP_S * acceleration_m_s2(height_m, vertical_m_s);
            let midway_m = height_m + 0.5 * STEP_S * vertical_m_s;
            vertical_m_s += STEP_S * acceleration_m_s2(midway_m, midway_m_s);
            height_m += STEP_S * midway_m_s;
            states.push((height_m, vertical_m_s));
            if height_m < 0.0 {
                left_s -= STEP_S;
            } else if states.len() as f64 * STEP_S > LONGEST_S {
                return None;
            }
        }
        Some(Self { states, delay_s })
    }

    /// Height of the feet, m, and vertical velocity, m/s, at the first thrust after a command at a
    /// height of the feet, m, between the ground and apogee.
    fn onset(&self, command_m: f64) -> (f64, f64) {
        let after = self.states.partition_point(|(height_m, _)| *height_m > command_m);
        let from = after.saturating_sub(1);
        let (from_m, from_m_s) = self.states[from];
        // Under constant acceleration; the root that does not cancel, for a velocity downwards.
        let fallen_m = (from_m - command_m).max(0.0);
        let gained_m_s2 = self.slope_m_s2(from);
        let speed_m_s = libm::sqrt((from_m_s * from_m_s - 2.0 * gained_m_s2 * fallen_m).max(0.0));
        let passed_s = if fallen_m > 0.0 { 2.0 * fallen_m / (speed_m_s - from_m_s) } else { 0.0 };
        self.at(from as f64 * STEP_S + passed_s + self.delay_s)
    }

    fn slope_m_s2(&self, from: usize) -> f64 {
        let to = (from + 1).min(self.states.len() - 1);
        (self.states[to].1 - self.states[from].1) / STEP_S
    }

    fn at(&self, time_s: f64) -> (f64, f64) {
        let from = (libm::floor(time_s / STEP_S) as usize).min(self.states.len() - 2);
        let passed_s = time_s - from as f64 * STEP_S;
        let (from_m, from_m_s) = self.states[from];
        let gained_m_s = self.slope_m_s2(from) * passed_s;
        (from_m + (from_m_s + 0.5 * gained_m_s) * passed_s, from_m_s + gained_m_s)
    }
}

/// Time after the burn that is examined, s. A vehicle at rest then falls to the legs' limit (1 m/s)
/// in a tenth of that.
const AFTER_S: f64 = 1.0;
/// Tilts tried for the hardest and softest braking. Between them a parabola is laid through three:
/// with 17, heights differ by at most 0.3 mm.
const TILTS: usize = 9;
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
struct Least {
    fallen_m: f64,
    /// Whether a landing ends it. Otherwise it ends where the vehicle is slowest.
    lands: bool,
}

/// One vehicle in its burn.
struct Braking {
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
    /// Paths that brake hard until they touch down at the limit of the legs: time of touchdown, s,
    /// and the state at each step before it.
    endings: Vec<(f64, Vec<State>)>,
}

impl Braking {
    /// From the largest tilt, rad, and the legs' limit, m/s. `None` if the thrust never exceeds the
    /// weight.
    fn new(vertical: Vertical, (tilt_max_rad, leg_m_s): (f64, f64)) -> Option<Self> {
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
        let air = vertical.site.air_at_m(vertical.cg_above_feet_m());
        let mut braking = Self {
            vertical,
            steps,
            tilts,
            leg_m_s,
            carried_until_s,
            ground_density_kg_m3: air.density_kg_m3,
            density_gradient_kg_m4: air.density_gradient_kg_m4,
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
        let forces_n =
            self.tilts.map(|[cos, cos2, sin3]| Some(thrust_n * cos + body_n * cos2 + across_n * sin3));
        (sign * peak(&forces_n).unwrap_or(f64::NAN) + upwards * fins_n) / mass_kg - STANDARD_GRAVITY_M_S2
    }

    /// The state after a time within a step, s; a negative time goes back.
    fn moved(&self, step: usize, (height_m, vertical_m_s): State, time_s: f64, brake: Brake) -> State {
        let half_s = 0.5 * time_s;
        let gained_m_s2 = self.acceleration_m_s2(step, (height_m, vertical_m_s), brake);
        let midway = (height_m + half_s * vertical_m_s, vertical_m_s + half_s * gained_m_s2);
        let midway_m_s2 = self.acceleration_m_s2(step, midway, brake);
        (height_m + time_s * midway.1, vertical_m_s + time_s * midway_m_s2)
    }

    /// The state at the end of each step, on the way from a time on; the first is at the end of the
    /// step of that time.
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

    /// The states at the steps' beginnings on the way to a state at a time, as far back as the
    /// speed is sensible; the first of them is the earliest.
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

    /// Until when hard braking keeps a vehicle within the limit of the legs, s, from a time and a
    /// velocity on.
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
    fn least_fall(&self, height_m: f64, vertical_m_s: f64) -> Least {
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

    /// The least fall of a vehicle that stops at a time at the earliest, after falling that far
    /// from a state: until there if it can land from there, otherwise until the earliest stop from
    /// which it can.
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
        match joined_m(0.0, from, self.onwards(0.0, from, Brake::Hard), &ending) {
            Some(fallen_m) => Least { fallen_m, lands: true },
            // Even the softest braking stops the vehicle too early.
            None => Least { fallen_m, lands: false },
        }
    }

    /// The greatest fall to a landing from a state at a time, m; `None` if it cannot become slow
    /// enough.
    fn most_fall_m(&self, from_s: f64, height_m: f64, vertical_m_s: f64) -> Option<f64> {
        let from = (height_m, vertical_m_s);
        let soft: Vec<(usize, f64, State)> = self.onwards(from_s, from, Brake::Soft).collect();
        let falls_m: Vec<Option<f64>> = self
            .endings
            .iter()
            .map(|(_, ending)| joined_m(from_s, from, soft.iter().copied(), ending))
            .collect();
        // A strong motor: not even soft braking all the way reaches the limit of the legs before
        // it.
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
}

/// The fall along a path until its velocity meets an ending's, and then along the ending, m; `None`
/// if they do not meet.
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

/// The largest of values at equal distances, of which some are missing, with a parabola through it
/// and its neighbours.
fn peak(values: &[Option<f64>]) -> Option<f64> {
    let found = values.iter().enumerate().filter_map(|(place, value)| Some((place, (*value)?)));
    let (place, most) = found.reduce(|best, next| if next.1 > best.1 { next } else { best })?;
    let beside = |place: Option<usize>| values.get(place?).copied().flatten();
    let (Some(left), Some(right)) = (beside(place.checked_sub(1)), beside(Some(place + 1))) else {
        return Some(most);
    };
    let curve = 2.0 * most - left - right;
    Some(most + if curve > 0.0 { (right - left) * (right - left) / (8.0 * curve) } else { 0.0 })
}

/// Tolerance of a zero, in the unit of the argument.
const CLOSE: f64 = 1e-4;
/// Largest number of evaluations; about eight are usual.
const MOST_VALUES: usize = 60;

/// Where a function that rises from below zero at `low` passes zero, by false position; the value
/// of an end that stays twice is halved (the Illinois rule; Dowell and Jarratt, BIT 11, 1971).
/// `None` if it is below zero at `high`; `low` if it is above zero there.
fn root(value_at: impl Fn(f64) -> f64, low: f64, high: f64) -> Option<f64> {
    let (mut below, mut above) = ((low, value_at(low)), (high, value_at(high)));
    if below.1 >= 0.0 {
        return Some(low);
    }
    if above.1 < 0.0 {
        return None;
    }
    let mut last_was_below = None;
    for _ in 0..MOST_VALUES {
        if above.0 - below.0 < CLOSE {
            break;
        }
        let at = below.0 - below.1 * (above.0 - below.0) / (above.1 - below.1);
        let value = value_at(at);
        if value.abs() < CLOSE {
            return Some(at);
        }
        let is_below = value < 0.0;
        let again = last_was_below == Some(is_below);
        if is_below {
            below = (at, value);
            above.1 *= if again { 0.5 } else { 1.0 };
        } else {
            above = (at, value);
            below.1 *= if again { 0.5 } else { 1.0 };
        }
        last_was_below = Some(is_below);
    }
    Some(above.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn window(low_m: f64, high_m: f64) -> Window {
        Window { low_m, high_m }
    }

    #[test]
    fn val_hand_the_best_height_is_inside_most_windows() {
        let windows = [window(60.0, 70.0), window(64.0, 66.0), window(65.0, 80.0), window(75.0, 90.0)];
        assert_eq!(best_height_m(&windows), Some((65.5, 3)));
        assert_eq!(best_height_m(&windows[..1]), Some((65.0, 1)));
        assert_eq!(best_height_m(&[window(60.0, 61.0), window(61.0, 62.0)]), Some((61.0, 2)));
        assert_eq!(best_height_m(&[]), None);
    }

    #[test]
    fn a_zero_is_found_and_its_absence_too() {
        assert!((root(|x| x * x * x - 8.0, 0.0, 300.0).unwrap() - 2.0).abs() < 2e-4);
        assert!((root(|x| if x < 3.0 { -1.0 } else { 1.0 }, 0.0, 5.0).unwrap() - 3.0).abs() < 2e-4);
        assert_eq!(root(|_| -1.0, 0.0, 1.0), None);
        assert_eq!(root(|_| 1.0, 0.0, 1.0), Some(0.0));
    }
}

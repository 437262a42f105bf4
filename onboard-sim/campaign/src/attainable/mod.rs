//! Whether a clairvoyant could have landed a flight: the measure for the landing rate of a controller.
//!
//! The clairvoyant falls with open fins from the drawn apogee and commands the ignition at one height that is the same
//! for all flights of the campaign. From the first thrust on it knows the true motor, mass and drag, and at every instant
//! it chooses the fins between closed and fully open and the tilt between upright and the planner's limit
//! (`powered.tilt_max_deg`). It lands if its feet reach the ground within the vertical speed limit of the legs and after
//! the thrust has fallen through the weight for the last time, because before that the vehicle would lift off again.
//!
//! It is a bound, so it errs on the generous side. Motion is vertical: wind, gusts, place, attitude dynamics and the
//! slope of the ground are left out. Tilt and fins change at once, so the vehicle may lean until touchdown: upright last
//! moments would cost only what the servos and the inertia cost. Injected faults do not happen to it.
//!
//! [`window`] is the interval of command heights from which a flight lands, [`best_height_m`] the height inside most of
//! them. A landing from a height exists if the height lies between two bang-bang landings (see [`braking`]).

mod braking;
mod fall;
mod root;

use flight::vehicle::mission::Mission;
use flight::vehicle::rigid::RigidState;
use sim::draw::Draw;
use world::vertical::Vertical;

use self::braking::Braking;
use self::fall::Fall;
use self::root::root;

/// Heights of the feet at the ignition command, m, from which a landing exists.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    pub low_m: f64,
    pub high_m: f64,
}

impl Window {
    /// Whether the flight lands from this command height.
    pub fn contains(&self, height_m: f64) -> bool {
        (self.low_m..=self.high_m).contains(&height_m)
    }
}

/// Command heights tried if none of the usual kind lands, between the lowest one and apogee. Only vehicles that are still
/// gaining speed have such landings, and for them the window is metres wide.
const TRIED: usize = 24;

/// The window of a flight whose fall begins in this state; `None` if it lands from no height.
pub fn window(mission: &Mission, drawn: &Draw, fall: &RigidState) -> Option<Window> {
    let vertical = Vertical::new(&mission.airframe, &mission.motor_curve, &drawn.truth);
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

/// The window in heights of the feet where the thrust begins, m, instead of where it is commanded.
pub fn onset_window(mission: &Mission, drawn: &Draw, fall: &RigidState) -> Option<Window> {
    let Window { low_m, high_m } = window(mission, drawn, fall)?;
    let vertical = Vertical::new(&mission.airframe, &mission.motor_curve, &drawn.truth);
    let apogee_m = fall.position_m.z - vertical.cg_above_feet_m();
    let fall = Fall::new(&vertical, apogee_m, fall.velocity_m_s.z.min(0.0), drawn.truth.ignition_delay_s)?;
    Some(Window { low_m: fall.onset(low_m).0, high_m: fall.onset(high_m).0 })
}

/// Heights are found this closely, m: far below what decides a landing (a metre of height is 0.2 m/s at the ground).
const ROUNDING_M: f64 = 1e-3;

struct Search {
    fall: Fall,
    braking: Braking,
}

impl Search {
    /// Height at the first thrust above the lowest from which the vehicle stops before the ground, m. It grows with the
    /// command height: a higher command comes at a lower speed.
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

/// The command height inside most windows, m, and the number of windows around it; `None` without windows. Among equally
/// good heights it is the middle of the lowest stretch.
pub fn best_height_m(windows: &[Window]) -> Option<(f64, u64)> {
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
}

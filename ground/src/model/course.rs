//! How a vehicle moves on that is not heard any more, as far as the ground can know: falling, braking, lifted.
//!
//! A fall meets the air's resistance `k V^2` against its motion through the air, with the `k` that balances what the last
//! second's acceleration was short of gravity: at terminal speed it keeps its speed, right after apogee it falls
//! freely. From the height on at which the motor was to be lit, the fall is braked so that it ends on the ground: that
//! is what the burn is for.

use protocol::dialect::TdPhase;

use super::motion::{GRAVITY_M_S2, Motion, NorthEastUp};
use super::reckoning::By;
use super::trend::Change;
use super::vehicle::{Vehicle, is_burning};

/// Slower than this through the air, its resistance cannot be told from noise, m/s.
const DRAG_SEEN_M_S: f64 = 8.0;
/// More resistance than an open parachute has is none: terminal speed 2 m/s, in 1/m.
const DRAG_MAX_PER_M: f64 = GRAVITY_M_S2 / 4.0;
/// Step of the way, s: small against the half second in which a fall settles under a parachute, the quickest that happens.
const STEP_S: f64 = 0.02;
/// No way is followed longer than this, s; from any height that is flown to the ground is nearer.
const LONGEST_S: f64 = 300.0;

/// What is expected after some time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Expected {
    /// North of the pad, m.
    pub(super) x_m: f64,
    /// East of the pad, m.
    pub(super) y_m: f64,
    /// Altitude, m.
    pub(super) altitude_m: f64,
    /// How far from there it is if the burn does not happen, m.
    pub(super) or_else_m: f64,
    /// How long of that under the landing motor's thrust, s.
    pub(super) burning_s: f64,
    /// When it came down, s after it was last heard.
    pub(super) landed_after_s: Option<f64>,
    /// What it goes by.
    pub(super) by: By,
}

/// The last known motion and what acts on it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Course {
    at_m: NorthEastUp,
    velocity_m_s: NorthEastUp,
    wind_m_s: NorthEastUp,
    pull: Pull,
}

#[derive(Debug, Clone, Copy)]
enum Pull {
    /// Gravity and the air's resistance, 1/m; from this height on a burn that ends on the ground.
    Air { drag_per_m: Option<f64>, burn_from_m: Option<f64> },
    /// Thrust that goes on as it was last seen, gravity included, m/s2, until the vehicle stands in the air.
    Thrust { acceleration_m_s2: NorthEastUp },
    /// A burn of which nothing was seen yet: braked so that it ends on the ground.
    Brake,
}

/// Where it led.
struct Way {
    place: NorthEastUp,
    landed_after_s: Option<f64>,
    burning_s: f64,
}

impl Course {
    /// From what the vehicle said last.
    pub(super) fn of(vehicle: &Vehicle, phase: TdPhase, motion: &Motion) -> Self {
        // A position that is not known stays unknown; a velocity that is not known is taken to be none.
        let known = |value: f64| if value.is_finite() { value } else { 0.0 };
        let velocity_m_s = [motion.vx_m_s, motion.vy_m_s, motion.climb_m_s].map(known);
        let descent = vehicle.descent.as_ref().map(|descent| &descent.value);
        let wind_m_s =
            descent.map_or([0.0; 3], |d| [f64::from(d.wind_x_m_s), f64::from(d.wind_y_m_s), 0.0]).map(known);
        let change = vehicle.trend.of_late();
        let thrust = matches!(phase, TdPhase::TD_PHASE_POWERED | TdPhase::TD_PHASE_BOOST);
        let pull = match change {
            Some(Change { acceleration_m_s2, .. }) if thrust => Pull::Thrust { acceleration_m_s2 },
            _ if is_burning(phase) => Pull::Brake,
            _ => {
                let chosen_m = descent.map(|d| f64::from(d.chosen_height_m));
                let burn_from_m = chosen_m.filter(|height_m| *height_m > 0.0 && vehicle.may_light());
                Pull::Air {
                    drag_per_m: change.and_then(|change| drag_per_m(&change, &wind_m_s)),
                    burn_from_m,
                }
            }
        };
        Self { at_m: [motion.x_m, motion.y_m, motion.altitude_m], velocity_m_s, wind_m_s, pull }
    }

    /// Where it leads in this time, s.
    pub(super) fn after(&self, seconds: f64) -> Expected {
        let Way { place, landed_after_s, burning_s } = self.follow(seconds);
        let (or_else_m, by) = match self.pull {
            Pull::Thrust { .. } | Pull::Brake => (0.0, By::LastThrust),
            Pull::Air { burn_from_m: Some(_), drag_per_m } => {
                let unlit = Self { pull: Pull::Air { drag_per_m, burn_from_m: None }, ..*self };
                let fallen = unlit.follow(seconds).place;
                ((place[2].max(0.0) - fallen[2].max(0.0)).abs(), By::FallThenBurn)
            }
            Pull::Air { drag_per_m: Some(_), .. } => (0.0, By::Fall),
            Pull::Air { drag_per_m: None, .. } => (0.0, By::FreeFall),
        };
        let [x_m, y_m, altitude_m] = place;
        Expected { x_m, y_m, altitude_m, or_else_m, burning_s, landed_after_s, by }
    }

    /// Step by step, by the pull in each step's middle: free fall comes out exactly, drag to the second order.
    fn follow(&self, seconds: f64) -> Way {
        let (mut place, mut velocity) = (self.at_m, self.velocity_m_s);
        let mut braking = None;
        let (mut passed_s, mut burning_s) = (0.0, 0.0);
        let seconds = seconds.min(LONGEST_S);
        while passed_s < seconds {
            let step_s = STEP_S.min(seconds - passed_s);
            let early = self.pull_m_s2(&place, &velocity, &mut braking);
            let halfway: NorthEastUp =
                std::array::from_fn(|axis| velocity[axis] + 0.5 * early[axis] * step_s);
            let pull = self.pull_m_s2(&place, &halfway, &mut braking);
            for axis in 0..3 {
                place[axis] += (velocity[axis] + 0.5 * pull[axis] * step_s) * step_s;
                velocity[axis] += pull[axis] * step_s;
            }
            passed_s += step_s;
            let burns = !matches!(self.pull, Pull::Air { .. }) || braking.is_some();
            burning_s += if burns { step_s } else { 0.0 };
            // Braked to a stand, as near to the ground as the last numbers had it; or on the ground.
            let stands = burns && velocity[2] >= 0.0 && self.velocity_m_s[2] < 0.0;
            if stands || place[2] <= 0.0 {
                return Way { place, landed_after_s: Some(passed_s), burning_s };
            }
        }
        Way { place, landed_after_s: None, burning_s }
    }

    fn pull_m_s2(
        &self,
        place: &NorthEastUp,
        velocity: &NorthEastUp,
        braking: &mut Option<NorthEastUp>,
    ) -> NorthEastUp {
        match self.pull {
            Pull::Thrust { acceleration_m_s2 } => acceleration_m_s2,
            Pull::Brake => *braking.get_or_insert_with(|| to_rest_m_s2(place, velocity)),
            Pull::Air { drag_per_m, burn_from_m } => {
                if braking.is_some()
                    || burn_from_m.is_some_and(|from_m| place[2] <= from_m && velocity[2] < 0.0)
                {
                    return *braking.get_or_insert_with(|| to_rest_m_s2(place, velocity));
                }
                let through_air = std::array::from_fn(|axis| velocity[axis] - self.wind_m_s[axis]);
                let resistance = drag_per_m.unwrap_or(0.0) * size(&through_air);
                let [north, east, up] = through_air.map(|part: f64| -resistance * part);
                [north, east, up - GRAVITY_M_S2]
            }
        }
    }
}

/// The resistance that takes from gravity what the acceleration is short of it, 1/m; `None` where there is too little wind to
/// tell.
fn drag_per_m(change: &Change, wind: &NorthEastUp) -> Option<f64> {
    let through_air: NorthEastUp = std::array::from_fn(|axis| change.velocity_m_s[axis] - wind[axis]);
    let speed = size(&through_air);
    if speed < DRAG_SEEN_M_S {
        return None;
    }
    let [north, east, up] = change.acceleration_m_s2;
    let felt = [north, east, up + GRAVITY_M_S2];
    let against: f64 = felt.iter().zip(&through_air).map(|(felt, through)| -felt * through).sum();
    let drag = against / (speed * speed * speed);
    drag.is_finite().then(|| drag.clamp(0.0, DRAG_MAX_PER_M))
}

/// The even braking that ends on the ground at rest, m/s2.
fn to_rest_m_s2(place: &NorthEastUp, velocity: &NorthEastUp) -> NorthEastUp {
    let down_m_s = -velocity[2];
    if place[2] <= 0.0 || down_m_s <= 0.0 {
        return [0.0; 3];
    }
    let takes_s = 2.0 * place[2] / down_m_s;
    velocity.map(|part| -part / takes_s)
}

fn size(vector: &NorthEastUp) -> f64 {
    libm::hypot(libm::hypot(vector[0], vector[1]), vector[2])
}

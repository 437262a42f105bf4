//! Continues the last known motion of the vehicle: falling with drag, braking, or accelerating under thrust.
//!
//! A fall has the drag `k V^2` against its motion through the air. `k` is chosen so that drag explains the difference
//! between gravity and the last second's acceleration: at terminal speed the speed is kept, shortly after apogee the
//! vehicle falls freely. Below the height at which the motor was to be lit, a constant deceleration brings the
//! vehicle to rest on the ground.

use protocol::dialect::TdPhase;

use crate::model::motion::{GRAVITY_M_S2, Motion, NorthEastUp};
use crate::model::trend::Change;
use crate::model::vehicle::{Vehicle, is_burning};

/// Below this airspeed, m/s, drag cannot be distinguished from noise.
const DRAG_SEEN_M_S: f64 = 8.0;
/// The largest believable drag, 1/m: a terminal speed of 2 m/s, slower than under an open parachute.
const DRAG_MAX_PER_M: f64 = GRAVITY_M_S2 / 4.0;
/// Integration step, s: small against the fastest change, the 0.5 s in which a fall under a parachute reaches its
/// terminal speed.
const STEP_S: f64 = 0.02;
/// The longest extrapolation, s; a fall from any height that is flown takes less.
const LONGEST_S: f64 = 300.0;

/// What a predicted position is based on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Basis {
    /// The vehicle's own plan.
    Plan,
    /// The last acceleration under thrust, continued.
    LastThrust,
    /// A fall with the last estimated drag, then the planned burn.
    FallThenBurn,
    /// A fall with the last estimated drag.
    Fall,
    /// Free fall, because the drag is unknown.
    FreeFall,
}

/// The expected state after some time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Extrapolated {
    /// North of the pad, m.
    pub(super) x_m: f64,
    /// East of the pad, m.
    pub(super) y_m: f64,
    pub(super) altitude_m: f64,
    /// The distance from this position if the burn does not happen, m.
    pub(super) or_else_m: f64,
    /// How long the landing motor burns until then, s.
    pub(super) burning_s: f64,
    /// When it landed, s after the last position.
    pub(super) landed_after_s: Option<f64>,
    pub(super) basis: Basis,
}

/// The last known motion and what acts on it.
#[derive(Debug, Clone, Copy)]
pub(super) struct LastMotion {
    at_m: NorthEastUp,
    velocity_m_s: NorthEastUp,
    wind_m_s: NorthEastUp,
    forces: Forces,
}

#[derive(Debug, Clone, Copy)]
enum Forces {
    /// Gravity and drag, 1/m; below this height, m, a burn that ends on the ground.
    Air { drag_per_m: Option<f64>, burn_from_m: Option<f64> },
    /// The last acceleration, gravity included, m/s2, until the vertical speed is zero.
    Thrust { acceleration_m_s2: NorthEastUp },
    /// A burn without a measured acceleration: braked so that it ends on the ground.
    Brake,
}

/// The end of an extrapolation.
struct Endpoint {
    place: NorthEastUp,
    landed_after_s: Option<f64>,
    burning_s: f64,
}

impl LastMotion {
    /// Collects the last reports of the vehicle.
    pub(super) fn of(vehicle: &Vehicle, phase: TdPhase, motion: &Motion) -> Self {
        // An unknown position stays unknown; an unknown velocity is taken as zero.
        let known = |value: f64| if value.is_finite() { value } else { 0.0 };
        let velocity_m_s = [motion.vx_m_s, motion.vy_m_s, motion.climb_m_s].map(known);
        let descent = vehicle.descent.as_ref().map(|descent| &descent.value);
        let wind_m_s =
            descent.map_or([0.0; 3], |d| [f64::from(d.wind_x_m_s), f64::from(d.wind_y_m_s), 0.0]).map(known);
        let change = vehicle.trend.mean_change();
        let thrust = matches!(phase, TdPhase::TD_PHASE_POWERED | TdPhase::TD_PHASE_BOOST);
        let forces = match change {
            Some(Change { acceleration_m_s2, .. }) if thrust => Forces::Thrust { acceleration_m_s2 },
            _ if is_burning(phase) => Forces::Brake,
            _ => {
                let chosen_m = descent.map(|d| f64::from(d.chosen_height_m));
                let burn_from_m = chosen_m.filter(|height_m| *height_m > 0.0 && vehicle.may_light());
                Forces::Air {
                    drag_per_m: change.and_then(|change| drag_per_m(&change, &wind_m_s)),
                    burn_from_m,
                }
            }
        };
        Self { at_m: [motion.x_m, motion.y_m, motion.altitude_m], velocity_m_s, wind_m_s, forces }
    }

    /// The expected state after this time, s.
    pub(super) fn after(&self, seconds: f64) -> Extrapolated {
        let Endpoint { place, landed_after_s, burning_s } = self.follow(seconds);
        let (or_else_m, basis) = match self.forces {
            Forces::Thrust { .. } | Forces::Brake => (0.0, Basis::LastThrust),
            Forces::Air { burn_from_m: Some(_), drag_per_m } => {
                let unlit = Self { forces: Forces::Air { drag_per_m, burn_from_m: None }, ..*self };
                let fallen = unlit.follow(seconds).place;
                ((place[2].max(0.0) - fallen[2].max(0.0)).abs(), Basis::FallThenBurn)
            }
            Forces::Air { drag_per_m: Some(_), .. } => (0.0, Basis::Fall),
            Forces::Air { drag_per_m: None, .. } => (0.0, Basis::FreeFall),
        };
        let [x_m, y_m, altitude_m] = place;
        Extrapolated { x_m, y_m, altitude_m, or_else_m, burning_s, landed_after_s, basis }
    }

    /// Integrates with the midpoint rule: exact for free fall, second order for drag.
    fn follow(&self, seconds: f64) -> Endpoint {
        let (mut place, mut velocity) = (self.at_m, self.velocity_m_s);
        let mut braking = None;
        let (mut passed_s, mut burning_s) = (0.0, 0.0);
        let seconds = seconds.min(LONGEST_S);
        while passed_s < seconds {
            let step_s = STEP_S.min(seconds - passed_s);
            let start = self.acceleration_m_s2_at(&place, &velocity, &mut braking);
            let halfway: NorthEastUp =
                std::array::from_fn(|axis| velocity[axis] + 0.5 * start[axis] * step_s);
            let acceleration = self.acceleration_m_s2_at(&place, &halfway, &mut braking);
            for axis in 0..3 {
                place[axis] += (velocity[axis] + 0.5 * acceleration[axis] * step_s) * step_s;
                velocity[axis] += acceleration[axis] * step_s;
            }
            passed_s += step_s;
            let burns = !matches!(self.forces, Forces::Air { .. }) || braking.is_some();
            burning_s += if burns { step_s } else { 0.0 };
            // Braked to rest, close to the ground as far as the last values were right; or on the ground.
            let stands = burns && velocity[2] >= 0.0 && self.velocity_m_s[2] < 0.0;
            if stands || place[2] <= 0.0 {
                return Endpoint { place, landed_after_s: Some(passed_s), burning_s };
            }
        }
        Endpoint { place, landed_after_s: None, burning_s }
    }

    fn acceleration_m_s2_at(
        &self,
        place: &NorthEastUp,
        velocity: &NorthEastUp,
        braking: &mut Option<NorthEastUp>,
    ) -> NorthEastUp {
        match self.forces {
            Forces::Thrust { acceleration_m_s2 } => acceleration_m_s2,
            Forces::Brake => *braking.get_or_insert_with(|| deceleration_to_rest_m_s2(place, velocity)),
            Forces::Air { drag_per_m, burn_from_m } => {
                if braking.is_some()
                    || burn_from_m.is_some_and(|from_m| place[2] <= from_m && velocity[2] < 0.0)
                {
                    return *braking.get_or_insert_with(|| deceleration_to_rest_m_s2(place, velocity));
                }
                let through_air = std::array::from_fn(|axis| velocity[axis] - self.wind_m_s[axis]);
                let resistance = drag_per_m.unwrap_or(0.0) * size(&through_air);
                let [north, east, up] = through_air.map(|part: f64| -resistance * part);
                [north, east, up - GRAVITY_M_S2]
            }
        }
    }
}

/// The drag that explains the difference between acceleration and gravity, 1/m; `None` if the airspeed is too low to
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

/// The constant deceleration that ends at rest on the ground, m/s2.
fn deceleration_to_rest_m_s2(place: &NorthEastUp, velocity: &NorthEastUp) -> NorthEastUp {
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

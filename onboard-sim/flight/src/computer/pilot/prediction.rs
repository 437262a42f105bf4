//! Prediction of the next seconds.

use nalgebra::{Vector2, Vector3};
use serde::Serialize;

use super::Pilot;
use super::vehicle_model::VehicleModel;
use crate::estimation::estimator::Estimate;
use crate::guidance::ignition::IgnitionPrediction;
use crate::guidance::powered::Homing;
use crate::guidance::vertical::fall_ends_m_s;
use crate::rules::phase::Phase;
use crate::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;
use crate::vehicle::rigid::RigidState;

/// Factor from the height that the parachute needs to the commit height: ejection and filling
/// scatter.
const COMMIT_MARGIN: f64 = 1.5;

/// Share of the burn's reach towards the pad on which the prediction counts. Of 33 `harsh` flights
/// (seed 7001) a second before their ignition, 30 touched down nearer than predicted or within 2 m,
/// and the others by up to 14 m farther. Half a second before it, the landing position of mk2 is
/// off by 3.4 m in the median of `field`, and 3.8 m in `real`; with the whole reach by 5.1 and 8.4
/// m.
const REACH_SHARE: f64 = 0.5;

/// Lowest assumed fall speed, m/s, so that the time to the ground is finite at apogee.
const FALL_MIN_M_S: f64 = 5.0;

/// The prediction before ignition, updated five or twenty times a second.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Prediction {
    pub ignition: IgnitionPrediction,
    /// Height of the feet below which the parachute has no margin, m.
    pub commit_height_m: f64,
    /// Height of the feet, m.
    pub height_m: f64,
    /// Speed predicted for this moment from the fall alone, m/s.
    pub predicted_speed_m_s: f64,
    /// The certified motor lands from here or from lower.
    pub lands_ahead: bool,
    /// Predicted distance of the touchdown from the pad, m: under the motor, or in a continued fall
    /// if no ignition height exists.
    pub touchdown_distance_m: f64,
}

impl Prediction {
    /// Height of the feet below which the parachute does not fill before the ground, m.
    pub(super) fn filling_height_m(&self) -> f64 {
        self.commit_height_m / COMMIT_MARGIN
    }
}

/// Height that a parachute needs at a speed, with a margin: the fall until ejection, plus the
/// inflation distance (T. W. Knacke, Parachute Recovery Systems Design Manual, NWC TP 6575, 1991,
/// chapter 5).
pub(super) fn commit_height_m(speed_m_s: f64, ejection_delay_s: f64, inflation_distance_m: f64) -> f64 {
    COMMIT_MARGIN * (speed_m_s * ejection_delay_s + inflation_distance_m)
}

/// Touchdown position without further steering, m, in the world's horizontal axes, from a position,
/// m, a velocity, m/s, and a height of the feet, m.
pub fn touchdown_m(place_m: &Vector3<f64>, velocity_m_s: &Vector3<f64>, height_m: f64) -> Vector2<f64> {
    let to_ground_s = height_m.max(0.0) / (-velocity_m_s.z).max(FALL_MIN_M_S);
    (place_m + velocity_m_s * to_ground_s).xy()
}

/// Time in which a vehicle with open fins takes on the wind's speed, s: a terminal speed of 40 m/s
/// over g, and half as much again while it is slower.
const TAKES_THE_WIND_S: f64 = 6.0;

/// The predicted apogee of a coasting vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ApogeeAhead {
    /// Its height, m.
    pub height_m: f64,
    /// Time to apogee, s.
    pub in_s: f64,
}

/// Apogee of a vehicle that coasts up from a height, m, at a vertical speed, m/s, with a drag
/// deceleration, m/s^2. Drag falls with the square of the speed, so on average over the height half
/// of it acts.
fn apogee_ahead(height_m: f64, vertical_m_s: f64, braking_m_s2: f64) -> ApogeeAhead {
    let slowing_m_s2 = STANDARD_GRAVITY_M_S2 + 0.5 * braking_m_s2.max(0.0);
    let rising_m_s = vertical_m_s.max(0.0);
    ApogeeAhead {
        height_m: height_m + 0.5 * rising_m_s * rising_m_s / slowing_m_s2,
        in_s: rising_m_s / slowing_m_s2,
    }
}

/// Touchdown position of a rising vehicle in still air without steering, m: it drifts to its apogee
/// and until drag has stopped it.
pub fn touchdown_from_below_m(place_m: &Vector3<f64>, velocity_m_s: &Vector3<f64>) -> Vector2<f64> {
    let in_s = apogee_ahead(place_m.z, velocity_m_s.z, 0.0).in_s;
    (place_m + velocity_m_s * (in_s + TAKES_THE_WIND_S)).xy()
}

impl VehicleModel {
    /// The prediction without the ignition, with the fins at these openings, rad, after a fall from
    /// this height, m.
    pub(super) fn fall(&self, estimate: &Estimate, fins_rad: &[f64; 4], apogee_m: f64) -> Prediction {
        let column = self.column(self.density_kg_m3(estimate), self.mission.soft_tilt_deg);
        let state = &estimate.state;
        let height_m = self.feet_height_m(estimate, &self.mass.at(0.0));
        let parachute = &self.airframe().parachute;
        let touchdown = touchdown_m(&state.position_m, &state.velocity_m_s, height_m);
        // Speed after the fall from apogee so far, with certified drag.
        let terminal_m_s = column.terminal_speed_m_s(self.fins_m2(fins_rad));
        let fallen_m = (apogee_m - state.position_m.z).max(0.0);
        let shed = libm::exp(-2.0 * STANDARD_GRAVITY_M_S2 * fallen_m / (terminal_m_s * terminal_m_s));
        Prediction {
            commit_height_m: commit_height_m(
                state.velocity_m_s.norm(),
                parachute.ejection_delay_s,
                parachute.inflation_distance_m,
            ),
            height_m,
            // Until it is computed.
            lands_ahead: true,
            predicted_speed_m_s: terminal_m_s * libm::sqrt((1.0 - shed).max(0.0)),
            touchdown_distance_m: libm::hypot(touchdown.x, touchdown.y),
            ..Prediction::default()
        }
    }

    /// The complete prediction.
    pub(super) fn prediction(&self, estimate: &Estimate, fins_rad: &[f64; 4], apogee_m: f64) -> Prediction {
        let fall = self.fall(estimate, fins_rad, apogee_m);
        let (settings, curve, fins_m2) =
            (&self.mission.ignition, &self.mission.motor_curve, self.fins_m2(fins_rad));
        let column = self.column(self.density_kg_m3(estimate), self.mission.soft_tilt_deg);
        let (height_m, vertical_m_s) = (fall.height_m, estimate.state.velocity_m_s.z);
        let ignition = settings.prediction(&column, curve, height_m, vertical_m_s, fins_m2);
        let lands_ahead =
            ignition.band.is_some() || settings.lands_ahead(&column, curve, height_m, vertical_m_s, fins_m2);
        let touchdown_distance_m = self
            .landing_m(estimate, &ignition)
            .map_or(fall.touchdown_distance_m, |landing_m| landing_m.norm());
        Prediction { ignition, lands_ahead, touchdown_distance_m, ..fall }
    }

    /// Landing position under the motor, m, in the world's horizontal axes: the vehicle falls to
    /// its ignition, decelerates evenly, and diverts towards the pad with a share of its reach.
    fn landing_m(&self, estimate: &Estimate, ignition: &IgnitionPrediction) -> Option<Vector2<f64>> {
        let settings = &self.mission.powered.homing;
        let homing = Homing { reach_m_s2: REACH_SHARE * settings.reach_m_s2, ..*settings };
        let falls_s = ignition.command_in_s?.max(0.0) + self.mission.ignition.delay_s;
        let burns_s = self.burn().falls_through_weight_s(self.mass.at(0.0).mass_kg)?;
        let RigidState { position_m, velocity_m_s, .. } = estimate.state;
        let onset_m = position_m + velocity_m_s * falls_s;
        Some(onset_m.xy().zip_map(&velocity_m_s.xy(), |onset_m, m_s| homing.target_m(onset_m, m_s, burns_s)))
    }

    /// Drag area of the fins in flight, m^2.
    fn fins_m2(&self, fins_rad: &[f64; 4]) -> f64 {
        self.motor.air_scale() * self.airframe().fin_drag_area_m2(fins_rad)
    }
}

impl Pilot {
    /// The apogee predicted on the way up; `None` under the ascent motor, and after apogee.
    pub fn apogee_ahead(&self, phase: Phase) -> Option<ApogeeAhead> {
        let estimate = self.estimate.as_ref().filter(|_| phase == Phase::Coast)?;
        let braking_m_s2 = -estimate.specific_force_m_s2.x;
        Some(apogee_ahead(estimate.state.position_m.z, estimate.state.velocity_m_s.z, braking_m_s2))
    }

    /// Expected landing position under the motor, m, in the world's horizontal axes; `None` without
    /// an ignition ahead. For displays: no decision depends on it.
    pub fn landing_m(&self) -> Option<Vector2<f64>> {
        self.model.landing_m(self.estimate.as_ref()?, &self.prediction.ignition)
    }

    /// Impact speed after a fall from here with fully open fins and no thrust, m/s, positive
    /// downwards; `None` before the first frame.
    pub fn impact_m_s(&self) -> Option<f64> {
        let estimate = self.estimate.as_ref()?;
        let (known, state) = (&self.model, &estimate.state);
        let column = known.column(known.density_kg_m3(estimate), known.mission.soft_tilt_deg);
        let fins_m2 = known.motor.air_scale() * known.airframe().open_fin_drag_area_m2();
        let terminal_m_s = column.terminal_speed_m_s(fins_m2);
        let height_m = known.feet_height_m(estimate, &known.mass.at(0.0));
        Some(fall_ends_m_s(height_m, state.velocity_m_s.z, terminal_m_s))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn touchdown_lies_along_the_velocity_and_the_time_of_a_slow_fall_is_limited() {
        let place_m = Vector3::new(10.0, -4.0, 80.4);
        let falling = touchdown_m(&place_m, &Vector3::new(-2.0, 1.0, -40.0), 80.0);
        assert_eq!(falling, Vector2::new(6.0, -2.0));
        let at_apogee = touchdown_m(&place_m, &Vector3::new(-2.0, 1.0, 0.0), 80.0);
        assert_eq!(at_apogee, Vector2::new(-22.0, 12.0));
        assert_eq!(touchdown_m(&place_m, &Vector3::new(-2.0, 1.0, -0.2), -0.1), place_m.xy());
    }
}

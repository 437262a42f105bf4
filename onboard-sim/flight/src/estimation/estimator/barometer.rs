//! The barometer: height by static pressure, with its offset and the errors of the flow around it.
//!
//! The error of a static port is in proportion to the dynamic pressure (W. Gracey, Measurement of
//! Aircraft Speed and Altitude, NASA Reference Publication 1046, 1980).

use super::correction::{INFLATION_POSITION_M, shown_by_height, without_last_if};
use super::covariance::{
    BAROMETER_LATE, BAROMETER_OFFSET, BAROMETER_RAM, BAROMETER_SCALE, BAROMETER_SUCTION, POSITION, VELOCITY,
    WIND,
};
use super::{Estimator, HeightSources};

/// Consecutive rejections, half a second, after which the filter assumes a new offset of the
/// barometer.
const BAROMETER_REJECTIONS: u32 = 25;

/// Consecutive rejections, three tenths of a second, after which inertial height and fixes outvote
/// it: before heights that disagree end the landing.
const OUTVOTED_REJECTIONS: u32 = 15;

impl Estimator {
    /// The barometer measures the height of its ports by its scale, plus its offset, plus the ram
    /// error `-k V^2 / 2 g`, plus the suction `c v^2 / 2 g` of the flow across the axis.
    pub(super) fn take_barometer(&mut self, altitude_m: f64, lever_m: &nalgebra::Vector3<f64>) {
        // Zeroed on the pad, where the vehicle stands upright.
        let altitude_m = altitude_m - (self.nominal.world_from_body * lever_m).z + lever_m.x;
        let gravity = self.config.gravity_m_s2;
        let through_air = self.velocity_through_air_m_s();
        let speed_height_m = through_air.norm_squared() / (2.0 * gravity);
        let state = &self.nominal;
        let nose = state.world_from_body * nalgebra::Vector3::x();
        let across = through_air - nose * nose.dot(&through_air);
        let across_height_m = across.norm_squared() / (2.0 * gravity);
        let by_velocity =
            through_air * (-state.barometer_ram / gravity) + across * (state.barometer_suction / gravity);
        let predicted_m = state.position_m.z * (1.0 + state.barometer_scale) + state.barometer_offset_m
            - state.barometer_ram * speed_height_m
            - state.barometer_late_s * state.velocity_m_s.z
            + state.barometer_suction * across_height_m;
        let mut sensitivity = [(BAROMETER_SUCTION, across_height_m); 11];
        let known = [
            (POSITION + 2, 1.0 + state.barometer_scale),
            (BAROMETER_SCALE, state.position_m.z),
            (VELOCITY, by_velocity.x),
            (VELOCITY + 1, by_velocity.y),
            (VELOCITY + 2, by_velocity.z),
            (WIND, -by_velocity.x),
            (WIND + 1, -by_velocity.y),
            (BAROMETER_OFFSET, 1.0),
            (BAROMETER_RAM, -speed_height_m),
            (BAROMETER_LATE, -state.velocity_m_s.z),
        ];
        let known = without_last_if(self.config.barometer_late_s <= 0.0, &known);
        sensitivity[..known.len()].copy_from_slice(known);
        let sensitivity = &sensitivity[..known.len() + usize::from(self.config.barometer_suction > 0.0)];
        let noise = self.config.barometer_m * self.config.barometer_m;
        let correction = self.correct(sensitivity, altitude_m - predicted_m, noise, shown_by_height);
        self.aids.barometer.take(&correction);
        if correction.accepted {
            (self.barometer_outvoted, self.outvoted_from) = (false, self.aids.gnss_position.used);
        }
        let fixes = &self.aids.gnss_position;
        if self.aids.barometer.refused_in_a_row >= OUTVOTED_REJECTIONS
            && fixes.refused_in_a_row == 0
            && fixes.used > self.outvoted_from
        {
            self.barometer_outvoted = true;
            self.heights.forget_barometer();
            self.heights_without_lidar.forget_barometer();
        }
        if altitude_m.is_finite() && !self.barometer_outvoted {
            let state = &self.nominal;
            let late_m = state.barometer_late_s * state.velocity_m_s.z;
            let height_m =
                (altitude_m - state.barometer_offset_m + state.barometer_ram * speed_height_m + late_m
                    - state.barometer_suction * across_height_m)
                    / (1.0 + state.barometer_scale);
            self.heights.take_barometer(height_m);
            self.heights_without_lidar.take_barometer(height_m);
        }
        if self.aids.barometer.refused_in_a_row >= BAROMETER_REJECTIONS {
            self.aids.barometer.refused_in_a_row = 0;
            let HeightSources { inertial_m, barometric_m, .. } = self.heights.sources();
            let off_m = (self.nominal.position_m.z - inertial_m).abs();
            if barometric_m.is_some_and(|height_m| (height_m - inertial_m).abs() < 0.5 * off_m) {
                // It and the inertial height outvote the estimate, which fixes have pulled away.
                self.covariance.widen(POSITION + 2, off_m * off_m);
            } else {
                self.covariance.widen(BAROMETER_OFFSET, INFLATION_POSITION_M * INFLATION_POSITION_M);
            }
        }
    }
}

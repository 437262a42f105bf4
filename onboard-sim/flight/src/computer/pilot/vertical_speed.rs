//! Vertical speed from three independent sources: inertial since the start, pressure, and
//! satellites. No single one decides.

use serde::{Deserialize, Serialize};

use crate::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;

/// Interval of the speed from pressure altitude, s: with a barometer's noise it is good to 0.6 m/s.
pub(super) const RATE_OVER_S: f64 = 0.2;
/// Maximum age of a fix, s: three missing fixes.
const FIX_MAX_AGE_S: f64 = 0.6;
/// Identical samples (a tenth of a second) after which a barometer counts as frozen.
const FROZEN_SAMPLES: u32 = 5;
/// Differences between speeds, m/s, that exclude both being right: a late fix and the pressure of
/// the last window differ by 3 while the vehicle coasts, and by 15 under the ascent motor, where
/// there are no fixes.
const APART_OF_THREE_M_S: f64 = 8.0;
pub(super) const APART_OF_TWO_M_S: f64 = 15.0;
/// Time for which the middle of three must contradict an estimate before the estimate is rejected,
/// s.
const CONTRADICTED_S: f64 = 0.5;
/// Change of the fixes' speed that the pressure must confirm, m/s: half a second of coasting.
const CONFIRMED_M_S: f64 = 5.0;

/// New data of a frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct SpeedReadings {
    pub(super) time_s: f64,
    pub(super) frame_s: f64,
    /// Upwards, from the specific force and the attitude, m/s^2.
    pub(super) vertical_m_s2: f64,
    /// `None` also while charge gas is in the vehicle.
    pub(super) pressure_altitude_m: Option<f64>,
    /// From a fix, up, m/s.
    pub(super) gnss_m_s: Option<f64>,
    /// Estimated, up, m/s.
    pub(super) estimated_m_s: f64,
}

with_defaults! {
    /// The three speeds, up, m/s.
    #[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
    pub(super) struct VerticalSpeeds {
        /// Initialised from the estimate.
        inertial_m_s: Option<f64> = None,
        gnss_m_s: f64 = 0.0,
        gnss_at_s: f64 = f64::NEG_INFINITY,
        /// The last pressure altitude.
        altitude_m: f64 = f64::INFINITY,
        same_samples: u32 = 0,
        /// Altitude and time at the start of the present window of [`RATE_OVER_S`], m and s.
        mark_m: f64 = 0.0,
        marked_at_s: f64 = f64::NEG_INFINITY,
        /// Result of the last window, m/s, and its time, s.
        pressure_m_s: f64 = 0.0,
        pressure_at_s: f64 = f64::NEG_INFINITY,
        contradicted_s: f64 = 0.0,
        /// The accelerometer is frozen or silent, and the estimate with it.
        pub(super) accelerometer_lost: bool = false,
        /// Speed of the first in the present run of confirmed fixes, m/s.
        confirmed_from_m_s: Option<f64> = None,
    }
}

impl VerticalSpeeds {
    /// After a reset only the estimate contains the meantime.
    pub(super) fn resumed(self) -> Self {
        Self { inertial_m_s: None, ..self }
    }

    pub(super) fn take(&mut self, seen: &SpeedReadings) {
        let inertial_m_s = self.inertial_m_s.get_or_insert(seen.estimated_m_s);
        if seen.vertical_m_s2.is_finite() {
            *inertial_m_s += seen.vertical_m_s2 * seen.frame_s;
        }
        if let Some(gnss_m_s) = seen.gnss_m_s.filter(|m_s| m_s.is_finite()) {
            (self.gnss_m_s, self.gnss_at_s) = (gnss_m_s, seen.time_s);
        }
        if let Some(altitude_m) = seen.pressure_altitude_m.filter(|altitude_m| altitude_m.is_finite()) {
            self.take_pressure(altitude_m, seen.time_s);
        }
        let middle_m_s = self.middle_m_s(seen.time_s, None).filter(|m_s| {
            // A NaN estimate is contradicted by anything.
            let near = (m_s - seen.estimated_m_s).abs() <= APART_OF_TWO_M_S;
            !near
        });
        self.contradicted_s = middle_m_s.map_or(0.0, |_| self.contradicted_s + seen.frame_s);
    }

    fn take_pressure(&mut self, altitude_m: f64, time_s: f64) {
        let same = altitude_m.to_bits() == self.altitude_m.to_bits();
        self.same_samples = if same { self.same_samples.saturating_add(1) } else { 0 };
        self.altitude_m = altitude_m;
        let since_s = time_s - self.marked_at_s;
        if since_s >= RATE_OVER_S {
            // The first sample after a pause only begins a window.
            if since_s <= 2.0 * RATE_OVER_S {
                (self.pressure_m_s, self.pressure_at_s) = ((altitude_m - self.mark_m) / since_s, time_s);
            }
            (self.mark_m, self.marked_at_s) = (altitude_m, time_s);
        }
    }

    /// Whether a barometer that repeats this sample is frozen.
    pub(super) fn repeats(&self, altitude_m: f64) -> bool {
        self.same_samples >= FROZEN_SAMPLES && altitude_m.to_bits() == self.altitude_m.to_bits()
    }

    /// Whether a fix contradicts both the estimate and the pressure.
    pub(super) fn outvote(&self, gnss_m_s: f64, estimated_m_s: f64, time_s: f64) -> bool {
        self.pressure_m_s(time_s, None).is_some_and(|pressure_m_s| {
            let near = |m_s: f64| (m_s - pressure_m_s).abs() <= APART_OF_THREE_M_S;
            near(estimated_m_s) && !near(gnss_m_s)
        })
    }

    /// Whether the pressure has agreed with the speed of the fixes, m/s, while that changed. A
    /// spike, or the flow at Mach 1, may agree by chance with a receiver that repeats its last
    /// speed.
    pub(super) fn pressure_confirms(
        &mut self,
        gnss_m_s: f64,
        time_s: f64,
        through_gas_s: Option<f64>,
    ) -> bool {
        let pressure_m_s = self.pressure_m_s(time_s, through_gas_s);
        let agrees = pressure_m_s.is_some_and(|m_s| (m_s - gnss_m_s).abs() <= APART_OF_THREE_M_S);
        self.confirmed_from_m_s = self.confirmed_from_m_s.or(Some(gnss_m_s)).filter(|_| agrees);
        self.confirmed_from_m_s.is_some_and(|from_m_s| (gnss_m_s - from_m_s).abs() >= CONFIRMED_M_S)
    }

    /// The last pressure altitude, m, of a barometer that is neither silent nor frozen.
    pub(super) fn altitude_m(&self, time_s: f64) -> Option<f64> {
        (time_s - self.pressure_at_s <= 2.0 * RATE_OVER_S && self.same_samples < FROZEN_SAMPLES)
            .then_some(self.altitude_m)
    }

    /// Speed by pressure. `through_gas_s`: for this time after the last window the vehicle coasts,
    /// and the pressure is that of charge gas.
    pub(super) fn pressure_m_s(&self, time_s: f64, through_gas_s: Option<f64>) -> Option<f64> {
        let age_s = time_s - self.pressure_at_s;
        if self.altitude_m(time_s).is_some() {
            Some(self.pressure_m_s)
        } else if through_gas_s.is_some_and(|most_s| age_s <= most_s) {
            Some(self.pressure_m_s - STANDARD_GRAVITY_M_S2 * age_s)
        } else {
            None
        }
    }

    /// Speed of the last fix, unless it is too old.
    pub(super) fn gnss_m_s(&self, time_s: f64) -> Option<f64> {
        (time_s - self.gnss_at_s <= FIX_MAX_AGE_S).then_some(self.gnss_m_s)
    }

    /// The middle of the three, if all are available: it is right if one is wrong.
    fn middle_m_s(&self, time_s: f64, through_gas_s: Option<f64>) -> Option<f64> {
        let mut three_m_s =
            [self.inertial_m_s?, self.pressure_m_s(time_s, through_gas_s)?, self.gnss_m_s(time_s)?];
        three_m_s.sort_by(f64::total_cmp);
        Some(three_m_s[1])
    }

    /// Vertical speed: the estimate, unless the three contradict it. Of two that disagree the
    /// faster climb counts: nothing separates or deploys on the way up.
    pub(super) fn rises_m_s(&self, estimated_m_s: f64, time_s: f64, through_gas_s: Option<f64>) -> f64 {
        let others = [self.pressure_m_s(time_s, through_gas_s), self.gnss_m_s(time_s)];
        if let Some(fastest_m_s) =
            others.into_iter().flatten().reduce(f64::max).filter(|_| self.accelerometer_lost)
        {
            return fastest_m_s;
        }
        let apart = |m_s: f64, most_m_s: f64| (m_s - estimated_m_s).abs() > most_m_s;
        if let Some(middle_m_s) = self.middle_m_s(time_s, through_gas_s) {
            return if apart(middle_m_s, APART_OF_THREE_M_S) { middle_m_s } else { estimated_m_s };
        }
        match self.pressure_m_s(time_s, through_gas_s).or(self.gnss_m_s(time_s)) {
            Some(other_m_s) if apart(other_m_s, APART_OF_TWO_M_S) => estimated_m_s.max(other_m_s),
            _ => estimated_m_s,
        }
    }

    /// Whether two of the three have contradicted the estimate for long enough to reject it.
    pub(super) fn contradict_the_estimate(&self) -> bool {
        self.contradicted_s >= CONTRADICTED_S
    }
}

//! Servos commanded by the width of a pulse, without feedback.

/// Time between pulses, us: 333 Hz, which digital servos take.
pub(crate) const PERIOD_US: f64 = 1e6 / 333.0;
/// Limits of a pulse, us.
const SHORTEST_US: f64 = 900.0;
const LONGEST_US: f64 = 2100.0;

/// A surface on its servo. Both values are measured on the vehicle, with a protractor: at two
/// angles, from both sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surface {
    /// Pulse at the angle zero, us.
    pub zero_us: f64,
    /// Its change with the angle, us/rad; negative if the servo is mounted the other way round.
    pub us_per_rad: f64,
}

impl Surface {
    /// The duty for an angle, rad. An angle that is no number gives no pulse, and a servo without
    /// pulses stays where it is.
    pub(crate) fn duty(&self, angle_rad: f64, most: u16) -> u16 {
        let pulse_us = (self.zero_us + self.us_per_rad * angle_rad).clamp(SHORTEST_US, LONGEST_US);
        libm::round(pulse_us / PERIOD_US * f64::from(most)) as u16
    }
}

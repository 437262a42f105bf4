//! A state at touchdown, predicted or reached, with the limits that the vehicle found violated.

use protocol::dialect::{TD_TOUCHDOWN_LIMITS_DATA, TdLimit};

/// A state at touchdown, predicted or reached.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touchdown {
    pub x_m: f64,
    pub altitude_m: f64,
    /// Pitch from the horizontal, rad; pi/2 is upright.
    pub pitch_rad: f64,
    /// Axial speed, towards the nose, m/s.
    pub u_m_s: f64,
    pub w_m_s: f64,
    pub q_rad_s: f64,
    /// The limits that the vehicle reports as violated.
    pub violated: TdLimit,
}

/// The limits of a touchdown in the order of the state: the word on screens and the vehicle's bit.
pub const LIMITS: [(&str, TdLimit); 6] = [
    ("distance", TdLimit::TD_LIMIT_X),
    ("height", TdLimit::TD_LIMIT_ALTITUDE),
    ("tilt", TdLimit::TD_LIMIT_PITCH),
    ("sink", TdLimit::TD_LIMIT_AXIAL_SPEED),
    ("drift", TdLimit::TD_LIMIT_LATERAL_SPEED),
    ("turn", TdLimit::TD_LIMIT_PITCH_RATE),
];

impl Touchdown {
    /// The angle from upright, rad.
    pub fn tilt_rad(&self) -> f64 {
        (self.pitch_rad - std::f64::consts::FRAC_PI_2).abs()
    }

    /// The names of the violated limits; `None` if there is none.
    pub fn violations(&self) -> Option<String> {
        let violated = LIMITS.iter().filter(|(_, bit)| self.violated.contains(*bit));
        let names: Vec<&str> = violated.map(|(name, _)| *name).collect();
        (!names.is_empty()).then(|| names.join(", "))
    }
}

/// What the landing legs withstand: lean, rad; vertical and horizontal speed, m/s; rotation rate, rad/s.
const LEGS: [f64; 4] = [10.0 * DEGREE, 1.0, 0.7, 30.0 * DEGREE];
const DEGREE: f64 = std::f64::consts::PI / 180.0;
/// Limits sent as `f32` match within this relative error.
const SAME_SHARE: f64 = 1e-5;

/// Whether these limits are what the landing legs withstand.
pub fn are_of_legs(limits: &TD_TOUCHDOWN_LIMITS_DATA) -> bool {
    let sent = [limits.pitch_error_rad, limits.u_m_s, limits.w_m_s, limits.q_rad_s];
    sent.into_iter().zip(LEGS).all(|(sent, own)| (f64::from(sent) - own).abs() <= SAME_SHARE * own)
}

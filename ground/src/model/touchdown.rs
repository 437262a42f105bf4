//! A state at touchdown, predicted or reached, with the limits that the vehicle found violated.

use protocol::dialect::TdLimit;

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

/// The limits of a touchdown in the order of the state: the short name on screens and the vehicle's bit.
pub const LIMITS: [(&str, TdLimit); 6] = [
    ("x", TdLimit::TD_LIMIT_X),
    ("alt", TdLimit::TD_LIMIT_ALTITUDE),
    ("pitch", TdLimit::TD_LIMIT_PITCH),
    ("u", TdLimit::TD_LIMIT_AXIAL_SPEED),
    ("w", TdLimit::TD_LIMIT_LATERAL_SPEED),
    ("q", TdLimit::TD_LIMIT_PITCH_RATE),
];

impl Touchdown {
    /// The names of the violated limits; `None` if there is none.
    pub fn violations(&self) -> Option<String> {
        let violated = LIMITS.iter().filter(|(_, bit)| self.violated.contains(*bit));
        let names: Vec<&str> = violated.map(|(name, _)| *name).collect();
        (!names.is_empty()).then(|| names.join(", "))
    }
}

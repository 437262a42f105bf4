//! The touchdown limits as they are shown.
//!
//! The vehicle judges; these constants are for the screen only (Table 2 of the landing paper).

use protocol::dialect::TdLimit;

/// A state at touchdown, predicted or reached.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touchdown {
    /// Horizontal position, m.
    pub x_m: f64,
    /// Altitude, m.
    pub altitude_m: f64,
    /// Pitch from the horizontal, rad; pi/2 is upright.
    pub pitch_rad: f64,
    /// Axial speed, towards the nose, m/s.
    pub u_m_s: f64,
    /// Lateral speed, m/s.
    pub w_m_s: f64,
    /// Pitch rate, rad/s.
    pub q_rad_s: f64,
    /// The limits that the vehicle found violated.
    pub violated: TdLimit,
}

/// One limit and the value held against it, in the units of the screen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LimitRow {
    /// Short name.
    pub name: &'static str,
    /// The value, in degrees where it is an angle.
    pub value: f64,
    /// Unit of value and limit.
    pub unit: &'static str,
    /// The limit, for reading.
    pub limit: &'static str,
    /// What the vehicle says of it.
    pub kept: bool,
}

impl Touchdown {
    /// Every limit, in state order.
    pub fn rows(&self) -> [LimitRow; 6] {
        let row = |name, value, limit, unit, bit| LimitRow {
            name,
            value,
            unit,
            limit,
            kept: !self.violated.contains(bit),
        };
        [
            row("x", self.x_m, "±20", "m", TdLimit::TD_LIMIT_X),
            row("alt", self.altitude_m, "0..0.2", "m", TdLimit::TD_LIMIT_ALTITUDE),
            row("pitch", self.pitch_rad.to_degrees(), "85..95", "deg", TdLimit::TD_LIMIT_PITCH),
            row("u", self.u_m_s, "±0.4", "m/s", TdLimit::TD_LIMIT_AXIAL_SPEED),
            row("w", self.w_m_s, "±0.1", "m/s", TdLimit::TD_LIMIT_LATERAL_SPEED),
            row("q", self.q_rad_s.to_degrees(), "±2", "deg/s", TdLimit::TD_LIMIT_PITCH_RATE),
        ]
    }

    /// The names of the limits not kept, or `None` if all are.
    pub fn violations(&self) -> Option<String> {
        let names: Vec<&str> = self.rows().iter().filter(|row| !row.kept).map(|row| row.name).collect();
        (!names.is_empty()).then(|| names.join(", "))
    }
}

//! The four fins of the landing paper: drag, lift and moments as functions of the opening angle (section 2, Eq. 1-17).
//!
//! Each fin is a quarter of the fuselage's skin, with its hinge near the nose; `kappa` is its opening angle, 0 closed
//! against the body and pi/2 fully open. (Eq. 1 prints `pi - X_b . Y_f`, which is no angle.) Body axes are those of
//! [`crate::vehicle::rigid`]: x to the nose, moments about x roll, y pitch, z yaw. Seen along the body, fin `i` is at
//!
//! ```text
//! (y, z) = r (-YAW[i] cos 30 deg, PITCH[i] sin 30 deg),   r = (D + L_f sin kappa) / 2
//! ```
//!
//! At this place a drag towards the nose has the moments of Eq. 16 and 17.
//!
//! Errors of the printed equations, and their corrections:
//! * Eq. 3 and Eq. 13-14 each have a sine of kappa; it is one and the same, and the force goes as `sin kappa`.
//! * Eq. 16 and 17 multiply the bracket by one force, but each fin has its own force, so the sum is taken fin by fin.
//! * Eq. 15 sums four lift moments of one sign: four equal openings would spin the vehicle. The text's "chosen
//!   symmetries" need neighbours that mirror each other, so the signs alternate ([`ROLL`]). The patterns of roll,
//!   pitch, yaw and drag are then orthogonal, which is the decoupling that section 2.1 claims.

use core::f64::consts::FRAC_PI_6;

/// Signs of the fins' roll moments. The hinges are on the side where the side force of the lift acts with the drag in
/// yaw, and against it, but more strongly, in pitch. With hinges on the other side the two would almost cancel in yaw.
pub const ROLL: [f64; 4] = [-1.0, 1.0, -1.0, 1.0];
/// Signs of the fins' pitch moments (Eq. 16).
pub const PITCH: [f64; 4] = [1.0, -1.0, -1.0, 1.0];
/// Signs of the fins' yaw moments (Eq. 17).
pub const YAW: [f64; 4] = [1.0, 1.0, -1.0, -1.0];

/// sin(pi/6).
pub const SIN_30: f64 = 0.5;
/// cos(pi/6).
pub const COS_30: f64 = 0.866_025_403_784_438_6;

/// Coefficients and size of the fins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FinModel {
    /// Reference area of the coefficients (the paper's S_b), m^2.
    pub reference_area_m2: f64,
    /// Drag coefficient of an open fin (C_xf).
    pub drag_coefficient: f64,
    /// Lift coefficient of an open fin (C_zf).
    pub lift_coefficient: f64,
    /// Length of a fin (L_f), m.
    pub length_m: f64,
    /// Diameter of the body (D), m.
    pub body_diameter_m: f64,
}

/// Moments about the body axes, N m.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Moments {
    /// About x.
    pub roll_n_m: f64,
    /// About y.
    pub pitch_n_m: f64,
    /// About z.
    pub yaw_n_m: f64,
}

/// The air's state at the fins: dynamic pressure, angle of attack and sideslip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flow {
    /// `1/2 rho V^2`, Pa.
    pub dynamic_pressure_pa: f64,
    /// Angle of attack, rad.
    pub alpha_rad: f64,
    /// Sideslip, rad.
    pub beta_rad: f64,
}

/// Angle of attack and sideslip seen by each fin, rad: Eq. 9-12.
pub fn fin_incidence_rad(alpha_rad: f64, beta_rad: f64) -> [(f64, f64); 4] {
    let (sin, cos) = libm::sincos(FRAC_PI_6);
    [
        (cos * alpha_rad - sin * beta_rad, sin * alpha_rad + cos * beta_rad),
        (cos * alpha_rad + sin * beta_rad, -sin * alpha_rad + cos * beta_rad),
        (-cos * alpha_rad + sin * beta_rad, -sin * alpha_rad - cos * beta_rad),
        (-cos * alpha_rad - sin * beta_rad, sin * alpha_rad - cos * beta_rad),
    ]
}

impl FinModel {
    /// Drag of each fin, N: Eq. 13.
    pub fn drag_n(&self, flow: &Flow, kappa_rad: [f64; 4]) -> [f64; 4] {
        self.force_n(self.drag_coefficient, flow, kappa_rad)
    }

    /// Magnitude of the lift of each fin, N: Eq. 14.
    pub fn lift_n(&self, flow: &Flow, kappa_rad: [f64; 4]) -> [f64; 4] {
        self.force_n(self.lift_coefficient, flow, kappa_rad)
    }

    fn force_n(&self, coefficient: f64, flow: &Flow, kappa_rad: [f64; 4]) -> [f64; 4] {
        let incidence = fin_incidence_rad(flow.alpha_rad, flow.beta_rad);
        let open_n = flow.dynamic_pressure_pa * self.reference_area_m2 * coefficient;
        core::array::from_fn(|i| {
            let (alpha, beta) = incidence[i];
            open_n * libm::sin(kappa_rad[i]) * libm::cos(alpha) * libm::cos(beta)
        })
    }

    /// Distance of a fin's force from the axis, m, from the sine of its opening angle.
    pub fn radius_m(&self, sin_kappa: f64) -> f64 {
        0.5 * (self.body_diameter_m + self.length_m * sin_kappa)
    }

    /// Moments of the drags and lifts about the axis: Eq. 15 with alternating signs, Eq. 16 and 17 fin by fin.
    pub fn moments(&self, flow: &Flow, kappa_rad: [f64; 4]) -> Moments {
        let (drag_n, lift_n) = (self.drag_n(flow, kappa_rad), self.lift_n(flow, kappa_rad));
        let mut moments = Moments::default();
        for i in 0..4 {
            let radius_m = self.radius_m(libm::sin(kappa_rad[i]));
            moments.roll_n_m += ROLL[i] * radius_m * lift_n[i];
            moments.pitch_n_m += PITCH[i] * radius_m * SIN_30 * drag_n[i];
            moments.yaw_n_m += YAW[i] * radius_m * COS_30 * drag_n[i];
        }
        moments
    }
}

#[cfg(test)]
mod tests;

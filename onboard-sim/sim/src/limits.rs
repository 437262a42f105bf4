//! What counts as a landing, by two sets of limits: those of the legs, and the landing paper's Table 2.
//!
//! The crew sees the verdict of the legs, because it says whether the vehicle still stands. Table 2 is reported as
//! well.

use core::f64::consts::FRAC_PI_2;

use crate::world::Touchdown;
use flight::rules::verdict::{LandingVerdict, TouchdownLimits};
use flight::vehicle::dynamics::PlanarState;
use flight::vehicle::mission::Mission;

/// Both sets of limits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// The limits of the legs, anywhere inside the fence.
    pub legs: TouchdownLimits,
    /// The landing paper's.
    pub table_2: TouchdownLimits,
}

impl Limits {
    pub fn of(mission: &Mission) -> Self {
        let table_2 = TouchdownLimits::from(&mission.touchdown_limits);
        Self { legs: TouchdownLimits::of_the_legs(mission), table_2 }
    }

    /// Judges by the limits of the legs: vertical and horizontal velocity over the ground, and the total rotation rate.
    pub fn by_legs(&self, touchdown: &Touchdown) -> (PlanarState, LandingVerdict) {
        let state = PlanarState {
            u_m_s: touchdown.vertical_m_s,
            w_m_s: touchdown.lateral_m_s,
            q_rad_s: touchdown.rate_rad_s,
            ..placed(touchdown)
        };
        (state, in_words_of_the_legs(LandingVerdict::judge(&self.legs, &state)))
    }

    /// Judges by the landing paper's Table 2: velocities along and across the axis, and the rotation rate across it.
    pub fn by_table_2(&self, touchdown: &Touchdown) -> (PlanarState, LandingVerdict) {
        let body_m_s = touchdown.state.velocity_in_body_m_s();
        let state = PlanarState {
            u_m_s: body_m_s.x,
            w_m_s: libm::hypot(body_m_s.y, body_m_s.z),
            q_rad_s: touchdown.cross_rate_rad_s,
            ..placed(touchdown)
        };
        (state, LandingVerdict::judge(&self.table_2, &state))
    }
}

/// The verdict with the names of what the legs feel: speeds over the ground, and angles without direction.
fn in_words_of_the_legs(mut verdict: LandingVerdict) -> LandingVerdict {
    let names = ["distance", "altitude", "tilt", "vertical speed", "lateral speed", "rotation rate"];
    for (result, name) in verdict.results.iter_mut().zip(names) {
        result.name = name;
        if name == "tilt" {
            result.value = result.value.abs();
        }
    }
    verdict
}

/// Distance and tilt. The altitude is that of the foot that touches the ground, so it is zero.
fn placed(touchdown: &Touchdown) -> PlanarState {
    let place_m = &touchdown.state.position_m;
    PlanarState {
        x_m: libm::hypot(place_m.x, place_m.y),
        z_m: 0.0,
        theta_rad: FRAC_PI_2 - touchdown.tilt_rad,
        ..PlanarState::default()
    }
}

//! Whether a plan exists from an ignition in the plane.
//!
//! Every cell is one cold solve of the profile's landing problem, from both bent initial guesses. A cell lands if the
//! plan converges and ends inside the touchdown limits (Table 2 of the landing paper).

use std::convert::Infallible;

use flight::guidance::landing::landing_problem;
use flight::rules::verdict::{LandingVerdict, TouchdownLimits};
use flight::vehicle::profile::Profile;
use nmpc::SolveStatus;

use super::{Axis, Cell, Finding, Map, MapError, Quantity, check, map_of};

/// What a profile can be mapped over.
const POSSIBLE: &[Quantity] = &[
    Quantity::ThrustToWeight,
    Quantity::Height,
    Quantity::Speed,
    Quantity::Tilt,
    Quantity::Rate,
    Quantity::LateralSpeed,
    Quantity::ThrustScale,
];

/// Computes a profile's map over `x` and `y` on `jobs` threads; `progress` is called with the cells done, from any of them.
///
/// # Errors
/// The axes do not suit a profile, or a thread could not be started.
pub fn map(
    profile: &Profile,
    axes: [Axis; 2],
    jobs: usize,
    progress: &(dyn Fn(usize) + Sync),
) -> Result<Map, MapError> {
    check(&profile.name, axes, POSSIBLE)?;
    map_of(axes, jobs, progress, |x, y| Ok::<_, Infallible>(cell(profile, axes, [x, y])))
}

fn cell(profile: &Profile, axes: [Axis; 2], values: [f64; 2]) -> Cell {
    let mut profile = profile.clone();
    let mut thrust_scale = 1.0;
    for (axis, value) in axes.into_iter().zip(values) {
        apply(axis.quantity, value, &mut profile, &mut thrust_scale);
    }
    let limits = TouchdownLimits::from_profile(&profile);
    let initial = profile.start.planar_state();
    let problem = landing_problem(&profile, initial, 0.0, profile.nmpc.horizon_steps, thrust_scale);
    let solution = nmpc::solve(&problem, None);
    if solution.status == SolveStatus::NotLandable {
        return Cell {
            finding: Finding::NotLandable,
            touchdown_speed_m_s: solution.best_touchdown_speed_m_s,
        };
    }
    let Some(end) = solution.states.last() else {
        return Cell { finding: Finding::Misses, touchdown_speed_m_s: f64::NAN };
    };
    let landed = LandingVerdict::judge_plan(&limits, end).landed();
    let lands = landed && solution.status == SolveStatus::Converged;
    Cell {
        finding: if lands { Finding::Lands } else { Finding::Misses },
        touchdown_speed_m_s: end.speed_m_s(),
    }
}

/// Puts a value into the problem.
fn apply(quantity: Quantity, value: f64, profile: &mut Profile, thrust_scale: &mut f64) {
    match quantity {
        Quantity::ThrustToWeight => {
            profile.motor.thrust_n = value * profile.vehicle.mass_kg * profile.environment.gravity_m_s2;
        }
        Quantity::Height => profile.start.altitude_m = value,
        Quantity::Speed => profile.start.u_m_s = -value,
        Quantity::Tilt => profile.start.pitch_deg = 90.0 + value,
        Quantity::Rate => profile.start.pitch_rate_deg_s = value,
        Quantity::LateralSpeed => profile.start.w_m_s = value,
        Quantity::ThrustScale => *thrust_scale = value,
        // Not among those that are possible.
        Quantity::IgnitionHeight | Quantity::Wind => {}
    }
}

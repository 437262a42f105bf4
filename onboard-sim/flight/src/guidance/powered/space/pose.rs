//! Poses the landing of a tick for the solver.

use alloc::vec::Vec;

use nmpc::free_time::Motor;
use nmpc::space::{Drag, End, Push, SpaceProblem, State, Weights};

use super::SpaceSettings;
use crate::guidance::powered::situation::Ahead;
use crate::guidance::powered::{PoweredSettings, PoweredSituation, here_m};
use crate::vehicle::rigid::RigidState;

/// The state of a landing in space.
fn initial(state: &RigidState, feet_below_cg_m: f64) -> State {
    let nose = state.nose_in_world();
    let p = libm::asin(nose.x.clamp(-1.0, 1.0));
    let r = libm::atan2(nose.y, nose.z);
    let moving = (state.world_from_body * state.rate_rad_s).cross(&nose);
    let (sin_r, cos_r) = libm::sincos(r);
    let cos_p = libm::cos(p).max(1e-3);
    let (position, velocity) = (&state.position_m, &state.velocity_m_s);
    [
        position.x,
        position.y,
        position.z - feet_below_cg_m,
        velocity.x,
        velocity.y,
        velocity.z,
        p,
        r,
        moving.x / cos_p,
        (moving.y * cos_r - moving.z * sin_r) / cos_p,
    ]
}

/// The landing of a tick, except what follows from its final time.
pub(super) fn posed(
    situation: &PoweredSituation<'_>,
    settings: &PoweredSettings,
    space: &SpaceSettings,
    state: &RigidState,
) -> SpaceProblem {
    let per_m = 0.5 * situation.air_density_kg_m3;
    let end = &settings.final_box;
    let initial = initial(state, situation.feet_below_cg_m);
    SpaceProblem {
        initial,
        step_s: settings.interval_s,
        pushes: Vec::new(),
        drag: Drag {
            fins: per_m * situation.fin_drag_area_m2,
            axial: per_m * situation.body_drag_area_m2,
            crossflow: per_m * situation.crossflow_area_m2,
        },
        wind_m_s: [situation.wind_m_s.x, situation.wind_m_s.y],
        gravity_m_s2: situation.gravity_m_s2,
        target_m: [0.0; 2],
        weights: Weights {
            place: settings.weights.x,
            lean: settings.weights.theta,
            rate: settings.weights.q,
            gimbal: settings.weights.delta,
            fins: space.fin_weight,
        },
        gimbal_limit_rad: settings.gimbal_deg.to_radians().min(situation.gimbal_limit_rad),
        lean_max_rad: settings.tilt_max_deg.to_radians(),
        end: End {
            vertical_m_s: [end.u_min_m_s, end.u_max_m_s],
            lateral_m_s: end.w_m_s,
            lean_rad: end.pitch_error_deg.to_radians(),
            rate_rad_s: end.pitch_rate_deg_s.to_radians(),
            settled_nodes: 1,
        },
        floor_rise_m_s: settings.floor_rise_m_s,
        guess_lean_rad: space.guess_lean_deg.to_radians(),
        // The first quarter of the turn brakes the motion sideways.
        guess_towards_rad: libm::atan2(-initial[4], -initial[3]),
        solver: settings.solver,
    }
}

/// Fills in what follows from the final time, s from now, and the number of intervals. It allocates only if there never
/// were as many.
pub(super) fn stretch(
    problem: &mut SpaceProblem,
    situation: &PoweredSituation<'_>,
    settings: &PoweredSettings,
    final_time_s: f64,
    intervals: usize,
) {
    let ahead = Ahead(situation);
    let step_s = final_time_s / intervals as f64;
    problem.step_s = step_s;
    problem.pushes.clear();
    problem.pushes.extend((0..intervals).map(|k| {
        let (from_s, to_s) = (k as f64 * step_s, (k + 1) as f64 * step_s);
        let (thrust_n, mass_kg) = (ahead.mean_thrust_n(from_s, to_s), ahead.mean_mass_kg(from_s, to_s));
        Push {
            thrust_m_s2: thrust_n / mass_kg,
            turning_rad_s2: thrust_n * situation.arm_m / situation.inertia_kg_m2,
            per_kg: 1.0 / mass_kg,
        }
    }));
    let target_m = |place_m: f64, velocity_m_s: f64| {
        if situation.lands_here {
            here_m(place_m, velocity_m_s, final_time_s)
        } else {
            settings.homing.target_m(place_m, velocity_m_s, final_time_s)
        }
    };
    let from = &problem.initial;
    problem.target_m = [target_m(from[0], from[3]), target_m(from[1], from[4])];
    problem.end.settled_nodes =
        (libm::round(settings.settled_s / step_s) as usize + 1).min(intervals / 2).max(1);
}

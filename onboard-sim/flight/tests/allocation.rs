//! After a rehearsal neither a tick of the controller nor a search for the final time allocates.
#![expect(clippy::expect_used, reason = "a missing built-in profile is a failed test")]

use flight::guidance::controller::{ControlLevel, ControllerConfig, ControllerInput, ControllerState, step};
use flight::rules::phase::Phase;
use flight::vehicle::dynamics::PlanarState;
use nmpc::free_time::{FreeTimeProblem, FreeTimeSolution, FreeTimeWorkspace, Motor, solve_free_time_into};

/// A disturbed landing with two ticks without an estimate and an abort at its end: every branch of a tick.
#[test]
fn powered_ticks_do_not_allocate() {
    let profile = vehicles::profile::builtin("paper-calibrated").expect("a built-in profile");
    let model = profile.planar_model();
    let mut controller = ControllerState::new(&ControllerConfig::from_profile(&profile));
    let mut input = ControllerInput {
        tick: 0,
        time_s: 0.0,
        phase: Phase::PadIdle,
        time_since_ignition_s: 0.0,
        state: profile.start.planar_state(),
        gimbal_applied_rad: 0.0,
        thrust_scale: 1.0,
        degraded: false,
        lands_here: false,
        deadline_missed: false,
    };
    for _ in 0..2 {
        assert!(step(&mut controller, &input).solver.converged());
    }
    input.phase = Phase::Powered;
    let mut levels = Vec::new();
    for tick in 0_u32..49 {
        input.tick = u64::from(tick);
        input.time_since_ignition_s = 0.1 * f64::from(tick);
        input.degraded = tick >= 47;
        let mut told = input;
        if matches!(tick, 30 | 31) {
            told.state.u_m_s = f64::NAN;
        }
        let mut output = None;
        let allocated = allocation_counter::measure(|| output = Some(step(&mut controller, &told)));
        assert_eq!(allocated.count_total, 0, "tick {tick}");
        let output = output.expect("a tick was run");
        levels.push(output.level);
        input.state = model.rk4_step(&input.state, input.gimbal_applied_rad, 33.3, 0.1);
        if tick % 7 == 3 {
            let kicked = input.state;
            input.state =
                PlanarState { w_m_s: kicked.w_m_s + 0.02, q_rad_s: kicked.q_rad_s - 0.01, ..kicked };
        }
        input.gimbal_applied_rad = output.gimbal_command_rad;
    }
    for level in [ControlLevel::Converged, ControlLevel::ShiftedPlan, ControlLevel::Stabiliser] {
        assert!(levels.contains(&level), "{level:?}");
    }
}

/// 37 N now, falling by 1.5 N/s, on a constant mass of 3 kg.
struct Fading;

impl Motor for Fading {
    fn mean_thrust_n(&self, from_s: f64, to_s: f64) -> f64 {
        37.0 - 0.75 * (from_s + to_s)
    }

    fn mean_mass_kg(&self, _: f64, _: f64) -> f64 {
        3.0
    }
}

#[test]
fn warm_searches_for_the_final_time_do_not_allocate() {
    let mut problem = FreeTimeProblem {
        landing: nmpc::paper::problem(nmpc::paper::start(), 0),
        intervals: 50,
        earliest_s: 0.5,
        latest_s: 6.0,
        target_drift_m_s: 0.0,
        max_solves: 8,
    };
    let mut workspace = FreeTimeWorkspace::default();
    let (mut best, mut next) = (FreeTimeSolution::default(), FreeTimeSolution::default());
    for found in [&mut best, &mut next] {
        solve_free_time_into(&problem, &Fading, None, &mut workspace, found);
    }
    assert!(best.lands(), "{}", best.solution.condition_miss);
    problem.max_solves = 3;
    let mut iterations = 0;
    for kick in [0.0, 0.02, -0.05] {
        problem.landing.initial.w_m_s += kick;
        let allocated = allocation_counter::measure(|| {
            solve_free_time_into(&problem, &Fading, Some((&best, 0.0)), &mut workspace, &mut next);
        });
        assert_eq!(allocated.count_total, 0, "{kick}");
        assert!(next.solves <= 3, "{}", next.solves);
        iterations += next.solution.iterations;
    }
    assert!(iterations > 0);
}

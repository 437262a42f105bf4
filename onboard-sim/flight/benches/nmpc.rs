//! How long the landing controller takes: the parts, cold and warm solves, and every tick of a whole landing.
//!
//! `cargo bench -p flight`. Besides divan's table, one closed-loop landing is flown many times and the wall time of
//! each of its ticks printed as median, 99th percentile and worst.
#![expect(clippy::expect_used, reason = "a bench without its built-in profile cannot run")]
#![expect(clippy::print_stdout, reason = "the table is the result")]

use std::hint::black_box;
use std::time::{Duration, Instant};

use flight::controller::{ControllerConfig, ControllerInput, ControllerOutput, ControllerState, step};
use flight::dynamics::{PlanarModel, PlanarState};
use flight::nmpc::{Problem, Solution, WarmStart, solve};
use flight::phase::Phase;
use flight::profile::Profile;

fn profile() -> Profile {
    Profile::builtin("paper-calibrated").expect("built in")
}

fn problem() -> Problem {
    let profile = profile();
    Problem::from_profile(&profile, profile.start.planar_state(), 0.0, 50, 1.0)
}

fn main() {
    divan::main();
    tick_times();
}

#[divan::bench]
fn rk4_step(bencher: divan::Bencher) {
    let profile = profile();
    let (model, state) = (PlanarModel::from_profile(&profile), profile.start.planar_state());
    bencher.bench(|| model.rk4_step(black_box(&state), black_box(0.1), 33.3, 0.1));
}

#[divan::bench]
fn stage_jacobian_and_hessian(bencher: divan::Bencher) {
    let profile = profile();
    let (model, state) = (PlanarModel::from_profile(&profile), profile.start.planar_state().to_array());
    bencher.bench(|| {
        let jacobian = model.jacobian(black_box(&state), black_box(0.1), 33.3);
        let hessian = model.weighted_hessian(black_box(&state), black_box(0.1), 33.3, &[1.0; 6]);
        (jacobian, hessian)
    });
}

#[divan::bench]
fn cold_solve(bencher: divan::Bencher) {
    let problem = problem();
    bencher.bench(|| solve(black_box(&problem), None));
}

/// The plan is already optimal: one look at the optimality conditions.
#[divan::bench]
fn warm_solve_undisturbed(bencher: divan::Bencher) {
    let (problem, warm) = after_one_sample(|_| ());
    bencher.bench(|| solve(black_box(&problem), Some(black_box(&warm))));
}

/// The state was kicked by 2 cm/s and 0.5 deg/s.
#[divan::bench]
fn warm_solve_kicked(bencher: divan::Bencher) {
    let (problem, warm) = after_one_sample(|state| {
        state.w_m_s += 0.02;
        state.q_rad_s += 0.5_f64.to_radians();
    });
    bencher.bench(|| solve(black_box(&problem), Some(black_box(&warm))));
}

fn after_one_sample(disturb: impl FnOnce(&mut PlanarState)) -> (Problem, WarmStart) {
    let first: Solution = solve(&problem(), None);
    let mut state = *first.states.get(1).expect("a solved path");
    disturb(&mut state);
    (Problem::from_profile(&profile(), state, 0.1, 49, 1.0), first.shifted(1))
}

/// Flies landings from slightly different starts and prints the times of their ticks.
fn tick_times() {
    const FLIGHTS: u32 = 40;
    let config = ControllerConfig::from_profile(&profile());
    let (mut nominal, mut dispersed, mut rehearsals) = (Vec::new(), Vec::new(), Vec::new());
    for flight in 0..FLIGHTS {
        let mut start = profile().start.planar_state();
        fly(&config, start, &mut rehearsals, &mut nominal);
        // Within two sigma of `paper-dispersed`, by a fixed pattern.
        let pattern = |step: u32| f64::from((flight * step) % FLIGHTS) / f64::from(FLIGHTS) * 2.0 - 1.0;
        start.w_m_s += 0.4 * pattern(7);
        start.theta_rad += 6.0_f64.to_radians() * pattern(11);
        start.q_rad_s += 4.0_f64.to_radians() * pattern(17);
        fly(&config, start, &mut rehearsals, &mut dispersed);
    }
    println!("\nwall time of controller::step, ms          median      p99    worst");
    for (name, mut times) in [
        ("first rehearsal (cold)", rehearsals),
        ("powered ticks, nominal start", nominal),
        ("powered ticks, dispersed starts", dispersed),
    ] {
        times.sort();
        let at = |fraction: f64| {
            let index = (fraction * (times.len() - 1) as f64).round() as usize;
            times.get(index).map_or(f64::NAN, |time| 1e3 * time.as_secs_f64())
        };
        println!("{name:<40} {:>8.3} {:>8.3} {:>8.3}", at(0.5), at(0.99), at(1.0));
    }
}

fn fly(
    config: &ControllerConfig,
    start: PlanarState,
    rehearsals: &mut Vec<Duration>,
    ticks: &mut Vec<Duration>,
) {
    let profile = config.profile();
    let model = PlanarModel::from_profile(profile);
    let mut controller = ControllerState::new(config);
    let mut input = ControllerInput {
        tick: 0,
        time_s: 0.0,
        phase: Phase::PadIdle,
        time_since_ignition_s: 0.0,
        state: profile.start.planar_state(),
        gimbal_applied_rad: 0.0,
        thrust_scale: 1.0,
        degraded: false,
        deadline_missed: false,
    };
    rehearsals.push(timed(&mut controller, &input).1);
    input.phase = Phase::Powered;
    input.state = start;
    for tick in 0_u32..49 {
        input.tick = u64::from(tick);
        input.time_since_ignition_s = f64::from(tick) * config.sample_time_s();
        let (output, time) = timed(&mut controller, &input);
        ticks.push(time);
        for _ in 0..100 {
            input.state =
                model.rk4_step(&input.state, input.gimbal_applied_rad, profile.motor.thrust_n, 1e-3);
        }
        input.gimbal_applied_rad = output.gimbal_command_rad;
    }
}

#[expect(clippy::disallowed_methods, reason = "a bench reads the clock; the crate under test does not")]
fn timed(controller: &mut ControllerState, input: &ControllerInput) -> (ControllerOutput, Duration) {
    let before = Instant::now();
    let output = step(controller, black_box(input));
    (output, before.elapsed())
}

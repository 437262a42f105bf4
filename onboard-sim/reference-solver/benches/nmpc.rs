//! Times the solver: its layers, cold and warm solves, and every solve of a whole landing.
//!
//! `cargo bench -p reference-solver` prints divan's table and two more results. It compares the interior-point method
//! with the reference solver on the landing paper's problem (each case is the best of several runs; the result is the
//! ratio of geometric means). And it flies one closed-loop landing many times and prints the wall time of each of its
//! solves as median, 99th percentile and worst.
#![expect(clippy::expect_used, reason = "a bench without a solved path cannot run")]
#![expect(clippy::print_stdout, reason = "the table is the result")]

use std::hint::black_box;
use std::time::{Duration, Instant};

use nmpc::dynamics::PlanarState;
use nmpc::paper::{HORIZON, SAMPLE_S, THRUST_N, model, problem as papers_own, settled, start};
use nmpc::{Problem, Solution, SolveStatus, WarmStart, Workspace, solve, solve_into};

fn problem() -> Problem {
    settled(start(), HORIZON)
}

fn main() {
    divan::main();
    against_the_reference();
    solve_times();
}

#[divan::bench]
fn rk4_step(bencher: divan::Bencher) {
    let (model, state) = (model(), start());
    bencher.bench(|| model.rk4_step(black_box(&state), black_box(0.1), 33.3, 0.1));
}

#[divan::bench]
fn stage_jacobian_and_hessian(bencher: divan::Bencher) {
    let (model, state) = (model(), start().to_array());
    bencher.bench(|| {
        let jacobian = model.jacobian(black_box(&state), black_box(0.1), 33.3);
        let hessian = model.weighted_hessian(black_box(&state), black_box(0.1), 33.3, &[1.0; 6]);
        (jacobian, hessian)
    });
}

/// Dynamics, tangents and curvature of all 50 intervals.
#[divan::bench]
fn layer_intervals(bencher: divan::Bencher) {
    let (problem, mut workspace) = loaded();
    bencher.bench_local(|| workspace.evaluate_intervals(black_box(&problem)));
}

/// One Newton step over 50 evaluated intervals.
#[divan::bench]
fn layer_sweep(bencher: divan::Bencher) {
    let (problem, mut workspace) = loaded();
    workspace.evaluate_intervals(&problem);
    bencher.bench_local(|| workspace.sweep(black_box(&problem)));
}

fn loaded() -> (Problem, Workspace) {
    let (problem, mut workspace) = (problem(), Workspace::default());
    workspace.load(&problem, &solve(&problem, None).shifted(0));
    (problem, workspace)
}

/// A cold solve from both guesses in a used workspace.
#[divan::bench]
fn cold_solve(bencher: divan::Bencher) {
    let problem = problem();
    let (mut workspace, mut solution) = (Workspace::default(), Solution::default());
    bencher.bench_local(|| solve_into(black_box(&problem), None, &mut workspace, &mut solution));
}

#[divan::bench(sample_count = 5)]
fn cold_solve_reference(bencher: divan::Bencher) {
    let problem = problem();
    bencher.bench(|| reference_solver::solve(black_box(&problem), None));
}

/// The plan is already optimal, so only the optimality conditions are evaluated.
#[divan::bench]
fn warm_solve_undisturbed(bencher: divan::Bencher) {
    let (problem, warm) = after(&problem(), 1, |_| ());
    let (mut workspace, mut solution) = (Workspace::default(), Solution::default());
    bencher.bench_local(|| solve_into(black_box(&problem), Some(&warm), &mut workspace, &mut solution));
}

#[divan::bench]
fn warm_solve_kicked(bencher: divan::Bencher) {
    let (problem, warm) = after(&problem(), 1, |state| kick(state, [1.0; 3]));
    let (mut workspace, mut solution) = (Workspace::default(), Solution::default());
    bencher.bench_local(|| solve_into(black_box(&problem), Some(&warm), &mut workspace, &mut solution));
}

#[divan::bench(sample_count = 20)]
fn warm_solve_kicked_reference(bencher: divan::Bencher) {
    let (problem, warm) = after(&problem(), 1, |state| kick(state, [1.0; 3]));
    bencher.bench(|| reference_solver::solve(black_box(&problem), Some(black_box(&warm))));
}

/// The rest of a problem after some samples of its solution, with a changed state there.
fn after(problem: &Problem, samples: usize, disturb: impl FnOnce(&mut PlanarState)) -> (Problem, WarmStart) {
    let first: Solution = solve(problem, None);
    let mut rest = problem.clone();
    rest.initial = *first.states.get(samples).expect("a solved path");
    disturb(&mut rest.initial);
    rest.thrust_n.drain(..samples);
    (rest, first.shifted(samples))
}

/// A disturbance of 2 cm/s and 0.5 deg/s, in the directions of the given signs.
fn kick(state: &mut PlanarState, [u, w, q]: [f64; 3]) {
    state.u_m_s += 0.02 * u;
    state.w_m_s += 0.02 * w;
    state.q_rad_s += 0.5_f64.to_radians() * q;
}

/// Compares the interior-point method with the reference, interleaved, on the landing paper's own problem: the seven
/// starts cold, disturbed in four directions at eight instants, and undisturbed.
fn against_the_reference() {
    let nominal = start();
    let pitched = |deg: f64| PlanarState { theta_rad: deg.to_radians(), ..nominal };
    let sideways = |w_m_s| PlanarState { w_m_s, ..nominal };
    let turning = |deg_s: f64| PlanarState { q_rad_s: deg_s.to_radians(), ..nominal };
    let starts =
        [nominal, pitched(60.0), pitched(120.0), sideways(-1.0), sideways(1.0), turning(-5.0), turning(5.0)];
    let (mut cold, mut kicked, mut undisturbed) = (Vec::new(), Vec::new(), Vec::new());
    for start in starts {
        let problem = papers_own(start, HORIZON);
        cold.push((problem.clone(), None));
        for samples in (1..49).step_by(6) {
            for signs in [[1.0, 1.0, 1.0], [-1.0, 1.0, 1.0], [1.0, -1.0, 1.0], [-1.0, -1.0, -1.0]] {
                let (rest, warm) = after(&problem, samples, |state| kick(state, signs));
                if solve(&rest, Some(&warm)).status == SolveStatus::Converged {
                    kicked.push((rest, Some(warm)));
                }
            }
            let (rest, warm) = after(&problem, samples, |_| ());
            undisturbed.push((rest, Some(warm)));
        }
    }
    println!(
        "\nsolves, us            {:>44} {:>30}",
        "interior: geomean  median    p99     max", "reference: geomean   ratio"
    );
    for (name, cases, repeats) in [("cold", cold, 1), ("kicked", kicked, 1), ("undisturbed", undisturbed, 3)]
    {
        let (mut workspace, mut solution) = (Workspace::default(), Solution::default());
        let (mut fast, mut slow, mut factorised) = (Vec::new(), Vec::new(), 0);
        for (problem, warm) in &cases {
            let of_several = |times: Vec<Duration>| times.into_iter().min().map_or(f64::NAN, micros);
            let mut solve_fast =
                || solve_into(black_box(problem), warm.as_ref(), &mut workspace, &mut solution);
            fast.push(of_several((0..50).map(|_| time_of(&mut solve_fast).1).collect()));
            slow.push(of_several(
                (0..repeats)
                    .map(|_| time_of(|| reference_solver::solve(black_box(problem), warm.as_ref())).1)
                    .collect(),
            ));
            factorised += solution.qp_iterations;
        }
        let geomean = |times: &[f64]| {
            libm::exp(times.iter().map(|time| libm::log(*time)).sum::<f64>() / times.len() as f64)
        };
        let (ours, theirs) = (geomean(&fast), geomean(&slow));
        fast.sort_by(f64::total_cmp);
        let at = |share: f64| {
            fast.get((share * (fast.len() - 1) as f64).round() as usize).copied().unwrap_or(f64::NAN)
        };
        println!(
            "{name:<12} {:>4} cases, {:>5.1} factorisations {ours:>8.1} {:>8.1} {:>8.1} {:>8.1} {theirs:>22.1} {:>8.1}",
            cases.len(),
            f64::from(factorised) / cases.len() as f64,
            at(0.5),
            at(0.99),
            at(1.0),
            theirs / ours,
        );
    }
}

fn micros(time: Duration) -> f64 {
    1e6 * time.as_secs_f64()
}

/// Flies landings from slightly different starts and prints the times of their solves.
fn solve_times() {
    const FLIGHTS: u32 = 40;
    let (mut nominal, mut dispersed, mut cold) = (Vec::new(), Vec::new(), Vec::new());
    for flight in 0..FLIGHTS {
        fly(start(), &mut cold, &mut nominal);
        // A fixed pattern within two sigma of 0.2 m/s, 3 deg and 2 deg/s.
        let pattern = |step: u32| f64::from((flight * step) % FLIGHTS) / f64::from(FLIGHTS) * 2.0 - 1.0;
        let mut start = start();
        start.w_m_s += 0.4 * pattern(7);
        start.theta_rad += 6.0_f64.to_radians() * pattern(11);
        start.q_rad_s += 4.0_f64.to_radians() * pattern(17);
        fly(start, &mut cold, &mut dispersed);
    }
    println!("\nwall time of a solve in the closed loop, ms   median      p99    worst");
    for (name, mut times) in
        [("first (cold)", cold), ("later, nominal start", nominal), ("later, dispersed starts", dispersed)]
    {
        times.sort();
        let at = |fraction: f64| {
            let index = (fraction * (times.len() - 1) as f64).round() as usize;
            times.get(index).map_or(f64::NAN, |time| 1e3 * time.as_secs_f64())
        };
        println!("{name:<40} {:>8.3} {:>8.3} {:>8.3}", at(0.5), at(0.99), at(1.0));
    }
}

/// Solves once a sample, one sample ahead, and flies a hundred times finer.
fn fly(mut state: PlanarState, cold: &mut Vec<Duration>, later: &mut Vec<Duration>) {
    let (mut workspace, mut solution) = (Workspace::default(), Solution::default());
    let mut gimbal_rad = 0.0;
    for sample in 1..HORIZON {
        let problem = settled(model().rk4_step(&state, gimbal_rad, THRUST_N, SAMPLE_S), HORIZON - sample);
        let warm = (sample > 1).then(|| solution.shifted(1));
        let solved = || solve_into(black_box(&problem), warm.as_ref(), &mut workspace, &mut solution);
        let times = if sample == 1 { &mut *cold } else { &mut *later };
        times.push(time_of(solved).1);
        for _ in 0..100 {
            state = model().rk4_step(&state, gimbal_rad, THRUST_N, 0.01 * SAMPLE_S);
        }
        gimbal_rad = solution.inputs_rad.first().copied().expect("an input");
    }
}

#[expect(clippy::disallowed_methods, reason = "a bench reads the clock; the crate under test does not")]
fn time_of<T>(work: impl FnOnce() -> T) -> (T, Duration) {
    let before = Instant::now();
    let result = work();
    (result, before.elapsed())
}

use super::*;
use nmpc::SolverLimits;
use nmpc::paper;
use nmpc::space::{Drag, End, Push, SpaceWorkspace, Weights};

const GRAVITY_M_S2: f64 = 9.806_65;

/// A stage of 1.2 kg that falls at 12.5 m/s in a light wind. Its thrust falls to its weight in 3.8 s.
fn problem(thrust_over_weight: f64) -> SpaceProblem {
    const INTERVALS: usize = 38;
    let pushes = (0..INTERVALS).map(|k| {
        let share = k as f64 / INTERVALS as f64;
        let thrust_m_s2 = GRAVITY_M_S2 * (thrust_over_weight - (thrust_over_weight - 1.0) * share * share);
        Push { thrust_m_s2, turning_rad_s2: 6.0 * thrust_m_s2, per_kg: 1.0 / 1.2 }
    });
    SpaceProblem {
        initial: [0.3, 0.0, 17.6, -0.4, -0.5, -12.5, -0.05, 0.03, 0.0, 0.0],
        step_s: 0.1,
        pushes: pushes.collect(),
        drag: Drag { fins: 0.05, axial: 0.003, crossflow: 0.04 },
        wind_m_s: [2.0, 0.5],
        gravity_m_s2: GRAVITY_M_S2,
        target_m: [0.0, 0.0],
        weights: Weights { place: 1.0, lean: 1000.0, rate: 0.0, gimbal: 20_000.0, fins: 20.0 },
        gimbal_limit_rad: 4.5_f64.to_radians(),
        lean_max_rad: 50.0_f64.to_radians(),
        end: End {
            vertical_m_s: [-0.3, -0.05],
            lateral_m_s: 0.06,
            lean_rad: 1.0_f64.to_radians(),
            rate_rad_s: 1.0_f64.to_radians(),
            settled_nodes: 3,
        },
        floor_rise_m_s: 0.4,
        guess_lean_rad: 0.5,
        guess_towards_rad: 0.6,
        solver: SolverLimits { max_iterations: 200, ..paper::problem(paper::start(), 1).solver },
    }
}

#[test]
fn explore() {
    for tw in [1.4, 1.6, 1.8, 2.0] {
        let model = problem(tw);
        let mut workspace = SpaceWorkspace::default();
        let outcome = nmpc::space::solve(&mut workspace, &model, None);
        let flown = score(&model, workspace.states(), workspace.inputs());
        println!("{tw}: {outcome:?}\n {flown:?}");
        let search = Search::of(&model);
        for t in TURNS {
            let t0 = std::time::Instant::now();
            let e = search.descend(search.guess(t));
            println!("{t}: {} {} {:?} {:?}", e.converged, e.iterations, scored(&model, &search.ranges, &e.nodes), t0.elapsed());
        }
        let e = search.descend(nodes(&model, workspace.states(), workspace.inputs()).unwrap());
        println!("flown: {} {} {:?}", e.converged, e.iterations, scored(&model, &search.ranges, &e.nodes));
    }
}

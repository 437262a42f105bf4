use super::*;
use crate::profile::Profile;

/// The seven starts of the landing paper, section 3.3.2.
fn starts() -> [(&'static str, PlanarState); 7] {
    let nominal = Profile::builtin("paper-calibrated").unwrap().start.planar_state();
    let pitched = |deg: f64| PlanarState { theta_rad: deg.to_radians(), ..nominal };
    let sideways = |w_m_s| PlanarState { w_m_s, ..nominal };
    let turning = |deg_s: f64| PlanarState { q_rad_s: deg_s.to_radians(), ..nominal };
    [
        ("nominal", nominal),
        ("theta0 = 60 deg", pitched(60.0)),
        ("theta0 = 120 deg", pitched(120.0)),
        ("w0 = -1 m/s", sideways(-1.0)),
        ("w0 = +1 m/s", sideways(1.0)),
        ("q0 = -5 deg/s", turning(-5.0)),
        ("q0 = +5 deg/s", turning(5.0)),
    ]
}

#[test]
fn explore() {
    let mut profile = Profile::builtin("paper-calibrated").unwrap();
    let end = crate::profile::FinalBox { settled_nodes: 3, pitch_error_deg: 1.0, u_min_m_s: -0.3, u_max_m_s: -0.05, w_m_s: 0.03, pitch_rate_deg_s: 0.5 };
    for (floor, fin) in [(None, None), (None, Some(end)), (Some(0.0), Some(end))] {
    profile.nmpc.limits.altitude_min_m = floor;
    profile.nmpc.limits.final_box = fin;
    for (name, start) in starts() {
        let problem = Problem::from_profile(&profile, start, 0.0, 50, 1.0);
        for a in [0.3, -0.3] {
        let solution = sqp::solve_from(&problem, &WarmStart { inputs_rad: guess::bent(&problem, a), ..Default::default() });
        let end = solution.states.last().unwrap();
        println!("{floor:?} {} {name} {a}: {:?} J={:.4} it={} qp={} stat={:.1e} feas={:.1e} miss={:.1e} nu={:.2} mult={:.1?} end u={:.4} w={:.4} th={:.3} q={:.3} x={:.3} z={:.1e}",
            fin.is_some(), solution.status, solution.cost, solution.iterations, solution.qp_iterations, solution.kkt_stationarity, solution.kkt_feasibility, solution.condition_miss,
            solution.terminal_multiplier(), solution.end_multipliers, end.u_m_s, end.w_m_s, end.theta_rad.to_degrees(), end.q_rad_s.to_degrees(), end.x_m, end.z_m);
        if a > 0.0 { println!("   z,zdot,tilt: {}", solution.states.iter().map(|s| format!("({:.4} {:.3} {:.2})", s.z_m, s.ground_velocity_m_s().1, s.theta_rad.to_degrees()-90.0)).collect::<Vec<_>>().join(" ")); println!("   u {:?}", solution.inputs_rad.iter().map(|m| (m*1000.0).round()/1000.0).collect::<Vec<_>>()); }
        }
    }
    }
}

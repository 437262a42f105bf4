//! The estimator on the modelled sensors: consistent, good enough to land by, and steady when sensors fail.
#![expect(clippy::expect_used, reason = "a test says what it expected")]

mod flight;

use self::flight::{Frame, Scene};

#[test]
fn report() {
    let n = 400;
    let flights: Vec<Vec<Frame>> = (0..n).map(|seed| Scene::of(seed).fly()).collect();
    for k in (0..).step_by(100) {
        let at: Vec<&Frame> = flights.iter().filter_map(|f| f.get(k)).collect();
        if at.len() < n as usize {
            break;
        }
        row(&at);
    }
    let last: Vec<&Frame> = flights.iter().filter_map(|f| f.last()).collect();
    row(&last);
    let g = &flights[0].last().unwrap();
    println!("{g:?}");
}

fn row(at: &[&Frame]) {
    let rms =
        |of: &dyn Fn(&Frame) -> f64| (at.iter().map(|f| of(f).powi(2)).sum::<f64>() / at.len() as f64).sqrt();
    let f0 = at[0];
    let e = |f: &Frame| f.estimate.state;
    println!(
        "t {:5.2} z {:6.1} v {:6.1} tilt {:4.1} burn {} nees {:6.2} px {:.3}/{:.3} pz {:.3}/{:.3} vx {:.3}/{:.3} vz {:.3}/{:.3} tx {:.3}/{:.3} tz {:.2}/{:.2} wind {:.2}/{:.2} hin {:.3}/{:.3} dis {:.2} good {}",
        f0.time_s,
        f0.truth.position_m.z,
        f0.truth.velocity_m_s.z,
        f0.truth.tilt_rad().to_degrees(),
        f0.burning,
        at.iter().map(|f| f.nees).sum::<f64>() / at.len() as f64,
        rms(&|f| e(f).position_m.x - f.truth.position_m.x),
        f0.estimate.sigmas.position_m.x,
        rms(&|f| e(f).position_m.z - f.truth.position_m.z),
        f0.estimate.sigmas.position_m.z,
        rms(&|f| e(f).velocity_m_s.x - f.truth.velocity_m_s.x),
        f0.estimate.sigmas.velocity_m_s.x,
        rms(&|f| e(f).velocity_m_s.z - f.truth.velocity_m_s.z),
        f0.estimate.sigmas.velocity_m_s.z,
        rms(&|f| (f.truth.world_from_body * e(f).world_from_body.inverse()).scaled_axis().x.to_degrees()),
        f0.estimate.sigmas.attitude_rad.x.to_degrees(),
        rms(&|f| (f.truth.world_from_body * e(f).world_from_body.inverse()).scaled_axis().z.to_degrees()),
        f0.estimate.sigmas.attitude_rad.z.to_degrees(),
        rms(&|f| (f.estimate.wind_m_s - f.wind_m_s).x),
        f0.estimate.sigmas.wind_m_s.x,
        rms(&|f| f.estimate.heights.inertial_m - f.truth.position_m.z),
        f0.estimate.heights.inertial_sigma_m,
        rms(&|f| f.estimate.heights.disagreement_m().unwrap_or(f64::NAN)),
        at.iter().filter(|f| f.estimate.health.is_good()).count(),
    );
}

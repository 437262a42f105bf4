//! Compares the planned paths, recomputed from the log, with the path of the rocket.

use replay::controller::{LoggedComputer, NewPlans, path_in_world_m};

use crate::simulated::MK2;

/// Where the rocket's centre of gravity was, m.
fn place_m(sample: &protocol::log::flight_v1::TruthSample) -> [f64; 3] {
    let place = &sample.state.position_m;
    [place.x, place.y, place.z]
}

fn apart_m(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}

/// Each path begins at the estimated position of the rocket, and the last path ends at its touchdown.
#[test]
fn val_flown_paths_begin_at_the_rocket_and_the_last_ends_at_its_touchdown() {
    let recording = MK2.recording();
    let (start, frames) = recording.replayable_frames().unwrap();
    let mut pilot =
        LoggedComputer::recorded(recording.profile_toml().unwrap(), start, &recording.head.run, &[]).unwrap();
    let (mut plans, mut paths) = (NewPlans::default(), Vec::new());
    for tick in frames {
        let again = pilot.run_again(tick).unwrap();
        if let Some((states, step_s)) = plans.made(pilot.pilot(), again.output.level) {
            paths.push((tick.input.time_s, path_in_world_m(pilot.pilot(), states, step_s)));
        }
    }
    assert!(paths.len() > 20, "{}", paths.len());
    for (time_s, path_m) in &paths {
        let there = recording.world.iter().find(|sample| sample.time_s >= time_s - 1e-4).unwrap();
        let off_m = apart_m(path_m[0], place_m(there));
        assert!(path_m.len() > 2 && off_m < 2.0, "{off_m} m off at {time_s} s");
    }
    let touched = recording.world.iter().find(|sample| sample.in_contact).unwrap();
    let (_, last_m) = paths.last().unwrap();
    let missed_m = apart_m(*last_m.last().unwrap(), place_m(touched));
    assert!(missed_m < 2.0, "{missed_m} m");
}

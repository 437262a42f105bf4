//! Planning latency and solver work of a flown rocket.

use onboard_sim::statistics::quantile;
use replay::info::info;
use replay::log::Recording;
use replay::report::report;

use crate::command_line::{replay, run};
use crate::from_apogee::LANDED;
use crate::simulated::MK2;

#[test]
fn the_solve_times_of_a_flown_rocket_are_read_from_its_log() {
    let recording = MK2.recording();
    let mut times_s: Vec<f64> = recording.timings.iter().map(|timing| timing.solve_time_s).collect();
    assert!(times_s.len() > 50 && times_s.iter().all(|time_s| *time_s > 0.0), "{times_s:?}");
    // Each belongs to a recorded planning frame.
    for timing in &recording.timings {
        let place = recording.frames.binary_search_by_key(&timing.frame, |frame| frame.input.frame).unwrap();
        let input = &recording.frames[place].input;
        assert_eq!(input.time_s.to_bits(), timing.time_s.to_bits());
        assert!(recording.frames[place].output.planned);
        assert_eq!(timing.deadline_s.to_bits(), 0.1_f64.to_bits());
    }
    let found = info(&MK2.log).unwrap().frames.unwrap().latency.unwrap();
    times_s.sort_by(f64::total_cmp);
    for (found_s, share) in [(found.median_s, 0.5), (found.p99_s, 0.99), (found.max_s, 1.0)] {
        assert_eq!(Some(found_s), quantile(&times_s, share), "{share}");
    }
    let late = times_s.iter().filter(|time_s| **time_s > 0.1).count();
    assert_eq!((found.count, found.over_deadline), (times_s.len() as u64, late as u64));
}

#[test]
fn solve_times_are_printed_only_if_they_were_recorded() {
    let (_, stdout, _) = run(&mut replay("info", &MK2.log));
    let count = MK2.recording().timings.len();
    let words =
        format!("from request to use on the vehicle's clock; deadline 100 ms: 0 over it, of {count} plans\n");
    assert!(stdout.contains("planning    latency median ") && stdout.contains(&words), "{stdout}");
    let work = info(&MK2.log).unwrap().frames.unwrap().solver_work.unwrap();
    assert!(work.plans > 50 && work.median >= 1.0 && work.median <= work.max, "{work:?}");
    let words = format!(
        "solver      work median {:.0}, worst {:.0} Newton iterations, of {} plans",
        work.median, work.max, work.plans
    );
    assert!(stdout.contains(&words), "{stdout}");
    let page = report(&MK2.log).unwrap().html;
    for part in ["deadline 100 ms", "From posing a plan to taking it over"] {
        assert!(page.contains(part), "{part}");
    }

    assert_eq!(info(&LANDED.log).unwrap().frames.unwrap().latency, None);
    assert!(!report(&LANDED.log).unwrap().html.contains("From posing a plan to taking it over"));
    assert_eq!(Recording::open(&LANDED.log).unwrap().timings, []);
}

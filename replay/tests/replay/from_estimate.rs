//! Tests a flight from apogee that is flown again from its estimated position.

use flight::rules::phase::Phase;
use replay::log::Recording;
use replay::refly::{From, ReflyOptions, StartAt, refly};

use crate::command_line::{replay, run};
use crate::from_apogee::LANDED;

#[test]
fn the_vehicle_is_where_the_estimate_was() {
    let recording = Recording::open(&LANDED.log).unwrap();
    let start = StartAt::Phase(Phase::Powered);
    let at =
        |from| refly(&recording, &ReflyOptions { start: start.clone(), from, ..ReflyOptions::default() });
    let (true_one, believed) = (at(From::Truth).unwrap(), at(From::Estimate).unwrap());
    assert_eq!((believed.start.from, believed.start.frame), (From::Estimate, true_one.start.frame));
    assert_eq!(believed.reached, true_one.reached);
    // The estimate has an error of plausible size.
    let off_m =
        (believed.start.x_m - true_one.start.x_m).abs() + (believed.start.z_m - true_one.start.z_m).abs();
    assert!(off_m > 1e-6 && off_m < 5.0, "{off_m} m");
    assert!(believed.gimbal_difference_max_rad > 0.0 && believed.reflown.is_some());
    assert_eq!(true_one.gimbal_difference_max_rad.to_bits(), 0.0_f64.to_bits());
}

#[test]
fn a_start_without_an_estimate_is_refused() {
    let recording = Recording::open(&LANDED.log).unwrap();
    let last = recording.frames.last().unwrap().input.frame;
    for (frame, reason) in [(1, "estimated nothing yet"), (last, "already on the ground")] {
        let options =
            ReflyOptions { start: StartAt::Frame(frame), from: From::Estimate, ..ReflyOptions::default() };
        let refusal = refly(&recording, &options).unwrap_err().to_string();
        assert!(refusal.contains("apogee.mcap") && refusal.contains(reason), "{refusal}");
    }
    let (code, stdout, _) = run(replay("refly", &LANDED.log).args(["--from", "estimate"]));
    assert!(code == 0 && stdout.contains("recorded estimate"), "{stdout}");
}

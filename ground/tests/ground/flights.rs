//! Whole mk2 flights from the simulator, received by the ground as the radio sends them.

use std::time::Duration;

use flight::computer::LogState;
use flight::computer::crew::{Asked, Request};
use ground::model::Model;
use ground::model::dead_reckoning::{Basis, PredictedPosition, predict_position};
use ground::model::judgement::{Compliance, LEGS, Standard, TABLE_2, overall};
use ground::update::{Msg, update};
use protocol::frame::Frame;
use simulated_vehicle::endpoint::{VehicleEndpoint, step};
use simulated_vehicle::fly::{LoadedFlight, load_flight};
use simulated_vehicle::vehicle::Vehicle;

use crate::rig::settings;

/// Longer than any flight of mk2, s.
const LONGEST_S: f64 = 60.0;

/// Every frame of a flight with its time, from power-up to the end.
fn frames_of(number: u64) -> Vec<(Duration, Frame)> {
    mk2(number).0
}

/// The same, with the simulator's own judgement by Table 2.
fn mk2(number: u64) -> (Vec<(Duration, Frame)>, bool) {
    let LoadedFlight::InSpace(mut flight) = load_flight("mk2").expect("a profile of its own") else {
        panic!("from apogee")
    };
    flight.number = number;
    let mut rocket = Vehicle::in_space(&flight).expect("its motor is known");
    rocket.set_log_state(LogState { running: true, space_bytes: u64::MAX });
    rocket.set_pin_out(true);
    let mut endpoint = VehicleEndpoint::sending(rocket.standard()).starting_by_itself();
    let mut heard = Vec::new();
    let mut stands_s = 0.0;
    while rocket.time_s() < LONGEST_S && stands_s < 2.0 {
        let ready = rocket.phase().on_pad() && rocket.snapshot().checks_failed == 0;
        let own = if ready { &[Asked::Arm, Asked::Start].map(Request::of_the_programme)[..] } else { &[] };
        step(&mut endpoint, &mut rocket, own, &mut || Duration::ZERO);
        if rocket.is_over() {
            stands_s += rocket.frame_s();
        }
        let now = Duration::from_secs_f64(rocket.time_s());
        heard.extend(endpoint.poll(&rocket).into_iter().map(|outgoing| (now, outgoing.frame)));
    }
    assert!(rocket.is_over(), "still {:?}", rocket.phase());
    let strict = rocket.judged_by_table_2().expect("it came down").landed;
    (heard, strict)
}

/// The model of a ground station that has received the flight up to a time.
fn heard_until(flight: &[(Duration, Frame)], end: Duration) -> Model {
    let mut model = Model::new(settings(false, true));
    let mut tick = Duration::ZERO;
    for (at, frame) in flight.iter().take_while(|(at, _)| *at <= end) {
        while tick <= *at {
            drop(update(&mut model, Msg::Tick, tick));
            tick += Duration::from_millis(100);
        }
        drop(update(&mut model, Msg::Frame(frame.clone()), *at));
    }
    model
}

/// The distance between the vehicle and its predicted position, m.
fn missed_by_m(predicted: &PredictedPosition, flight: &Model) -> f64 {
    let motion = flight.vehicle.motion.expect("it flies").value;
    let across_m = libm::hypot(motion.x_m - predicted.x_m, motion.y_m - predicted.y_m);
    libm::hypot(across_m, motion.altitude_m - predicted.altitude_m)
}

/// The link is lost at every half second of five flights, and each prediction is compared with the later telemetry. A
/// circle that is too large would be useless, so most must be smaller than the remaining height.
#[test]
fn the_true_path_stays_inside_the_error_circle_in_19_of_20_cases() {
    let half = Duration::from_millis(500);
    let (mut inside, mut all, mut by_plan, mut useful) = (0_u32, 0_u32, 0_u32, 0_u32);
    for number in 0..5 {
        let flight = frames_of(number);
        let halves = u32::try_from(flight.last().expect("it speaks").0.as_millis() / 500).unwrap();
        let heard: Vec<(Duration, Model)> =
            (0..=halves).map(|k| (half * k, heard_until(&flight, half * k))).collect();
        for (lost_at, known) in &heard {
            for (now, later) in heard.iter().filter(|(now, _)| now > lost_at) {
                let Some(predicted) = predict_position(&known.vehicle, *now) else { continue };
                all += 1;
                inside += u32::from(missed_by_m(&predicted, later) <= predicted.error_m);
                by_plan += u32::from(predicted.basis == Basis::Plan);
                let height_m = known.vehicle.motion.map_or(0.0, |motion| motion.value.altitude_m);
                useful += u32::from(predicted.error_m < height_m);
            }
        }
    }
    println!("{inside} of {all} inside the circle, {by_plan} by a plan, {useful} smaller than the height");
    assert!(all > 1_000 && by_plan > 100, "{all} predictions, {by_plan} by a plan");
    assert!(20 * inside >= 19 * all, "{inside} of {all}");
    assert!(2 * useful > all, "{useful} of {all}");
}

/// The computed verdict by Table 2 never contradicts the simulator's judgement, which knows the true state.
#[test]
fn the_computed_verdict_never_contradicts_the_simulator() {
    let mut decided = 0;
    for number in 0..8 {
        let (flight, strict) = mk2(number);
        let heard = heard_until(&flight, flight.last().expect("it speaks").0);
        let verdict = heard.vehicle.verdict.expect("it was judged").value;
        let limits = heard.vehicle.limits.as_ref().expect("it says its limits");
        assert_eq!(Standard::of(limits), Some(LEGS), "mk2 judges by its legs");
        let computed = overall(&TABLE_2.judge(&verdict.touchdown, heard.vehicle.in_space));
        println!("flight {number}: Table 2 {strict}, computed {computed:?}");
        assert_ne!(computed, if strict { Compliance::Broken } else { Compliance::Kept }, "flight {number}");
        decided += u32::from(computed != Compliance::Unknown);
    }
    assert!(decided > 0, "nothing was decided");
}

//! A whole mk2 flight from the simulator, heard by the ground as its radio sends it.

use std::time::Duration;

use ground::model::Model;
use ground::model::judgement::{Held, LEGS, Standard, TABLE_2, together};
use ground::model::reckoning::{By, Reckoned, reckon};
use ground::update::{Msg, update};
use onboard_sim::craft::{Craft as _, LogState, Request};
use onboard_sim::endpoint::VehicleEndpoint;
use onboard_sim::fly::{LoadedFlight, load_profile};
use onboard_sim::rocket::Rocket;
use protocol::frame::Frame;

use crate::bench::settings;

/// No flight of mk2 lasts longer, s.
const LONGEST_S: f64 = 60.0;

/// Every frame of a flight with its time, from power-up until it is over.
fn frames_of(number: u64) -> Vec<(Duration, Frame)> {
    mk2(number).0
}

/// The same, and whether Table 2 was kept, by the simulator's own judgement.
fn mk2(number: u64) -> (Vec<(Duration, Frame)>, bool) {
    let LoadedFlight::FromApogee(mut flight) = load_profile("mk2").expect("a profile of its own") else {
        panic!("from apogee")
    };
    flight.number = number;
    let mut rocket = Rocket::new(&flight).expect("its motor is known");
    rocket.set_log_state(LogState { running: true, space_bytes: u64::MAX });
    rocket.pull_pin();
    let mut endpoint = VehicleEndpoint::sending(rocket.standard());
    let mut heard = Vec::new();
    let mut stands_s = 0.0;
    while rocket.time_s() < LONGEST_S && stands_s < 2.0 {
        for event in rocket.advance_frame(&mut || Duration::ZERO) {
            endpoint.on_event(&event);
        }
        if rocket.phase().on_pad() && rocket.snapshot().checks_failed == 0 {
            rocket.request(Request::Arm);
            rocket.request(Request::Start);
        }
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

/// A ground that has heard the flight up to a time.
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

/// How far the vehicle was from where it was predicted, m.
fn missed_by_m(predicted: &Reckoned, flight: &Model) -> f64 {
    let motion = flight.vehicle.motion.expect("it flies").value;
    let across_m = libm::hypot(motion.x_m - predicted.x_m, motion.y_m - predicted.y_m);
    libm::hypot(across_m, motion.altitude_m - predicted.altitude_m)
}

/// The link is lost at every half second of five flights, from apogee to the ground; the prediction is held against what
/// the vehicle said of itself later. A circle that held everything would be of no use: most are smaller than the height
/// that is left to fall.
#[test]
fn the_true_path_stays_inside_the_circle_as_often_as_it_claims() {
    let half = Duration::from_millis(500);
    let (mut inside, mut all, mut by_plan, mut useful) = (0_u32, 0_u32, 0_u32, 0_u32);
    for number in 0..5 {
        let flight = frames_of(number);
        let halves = u32::try_from(flight.last().expect("it speaks").0.as_millis() / 500).unwrap();
        let heard: Vec<(Duration, Model)> =
            (0..=halves).map(|k| (half * k, heard_until(&flight, half * k))).collect();
        for (lost_at, known) in &heard {
            for (now, later) in heard.iter().filter(|(now, _)| now > lost_at) {
                let Some(predicted) = reckon(&known.vehicle, *now) else { continue };
                all += 1;
                inside += u32::from(missed_by_m(&predicted, later) <= predicted.error_m);
                by_plan += u32::from(predicted.by == By::Plan);
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

/// What is computed of Table 2 never contradicts the judgement that knows everything.
#[test]
fn the_computed_verdict_never_contradicts_the_simulators() {
    let mut decided = 0;
    for number in 0..8 {
        let (flight, strict) = mk2(number);
        let heard = heard_until(&flight, flight.last().expect("it speaks").0);
        let verdict = heard.vehicle.verdict.expect("it was judged").value;
        let limits = heard.vehicle.limits.as_ref().expect("it says its limits");
        assert_eq!(Standard::of(limits), Some(LEGS), "mk2 judges by its legs");
        let computed = together(&TABLE_2.judge(&verdict.touchdown, heard.vehicle.in_space));
        println!("flight {number}: Table 2 {strict}, computed {computed:?}");
        assert_ne!(computed, if strict { Held::Broken } else { Held::Kept }, "flight {number}");
        decided += u32::from(computed != Held::Unknown);
    }
    assert!(decided > 0, "nothing was decided");
}

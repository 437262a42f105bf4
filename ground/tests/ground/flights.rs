//! Whole mk2 flights from the simulator, received by the ground as the radio sends them.

use std::time::Duration;

use flight::computer::LogState;
use flight::computer::crew::{CrewCommand, Request};
use ground::model::{
    Model,
    dead_reckoning::{Basis, PredictedPosition, predict_position},
};
use ground::update::{Msg, update};
use ground::view::status_lines;
use protocol::dialect::{TdChute, TdPhase};
use protocol::frame::Frame;
use sim::wire::endpoint::{VehicleEndpoint, VehicleKind, step};
use sim::wire::fly::load_flight;
use sim::wire::vehicle::Vehicle;

use crate::rig::settings;

/// Longer than any flight of mk2, s.
const LONGEST_S: f64 = 120.0;

/// Every frame of a flight with its time, from power-up to the end.
fn frames_of(number: u64) -> Vec<(Duration, Frame)> {
    mk2(number, |_| None)
}

/// The same, with what the crew asks of the vehicle in flight.
fn mk2(number: u64, asks: impl Fn(&Vehicle) -> Option<CrewCommand>) -> Vec<(Duration, Frame)> {
    let mut flight = load_flight("mk2").expect("a profile of its own");
    flight.number = number;
    let mut rocket = Vehicle::on_the_pad(&flight).expect("its motor is known");
    rocket.set_log_state(LogState { running: true, space_bytes: u64::MAX });
    rocket.set_pin_out(true);
    let mut endpoint = VehicleEndpoint::new(VehicleKind::Simulated).starting_by_itself();
    let mut heard = Vec::new();
    let mut stands_s = 0.0;
    while rocket.time_s() < LONGEST_S && stands_s < 2.0 {
        let ready = rocket.phase().on_pad() && rocket.state().checks_failed() == 0;
        let own = if ready {
            vec![CrewCommand::Arm, CrewCommand::Start]
        } else {
            asks(&rocket).into_iter().collect()
        };
        let own: Vec<Request> = own.into_iter().map(Request::of_the_programme).collect();
        step(&mut endpoint, &mut rocket, &own);
        if rocket.is_over() {
            stands_s += 0.005;
        }
        let now = Duration::from_secs_f64(rocket.time_s());
        heard.extend(endpoint.poll(&rocket.state()).into_iter().map(|outgoing| (now, outgoing.frame)));
    }
    assert!(rocket.is_over(), "still {:?}", rocket.phase());
    heard
}

/// The model of a ground station that has received the flight up to a time.
fn received_until(flight: &[(Duration, Frame)], end: Duration) -> Model {
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
    let across_m = libm::hypot(motion.x_m - predicted.spot.north_m, motion.y_m - predicted.spot.east_m);
    libm::hypot(across_m, motion.altitude_m - predicted.altitude_m)
}

/// The link is lost at every half second of five flights, and each prediction is compared with the
/// later telemetry. A circle that is too large would be useless, so most must be smaller than the
/// remaining height.
#[test]
fn the_true_path_stays_inside_the_error_circle_in_19_of_20_cases() {
    let half = Duration::from_millis(500);
    let (mut inside, mut all, mut by_plan, mut useful) = (0_u32, 0_u32, 0_u32, 0_u32);
    for number in 0..5 {
        let flight = frames_of(number);
        let halves = u32::try_from(flight.last().expect("it speaks").0.as_millis() / 500).unwrap();
        let heard: Vec<(Duration, Model)> =
            (0..=halves).map(|k| (half * k, received_until(&flight, half * k))).collect();
        for (lost_at, known) in &heard {
            for (now, later) in heard.iter().filter(|(now, _)| now > lost_at) {
                let Some(predicted) = predict_position(&known.vehicle, *now) else { continue };
                all += 1;
                inside += u32::from(missed_by_m(&predicted, later) <= predicted.spot.error_m);
                by_plan += u32::from(predicted.basis == Basis::Plan);
                let height_m = known.vehicle.motion.map_or(0.0, |motion| motion.value.altitude_m);
                useful += u32::from(predicted.spot.error_m < height_m);
            }
        }
    }
    println!("{inside} of {all} inside the circle, {by_plan} by a plan, {useful} smaller than the height");
    assert!(all > 1_000 && by_plan > 100, "{all} predictions, {by_plan} by a plan");
    assert!(20 * inside >= 19 * all, "{inside} of {all}");
    assert!(2 * useful > all, "{useful} of {all}");
}

/// Whatever the screen says of the time under the parachute has to come true, and it says it as
/// soon as the canopy carries.
#[test]
fn the_predicted_time_under_the_parachute_is_the_flown_time() {
    let mut reported = 0;
    for (number, below_m) in [(0, 1_000.0), (1, 200.0), (2, 150.0)] {
        let flight = mk2(number, |rocket| {
            let falls = rocket.phase().in_descent();
            let height_m = rocket.state().airborne().map_or(0.0, |air| air.height_m());
            (falls && height_m < below_m).then_some(CrewCommand::Abort)
        });
        let down = down_at(&flight);
        let mut carried_since = None;
        let mut model = Model::new(settings(false, true));
        for (at, frame) in flight {
            let now = at;
            drop(update(&mut model, Msg::Frame(frame), now));
            let open = model.vehicle.descent().is_some_and(|d| d.value.chute == TdChute::TD_CHUTE_OPEN);
            if !open || !model.vehicle.in_flight() || now >= down {
                continue;
            }
            carried_since.get_or_insert(now);
            let line = status_lines::next_event(&model, now, false).expect("it flies");
            let (_, rest) = line.split_once("ground in ").unwrap_or_else(|| panic!("{line}"));
            let reported_s: f64 = rest.split(' ').next().unwrap_or_default().parse().expect("seconds");
            let flown_s = down.saturating_sub(now).as_secs_f64();
            let settled = now.checked_sub(carried_since.unwrap()) > Some(Duration::from_secs(2));
            // The canopy still brakes when it begins to carry, and gusts and the estimated height
            // move the shown time.
            let share = if settled { 0.15 } else { 0.5 };
            assert!(
                (reported_s - flown_s).abs() <= share * flown_s + 1.0,
                "flight {number}, {flown_s:.1} s before the ground: {line}"
            );
            reported += 1;
        }
        assert!(carried_since.is_some(), "flight {number}: the canopy never carried");
    }
    assert!(reported > 1_000, "{reported}");
}

/// When the vehicle says that it has touched down.
fn down_at(flight: &[(Duration, Frame)]) -> Duration {
    let mut model = Model::new(settings(false, true));
    for (at, frame) in flight {
        drop(update(&mut model, Msg::Frame(frame.clone()), *at));
        if model.vehicle.phase().is_some_and(|phase| phase.value == TdPhase::TD_PHASE_TOUCHDOWN) {
            return *at;
        }
    }
    panic!("it never touched down");
}

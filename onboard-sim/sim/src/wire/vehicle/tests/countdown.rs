//! The arming checks are repeated until the igniter is energised.

use super::space::flight_of;
use super::*;
use crate::fault::{Breakage, TimedFault};
use flight::computer::FRAME_S;
use flight::rules::phase::HoldCause;
use flight::vehicle::mission::StartPoint;

fn armed(mission: &str) -> Rocket {
    let mut flight = flight_of("field", &[]);
    flight.recipe.mission = flight::vehicles::mission::builtin(mission).unwrap().unwrap();
    flight.recipe = flight.recipe.starting_at(StartPoint::Pad).unwrap();
    Rocket::of(Vehicle::on_the_pad(&flight).unwrap()).run_to(Phase::PadArmed)
}

/// Something that fails on the pad: the words that the crew reads, and how long it takes to be
/// seen, s.
struct Failure {
    happens: fn(&mut Rocket),
    words: &'static str,
    seen_s: f64,
}

fn break_down(rocket: &mut Rocket, fault: &str) {
    let fault: TimedFault = format!("{fault}@0").parse().unwrap();
    let breakage: Breakage = fault.breakage;
    rocket.vehicle.sortie.break_down(&breakage);
}

macro_rules! sensor {
    ($fault:literal, $words:literal, $seen_s:literal) => {
        Failure { happens: |rocket| break_down(rocket, $fault), words: $words, seen_s: $seen_s }
    };
}

/// A fix is missed after 1.5 s; a tilt is measured once a second, and a second with both is no
/// second at rest.
const FAILURES: &[Failure] = &[
    sensor!("accelerometer-dead", "accelerometer repeats one value", 0.2),
    sensor!("accelerometer-bias:300", "m/s2 at rest, not 9.8", 0.4),
    sensor!("gyro-bias:20", "rotation: found", 0.2),
    sensor!("barometer-out", "barometer silent for", 0.4),
    sensor!("barometer-step:-100", "barometer -100 m off", 0.2),
    sensor!("barometer-step:50", "barometer 50 m off", 0.2),
    sensor!("gnss-out", "no GNSS fix for", 1.9),
    sensor!("lidar-out", "lidar silent for", 0.4),
    Failure {
        happens: |rocket| rocket.set_log_state(LogState { running: false, space_bytes: 0 }),
        words: "log: found not running",
        seen_s: 0.2,
    },
    Failure {
        happens: |rocket| rocket.set_log_state(LogState { running: true, space_bytes: 1 << 20 }),
        words: "log space: found 1 MiB",
        seen_s: 0.2,
    },
    Failure {
        happens: |rocket| rocket.vehicle.sortie.set_battery(0.01),
        words: "battery: found",
        seen_s: 0.2,
    },
];

fn text_of(event: &VehicleEvent) -> Option<&str> {
    match event {
        VehicleEvent::Message(CrewMessage::Text { text, .. }) => Some(text),
        _ => None,
    }
}

fn seconds(rocket: &mut Rocket, seconds: f64) -> Vec<VehicleEvent> {
    (0..(seconds / FRAME_S) as u32).flat_map(|_| rocket.advance()).collect()
}

/// Each failure at each second of the countdown, and in its last moments: held within the detection
/// time, and never ignited.
#[test]
fn whatever_fails_in_the_countdown_holds_it_with_its_name_until_the_igniter_has_its_current() {
    for mission in ["mk2", "mk3"] {
        let armed = armed(mission);
        for failure in FAILURES {
            let last_s = failure.seen_s + 0.01;
            for left_s in [5.0, 4.0, 3.0, 2.0, 1.9, 1.0, 0.5].into_iter().filter(|left_s| *left_s >= last_s) {
                let mut rocket = Rocket { vehicle: armed.vehicle.clone(), unread: Vec::new() };
                rocket.request(CrewCommand::Start);
                let countdown_s = rocket.computer().countdown_s();
                seconds(&mut rocket, countdown_s - left_s);
                (failure.happens)(&mut rocket);
                let events = seconds(&mut rocket, left_s + 0.5);
                let context = format!("{mission}, {} at T-{left_s}: {events:?}", failure.words);
                assert_eq!(rocket.phase(), Phase::PadArmed, "{context}");
                let held = rocket.mode().held(rocket.time_s()).map(|(cause, _)| cause);
                assert_eq!(held, Some(HoldCause::CheckFailed), "{context}");
                // The last texts before the hold name the failure.
                let texts: Vec<_> = events.iter().filter_map(text_of).collect();
                let hold = texts.iter().position(|text| text.starts_with("HOLD: no countdown")).unwrap();
                assert!(texts[hold - 1].contains(failure.words), "{context}");
                // A start under a check that fails is refused with its name.
                let answer = rocket.request(CrewCommand::Start);
                assert!(
                    answer.reason.as_ref().is_some_and(|reason| reason.contains(failure.words)),
                    "{answer:?}"
                );
                assert_eq!(rocket.mode().countdown_end_s, None, "{context}");
            }
        }
    }
}

/// While it is only armed nothing is held; the crew is alarmed, and cannot start.
#[test]
fn whatever_fails_while_it_is_armed_is_an_alarm_and_no_start_is_accepted() {
    let armed = armed("mk3");
    for failure in FAILURES {
        let mut rocket = Rocket { vehicle: armed.vehicle.clone(), unread: Vec::new() };
        seconds(&mut rocket, 1.0);
        (failure.happens)(&mut rocket);
        let events = seconds(&mut rocket, failure.seen_s + 1.0);
        let alarmed = events.iter().any(|event| {
            matches!(event, VehicleEvent::Message(CrewMessage::Text { severity: Severity::Critical, text })
                if text.starts_with("armed, and") && text.contains(failure.words))
        });
        assert!(alarmed, "{}: {events:?}", failure.words);
        let answer = rocket.request(CrewCommand::Start);
        assert_eq!(answer.ending, Ending::NotNow, "{}", failure.words);
        assert!(answer.reason.as_ref().is_some_and(|reason| reason.contains(failure.words)), "{answer:?}");
    }
}

/// Nothing holds a countdown of a vehicle with which nothing is wrong, whatever the world is like.
#[test]
fn a_countdown_with_nothing_wrong_is_never_held() {
    for dispersion in ["none", "field", "real"] {
        for number in 0..6 {
            let mut flight = flight_of(dispersion, &[]);
            flight.number = number;
            flight.recipe = flight.recipe.starting_at(StartPoint::Pad).unwrap();
            let mut rocket = Rocket::of(Vehicle::on_the_pad(&flight).unwrap());
            seconds(&mut rocket, 30.0);
            // A fin whose feedback is off by more than its tolerance is refused, as before.
            if rocket.request(CrewCommand::Arm).ending != Ending::Accepted {
                continue;
            }
            seconds(&mut rocket, 60.0);
            assert_eq!(rocket.request(CrewCommand::Start).ending, Ending::Accepted, "{dispersion} {number}");
            let countdown_s = rocket.computer().countdown_s();
            let events = seconds(&mut rocket, countdown_s + 0.1);
            assert_eq!(rocket.phase(), Phase::Boost, "{dispersion} {number}: {events:?}");
        }
    }
}

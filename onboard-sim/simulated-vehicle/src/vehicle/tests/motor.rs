//! After the flight: what is said of the motor, and when the rocket is SAFED.

use flight::rules::phase::MotorStatus;

use super::space::{flight_of, in_phase};
use super::*;

/// Flown to its end.
fn flown(flight: &RocketFlight) -> (Told, Vec<VehicleEvent>) {
    let mut rocket = in_phase(flight, Phase::Deploy);
    let events = rocket.run_until(Vehicle::is_over);
    (rocket, events)
}

fn wait(rocket: &mut Told, duration_s: f64) -> Vec<VehicleEvent> {
    let end_s = rocket.time_s() + duration_s;
    let mut events = Vec::new();
    while rocket.time_s() < end_s {
        events.extend(rocket.advance());
        assert!(rocket.records(false).is_empty(), "nothing is flown any more");
    }
    events
}

#[test]
fn a_burnt_motor_is_hot_and_then_the_rocket_is_safed() {
    let (mut rocket, events) = flown(&flight_of("field", &[]));
    assert!(said(&events, "burn-out: motor hot for 60 s"), "{events:?}");
    let landed = rocket.snapshot();
    assert_eq!((landed.phase, landed.motor), (Phase::Touchdown, MotorStatus::Hot));
    let wait_s = landed.approach_wait_s.unwrap();
    assert!((45.0..=60.0).contains(&wait_s), "{wait_s}");
    let stood_s = rocket.time_s() - rocket.judged().unwrap().impact.time_s;
    assert!((1.0..5.0).contains(&stood_s), "the flight is over {stood_s} s after the touchdown");
    wait(&mut rocket, wait_s - 0.1);
    assert_eq!(rocket.phase(), Phase::Touchdown);
    let events = wait(&mut rocket, 0.2);
    assert_eq!(phases(&events), [Phase::Safed]);
    assert!(said(&events, "burnt out and cooled"), "{events:?}");
    assert_eq!((rocket.snapshot().motor, rocket.is_over()), (MotorStatus::Burnt, true));
}

#[test]
fn a_motor_that_was_not_lit_or_did_not_light_is_live_until_its_pin_is_back() {
    for faults in [&["abort@descent+1"][..], &["no-light@apogee"]] {
        let (mut rocket, events) = flown(&flight_of("none", faults));
        assert!(said(&events, "LIVE MOTOR: do not approach for 60 s"), "{faults:?}: {events:?}");
        let landed = rocket.snapshot();
        assert_eq!((landed.phase, landed.motor), (Phase::Touchdown, MotorStatus::Live), "{faults:?}");
        assert!((50.0..60.0).contains(&landed.approach_wait_s.unwrap()), "{faults:?}");
        // Too soon: its time has to pass all the same.
        rocket.set_pin_out(false);
        wait(&mut rocket, 20.0);
        assert_eq!((rocket.phase(), rocket.snapshot().motor), (Phase::Touchdown, MotorStatus::PinIn));
        rocket.set_pin_out(true);
        assert!(said(&wait(&mut rocket, 200.0), "LIVE MOTOR: the wait is over"));
        assert_eq!((rocket.phase(), rocket.snapshot().motor), (Phase::Touchdown, MotorStatus::Live));
        rocket.set_pin_out(false);
        assert_eq!(phases(&wait(&mut rocket, 0.1)), [Phase::Safed]);
    }
}

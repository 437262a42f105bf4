//! An abort in every phase that the flight passes.

use super::*;
use crate::craft::{AbortEffect, Chute};

#[test]
fn an_abort_on_the_pad_disarms_latches_and_lets_nothing_go() {
    let flight = flight_of("none", &[]);
    for phase in [Phase::PadIdle, Phase::PadArmed] {
        let mut rocket = in_phase(&flight, phase);
        rocket.request(Request::Start);
        assert_eq!(rocket.snapshot().abort_effect, AbortEffect::SafeOnPad);
        assert_eq!(rocket.request(Request::Abort).result, Result::Accepted);
        let after = rocket.snapshot();
        assert!(!after.interlocks.armed && after.interlocks.landing_motor_inhibited);
        assert_eq!((after.pad_wait_s, after.abort_effect), (Some(60.0), AbortEffect::None));
        for _ in 0..2_000 {
            rocket.advance_frame(&mut still());
        }
        assert_eq!(rocket.phase(), Phase::PadIdle);
        assert!(rocket.air.is_none() && rocket.is_over());
        assert_ne!(rocket.request(Request::Arm).result, Result::Accepted);
    }
}

#[test]
fn an_abort_with_room_left_opens_the_parachute_and_lights_nothing() {
    let flight = flight_of("field", &[]);
    for phase in [Phase::Deploy, Phase::AeroDescent, Phase::LandArmed] {
        let mut rocket = in_phase(&flight, phase);
        run_until(&mut rocket, |rocket| rocket.snapshot().abort_effect == AbortEffect::ChuteNow);
        assert_eq!(rocket.snapshot().descent.unwrap().chute, Chute::Stowed);
        assert_eq!(rocket.request(Request::Abort).result, Result::Accepted);
        let events = run_until(&mut rocket, Rocket::is_over);
        assert_eq!(phases(&events), [Phase::Chute, Phase::Touchdown]);
        assert!(said(&events, "parachute deployed") && said(&events, "landing motor inhibited"));
        assert!(rocket.aborted());
        let judged = rocket.judged().unwrap();
        assert!(!judged.landed, "under the parachute it is not a landing");
        assert!(judged.impact.state.u_m_s.abs() < 10.0, "{judged:?}");
        assert_eq!(rocket.snapshot().descent.unwrap().chute, Chute::Open);
    }
}

#[test]
fn an_abort_too_low_for_the_parachute_burns_or_inhibits() {
    let flight = flight_of("none", &[]);
    let mut rocket = in_phase(&flight, Phase::LandArmed);
    run_until(&mut rocket, |rocket| rocket.snapshot().abort_effect == AbortEffect::BurnOrInhibit);
    assert_eq!(rocket.phase(), Phase::LandArmed);
    assert_eq!(rocket.request(Request::Abort).result, Result::Accepted);
    let events = run_until(&mut rocket, Rocket::is_over);
    assert!(!phases(&events).contains(&Phase::Chute));
    let lit = phases(&events).contains(&Phase::Ignition);
    assert_eq!(said(&events, "vehicle will be lost"), !lit, "{events:?}");
    assert!(rocket.aborted());
}

#[test]
fn an_abort_under_thrust_holds_upright_and_never_opens_a_parachute() {
    let flight = flight_of("none", &[]);
    for phase in [Phase::Ignition, Phase::Powered] {
        let mut rocket = in_phase(&flight, phase);
        assert_eq!(rocket.snapshot().abort_effect, AbortEffect::UprightOnly);
        assert_eq!(rocket.request(Request::Abort).result, Result::Accepted);
        let events = run_until(&mut rocket, Rocket::is_over);
        assert!(said(&events, "no cut-off exists"));
        assert!(!phases(&events).contains(&Phase::Chute));
        assert!(said(&events, "controller level"), "{events:?}");
    }
}

#[test]
fn on_the_ground_there_is_nothing_to_abort_and_in_the_air_nothing_to_arm() {
    let flight = flight_of("none", &[]);
    let mut rocket = in_phase(&flight, Phase::AeroDescent);
    for request in [Request::Arm, Request::Disarm, Request::Start] {
        let answer = rocket.request(request);
        assert_eq!(answer.result, Result::Denied, "{request:?}");
        assert!(answer.reason.unwrap().contains("AERO_DESCENT"));
    }
    run_until(&mut rocket, |rocket| rocket.phase() == Phase::Touchdown);
    assert_eq!(rocket.snapshot().abort_effect, AbortEffect::None);
    let answer = rocket.request(Request::Abort);
    assert_eq!(answer.result, Result::Failed);
    assert!(answer.reason.unwrap().contains("on the ground"));
}

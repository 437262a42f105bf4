//! An abort in every phase that the flight passes.

use super::space::{flight_of, in_phase};
use super::*;
use flight::computer::AbortEffect;

#[test]
fn an_abort_on_the_pad_disarms_latches_and_lets_nothing_go() {
    let flight = flight_of("none", &[]);
    for phase in [Phase::PadIdle, Phase::PadArmed] {
        let mut rocket = in_phase(&flight, phase);
        rocket.request(Asked::Start);
        assert_eq!(rocket.snapshot().abort_effect, AbortEffect::SafeOnPad);
        assert_eq!(rocket.request(Asked::Abort).ending, Ending::Accepted);
        let after = rocket.snapshot();
        assert!(!after.interlocks.armed && after.interlocks.landing_motor_inhibited);
        assert_eq!((after.pad_wait_s, after.abort_effect), (Some(60.0), AbortEffect::None));
        for _ in 0..2_000 {
            rocket.advance();
        }
        assert_eq!(rocket.phase(), Phase::PadIdle);
        assert!(rocket.computer().released_at_s().is_none() && rocket.is_over());
        assert_ne!(rocket.request(Asked::Arm).ending, Ending::Accepted);
    }
}

#[test]
fn an_abort_with_room_left_opens_the_parachute_and_lights_nothing() {
    let flight = flight_of("field", &[]);
    for phase in [Phase::Deploy, Phase::AeroDescent, Phase::LandArmed] {
        let mut rocket = in_phase(&flight, phase);
        rocket.run_until(|rocket| rocket.snapshot().abort_effect == AbortEffect::ChuteNow);
        assert_eq!(rocket.snapshot().descent.unwrap().chute, Chute::Stowed);
        assert_eq!(rocket.request(Asked::Abort).ending, Ending::Accepted);
        let events = rocket.run_until(Vehicle::is_over);
        assert_eq!(phases(&events), [Phase::Chute, Phase::Touchdown]);
        assert!(said(&events, "parachute deployed") && said(&events, "landing motor inhibited"));
        assert!(rocket.aborted());
        let judged = rocket.judged().unwrap();
        assert!(!judged.landed, "under the parachute it is not a landing");
        assert!(judged.impact.state.u_m_s.abs() < 10.0, "{judged:?}");
        assert_eq!(rocket.snapshot().descent.unwrap().chute, Chute::Open);
    }
}

/// Below the commit height: with the gate shut the parachute still fills in time, with the gate open it burns and lands.
#[test]
fn an_abort_below_the_commit_height_does_what_is_said_beside_the_key() {
    let flight = flight_of("none", &[]);
    let mut rocket = in_phase(&flight, Phase::LandArmed);
    let below_commit = |rocket: &Vehicle| {
        rocket.snapshot().descent.is_some_and(|descent| descent.height_m < descent.commit_height_m)
    };
    rocket.run_until(below_commit);
    assert_eq!(rocket.snapshot().abort_effect, AbortEffect::ChuteNow);
    assert_eq!(rocket.phase(), Phase::LandArmed);
    assert_eq!(rocket.request(Asked::Abort).ending, Ending::Accepted);
    let events = rocket.run_until(Vehicle::is_over);
    assert_eq!(phases(&events), [Phase::Chute, Phase::Touchdown]);
    assert!(!said(&events, "vehicle will be lost"), "{events:?}");
    let found_m_s = -rocket.judged().unwrap().impact.state.u_m_s;
    assert!(found_m_s < 10.0, "{found_m_s} m/s");

    let mut rocket = in_phase(&flight, Phase::LandArmed);
    rocket.run_until(|rocket| rocket.snapshot().abort_effect == AbortEffect::Burn);
    assert_eq!(rocket.phase(), Phase::LandArmed);
    assert_eq!(rocket.request(Asked::Abort).ending, Ending::Accepted);
    let events = rocket.run_until(Vehicle::is_over);
    assert_eq!(phases(&events), [Phase::Ignition, Phase::Powered, Phase::Touchdown]);
    assert!(said(&events, "landing on the ground below"), "{events:?}");
    assert!(rocket.aborted() && rocket.judged().unwrap().landed, "the verdict stands beside the abort");
}

#[test]
fn an_abort_under_thrust_lands_and_never_opens_a_parachute() {
    let flight = flight_of("none", &[]);
    for phase in [Phase::Ignition, Phase::Powered] {
        let mut rocket = in_phase(&flight, phase);
        assert_eq!(rocket.snapshot().abort_effect, AbortEffect::LandHere);
        assert_eq!(rocket.request(Asked::Abort).ending, Ending::Accepted);
        let events = rocket.run_until(Vehicle::is_over);
        assert!(said(&events, "no cut-off exists; landing on the ground below"));
        assert!(!phases(&events).contains(&Phase::Chute));
        assert!(rocket.aborted() && rocket.judged().unwrap().landed, "{:?}", rocket.judged());
    }
}

/// The motor was commanded and has not lit: nothing lands then, and nothing else is claimed.
#[test]
fn without_light_an_abort_is_a_fall() {
    let flight = flight_of("none", &["no-light@0"]);
    let mut rocket = in_phase(&flight, Phase::Ignition);
    rocket.run_until(|rocket| rocket.snapshot().interlocks.no_light_latched);
    let AbortEffect::Impact { m_s } = rocket.snapshot().abort_effect else { panic!("it does not burn") };
    assert_eq!(rocket.request(Asked::Abort).ending, Ending::Accepted);
    let events = rocket.run_until(Vehicle::is_over);
    assert!(said(&events, "the landing motor has not lit") && !said(&events, "landing on the ground"));
    let found_m_s = -rocket.judged().unwrap().impact.state.u_m_s;
    assert!((f64::from(m_s) - 2.0..=f64::from(m_s)).contains(&found_m_s), "{m_s} said, {found_m_s} found");
}

#[test]
fn on_the_ground_there_is_nothing_to_abort_and_in_the_air_nothing_to_arm() {
    let flight = flight_of("none", &[]);
    let mut rocket = in_phase(&flight, Phase::AeroDescent);
    for asked in [Asked::Arm, Asked::Disarm, Asked::Start] {
        let answer = rocket.request(asked);
        assert_eq!(answer.ending, Ending::Denied, "{asked:?}");
        assert!(answer.reason.unwrap().contains("AERO_DESCENT"));
    }
    rocket.run_until(|rocket| rocket.phase() == Phase::Touchdown);
    assert_eq!(rocket.snapshot().abort_effect, AbortEffect::None);
    let answer = rocket.request(Asked::Abort);
    assert_eq!(answer.ending, Ending::Failed);
    assert!(answer.reason.unwrap().contains("on the ground"));
}

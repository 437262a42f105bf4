//! The rocket from its rail, and from below a drone.

use super::space::{flight_of, mission_of};
use super::*;
use crate::outside::{Outside, Unwatched};
use crate::sortie::Sortie;
use crate::world::RestOutcome;
use flight::computer::{AbortEffect, FRAME_S};
use flight::rules::outputs::{Outputs, PyroOutput};
use flight::rules::phase::HoldCause;
use flight::vehicle::mission::StartPoint;
use flight::vehicles::mission::DEFAULT;

fn from(start: StartPoint, dispersion: &str, faults: &[&str]) -> Rocket {
    begun(flight_of(dispersion, faults), start)
}

fn begun(mut flight: RocketFlight, start: StartPoint) -> Rocket {
    flight.recipe = flight.recipe.starting_at(start).unwrap();
    Rocket::of(Vehicle::on_the_pad(&flight).unwrap())
}

/// Started as far as it takes, and then flown to the end.
fn flown(rocket: Rocket) -> (Rocket, Vec<VehicleEvent>) {
    let mut rocket = rocket.run_to(Phase::PadArmed);
    rocket.request(CrewCommand::Start);
    let events = rocket.run_until(Vehicle::is_over);
    (rocket, events)
}

#[test]
fn from_the_pad_it_passes_every_phase_and_lands() {
    for dispersion in ["none", "field"] {
        let (rocket, events) = flown(from(StartPoint::Pad, dispersion, &[]));
        let expected = [
            Phase::PadArmed,
            Phase::Boost,
            Phase::Coast,
            Phase::Deploy,
            Phase::AeroDescent,
            Phase::LandArmed,
            Phase::Ignition,
            Phase::Powered,
            Phase::Touchdown,
        ];
        assert_eq!(phases(&events), expected);
        for words in [
            "ascent motor commanded to light",
            "LIFT-OFF",
            "burnt out at",
            "booster commanded to separate",
            "APOGEE at",
        ] {
            assert!(has_text(&events, words), "{words}: {events:?}");
        }
        assert!(!has_text(&events, "no ascent is flown"));
        assert!(rocket.judged().unwrap().landing.stands, "{dispersion}");
        let fell_from_m = rocket.sortie.fell_from().position_m.z;
        assert!((270.0..335.0).contains(&fell_from_m), "{fell_from_m}");
    }
}

/// Display of the ascent at the station: booster and apogee, and the clock since lift-off.
#[test]
fn on_the_way_up_the_telemetry_has_booster_and_apogee() {
    let mut rocket = from(StartPoint::Pad, "none", &[]).run_to(Phase::Boost);
    rocket.run_until(|rocket| rocket.state().airborne().is_some());
    assert!(rocket.descent().booster == TdBooster::TD_BOOSTER_ATTACHED && rocket.descent().apogee_m.is_nan());
    assert_eq!(rocket.computer().abort_effect(), AbortEffect::SafeOnPad, "it has not lifted off");
    rocket.run_until(|rocket| rocket.phase() == Phase::Coast);
    assert_eq!(rocket.computer().abort_effect(), AbortEffect::ChuteAtApogee);
    let reported = rocket.descent();
    let began_s = rocket.state().since_zero_s().unwrap();
    rocket.run_until(|rocket| descent(rocket).booster == TdBooster::TD_BOOSTER_SEPARATED);
    rocket.run_until(|rocket| !rocket.phase().before_apogee());
    assert_eq!(rocket.computer().abort_effect(), AbortEffect::ChuteNow, "from the first frame on");
    let reached_m = rocket.sortie.world().state().position_m.z;
    assert!((f64::from(reported.apogee_m) - reached_m).abs() < 0.03 * reached_m, "{reported:?}, {reached_m}");
    let took_s = rocket.state().since_zero_s().unwrap() - began_s;
    assert!((f64::from(reported.time_to_apogee_s) - took_s).abs() < 0.05 * took_s, "{reported:?}, {took_s}");
    rocket.advance();
    let over = rocket.descent();
    assert!(over.apogee_m.abs() < 1e-9 && over.time_to_apogee_s.abs() < 1e-9, "{over:?}");
}

#[test]
fn an_abort_on_the_way_up_ends_under_the_parachute_at_apogee() {
    let events_until = |rocket: &mut Rocket, words: &str| {
        while !has_text(&rocket.advance(), words) {}
    };
    for words in ["LIFT-OFF", "burnt out at"] {
        let mut rocket = from(StartPoint::Pad, "field", &[]).run_to(Phase::Boost);
        events_until(&mut rocket, words);
        assert_eq!(rocket.computer().abort_effect(), AbortEffect::ChuteAtApogee);
        assert_eq!(rocket.request(CrewCommand::Abort).ending, Ending::Accepted);
        assert!(rocket.mode().interlocks.landing_motor_inhibited);
        let events = rocket.run_until(Vehicle::is_over);
        assert_eq!(phases(&events).last(), Some(&Phase::Touchdown));
        assert!(phases(&events).contains(&Phase::Chute) && !phases(&events).contains(&Phase::Ignition));
        let impact_m_s = rocket.judged().unwrap().touchdown.vertical_m_s;
        assert!(impact_m_s.abs() < 10.0, "{impact_m_s}");
    }
}

/// The igniter was energised, and the motor has not ignited: it does not ignite, and must not be
/// approached for a minute.
#[test]
fn an_abort_or_disarm_before_lift_off_switches_the_igniter_off_and_warns_of_a_hang_fire() {
    for command in [CrewCommand::Abort, CrewCommand::Disarm] {
        let mut rocket = from(StartPoint::Pad, "none", &[]).run_to(Phase::Boost);
        rocket.advance();
        assert!(rocket.computer().commands().outputs.is_on(PyroOutput::AscentIgniter));
        assert_eq!(rocket.computer().abort_effect(), AbortEffect::SafeOnPad);
        assert_eq!(rocket.request(command).ending, Ending::Accepted);
        assert_eq!(rocket.computer().commands().outputs, Outputs::NONE);
        let events = rocket.run_until(Vehicle::is_over);
        assert_eq!(phases(&events), [Phase::PadIdle]);
        assert!(has_text(&events, "the motor may still light") && has_text(&events, "keep away for 60 s"));
        let after = *rocket.mode();
        assert!(after.interlocks.abort_latched && !after.interlocks.armed);
        let pad_wait_s = after.pad_wait_remaining_s(rocket.time_s());
        assert!((58.0..60.0).contains(&pad_wait_s.unwrap()), "{pad_wait_s:?}");
        for _ in 0..1_000 {
            rocket.advance();
        }
        assert!(rocket.sortie.world().booster_thrust_n().abs() < 1e-15);
        assert_eq!(rocket.phase(), Phase::PadIdle);
    }
}

/// The motor has ignited, and no lift-off is detected yet: it rises, and descends as after any
/// abort in the ascent.
#[test]
fn an_abort_between_the_light_and_the_lift_off_ends_under_the_parachute() {
    let mut rocket = from(StartPoint::Pad, "field", &[]).run_to(Phase::Boost);
    rocket.run_until(|rocket| rocket.sortie.world().booster_thrust_n() > 0.0);
    assert_eq!(rocket.request(CrewCommand::Abort).ending, Ending::Accepted);
    assert_eq!(rocket.phase(), Phase::PadIdle);
    let events = rocket.run_until(Vehicle::is_over);
    let seen = [Phase::PadIdle, Phase::Boost, Phase::Coast, Phase::Chute, Phase::Touchdown];
    assert_eq!(phases(&events), seen);
    assert!(has_text(&events, "LIFT-OFF") && rocket.sortie.world().thrust_begins_s().is_none());
    let impact_m_s = rocket.judged().unwrap().touchdown.vertical_m_s;
    assert!(impact_m_s.abs() < 10.0, "{impact_m_s}");
}

/// Asks for something in a copy of a flight and flies it on; whether it was accepted.
fn accepted_in(flight: &Sortie, command: CrewCommand, frames: usize) -> bool {
    let mut flight = flight.clone();
    let requests = [Request::of_the_programme(command)];
    let outside = Outside { requests: &requests, ..Outside::NOBODY };
    let answered = flight.step_with(&outside, &mut Unwatched).unwrap();
    let accepted = answered.answers[0].ending == Ending::Accepted;
    let ignited = flight.world().booster_thrust_n() > 0.0;
    let mut outputs = answered.commands.outputs;
    for _ in 0..=frames {
        let lands_in_place = flight.computer().mode().interlocks.lands_in_place;
        let stopped = accepted && !(lands_in_place && command == CrewCommand::Abort);
        assert!(!(stopped && outputs.lights()), "{command:?} at {:?}: {outputs:?}", flight.computer().mode());
        outputs = flight.step().unwrap().commands.outputs;
    }
    // A motor that had not ignited does not ignite.
    let lights = flight.world().booster_thrust_n() > 0.0;
    assert!(!accepted || ignited || !lights, "{command:?}: the motor ignited later");
    accepted
}

/// The bar: an abort, a disarm and a hold in every frame from ten seconds before the release to
/// three after it.
#[test]
fn after_an_abort_a_disarm_or_a_hold_at_any_moment_no_igniter_is_on_but_for_a_burn_too_low_for_the_parachute()
{
    for start in [StartPoint::Pad, StartPoint::Drone] {
        let mut rocket = from(start, "field", &[]).run_to(Phase::PadArmed);
        rocket.request(CrewCommand::Start);
        let release_s = rocket.computer().mode().countdown_end_s.unwrap();
        let mut flight = rocket.vehicle.sortie.clone();
        let mut energised = 0;
        for frame in 0..2_600 {
            let mode = *flight.computer().mode();
            let risen = flight.computer().flown().is_some() && !mode.phase.on_pad();
            // The igniter is observed for the longest possible ignition delay.
            let looking = risen && flight.computer().commands().outputs.lights();
            let frames = if looking || frame % 200 == 0 { 600 } else { 2 };
            let held = accepted_in(&flight, CrewCommand::Hold, frames);
            assert_eq!(
                held,
                mode.may_hold_for(
                    HoldCause::Commanded,
                    start,
                    f64::from(u32::try_from(flight.frame()).unwrap() + 1) * FRAME_S
                )
            );
            let disarmed = accepted_in(&flight, CrewCommand::Disarm, frames);
            assert!(disarmed || !mode.phase.on_pad(), "{mode:?}");
            let aborted = accepted_in(&flight, CrewCommand::Abort, frames);
            assert!(aborted, "{mode:?}");
            energised += u32::from(flight.computer().commands().outputs.is_on(PyroOutput::AscentIgniter));
            flight.step();
        }
        let since_s = f64::from(u32::try_from(flight.frame()).unwrap()) * FRAME_S - release_s;
        assert!((2.9..3.1).contains(&since_s), "{since_s}");
        assert_eq!(energised > 10, start == StartPoint::Pad, "{start:?}: {energised} frames");
    }
}

#[test]
fn an_ascent_motor_that_does_not_light_leaves_an_aborted_vehicle_on_its_pad() {
    let (rocket, events) = flown(from(StartPoint::Pad, "field", &["ascent-no-light@0"]));
    assert_eq!(phases(&events), [Phase::PadArmed, Phase::Boost, Phase::PadIdle]);
    assert!(has_text(&events, "no lift-off within 3 s") && has_text(&events, "keep away for 60 s"));
    let after = *rocket.mode();
    assert!(
        after.interlocks.abort_latched && after.interlocks.landing_motor_inhibited && !after.interlocks.armed
    );
    assert!(rocket.sortie.world().booster_attached());
}

/// A vehicle with its booster can neither steer nor land: no burn, parachute at apogee.
#[test]
fn a_booster_that_does_not_separate_inhibits_the_motor_and_opens_the_parachute() {
    let (rocket, events) = flown(from(StartPoint::Pad, "field", &["separation-fails@0"]));
    assert_eq!(
        phases(&events),
        [Phase::PadArmed, Phase::Boost, Phase::Coast, Phase::Chute, Phase::Touchdown]
    );
    assert!(has_text(&events, "the booster has not separated"));
    assert!(rocket.mode().interlocks.landing_motor_inhibited);
    let world = rocket.sortie.world();
    assert!(world.booster_attached() && world.thrust_begins_s().is_none());
    let impact_m_s = world.touchdown().unwrap().over_ground.vertical_m_s;
    assert!(impact_m_s > -10.0, "{impact_m_s}");
    assert_eq!(world.rest().unwrap().outcome, RestOutcome::BodyStrike);
}

/// Early and late detections: sensor faults in the ascent must not ignite the motor early, nor miss
/// the apogee.
#[test]
fn faults_of_the_ascent_end_in_a_landing_or_under_the_parachute() {
    for fault in [
        "gnss-out@0",
        "barometer-out@0",
        "reboot:0.5@boost+0.3",
        "reboot:1@coast+2",
        "accelerometer-bias:200@coast+1",
        "accelerometer-bias:-200@coast+1",
        "ascent-weak:0.7@0",
        "ascent-weak:0.5@0",
    ] {
        let (rocket, events) = flown(from(StartPoint::Pad, "field", &[fault]));
        let seen = phases(&events);
        let rose = seen.iter().position(|phase| *phase == Phase::Coast).expect("it coasted");
        assert!(
            seen[rose + 1..].iter().any(|phase| matches!(phase, Phase::Deploy | Phase::Chute)),
            "{fault}: {seen:?}"
        );
        let impact_m_s = rocket.judged().map_or(f64::NAN, |judged| judged.touchdown.vertical_m_s);
        assert!(impact_m_s.abs() < 15.0, "{fault}: {impact_m_s} m/s, {seen:?}");
        // Apogee was detected within half a second of the true one.
        let fall_m_s = rocket.sortie.fell_from().velocity_m_s.z;
        assert!(fall_m_s.abs() < 5.0, "{fault}: {fall_m_s}");
    }
}

/// Lift-off is late, seen by the barometer alone. Pressure and satellites part the booster and show
/// the apogee; without an accelerometer no landing is tried.
#[test]
fn a_dead_accelerometer_neither_lights_the_motor_nor_loses_the_parachute() {
    let mut hard = 0;
    for (fault, seed) in ["accelerometer-dead@0", "accelerometer-dead@boost+1"]
        .into_iter()
        .flat_map(|fault| (1..=4).map(move |seed| (fault, seed)))
    {
        let mut flight = flight_of("field", &[fault]);
        flight.recipe.seed = seed;
        let (rocket, events) = flown(begun(flight, StartPoint::Pad));
        let expected =
            [Phase::PadArmed, Phase::Boost, Phase::Coast, Phase::Deploy, Phase::Chute, Phase::Touchdown];
        assert_eq!(phases(&events), expected, "{fault}, seed {seed}");
        let fall_m_s = rocket.sortie.fell_from().velocity_m_s.z;
        assert!((-8.0..2.0).contains(&fall_m_s), "{fault}, seed {seed}: {fall_m_s} m/s");
        let impact_m_s = rocket.judged().map_or(f64::NAN, |judged| judged.touchdown.vertical_m_s);
        hard += u32::from(impact_m_s.is_nan() || impact_m_s.abs() >= 15.0);
    }
    // Of 60 such flights the parachute of 1 fills too late.
    assert!(hard <= 1, "{hard}");
}

/// A self-ignited motor, in every state of the pad: an armed vehicle flies its mission, another one
/// descends under its parachute without the landing motor.
#[test]
fn an_ascent_motor_that_lights_itself_is_flown() {
    let ways: [(Phase, &[CrewCommand], Phase); 4] = [
        (Phase::PadIdle, &[], Phase::Chute),
        (Phase::PadArmed, &[], Phase::Powered),
        (Phase::PadArmed, &[CrewCommand::Start], Phase::Powered),
        (Phase::PadArmed, &[CrewCommand::Start, CrewCommand::Hold], Phase::Powered),
    ];
    for (phase, command, way_down) in ways {
        let mut rocket = from(StartPoint::Pad, "field", &[]).run_to(phase);
        for command in command {
            assert_eq!(rocket.request(*command).ending, Ending::Accepted);
        }
        rocket.advance();
        rocket.vehicle.sortie.world_mut().inject(&crate::world::Fault::AscentSelfLights);
        let events = rocket.run_until(Vehicle::is_over);
        let seen = phases(&events);
        assert!(has_text(&events, "LIFT-OFF without a countdown"), "{command:?}: {seen:?}");
        assert!(seen.contains(&way_down), "{command:?}: {seen:?}");
        let inhibited = rocket.mode().interlocks.abort_latched;
        assert_eq!(inhibited, way_down == Phase::Chute, "{command:?}");
        let impact_m_s = rocket.judged().unwrap().touchdown.vertical_m_s;
        assert!(impact_m_s.abs() < 10.0, "{command:?}: {impact_m_s}");
    }
}

#[test]
fn hanging_it_is_not_armed_too_low() {
    let mut flight = flight_of("none", &[]);
    flight.recipe = flight.recipe.starting_at(StartPoint::Drone).unwrap();
    flight.recipe.mission.drop.as_mut().unwrap().height_m = 9.0;
    let mut rocket = Rocket::of(Vehicle::on_the_pad(&flight).unwrap());
    rocket.run_until(|rocket| rocket.phase() == Phase::PadIdle && rocket.time_s() > 5.0);
    let checks = rocket.arming_checks();
    let height = checks.iter().find(|check| check.name == "height below the drone").unwrap();
    assert!(!height.passed && height.required.as_str() == "at least 10 m", "{height:?}");
    assert_eq!(rocket.request(CrewCommand::Arm).ending, Ending::NotNow);
}

/// Every uncleared release: disarmed, armed, counting down, held.
#[test]
fn released_before_it_was_cleared_it_inhibits_the_motor_and_opens_the_parachute() {
    let ways: [(Phase, &[CrewCommand]); 4] = [
        (Phase::PadIdle, &[]),
        (Phase::PadArmed, &[]),
        (Phase::PadArmed, &[CrewCommand::Start]),
        (Phase::PadArmed, &[CrewCommand::Start, CrewCommand::Hold]),
    ];
    for (phase, command) in ways {
        let mut rocket = from(StartPoint::Drone, "field", &[]).run_to(phase);
        for command in command {
            assert_eq!(rocket.request(*command).ending, Ending::Accepted);
        }
        rocket.advance();
        rocket.vehicle.sortie.world_mut().release();
        let events = rocket.run_until(Vehicle::is_over);
        assert_eq!(phases(&events), [Phase::Chute, Phase::Touchdown], "{command:?}");
        assert!(has_text(&events, "RELEASED before it was cleared"));
        assert!(rocket.mode().interlocks.landing_motor_inhibited);
        let impact_m_s = rocket.judged().unwrap().touchdown.vertical_m_s;
        assert!(impact_m_s.abs() < 10.0, "{command:?}: {impact_m_s}");
    }
}

#[test]
fn an_abort_while_it_hangs_inhibits_the_motor_and_stays_on_the_drone() {
    let mut rocket = from(StartPoint::Drone, "field", &[]).run_to(Phase::PadArmed);
    rocket.request(CrewCommand::Start);
    assert_eq!(rocket.request(CrewCommand::Abort).ending, Ending::Accepted);
    for _ in 0..2_000 {
        rocket.advance();
    }
    assert_eq!(rocket.phase(), Phase::PadIdle);
    assert!(rocket.sortie.world().hangs() && rocket.mode().interlocks.landing_motor_inhibited);
}

/// A reset of 0.1 s on the pad disarms, ends the countdown and is reported; the crew may arm and
/// start again.
#[test]
fn a_reset_on_the_pad_disarms_and_the_vehicle_flies_when_it_is_armed_again() {
    let mut rocket = from(StartPoint::Pad, "field", &["reboot:0.1@pad-armed+1"]).run_to(Phase::PadArmed);
    rocket.request(CrewCommand::Start);
    let events = rocket.run_until(|rocket| rocket.phase() == Phase::Safe);
    assert!(!has_text(&events, "LIFT-OFF"));
    let events = rocket.run_until(|rocket| rocket.phase() == Phase::PadIdle);
    assert!(has_text(&events, "the flight computer has restarted: DISARMED"), "{events:?}");
    let mode = *rocket.mode();
    assert!(!mode.interlocks.armed && mode.countdown_end_s.is_none(), "{mode:?}");
    rocket.run_until(|rocket| rocket.arming_checks().iter().all(|check| check.passed));
    rocket.request(CrewCommand::Arm);
    rocket.request(CrewCommand::Start);
    rocket.run_until(Vehicle::is_over);
    assert!(rocket.judged().is_some_and(|judged| judged.landing.stands));
}

/// In the air it flies on. Under power it holds the nose upright until its next plan. Of 100
/// flights of seed 7001 that are reset at the ignition or a second later 98 stand; all of this one
/// do.
#[test]
fn a_reset_in_every_phase_of_the_flight_is_flown_through() {
    for phase in ["boost+0.3", "coast+2", "descent+2", "armed", "ignition", "powered+1", "touchdown+0.2"] {
        let mut flight = mission_of(DEFAULT, "field", &[&format!("reboot:0.1@{phase}")]);
        flight.recipe.seed = 2;
        let (rocket, events) = flown(begun(flight, StartPoint::Pad));
        let seen = phases(&events);
        assert_eq!(
            seen[seen.len() - 7..],
            [
                Phase::Coast,
                Phase::Deploy,
                Phase::AeroDescent,
                Phase::LandArmed,
                Phase::Ignition,
                Phase::Powered,
                Phase::Touchdown
            ],
            "{phase}"
        );
        assert!(rocket.judged().is_some_and(|judged| judged.landing.stands), "{phase}");
        assert!(!has_text(&events, "DISARMED"), "{phase}");
    }
}

//! The rocket: pad, arming, the flight from apogee, reports on the motor after it, and an abort in
//! every phase.

use crate::dispersion::Dispersion;
use flight::computer::AbortEffect;
use flight::computer::pilot::FRAMES_PER_PLAN;
use flight::rules::outputs::PyroOutput;
use flight::rules::phase::MotorStatus;
use protocol::dialect::TdChute;

use super::*;
use crate::wire::fly::load_flight;

pub(super) fn flight_of(dispersion: &str, faults: &[&str]) -> RocketFlight {
    mission_of("mk2", dispersion, faults)
}

pub(super) fn mission_of(mission: &str, dispersion: &str, faults: &[&str]) -> RocketFlight {
    let mut flight = load_flight(mission).unwrap();
    flight.recipe.dispersion = Dispersion::builtin(dispersion).unwrap();
    flight.recipe.faults = faults.iter().map(|fault| fault.parse().unwrap()).collect();
    flight
}

fn rocket_of(flight: &RocketFlight) -> Rocket {
    Rocket::of(Vehicle::on_the_pad(flight).unwrap())
}

pub(super) fn in_phase(flight: &RocketFlight, phase: Phase) -> Rocket {
    rocket_of(flight).run_to(phase)
}

/// Steered with fins nearly shut, mk3 is aborted: its charge is not energised before all of them
/// are 45 degrees open. A stuck fin, and servos without feedback, delay it by the travel time of a
/// servo, and no longer.
#[test]
fn the_charge_waits_for_the_fins_over_the_hatch_and_for_no_stuck_one() {
    for (stuck, reports) in [(false, true), (true, true), (false, false)] {
        let mut flight = mission_of("mk3", "none", &[]);
        flight.recipe.mission.airframe.servos_report = reports;
        // Who cannot be armed without two pairs of eyes is armed before its servos fall silent.
        let mut rocket = rocket_of(&mission_of("mk3", "none", &[])).run_to(Phase::AeroDescent);
        rocket.vehicle.sortie.reconfigure(&flight.recipe.mission);
        let shut =
            |rocket: &Vehicle| rocket.sortie.world().fins_rad().into_iter().fold(f64::INFINITY, f64::min);
        rocket.run_until(|rocket| shut(rocket) < 0.3);
        if stuck {
            (0..4).for_each(|fin| {
                rocket.vehicle.sortie.world_mut().inject(&crate::world::Fault::FinStuck { fin });
            });
        }
        let since_s = rocket.time_s();
        assert_eq!(rocket.request(CrewCommand::Abort).ending, Ending::Accepted);
        assert_eq!(rocket.phase(), Phase::Chute);
        assert_eq!(
            rocket.computer().commands().fins_rad.map(f64::to_bits),
            [std::f64::consts::FRAC_PI_2; 4].map(f64::to_bits),
            "in the same frame"
        );
        rocket.run_until(|rocket| rocket.computer().commands().outputs.is_on(PyroOutput::Parachute));
        let waited_s = rocket.time_s() - since_s;
        // 90 degrees at 300 degrees/s, and 20 ms.
        assert!(waited_s > 0.1 && waited_s < 0.33, "{stuck} {reports}: {waited_s}");
        assert_eq!(shut(&rocket) < 0.3, stuck);
        assert!(stuck || shut(&rocket) > 0.7, "{reports}: {}", shut(&rocket));
        assert!((waited_s > 0.31) == (stuck || !reports), "{stuck} {reports}: {waited_s}");
    }
}

#[test]
fn with_a_crew_it_is_the_very_flight_that_a_campaign_flies() {
    for dispersion in ["none", "field"] {
        let flight = flight_of(dispersion, &[]);
        let mut rocket = in_phase(&flight, Phase::PadIdle);
        rocket.request(CrewCommand::Arm);
        rocket.request(CrewCommand::Start);
        let events = rocket.run_until(Vehicle::is_over);
        let flown = Sortie::new(&flight.recipe, flight.number).unwrap().run();
        let touchdown = flown.touchdown.as_ref().unwrap();
        let judged = rocket.judged().unwrap();
        assert_eq!(judged.landing, flown.landing);
        assert!(judged.landing.stands && judged.landing.envelope, "{flown:?}");
        assert_eq!(judged.touchdown.vertical_m_s.to_bits(), touchdown.over_ground.vertical_m_s.to_bits());
        let distance_m = touchdown.over_ground.distance_m;
        assert_eq!(judged.touchdown.distance_m.to_bits(), distance_m.to_bits());
        let flown_s = judged.time_s - rocket.computer().released_at_s().unwrap();
        assert!((flown_s - touchdown.time_s).abs() < 1e-9);
        let expected = [
            Phase::PadArmed,
            Phase::Deploy,
            Phase::AeroDescent,
            Phase::LandArmed,
            Phase::Ignition,
            Phase::Powered,
            Phase::Touchdown,
        ];
        assert_eq!(phases(&events), expected);
        assert!(
            has_text(&events, "no ascent is flown")
                && has_text(&events, "STANDS UNDAMAGED, inside the design envelope")
        );
        assert!(events.iter().any(|event| matches!(event, VehicleEvent::Verdict)));
        let recorded = rocket.verdict_record().unwrap();
        assert_eq!((recorded.landing.stands, recorded.envelope.len(), recorded.table_2.len()), (true, 4, 6));
    }
}

#[test]
fn the_pad_is_levelled_and_the_landing_rehearsed_before_arming() {
    let mut rocket = rocket_of(&flight_of("field", &[]));
    rocket.run_until(|rocket| rocket.phase() == Phase::PadIdle);
    let refused = rocket.request(CrewCommand::Arm);
    assert_eq!(refused.ending, Ending::NotNow);
    assert!(refused.reason.unwrap().starts_with("controller warm: found no rehearsal yet"));
    rocket.run_until(|rocket| rocket.sortie.rehearsed().is_some());
    let found = rocket.computer().stance();
    // Sensors were at work: nothing is exactly nought, and nothing is far from it.
    assert!((1e-6..0.01).contains(&found.rotation_rad_s), "{found:?}");
    assert!((1e-4..0.2).contains(&found.speed_m_s), "{found:?}");
    assert!((1e-6..0.02).contains(&found.tilt_rad), "{found:?}");
    assert_eq!(rocket.state().checks_failed(), 0, "{:?}", rocket.arming_checks());
    rocket.set_log_state(LogState { running: false, space_bytes: 0 });
    let refused = rocket.request(CrewCommand::Arm);
    assert!(refused.reason.unwrap().starts_with("log: found not running"));
    rocket.set_log_state(LogState { running: true, space_bytes: u64::MAX });
    assert_eq!(rocket.request(CrewCommand::Arm).ending, Ending::Accepted);
    assert_eq!(rocket.request(CrewCommand::Arm).ending, Ending::Accepted, "armed already");
}

#[test]
fn a_mission_that_does_not_land_is_refused_on_the_pad_in_words() {
    let mut flight = flight_of("none", &[]);
    // Far below the ignition band.
    flight.recipe.mission.start.height_m = 30.0;
    let mut rocket = rocket_of(&flight);
    let mut events = rocket.run_until(|rocket| rocket.sortie.rehearsed().is_some());
    for _ in 0..400 {
        events.extend(rocket.advance());
    }
    let complaints = events.iter().filter(|event| {
        matches!(event, VehicleEvent::Message(CrewMessage::Text { severity: Severity::Warning, text }) if text.starts_with("not ready: controller warm"))
    });
    assert_eq!(complaints.count(), 1, "said unasked, and once: {events:?}");
    assert_eq!(rocket.request(CrewCommand::Arm).ending, Ending::NotNow);
}

#[test]
fn telemetry_is_the_estimate_in_north_east_down() {
    let flight = flight_of("none", &[]);
    let mut rocket = in_phase(&flight, Phase::Powered);
    rocket.run_until(|rocket| rocket.state().planned().is_some());
    let state = rocket.state();
    let world = rocket.sortie.world();
    let (truth, motion) = (world.state(), state.motion());
    let close = |found: f64, should: f64| assert!((found - should).abs() < 1e-9, "{found}, not {should}");
    let estimated = &rocket.sortie.pilot().estimate().unwrap().state;
    close(motion.position_m[0], estimated.position_m.x);
    close(motion.position_m[1], -estimated.position_m.y);
    close(motion.velocity_m_s[2], -estimated.velocity_m_s.z);
    // The burnt mass is estimated: the centre of gravity is some tenths of a millimetre off.
    let off_m = -motion.position_m[2] - world.height_m() - (estimated.position_m.z - truth.position_m.z);
    assert!(off_m.abs() < 2e-3, "{}", motion.position_m[2]);
    // The nose, turned by the quaternion of the wire.
    let [w, x, y, z] = motion.ned_from_body;
    let nose_ned = [w * w + x * x - y * y - z * z, 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)];
    let nose = estimated.nose_in_world();
    close(nose_ned[0], nose.x);
    close(nose_ned[1], -nose.y);
    close(nose_ned[2], -nose.z);
    let descent = rocket.descent();
    assert!((f64::from(descent.vertical_speed_m_s) - estimated.velocity_m_s.z).abs() < 1e-5, "{descent:?}");
    assert!((estimated.position_m - truth.position_m).norm() < 0.1, "with sensors that are nearly exact");
    assert!(descent.time_to_ignition_s.is_nan() && !descent.band_low_m.is_nan());
    let planned = state.planned().unwrap();
    assert!(planned.path_from_the_east::<12>().1 > 2);
    let (time_to_go_s, end) = (planned.time_to_go_s, planned.end(0.0));
    assert!((0.5..6.0).contains(&time_to_go_s), "{time_to_go_s}");
    assert!(end.vertical_m_s.abs() < 1.0 && end.lateral_m_s < 1.0, "{end:?}");
}

#[test]
fn the_countdown_to_ignition_runs_down_to_it() {
    // In still air without errors: an effect of a gust or a better estimate in the last second is
    // no error of the countdown.
    let mut rocket = in_phase(&flight_of("none", &[]), Phase::LandArmed);
    let announced = rocket.descent();
    let chosen_m = announced.chosen_height_m;
    assert!(announced.band_low_m < chosen_m && chosen_m < announced.band_high_m, "{announced:?}");
    let left_s = |rocket: &Vehicle| f64::from(descent(rocket).time_to_ignition_s);
    assert!((2.0..3.1).contains(&left_s(&rocket)), "{announced:?}");
    rocket.run_until(|rocket| left_s(rocket) <= 1.0);
    let at_s = rocket.time_s() + left_s(&rocket);
    rocket.run_until(|rocket| rocket.phase() == Phase::Ignition);
    assert!((rocket.time_s() - at_s).abs() < 0.1, "{} s, announced {at_s} s", rocket.time_s());
}

#[test]
fn a_dead_flight_computer_neither_receives_nor_sends() {
    let mut rocket = in_phase(&flight_of("field", &["reboot:0.2@descent+1"]), Phase::AeroDescent);
    let mut silent = 0;
    while rocket.phase() == Phase::AeroDescent {
        rocket.advance();
        silent += u64::from(rocket.radio().silent);
        assert_eq!(rocket.radio().silent, rocket.sortie.computer_is_dead());
    }
    assert_eq!(silent, 40, "0.2 s in frames of 5 ms");
}

/// As from a board: the truth is in the log alone.
#[test]
fn the_crew_sees_the_servo_feedback() {
    let mut rocket = in_phase(&flight_of("real", &[]), Phase::Powered);
    let mut apart = 0;
    for _ in 0..200 {
        rocket.advance();
        let seen = *rocket.state().input();
        let frame = rocket.computer_frame.clone().unwrap();
        assert_eq!((seen.fins_rad.to_vec(), rocket.computer_records().len()), (frame.input.fins_rad, 1));
        assert_eq!(seen.gimbal_rad.to_vec(), frame.input.gimbal_rad);
        let bits = |angles: [f64; 4]| angles.map(f64::to_bits);
        apart += u64::from(bits(seen.fins_rad) != bits(rocket.sortie.world().fins_rad()));
    }
    assert!(apart > 100, "{apart} frames");
}

/// A plan is taken over after the computing time of a board in frames, and that time is reported by
/// radio.
#[test]
fn plans_are_late_by_what_they_cost_on_a_board() {
    let mut rocket = in_phase(&flight_of("none", &[]), Phase::Powered);
    let (mut took, mut posed) = (Vec::new(), Vec::new());
    while rocket.phase() == Phase::Powered {
        for event in rocket.advance() {
            if let VehicleEvent::Planned(PilotTiming { frame, solve_time_s: took_s, deadline_s, .. }) = event
            {
                let frames = (took_s / FRAME_S).round() as u64;
                assert_eq!(rocket.state().solve_time_s().to_bits(), took_s.to_bits());
                assert_eq!(deadline_s.to_bits(), PLAN_WITHIN_S.to_bits());
                took.push(frames);
                posed.push(frame - frames);
            }
        }
    }
    let most = took.iter().max().unwrap();
    assert!(
        took.len() > 20 && *most as f64 * FRAME_S <= PLAN_WITHIN_S && took.iter().all(|took| *took >= 2),
        "{took:?}"
    );
    let apart = posed.iter().zip(posed.iter().skip(1)).map(|(posed, next)| next - posed);
    for (apart, took) in apart.zip(&took) {
        // Not in the frame that takes the last one over.
        assert_eq!(apart, FRAMES_PER_PLAN.max(*took + 1), "{posed:?} {took}");
    }
}

// After the flight: reports on the motor, and the time of SAFED.

/// Flown to its end.
fn flown(flight: &RocketFlight) -> (Rocket, Vec<VehicleEvent>) {
    let mut rocket = in_phase(flight, Phase::Deploy);
    let events = rocket.run_until(Vehicle::is_over);
    (rocket, events)
}

fn wait(rocket: &mut Rocket, duration_s: f64) -> Vec<VehicleEvent> {
    let end_s = rocket.time_s() + duration_s;
    let mut events = Vec::new();
    while rocket.time_s() < end_s {
        events.extend(rocket.advance());
        assert!(rocket.records().is_empty(), "nothing is flown any more");
    }
    events
}

#[test]
fn a_burnt_motor_is_hot_and_then_the_rocket_is_safed() {
    let (mut rocket, events) = flown(&flight_of("field", &[]));
    assert!(has_text(&events, "burn-out: motor hot for 60 s"), "{events:?}");
    let (landed, motor) = (*rocket.mode(), rocket.mode().motor_status(rocket.time_s()));
    assert_eq!((landed.phase, motor), (Phase::Touchdown, MotorStatus::Hot));
    let wait_s = landed.approach_wait_s(rocket.time_s()).unwrap();
    assert!((45.0..=60.0).contains(&wait_s), "{wait_s}");
    let stood_s = rocket.time_s() - rocket.judged().unwrap().time_s;
    assert!((1.0..5.0).contains(&stood_s), "the flight is over {stood_s} s after the touchdown");
    wait(&mut rocket, wait_s - 0.1);
    assert_eq!(rocket.phase(), Phase::Touchdown);
    let events = wait(&mut rocket, 0.2);
    assert_eq!(phases(&events), [Phase::Safed]);
    assert!(has_text(&events, "burnt out and cooled"), "{events:?}");
    assert_eq!((rocket.mode().motor_status(rocket.time_s()), rocket.is_over()), (MotorStatus::Burnt, true));
}

#[test]
fn a_motor_not_ignited_or_with_no_light_is_live_until_its_pin_is_back() {
    for faults in [&["abort@descent+1"][..], &["no-light@apogee"]] {
        let (mut rocket, events) = flown(&flight_of("none", faults));
        assert!(has_text(&events, "LIVE MOTOR: do not approach for 60 s"), "{faults:?}: {events:?}");
        let (landed, motor) = (*rocket.mode(), rocket.mode().motor_status(rocket.time_s()));
        assert_eq!((landed.phase, motor), (Phase::Touchdown, MotorStatus::Live), "{faults:?}");
        assert!((50.0..60.0).contains(&landed.approach_wait_s(rocket.time_s()).unwrap()), "{faults:?}");
        // Too soon: its time must pass all the same.
        rocket.set_pin_out(false);
        wait(&mut rocket, 20.0);
        assert_eq!(
            (rocket.phase(), rocket.mode().motor_status(rocket.time_s())),
            (Phase::Touchdown, MotorStatus::PinIn)
        );
        rocket.set_pin_out(true);
        assert!(has_text(&wait(&mut rocket, 200.0), "LIVE MOTOR: the wait is over"));
        assert_eq!(
            (rocket.phase(), rocket.mode().motor_status(rocket.time_s())),
            (Phase::Touchdown, MotorStatus::Live)
        );
        rocket.set_pin_out(false);
        assert_eq!(phases(&wait(&mut rocket, 0.1)), [Phase::Safed]);
    }
}

// An abort in every phase that the flight passes.

#[test]
fn an_abort_with_room_left_opens_the_parachute_and_lights_nothing() {
    let flight = flight_of("field", &[]);
    for phase in [Phase::Deploy, Phase::AeroDescent, Phase::LandArmed] {
        let mut rocket = in_phase(&flight, phase);
        rocket.run_until(|rocket| rocket.computer().abort_effect() == AbortEffect::ChuteNow);
        assert_eq!(rocket.descent().chute, TdChute::TD_CHUTE_STOWED);
        assert_eq!(rocket.request(CrewCommand::Abort).ending, Ending::Accepted);
        let events = rocket.run_until(Vehicle::is_over);
        assert_eq!(phases(&events), [Phase::Chute, Phase::Touchdown]);
        assert!(has_text(&events, "parachute deployed") && has_text(&events, "landing motor inhibited"));
        assert!(rocket.aborted());
        let judged = rocket.judged().unwrap();
        assert!(!judged.landing.stands, "under the parachute it is not a landing");
        assert!(judged.touchdown.vertical_m_s.abs() < 10.0, "{judged:?}");
        assert_eq!(rocket.descent().chute, TdChute::TD_CHUTE_OPEN);
    }
}

/// Below the commit height: with ignition inhibited the parachute still fills in time, with
/// ignition permitted it burns and lands.
#[test]
fn an_abort_below_the_commit_height_has_the_effect_shown_beside_the_key() {
    let flight = flight_of("none", &[]);
    let mut rocket = in_phase(&flight, Phase::LandArmed);
    let below_commit = |rocket: &Vehicle| {
        let descent = descent(rocket);
        descent.height_m < descent.commit_height_m
    };
    rocket.run_until(below_commit);
    assert_eq!(rocket.computer().abort_effect(), AbortEffect::ChuteNow);
    assert_eq!(rocket.phase(), Phase::LandArmed);
    assert_eq!(rocket.request(CrewCommand::Abort).ending, Ending::Accepted);
    let events = rocket.run_until(Vehicle::is_over);
    assert_eq!(phases(&events), [Phase::Chute, Phase::Touchdown]);
    assert!(!has_text(&events, "vehicle will be lost"), "{events:?}");
    let found_m_s = -rocket.judged().unwrap().touchdown.vertical_m_s;
    assert!(found_m_s < 10.0, "{found_m_s} m/s");

    let mut rocket = in_phase(&flight, Phase::LandArmed);
    rocket.run_until(|rocket| rocket.computer().abort_effect() == AbortEffect::Burn);
    assert_eq!(rocket.phase(), Phase::LandArmed);
    assert_eq!(rocket.request(CrewCommand::Abort).ending, Ending::Accepted);
    let events = rocket.run_until(Vehicle::is_over);
    assert_eq!(phases(&events), [Phase::Ignition, Phase::Powered, Phase::Touchdown]);
    assert!(has_text(&events, "landing on the ground below"), "{events:?}");
    assert!(
        rocket.aborted() && rocket.judged().unwrap().landing.stands,
        "the verdict stands beside the abort"
    );
}

#[test]
fn an_abort_under_thrust_lands_and_never_opens_a_parachute() {
    let flight = flight_of("none", &[]);
    for phase in [Phase::Ignition, Phase::Powered] {
        let mut rocket = in_phase(&flight, phase);
        assert_eq!(rocket.computer().abort_effect(), AbortEffect::LandInPlace);
        assert_eq!(rocket.request(CrewCommand::Abort).ending, Ending::Accepted);
        let events = rocket.run_until(Vehicle::is_over);
        assert!(has_text(&events, "no cut-off exists; landing on the ground below"));
        assert!(!phases(&events).contains(&Phase::Chute));
        assert!(rocket.aborted() && rocket.judged().unwrap().landing.stands, "{:?}", rocket.judged());
    }
}

/// Ignition was commanded, and the motor has not ignited: no landing follows, and none is claimed.
#[test]
fn without_light_an_abort_is_a_fall() {
    let flight = flight_of("none", &["no-light@0"]);
    let mut rocket = in_phase(&flight, Phase::Ignition);
    rocket.run_until(|rocket| rocket.mode().interlocks.no_light_latched);
    let AbortEffect::Impact { m_s } = rocket.computer().abort_effect() else { panic!("it does not burn") };
    assert_eq!(rocket.request(CrewCommand::Abort).ending, Ending::Accepted);
    let events = rocket.run_until(Vehicle::is_over);
    assert!(
        has_text(&events, "the landing motor has not ignited") && !has_text(&events, "landing on the ground")
    );
    let found_m_s = -rocket.judged().unwrap().touchdown.vertical_m_s;
    assert!((f64::from(m_s) - 2.0..=f64::from(m_s)).contains(&found_m_s), "{m_s} said, {found_m_s} found");
}

//! The vehicle check on the pad: its findings, its refusals, and its end.

use crate::sortie::Sortie;
use crate::world::Fault;
use flight::computer::pad_check::{CheckState, Item, Verdict};
use flight::vehicle::mission::StartPoint;
use proptest::prelude::*;

use super::space::{flight_of, in_phase, mission_of};
use super::*;
use crate::wire::fly::load_flight;

fn on_the_pad(dispersion: &str, faults: &[&str]) -> Rocket {
    Rocket::of(Vehicle::on_the_pad(&flight_of(dispersion, faults)).unwrap()).run_to(Phase::PadIdle)
}

fn failing(rocket: &Vehicle) -> Vec<Item> {
    let findings = rocket.computer().pad_check().findings.iter();
    findings.filter(|found| found.verdict == Verdict::NotOk).map(|found| found.item).collect()
}

fn state(rocket: &Vehicle) -> CheckState {
    rocket.computer().pad_check().state
}

/// Asks for a check and waits for its end.
fn checked(rocket: &mut Rocket) -> Vec<VehicleEvent> {
    assert_eq!(rocket.request(CrewCommand::Check).ending, Ending::Accepted);
    rocket.run_until(|rocket| state(rocket) != CheckState::Running)
}

/// Gimbal and fins are commanded to rest.
fn rests(rocket: &Vehicle) -> bool {
    let commands = rocket.computer().commands();
    commands.gimbal_rad.iter().chain(&commands.fins_rad).all(|angle_rad| angle_rad.abs() < f64::MIN_POSITIVE)
}

#[test]
fn every_built_in_mission_passes_its_check() {
    for (name, _) in flight::vehicles::mission::BUILTIN {
        for dispersion in ["none", "field", "real"] {
            let mut flight = load_flight(name).unwrap();
            flight.recipe.dispersion = crate::dispersion::Dispersion::builtin(dispersion).unwrap();
            let mut rocket = Rocket::of(Vehicle::on_the_pad(&flight).unwrap());
            rocket.run_until(|rocket| rocket.phase() == Phase::PadIdle);
            let events = checked(&mut rocket);
            let findings = &rocket.computer().pad_check().findings;
            assert_eq!(state(&rocket), CheckState::Passed, "{name}, {dispersion}: {findings:#?}");
            assert!(has_text(&events, "check of the vehicle begins: gimbal and fins MOVE"));
            assert!(has_text(&events, "check passed: 3"), "{events:?}");
            assert!(rests(&rocket), "{name}");
        }
    }
}

/// Every wrong wiring of one or two surfaces: reversed ones, and swapped ones.
fn wrong_wirings() -> Vec<Fault> {
    let reversed = (0..6).map(|surface| Fault::Reversed { surface });
    let swapped =
        (0..6).flat_map(|one| (one + 1..6).map(move |other| Fault::Swapped { surfaces: [one, other] }));
    reversed.chain(swapped).collect()
}

/// With servo feedback, a surface that does not follow its command is found and named.
#[test]
fn every_wrong_wiring_is_found_with_servo_feedback() {
    for wrong in wrong_wirings() {
        let mut rocket = on_the_pad("none", &[]);
        rocket.vehicle.sortie.world_mut().inject(&wrong);
        checked(&mut rocket);
        assert_eq!(state(&rocket), CheckState::Failed, "{wrong:?}");
        let surfaces = match wrong {
            Fault::Reversed { surface } => vec![surface],
            Fault::Swapped { surfaces } => surfaces.to_vec(),
            _ => vec![],
        };
        for surface in surfaces {
            assert!(failing(&rocket).contains(&Item::Error(surface)), "{wrong:?}: {:?}", failing(&rocket));
        }
    }
}

/// Observations of two people in a check: the position of each surface for each command. A fin is
/// open (1) or closed (0); the nozzle swings towards the fins of one side (y, z), or hangs
/// straight.
fn seen_motions(rocket: &mut Rocket) -> Vec<([f64; 2], [f64; 4])> {
    let mut seen: Vec<([f64; 2], [f64; 4])> = Vec::new();
    rocket.request(CrewCommand::Check);
    rocket.run_until(|rocket| {
        let ([pitch_rad, yaw_rad], fins_rad) =
            (rocket.sortie.world().gimbal_rad(), rocket.sortie.world().fins_rad());
        // The thrust points to (sin yaw, -sin pitch) in (y, z), and the nozzle's end moves the
        // other way.
        let side = |angle_rad: f64| if angle_rad.abs() < 0.1 { 0.0 } else { angle_rad.signum() };
        let stands =
            ([-side(yaw_rad), side(pitch_rad)], fins_rad.map(|fin_rad| f64::from(u8::from(fin_rad > 1.5))));
        if seen.last() != Some(&stands) {
            seen.push(stands);
        }
        state(rocket) != CheckState::Running
    });
    seen
}

/// The words of the crew's page as motions: the nozzle towards fins 1 and 4, 2 and 3, 1 and 2, 3
/// and 4; then each fin.
fn motions_of_the_page() -> Vec<([f64; 2], [f64; 4])> {
    let fins = flight::vehicles::mission::builtin_airframe("mk3").unwrap().fin_model();
    let towards = |one: usize, other: usize| {
        let middle = [0, 1].map(|axis: usize| fins.outward(one)[axis] + fins.outward(other)[axis]);
        middle.map(|part| if part.abs() < 1e-9 { 0.0 } else { part.signum() })
    };
    let rest = ([0.0; 2], [0.0; 4]);
    let mut seen = vec![rest];
    for sides in [[[1, 4], [2, 3]], [[1, 2], [3, 4]]] {
        for [one, other] in sides {
            seen.extend([(towards(one - 1, other - 1), [0.0; 4]), rest]);
        }
    }
    for fin in 0..4 {
        let mut open = [0.0; 4];
        open[fin] = 1.0;
        seen.extend([([0.0; 2], open), rest]);
    }
    seen
}

fn without_feedback() -> Rocket {
    let mut flight = flight_of("none", &[]);
    flight.recipe.mission.airframe.servos_report = false;
    let mut rocket = Rocket::of(Vehicle::on_the_pad(&flight).unwrap());
    // Every check passes but one.
    rocket.run_until(|rocket| {
        rocket.phase() == Phase::PadIdle && rocket.state().checks_failed().is_power_of_two()
    });
    rocket
}

/// Servos without feedback: the positions are the commands, and pass for any motion. Without the
/// confirmation of two people the vehicle is not armed, and with any wrong wire their observations
/// differ from the page.
#[test]
fn without_feedback_two_people_see_every_wrong_wiring_and_nobody_arms_before() {
    let mut rocket = without_feedback();
    let refused = |rocket: &mut Rocket| rocket.request(CrewCommand::Arm).reason.unwrap_or_default();
    assert!(refused(&mut rocket).starts_with("fins answering: found servos that tell nothing, seen by 0"));
    assert_eq!(rocket.request(CrewCommand::Seen).reason.unwrap().as_str(), "no check with motion has passed");
    assert_eq!(seen_motions(&mut rocket), motions_of_the_page());
    assert_eq!(state(&rocket), CheckState::Passed);
    let shown = |item| {
        rocket.computer().pad_check().findings.iter().find(|found| found.item == item).unwrap().verdict
    };
    assert_eq!((shown(Item::Range(0)), shown(Item::Lag(5))), (Verdict::NotJudged, Verdict::NotJudged));
    assert_eq!(rocket.request(CrewCommand::Seen).ending, Ending::Accepted);
    assert!(refused(&mut rocket).contains("seen by 1, required 2 people who saw"));
    assert_eq!(rocket.request(CrewCommand::Seen).ending, Ending::Accepted);
    assert_eq!(rocket.request(CrewCommand::Arm).ending, Ending::Accepted);
    rocket.request(CrewCommand::Disarm);
    // Another check takes two people's words again.
    checked(&mut rocket);
    assert!(refused(&mut rocket).contains("seen by 0"));
    for wrong in wrong_wirings() {
        let mut rocket = without_feedback();
        rocket.vehicle.sortie.world_mut().inject(&wrong);
        assert_ne!(seen_motions(&mut rocket), motions_of_the_page(), "{wrong:?}");
        assert_eq!(state(&rocket), CheckState::Passed, "{wrong:?}: nothing but eyes finds it");
        assert!(refused(&mut rocket).contains("seen by 0"), "{wrong:?}");
    }
}

#[test]
fn a_failed_self_test_is_a_reason_to_look_closer() {
    let mut rocket = Rocket::of(Vehicle::on_the_pad(&flight_of("none", &[])).unwrap());
    rocket.vehicle.sortie.world_mut().inject(&Fault::FinStuck { fin: 2 });
    let refused = rocket.request(CrewCommand::Check);
    assert_eq!(refused.ending, Ending::NotNow);
    assert_eq!(refused.reason.unwrap().as_str(), "the self-test is not over");
    rocket.run_until(|rocket| rocket.time_s() > 4.0);
    assert_eq!(rocket.phase(), Phase::Safe);
    checked(&mut rocket);
    assert_eq!(failing(&rocket), [Item::Range(4), Item::Error(4), Item::Lag(4)]);
}

/// 1.3 degrees off in flight 12 of `real`: the fins follow their commands.
#[test]
fn a_feedback_with_an_offset_passes_the_self_test_and_a_slipped_spline_does_not() {
    let mut flight = flight_of("real", &[]);
    for (feedback_deg, phase) in [(1.5, Phase::PadIdle), (15.0, Phase::Safe)] {
        flight.recipe.dispersion.sensor_params.switches.fin_feedback_deg = feedback_deg;
        let mut rocket = Rocket::of(Vehicle::on_the_pad(&flight).unwrap());
        rocket.run_until(|rocket| rocket.time_s() > 4.0);
        let found_rad = rocket.computer().commands().fins_rad;
        assert_eq!(rocket.phase(), phase, "{feedback_deg} deg: {found_rad:?}");
    }
}

/// The world restarts at the release, and faults persist; without a pad they exist from the
/// beginning on.
#[test]
fn a_fin_that_sticks_on_the_pad_sticks_in_flight() {
    let flight = flight_of("none", &["fin-stuck:1@pad"]);
    let waited = in_phase(&flight, Phase::Deploy).vehicle.sortie;
    for mut sortie in [Box::new(waited), Box::new(Sortie::new(&flight.recipe, 0).unwrap())] {
        (0..100).for_each(|_| drop(sortie.step()));
        let open = sortie.world().fins_rad().map(|angle_rad| angle_rad > 0.1);
        assert_eq!((open, sortie.faults_happened()), ([true, false, true, true], 1));
    }
}

#[test]
fn without_motion_everything_but_the_surfaces_is_checked() {
    let mut rocket = on_the_pad("field", &[]);
    assert_eq!(rocket.request(CrewCommand::CheckStill).ending, Ending::Accepted);
    rocket.run_until(|rocket| {
        assert!(rests(rocket));
        state(rocket) != CheckState::Running
    });
    assert_eq!(state(&rocket), CheckState::Passed);
    // Eight of the sensors, six of switches, batteries and log: mk2 starts at apogee, without a
    // booster's wire.
    assert_eq!(rocket.computer().pad_check().findings.len(), 14);
}

#[test]
fn an_empty_battery_is_found_reported_and_inhibits_arming() {
    let mut rocket = on_the_pad("none", &[]);
    rocket.vehicle.sortie.set_battery(0.08);
    checked(&mut rocket);
    assert_eq!(failing(&rocket), [Item::BatteryVoltage, Item::ServoBatteryVoltage]);
    let refused = rocket.request(CrewCommand::Arm);
    let reason = refused.reason.unwrap();
    assert!(reason.starts_with("battery: found 7.1") && reason.ends_with("at least 7.4 V"), "{reason}");
    let battery = rocket.state().battery.unwrap();
    let left = battery.left.is_some_and(|left| (left - 0.08).abs() < 0.01);
    assert!(left && (7.0..7.4).contains(&battery.volts), "{battery:?}");
}

/// The answer to an arming with this fault of mk3, whose lidar is above its blind range.
fn armed_with(fault: &str) -> Answer {
    let mut rocket = Rocket::of(Vehicle::on_the_pad(&mission_of("mk3", "none", &[fault])).unwrap());
    rocket.run_until(|rocket| rocket.time_s() > 6.0);
    rocket.request(CrewCommand::Arm)
}

#[test]
fn a_sensor_that_is_wrong_on_the_pad_is_named_and_refuses_the_arming() {
    for (fault, named) in [
        ("gyro-nan@pad", "gyro silent"),
        ("lidar-dead@pad", "lidar"),
        ("lidar-stuck@pad", "lidar repeats one value"),
        ("lidar-step:5@pad", "lidar 5."),
        ("lidar-step:-5@pad", "lidar"),
    ] {
        let answer = armed_with(fault);
        let reason = answer.reason.unwrap_or_default();
        assert!(answer.ending != Ending::Accepted && reason.contains(named), "{fault}: {reason}");
        assert!(!reason.contains("accelerometer"), "{fault}: {reason}");
    }
}

/// A receiver may repeat a fix at rest, and a turn-on bias of 7 deg/s is calibrated.
#[test]
fn repeated_fixes_and_a_large_gyro_bias_do_not_refuse_the_arming() {
    for fault in ["gnss-stuck@pad", "gyro-step:4@pad"] {
        let answer = armed_with(fault);
        assert_eq!(answer.ending, Ending::Accepted, "{fault}: {answer:?}");
    }
}

#[test]
fn it_is_refused_with_the_reason_unless_disarmed_on_the_pad() {
    let refused = |rocket: &mut Rocket| {
        let answer = rocket.request(CrewCommand::Check);
        assert_eq!(answer.ending, Ending::NotNow);
        assert!(rests(rocket) || !rocket.phase().on_pad());
        answer.reason.unwrap()
    };
    let mut rocket = on_the_pad("none", &[]);
    rocket.request(CrewCommand::Arm);
    assert_eq!(refused(&mut rocket).as_str(), "armed: disarm first");
    rocket.request(CrewCommand::Start);
    assert_eq!(refused(&mut rocket).as_str(), "armed: disarm first");
    rocket.run_until(|rocket| rocket.phase() == Phase::AeroDescent);
    assert_eq!(refused(&mut rocket).as_str(), "not on the pad");
    let mut rocket = on_the_pad("none", &[]);
    rocket.request(CrewCommand::Abort);
    assert_eq!(refused(&mut rocket).as_str(), "an abort is latched: restart to clear it");
}

#[test]
fn every_other_request_ends_it_and_an_arming_waits_for_the_surfaces() {
    for command in [
        CrewCommand::Arm,
        CrewCommand::Start,
        CrewCommand::Abort,
        CrewCommand::Disarm,
        CrewCommand::Hold,
        CrewCommand::EndCheck,
        CrewCommand::Seen,
    ] {
        let mut rocket = on_the_pad("none", &[]);
        rocket.request(CrewCommand::Check);
        rocket.run_until(|rocket| rocket.computer().commands().gimbal_rad[0] > 0.1);
        assert!(rocket.state().checks_failed() != 0, "not ready meanwhile");
        let answer = rocket.request(command);
        assert_eq!(state(&rocket), CheckState::Stopped, "{command:?}");
        assert!(rests(&rocket), "{command:?}");
        assert!(!rocket.mode().interlocks.armed, "{command:?}");
        if command == CrewCommand::Arm {
            assert_eq!(answer.ending, Ending::NotNow);
            assert!(answer.reason.unwrap().starts_with("a check of the vehicle ran"));
            let again = rocket.request(CrewCommand::Arm).reason.unwrap();
            assert!(again.starts_with("self-test: found a check of the vehicle runs"), "{again}");
            let since_s = rocket.time_s();
            rocket.run_until(|rocket| rocket.time_s() > since_s + 1.0);
            assert_eq!(rocket.request(CrewCommand::Arm).ending, Ending::Accepted);
        }
        if command == CrewCommand::Abort {
            assert!(rocket.aborted());
        }
    }
}

#[test]
fn an_uncommanded_lift_off_ends_it() {
    let mut flight = flight_of("none", &[]);
    flight.recipe = flight.recipe.starting_at(StartPoint::Pad).unwrap();
    flight.recipe.faults = vec!["ascent-self-lights@pad+6".parse().unwrap()];
    let mut rocket = Rocket::of(Vehicle::on_the_pad(&flight).unwrap());
    rocket.run_until(|rocket| rocket.time_s() > 6.0);
    rocket.request(CrewCommand::Check);
    rocket.run_until(|rocket| !rocket.phase().on_pad());
    assert_eq!(state(&rocket), CheckState::Stopped);
}

/// Commands, each with the number of frames after it.
fn requests() -> impl Strategy<Value = Vec<(CrewCommand, u16)>> {
    let command = prop_oneof![
        4 => Just(CrewCommand::Check),
        1 => Just(CrewCommand::CheckStill),
        1 => Just(CrewCommand::EndCheck),
        1 => Just(CrewCommand::Seen),
        2 => Just(CrewCommand::Arm),
        1 => Just(CrewCommand::Start),
        1 => Just(CrewCommand::Disarm),
        1 => Just(CrewCommand::Hold),
        1 => Just(CrewCommand::Abort),
    ];
    prop::collection::vec((command, 0..400_u16), 1..24)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    /// For any crew command at any time: no check moves anything while the vehicle is armed, counts
    /// down, is aborted or flies.
    #[test]
    fn no_check_moves_a_surface_of_an_armed_or_a_flying_vehicle(requests in requests()) {
        let mut rocket = on_the_pad("none", &[]);
        let mut next = requests.into_iter();
        let (mut command, mut wait) = next.next().unwrap();
        for _ in 0..4_000 {
            if wait == 0 {
                rocket.request(command);
                match next.next() {
                    Some(more) => (command, wait) = more,
                    None => break,
                }
            } else {
                wait -= 1;
                rocket.advance();
            }
            let mode = rocket.mode();
            let may_move = mode.phase == Phase::PadIdle
                && !mode.interlocks.armed
                && !mode.interlocks.abort_latched
                && mode.countdown_end_s.is_none();
            let runs = state(&rocket) == CheckState::Running;
            prop_assert!(may_move || !runs, "{:?}", rocket.mode());
            prop_assert!(runs || rests(&rocket) || !mode.phase.on_pad(), "{:?}", rocket.mode());
        }
    }
}

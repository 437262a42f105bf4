//! Who sits where, which boot of which vehicle, and who may walk up to it.

use ground::key::Key;
use ground::model::seat::Seat;
use ground::model::{Role, Settings};
use ground::update::{Action, Msg};
use protocol::dialect::{
    MavCmd, TD_FLIGHT_STATUS_DATA, TdAbortEffect, TdHold, TdInterlock, TdMotor, TdPhase,
};
use protocol::log::record::Record;

use crate::bench::{Bench, settings};
use crate::hand::ladder;

fn first_line(bench: &Bench, columns: u16, rows: u16) -> String {
    bench.screen(columns, rows).lines().next().unwrap_or_default().trim_matches('"').to_owned()
}

#[test]
fn every_screen_says_first_who_sits_where() {
    let demo =
        Settings { demonstration: true, vehicle_name: Some("mk2".to_owned()), ..settings(false, true) };
    let cases = [
        (demo, true, " DEMO       system 1 boot 1A2B3C4D mk2"),
        (settings(false, true), true, " SIM        system 1 boot 1A2B3C4D"),
        (settings(false, true), false, " LIVE       system 1 boot 1A2B3C4D"),
        (Settings { role: Role::Watching, ..settings(false, true) }, false, " WATCH LIVE system 1"),
        (Settings { role: Role::Replaying, ..settings(false, true) }, true, " REPLAY SIM system 1"),
    ];
    for (settings, simulated, expected) in cases {
        let mut bench = Bench::new(settings);
        bench.simulated = simulated;
        bench.run(2.0);
        for digit in "123456789?".chars() {
            bench.key(Key::Char(digit));
            let line = first_line(&bench, 80, 24);
            assert!(line.starts_with(expected) && line.contains("255/190 udpin:"), "{digit}: {line}");
        }
        let word = expected.split("  ").next().unwrap_or_default();
        assert!(first_line(&bench, 20, 5).starts_with(word.trim_end_matches(" system 1")), "{word}");
    }
}

/// A vehicle that once said otherwise is taken for a real one until it boots again.
#[test]
fn a_vehicle_that_contradicts_itself_is_live() {
    let mut bench = Bench::crewed();
    bench.run(2.0);
    assert!(bench.model.vehicle.is_simulated() && first_line(&bench, 80, 24).starts_with(" SIM"));
    for simulated in [false, true] {
        bench.simulated = simulated;
        bench.run(2.0);
        assert!(!bench.model.vehicle.is_simulated() && first_line(&bench, 80, 24).starts_with(" LIVE"));
    }
    bench.boot_number += 1;
    bench.run(2.0);
    assert!(bench.model.vehicle.is_simulated() && first_line(&bench, 80, 24).starts_with(" SIM"));
}

#[test]
fn who_commands_is_named_where_there_are_several() {
    let mut bench = Bench::crewed();
    let seats = vec![Seat::new(1, "ann on pts/1"), Seat::new(2, "bob on pts/2")];
    bench.msg(Msg::Crew(seats));
    assert!(first_line(&bench, 80, 24).contains("by ann,bob"), "{}", first_line(&bench, 80, 24));
}

/// Four seconds after its boot the vehicle is armed, and boots again: its clock alone would not show it.
#[test]
fn a_reboot_within_seconds_of_a_boot_voids_what_was_acknowledged_and_observed() {
    let mut bench = Bench::crewed();
    bench.keys(&ladder());
    bench.answer(MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, 0);
    bench.armed = true;
    bench.phase = TdPhase::TD_PHASE_PAD_ARMED;
    bench.run(2.0);
    assert!(bench.screen(80, 24).contains("ARM    commanded"));
    assert!(bench.model.commands.tracks[0].observed_at.is_some());
    bench.key(Key::Char('S'));
    bench.boot_number = 0x0000_00BB;
    bench.armed = false;
    bench.phase = TdPhase::TD_PHASE_PAD_IDLE;
    bench.run(0.1);
    let said = bench.events();
    assert!(said.contains("rebooted, boot 000000BB"), "{said}");
    assert!(said.contains("void since the reboot, whatever was acknowledged or observed: ARM"), "{said}");
    assert!(bench.model.commands.tracks.is_empty() && bench.model.vehicle.armed().is_none());
    assert_eq!(bench.model.dialog, ground::model::dialog::Dialog::Closed);
    assert!(bench.screen(80, 24).contains("ALARM the vehicle has REBOOTED"));
    bench.keys(&[Key::Enter]);
    assert!(!bench.commands().iter().any(|command| command.command == MavCmd::MAV_CMD_MISSION_START));
    bench.run(2.0);
    assert_eq!(bench.events().matches("has rebooted").count(), 1, "said once");
}

fn ended(motor: TdMotor, wait_s: u16, interlocks: TdInterlock) -> Bench {
    let mut bench = Bench::crewed();
    bench.phase = TdPhase::TD_PHASE_CHUTE;
    bench.abort_effect = TdAbortEffect::TD_ABORT_EFFECT_NONE;
    bench.interlocks |= interlocks;
    (bench.motor, bench.approach_wait_s) = (motor, wait_s);
    bench.run(1.0);
    bench
}

/// After no light, an inhibit, a parachute or an abort: on every screen, at every size, as an alarm and as a line of the log.
#[test]
fn a_live_motor_after_a_flight_keeps_everybody_away_until_it_is_safe() {
    for locks in [
        TdInterlock::TD_INTERLOCK_NO_LIGHT,
        TdInterlock::TD_INTERLOCK_MOTOR_INHIBITED,
        TdInterlock::TD_INTERLOCK_ABORT_LATCHED,
    ] {
        let mut bench = ended(TdMotor::TD_MOTOR_LIVE, 57, locks);
        let words = "LIVE MOTOR: do not approach";
        for phase in [TdPhase::TD_PHASE_CHUTE, TdPhase::TD_PHASE_TOUCHDOWN, TdPhase::TD_PHASE_SAFED] {
            bench.phase = phase;
            bench.run(0.2);
            for digit in "123456789?".chars() {
                bench.key(Key::Char(digit));
                let screen = bench.screen(80, 24);
                assert!(screen.contains("LIVE MOTOR: do not approach for 57 s"), "{digit}: {screen}");
                assert!(bench.screen(40, 12).contains(words), "{digit}");
            }
        }
        assert!(bench.screen(20, 5).contains("LIVE MOTOR"), "{}", bench.screen(20, 5));
        let logged = bench.actions.iter().filter(
            |action| matches!(action, Action::Record(Record::Event(event)) if event.message.contains(words)),
        );
        assert_eq!(logged.count(), 1);
        assert!(bench.events().contains("LIVE MOTOR: do not approach for 57 s"));
        bench.approach_wait_s = 0;
        bench.run(0.1);
        assert!(bench.screen(80, 24).contains("LIVE MOTOR: do not approach, but to put the pin in"));
        bench.motor = TdMotor::TD_MOTOR_PIN_IN;
        bench.run(0.1);
        assert!(bench.events().contains("the pin is in: the vehicle may be approached"));
        let screen = bench.screen(80, 24);
        assert!(!screen.contains("do not approach for") && !screen.contains("ALARM LIVE"), "{screen}");
    }
}

#[test]
fn the_words_for_each_state_of_the_motor() {
    let none = TdInterlock::empty();
    let cases = [
        (TdMotor::TD_MOTOR_UNKNOWN, 0, "MOTOR NOT REPORTED: take it for live"),
        (TdMotor::TD_MOTOR_LIVE, u16::MAX, "LIVE MOTOR: do not approach"),
        (TdMotor::TD_MOTOR_BURNING, u16::MAX, "MOTOR BURNING: do not approach"),
        (TdMotor::TD_MOTOR_HOT, 48, "MOTOR HOT: burnt out, do not touch for 48 s"),
    ];
    for (motor, wait_s, words) in cases {
        let screen = ended(motor, wait_s, none).screen(80, 24);
        assert!(screen.contains(words), "{screen}");
    }
    for safe in [TdMotor::TD_MOTOR_BURNT, TdMotor::TD_MOTOR_PIN_IN] {
        let screen = ended(safe, 0, none).screen(80, 24);
        assert!(!screen.contains("MOTOR") && !screen.contains("approach"), "{screen}");
    }
}

/// Before a flight people stand beside it by design.
#[test]
fn a_vehicle_that_is_made_ready_keeps_nobody_away() {
    let mut bench = Bench::crewed();
    assert!(!bench.screen(80, 24).contains("MOTOR"));
    bench.pad_wait_s = 31;
    bench.motor = TdMotor::TD_MOTOR_PIN_IN;
    bench.run(0.1);
    assert!(bench.screen(80, 24).contains("STAY OFF THE PAD for 31 s"));
}

#[test]
fn a_hold_says_why_and_that_it_does_not_resume() {
    let mut bench = Bench::crewed();
    bench.armed = true;
    bench.phase = TdPhase::TD_PHASE_PAD_ARMED;
    bench.run(1.0);
    bench.hold = TdHold::TD_HOLD_UPLINK_SILENT;
    bench.run(0.2);
    let words = "HOLD: the vehicle did not hear this station for 2 s; start anew; disarms in 42 s";
    assert!(bench.screen(80, 24).contains(words), "{}", bench.screen(80, 24));
    assert!(bench.events().contains(words));
    assert_eq!(bench.events().matches("HOLD").count(), 1);
    bench.hold = TdHold::TD_HOLD_COMMANDED;
    bench.run(0.2);
    assert!(bench.screen(80, 24).contains("HOLD: a station asked for it; start anew"));
    bench.hold = TdHold::TD_HOLD_NONE;
    bench.run(0.2);
    assert!(!bench.screen(80, 24).contains("\"HOLD: a station"));
}

/// What an older vehicle sends is shorter, and says nothing of boot, motor and hold.
#[test]
fn a_vehicle_that_tells_nothing_new_is_live_and_shown_as_before() {
    let mut bench = Bench::crewed();
    bench.model = ground::model::Model::new(settings(false, true));
    bench.heartbeat();
    bench.hear(&protocol::dialect::MavMessage::TD_FLIGHT_STATUS(TD_FLIGHT_STATUS_DATA {
        phase: TdPhase::TD_PHASE_PAD_IDLE,
        ..TD_FLIGHT_STATUS_DATA::default()
    }));
    assert!(first_line(&bench, 80, 24).starts_with(" LIVE       system 1 boot --"));
}

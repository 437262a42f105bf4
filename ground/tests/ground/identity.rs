//! Who commands, which boot of which vehicle, and whether people may approach it.

use ground::key::Key;
use ground::model::{Alarm, AlarmKind, Role, Settings, why_not_stop};
use ground::update::Action;
use protocol::dialect::{
    MavCmd, MavMessage, TD_FLIGHT_STATUS_DATA, TD_MISSION_DATA, TdAbortEffect, TdHold, TdInterlock, TdMotor,
    TdPhase, TdStart,
};
use protocol::log::record::Record;
use protocol::mission::MissionHash;

use crate::endings::reason;
use crate::keys::ladder;
use crate::rig::{Rig, settings};

fn first_line(rig: &Rig, columns: u16, rows: u16) -> String {
    rig.screen(columns, rows).lines().next().unwrap_or_default().trim_matches('"').to_owned()
}

#[test]
fn the_first_line_of_every_page_is_the_identity() {
    let demo =
        Settings { demonstration: true, vehicle_name: Some("mk2".to_owned()), ..settings(false, true) };
    let cases = [
        (demo, true, " DEMO, NOT REAL  mk2 boot 1A2B3C4D "),
        (settings(false, true), true, " SIM boot 1A2B3C4D"),
        (settings(false, true), false, " LIVE boot 1A2B3C4D"),
        (Settings { role: Role::Watching, ..settings(false, true) }, false, " WATCH LIVE boot 1"),
        (Settings { role: Role::Replaying, ..settings(false, true) }, true, " REPLAY SIM boot 1"),
    ];
    for (settings, simulated, expected) in cases {
        let mut rig = Rig::new(settings);
        rig.simulated = simulated;
        rig.run(2.0);
        for digit in "123456789?".chars() {
            rig.key(Key::Char(digit));
            let line = first_line(&rig, 80, 24);
            assert!(line.starts_with(expected) && !line.contains("255/190"), "{digit}: {line}");
        }
        let word = expected.split(" boot").next().unwrap_or_default().trim_end_matches(" mk2");
        let fits: String = word.chars().take(19).collect();
        assert!(first_line(&rig, 20, 5).starts_with(&fits), "{word}");
    }
}

/// A vehicle that once reported not to be simulated counts as real until it reboots.
#[test]
fn a_vehicle_that_contradicts_itself_is_live() {
    let mut rig = Rig::crewed();
    rig.run(2.0);
    assert!(rig.model.vehicle.boot.is_simulated() && first_line(&rig, 80, 24).starts_with(" SIM"));
    for simulated in [false, true] {
        rig.simulated = simulated;
        rig.run(2.0);
        assert!(!rig.model.vehicle.boot.is_simulated() && first_line(&rig, 80, 24).starts_with(" LIVE"));
    }
    rig.reboot();
    rig.run(4.0);
    assert!(rig.model.vehicle.boot.is_simulated() && first_line(&rig, 80, 24).starts_with(" SIM"));
}

/// The vehicle reboots four seconds after its boot, which its clock alone would not show.
#[test]
fn a_reboot_within_seconds_of_a_boot_voids_earlier_commands() {
    let mut rig = Rig::crewed();
    rig.keys(&ladder());
    rig.answer(MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, 0);
    rig.armed = true;
    rig.phase = TdPhase::TD_PHASE_PAD_ARMED;
    rig.run(2.0);
    assert!(rig.model.commands.tracks[0].observed_at.is_some());
    rig.key(Key::Char('S'));
    rig.boot_number = 0x0000_00BA;
    rig.reboot();
    rig.armed = false;
    rig.phase = TdPhase::TD_PHASE_PAD_IDLE;
    rig.run(2.1);
    let said = rig.events();
    assert!(said.contains("rebooted while it was armed, boot 000000BB"), "{said}");
    assert!(said.contains("void since then: ARM"), "{said}");
    assert!(rig.model.commands.tracks.is_empty() && !rig.model.vehicle.is_armed());
    assert_eq!(rig.model.dialog, None);
    assert!(rig.model.alarms.is_unseen(AlarmKind::Rebooted));
    rig.keys(&[Key::Enter]);
    assert!(!rig.commands().iter().any(|command| command.command == MavCmd::MAV_CMD_MISSION_START));
    rig.run(2.0);
    assert_eq!(rig.events().matches("has rebooted").count(), 1, "said once");
}

/// A vehicle that is down, with this motor.
fn down(motor: TdMotor, wait_s: u16, interlocks: TdInterlock) -> Rig {
    let mut rig = Rig::crewed();
    rig.phase = TdPhase::TD_PHASE_TOUCHDOWN;
    rig.abort_effect = TdAbortEffect::TD_ABORT_EFFECT_NONE;
    rig.interlocks |= interlocks;
    (rig.motor, rig.approach_wait_s) = (motor, wait_s);
    rig.run(1.0);
    rig
}

/// The row of the words, which is the same on every page from 80x24 on, and the large letters under
/// it.
fn large(rig: &Rig) -> String {
    rig.screen(80, 24).lines().skip(3).take(4).collect::<Vec<_>>().join("\n")
}

/// The words with their reason are one row on every page, and large under it; small screens have
/// them as their second line.
fn stands_on_every_page(rig: &mut Rig, words: &str, reason: &str) {
    rig.key(Key::Char('1'));
    let expected = large(rig);
    // A letter is 1 to 5 columns wide, with one behind it.
    let letters = words.chars().count();
    let widest = expected.lines().skip(1).map(|line| line.trim_matches('"').trim_end().chars().count()).max();
    assert!(widest.is_some_and(|widest| (3 * letters..80).contains(&widest)), "{words}: {expected}");
    for digit in "123456789?ftx".chars() {
        rig.key(Key::Char(digit));
        assert_eq!(large(rig), expected, "{digit}");
        assert!(large(rig).contains(reason), "{digit}: {reason}\n{}", rig.screen(80, 24));
        let small = rig.screen(60, 12);
        let second = small.lines().nth(1).unwrap_or_default();
        assert!(second.contains(&format!(" {words}")), "{digit}: {small}");
    }
    let tiny = rig.screen(20, 5);
    assert!(tiny.lines().nth(1).is_some_and(|line| line.contains(words)), "{tiny}");
    rig.key(Key::Char('0'));
}

/// After a failed ignition, an inhibit or an abort: on every page and size, as an alarm and in the
/// log.
#[test]
fn a_live_motor_after_a_flight_forbids_the_approach_until_it_is_safe() {
    for locks in [
        TdInterlock::TD_INTERLOCK_NO_LIGHT,
        TdInterlock::TD_INTERLOCK_MOTOR_INHIBITED,
        TdInterlock::TD_INTERLOCK_ABORT_LATCHED,
    ] {
        let mut rig = down(TdMotor::TD_MOTOR_LIVE, 57, locks);
        let words = "DO NOT APPROACH for 57 s: LIVE MOTOR";
        for phase in [TdPhase::TD_PHASE_TOUCHDOWN, TdPhase::TD_PHASE_SAFED] {
            rig.phase = phase;
            rig.run(0.2);
            stands_on_every_page(&mut rig, "DO NOT APPROACH", "do not approach for 57 s: LIVE MOTOR");
        }
        let logged = rig.actions.iter().filter(
            |action| matches!(action, Action::Record(Record::Event(event)) if event.message.contains(words)),
        );
        assert_eq!(logged.count(), 1);
        assert!(rig.events().contains(words), "{}", rig.events());
        assert!(rig.model.alarms.list().iter().any(|alarm| alarm.what.text.ends_with("LIVE MOTOR")));
        rig.approach_wait_s = 0;
        rig.run(0.1);
        let live = "one person: pin in: the motor is LIVE, and the waiting time is over";
        stands_on_every_page(&mut rig, "ONE PERSON: PIN IN", live);
        assert!(rig.events().contains("ONE PERSON: PIN IN: the motor is LIVE"), "{}", rig.events());
        let alarms = rig.model.alarms.list();
        assert!(alarms.iter().any(|alarm| alarm.what.text.starts_with("ONE PERSON: PIN IN")), "{alarms:?}");
        rig.motor = TdMotor::TD_MOTOR_PIN_IN;
        rig.run(0.1);
        stands_on_every_page(&mut rig, "MAY BE APPROACHED", "may be approached: the pin is in");
        assert!(rig.events().contains("MAY BE APPROACHED: the pin is in"));
        let live = |alarm: &Alarm| alarm.what.kind == AlarmKind::LiveMotor && alarm.is_active();
        assert!(!rig.model.alarms.list().iter().any(live));
    }
}

/// The station has not received the abort: the vehicle reports that the pin is due.
#[test]
fn the_pin_is_due_on_every_page_after_a_power_cycle_until_it_was_put_in() {
    let mut rig = Rig::crewed();
    rig.interlocks |= TdInterlock::TD_INTERLOCK_PIN_DUE;
    rig.approach_wait_s = 43;
    rig.run(0.1);
    stands_on_every_page(&mut rig, "DO NOT APPROACH", "do not approach for 43 s: LIVE MOTOR");
    rig.approach_wait_s = 0;
    rig.run(0.1);
    let live = "one person: pin in: the motor is LIVE, and the waiting time is over";
    stands_on_every_page(&mut rig, "ONE PERSON: PIN IN", live);
    rig.motor = TdMotor::TD_MOTOR_PIN_IN;
    rig.run(0.1);
    stands_on_every_page(&mut rig, "MAY BE APPROACHED", "may be approached: the pin is in");
}

#[test]
fn each_state_of_the_motor_has_its_warning() {
    let none = TdInterlock::empty();
    let cases = [
        (TdMotor::TD_MOTOR_UNKNOWN, 0, "do not approach: MOTOR NOT REPORTED: treat it as live"),
        (TdMotor::TD_MOTOR_LIVE, u16::MAX, "do not approach: LIVE MOTOR"),
        (TdMotor::TD_MOTOR_BURNING, u16::MAX, "do not approach: MOTOR BURNING"),
        (TdMotor::TD_MOTOR_HOT, 48, "do not approach for 48 s: MOTOR HOT, burnt out"),
        (TdMotor::TD_MOTOR_PIN_IN, 31, "do not approach for 31 s: the waiting time runs"),
    ];
    for (motor, wait_s, words) in cases {
        stands_on_every_page(&mut down(motor, wait_s, none), "DO NOT APPROACH", words);
    }
    for (safe, why) in [
        (TdMotor::TD_MOTOR_BURNT, "the motor is burnt out and cool"),
        (TdMotor::TD_MOTOR_PIN_IN, "the pin is in"),
    ] {
        let mut rig = down(safe, 0, none);
        stands_on_every_page(&mut rig, "MAY BE APPROACHED", why);
    }
}

/// Whoever ends the station takes the words away.
#[test]
fn a_station_is_not_stopped_by_a_slip_while_people_must_stay_away() {
    let mut rig = down(TdMotor::TD_MOTOR_HOT, 20, TdInterlock::empty());
    let why = why_not_stop(&rig.model, rig.now).unwrap_or_default();
    assert_eq!(why, "people must keep away, DO NOT APPROACH for 20 s: MOTOR HOT, burnt out");
    (rig.motor, rig.approach_wait_s) = (TdMotor::TD_MOTOR_LIVE, 0);
    rig.run(0.2);
    let why = why_not_stop(&rig.model, rig.now).unwrap_or_default();
    assert!(why.starts_with("people must keep away, ONE PERSON: PIN IN"), "{why}");
    rig.motor = TdMotor::TD_MOTOR_PIN_IN;
    rig.run(0.2);
    assert_eq!(why_not_stop(&rig.model, rig.now), None);
}

/// Without `--mission` only the crew can compare it with what they mean to fly.
#[test]
fn the_pad_page_names_the_reported_mission() {
    let mut rig = Rig::crewed();
    assert!(!rig.screen(80, 24).contains("from pad"), "{}", rig.screen(80, 24));
    let mut name = [0; 20];
    name[..3].copy_from_slice(b"mk2");
    let hash = MissionHash::of("a text");
    rig.receive(&MavMessage::TD_MISSION(TD_MISSION_DATA {
        hash: hash.0,
        name: name.into(),
        start: TdStart::TD_START_PAD,
        ..TD_MISSION_DATA::default()
    }));
    for (columns, rows) in [(80, 24), (120, 36)] {
        let screen = rig.screen(columns, rows);
        let line = screen.lines().find(|line| line.contains("from pad")).unwrap_or_default();
        assert!(line.contains("mk2 from pad") && line.contains(&hash.to_string()[..8]), "{screen}");
    }
}

/// The vehicle is switched off, or falls silent, while its motor cools: the time goes on.
#[test]
fn a_waiting_time_goes_on_without_the_link() {
    let mut rig = down(TdMotor::TD_MOTOR_HOT, 20, TdInterlock::empty());
    rig.speaks = false;
    rig.run(12.0);
    assert_eq!(reason(&rig).as_deref(), Some("~do not approach for 8 s: MOTOR HOT, burnt out"));
    rig.run(9.0);
    assert_eq!(
        reason(&rig).as_deref(),
        Some("~may be approached: the motor is burnt out, and its cooling time is over")
    );
    assert!(rig.events().contains("MAY BE APPROACHED"), "{}", rig.events());
    let mut rig = down(TdMotor::TD_MOTOR_LIVE, 20, TdInterlock::empty());
    rig.speaks = false;
    rig.run(25.0);
    let live = "~one person: pin in: the motor is LIVE, and the waiting time is over";
    assert_eq!(reason(&rig).as_deref(), Some(live));
    let mut rig = down(TdMotor::TD_MOTOR_LIVE, u16::MAX, TdInterlock::empty());
    rig.speaks = false;
    rig.run(200.0);
    assert_eq!(reason(&rig).as_deref(), Some("~do not approach: LIVE MOTOR"), "unknown stays unknown");
}

/// In flight no person approaches, and the pages show the flight.
#[test]
fn no_approach_headline_in_flight_or_while_the_vehicle_is_being_prepared() {
    let mut rig = Rig::crewed();
    assert_eq!(reason(&rig), None);
    rig.phase = TdPhase::TD_PHASE_CHUTE;
    rig.interlocks |= TdInterlock::TD_INTERLOCK_ABORT_LATCHED;
    rig.run(0.2);
    assert_eq!(reason(&rig), None);
    let mut rig = Rig::crewed();
    rig.approach_wait_s = 31;
    rig.motor = TdMotor::TD_MOTOR_PIN_IN;
    rig.run(0.1);
    stands_on_every_page(&mut rig, "DO NOT APPROACH", "do not approach for 31 s: the waiting time runs");
}

#[test]
fn a_hold_shows_its_reason_and_what_happens_next() {
    let mut rig = Rig::crewed();
    rig.armed = true;
    rig.phase = TdPhase::TD_PHASE_PAD_ARMED;
    rig.run(1.0);
    rig.hold = TdHold::TD_HOLD_UPLINK_SILENT;
    rig.run(0.2);
    let words = "HOLD: no uplink from this station for 1 s; start again; disarms in 42 s";
    assert!(rig.screen(80, 24).contains(words), "{}", rig.screen(80, 24));
    assert!(rig.events().contains(words));
    assert_eq!(rig.events().matches("HOLD").count(), 1);
    rig.hold = TdHold::TD_HOLD_COMMANDED;
    rig.run(0.2);
    assert!(rig.screen(80, 24).contains("HOLD: a station requested it; start again"));
    rig.hold = TdHold::TD_HOLD_NONE;
    rig.run(0.2);
    assert!(!rig.screen(80, 24).contains("\"HOLD: a station"));
}

/// Nothing is known of it yet.
#[test]
fn an_unknown_vehicle_counts_as_live() {
    let mut rig = Rig::crewed();
    rig.model = ground::model::Model::new(settings(false, true));
    rig.heartbeat();
    rig.receive(&protocol::dialect::MavMessage::TD_FLIGHT_STATUS(TD_FLIGHT_STATUS_DATA {
        phase: TdPhase::TD_PHASE_PAD_IDLE,
        ..TD_FLIGHT_STATUS_DATA::default()
    }));
    assert!(first_line(&rig, 80, 24).starts_with(" LIVE boot --"));
}

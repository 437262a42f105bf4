//! Who commands which vehicle: two vehicles under one id, two stations under one id, whose key a
//! screen uses, and vehicles with another autopilot.

use std::time::Duration;

use ground::key::Key;
use ground::model::{CommandKind, Ending, KeyOwner, Role, Seat, Settings};
use ground::update::{Action, Msg, Request};
use protocol::dialect::{
    ATTITUDE_DATA, COMMAND_LONG_DATA, GLOBAL_POSITION_INT_DATA, HEARTBEAT_DATA, MavAutopilot, MavCmd,
    MavMessage, MavModeFlag, MavType, TD_CREW_DATA, TD_FLIGHT_STATUS_DATA, TD_GIMBAL_DATA, TD_MISSION_DATA,
    TD_OPERATOR_DATA, TD_UPLINK_DATA, TIMESYNC_DATA, TdAct, TdInterlock, TdLatch, TdLimit, TdMotor, TdPhase,
    TdRole, VFR_HUD_DATA,
};
use protocol::identity::{Address, GROUND, PHASE_BITS};

use crate::keys::ladder;
use crate::rig::{Rig, SESSION, enter, is_abort, is_arm, settings, typed};

const ARM: MavCmd = MavCmd::MAV_CMD_COMPONENT_ARM_DISARM;
const START: MavCmd = MavCmd::MAV_CMD_MISSION_START;
const TAP: MavCmd = MavCmd::MAV_CMD_TD_TAP;
const TAKE: MavCmd = MavCmd::MAV_CMD_TD_TAKE_COMMAND;
const CHECK: MavCmd = MavCmd::MAV_CMD_TD_PAD_CHECK;

/// Whether it can make something move or light.
fn moves(command: &COMMAND_LONG_DATA) -> bool {
    match command.command {
        ARM | CHECK => command.param1 > 0.5,
        START | TAP | TAKE => true,
        _ => false,
    }
}

fn first_line(rig: &Rig, columns: u16, rows: u16) -> String {
    rig.screen(columns, rows).lines().next().unwrap_or_default().to_owned()
}

/// The vehicle of the rig and a second one under its id, for some seconds.
pub(crate) fn beside(rig: &mut Rig, boot_number: u32, seconds: u32) {
    for _ in 0..10 * seconds {
        rig.run(0.1);
        rig.receive(&MavMessage::TD_FLIGHT_STATUS(TD_FLIGHT_STATUS_DATA {
            boot_number,
            time_boot_ms: 900_000 + rig.boot_ms(),
            phase: TdPhase::TD_PHASE_PAD_IDLE,
            interlocks: TdInterlock::TD_INTERLOCK_PIN_OUT,
            countdown_ms: i32::MAX,
            ..TD_FLIGHT_STATUS_DATA::default()
        }));
    }
}

#[test]
fn two_vehicles_under_one_id_are_named_in_the_first_line_and_nothing_moves() {
    let mut rig = Rig::crewed();
    beside(&mut rig, 9, 2);
    for page in "123456789?".chars() {
        rig.key(Key::Char(page));
        for (columns, rows) in [(80, 24), (140, 45), (40, 12)] {
            let line = first_line(&rig, columns, rows);
            assert!(line.contains("TWO VEHICLES under id 1"), "{page}: {line}");
        }
    }
    rig.key(Key::Char('1'));
    let screen = rig.screen(80, 24);
    assert!(screen.contains("NO-GO: TWO VEHICLES") && !screen.contains(" GO: "), "{screen}");
    rig.take_commands();
    rig.keys(&ladder());
    rig.keys(&[typed("CTAKE"), vec![Key::Enter], typed("X"), vec![Key::Enter]].concat());
    for kind in CommandKind::ALL.iter().copied() {
        rig.msg(Msg::command(kind, Seat::new(2, "ann")));
    }
    rig.abort();
    let sent = rig.take_commands();
    assert!(!sent.iter().any(moves), "{sent:?}");
    assert!(sent.iter().any(is_abort));
    // One has answered and shows the latch: the other one may not have received it.
    rig.answer(MavCmd::MAV_CMD_DO_FLIGHTTERMINATION, 0);
    rig.interlocks |= TdInterlock::TD_INTERLOCK_ABORT_LATCHED;
    beside(&mut rig, 9, 5);
    assert!(rig.take_commands().iter().filter(|sent| is_abort(sent)).count() > 20);
    rig.expect_event("cannot arm: TWO VEHICLES under id 1: switch one off");
    rig.expect_event("the ABORT goes to every vehicle received under id 1");
}

/// The crew switches the second vehicle off, whichever is shown.
#[test]
fn two_vehicles_end_when_one_is_silent() {
    let mut rig = Rig::crewed();
    beside(&mut rig, 9, 2);
    assert_eq!(rig.model.vehicle.boot.number(), Some(0x1A2B_3C4D), "the first one keeps the screen");
    rig.run(11.0);
    assert!(first_line(&rig, 80, 24).contains("boot 1A2B3C4D"), "{}", first_line(&rig, 80, 24));
    assert!(!rig.events().contains("rebooted"), "{}", rig.events());
    rig.expect_screen(" every arming check passes");
    rig.take_commands();
    rig.keys(&ladder());
    assert!(rig.take_commands().iter().any(is_arm));
}

/// A rig whose vehicle counts down, armed from here.
fn counting() -> Rig {
    let mut rig = Rig::crewed();
    (rig.armed, rig.phase, rig.countdown_ms) = (true, TdPhase::TD_PHASE_PAD_ARMED, 8_000);
    rig.run(1.0);
    rig.take_commands();
    rig
}

/// A spare on the same channel, before its first status and after a single one.
#[test]
fn the_first_words_of_a_spare_on_one_channel_are_never_those_of_the_shown_vehicle() {
    let mut rig = Rig::crewed();
    for _ in 0..2 {
        let clock_ms = rig.boot_ms();
        rig.receive(&MavMessage::HEARTBEAT(HEARTBEAT_DATA {
            custom_mode: TdPhase::TD_PHASE_POWERED as u32 | 9 << PHASE_BITS,
            mavtype: MavType::MAV_TYPE_ROCKET,
            autopilot: MavAutopilot::MAV_AUTOPILOT_GENERIC,
            ..HEARTBEAT_DATA::default()
        }));
        rig.receive(&MavMessage::TD_GIMBAL(TD_GIMBAL_DATA {
            boot_number: 9,
            time_boot_ms: clock_ms,
            pitch_measured: 1_234,
            ..TD_GIMBAL_DATA::default()
        }));
        assert_eq!(rig.model.vehicle.phase_now(), Some(TdPhase::TD_PHASE_PAD_IDLE));
        let gimbal = rig.model.vehicle.last::<TD_GIMBAL_DATA>();
        assert!(gimbal.is_none_or(|gimbal| gimbal.value.pitch_measured != 1_234));
        rig.receive(&MavMessage::TD_FLIGHT_STATUS(TD_FLIGHT_STATUS_DATA {
            boot_number: 9,
            vehicle_uid: 5,
            time_boot_ms: clock_ms,
            ..TD_FLIGHT_STATUS_DATA::default()
        }));
    }
}

/// A spare is switched on with its clock at zero, on the same channel.
#[test]
fn a_second_vehicle_does_not_hide_a_countdown_and_the_station_that_armed_holds_it() {
    let mut rig = counting();
    for step in 0..60 {
        rig.receive(&MavMessage::TD_FLIGHT_STATUS(TD_FLIGHT_STATUS_DATA {
            boot_number: 9,
            vehicle_uid: 5,
            time_boot_ms: 100 * step,
            phase: TdPhase::TD_PHASE_PAD_IDLE,
            countdown_ms: i32::MAX,
            ..TD_FLIGHT_STATUS_DATA::default()
        }));
        let screen = rig.screen(140, 45);
        let [first, second] = [0, 1].map(|row| screen.lines().nth(row).unwrap_or_default());
        assert!(first.contains("TWO VEHICLES under id 1"), "{step}: {screen}");
        assert!(
            second.contains("COUNTDOWN") && second.contains("ARMED") && second.contains("T-8.0"),
            "{screen}"
        );
        assert!(screen.contains("also 00000009 PAD_IDLE") && !screen.contains("REBOOTED"), "{screen}");
        rig.run(0.1);
    }
    let sent = rig.take_commands();
    assert!(sent.iter().any(|sent| sent.command == MavCmd::MAV_CMD_DO_PAUSE_CONTINUE), "{sent:?}");
    rig.expect_event("TWO VEHICLES in the countdown: HOLD");
}

/// It begins with what a station should know first: its mission, its limits.
#[test]
fn messages_of_a_spare_before_its_first_status_are_not_shown_as_the_vehicles() {
    let mut rig = counting();
    rig.msg(Msg::FromSource(1));
    rig.run(1.0);
    rig.msg(Msg::FromSource(2));
    rig.receive(&MavMessage::TD_MISSION(TD_MISSION_DATA { hash: [7; 8], ..TD_MISSION_DATA::default() }));
    assert_eq!(rig.model.vehicle.mission(), None);
    rig.msg(Msg::FromSource(1));
    rig.receive(&MavMessage::TD_MISSION(TD_MISSION_DATA { hash: [8; 8], ..TD_MISSION_DATA::default() }));
    assert_eq!(rig.model.vehicle.mission().as_ref().map(|mission| mission.hash.0), Some([8; 8]));
}

#[test]
fn one_of_two_vehicles_is_chosen_by_name_and_then_armed() {
    let mut rig = Rig::crewed();
    beside(&mut rig, 9, 1);
    // No vehicle with that one is received.
    rig.msg(Msg::Requested { request: Request::Choose(8), by: Seat::default() });
    beside(&mut rig, 9, 1);
    assert!(![Some(8), Some(9)].contains(&rig.model.vehicle.boot.number()));
    assert!(ground::model::why_nothing_moves(&rig.model, rig.now).is_some());
    rig.keys(&[vec![Key::Char(':')], typed("choose boot 00000009"), vec![Key::Enter]].concat());
    beside(&mut rig, 9, 1);
    assert_eq!(rig.model.vehicle.boot.number(), Some(9), "{}", rig.screen(80, 24));
    assert!(first_line(&rig, 80, 24).contains("TWO VEHICLES"), "it is still said");
    assert!(ground::model::why_nothing_moves(&rig.model, rig.now).is_none());
}

#[test]
fn a_reset_in_the_countdown_is_an_alarm_and_withdraws_what_was_observed() {
    for fixed in [false, true] {
        let mut rig = counting();
        rig.msg(Msg::command(CommandKind::Start, Seat::default()));
        rig.answer(START, 0);
        rig.run(6.0);
        assert!(rig.screen(140, 45).contains("observed yes"), "{}", rig.screen(140, 45));
        if fixed {
            rig.switch_on();
        } else {
            rig.reboot();
        }
        (rig.armed, rig.phase, rig.countdown_ms) = (false, TdPhase::TD_PHASE_PAD_IDLE, i32::MAX);
        rig.run(2.5);
        let screen = rig.screen(140, 45);
        assert!(screen.contains("REBOOTED in the countdown") && !screen.contains("observed yes"), "{screen}");
        rig.expect_event("void since then: START");
    }
}

/// The countdown that the vehicle shows is another station's.
#[test]
fn a_start_that_was_denied_is_not_observed() {
    for counts_first in [true, false] {
        let mut rig = Rig::crewed();
        (rig.armed, rig.phase, rig.armed_here) = (true, TdPhase::TD_PHASE_PAD_ARMED, false);
        rig.run(1.0);
        rig.msg(Msg::command(CommandKind::Start, Seat::default()));
        for step in [counts_first, !counts_first] {
            if step {
                rig.countdown_ms = 8_000;
                rig.run(0.3);
            } else {
                rig.answer(START, 2);
            }
        }
        rig.run(1.0);
        let track = rig.model.commands.of(CommandKind::Start).unwrap();
        assert!(track.observed_at.is_none() && !track.accepted(), "{track:?}");
    }
}

#[test]
fn a_reset_in_flight_is_an_alarm_until_the_end() {
    let mut rig = counting();
    (rig.phase, rig.countdown_ms) = (TdPhase::TD_PHASE_AERO_DESCENT, i32::MAX);
    rig.run(2.0);
    rig.text("the flight computer has restarted IN FLIGHT");
    rig.run(60.0);
    let held = |rig: &Rig| {
        let mut alarms = rig.model.alarms.list().iter();
        alarms.any(|alarm| alarm.is_active() && alarm.what.text == "the vehicle has REBOOTED IN FLIGHT")
    };
    assert!(held(&rig), "{}", rig.screen(120, 36));
    while rig.model.alarms.unacknowledged() > 0 {
        rig.key(Key::Char(' '));
    }
    rig.run(0.3);
    let screen = rig.screen(140, 45);
    assert!(screen.contains("RESET"), "{screen}");
    rig.phase = TdPhase::TD_PHASE_SAFED;
    rig.verdict(true, TdLimit::empty());
    rig.run(60.0);
    assert!(held(&rig), "{}", rig.screen(120, 36));
    let ending = Ending::of(&rig.model.vehicle, rig.now).unwrap().sentence(&rig.model.vehicle);
    assert!(ending.contains(", after a RESET IN FLIGHT"), "{ending}");
}

#[test]
fn what_was_observed_and_is_no_longer_so_is_withdrawn() {
    let mut rig = counting();
    rig.msg(Msg::command(CommandKind::Start, Seat::default()));
    rig.answer(START, 0);
    rig.run(1.0);
    rig.countdown_ms = i32::MAX;
    rig.run(2.0);
    rig.expect_event("START no longer so: no countdown runs");
    assert!(!rig.screen(140, 45).contains("observed yes"), "{}", rig.screen(140, 45));
}

#[test]
fn a_power_cycle_does_not_end_the_waiting_time_after_an_abort() {
    let mut rig = counting();
    rig.interlocks |= TdInterlock::TD_INTERLOCK_ABORT_LATCHED | TdInterlock::TD_INTERLOCK_MOTOR_INHIBITED;
    (rig.armed, rig.phase, rig.countdown_ms) = (false, TdPhase::TD_PHASE_PAD_IDLE, i32::MAX);
    rig.approach_wait_s = 58;
    rig.run(1.0);
    rig.reboot();
    rig.interlocks = TdInterlock::TD_INTERLOCK_PIN_OUT;
    rig.approach_wait_s = 0;
    rig.run(4.0);
    let screen = rig.screen(80, 24);
    assert!(rig.events().contains("rebooted") && screen.contains("do not approach"), "{screen}");
    rig.take_commands();
    rig.keys(&ladder());
    assert_eq!(rig.take_commands(), []);
    rig.expect_event("cannot arm: do not approach for 5");
    // The motor is live as before; a pin that was seen ends it, and so does an arming.
    rig.run(60.0);
    rig.expect_screen("one person: pin in");
    rig.motor = TdMotor::TD_MOTOR_PIN_IN;
    rig.run(1.0);
    rig.motor = TdMotor::TD_MOTOR_LIVE;
    rig.run(1.0);
    let screen = rig.screen(80, 24);
    assert!(screen.contains(" every arming check passes") && !screen.contains("one person"), "{screen}");
}

#[test]
fn what_can_move_something_names_the_boot_and_what_stops_does_not() {
    let mut rig = Rig::new(settings(false, true));
    rig.boot_number = 0x00AB_CDEF;
    rig.run(1.0);
    for kind in [CommandKind::Arm, CommandKind::Check, CommandKind::CheckStill] {
        rig.msg(Msg::command(kind, Seat::default()));
        rig.run(1.0);
    }
    rig.armed = true;
    rig.phase = TdPhase::TD_PHASE_PAD_ARMED;
    rig.armed_here = false;
    rig.run(1.0);
    for kind in [CommandKind::Start, CommandKind::TakeCommand, CommandKind::Hold, CommandKind::EndCheck] {
        rig.msg(Msg::command(kind, Seat::default()));
    }
    rig.msg(Msg::command(CommandKind::Disarm, Seat::default()));
    rig.msg(Msg::command(CommandKind::Abort, Seat::default()));
    let sent = rig.take_commands();
    for command in [ARM, CHECK, START, TAKE] {
        assert!(sent.iter().any(|sent| sent.command == command && moves(sent)), "{command:?}");
    }
    for command in sent {
        let boot = if moves(&command) { 11_259_375.0_f32 } else { 0.0 };
        assert_eq!(command.param7.to_bits(), boot.to_bits(), "{command:?}");
    }
}

/// A report of the vehicle about a station with our address.
fn report(rig: &mut Rig, session: u32, same_id: u8, commands: bool, accepted_age_ms: u16) {
    rig.receive(&MavMessage::TD_UPLINK(TD_UPLINK_DATA {
        accepted_age_ms,
        refused_age_ms: u16::MAX,
        target_system: GROUND.system_id,
        target_component: GROUND.component_id,
        commands: u8::from(commands),
        session,
        same_id,
        ..TD_UPLINK_DATA::default()
    }));
}

#[test]
fn another_station_under_our_id_is_an_alarm_and_nothing_is_armed_until_it_ends() {
    let frame = |rig: &mut Rig| {
        rig.receive_from(
            GROUND,
            &MavMessage::HEARTBEAT(HEARTBEAT_DATA { custom_mode: 5, ..HEARTBEAT_DATA::default() }),
        );
    };
    let of_another = |rig: &mut Rig| report(rig, 5, 0, false, 100);
    let counted = |rig: &mut Rig| report(rig, SESSION, 1, false, 100);
    let signs: [fn(&mut Rig); 3] = [frame, of_another, counted];
    for sign in signs {
        let mut rig = Rig::crewed();
        rig.run(7.0);
        sign(&mut rig);
        rig.run(0.2);
        let screen = rig.screen(100, 30);
        assert!(screen.contains("ALARM another station uses our id 255/190"), "{screen}");
        assert!(!screen.contains(" GO: "), "{screen}");
        rig.keys(&ladder());
        assert_eq!(rig.take_commands(), []);
        rig.run(10.0);
        rig.keys(&ladder());
        assert!(rig.take_commands().iter().any(is_arm));
    }
}

/// Started again with the same ids: the vehicle reports the station before for 5 s.
#[test]
fn a_station_that_is_started_again_does_not_take_its_past_for_another_station() {
    let mut rig = Rig::crewed();
    for tenth in 0..50 {
        report(&mut rig, 5, 0, false, 100 * tenth);
        report(&mut rig, SESSION, 1, false, 100);
        rig.run(0.1);
        assert!(!rig.screen(100, 30).contains("another station uses our id"), "{tenth}");
    }
    rig.run(5.0);
    report(&mut rig, SESSION, 1, false, 100);
    rig.run(0.2);
    assert!(rig.screen(100, 30).contains("ALARM another station uses our id"), "it is another one");
}

#[test]
fn an_echo_of_our_frames_and_a_long_silent_station_are_no_other_station() {
    let mut rig = Rig::crewed();
    let echo = HEARTBEAT_DATA { custom_mode: SESSION, ..HEARTBEAT_DATA::default() };
    rig.receive_from(GROUND, &MavMessage::HEARTBEAT(echo));
    report(&mut rig, 5, 0, false, 5_100);
    rig.run(0.1);
    rig.keys(&ladder());
    assert!(rig.take_commands().iter().any(is_arm), "{}", rig.events());
}

/// The other one armed and started, and dies in the countdown.
#[test]
fn what_another_session_armed_is_never_armed_here() {
    let mut rig = Rig::crewed();
    rig.armed_here = false;
    rig.armed = true;
    rig.phase = TdPhase::TD_PHASE_PAD_ARMED;
    rig.countdown_ms = 8_000;
    for tenth in 0..100 {
        report(&mut rig, 5, 0, true, tenth * 100);
        rig.run(0.1);
        for (columns, rows) in [(80, 24), (140, 45), (40, 12)] {
            let screen = rig.screen(columns, rows);
            assert!(!screen.contains("armed here"), "{screen}");
        }
    }
    assert!(first_line(&rig, 100, 30).contains("armed by another 255/190"), "{}", first_line(&rig, 100, 30));
    // Without a screen here, the countdown of the other one is not held from here.
    rig.msg(Msg::Crew { seats: vec![Seat::new(1, "ann")], silent: Vec::new() });
    rig.msg(Msg::Crew { seats: Vec::new(), silent: Vec::new() });
    rig.take_commands();
    rig.run(5.0);
    assert_eq!(rig.take_commands(), []);
}

/// A program without a session, and a Touchdown station on a link without a key.
#[test]
fn an_arming_a_start_and_an_abort_by_another_station_are_alarms_with_its_address_and_id() {
    let other = Address { system_id: 254, component_id: 190 };
    let mut rig = Rig::crewed();
    rig.armed_here = false;
    let reports = |rig: &mut Rig, command: &str| {
        rig.text(&format!("254/190 at 192.0.2.7:14550: {command}"));
        rig.uplink_of(other, 100, true);
        rig.run(1.2);
    };
    let every_page = |rig: &mut Rig, words: &str| {
        for page in "123456789?".chars() {
            rig.key(Key::Char(page));
            rig.expect_screen(words);
        }
        rig.key(Key::Char('1'));
    };
    (rig.armed, rig.phase) = (true, TdPhase::TD_PHASE_PAD_ARMED);
    reports(&mut rig, "arm");
    every_page(&mut rig, "ALARM ARMED BY 254/190 at 192.0.2.7:14550");
    rig.key(Key::Char(' '));
    rig.countdown_ms = 60_000;
    reports(&mut rig, "start");
    every_page(&mut rig, "ALARM STARTED BY 254/190 at 192.0.2.7:14550");
    rig.key(Key::Char(' '));
    (rig.armed, rig.phase, rig.countdown_ms) = (false, TdPhase::TD_PHASE_PAD_IDLE, i32::MAX);
    rig.interlocks |= TdInterlock::TD_INTERLOCK_ABORT_LATCHED;
    rig.latch = TdLatch::TD_LATCH_COMMANDED;
    rig.text("station 254/190 aborts");
    reports(&mut rig, "abort");
    every_page(&mut rig, "ABORT LATCHED: by 254/190 at 192.0.2.7:14550");
}

#[test]
fn the_heartbeat_carries_the_session_of_the_station() {
    let mut rig = Rig::crewed();
    let beat = rig.actions.iter().find_map(|action| match action {
        Action::Send(message) => match &**message {
            MavMessage::HEARTBEAT(beat) => Some(beat.custom_mode),
            _ => None,
        },
        _ => None,
    });
    assert_eq!(beat, Some(SESSION));
    rig.actions.clear();
}

/// A station that signs as Ann, or, without her, as an observer.
fn station_of(number: u8, name: &str, role: Role, operator: &str) -> Rig {
    let mut rig = Rig::new(Settings {
        seat: Seat::new(1, operator),
        role,
        key_owner: (number > 0).then(|| KeyOwner { number, name: name.to_owned() }),
        ..settings(false, true)
    });
    rig.run(1.0);
    for (number, role, name) in [(1, TdRole::TD_ROLE_RANGE_SAFETY, "Ann"), (2, TdRole::TD_ROLE_FLIGHT, "Bob")]
    {
        let mut bytes = [0; 16];
        bytes[..3].copy_from_slice(name.as_bytes());
        rig.receive(&MavMessage::TD_OPERATOR(TD_OPERATOR_DATA {
            boot_number: 0,
            number,
            role,
            name: bytes.into(),
        }));
    }
    rig.receive(&MavMessage::TD_CREW(TD_CREW_DATA { people: 2, ..TD_CREW_DATA::default() }));
    rig
}

#[test]
fn a_screen_of_another_operator_announces_that_it_only_stops_and_the_station_refuses_the_rest() {
    let mut screen = station_of(1, "Ann", Role::Attached, "Bob");
    let shown = screen.screen(80, 24);
    assert!(shown.contains("HOLD/ABORT ONLY TWO-PERSON"), "{shown}");
    assert!(shown.contains("only HOLD and ABORT here"), "{shown}");
    screen.actions.clear();
    for key in "ASDTCXE".chars() {
        screen.keys(&[
            Key::Char(key),
            Key::Char('A'),
            Key::Char('R'),
            Key::Char('M'),
            Key::Enter,
            Key::Escape,
        ]);
    }
    let asked =
        |rig: &Rig| rig.actions.iter().any(|action| matches!(action, Action::Request(Request::Command(_))));
    assert!(!asked(&screen), "{:?}", screen.actions);
    let said = "this screen cannot arm: this station signs as Ann";
    screen.expect_event(said);
    screen.abort();
    assert!(screen.actions.contains(&Action::Request(Request::Command(CommandKind::Abort))));
    // The station does not rely on the screen.
    let mut station = station_of(1, "Ann", Role::Station, "Ann");
    station.take_commands();
    for operator in ["Bob", "", "ann", "flight on pts/3"] {
        for kind in CommandKind::ALL.iter().copied().filter(|kind| kind.needs_the_owner()) {
            station.msg(Msg::command(kind, Seat::new(2, operator)));
        }
    }
    assert_eq!(station.take_commands(), []);
    station.expect_event("cannot arm: this station signs as Ann");
    station.msg(Msg::command(CommandKind::Hold, Seat::new(2, "Bob")));
    station.msg(Msg::command(CommandKind::Abort, Seat::new(2, "Bob")));
    assert_eq!(station.take_commands().len(), 2);
    station.run(1.0);
    station.msg(Msg::command(CommandKind::Arm, Seat::new(3, "Ann")));
    assert!(station.take_commands().iter().any(is_arm), "Ann attaches a second screen");
}

#[test]
fn an_observer_s_station_holds_and_aborts_and_a_watcher_does_not() {
    let mut observer = station_of(0, "", Role::Station, "Cyd");
    let shown = observer.screen(80, 24);
    assert!(shown.contains("OBSERVER") && shown.contains("ABORT Ctrl-X Enter"), "{shown}");
    assert!(shown.contains("only HOLD and ABORT here"), "{shown}");
    observer.take_commands();
    observer.keys(&[Key::Char('D'), Key::Enter]);
    assert_eq!(observer.take_commands(), []);
    observer.countdown_ms = 9_000;
    observer.run(0.2);
    observer.keys(&[Key::Char('H'), Key::Enter]);
    observer.abort();
    assert_eq!(observer.take_commands().iter().filter(|sent| !is_abort(sent)).count(), 1);
    let watcher = station_of(0, "", Role::Watching, "Cyd").screen(80, 24);
    assert!(watcher.contains("WATCHING only") && !watcher.contains("ABORT Ctrl-X"), "{watcher}");
}

fn copter(custom_mode: u32) -> MavMessage {
    MavMessage::HEARTBEAT(HEARTBEAT_DATA {
        custom_mode,
        mavtype: MavType::MAV_TYPE_QUADROTOR,
        autopilot: MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA,
        base_mode: MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED,
        ..HEARTBEAT_DATA::default()
    })
}

/// It answers TIMESYNC, so that its uplink is proven.
fn answer_timesync(rig: &mut Rig) {
    let ts1 = i64::try_from(rig.now.as_nanos()).unwrap_or(0);
    rig.now += Duration::from_millis(20);
    rig.receive(&MavMessage::TIMESYNC(TIMESYNC_DATA { tc1: 5, ts1, ..Default::default() }));
}

/// A copter in a mode whose number is a phase of ours: ACRO (1) is PAD_IDLE, LAND (9) is POWERED.
fn beside_a_copter() -> Rig {
    let mut rig = Rig::new(settings(false, true));
    rig.speaks = false;
    for mode in [1, 9, 6, 0, 1] {
        rig.receive(&copter(mode));
        rig.receive(&MavMessage::VFR_HUD(VFR_HUD_DATA { alt: 584.0, climb: 1.5, ..VFR_HUD_DATA::default() }));
        rig.receive(&MavMessage::ATTITUDE(ATTITUDE_DATA { roll: 0.1, ..ATTITUDE_DATA::default() }));
        rig.receive(&MavMessage::GLOBAL_POSITION_INT(GLOBAL_POSITION_INT_DATA {
            lat: 473_977_420,
            lon: 85_455_940,
            alt: 584_000,
            relative_alt: 12_500,
            ..GLOBAL_POSITION_INT_DATA::default()
        }));
        answer_timesync(&mut rig);
        rig.run(0.1);
    }
    rig
}

/// It dates some of its messages only: the age of the last of those is not that of the link.
#[test]
fn a_copter_received_ten_times_a_second_is_never_lost() {
    let mut rig = beside_a_copter();
    for _ in 0..90 {
        rig.receive(&copter(1));
        rig.receive(&MavMessage::VFR_HUD(VFR_HUD_DATA::default()));
        rig.run(0.1);
    }
    let screen = rig.screen(80, 24);
    assert!(!screen.contains("DOWN LOST") && screen.contains("down 0s"), "{screen}");
    let line = first_line(&rig, 200, 50);
    assert!(line.contains("ABORT only") && !line.contains("commands here"), "{line}");
}

#[test]
fn a_copter_is_shown_as_a_copter_and_is_never_armed_from_here() {
    let mut rig = beside_a_copter();
    assert!(rig.model.link.uplink.is_proven(rig.now), "or this test proves nothing");
    assert!(rig.model.vehicle.phase().is_none() && rig.model.vehicle.height_m().is_none());
    for (columns, rows) in [(80, 24), (40, 12)] {
        let line = first_line(&rig, columns, rows);
        assert!(line.contains("NOT A TOUCHDOWN VEHICLE: Ardu"), "{line}");
    }
    let screen = rig.screen(80, 24);
    for words in ["mode 1", "ARMED", "CUTS ITS MOTORS"] {
        assert!(screen.contains(words), "{words}: {screen}");
    }
    assert!(!screen.contains("PAD_IDLE") && !screen.contains(" GO"), "{screen}");
    rig.take_commands();
    rig.keys(&ladder());
    rig.keys(&[Key::Char('D'), Key::Enter]);
    for kind in CommandKind::ALL.iter().copied().filter(|kind| *kind != CommandKind::Abort) {
        rig.msg(Msg::command(kind, Seat::new(2, "ann")));
    }
    assert!(!rig.take_commands().iter().any(|sent| moves(sent) || sent.command == ARM));
    rig.expect_event("cannot arm: not a Touchdown vehicle: ArduPilot quadrotor");
}

#[test]
fn an_abort_of_a_copter_is_confirmed_first_and_names_its_effect() {
    let mut rig = beside_a_copter();
    rig.take_commands();
    rig.abort();
    assert_eq!(rig.take_commands(), []);
    let screen = rig.screen(80, 24);
    assert!(screen.contains("ArduPilot quadrotor: flight termination CUTS ITS MOTORS"), "{screen}");
    rig.keys(&enter("ABORT"));
    assert!(rig.take_commands().iter().any(is_abort));
}

/// Before its first flight status it may still be somebody else's.
#[test]
fn a_heartbeat_alone_does_not_make_a_vehicle_ours() {
    let mut rig = Rig::new(settings(false, true));
    rig.speaks = false;
    rig.heartbeat();
    answer_timesync(&mut rig);
    rig.keys(&ladder());
    assert_eq!(rig.take_commands(), []);
    rig.expect_event("it has sent no flight status");
    rig.flight_status();
    // Both say that it is simulated: a real one asks for a word about its motor.
    rig.heartbeat();
    rig.uplink();
    rig.keys(&ladder());
    assert!(rig.take_commands().iter().any(is_arm), "{}", rig.events());
}

#[test]
fn a_copter_beside_our_vehicle_under_its_id_is_a_second_vehicle() {
    let mut rig = Rig::crewed();
    rig.receive(&copter(1));
    rig.run(0.1);
    assert!(first_line(&rig, 80, 24).contains("TWO VEHICLES under id 1"), "{}", first_line(&rig, 80, 24));
    assert!(rig.screen(80, 24).contains("PAD_"), "our vehicle's values stay");
    rig.keys(&ladder());
    assert_eq!(rig.take_commands(), []);
    rig.abort();
    assert!(rig.take_commands().iter().any(is_abort), "at once: one of them is ours");
}

/// SplitMix64 (Steele, Lea and Flood, 2014).
struct Random(u64);

impl Random {
    fn below(&mut self, bound: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (mixed ^ (mixed >> 31)) % bound
    }

    fn of<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.below(choices.len() as u64) as usize]
    }
}

/// A million random steps of two stations with their screens and one vehicle: nothing that can move
/// is ever sent for a seat that is not the owner of the station's key, and what the vehicle takes
/// for two people is never one.
#[test]
fn no_screen_acts_with_the_key_of_another_person() {
    const PEOPLE: [&str; 6] = ["Ann", "Bob", "Cyd", "", "ann", "Ann on pts/3"];
    const KINDS: &[CommandKind] = CommandKind::ALL;
    let mut random = Random(1);
    let mut stations =
        [(1, "Ann"), (2, "Bob")].map(|(number, name)| station_of(number, name, Role::Station, name));
    // The proposal that waits at the vehicle: the key, and the person who really proposed.
    let mut waits: Option<(u8, &str)> = None;
    let (mut sent, mut agreed) = (0, 0);
    for step in 0..1_000_000_u32 {
        let place = random.below(2) as usize;
        let (key, owner) = [(1, "Ann"), (2, "Bob")][place];
        let station = &mut stations[place];
        station.now += Duration::from_millis(random.below(200));
        if step % 64 < 8 {
            station.armed = random.below(2) == 1;
            station.armed_here = random.below(2) == 1;
            station.phase =
                if station.armed { TdPhase::TD_PHASE_PAD_ARMED } else { TdPhase::TD_PHASE_PAD_IDLE };
            station.countdown_ms = random.of(&[i32::MAX, 5_000]);
            station.heartbeat();
            station.flight_status();
            station.uplink();
            let act = random.of(&[TdAct::TD_ACT_NONE, TdAct::TD_ACT_ARM, TdAct::TD_ACT_START]);
            let asked_by = waits.map_or(0, |(key, _)| key);
            station.receive(&MavMessage::TD_CREW(TD_CREW_DATA {
                people: 2,
                ask_number: 7,
                ask_left_ms: 9_000,
                act: if asked_by > 0 { act } else { TdAct::TD_ACT_NONE },
                asked_by,
                tapped_by: random.below(3) as u8,
                tap_left_ms: 2_000,
                ..TD_CREW_DATA::default()
            }));
            station.msg(Msg::Tick);
            station.actions.clear();
            continue;
        }
        let by = random.of(&PEOPLE);
        let kind = random.of(KINDS);
        station.msg(Msg::command(kind, Seat::new(1 + random.below(4) as u32, by)));
        for command in
            station.take_commands().iter().filter(|command| moves(command) && command.confirmation == 0)
        {
            assert_eq!(by, owner, "step {step}: {kind:?} {command:?}");
            sent += 1;
            match waits {
                _ if command.command != ARM => {}
                Some((asked, person)) if command.param3 > 0.0 && asked != key => {
                    assert_ne!(person, by, "step {step}: one person is two");
                    agreed += 1;
                    waits = None;
                }
                _ => waits = Some((key, by)),
            }
        }
    }
    assert!(sent > 1_000 && agreed > 100, "{sent} sent, {agreed} agreed: or this proves nothing");
}

/// A million random steps of vehicles with other autopilots, which may send anything, also our own
/// messages: they are never armed or started.
#[test]
fn no_foreign_vehicle_is_ever_armed_or_started() {
    const AUTOPILOTS: [MavAutopilot; 4] = [
        MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA,
        MavAutopilot::MAV_AUTOPILOT_PX4,
        MavAutopilot::MAV_AUTOPILOT_INVALID,
        MavAutopilot::MAV_AUTOPILOT_GENERIC,
    ];
    const TYPES: [MavType; 4] = [
        MavType::MAV_TYPE_QUADROTOR,
        MavType::MAV_TYPE_FIXED_WING,
        MavType::MAV_TYPE_ROCKET,
        MavType::MAV_TYPE_GENERIC,
    ];
    let mut random = Random(2);
    let mut rig = Rig::new(settings(false, true));
    rig.speaks = false;
    let mut aborts = 0;
    for step in 0..1_000_000_u32 {
        rig.now += Duration::from_millis(random.below(100));
        match random.below(8) {
            // Like any vehicle it sends a heartbeat at least now and then.
            0..=2 => {
                let autopilot = random.of(&AUTOPILOTS);
                let mut mavtype = random.of(&TYPES);
                if autopilot == MavAutopilot::MAV_AUTOPILOT_GENERIC && mavtype == MavType::MAV_TYPE_ROCKET {
                    mavtype = MavType::MAV_TYPE_QUADROTOR;
                }
                let armed = random.below(2) == 1;
                rig.receive(&MavMessage::HEARTBEAT(HEARTBEAT_DATA {
                    custom_mode: random.below(14) as u32,
                    autopilot,
                    mavtype,
                    base_mode: if armed {
                        MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED
                    } else {
                        MavModeFlag::empty()
                    },
                    ..HEARTBEAT_DATA::default()
                }));
            }
            3 => answer_timesync(&mut rig),
            4 if random.below(4) == 0 => {
                rig.boot_number = random.below(3) as u32;
                rig.phase = random.of(&[TdPhase::TD_PHASE_PAD_IDLE, TdPhase::TD_PHASE_PAD_ARMED]);
                rig.flight_status();
                rig.uplink();
            }
            5 => rig.keys(
                &random
                    .of(&[['A', 'A', 'R', 'M'], ['S', 'T', 'A', 'R'], ['C', 'X', 'E', 'T']])
                    .map(Key::Char),
            ),
            6 => rig.key(Key::Enter),
            _ => {
                let kind = random.of(CommandKind::ALL);
                rig.msg(Msg::command(kind, Seat::new(2, "ann")));
            }
        }
        if step % 16 == 0 {
            rig.msg(Msg::Tick);
        }
        for command in rig.take_commands() {
            assert!(!moves(&command), "step {step}: {command:?}");
            aborts += u32::from(is_abort(&command));
        }
    }
    assert!(aborts > 1_000, "{aborts} aborts: or this proves nothing");
}

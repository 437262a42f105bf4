//! Alarms: the bell rings until they are acknowledged, and old or late values are marked.

use std::time::Duration;

use ground::key::Key;
use ground::model::{AlarmKind, RING_EVERY, Role, Settings, link_hints, refused_frames};
use ground::update::vehicle_changes::RESTARTED;
use ground::update::{Action, Msg};
use ground::view::headline::pad;
use protocol::dialect::{
    ESTIMATOR_STATUS_DATA, EstimatorStatusFlags, MavCmd, MavMessage, MavSysStatusSensor, SYS_STATUS_DATA,
    TdAbortEffect, TdCheck, TdControlLevel, TdInterlock, TdPhase,
};
use protocol::signing::SigningCounters;

use crate::rig::{Rig, settings};

fn bells(rig: &Rig) -> usize {
    rig.actions.iter().filter(|action| **action == Action::Bell).count()
}

#[test]
fn the_loss_of_the_link_rings_until_it_is_acknowledged() {
    let mut rig = Rig::crewed();
    rig.actions.clear();
    rig.speaks = false;
    rig.run(3.0);
    assert_eq!(bells(&rig), 0);
    rig.run(0.1);
    assert_eq!(bells(&rig), 1);
    rig.expect_screen("ALARM LINK LOST");
    assert!(rig.screen(20, 5).contains("ALARM LINK LOST"));
    rig.run(RING_EVERY.as_secs_f64());
    assert_eq!(bells(&rig), 2);
    rig.key(Key::Char(' '));
    rig.run(20.0);
    assert_eq!(bells(&rig), 2);
    assert!(rig.screen(80, 24).contains("alarm seen: LINK LOST"), "it still holds");
    rig.speaks = true;
    rig.run(1.1);
    assert!(rig.model.alarms.list().is_empty());
    // It returns as a new, unacknowledged alarm.
    rig.speaks = false;
    rig.run(5.0);
    assert_eq!(rig.model.alarms.unacknowledged(), 1);
    assert!(bells(&rig) > 2);
}

#[test]
fn an_alarm_that_has_ended_stays_until_it_is_acknowledged() {
    let mut rig = Rig::crewed();
    rig.speaks = false;
    rig.run(5.0);
    rig.speaks = true;
    rig.run(2.0);
    let screen = rig.screen(80, 24);
    assert!(screen.contains(" ended alarm: LINK LOST") && screen.contains(" ended 1 s ago"), "{screen}");
    rig.key(Key::Char(' '));
    assert!(!rig.screen(80, 24).contains("ALARM"));
}

/// Its card is full soon after the lift-off.
#[test]
fn a_log_of_the_vehicle_that_stops_in_flight_is_an_alarm_that_stays() {
    let mut rig = Rig::crewed();
    (rig.phase, rig.armed) = (TdPhase::TD_PHASE_BOOST, true);
    let log = MavSysStatusSensor::MAV_SYS_STATUS_LOGGING;
    let status = |health| {
        MavMessage::SYS_STATUS(SYS_STATUS_DATA {
            onboard_control_sensors_present: log,
            onboard_control_sensors_health: health,
            ..SYS_STATUS_DATA::default()
        })
    };
    rig.receive(&status(log));
    rig.run(1.0);
    let is_reported = |rig: &Rig| rig.model.alarms.is_unseen(AlarmKind::VehicleLog);
    assert!(!is_reported(&rig));
    rig.receive(&status(MavSysStatusSensor::empty()));
    rig.run(30.0);
    assert!(is_reported(&rig) && rig.model.vehicle.log_has_stopped());
    let text = rig.model.alarms.foremost().map(|alarm| alarm.what.text.as_str());
    assert_eq!(text, Some("VEHICLE LOG has stopped: this flight is not recorded completely"));
}

/// On the pad it is a failing check, and on the way up no receiver holds its fix.
#[test]
fn a_loss_of_gnss_from_apogee_on_is_an_alarm_on_every_page() {
    let gnss = MavSysStatusSensor::MAV_SYS_STATUS_SENSOR_GPS;
    let absolute = EstimatorStatusFlags::ESTIMATOR_POS_HORIZ_ABS;
    let loss = |rig: &mut Rig, health, flags| {
        rig.receive(&MavMessage::SYS_STATUS(SYS_STATUS_DATA {
            onboard_control_sensors_present: gnss,
            onboard_control_sensors_health: health,
            ..SYS_STATUS_DATA::default()
        }));
        rig.receive(&MavMessage::ESTIMATOR_STATUS(ESTIMATOR_STATUS_DATA {
            flags,
            pos_horiz_accuracy: 40.0,
            ..ESTIMATOR_STATUS_DATA::default()
        }));
        rig.run(0.2);
    };
    let nothing = MavSysStatusSensor::empty();
    for (health, flags, words) in [
        (nothing, absolute, "GNSS LOST: the position may be off by 98 m"),
        (gnss, EstimatorStatusFlags::empty(), "POSITION LOST: the position may be off by 98 m"),
    ] {
        let mut rig = Rig::crewed();
        loss(&mut rig, health, flags);
        assert!(!rig.model.alarms.is_unseen(AlarmKind::Position), "before the flight");
        (rig.phase, rig.armed) = (TdPhase::TD_PHASE_COAST, true);
        loss(&mut rig, gnss, absolute);
        rig.run(1.0);
        loss(&mut rig, health, flags);
        assert!(!rig.model.alarms.is_unseen(AlarmKind::Position), "on the way up");
        rig.phase = TdPhase::TD_PHASE_AERO_DESCENT;
        loss(&mut rig, health, flags);
        for page in "123456789?".chars() {
            rig.key(Key::Char(page));
            rig.expect_screen(words);
        }
        rig.phase = TdPhase::TD_PHASE_TOUCHDOWN;
        rig.run(10.0);
        let mut alarms = rig.model.alarms.list().iter();
        assert!(alarms.any(|alarm| alarm.is_active() && alarm.what.text == words));
    }
}

/// Boot number and clock go on: the vehicle was not switched off.
#[test]
fn a_reset_of_the_flight_computer_is_an_alarm_and_no_go_until_it_is_seen() {
    for (says_it, is_seen_in_its_test) in [(true, false), (false, true), (true, true)] {
        let mut rig = Rig::crewed();
        rig.armed = true;
        rig.phase = TdPhase::TD_PHASE_PAD_ARMED;
        rig.countdown_ms = 7_000;
        rig.run(1.0);
        if says_it {
            rig.text(RESTARTED);
        }
        (rig.armed, rig.countdown_ms) = (false, i32::MAX);
        if is_seen_in_its_test {
            rig.phase = TdPhase::TD_PHASE_SAFE;
            rig.run(1.0);
        }
        rig.phase = TdPhase::TD_PHASE_PAD_IDLE;
        rig.run(15.0);
        let word = |rig: &Rig| pad(&rig.model, rig.now).text;
        let alarm = rig.model.alarms.foremost().unwrap();
        assert_eq!(alarm.what.text, "the vehicle has REBOOTED in the countdown");
        assert!(!alarm.is_active() && !alarm.acknowledged);
        assert_eq!(word(&rig), "RESET");
        assert_eq!(rig.events().matches("the flight computer has restarted in the countdown").count(), 1);
        rig.key(Key::Char(' '));
        assert_eq!(word(&rig), "GO");
    }
}

/// A screen that attaches receives the whole history. It rings only for alarms that still hold.
#[test]
fn attaching_does_not_ring_for_past_alarms() {
    let attached = |seconds_after: f64| {
        let mut rig = Rig::new(Settings { role: Role::Attached, ..settings(false, true) });
        rig.run(1.0);
        rig.speaks = false;
        rig.run(30.0);
        rig.speaks = true;
        rig.run(seconds_after);
        assert_eq!(bells(&rig), 0, "the past rings");
        rig.model.alarms.history_ends();
        rig
    };
    let mut over = attached(60.0);
    over.run(30.0);
    assert_eq!(bells(&over), 0);
    let screen = over.screen(80, 24);
    assert!(screen.contains(" past alarm: LINK LOST: no telemetry, ended 89 s ago"), "{screen}");
    over.speaks = false;
    over.run(5.0);
    assert_eq!(bells(&over), 1, "lost again");
    over.expect_screen("ALARM LINK LOST");
    let mut lasting = attached(0.0);
    lasting.speaks = false;
    lasting.run(0.1);
    assert_eq!(bells(&lasting), 1, "it still holds");
}

/// A station that hangs sends its screens nothing; that is no evidence about the vehicle.
#[test]
fn a_screen_reports_a_silent_station() {
    for role in [Role::Attached, Role::Watching] {
        let mut rig = Rig::new(Settings { role, ..settings(false, true) });
        rig.run(5.0);
        rig.model.alarms.history_ends();
        rig.run(1.0);
        let hangs = |rig: &mut Rig, seconds: u64| {
            for _ in 0..10 * seconds {
                rig.now += Duration::from_millis(100);
                rig.msg(Msg::ScreenTick);
            }
        };
        hangs(&mut rig, 2);
        assert!(rig.model.alarms.list().is_empty(), "not yet");
        hangs(&mut rig, 8);
        let kinds: Vec<_> = rig.model.alarms.list().iter().map(|alarm| alarm.what.kind).collect();
        assert_eq!(kinds, [AlarmKind::StationSilent]);
        assert!(bells(&rig) > 1, "it rings");
        let screen = rig.screen(80, 24);
        assert!(screen.contains("ALARM STATION SILENT"), "{screen}");
        assert!(screen.contains("STATION SILENT 10s") && !screen.contains("LOST"), "{screen}");
        // The silent station cannot acknowledge it.
        rig.actions.clear();
        rig.key(Key::Char(' '));
        assert!(rig.actions.iter().all(|action| !matches!(action, Action::Request(_))));
        hangs(&mut rig, 10);
        assert_eq!(bells(&rig), 0);
        // In the silence the vehicle did not hear the station, either; its first report is awaited.
        rig.run(1.0);
        let mut listed = rig.model.alarms.list().iter();
        assert!(listed.all(|alarm| alarm.what.kind != AlarmKind::StationSilent && !alarm.is_active()));
        rig.expect_event("the station answers again");
        assert!(!rig.screen(80, 24).contains("STATION SILENT 1"), "{}", rig.screen(80, 24));
    }
}

/// Until the first plan is used the stabiliser flies by design; after that it is an alarm.
#[test]
fn the_stabiliser_raises_an_alarm_only_if_it_continues_to_fly() {
    let stabiliser = TdControlLevel::TD_CONTROL_LEVEL_STABILISER;
    let mut rig = Rig::crewed();
    rig.phase = TdPhase::TD_PHASE_POWERED;
    rig.run(0.1);
    rig.controller(stabiliser);
    assert!(rig.model.alarms.list().is_empty());
    rig.run(0.3);
    rig.controller(stabiliser);
    rig.expect_screen("ALARM DEGRADED");
    let mut rig = Rig::crewed();
    rig.phase = TdPhase::TD_PHASE_POWERED;
    rig.run(0.1);
    rig.controller(stabiliser);
    rig.run(0.1);
    rig.controller(TdControlLevel::TD_CONTROL_LEVEL_CONVERGED);
    rig.run(2.0);
    assert!(rig.model.alarms.list().is_empty());
}

#[test]
fn an_abort_without_an_answer_is_an_alarm_while_it_is_repeated() {
    let mut rig = Rig::crewed();
    rig.abort_chord();
    rig.run(3.0);
    rig.expect_screen("ABORT NOT ACKNOWLEDGED");
    rig.answer(MavCmd::MAV_CMD_DO_FLIGHTTERMINATION, 0);
    rig.key(Key::Char(' '));
    rig.run(0.1);
    assert!(rig.model.alarms.list().is_empty());
}

#[test]
fn an_abort_that_would_arrive_too_late_is_marked() {
    let mut rig = Rig::crewed();
    rig.phase = TdPhase::TD_PHASE_AERO_DESCENT;
    rig.abort_effect = TdAbortEffect::TD_ABORT_EFFECT_CHUTE_NOW;
    rig.run(1.0);
    rig.descent(180.0);
    rig.expect_screen("abort now: parachute NOW, landing motor inhibited");
    // 5 m above the commit height at 21.5 m/s: 0.23 s.
    rig.descent(100.0);
    rig.expect_screen("abort now: TOO LATE for a chute");
    // 0.2 s to ignition.
    rig.descent(62.0);
    rig.expect_screen("abort now: TOO LATE: arrives after ignition, lands here");
    for effect in [TdAbortEffect::TD_ABORT_EFFECT_BURN, TdAbortEffect::TD_ABORT_EFFECT_IMPACT] {
        rig.abort_effect = effect;
        rig.run(0.5);
        rig.descent(62.0);
        rig.expect_screen("abort now: TOO LATE: arrives after ignition, lands here");
    }
    rig.phase = TdPhase::TD_PHASE_POWERED;
    rig.abort_effect = TdAbortEffect::TD_ABORT_EFFECT_LAND_IN_PLACE;
    rig.run(2.0);
    rig.expect_screen("abort now: lands here");
}

/// With two alarms, one Space acknowledges one of them; the list marks which, and another can be
/// chosen.
#[test]
fn alarms_are_listed_and_acknowledged_one_by_one() {
    let mut rig = Rig::crewed();
    rig.interlocks |= TdInterlock::TD_INTERLOCK_NO_LIGHT;
    rig.run(0.1);
    rig.checks_failed = TdCheck::TD_CHECK_LOG_SPACE.bits();
    rig.run(2.0);
    rig.key(Key::Char('8'));
    let screen = rig.screen(80, 24);
    assert!(screen.contains("[8Alarms]") && screen.contains("2 of 2 not seen"), "{screen}");
    assert_eq!(
        rig.model.pointed_at().map(|at| rig.model.alarms.list()[at].what.kind),
        Some(AlarmKind::NoLight)
    );
    rig.keys(&[Key::Up, Key::Char(' ')]);
    rig.run(0.1);
    let listed = rig.model.alarms.list().iter().map(|alarm| (alarm.what.kind, alarm.acknowledged));
    assert_eq!(listed.collect::<Vec<_>>(), [(AlarmKind::NoLight, true), (AlarmKind::VehicleLog, false)]);
    assert_eq!(rig.model.alarms.unacknowledged(), 1);
    rig.expect_event("alarm acknowledged: NO LIGHT");
    // On any other page Space acknowledges the alarm in the alarm line.
    rig.keys(&[Key::Char('1'), Key::Char(' ')]);
    assert_eq!(rig.model.alarms.unacknowledged(), 0);
}

#[test]
fn a_long_alarm_text_never_hides_the_key_that_acknowledges() {
    let mut rig = Rig::crewed();
    rig.msg(ground::update::Msg::LinkDown("no route to host ".repeat(9)));
    rig.run(1.0);
    for (columns, rows) in [(80, 24), (81, 24), (140, 45), (40, 12)] {
        let screen = rig.screen(columns, rows);
        let line = screen.lines().find(|line| line.contains("ALARM LINK DOWN")).unwrap_or_default();
        assert!(line.trim_end_matches('"').ends_with(" Space: seen "), "{screen}");
        assert!(line.contains(".., 1 s ago "), "the age is not cut either: {screen}");
        let identity = screen.lines().next().unwrap_or_default();
        assert!(identity.contains("boot 1A2B3C4D"), "nor is who it is: {screen}");
    }
}

/// A station on a wrong port says what it listens on and what to check, on the page and once as an
/// event.
#[test]
fn a_link_without_data_has_hints_on_the_main_page() {
    let mut rig = Rig::new(settings(false, true));
    rig.speaks = false;
    rig.run(4.0);
    assert_eq!(link_hints(&rig.model, rig.now), None);
    rig.run(3.0);
    for size in [(80, 24), (80, 22), (120, 40), (40, 12)] {
        let screen = rig.screen(size.0, size.1);
        assert!(screen.contains("Nothing received from system 1"), "{screen}");
        assert!(size.0 < 80 || screen.contains("fitted?"), "{screen}");
    }
    let screen = rig.screen(80, 24);
    assert!(screen.contains("It listens on 127.0.0.1:14550"), "{screen}");
    assert_eq!(rig.events().matches("Nothing received").count(), 1);
    rig.speaks = true;
    rig.run(2.0);
    assert_eq!(link_hints(&rig.model, rig.now), None);
}

/// A wrong key: an alarm with the number of frames, and the hint on the page.
#[test]
fn frames_refused_for_their_signature_raise_an_alarm_on_a_silent_link() {
    let counters = |wrong| Some(SigningCounters { wrong, ..SigningCounters::default() });
    let mut rig = Rig::new(settings(false, true));
    rig.speaks = false;
    for wrong in 1..=8 {
        rig.msg(Msg::Links { links: Vec::new(), signing: counters(wrong * 20) });
        rig.run(1.0);
    }
    let words = "160 frames REFUSED, wrong signature: is --key the vehicle's key?";
    assert_eq!(refused_frames(&rig.model, rig.now).as_deref(), Some(words));
    let alarm = rig.model.alarms.foremost().map(|alarm| (alarm.what.kind, alarm.what.text.as_str()));
    assert_eq!(alarm, Some((AlarmKind::Signatures, words)));
    assert!(rig.actions.contains(&Action::Bell));
    // Unknown senders beside a received vehicle ring no bell.
    let mut rig = Rig::crewed();
    rig.msg(Msg::Links { links: Vec::new(), signing: counters(500) });
    rig.run(1.0);
    assert!(!rig.model.alarms.list().iter().any(|alarm| alarm.what.kind == AlarmKind::Signatures));
}

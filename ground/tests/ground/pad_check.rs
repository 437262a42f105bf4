//! The checks on the pad as the crew sees them: keys, values, alarms, the radio range test, and the
//! book.

use std::time::Duration;

use crate::rig::{Rig, settings, typed};
use ground::key::Key;
use ground::model::{AlarmKind, LOSS_MOST, Model, Page, Role};
use ground::update::{Action, Msg};
use protocol::dialect::{
    BATTERY_STATUS_DATA, COMMAND_LONG_DATA, MavCmd, MavMessage, RADIO_STATUS_DATA, STORAGE_INFORMATION_DATA,
    SYS_STATUS_DATA, TD_PAD_CHECK_DATA, TIMESYNC_DATA, TdCheck, TdPadCheckItem as Item,
    TdPadCheckState as State, TdPadCheckVerdict as Verdict, TdPhase,
};
use protocol::identity::{Address, GROUND};

const CHECK: MavCmd = MavCmd::MAV_CMD_TD_PAD_CHECK;

/// The first parameters of the checks that were sent.
fn checks(rig: &mut Rig) -> Vec<f32> {
    let sent = rig.take_commands();
    let of = |sent: &COMMAND_LONG_DATA| (sent.command == CHECK).then_some(sent.param1);
    sent.iter().filter_map(of).collect()
}

/// Values of a check: gimbal pitch, one fin that is stuck, battery, pin.
type Value = (Item, f32, f32, f32, Verdict);

fn values() -> [Value; 9] {
    const NONE: f32 = f32::NAN;
    let (ok, no) = (Verdict::TD_PAD_CHECK_VERDICT_OK, Verdict::TD_PAD_CHECK_VERDICT_NOT_OK);
    [
        (Item::TD_PAD_CHECK_ITEM_GIMBAL_PITCH_RANGE, 0.2443, 0.2043, NONE, ok),
        (Item::TD_PAD_CHECK_ITEM_GIMBAL_PITCH_ERROR, 0.0044, NONE, 0.02, ok),
        (Item::TD_PAD_CHECK_ITEM_GIMBAL_PITCH_LAG, 0.025, NONE, 0.052, ok),
        (Item::TD_PAD_CHECK_ITEM_FIN_2_RANGE, 0.0, 1.53, NONE, no),
        (Item::TD_PAD_CHECK_ITEM_FIN_2_ERROR, 1.57, NONE, 0.02, no),
        (Item::TD_PAD_CHECK_ITEM_FIN_2_LAG, NONE, NONE, 0.05, no),
        (Item::TD_PAD_CHECK_ITEM_GRAVITY, 9.81, 9.3, 10.3, ok),
        (Item::TD_PAD_CHECK_ITEM_BATTERY_VOLTAGE, 8.31, 7.4, NONE, ok),
        (Item::TD_PAD_CHECK_ITEM_PIN_OUT, 0.0, NONE, NONE, Verdict::TD_PAD_CHECK_VERDICT_NOT_JUDGED),
    ]
}

/// The vehicle reports the first values of a check.
fn report(rig: &mut Rig, run: u16, state: State, found: usize) {
    report_values(rig, run, state, &values()[..found]);
}

fn report_values(rig: &mut Rig, run: u16, state: State, values: &[Value]) {
    for (place, (item, value, least, most, verdict)) in values.iter().copied().enumerate() {
        rig.receive(&MavMessage::TD_PAD_CHECK(TD_PAD_CHECK_DATA {
            boot_number: 0,
            time_boot_ms: rig.boot_ms(),
            value,
            least,
            most,
            run,
            item,
            verdict,
            state,
            progress: if state == State::TD_PAD_CHECK_STATE_RUNNING { 40 } else { 100 },
            place: place as u8,
            found: values.len() as u8,
            asked_by: 0,
        }));
    }
}

fn supply(rig: &mut Rig, millivolts: u16, percent: i8, space_mib: f32) {
    rig.receive(&MavMessage::SYS_STATUS(SYS_STATUS_DATA {
        voltage_battery: millivolts,
        battery_remaining: percent,
        ..SYS_STATUS_DATA::default()
    }));
    rig.receive(&MavMessage::STORAGE_INFORMATION(STORAGE_INFORMATION_DATA {
        time_boot_ms: rig.boot_ms(),
        available_capacity: space_mib,
        ..STORAGE_INFORMATION_DATA::default()
    }));
}

fn alarms(model: &Model) -> Vec<AlarmKind> {
    model.alarms.list().iter().filter(|alarm| alarm.is_active()).map(|alarm| alarm.what.kind).collect()
}

fn entered(rig: &Rig) -> String {
    let line = |action: &Action| match action {
        Action::Enter(line) => Some(format!("{}: {}", line.kind, line.text)),
        _ => None,
    };
    rig.actions.iter().filter_map(line).collect::<Vec<_>>().join("\n")
}

#[test]
fn a_check_takes_a_letter_and_enter_and_the_same_letter_ends_it() {
    let mut rig = Rig::crewed();
    rig.key(Key::Char('X'));
    assert_eq!(rig.model.page(), Page::Checks);
    rig.expect_screen("Gimbal and fins MOVE");
    rig.key(Key::Char('x'));
    assert!(checks(&mut rig).is_empty(), "any other key cancels");
    rig.keys(&[Key::Char('X'), Key::Enter]);
    assert_eq!(checks(&mut rig), [1.0]);
    rig.run(3.0);
    assert!(checks(&mut rig).is_empty(), "it is never repeated");
    rig.answer(CHECK, 0);
    report(&mut rig, 1, State::TD_PAD_CHECK_STATE_RUNNING, 2);
    rig.expect_screen("CHECK 1 RUNS 40 %: hands off");
    rig.key(Key::Char('X'));
    assert_eq!(checks(&mut rig), [0.0], "at once");
    rig.answer(CHECK, 0);
    report(&mut rig, 1, State::TD_PAD_CHECK_STATE_STOPPED, 2);
    rig.expect_screen("CHECK 1 STOPPED early");
    rig.keys(&[Key::Char('X'), Key::Enter]);
    assert!(checks(&mut rig).is_empty(), "pressed to end it, a moment too late");
    rig.run(3.0);
    rig.keys(&[Key::Char('E'), Key::Enter]);
    assert_eq!(checks(&mut rig), [2.0], "without motion");
    assert!(alarms(&rig.model).is_empty(), "{:?}", rig.model.alarms.list());
}

/// Servos that tell nothing: while they move and afterwards the page says what people see, and one
/// person's word takes a word.
#[test]
fn what_only_people_see_is_on_the_page_and_takes_a_letter_and_a_word() {
    let shown = Verdict::TD_PAD_CHECK_VERDICT_NOT_JUDGED;
    let silent = [
        (Item::TD_PAD_CHECK_ITEM_GIMBAL_PITCH_RANGE, f32::NAN, f32::NAN, f32::NAN, shown),
        (Item::TD_PAD_CHECK_ITEM_FIN_1_RANGE, f32::NAN, f32::NAN, f32::NAN, shown),
    ];
    let mut rig = Rig::crewed();
    rig.key(Key::Char('x'));
    rig.keys(&[Key::Char('Y')]);
    rig.expect_event("no check of servos without feedback has passed");
    rig.run(3.0);
    report_values(&mut rig, 1, State::TD_PAD_CHECK_STATE_RUNNING, &silent[..1]);
    let words = "gimbal pitch nozzle swings towards fins 1 and 4, then towards 2 and 3";
    rig.expect_screen(words);
    report_values(&mut rig, 1, State::TD_PAD_CHECK_STATE_PASSED, &silent);
    let screen = rig.screen(80, 24);
    assert!(screen.contains("CHECK 1 PASSED but for what only people see"), "{screen}");
    assert!(screen.contains("fin 4        fin 4 alone opens fully, then closes"), "{screen}");
    assert!(checks(&mut rig).is_empty());
    rig.key(Key::Char('Y'));
    let screen = rig.screen(80, 24);
    assert!(screen.contains("SEEN, in this order and nothing else?"), "{screen}");
    rig.keys(&[Key::Char('S'), Key::Char('E'), Key::Char('E'), Key::Char('N'), Key::Enter]);
    assert_eq!(checks(&mut rig), [3.0]);
    rig.run(3.0);
    assert!(checks(&mut rig).is_empty(), "one word is one person's");
}

#[test]
fn the_letter_ends_a_check_without_a_report() {
    let mut rig = Rig::crewed();
    rig.keys(&[Key::Char('X'), Key::Enter]);
    assert_eq!(checks(&mut rig), [1.0]);
    rig.expect_screen("HANDS OFF: a check of the vehicle may run");
    assert!(rig.screen(20, 5).contains(" HANDS OFF: a check"), "{}", rig.screen(20, 5));
    rig.key(Key::Char('X'));
    assert_eq!(checks(&mut rig), [0.0], "no dialog, and no second start");
}

#[test]
fn an_armed_or_a_flying_vehicle_gets_no_check_request() {
    let mut rig = Rig::crewed();
    rig.armed = true;
    rig.phase = TdPhase::TD_PHASE_PAD_ARMED;
    rig.run(1.0);
    rig.keys(&[Key::Char('X'), Key::Enter, Key::Char('E'), Key::Enter, Key::Char('U')]);
    rig.expect_event("cannot check: armed: disarm first");
    rig.expect_event("no radio range test: armed");
    (rig.armed, rig.phase) = (false, TdPhase::TD_PHASE_TOUCHDOWN);
    rig.run(1.0);
    rig.keys(&[Key::Char('X'), Key::Enter]);
    assert!(checks(&mut rig).is_empty());
    rig.expect_event("cannot check: phase TOUCHDOWN");
}

#[test]
fn every_value_is_shown_with_its_limit_and_the_book_has_the_verdict() {
    let mut rig = Rig::crewed();
    rig.key(Key::Char('x'));
    supply(&mut rig, 8_310, 97, 3_072.0);
    let screen = rig.screen(80, 24);
    assert!(screen.contains("no check yet") && screen.contains("battery 8.31 V, 97 %"), "{screen}");
    assert!(screen.contains("vehicle's log 3072 MiB free"), "{screen}");
    report(&mut rig, 1, State::TD_PAD_CHECK_STATE_RUNNING, 4);
    assert!(!entered(&rig).contains("check of the vehicle"), "not before its end");
    report(&mut rig, 1, State::TD_PAD_CHECK_STATE_FAILED, 9);
    report(&mut rig, 1, State::TD_PAD_CHECK_STATE_FAILED, 9);
    insta::assert_snapshot!("pad_check_failed_80x24", rig.screen(80, 24));
    let book = entered(&rig);
    assert_eq!(book.matches("check of the vehicle").count(), 1, "{book}");
    let words = "check 1 FAILED: 9 values, outside: fin 2 range 0.0 deg (least 87.7); fin 2 error 90.0 deg";
    assert!(book.contains(words), "{book}");
    rig.expect_event(words);
    // Another check forgets the values of this one.
    report(&mut rig, 2, State::TD_PAD_CHECK_STATE_RUNNING, 1);
    assert!(!rig.screen(80, 24).contains("NO 0.0"), "{}", rig.screen(80, 24));
}

/// A step of the checklist may ask for it: known only of a whole check.
#[test]
fn the_failures_of_a_check_are_a_value_like_any_other() {
    let failures = ground::model::quantity::Quantity::named("check failures").unwrap();
    let mut rig = Rig::crewed();
    report(&mut rig, 1, State::TD_PAD_CHECK_STATE_RUNNING, 4);
    assert!(failures.read(&rig.model, rig.now).is_none());
    report(&mut rig, 1, State::TD_PAD_CHECK_STATE_FAILED, 9);
    assert_eq!(failures.read(&rig.model, rig.now).map(|sample| sample.value), Some(3.0));
    report(&mut rig, 2, State::TD_PAD_CHECK_STATE_STOPPED, 4);
    assert!(failures.read(&rig.model, rig.now).is_none());
}

#[test]
fn a_low_battery_and_a_full_storage_are_alarms_outside_a_check_too() {
    let mut rig = Rig::crewed();
    supply(&mut rig, 8_310, 97, 3_072.0);
    rig.run(0.5);
    assert!(alarms(&rig.model).is_empty());
    // By the limits of the vehicle, on its pad.
    supply(&mut rig, 7_310, 20, 40.0);
    rig.checks_failed = (TdCheck::TD_CHECK_BATTERY | TdCheck::TD_CHECK_LOG_SPACE).bits();
    rig.run(0.5);
    assert_eq!(alarms(&rig.model), [AlarmKind::Battery, AlarmKind::VehicleLog]);
    let text = &rig.model.alarms.list()[1].what.text;
    assert_eq!(text, "VEHICLE LOG has too little space: 40 MiB");
    rig.key(Key::Char(' '));
    rig.expect_screen("BATTERY LOW: 7.31 V, 20 % left");
    for (id, millivolts) in [(1, 11_040), (0, 7_310)] {
        let mut voltages = [u16::MAX; 10];
        voltages[0] = millivolts;
        let pack = BATTERY_STATUS_DATA { id, voltages, ..BATTERY_STATUS_DATA::default() };
        rig.receive(&MavMessage::BATTERY_STATUS(pack));
    }
    rig.run(0.5);
    rig.expect_screen("BATTERY LOW: 7.3/11.0 V, 20 % left");
    // In the air by what is left.
    (rig.checks_failed, rig.phase) = (0, TdPhase::TD_PHASE_AERO_DESCENT);
    rig.run(0.5);
    assert!(alarms(&rig.model).is_empty());
    supply(&mut rig, 7_010, 9, 40.0);
    rig.run(0.5);
    assert_eq!(alarms(&rig.model), [AlarmKind::Battery]);
    // A vehicle that knows of no battery.
    supply(&mut rig, u16::MAX, -1, 40.0);
    rig.run(0.5);
    assert!(alarms(&rig.model).is_empty());
}

/// Runs a range test in which the vehicle answers all but one of so many questions.
fn range_test(rig: &mut Rig, unanswered_of: usize) {
    rig.key(Key::Char('U'));
    let mut questions = 0;
    for _ in 0..340 {
        rig.run(0.1);
        let requests: Vec<TIMESYNC_DATA> = rig
            .actions
            .drain(..)
            .filter_map(|action| match action {
                Action::Send(message) => match *message {
                    MavMessage::TIMESYNC(sync) if sync.tc1 == 0 => Some(sync),
                    _ => None,
                },
                _ => None,
            })
            .collect();
        for sync in requests {
            questions += 1;
            if unanswered_of == 0 || questions % unanswered_of != 0 {
                rig.receive(&MavMessage::TIMESYNC(TIMESYNC_DATA {
                    tc1: 1,
                    target_system: GROUND.system_id,
                    target_component: GROUND.component_id,
                    ..sync
                }));
            }
        }
        rig.receive_from(
            Address { system_id: 51, component_id: 68 },
            &MavMessage::RADIO_STATUS(RADIO_STATUS_DATA {
                rssi: 110,
                remrssi: 100,
                noise: 50,
                remnoise: 50,
                ..RADIO_STATUS_DATA::default()
            }),
        );
    }
}

#[test]
fn the_radio_is_tested_with_a_margin_and_a_verdict() {
    let mut rig = Rig::crewed();
    range_test(&mut rig, 0);
    let screen = rig.screen(80, 24);
    assert!(screen.contains("RADIO PASSED"), "{screen}");
    let found = rig.model.range_test.as_ref().and_then(|test| test.found).unwrap();
    assert_eq!(found.margin_db, Some((100.0 - 50.0) / 1.9), "26.3 dB at the worse end");
    rig.expect_event("radio range test PASSED: loss down 0.0 %, up 0.0 %");
    let mut rig = Rig::crewed();
    range_test(&mut rig, 10);
    let found = rig.model.range_test.as_ref().and_then(|test| test.found).unwrap();
    assert!(!found.passed() && found.loss_up > LOSS_MOST && found.loss_down <= LOSS_MOST, "{found:?}");
}

#[test]
fn a_standstill_of_the_station_ends_the_radio_test() {
    let mut rig = Rig::crewed();
    rig.key(Key::Char('U'));
    rig.run(2.0);
    rig.msg(Msg::StoodStill(Duration::from_secs(3)));
    rig.expect_event("this station stood still for 3 s: what waited is in the log only");
    rig.expect_event("radio range test STOPPED, this station stood still");
    assert_eq!(
        rig.model.range_test.as_ref().and_then(|test| test.found).map(|found| found.passed()),
        Some(false)
    );
}

#[test]
fn an_arming_ends_the_radio_test() {
    let mut rig = Rig::crewed();
    rig.key(Key::Char('U'));
    rig.run(2.0);
    rig.expect_screen("RADIO RUNS");
    rig.armed = true;
    rig.phase = TdPhase::TD_PHASE_PAD_ARMED;
    rig.run(1.5);
    rig.expect_event("radio range test STOPPED, the vehicle is armed");
}

#[test]
fn a_screen_that_only_watches_checks_nothing() {
    let mut settings = settings(false, true);
    settings.role = Role::Watching;
    let mut rig = Rig::new(settings);
    rig.model.alarms.history_ends();
    rig.run(1.0);
    rig.keys(&[typed("X"), vec![Key::Enter], typed("U")].concat());
    assert!(checks(&mut rig).is_empty() && rig.model.range_test.is_none());
    rig.expect_event("this screen only watches");
}

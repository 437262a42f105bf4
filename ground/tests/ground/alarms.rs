//! Alarms: rung until seen, never by colour alone; what is too old or too late says so.

use ground::key::Key;
use ground::model::alarm::{AlarmKind, RING_EVERY};
use ground::model::command::CommandKind;
use ground::model::{Role, Settings};
use ground::update::Action;
use protocol::dialect::{MavCmd, TdAbortEffect, TdControlLevel, TdInterlock, TdPhase};

use crate::bench::{Bench, settings};
use crate::hand::ladder;

fn bells(bench: &Bench) -> usize {
    bench.actions.iter().filter(|action| **action == Action::Bell).count()
}

#[test]
fn the_loss_of_the_link_rings_until_it_is_acknowledged() {
    let mut bench = Bench::crewed();
    bench.actions.clear();
    bench.speaks = false;
    bench.run(3.0);
    assert_eq!(bells(&bench), 0);
    bench.run(0.1);
    assert_eq!(bells(&bench), 1);
    assert!(bench.screen(80, 24).contains("ALARM LINK LOST"));
    assert!(bench.screen(20, 5).contains("ALARM LINK LOST"));
    bench.run(RING_EVERY.as_secs_f64());
    assert_eq!(bells(&bench), 2);
    bench.key(Key::Char(' '));
    bench.run(20.0);
    assert_eq!(bells(&bench), 2);
    assert!(bench.screen(80, 24).contains("alarm seen: LINK LOST"), "it still holds");
    bench.speaks = true;
    bench.run(1.1);
    assert!(bench.model.alarms.list().is_empty());
}

#[test]
fn an_alarm_that_is_over_stays_until_it_was_seen() {
    let mut bench = Bench::crewed();
    bench.speaks = false;
    bench.run(5.0);
    bench.speaks = true;
    bench.run(2.0);
    let screen = bench.screen(80, 24);
    assert!(screen.contains(" ended alarm: LINK LOST") && screen.contains(" ended 1 s ago"), "{screen}");
    bench.key(Key::Char(' '));
    assert!(!bench.screen(80, 24).contains("ALARM"));
}

/// A screen that attaches, or attaches again, is told everything from the start: it rings for what holds, not for
/// what was.
#[test]
fn attaching_rings_no_old_bells() {
    let attached = |seconds_after: f64| {
        let mut bench = Bench::new(Settings { role: Role::Attached, ..settings(false, true) });
        bench.run(1.0);
        bench.speaks = false;
        bench.run(30.0);
        bench.speaks = true;
        bench.run(seconds_after);
        assert_eq!(bells(&bench), 0, "the past rings");
        bench.model.history_ends();
        bench
    };
    let mut over = attached(60.0);
    over.run(30.0);
    assert_eq!(bells(&over), 0);
    let screen = over.screen(80, 24);
    assert!(screen.contains(" past alarm: LINK LOST: the vehicle is not heard ended 89 s ago"), "{screen}");
    over.speaks = false;
    over.run(5.0);
    assert_eq!(bells(&over), 1, "lost anew");
    assert!(over.screen(80, 24).contains("ALARM LINK LOST"));
    let mut lasting = attached(0.0);
    lasting.speaks = false;
    lasting.run(0.1);
    assert_eq!(bells(&lasting), 1, "it still holds");
}

#[test]
fn disagreement_between_acknowledged_and_observed_is_an_alarm() {
    let mut bench = Bench::crewed();
    bench.keys(&ladder());
    bench.answer(MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, 0);
    bench.run(4.0);
    let kinds: Vec<_> = bench.model.alarms.list().iter().map(|alarm| alarm.kind).collect();
    assert_eq!(kinds, [AlarmKind::Disagreement(CommandKind::Arm)]);
}

#[test]
fn what_the_vehicle_latches_is_an_alarm() {
    let mut bench = Bench::crewed();
    bench.interlocks |= TdInterlock::TD_INTERLOCK_NO_LIGHT;
    bench.run(0.1);
    assert!(bench.screen(80, 24).contains("ALARM NO LIGHT"));
}

/// Until the first plan acts the stabiliser flies by design; a stabiliser that goes on flying is an alarm.
#[test]
fn a_stabiliser_that_goes_on_flying_is_an_alarm_and_its_first_moment_is_none() {
    let stabiliser = TdControlLevel::TD_CONTROL_LEVEL_STABILISER;
    let mut bench = Bench::crewed();
    bench.phase = TdPhase::TD_PHASE_POWERED;
    bench.run(0.1);
    bench.controller(stabiliser);
    assert!(bench.model.alarms.list().is_empty());
    bench.run(0.3);
    bench.controller(stabiliser);
    assert!(bench.screen(80, 24).contains("ALARM DEGRADED"), "{}", bench.screen(80, 24));
    let mut bench = Bench::crewed();
    bench.phase = TdPhase::TD_PHASE_POWERED;
    bench.run(0.1);
    bench.controller(stabiliser);
    bench.run(0.1);
    bench.controller(TdControlLevel::TD_CONTROL_LEVEL_CONVERGED);
    bench.run(2.0);
    assert!(bench.model.alarms.list().is_empty());
}

#[test]
fn an_abort_without_an_answer_is_an_alarm_while_it_is_repeated() {
    let mut bench = Bench::crewed();
    bench.abort_chord();
    bench.run(3.0);
    assert!(bench.screen(80, 24).contains("ABORT NOT ACKNOWLEDGED"));
    bench.answer(MavCmd::MAV_CMD_DO_FLIGHTTERMINATION, 0);
    bench.key(Key::Char(' '));
    bench.run(0.1);
    assert!(bench.model.alarms.list().is_empty());
}

#[test]
fn an_abort_that_would_arrive_too_late_says_so() {
    let mut bench = Bench::crewed();
    bench.phase = TdPhase::TD_PHASE_AERO_DESCENT;
    bench.abort_effect = TdAbortEffect::TD_ABORT_EFFECT_CHUTE_NOW;
    bench.run(1.0);
    bench.descent(180.0);
    assert!(bench.screen(80, 24).contains("abort now: parachute NOW, landing motor inhibited"));
    // 5 m above the commit height at 21.5 m/s: 0.23 s.
    bench.descent(100.0);
    assert!(bench.screen(80, 24).contains("abort now: TOO LATE for a chute"));
    // 0.2 s to ignition.
    bench.descent(62.0);
    assert!(bench.screen(80, 24).contains("abort now: TOO LATE: arrives after ignition, lands here"));
    for effect in [TdAbortEffect::TD_ABORT_EFFECT_BURN, TdAbortEffect::TD_ABORT_EFFECT_IMPACT] {
        bench.abort_effect = effect;
        bench.run(0.5);
        bench.descent(62.0);
        assert!(bench.screen(80, 24).contains("abort now: TOO LATE: arrives after ignition, lands here"));
    }
    bench.phase = TdPhase::TD_PHASE_POWERED;
    bench.abort_effect = TdAbortEffect::TD_ABORT_EFFECT_LAND_HERE;
    bench.run(2.0);
    assert!(bench.screen(80, 24).contains("abort now: lands here"));
}

#[test]
fn after_the_loss_of_the_link_the_position_is_a_prediction_that_grows_uncertain() {
    let mut bench = Bench::crewed();
    bench.phase = TdPhase::TD_PHASE_AERO_DESCENT;
    bench.run(1.0);
    bench.state(1.0, 60.0, 0.0, -5.0, 90.0);
    bench.speaks = false;
    bench.run(2.0);
    let early = bench.screen(80, 24);
    assert!(early.contains("PREDICTED, not heard") && early.contains("free fall"), "{early}");
    // 60 - 5 t - g t^2 / 2 at 2 s, and 1.5 + 0.5 t + 2.5 t^2: the drag is not known.
    assert!(early.contains("30.4 ±12.5 m"), "{early}");
    bench.run(1.0);
    assert!(bench.screen(80, 24).contains("0.9 ±25.5 m"));
}

/// Two alarms: one Space, one alarm seen; the list says which is next, and another can be chosen.
#[test]
fn each_alarm_is_listed_and_acknowledged_by_itself() {
    let mut bench = Bench::crewed();
    bench.interlocks |= TdInterlock::TD_INTERLOCK_NO_LIGHT;
    bench.run(0.1);
    bench.interlocks |= TdInterlock::TD_INTERLOCK_DEGRADED;
    bench.run(2.0);
    bench.key(Key::Char('9'));
    let screen = bench.screen(80, 24);
    assert!(screen.contains("[9Alarms]") && screen.contains("2 of 2 not seen"), "{screen}");
    assert!(
        screen.contains(">ALARM        DEGRADED") && screen.contains(" ALARM        NO LIGHT"),
        "{screen}"
    );
    bench.keys(&[Key::Up, Key::Char(' ')]);
    bench.run(0.1);
    let screen = bench.screen(80, 24);
    assert!(screen.contains("alarm seen:  NO LIGHT") && screen.contains("ALARM        DEGRADED"), "{screen}");
    assert_eq!(bench.model.alarms.unacknowledged(), 1);
    assert!(bench.events().contains("alarm acknowledged: NO LIGHT"));
    // On any other screen the one of the alarm line.
    bench.keys(&[Key::Char('1'), Key::Char(' ')]);
    assert_eq!(bench.model.alarms.unacknowledged(), 0);
}

#[test]
fn the_key_that_acknowledges_is_never_what_is_cut() {
    let mut bench = Bench::crewed();
    bench.msg(ground::update::Msg::LinkDown("no route to host ".repeat(9)));
    bench.run(1.0);
    for (columns, rows) in [(80, 24), (81, 24), (140, 45), (40, 12)] {
        let screen = bench.screen(columns, rows);
        let line = screen.lines().find(|line| line.contains("ALARM LINK DOWN")).unwrap_or_default();
        assert!(line.trim_end_matches('"').ends_with(" Space: seen "), "{screen}");
        assert!(line.contains(".. 1 s "), "the age is not cut either: {screen}");
    }
}

/// The age is that of the present alarm, not of one before it that nobody saw.
#[test]
fn an_alarm_that_is_raised_anew_begins_its_age_anew() {
    let mut bench = Bench::crewed();
    bench.speaks = false;
    bench.run(20.0);
    bench.speaks = true;
    bench.run(21.0);
    let screen = bench.screen(80, 24);
    assert!(screen.contains("ended alarm: LINK LOST") && screen.contains("ended 20 s ago"), "{screen}");
    bench.speaks = false;
    bench.run(5.0);
    let screen = bench.screen(80, 24);
    assert!(screen.contains(" ALARM LINK LOST: the vehicle is not heard 1 s "), "{screen}");
}

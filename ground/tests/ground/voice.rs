//! Callouts: which lines the crew's voice gets, and which bells ring without it.

use std::time::Duration;

use ground::model::{Amount, Talk};
use ground::update::Action;
use protocol::dialect::{TdCheck, TdLimit, TdMotor, TdPhase};

use crate::rig::{Rig, settings};

fn rig(amount: Amount, has_voice: bool) -> Rig {
    let mut settings = settings(false, true);
    settings.talk = Talk { amount, has_voice, height_every: Duration::from_millis(500) };
    let mut rig = Rig::new(settings);
    rig.run(1.0);
    rig.actions.clear();
    rig
}

fn called_out(rig: &mut Rig) -> Vec<String> {
    let called_out = std::mem::take(&mut rig.actions).into_iter().filter_map(|action| match action {
        Action::CallOut(text) => Some(text),
        _ => None,
    });
    called_out.collect()
}

/// Up to 120 m and down again to the ground, then the verdict.
fn fly(rig: &mut Rig) {
    rig.phase = TdPhase::TD_PHASE_BOOST;
    for up in (0..=120).step_by(5) {
        rig.run(0.1);
        rig.state(0.0, up as f32, 0.0, 50.0, 90.0);
    }
    rig.phase = TdPhase::TD_PHASE_COAST;
    rig.run(0.5);
    rig.phase = TdPhase::TD_PHASE_AERO_DESCENT;
    for up in (30..120).rev().step_by(2) {
        rig.run(0.1);
        rig.state(0.0, up as f32, 0.0, -20.0, 90.0);
    }
    for (phase, from) in [(TdPhase::TD_PHASE_IGNITION, 30), (TdPhase::TD_PHASE_POWERED, 25)] {
        rig.phase = phase;
        for up in (from - 25..from).rev() {
            rig.run(0.1);
            rig.state(0.0, up as f32, 0.0, -5.0, 90.0);
        }
    }
    rig.phase = TdPhase::TD_PHASE_TOUCHDOWN;
    (rig.motor, rig.approach_wait_s) = (TdMotor::TD_MOTOR_HOT, 60);
    rig.run(0.5);
    rig.verdict(true, TdLimit::empty());
    rig.run(0.5);
}

#[test]
fn a_flight_is_called_out_from_liftoff_to_verdict() {
    let mut rig = rig(Amount::Normal, true);
    fly(&mut rig);
    let expected = [
        "ignition commanded",
        "liftoff",
        "50 metres",
        "100 metres",
        "coast",
        "apogee",
        "100 metres",
        "50 metres",
        "ignition",
        "powered",
        "touchdown",
        "do not approach",
        "stands undamaged",
    ];
    assert_eq!(called_out(&mut rig), expected);
}

#[test]
fn more_or_less_is_called_out_as_the_crew_wants() {
    let mut few = rig(Amount::Few, true);
    fly(&mut few);
    assert_eq!(
        called_out(&mut few),
        ["liftoff", "apogee", "ignition", "touchdown", "do not approach", "stands undamaged"]
    );
    let mut all = rig(Amount::All, true);
    fly(&mut all);
    let all = called_out(&mut all);
    assert!(
        ["40 metres", "30 metres", "20 metres", "10 metres"]
            .iter()
            .all(|text| all.iter().any(|called_out| called_out == text)),
        "{all:?}"
    );
    let mut nothing = rig(Amount::Nothing, true);
    fly(&mut nothing);
    assert!(called_out(&mut nothing).is_empty());
}

#[test]
fn heights_are_called_out_with_a_minimum_interval() {
    let mut settings = settings(false, true);
    settings.talk = Talk { amount: Amount::All, has_voice: true, height_every: Duration::from_secs(3) };
    let mut rig = Rig::new(settings);
    rig.run(1.0);
    fly(&mut rig);
    let heights = called_out(&mut rig).iter().filter(|text| text.ends_with("metres")).count();
    assert!((3..=5).contains(&heights), "{heights} in 12 s");
}

#[test]
fn no_go_and_a_lost_link_are_called_out_once() {
    let mut rig = rig(Amount::Few, true);
    rig.checks_failed = TdCheck::TD_CHECK_IGNITER.bits();
    rig.run(2.0);
    assert_eq!(called_out(&mut rig), ["no go: igniter"]);
    rig.checks_failed = 0;
    rig.run(2.0);
    rig.speaks = false;
    rig.run(8.0);
    let called_out = called_out(&mut rig);
    assert_eq!(called_out.iter().filter(|text| *text == "link lost").count(), 1, "{called_out:?}");
}

/// Without a voice bells can be counted: one a tick, and more of them for what is worse.
#[test]
fn without_a_voice_bells_differ() {
    let bells = |rig: &mut Rig| {
        let actions = std::mem::take(&mut rig.actions);
        assert!(!actions.iter().any(|action| matches!(action, Action::CallOut(_))));
        actions.iter().filter(|action| **action == Action::Bell).count()
    };
    let mut rig = rig(Amount::Normal, false);
    rig.phase = TdPhase::TD_PHASE_BOOST;
    rig.run(1.0);
    assert_eq!(bells(&mut rig), 0, "it has not moved");
    rig.state(0.0, 2.0, 0.0, 12.0, 90.0);
    rig.run(1.0);
    assert_eq!(bells(&mut rig), 2, "liftoff");
    rig.phase = TdPhase::TD_PHASE_COAST;
    rig.run(0.5);
    assert_eq!(bells(&mut rig), 0, "a phase alone does not ring");
    rig.phase = TdPhase::TD_PHASE_DEPLOY;
    rig.run(0.5);
    assert_eq!(bells(&mut rig), 1, "apogee");
}

/// A screen that attaches late does not call out the past.
#[test]
fn the_past_is_not_called_out() {
    let mut settings = settings(false, true);
    settings.role = ground::model::Role::Attached;
    settings.talk.has_voice = true;
    let mut rig = Rig::new(settings);
    rig.run(1.0);
    rig.phase = TdPhase::TD_PHASE_BOOST;
    rig.run(1.0);
    rig.model.alarms.history_ends();
    assert!(called_out(&mut rig).is_empty());
    rig.phase = TdPhase::TD_PHASE_COAST;
    rig.run(1.0);
    assert_eq!(called_out(&mut rig), ["coast"]);
}

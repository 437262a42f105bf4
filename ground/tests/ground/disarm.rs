//! Disarming, and late answers to an arming: both have the command number 400.

use crate::keys::ladder;
use crate::rig::{Rig, is_arm};
use ground::key::Key;
use ground::model::{Acknowledgement, CommandKind};
use protocol::dialect::{COMMAND_LONG_DATA, MavCmd, TdPhase};
use protocol::identity::GROUND;

const ARM: MavCmd = MavCmd::MAV_CMD_COMPONENT_ARM_DISARM;
const ACCEPTED: u8 = 0;
const DENIED: u8 = 2;

fn is_disarm(command: &COMMAND_LONG_DATA) -> bool {
    command.command == ARM && command.param1 < 0.5
}

/// Both have the command number 400. An answer to the arming that arrives after the disarm was sent
/// says nothing about the disarm.
#[test]
fn a_late_answer_to_an_arming_does_not_end_the_disarm() {
    // Disarms while the arming still waits for its answer, and after it was given up.
    for (pause_s, result) in [(0.2, ACCEPTED), (0.2, DENIED), (3.0, ACCEPTED)] {
        let mut rig = Rig::crewed();
        rig.keys(&ladder());
        rig.run(pause_s);
        rig.keys(&[Key::Char('D'), Key::Enter]);
        let sent = rig.take_commands();
        assert!(sent.iter().filter(|command| is_disarm(command)).count() == 1, "{sent:?}");
        let number = sent.iter().find(|command| is_arm(command)).unwrap().param2 as i32;
        rig.answer_with(GROUND, ARM, result, number);
        rig.armed = result == ACCEPTED;
        let disarm = rig.model.commands.of(CommandKind::Disarm).unwrap();
        assert_eq!(disarm.acknowledged, Acknowledgement::Waiting);
        let arm = rig.model.commands.of(CommandKind::Arm).unwrap();
        assert_eq!(arm.acknowledged, Acknowledgement::Answered(result));
        rig.run(0.6);
        let sent = rig.take_commands();
        assert!(sent.iter().all(is_disarm) && sent.len() >= 3, "the first was lost, so it is repeated");
        rig.answer(ARM, ACCEPTED);
        rig.armed = false;
        rig.run(3.0);
        assert!(rig.take_commands().is_empty(), "its own answer ends it");
        let disarm = rig.model.commands.of(CommandKind::Disarm).unwrap();
        assert!(disarm.accepted() && disarm.observed_at.is_some());
    }
}

#[test]
fn a_disarm_is_repeated_until_the_vehicle_answers_or_flies() {
    let disarms = |rig: &mut Rig| rig.take_commands().iter().filter(|sent| is_disarm(sent)).count();
    let unanswered = || {
        let mut rig = Rig::crewed();
        rig.armed = true;
        rig.run(1.0);
        rig.keys(&[Key::Char('D'), Key::Enter]);
        rig.run(10.0);
        rig.expect_screen("DISARM NOT ACKNOWLEDGED yet; repeated");
        assert!(disarms(&mut rig) > 40);
        rig
    };
    let mut rig = unanswered();
    rig.answer(ARM, ACCEPTED);
    rig.armed = false;
    rig.run(1.0);
    disarms(&mut rig);
    rig.run(5.0);
    assert_eq!(disarms(&mut rig), 0, "it is answered");
    let mut rig = unanswered();
    rig.phase = TdPhase::TD_PHASE_BOOST;
    rig.run(1.0);
    rig.expect_event("DISARM TOO LATE: the vehicle flies");
    disarms(&mut rig);
    rig.run(5.0);
    assert_eq!(disarms(&mut rig), 0);
}

/// After an answered arming, the next answer belongs to the disarm.
#[test]
fn a_disarm_after_an_answered_arming_ends_with_its_first_answer() {
    let mut rig = Rig::crewed();
    rig.keys(&ladder());
    rig.answer(ARM, ACCEPTED);
    rig.keys(&[Key::Char('D'), Key::Enter]);
    rig.answer(ARM, ACCEPTED);
    rig.take_commands();
    rig.run(5.0);
    assert!(rig.take_commands().is_empty());
    assert!(!rig.events().contains("ARM acknowledged, not observed"), "it is no longer expected");
}

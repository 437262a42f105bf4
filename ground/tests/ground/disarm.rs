//! The disarming, and the answers to an arming that come after it: both are command 400.

use crate::bench::Bench;
use crate::hand::ladder;
use ground::key::Key;
use ground::model::command::{Acknowledged, CommandKind};
use protocol::dialect::{COMMAND_LONG_DATA, MavCmd};

const ARM: MavCmd = MavCmd::MAV_CMD_COMPONENT_ARM_DISARM;
const ACCEPTED: u8 = 0;
const DENIED: u8 = 2;

fn is_disarm(command: &COMMAND_LONG_DATA) -> bool {
    command.command == ARM && command.param1 < 0.5
}

/// Both are command 400: the answer to the arming that arrives after the disarming was sent says nothing
/// about the disarming.
#[test]
fn the_late_answer_to_an_arming_does_not_end_the_disarming() {
    // Disarmed while the arming still waits for its answer, and after it was given up.
    for (pause_s, result) in [(0.2, ACCEPTED), (0.2, DENIED), (3.0, ACCEPTED)] {
        let mut bench = Bench::crewed();
        bench.keys(&ladder());
        bench.run(pause_s);
        bench.keys(&[Key::Char('D'), Key::Enter]);
        let sent = bench.take_commands();
        assert!(sent.iter().filter(|command| is_disarm(command)).count() == 1, "{sent:?}");
        bench.answer(ARM, result);
        bench.armed = result == ACCEPTED;
        let disarm = bench.model.commands.of(CommandKind::Disarm).unwrap();
        assert_eq!(disarm.acknowledged, Acknowledged::Waiting);
        let arm = bench.model.commands.of(CommandKind::Arm).unwrap();
        assert_eq!(arm.acknowledged, Acknowledged::Answered(result));
        bench.run(0.6);
        let sent = bench.take_commands();
        assert!(sent.len() == 1 && is_disarm(&sent[0]), "the first was lost, so it is sent again: {sent:?}");
        bench.answer(ARM, ACCEPTED);
        bench.armed = false;
        bench.run(3.0);
        assert!(bench.take_commands().is_empty(), "its own answer ends it");
        let disarm = bench.model.commands.of(CommandKind::Disarm).unwrap();
        assert!(disarm.accepted() && disarm.observed_at.is_some());
    }
}

#[test]
fn a_disarming_without_an_answer_is_given_up_after_its_tries() {
    let mut bench = Bench::crewed();
    bench.keys(&ladder());
    bench.keys(&[Key::Char('D'), Key::Enter]);
    bench.run(5.0);
    assert_eq!(bench.take_commands().iter().filter(|command| is_disarm(command)).count(), 4);
    assert!(bench.events().contains("DISARM not acknowledged after 4 attempts"));
}

/// An arming that was answered leaves nothing outstanding: the next answer is the disarming's.
#[test]
fn a_disarming_after_an_answered_arming_ends_with_its_first_answer() {
    let mut bench = Bench::crewed();
    bench.keys(&ladder());
    bench.answer(ARM, ACCEPTED);
    bench.keys(&[Key::Char('D'), Key::Enter]);
    bench.answer(ARM, ACCEPTED);
    bench.take_commands();
    bench.run(5.0);
    assert!(bench.take_commands().is_empty());
    assert!(!bench.events().contains("ARM acknowledged, not observed"), "nobody expects it any more");
}

//! Who commands: seats in the record, two hands at once, and a countdown that nobody attends.

use ground::model::Settings;
use ground::model::command::CommandKind;
use ground::model::seat::Seat;
use ground::update::{Action, Msg};
use protocol::dialect::{MavCmd, TdPhase};
use protocol::log::record::Record;

use crate::bench::{Bench, is_arm, settings};
use crate::hand::ladder;

const ARM: MavCmd = MavCmd::MAV_CMD_COMPONENT_ARM_DISARM;
const START: MavCmd = MavCmd::MAV_CMD_MISSION_START;
const HOLD: MavCmd = MavCmd::MAV_CMD_DO_PAUSE_CONTINUE;

fn anna() -> Seat {
    Seat::new(1, "anna on pts/3")
}

fn ben() -> Seat {
    Seat::new(2, "ben from 10.0.0.7")
}

fn requested(kind: CommandKind, by: Seat) -> Msg {
    Msg::Requested { kind, by }
}

/// A station with Anna at its own screen.
fn with_anna() -> Bench {
    let mut bench = Bench::new(Settings { seat: anna(), ..settings(false, true) });
    bench.msg(Msg::Crew(vec![anna()]));
    bench.run(1.0);
    bench.take_commands();
    bench
}

fn records(bench: &Bench) -> String {
    let detail = |action: &Action| match action {
        Action::Record(Record::OperatorAction(action)) => Some(format!("{}: {}", action.kind, action.detail)),
        _ => None,
    };
    bench.actions.iter().filter_map(detail).collect::<Vec<_>>().join("\n")
}

#[test]
fn each_command_names_its_screen_and_operator_in_event_and_record() {
    let mut bench = with_anna();
    bench.keys(&ladder());
    assert!(
        bench.events().contains("ARM commanded, attempt 1 (screen 1, anna on pts/3)"),
        "{}",
        bench.events()
    );
    bench.answer(ARM, 0);
    bench.armed = true;
    bench.phase = TdPhase::TD_PHASE_PAD_ARMED;
    bench.run(1.0);
    bench.msg(requested(CommandKind::Start, ben()));
    let by_ben = "START commanded, attempt 1 (screen 2, ben from 10.0.0.7)";
    assert!(bench.events().contains(by_ben), "{}", bench.events());
    let records = records(&bench);
    for record in [
        "commanded: ARM commanded, attempt 1 (screen 1, anna on pts/3)",
        "acknowledged: ARM acknowledged: accepted (screen 1, anna on pts/3)",
        &format!("commanded: {by_ben}"),
    ] {
        assert!(records.contains(record), "{record} is missing in\n{records}");
    }
}

#[test]
fn two_screens_that_arm_at_once_arm_once() {
    let mut bench = with_anna();
    bench.msg(requested(CommandKind::Arm, anna()));
    bench.msg(requested(CommandKind::Arm, ben()));
    assert_eq!(bench.take_commands().iter().filter(|sent| is_arm(sent)).count(), 1);
    assert!(bench.events().contains("ARM is on its way already (screen 1, anna on pts/3) (screen 2, ben"));
    // Acknowledged, and the HEARTBEAT that shows it has not come yet.
    bench.answer(ARM, 0);
    bench.msg(requested(CommandKind::Arm, ben()));
    assert!(bench.take_commands().is_empty());
    // Never observed: whoever asks again means it.
    bench.run(4.0);
    bench.msg(requested(CommandKind::Arm, ben()));
    assert!(bench.take_commands().iter().any(is_arm));
}

/// Armed and started by Anna; the countdown runs.
fn counting() -> Bench {
    let mut bench = with_anna();
    bench.keys(&ladder());
    bench.answer(ARM, 0);
    bench.armed = true;
    bench.phase = TdPhase::TD_PHASE_PAD_ARMED;
    bench.run(1.0);
    bench.msg(requested(CommandKind::Start, anna()));
    bench.answer(START, 0);
    bench.countdown_ms = 20_000;
    bench.run(1.0);
    bench.take_commands();
    bench
}

fn holds(bench: &mut Bench) -> usize {
    let sent = bench.take_commands();
    sent.iter().filter(|sent| sent.command == HOLD && sent.param1.to_bits() == 0).count()
}

#[test]
fn a_countdown_that_nobody_attends_is_held_until_it_is_gone() {
    let mut bench = counting();
    bench.run(10.0);
    assert_eq!(holds(&mut bench), 0, "Anna is there");
    bench.msg(Msg::Crew(Vec::new()));
    bench.run(4.9);
    assert_eq!(holds(&mut bench), 0);
    bench.run(1.0);
    let said = "no commanding screen for 5 s in the countdown: HOLD";
    assert!(bench.events().contains(said) && records(&bench).contains(&format!("hold: {said}")));
    assert!((9..=10).contains(&holds(&mut bench)), "ten a second");
    bench.speaks = false;
    bench.run(1.0);
    assert_eq!(holds(&mut bench), 10, "until the vehicle shows it");
    bench.speaks = true;
    bench.countdown_ms = i32::MAX;
    bench.run(0.1);
    holds(&mut bench);
    bench.run(5.0);
    assert_eq!(holds(&mut bench), 0);
    assert!(bench.events().contains("the hold is not asked for any more: the countdown is gone"));
}

#[test]
fn a_crew_that_is_back_in_time_goes_on() {
    let mut bench = counting();
    bench.msg(Msg::Crew(Vec::new()));
    bench.run(4.0);
    bench.msg(Msg::Crew(vec![ben()]));
    bench.run(10.0);
    assert_eq!(holds(&mut bench), 0);
}

#[test]
fn what_another_station_armed_and_what_flies_is_not_held() {
    let mut other = with_anna();
    other.armed = true;
    other.phase = TdPhase::TD_PHASE_PAD_ARMED;
    other.countdown_ms = 20_000;
    other.msg(Msg::Crew(Vec::new()));
    other.run(10.0);
    assert_eq!(holds(&mut other), 0, "another crew's countdown");
    let mut released = counting();
    released.msg(Msg::Crew(Vec::new()));
    released.run(4.0);
    released.phase = TdPhase::TD_PHASE_BOOST;
    released.run(10.0);
    assert_eq!(holds(&mut released), 0, "after release the link plays no part");
}

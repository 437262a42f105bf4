//! The crew: operators in the log, two screens that command at once, and a countdown without a
//! commanding screen.

use ground::key::Key;
use ground::model::{CommandKind, Seat, Settings, Silence};
use ground::update::{Action, Msg};
use protocol::dialect::{MavCmd, TdHold, TdPhase};
use protocol::log::record::Record;

use crate::keys::ladder;
use crate::rig::{Rig, is_arm, settings};

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
    Msg::command(kind, by)
}

/// A station with Anna at its own screen.
fn with_anna() -> Rig {
    let mut rig = Rig::new(Settings { seat: anna(), ..settings(false, true) });
    rig.msg(Msg::Crew { seats: vec![anna()], silent: Vec::new() });
    rig.run(1.0);
    rig.take_commands();
    rig
}

fn records(rig: &Rig) -> String {
    let detail = |action: &Action| match action {
        Action::Record(Record::OperatorAction(action)) => Some(format!("{}: {}", action.kind, action.detail)),
        _ => None,
    };
    rig.actions.iter().filter_map(detail).collect::<Vec<_>>().join("\n")
}

#[test]
fn each_command_names_its_screen_and_operator_in_event_and_record() {
    let mut rig = with_anna();
    rig.keys(&ladder());
    rig.expect_event("ARM commanded, attempt 1 (screen 1, anna on pts/3)");
    rig.answer(ARM, 0);
    rig.armed = true;
    rig.phase = TdPhase::TD_PHASE_PAD_ARMED;
    rig.run(1.0);
    rig.msg(requested(CommandKind::Start, ben()));
    let by_ben = "START commanded, attempt 1 (screen 2, ben from 10.0.0.7)";
    rig.expect_event(by_ben);
    let records = records(&rig);
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
    let mut rig = with_anna();
    rig.msg(requested(CommandKind::Arm, anna()));
    rig.msg(requested(CommandKind::Arm, ben()));
    assert_eq!(rig.take_commands().iter().filter(|sent| is_arm(sent)).count(), 1);
    assert!(rig.events().contains("ARM is already on its way (screen 1, anna on pts/3) (screen 2, ben"));
    // Acknowledged, but the HEARTBEAT that shows it has not arrived yet.
    rig.answer(ARM, 0);
    rig.msg(requested(CommandKind::Arm, ben()));
    assert!(rig.take_commands().is_empty());
    // Never observed, so a new request is sent.
    rig.run(4.0);
    rig.msg(requested(CommandKind::Arm, ben()));
    assert!(rig.take_commands().iter().any(is_arm));
}

/// Armed and started by Anna; the countdown runs.
fn counting() -> Rig {
    let mut rig = with_anna();
    rig.keys(&ladder());
    rig.answer(ARM, 0);
    rig.armed = true;
    rig.phase = TdPhase::TD_PHASE_PAD_ARMED;
    rig.run(1.0);
    rig.msg(requested(CommandKind::Start, anna()));
    rig.answer(START, 0);
    rig.countdown_ms = 20_000;
    rig.run(1.0);
    rig.take_commands();
    rig
}

fn holds(rig: &mut Rig) -> usize {
    let sent = rig.take_commands();
    let holds = sent.iter().filter(|sent| sent.command == HOLD && sent.param1.to_bits() == 0);
    holds.inspect(|sent| assert!(sent.param2.to_bits() == 1.0_f32.to_bits(), "no person: {sent:?}")).count()
}

#[test]
fn a_countdown_without_a_commanding_screen_is_held() {
    let mut rig = counting();
    rig.run(10.0);
    assert_eq!(holds(&mut rig), 0, "Anna is there");
    rig.msg(Msg::Crew { seats: Vec::new(), silent: Vec::new() });
    rig.run(0.7);
    assert_eq!(holds(&mut rig), 0);
    rig.run(1.0);
    let said = "no commanding screen in the countdown: HOLD";
    assert!(rig.events().contains(said) && records(&rig).contains(&format!("hold: {said}")));
    assert!((9..=10).contains(&holds(&mut rig)), "ten a second");
    rig.speaks = false;
    rig.run(1.0);
    assert_eq!(holds(&mut rig), 10, "until the vehicle shows it");
    rig.speaks = true;
    rig.countdown_ms = i32::MAX;
    rig.run(0.1);
    holds(&mut rig);
    rig.run(5.0);
    assert_eq!(holds(&mut rig), 0);
    rig.expect_event("the hold is no longer sent: the countdown has ended");
}

/// At T-2 s nothing holds any more, and the station does not claim to.
#[test]
fn after_the_last_moment_no_hold_is_sent_and_that_is_reported() {
    let mut rig = counting();
    rig.expect_screen("; hold until T-2");
    rig.countdown_ms = 1_900;
    rig.msg(Msg::Crew { seats: Vec::new(), silent: Vec::new() });
    rig.run(5.0);
    assert_eq!(holds(&mut rig), 0);
    let said = "no commanding screen in the countdown: TOO LATE for a hold, only an abort ends it";
    assert_eq!(rig.events().matches(said).count(), 1, "{}", rig.events());
    // A hold that was being sent ends there, too.
    let mut rig = counting();
    rig.countdown_ms = 2_500;
    rig.msg(Msg::Crew { seats: Vec::new(), silent: Vec::new() });
    rig.run(3.0);
    assert!(holds(&mut rig) > 5);
    rig.countdown_ms = 2_000;
    rig.run(2.0);
    assert_eq!(holds(&mut rig), 0);
    rig.expect_event("TOO LATE for a hold");
    // A person at a screen reads what still works.
    rig.msg(Msg::Crew { seats: vec![anna()], silent: Vec::new() });
    rig.keys(&[Key::Char('H'), Key::Enter]);
    assert_eq!(holds(&mut rig), 0);
    rig.expect_event("too late for a hold: Ctrl-X, then Enter, aborts");
    rig.expect_screen("; TOO LATE to hold");
}

/// The station has waited for its answer already.
#[test]
fn a_countdown_whose_only_screen_does_not_answer_is_held_at_once() {
    let mut rig = counting();
    rig.msg(Msg::Crew { seats: Vec::new(), silent: vec![(anna(), Silence::TmuxWithoutClient)] });
    rig.run(0.1);
    assert!(holds(&mut rig) > 0);
    let why = "screen 1, anna on pts/3 is not shown (tmux has no client)";
    rig.expect_event(format!("does not count: {why}"));
    // The largest line gives the station's reason.
    rig.hold = TdHold::TD_HOLD_COMMANDED;
    rig.countdown_ms = i32::MAX;
    rig.run(0.5);
    rig.expect_screen("HOLD: this screen is not shown (tmux has no client); start again");
    // Somebody else who answers is enough.
    let mut rig = counting();
    rig.msg(Msg::Crew { seats: vec![ben()], silent: vec![(anna(), Silence::NoAnswer)] });
    rig.run(5.0);
    assert_eq!(holds(&mut rig), 0);
}

#[test]
fn a_crew_that_returns_in_time_prevents_the_hold() {
    let mut rig = counting();
    rig.msg(Msg::Crew { seats: Vec::new(), silent: Vec::new() });
    rig.run(0.5);
    rig.msg(Msg::Crew { seats: vec![ben()], silent: Vec::new() });
    rig.run(10.0);
    assert_eq!(holds(&mut rig), 0);
}

#[test]
fn a_countdown_of_another_station_and_a_flight_are_not_held() {
    let mut other = with_anna();
    other.armed = true;
    other.phase = TdPhase::TD_PHASE_PAD_ARMED;
    other.armed_here = false;
    other.countdown_ms = 20_000;
    other.msg(Msg::Crew { seats: Vec::new(), silent: Vec::new() });
    other.run(10.0);
    assert_eq!(holds(&mut other), 0, "another crew's countdown");
    let mut released = counting();
    released.msg(Msg::Crew { seats: Vec::new(), silent: Vec::new() });
    released.run(0.5);
    released.phase = TdPhase::TD_PHASE_BOOST;
    released.run(10.0);
    assert_eq!(holds(&mut released), 0, "after release the link plays no part");
}

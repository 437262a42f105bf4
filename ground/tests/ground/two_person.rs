//! Two people at two stations: what one asks is on the other's screen, and only the other's ladder
//! confirms it.

use ground::key::Key;
use ground::model::{KeyOwner, Seat, Settings};
use ground::update::Msg;
use protocol::dialect::{
    COMMAND_LONG_DATA, MavCmd, MavMessage, MavResult, TD_CREW_DATA, TD_MISSION_DATA, TD_OPERATOR_DATA, TdAct,
    TdHold, TdInterlock, TdPhase, TdRole, TdStart,
};
use protocol::identity::{Address, GROUND};
use protocol::mission::MissionHash;

use crate::rig::{Rig, enter, is_arm, settings, typed};

const ANN: u8 = 1;
const BOB: u8 = 2;

fn characters<const N: usize>(text: &str) -> [u8; N] {
    let mut bytes = [0; N];
    bytes[..text.len()].copy_from_slice(text.as_bytes());
    bytes
}

/// The station of an operator; 0 is an observer's.
fn station_of(number: u8, mission: Option<&str>) -> Rig {
    let name = if number == ANN { "Ann" } else { "Bob" };
    let mut rig = Rig::new(Settings {
        seat: Seat::new(1, name),
        key_owner: (number > 0).then(|| KeyOwner { number, name: name.to_owned() }),
        mission: mission.map(MissionHash::of),
        ..settings(false, true)
    });
    rig.run(1.0);
    for (number, role, name) in
        [(ANN, TdRole::TD_ROLE_RANGE_SAFETY, "Ann"), (BOB, TdRole::TD_ROLE_FLIGHT, "Bob")]
    {
        let name = characters::<16>(name).into();
        rig.receive(&MavMessage::TD_OPERATOR(TD_OPERATOR_DATA { boot_number: 0, number, role, name }));
    }
    crew(&mut rig, TD_CREW_DATA::default());
    rig
}

fn crew(rig: &mut Rig, mut crew: TD_CREW_DATA) {
    (crew.people, crew.time_boot_ms) = (2, rig.boot_ms());
    rig.receive(&MavMessage::TD_CREW(crew));
}

fn proposes(rig: &mut Rig, by: u8, act: TdAct, ask_left_ms: u16) {
    crew(rig, TD_CREW_DATA { ask_number: 4_711, ask_left_ms, act, asked_by: by, ..TD_CREW_DATA::default() });
}

fn confirm() -> Vec<Key> {
    enter("ACONFIRM")
}

/// In the countdown, which the operator has to keep running with taps.
fn counting(tapped_by: u8) -> Rig {
    let mut rig = station_of(ANN, None);
    rig.phase = TdPhase::TD_PHASE_PAD_ARMED;
    rig.armed = true;
    rig.interlocks |= TdInterlock::TD_INTERLOCK_ARMED;
    rig.countdown_ms = 8_000;
    rig.run(1.0);
    crew(
        &mut rig,
        TD_CREW_DATA { tapped_by, tap_left_ms: 2_000, commanded_by: BOB, ..TD_CREW_DATA::default() },
    );
    rig
}

#[test]
fn the_header_names_operator_role_and_mode_on_every_page() {
    for (number, words) in
        [(ANN, "RANGE SAFETY Ann TWO-PERSON"), (BOB, "FLIGHT Bob TWO-PERSON"), (0, "OBSERVER TWO-PERSON")]
    {
        let mut rig = station_of(number, None);
        for page in "123456789".chars() {
            rig.key(Key::Char(page));
            rig.expect_screen(words);
        }
    }
    let mut rig = station_of(ANN, None);
    crew(&mut rig, TD_CREW_DATA::default());
    rig.receive(&MavMessage::TD_CREW(TD_CREW_DATA { people: 1, ..TD_CREW_DATA::default() }));
    rig.expect_screen("RANGE SAFETY Ann one-person");
}

#[test]
fn the_other_s_proposal_is_on_this_screen_and_confirmed_by_its_number() {
    let mut rig = station_of(ANN, None);
    proposes(&mut rig, BOB, TdAct::TD_ACT_ARM, 9_000);
    let screen = rig.screen(80, 24);
    assert!(screen.contains("FLIGHT Bob requests to arm."), "{screen}");
    assert!(screen.contains("Press A within 9 s, then type CONFIRM and Enter to confirm."), "{screen}");
    rig.take_commands();
    // The word of an ask confirms nothing.
    rig.keys(&enter("AARM"));
    assert_eq!(rig.take_commands(), []);
    proposes(&mut rig, BOB, TdAct::TD_ACT_ARM, 7_000);
    rig.keys(&confirm());
    let sent = rig.take_commands();
    let [command] = &sent[..] else { panic!("{sent:?}") };
    assert!(is_arm(command) && command.param3.to_bits() == 4_711.0f32.to_bits());
    // Repeated under one number: the vehicle takes it once.
    rig.run(5.0);
    let again = rig.take_commands();
    assert!(again.len() == 4 && again.iter().all(|sent| sent.param2.to_bits() == command.param2.to_bits()));
}

#[test]
fn a_lapsed_or_changed_proposal_is_not_confirmed() {
    let mut rig = station_of(ANN, None);
    proposes(&mut rig, BOB, TdAct::TD_ACT_ARM, 2_000);
    rig.key(Key::Char('A'));
    rig.run(2.5);
    rig.keys(&enter("CONFIRM"));
    assert_eq!(rig.take_commands(), []);
    proposes(&mut rig, BOB, TdAct::TD_ACT_ARM, 9_000);
    rig.keys(&typed("ACONFIRM"));
    // Bob has withdrawn it and proposes again: the proposal on the screen is no longer the one that
    // waits.
    crew(
        &mut rig,
        TD_CREW_DATA {
            ask_number: 4_712,
            ask_left_ms: 9_000,
            act: TdAct::TD_ACT_ARM,
            asked_by: BOB,
            ..TD_CREW_DATA::default()
        },
    );
    rig.key(Key::Enter);
    assert_eq!(rig.take_commands(), []);
    rig.expect_event("nothing is confirmed: the request has lapsed");
}

#[test]
fn a_local_proposal_names_who_must_confirm_and_is_no_refusal() {
    let mut rig = station_of(BOB, None);
    rig.key(Key::Char('A'));
    let screen = rig.screen(80, 24);
    assert!(screen.contains("This is a request: RANGE SAFETY or PAD must confirm within 10 s."), "{screen}");
    rig.keys(&enter("ARM"));
    let sent = rig.take_commands();
    assert!(matches!(&sent[..], [command] if is_arm(command) && command.param3.to_bits() == 0), "{sent:?}");
    let rejected = MavResult::MAV_RESULT_TEMPORARILY_REJECTED as u8;
    rig.answer_with(GROUND, MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, rejected, 4_711);
    proposes(&mut rig, BOB, TdAct::TD_ACT_ARM, 9_500);
    let screen = rig.screen(80, 24);
    assert!(screen.contains("You request to arm."), "{screen}");
    assert!(screen.contains("acknowledged requested"), "{screen}");
    assert!(!screen.contains("REFUSED"), "{screen}");
    // No operator confirms their own proposal here, either.
    rig.keys(&confirm());
    assert!(rig.take_commands().iter().all(|command| command.param3.to_bits() == 0));
}

#[test]
fn only_the_one_who_confirmed_taps_and_a_held_key_taps_once() {
    let tap = |command: &&COMMAND_LONG_DATA| command.command == MavCmd::MAV_CMD_TD_TAP;
    let mut rig = counting(ANN);
    let screen = rig.screen(80, 24);
    assert!(screen.contains("Tap T: 2.0 s left, or the countdown is held."), "{screen}");
    rig.take_commands();
    rig.key(Key::Char('T'));
    assert_eq!(rig.take_commands().iter().filter(tap).count(), 1);
    rig.hold(Key::Char('T'), 400, 33, 2);
    assert_eq!(rig.take_commands().iter().filter(tap).count(), 1, "a held key");
    let mut rig = counting(BOB);
    rig.expect_screen("FLIGHT Bob taps: 2.0 s left");
    rig.take_commands();
    rig.key(Key::Char('T'));
    assert_eq!(rig.take_commands().iter().filter(tap).count(), 0);
}

#[test]
fn anyone_holds_and_the_screen_shows_who_held_and_why() {
    let mut rig = counting(BOB);
    rig.take_commands();
    rig.keys(&[Key::Char('H'), Key::Enter]);
    let sent = rig.take_commands();
    assert!(
        sent.iter()
            .any(|command| command.command == MavCmd::MAV_CMD_DO_PAUSE_CONTINUE && command.param1 == 0.0)
    );
    rig.countdown_ms = i32::MAX;
    for (hold, held_by, words) in [
        (TdHold::TD_HOLD_COMMANDED, ANN, "HOLD: RANGE SAFETY Ann requested it; start again"),
        (TdHold::TD_HOLD_TAP_OVERDUE, BOB, "HOLD: no tap of FLIGHT Bob for 1 s; start again"),
    ] {
        rig.hold = hold;
        crew(&mut rig, TD_CREW_DATA { held_by, commanded_by: BOB, ..TD_CREW_DATA::default() });
        rig.run(0.5);
        let screen = rig.screen(100, 30);
        assert!(screen.contains(words), "{screen}");
    }
}

#[test]
fn an_observer_arms_nothing_and_reads_the_reason() {
    let mut rig = station_of(0, None);
    rig.keys(&enter("AARM"));
    assert_eq!(rig.take_commands(), []);
    rig.expect_event("no operator's key here (--crew, --operator)");
}

#[test]
fn command_is_taken_with_a_separate_ladder() {
    let mut rig = counting(BOB);
    let other = Address { system_id: 254, component_id: 190 };
    rig.armed = false;
    rig.run(0.5);
    rig.armed = true;
    rig.heartbeat();
    rig.uplink_of(GROUND, 100, false);
    rig.uplink_of(other, 6_000, true);
    rig.take_commands();
    rig.keys(&[Key::Char('C'), Key::Enter]);
    assert_eq!(rig.take_commands(), [], "not without the word");
    rig.key(Key::Char('C'));
    rig.expect_screen("FLIGHT Bob is in command");
    rig.keys(&enter("TAKE"));
    let sent = rig.take_commands();
    assert!(matches!(&sent[..], [command] if command.command == MavCmd::MAV_CMD_TD_TAKE_COMMAND), "{sent:?}");
    rig.answer(MavCmd::MAV_CMD_TD_TAKE_COMMAND, MavResult::MAV_RESULT_DENIED as u8);
    rig.run(0.5);
    assert!(!rig.events().contains("TAKE COMMAND observed"), "{}", rig.events());
}

#[test]
fn another_mission_is_not_armed_and_both_hashes_are_named() {
    let mut rig = station_of(ANN, Some("the right one"));
    let ours = MissionHash::of("the right one").to_string();
    let fly = |rig: &mut Rig, text: &str| {
        let name = characters::<20>("mk2").into();
        let (hash, start) = (MissionHash::of(text).0, TdStart::TD_START_APOGEE);
        rig.receive(&MavMessage::TD_MISSION(TD_MISSION_DATA {
            hash,
            name,
            start,
            ..TD_MISSION_DATA::default()
        }));
        rig.keys(&enter("AARM"));
        rig.take_commands()
    };
    rig.keys(&enter("AARM"));
    assert_eq!(rig.take_commands(), [], "the vehicle has not said what it flies");
    assert_eq!(fly(&mut rig, "another one"), []);
    let theirs = MissionHash::of("another one").to_string();
    assert!(rig.events().contains(&theirs) && rig.events().contains(&ours), "{}", rig.events());
    rig.expect_screen("NO-GO: the vehicle flies mk2");
    rig.model.settings.start = Some("pad".to_owned());
    assert_eq!(fly(&mut rig, "the right one"), []);
    rig.expect_event("the flight begins at: apogee, --start is pad");
    rig.model.settings.start = Some("apogee".to_owned());
    assert_eq!(fly(&mut rig, "the right one").len(), 1);
    // An attached screen asks its station, which knows the same mission.
    rig.msg(Msg::Tick);
}

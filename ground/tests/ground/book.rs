//! The entries of the station's book, and how its end is sent to the vehicle.

use ground::key::Key;
use ground::model::BookLine;
use ground::update::{Action, Msg};
use protocol::book::{Book, Line, SignedHead};
use protocol::dialect::{
    MavCmd, MavMessage, TD_BOOK_HEAD_DATA, TD_BOOK_KEPT_DATA, TD_CREW_DATA, TD_OPERATOR_DATA, TdAct, TdHold,
    TdPhase, TdRole,
};
use protocol::identity::GROUND;

use crate::rig::{Rig, enter};

fn entered(rig: &Rig) -> Vec<BookLine> {
    let line = |action: &Action| match action {
        Action::Enter(line) => Some(line.clone()),
        _ => None,
    };
    rig.actions.iter().filter_map(line).collect()
}

fn has(rig: &Rig, kind: &str, words: &str) -> usize {
    entered(rig).iter().filter(|line| line.kind == kind && line.text.contains(words)).count()
}

#[test]
fn keys_commands_answers_and_what_the_vehicle_shows_are_entered_once() {
    let mut rig = Rig::crewed();
    rig.actions.clear();
    rig.keys(&enter("AARM"));
    rig.answer(MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, 0);
    rig.armed = true;
    rig.run(2.0);
    rig.text("pin is out");
    let keys: Vec<String> =
        entered(&rig).into_iter().filter(|line| line.kind == "key").map(|line| line.text).collect();
    assert_eq!(keys, ["A", "ARM Enter"], "a typed word is one line");
    assert_eq!(has(&rig, "commanded", "ARM commanded, attempt 1"), 1);
    assert_eq!(has(&rig, "acknowledged", "ARM acknowledged"), 1);
    assert_eq!(has(&rig, "observed", "ARM observed"), 1);
    assert_eq!(has(&rig, "event", "armed (HEARTBEAT)"), 1);
    assert_eq!(has(&rig, "vehicle says", "pin is out"), 1);
    let doubled = entered(&rig).iter().filter(|line| line.text.contains("ARM acknowledged")).count();
    assert_eq!(doubled, 1, "{:?}", entered(&rig));
}

#[test]
fn requests_confirmations_and_commands_are_entered_with_name_and_key() {
    let mut rig = Rig::crewed();
    let mut name = [0; 16];
    name[..3].copy_from_slice(b"Bob");
    rig.receive(&MavMessage::TD_OPERATOR(TD_OPERATOR_DATA {
        boot_number: 0,
        number: 2,
        role: TdRole::TD_ROLE_FLIGHT,
        name: name.into(),
    }));
    let crew = TD_CREW_DATA { people: 2, ..TD_CREW_DATA::default() };
    rig.receive(&MavMessage::TD_CREW(crew.clone()));
    let ask = TD_CREW_DATA {
        act: TdAct::TD_ACT_ARM,
        ask_number: 4_711,
        asked_by: 2,
        ask_left_ms: 9_000,
        ..crew.clone()
    };
    rig.receive(&MavMessage::TD_CREW(ask.clone()));
    rig.receive(&MavMessage::TD_CREW(TD_CREW_DATA { ask_left_ms: 8_000, ..ask }));
    rig.receive(&MavMessage::TD_CREW(TD_CREW_DATA { commanded_by: 2, ..crew.clone() }));
    assert_eq!(has(&rig, "vehicle says", "key 2: requests to arm (request 4711)"), 1);
    let by = entered(&rig).into_iter().find(|line| line.text.contains("is in command")).unwrap();
    assert_eq!(by.who, "FLIGHT Bob");
    // Whichever message is first. Only the one who requested a hold is entered as a person.
    for (hold, who, words) in [
        (TdHold::TD_HOLD_COMMANDED, "FLIGHT Bob", "key 2: requested the hold"),
        (TdHold::TD_HOLD_UPLINK_SILENT, "", "HOLD: station of FLIGHT Bob (key 2) not received"),
        (TdHold::TD_HOLD_STATION_DEAF, "", "HOLD: station of FLIGHT Bob (key 2) receives nothing"),
        (TdHold::TD_HOLD_TAP_OVERDUE, "", "HOLD: no tap of FLIGHT Bob (key 2)"),
    ] {
        for crew_first in [true, false] {
            (rig.hold, rig.phase) = (TdHold::TD_HOLD_NONE, TdPhase::TD_PHASE_PAD_ARMED);
            rig.receive(&MavMessage::TD_CREW(crew.clone()));
            rig.run(0.2);
            rig.actions.clear();
            let held = MavMessage::TD_CREW(TD_CREW_DATA { held_by: 2, ..crew.clone() });
            if crew_first {
                rig.receive(&held);
            }
            rig.hold = hold;
            rig.run(0.2);
            rig.receive(&held);
            rig.run(0.2);
            let entries = entered(&rig);
            let entry = entries.iter().find(|line| line.kind == "vehicle says" && line.text == words);
            assert_eq!(entry.map(|line| line.who.as_str()), Some(who), "{words}: {entries:?}");
            let by_bob = entries.iter().filter(|line| line.who.contains("Bob")).count();
            assert_eq!(by_bob, usize::from(!who.is_empty()), "{entries:?}");
        }
    }
}

fn heads(rig: &mut Rig) -> Vec<TD_BOOK_HEAD_DATA> {
    let head = |action: &Action| match action {
        Action::Send(message) => match &**message {
            MavMessage::TD_BOOK_HEAD(head) => Some(head.clone()),
            _ => None,
        },
        _ => None,
    };
    let found = rig.actions.iter().filter_map(head).collect();
    rig.actions.clear();
    found
}

#[test]
fn the_end_of_the_book_is_sent_until_the_vehicle_confirms_it() {
    let mut rig = Rig::crewed();
    let mut book = Book::default();
    book.enter(&Line { unix_ns: 1, kind: "opened", who: "", text: "" });
    let head = SignedHead { head: book.head().unwrap(), signature: [1; 64] };
    rig.actions.clear();
    rig.msg(Msg::Book { head, is_signed: true });
    rig.run(5.0);
    let sent = heads(&mut rig);
    assert!((2..=3).contains(&sent.len()), "every 2 s: {}", sent.len());
    assert!(SignedHead::of_message(&sent[0]) == head && sent[0].target_system == 1);
    let kept = TD_BOOK_KEPT_DATA {
        boot_number: 0,
        book: head.head.book,
        entries: 1,
        target_system: GROUND.system_id,
        target_component: GROUND.component_id,
    };
    // Of another book, to another station, and of entries that do not exist.
    for wrong in [
        TD_BOOK_KEPT_DATA { book: 1, ..kept.clone() },
        TD_BOOK_KEPT_DATA { target_system: 7, ..kept.clone() },
        TD_BOOK_KEPT_DATA { entries: 9, ..kept.clone() },
    ] {
        rig.receive(&MavMessage::TD_BOOK_KEPT(wrong));
    }
    rig.run(3.0);
    assert!(!heads(&mut rig).is_empty());
    rig.receive(&MavMessage::TD_BOOK_KEPT(kept));
    rig.run(5.0);
    assert!(heads(&mut rig).is_empty());
    rig.key(Key::Char('7'));
    let screen = rig.screen(80, 24);
    assert!(screen.contains("1 entries, head") && screen.contains("signed; 1 at the vehicle"), "{screen}");
    // A vehicle that was switched on again has a new log.
    rig.reboot();
    rig.run(3.0);
    assert!(!heads(&mut rig).is_empty());
}

#[test]
fn entries_of_the_vehicle_name_its_boot_while_another_one_is_received() {
    let mut rig = Rig::crewed();
    rig.text("alone");
    crate::who::beside(&mut rig, 9, 2);
    rig.text("one of two");
    let who = |words: &str| entered(&rig).into_iter().find(|line| line.text == words).unwrap().who;
    let boot = rig.model.vehicle.boot.number().unwrap();
    assert_eq!((who("alone"), who("one of two")), (String::new(), format!("boot {boot:08X}")));
}

/// Typed while a vehicle falls: the page stays, no letter of it acts, and the abort works.
#[test]
fn a_note_goes_into_log_and_book_with_who_wrote_it() {
    let mut rig = Rig::crewed();
    rig.model.settings.seat = ground::model::Seat::new(1, "Ann");
    (rig.phase, rig.armed) = (TdPhase::TD_PHASE_AERO_DESCENT, true);
    rig.run(1.0);
    rig.actions.clear();
    rig.keys(&enter("nDog on the field"));
    rig.keys(&[&crate::rig::typed("nnot this")[..], &[Key::Escape]].concat());
    assert_eq!(has(&rig, "note", ""), 1);
    let note = entered(&rig).into_iter().find(|line| line.kind == "note").unwrap();
    assert_eq!((note.who.as_str(), note.text.ends_with(": Dog on the field")), ("Ann", true), "{note:?}");
    rig.expect_event("Dog on the field");
    assert!(rig.take_commands().is_empty());
    rig.keys(&crate::rig::typed("nab"));
    rig.abort();
    assert!(rig.take_commands().iter().any(crate::rig::is_abort));
}

#[test]
fn a_hold_by_the_vehicle_is_reported_with_its_reason() {
    let mut rig = Rig::crewed();
    (rig.phase, rig.armed) = (TdPhase::TD_PHASE_PAD_ARMED, true);
    (rig.hold, rig.countdown_ms) = (TdHold::TD_HOLD_CHECK_FAILED, i32::MAX);
    rig.run(1.0);
    rig.key(Key::Char('H'));
    rig.expect_event("HELD already: a check of the vehicle fails");
}

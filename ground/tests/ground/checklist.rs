//! The checklist: who signs what, with which values; NO-GO until it is done; the same on every
//! screen.

use std::path::Path;

use ground::key::Key;
use ground::model::{Checklist, ChecklistEntry, Mark, Role, Seat, Settings, parse_checklist};
use ground::update::{Action, Msg, Request};
use ground::view::theme::{Palette, Theme};
use protocol::crew_file::CrewFile;
use protocol::dialect::{MavMessage, TD_MISSION_DATA, TdPhase, TdRole, TdStart};
use protocol::mission::MissionHash;
use strum::VariantArray as _;

use crate::rig::{Rig, enter, is_arm, settings};

const LIST: &str = r#"
name = "A day at the range"
[[step]]
words = "Range clear"
signs = "range-safety"
[[step]]
words = "Rail upright"
signs = "flight"
value = "tilt"
most = 3.0
[[step]]
words = "Cameras run"
signs = "anybody"
"#;

fn station(list: &str, role: Role) -> Rig {
    let mut rig = Rig::new(Settings {
        role,
        seat: Seat::new(1, "Ann"),
        crew_roles: vec![
            ("Ann".to_owned(), TdRole::TD_ROLE_RANGE_SAFETY),
            ("Bob".to_owned(), TdRole::TD_ROLE_FLIGHT),
            ("Oli".to_owned(), TdRole::TD_ROLE_OBSERVER),
        ],
        start_unix_s: 1_800_000_000,
        ..settings(false, true)
    });
    rig.msg(Msg::Checklist(Box::new(parse_checklist(list).expect("a checklist"))));
    rig.run(1.0);
    upright(&mut rig, 90.0);
    rig
}

fn upright(rig: &mut Rig, pitch_deg: f64) {
    rig.state(0.0, 15.0, 0.0, 0.0, pitch_deg);
}

fn list(rig: &Rig) -> &Checklist {
    rig.model.checklist.as_ref().expect("the station has a checklist")
}

fn requested(rig: &mut Rig, step: u8, void: bool, who: &str) {
    rig.msg(Msg::Requested { request: Request::Sign { step, void }, by: Seat::new(2, who) });
}

fn sign_all(rig: &mut Rig) {
    for (step, who) in [(0, "Ann"), (1, "Bob"), (2, "Ann")] {
        requested(rig, step, false, who);
    }
}

fn arms(rig: &mut Rig) -> bool {
    rig.actions.clear();
    rig.keys(&enter("AARM"));
    rig.take_commands().iter().any(is_arm)
}

#[test]
fn nothing_is_armed_before_every_step_is_signed() {
    let mut rig = station(LIST, Role::Station);
    assert!(!arms(&mut rig));
    let screen = rig.screen(80, 24);
    assert!(screen.contains("NO-GO") && screen.contains("checklist 0 of 3: step 1 is open"), "{screen}");
    sign_all(&mut rig);
    let screen = rig.screen(80, 24);
    assert!(!screen.contains("NO-GO") && screen.contains("checks; checklist 3/3 (k)"), "{screen}");
    assert!(arms(&mut rig));
}

#[test]
fn a_step_is_signed_on_the_pad_page_with_a_key_and_enter() {
    let mut rig = station(LIST, Role::Station);
    rig.keys(&[Key::Char('k'), Key::Char('G')]);
    let screen = rig.screen(80, 24);
    assert!(screen.contains("SIGN a step of the checklist") && screen.contains("1: Range clear"), "{screen}");
    assert_eq!(list(&rig).steps[0].mark, Mark::Open);
    rig.key(Key::Enter);
    let Mark::Signed(signature) = &list(&rig).steps[0].mark else { panic!("{}", rig.events()) };
    assert_eq!((signature.by.as_str(), signature.role), ("Ann", Some(TdRole::TD_ROLE_RANGE_SAFETY)));
    assert_eq!(signature.unix_s, 1_800_000_001);
    let kept = rig
        .actions
        .iter()
        .filter(|action| matches!(action, Action::StoreChecklist(ChecklistEntry::Marked { step: 0, .. })));
    assert_eq!(kept.count(), 1);
    let booked = rig.actions.iter().any(|action| match action {
        Action::Enter(line) => {
            line.kind == "signed" && line.who == "Ann" && line.text.contains("Range clear")
        }
        _ => false,
    });
    assert!(booked, "{:?}", rig.actions);
    rig.keys(&[Key::Down, Key::Down, Key::Char('G'), Key::Enter]);
    assert!(matches!(list(&rig).steps[2].mark, Mark::Signed(_)));
    // Another key cancels, and time does.
    rig.keys(&[Key::Up, Key::Up, Key::Char('V'), Key::Char('x')]);
    rig.expect_event("voiding: cancelled, nothing was done");
    rig.key(Key::Char('V'));
    rig.run(6.0);
    rig.key(Key::Enter);
    assert!(matches!(list(&rig).steps[0].mark, Mark::Signed(_)));
}

/// At the station itself and on an attached screen.
#[test]
fn a_step_of_another_role_is_refused_on_the_page_with_the_reason() {
    let mut rig = station(LIST, Role::Station);
    rig.keys(&[Key::Char('k'), Key::Down, Key::Char('G')]);
    let why = "step 2 is not signed: FLIGHT signs it, Ann is RANGE SAFETY";
    for size in [(80, 24), (120, 40)] {
        let screen = rig.screen(size.0, size.1);
        assert!(screen.contains(why) && !screen.contains("SIGN a step"), "{screen}");
    }
    // A dialog that was open before the vehicle was armed elsewhere, and a screen that does not
    // know the roles.
    requested(&mut rig, 1, false, "Ann");
    let reason = rig.actions.iter().rev().find_map(|action| match action {
        Action::RefuseSignature(why) => Some(why.clone()),
        _ => None,
    });
    let mut attached = station(LIST, Role::Attached);
    attached.keys(&[Key::Char('k'), Key::Down, Key::Char('G'), Key::Enter]);
    attached.msg(Msg::SignRefused(reason.expect("the screens receive the reason")));
    attached.expect_screen(why);
    attached.expect_event(why);
    attached.run(20.0);
    attached.expect_screen("signs");
}

/// The blocks of TOML on a page that begin with this text.
fn toml_block(page: &str, begins: &str) -> String {
    let blocks = page.split("```toml\n").skip(1).filter_map(|block| block.split("```").next());
    blocks.into_iter().find(|block| block.starts_with(begins)).expect("the example").to_owned()
}

/// Whoever copies the examples of the page can arm.
#[test]
fn the_example_crew_can_finish_both_example_checklists() {
    let page = include_str!("../../../docs/crew.md");
    let crew = toml_block(page, "# crew.toml");
    let crew = CrewFile::from_toml(&crew, Path::new("crew.toml")).expect("an example that is read");
    for list in [include_str!("../../checklist-example.toml"), &toml_block(page, "name = ")] {
        let mut rig = station(list, Role::Station);
        rig.model.settings.crew_roles =
            crew.members.iter().map(|member| (member.name.clone(), member.role)).collect();
        for (place, step) in list_of(list).steps.iter().enumerate() {
            let signer = crew.members.iter().find(|member| step.role.is_none_or(|role| role == member.role));
            let signer =
                signer.unwrap_or_else(|| panic!("no member of the example crew signs `{}`", step.words));
            upright(&mut rig, 90.0);
            requested(&mut rig, u8::try_from(place).unwrap(), false, &signer.name);
        }
        let (done, all) = rig.model.steps_done(rig.now).expect("a checklist");
        assert_eq!(done, all, "{}", rig.events());
    }
}

fn list_of(text: &str) -> Checklist {
    parse_checklist(text).expect("a checklist")
}

#[test]
fn who_may_not_sign_is_refused_with_the_reason() {
    let mut rig = station(LIST, Role::Station);
    for (who, why) in [("Bob", "RANGE SAFETY signs it, Bob is FLIGHT"), ("Oli", "Oli is an observer")] {
        requested(&mut rig, 0, false, who);
        rig.expect_event(why);
    }
    requested(&mut rig, 0, false, "Eve");
    requested(&mut rig, 0, false, "");
    requested(&mut rig, 99, false, "Ann");
    for why in ["Eve is not in the crew", "no operator is named", "there is no such step"] {
        assert!(rig.events().contains(why), "{why}: {}", rig.events());
    }
    assert!(!list(&rig).is_touched());
    sign_all(&mut rig);
    requested(&mut rig, 0, false, "Ann");
    rig.expect_event("it is signed already");
    rig.armed = true;
    rig.phase = TdPhase::TD_PHASE_PAD_ARMED;
    rig.heartbeat();
    requested(&mut rig, 0, true, "Ann");
    rig.expect_event("the vehicle is armed: disarm first");
}

#[test]
fn a_value_must_be_within_its_limits_when_it_is_signed_and_afterwards() {
    let mut rig = station(LIST, Role::Station);
    upright(&mut rig, 80.0);
    requested(&mut rig, 1, false, "Bob");
    rig.expect_event("tilt is 10.0 deg, not at most 3 deg");
    upright(&mut rig, 89.0);
    sign_all(&mut rig);
    let Mark::Signed(signature) = &list(&rig).steps[1].mark else { panic!("{}", rig.events()) };
    assert!((signature.found.unwrap() - 1.0).abs() < 0.01);
    assert!(rig.model.why_checklist(rig.now).is_none());
    upright(&mut rig, 80.0);
    let why = rig.model.why_checklist(rig.now).unwrap();
    assert!(why.contains("step 2 is outside its limits"), "{why}");
    upright(&mut rig, 90.0);
    rig.run(3.0);
    let why = rig.model.why_checklist(rig.now).unwrap();
    assert!(why.contains("step 2 has no value"), "the tilt is old: {why}");
    requested(&mut rig, 1, true, "Ann");
    requested(&mut rig, 1, false, "Bob");
    rig.expect_event("the vehicle does not send its tilt now");
}

#[test]
fn a_voided_step_is_no_go_until_it_is_signed_again() {
    let mut rig = station(LIST, Role::Station);
    sign_all(&mut rig);
    // Anybody of the crew who may sign at all may void.
    requested(&mut rig, 0, true, "Bob");
    assert!(!arms(&mut rig));
    rig.key(Key::Char('k'));
    let screen = rig.screen(80, 24);
    assert!(
        screen.contains("VOID  1 Range clear") && screen.contains("voided by Bob, 08:00 UTC"),
        "{screen}"
    );
    requested(&mut rig, 0, false, "Ann");
    assert!(arms(&mut rig));
}

#[test]
fn after_the_liftoff_every_step_is_open_for_the_next_flight() {
    let mut rig = station(LIST, Role::Station);
    sign_all(&mut rig);
    rig.actions.clear();
    rig.phase = TdPhase::TD_PHASE_BOOST;
    rig.run(1.0);
    assert!(!list(&rig).is_touched());
    let flown = rig
        .actions
        .iter()
        .filter(|action| matches!(action, Action::StoreChecklist(ChecklistEntry::Flown { .. })));
    assert_eq!(flown.count(), 1);
}

#[test]
fn the_checklist_of_another_mission_is_no_go() {
    let mut rig = station(
        &LIST.replace("[[step]]\nwords = \"Range", "mission = \"mk3\"\n[[step]]\nwords = \"Range"),
        Role::Station,
    );
    sign_all(&mut rig);
    assert!(!arms(&mut rig));
    for (name, arms_now) in [("mk2", false), ("mk3", true)] {
        let mut bytes = [0; 20];
        bytes[..3].copy_from_slice(name.as_bytes());
        let hash = MissionHash::of(name).0;
        rig.receive(&MavMessage::TD_MISSION(TD_MISSION_DATA {
            hash,
            name: bytes.into(),
            start: TdStart::TD_START_PAD,
            ..TD_MISSION_DATA::default()
        }));
        upright(&mut rig, 90.0);
        assert_eq!(arms(&mut rig), arms_now, "{}", rig.events());
    }
}

#[test]
fn an_attached_screen_sends_its_request_and_shows_the_stations_answer() {
    let mut rig = station(LIST, Role::Attached);
    rig.keys(&[Key::Char('k'), Key::Char('G'), Key::Enter]);
    assert!(rig.actions.contains(&Action::Request(Request::Sign { step: 0, void: false })));
    assert!(!list(&rig).is_touched(), "only the station marks it");
    let mut at_the_station = station(LIST, Role::Station);
    requested(&mut at_the_station, 0, false, "Ann");
    rig.msg(Msg::Checklist(Box::new(list(&at_the_station).clone())));
    assert_eq!(list(&rig), list(&at_the_station));
    let mut watching = station(LIST, Role::Watching);
    watching.keys(&[Key::Char('k'), Key::Char('G'), Key::Enter]);
    assert!(!watching.actions.iter().any(|action| matches!(action, Action::Request(_))));
}

/// Held keys and pastes sign nothing.
#[test]
fn nothing_is_signed_by_accident() {
    let mut rig = station(LIST, Role::Station);
    rig.msg(Msg::Keys(vec![Key::Char('G'), Key::Enter]));
    rig.msg(Msg::Pasted);
    rig.hold(Key::Char('G'), 400, 33, 2);
    rig.key(Key::Char('g'));
    assert!(!list(&rig).is_touched());
}

/// The longest checklist, on the pad page at three sizes and in every theme.
#[test]
fn every_step_can_be_reached_at_every_size() {
    let words = "x".repeat(45);
    let step = |number| format!("[[step]]\nwords = \"Step {number}: {words}\"\nsigns = \"anybody\"\n");
    let steps: Vec<String> = (1..=40).map(step).collect();
    let long = format!("name = \"long\"\n{}", steps.concat());
    let mut rig = station(&long, Role::Station);
    rig.key(Key::Char('k'));
    for number in 1..=40 {
        for size in [(80, 24), (140, 45), (200, 60)] {
            for palette in Palette::VARIANTS.iter().copied() {
                let terminal = rig.draw(size.0, size.1, Theme { palette, ascii: false });
                let screen = terminal.backend().to_string();
                assert!(screen.contains(&format!(">open {number:>2} Step {number}:")), "{number} {screen}");
                assert!(screen.contains("anybody signs"), "{screen}");
            }
        }
        rig.key(Key::Down);
    }
}

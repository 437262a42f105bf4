//! Snapshots of whole screens: the text without colour, and the styles of the cells with colour.
//!
//! `cargo insta review` or `INSTA_UPDATE=always cargo test` records new ones.

use crate::pictures::{rows as rows_of, states};
use crate::rig::{MONO, Rig, is_abort, settings, typed};
use ground::key::Key;
use ground::model::{Page, dead_reckoning::predict_position, quantity::Quantity};
use ground::update::Msg;
use ground::view::theme::{Palette, Theme};
use ground::view::{headline, status_lines, top_lines};
use protocol::dialect::{MavCmd, TdAbortEffect, TdBooster, TdInterlock, TdLimit, TdPhase};
use protocol::frame::FramerCounters;

pub(crate) fn snapshot(name: &str, rig: &Rig) {
    insta::assert_snapshot!(format!("{name}_80x24"), rig.screen(80, 24));
    insta::assert_snapshot!(format!("{name}_80x24_styles"), rig.styles(80, 24));
}

pub(crate) fn on_the_pad() -> Rig {
    let mut rig = Rig::crewed();
    rig.state(0.0, 15.0, 0.0, 0.0, 90.0);
    rig.actuators(0);
    rig.limits();
    rig.plan(TdLimit::empty());
    rig
}

pub(crate) fn armed() -> Rig {
    let mut rig = on_the_pad();
    rig.keys(&[typed("AARM"), vec![Key::Enter]].concat());
    rig.answer(MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, 0);
    rig.armed = true;
    rig.phase = TdPhase::TD_PHASE_PAD_ARMED;
    rig.interlocks |= TdInterlock::TD_INTERLOCK_ARMED;
    rig.run(1.0);
    rig
}

pub(crate) fn counting() -> Rig {
    let mut rig = armed();
    rig.keys(&crate::keys::start_ladder());
    rig.answer(MavCmd::MAV_CMD_MISSION_START, 0);
    rig.countdown_ms = 3_200;
    rig.run(1.0);
    rig
}

pub(crate) fn powered() -> Rig {
    let mut rig = counting();
    rig.phase = TdPhase::TD_PHASE_POWERED;
    rig.abort_effect = TdAbortEffect::TD_ABORT_EFFECT_LAND_IN_PLACE;
    rig.countdown_ms = -2_700;
    rig.run(1.0);
    for k in 0..20_u16 {
        let fallen = f32::from(k) * 0.4;
        rig.state(-0.05 * fallen, 15.0 - fallen, -0.1, -3.4, 89.0);
        rig.run(0.1);
    }
    rig.actuators(-640);
    rig.plan(TdLimit::empty());
    rig
}

/// The capacity of a serial line is shown beside its rate; that of a network is unknown.
#[test]
fn the_links_capacity_is_shown_beside_its_rate() {
    let mut settings = settings(false, true);
    settings.link_capacity_bytes_s = Some(5_760);
    let mut rig = Rig::new(settings);
    rig.key(Key::Char('5'));
    rig.run(1.0);
    rig.msg(Msg::Received { bytes: 1_600, framing: FramerCounters::default() });
    assert!(rig.screen(80, 24).contains(" 1600/5760 "), "{}", rig.screen(80, 24));
}

#[test]
fn regress_abort_chord_and_abort() {
    let mut rig = powered();
    rig.key(Key::CtrlX);
    snapshot("abort_chord", &rig);
    rig.run(0.4);
    rig.key(Key::CtrlX);
    rig.run(1.0);
    assert!(rig.take_commands().iter().any(is_abort));
    snapshot("abort_sent", &rig);
}

pub(crate) fn coasting() -> Rig {
    let mut rig = armed();
    rig.phase = TdPhase::TD_PHASE_COAST;
    rig.abort_effect = TdAbortEffect::TD_ABORT_EFFECT_CHUTE_AT_APOGEE;
    rig.countdown_ms = -3_500;
    rig.run(1.0);
    rig.state(8.5, 184.8, 2.9, 49.4, 86.0);
    rig.ascent(TdBooster::TD_BOOSTER_ATTACHED, 301.0, 4.9);
    rig
}

pub(crate) fn descending() -> Rig {
    let mut rig = armed();
    rig.phase = TdPhase::TD_PHASE_AERO_DESCENT;
    rig.abort_effect = TdAbortEffect::TD_ABORT_EFFECT_CHUTE_NOW;
    rig.run(1.0);
    rig.state(4.0, 132.0, -0.6, -21.5, 88.0);
    rig.actuators(0);
    rig.descent(132.0);
    rig
}

/// Every page by its digit, during a flight.
#[test]
fn regress_every_page_by_its_digit() {
    for (digit, name) in
        [('4', "review"), ('5', "link"), ('6', "messages"), ('7', "log"), ('8', "alarms"), ('1', "pad_held")]
    {
        let mut rig = powered();
        rig.key(Key::Char(digit));
        snapshot(&format!("screen_{name}"), &rig);
    }
}

#[test]
fn regress_ascii() {
    for (name, rig) in [("powered", powered()), ("descent", descending()), ("pad", on_the_pad())] {
        let ascii = Theme { palette: Palette::None, ascii: true };
        insta::assert_snapshot!(format!("ascii_{name}"), rig.draw(80, 24, ascii).backend().to_string());
    }
}

/// At every size from 1x1 to 60x20 and in every state: nothing panics; and as far as the rows
/// reach, the banner's sentence stands in the second row, and what an abort would do in the row
/// after state and clock: whole if it fits, else cut with a mark.
#[test]
fn the_abort_is_on_every_small_screen_that_has_room_for_it() {
    for (name, rig) in states() {
        let banner = headline::banner(&rig.model, rig.now).map(|banner| format!(" {}", banner.sentence()));
        let abort = top_lines::abort(&rig.model, MONO, rig.now, 200).to_string();
        let abort = abort.replace(top_lines::ABORT_LABEL, " ^X^X ABORT: ");
        let place = if banner.is_some() { 4 } else { 3 };
        for (columns, rows) in (1..=60).flat_map(|columns| (1..=20).map(move |rows| (columns, rows))) {
            let screen = rows_of(rig.draw(columns, rows, MONO).backend().buffer());
            for (row, words) in banner.iter().map(|words| (1, words)).chain([(place, &abort)]) {
                let Some(found) = screen.get(row) else { continue };
                let (found, words) = (found.trim_end_matches('…').trim_end(), words.trim_end());
                let is_cut = found.chars().count() + 2 >= usize::from(columns);
                assert!(
                    found == words || is_cut && words.starts_with(found),
                    "{name} {columns}x{rows}: {words}\n{screen:#?}"
                );
            }
        }
    }
}

/// Every page on an ASCII terminal has only ASCII cells.
#[test]
fn every_page_in_ascii() {
    for (name, mut rig) in states() {
        for page in Page::all() {
            rig.model.pages.hold(Some(page));
            for (columns, rows) in [(40, 12), (79, 60), (80, 24), (300, 90)] {
                let terminal = rig.draw(columns, rows, Theme { palette: Palette::Dark, ascii: true });
                let cells = &terminal.backend().buffer().content;
                assert!(
                    cells.iter().all(|cell| cell.symbol().is_ascii()),
                    "{name} {page:?} {columns}x{rows}"
                );
            }
        }
    }
}

/// The page follows the flight unless it is held; Escape follows the flight again.
#[test]
fn pages_follow_the_flight_and_can_be_held() {
    let mut rig = descending();
    assert_eq!(rig.model.page(), Page::Descent);
    rig.key(Key::Char('h'));
    rig.phase = TdPhase::TD_PHASE_POWERED;
    rig.run(1.0);
    assert_eq!((rig.model.page(), rig.model.pages.held), (Page::Descent, Some(Page::Descent)));
    rig.key(Key::Escape);
    assert_eq!((rig.model.page(), rig.model.pages.held), (Page::Landing, None));
    rig.phase = TdPhase::TD_PHASE_TOUCHDOWN;
    rig.run(1.0);
    assert_eq!(rig.model.page(), Page::Review);
}

#[test]
fn regress_help() {
    let mut rig = on_the_pad();
    rig.key(Key::F1);
    snapshot("help", &rig);
}

/// Phase, armed, countdown, link and the abort key do not move when a dialog opens.
#[test]
fn the_top_lines_do_not_move() {
    // The middle of the second line is what comes next, or whether the vehicle may be armed.
    let state = |line: &str| line.chars().take(34).collect::<String>();
    let top = |rig: &Rig| {
        let screen = rig.screen(80, 24);
        let lines: Vec<&str> = screen.lines().take(3).collect();
        [lines[0].to_owned(), state(lines[1]), lines[2].to_owned()]
    };
    let mut rig = armed();
    let before = top(&rig);
    for key in
        [Key::Char('S'), Key::Escape, Key::Char('D'), Key::Escape, Key::F1, Key::Escape, Key::Char('q')]
    {
        rig.key(key);
        assert_eq!(top(&rig), before, "after {key:?}");
    }
}

/// A quantity has the same value everywhere, whichever message carried it last.
#[test]
fn a_quantity_has_one_value_on_a_screen() {
    let mut rig = descending();
    // TD_DESCENT arrived a moment before the position.
    rig.descent(131.2);
    rig.run(0.3);
    rig.state(4.0, 125.5, -0.6, -21.5, 88.0);
    let next = |rig: &Rig| status_lines::next_event(&rig.model, rig.now, false);
    let read =
        |rig: &Rig, name| Quantity::named(name).and_then(|q| q.read(&rig.model, rig.now)).map(|s| s.value);
    assert_eq!(read(&rig, "height"), Some(125.5));
    assert_eq!(read(&rig, "time to ignition").map(|s| (10.0 * s).round()), Some(31.0));
    assert_eq!(next(&rig).as_deref(), Some(" next IGNITION in 3.1 s at 58 m, motor not armed"));
    let mut rig = powered();
    rig.run(0.4);
    assert_eq!(next(&rig).as_deref(), Some(" next touchdown in 1.9 s"));
}

/// A position on the pad says nothing about a flight that starts at apogee.
#[test]
fn a_prediction_does_not_begin_on_the_pad() {
    let mut rig = counting();
    rig.run(0.5);
    rig.phase = TdPhase::TD_PHASE_AERO_DESCENT;
    rig.run(0.1);
    rig.speaks = false;
    rig.run(4.0);
    assert_eq!(predict_position(&rig.model.vehicle, rig.now), None);
}

//! Whether a command was accepted can be read on every screen: in every state, at every danger, in
//! every theme and width.

use ground::key::Key;
use ground::model::{Acknowledgement, CommandKind};
use ground::update::Msg;
use ground::view::status_lines;
use ground::view::theme::{Depth, Level, Palette, Theme};
use ground::view::top_lines::level;
use protocol::dialect::{TdAbortEffect, TdBooster, TdInterlock, TdLatch, TdMotor, TdPhase};
use strum::VariantArray as _;

use crate::pictures::{CONTRAST_MIN, contrast, flying};
use crate::rig::svg::colours;
use crate::rig::{MONO, Rig};
use crate::screens::{armed, coasting, on_the_pad, powered};

const SIZES: [(u16, u16); 4] = [(80, 24), (120, 36), (140, 45), (200, 50)];

/// A vehicle at each danger, with the colour of its rows.
fn dangers() -> Vec<(&'static str, Rig)> {
    let mut boost = armed();
    (boost.phase, boost.countdown_ms) = (TdPhase::TD_PHASE_BOOST, -600);
    boost.run(0.5);
    let mut down = flying(TdPhase::TD_PHASE_TOUCHDOWN);
    (down.motor, down.approach_wait_s) = (TdMotor::TD_MOTOR_HOT, 52);
    down.run(0.5);
    let mut pinned = flying(TdPhase::TD_PHASE_TOUCHDOWN);
    (pinned.motor, pinned.approach_wait_s) = (TdMotor::TD_MOTOR_PIN_IN, 0);
    pinned.run(0.5);
    let mut waited = flying(TdPhase::TD_PHASE_TOUCHDOWN);
    (waited.motor, waited.approach_wait_s) = (TdMotor::TD_MOTOR_LIVE, 0);
    waited.run(0.5);
    let mut lost = coasting();
    lost.speaks = false;
    lost.run(6.0);
    vec![
        ("calm", on_the_pad()),
        ("armed", armed()),
        ("boost", boost),
        ("coast", coasting()),
        ("burn", powered()),
        ("down", down),
        ("one person", waited),
        ("free", pinned),
        ("lost", lost),
    ]
}

/// Every state of the latest command, with its name.
fn in_every_state(rig: &mut Rig, kind: CommandKind, mut see: impl FnMut(&str, &Rig)) {
    use Acknowledgement as A;
    rig.msg(Msg::Commanded(kind));
    let now = rig.now;
    let is_ours = |rig: &Rig| {
        rig.model.commands.tracks.iter().position(|track| track.kind == kind).expect("it was commanded")
    };
    for state in [A::Waiting, A::InProgress, A::Proposed, A::GivenUp]
        .into_iter()
        .chain([0, 1, 3, 5, 9].map(A::Answered))
    {
        for (observed, is_withdrawn) in [(None, false), (None, true), (Some(now), false)] {
            let place = is_ours(rig);
            let track = &mut rig.model.commands.tracks[place];
            (track.acknowledged, track.acknowledged_at, track.attempts) = (state, Some(now), 12_345);
            (track.observed_at, track.is_withdrawn) = (observed, is_withdrawn);
            see(&format!("{kind:?} {state:?} {observed:?} {is_withdrawn}"), rig);
        }
    }
    let place = is_ours(rig);
    rig.model.commands.tracks[place].acknowledged = A::Answered(0);
    rig.model.commands.tracks[place].observed_at = None;
    rig.now += ground::model::OBSERVE_WITHIN;
    see(&format!("{kind:?} not observed"), rig);
    rig.now = now;
}

/// The letters of the first four and the last three rows that cannot be read, on a terminal of 256
/// colours or of 24 bits.
fn unreadable(rig: &Rig, (columns, rows): (u16, u16), theme: Theme) -> Vec<String> {
    let terminal = rig.draw(columns, rows, theme);
    let cells = terminal.backend().buffer().content.chunks(usize::from(columns)).enumerate();
    let checked = cells.filter(|(row, _)| *row < 4 || *row + 3 >= usize::from(rows));
    checked
        .flat_map(|(row, cells)| cells.iter().map(move |cell| (row, cell)))
        .filter(|(_, cell)| !cell.symbol().trim().is_empty() && !"│─┌┐└┘├┤┬┴┼┄".contains(cell.symbol()))
        .filter_map(|(row, cell)| {
            let found = [Depth::Indexed, Depth::True].map(|depth| {
                let mut cell = cell.clone();
                (cell.fg, cell.bg) = (depth.shown(cell.fg, false), depth.shown(cell.bg, true));
                let (fore, back) = colours(&cell);
                contrast(fore, back)
            });
            let is_readable = found.iter().all(|found| *found >= CONTRAST_MIN);
            (!is_readable).then(|| format!("row {row} {:?} {found:.2?}", cell.symbol()))
        })
        .collect()
}

#[test]
fn the_dangers_have_every_colour_of_a_row() {
    let levels: Vec<Level> = dangers().iter().map(|(_, rig)| level(&rig.model, rig.now)).collect();
    assert!(Level::VARIANTS.iter().all(|level| levels.contains(level)), "{levels:?}");
}

#[test]
fn every_command_in_every_state_can_be_read_at_every_danger_in_every_theme() {
    for (danger, mut rig) in dangers() {
        // The others stand in the last rows, whose ground is that of the page.
        let others = ["calm", "boost", "down"].contains(&danger);
        for kind in CommandKind::ALL.iter().copied().filter(|kind| others || *kind == CommandKind::Abort) {
            in_every_state(&mut rig, kind, |state, rig| {
                for palette in Palette::VARIANTS.iter().copied() {
                    let theme = Theme { palette, ascii: false };
                    let sizes = if kind == CommandKind::Abort { &SIZES[..] } else { &SIZES[..1] };
                    for size in sizes {
                        let wrong = unreadable(rig, *size, theme);
                        assert!(wrong.is_empty(), "{danger} {state} {palette:?} {size:?}: {wrong:?}");
                    }
                }
            });
        }
    }
}

/// An abort that is begun, and one that is kept for the next station.
#[test]
fn a_begun_and_an_unsent_abort_can_be_read_at_every_danger_in_every_theme() {
    for (danger, rig) in dangers() {
        let mut kept = rig;
        kept.model.link.abort_unsent = true;
        kept.run(0.1);
        let mut begun = dangers().into_iter().find(|(name, _)| *name == danger).unwrap().1;
        begun.key(Key::CtrlX);
        for rig in [kept, begun] {
            for palette in Palette::VARIANTS.iter().copied() {
                for size in SIZES {
                    let wrong = unreadable(&rig, size, Theme { palette, ascii: false });
                    assert!(wrong.is_empty(), "{danger} {palette:?} {size:?}: {wrong:?}");
                }
            }
        }
    }
}

/// The row of the abort says the three facts, and the key that acts now.
#[test]
fn the_key_that_acts_now_stays_beside_an_abort_in_every_state() {
    for (danger, mut rig) in dangers() {
        in_every_state(&mut rig, CommandKind::Abort, |state, rig| {
            for (columns, rows) in SIZES {
                let screen = rig.draw(columns, rows, MONO).backend().to_string();
                let row = screen.lines().find(|row| row.contains("ABORT Ctrl-X Enter"));
                let row = row.unwrap_or_else(|| panic!("{danger} {state} {columns}: no key\n{screen}"));
                assert!(row.contains(" ack") && row.contains(" obs"), "{danger} {state} {columns}: {row}");
                assert!(!row.contains('…'), "{danger} {state} {columns}: {row}");
            }
        });
        let mut rig = rig;
        rig.key(Key::CtrlX);
        assert!(rig.screen(80, 24).contains("ENTER ABORTS (or Ctrl-X)"), "{danger}");
        rig.model.link.abort_unsent = true;
        assert!(rig.screen(80, 24).contains("Esc cancels it"), "{danger}");
    }
}

/// After an abort on the way up what comes next is the parachute, and when.
#[test]
fn after_an_abort_on_the_way_up_the_parachute_comes_next_and_not_the_burn() {
    let mut rig = coasting();
    rig.abort();
    rig.interlocks |= TdInterlock::TD_INTERLOCK_ABORT_LATCHED | TdInterlock::TD_INTERLOCK_MOTOR_INHIBITED;
    rig.latch = TdLatch::TD_LATCH_COMMANDED;
    rig.abort_effect = TdAbortEffect::TD_ABORT_EFFECT_NONE;
    rig.run(0.2);
    rig.state(8.5, 184.8, 2.9, 29.4, 86.0);
    rig.ascent(TdBooster::TD_BOOSTER_ATTACHED, 301.0, 3.0);
    let next = |rig: &Rig| status_lines::next_event(&rig.model, rig.now, true);
    assert_eq!(next(&rig).as_deref(), Some(" next parachute in 3.0 s, at apogee"));
    // It stands beside the state on every page, also once the alarm was seen.
    for key in "123456789 ".chars() {
        rig.key(Key::Char(key));
        let second = rig.screen(80, 24).lines().nth(1).unwrap_or_default().to_owned();
        assert!(second.contains(&next(&rig).unwrap()), "{key}: {second}");
    }
    for (phase, words) in [
        (TdPhase::TD_PHASE_BOOST, " next parachute, at apogee"),
        (TdPhase::TD_PHASE_DEPLOY, " next parachute"),
    ] {
        rig.phase = phase;
        rig.run(0.1);
        assert_eq!(next(&rig).as_deref(), Some(words));
    }
}

//! Whole screens, as text without colour, and the styles of their cells with colour.
//!
//! `cargo insta review` or `INSTA_UPDATE=always cargo test` takes new ones.

use crate::bench::{Bench, MONO, is_abort, settings, typed};
use ground::key::Key;
use ground::update::Msg;
use ground::view::theme::Theme;
use protocol::dialect::{MavCmd, TdAbortEffect, TdInterlock, TdLimit, TdPhase};
use protocol::frame::FramerCounters;
use ratatui::style::Color;

const SIZES: [(u16, u16); 3] = [(80, 24), (40, 12), (20, 5)];

pub(crate) fn snapshot(name: &str, bench: &Bench) {
    for (columns, rows) in SIZES {
        insta::assert_snapshot!(format!("{name}_{columns}x{rows}"), bench.screen(columns, rows));
        insta::assert_snapshot!(format!("{name}_{columns}x{rows}_styles"), bench.styles(columns, rows));
    }
}

pub(crate) fn on_the_pad() -> Bench {
    let mut bench = Bench::crewed();
    bench.state(0.0, 15.0, 0.0, 0.0, 90.0);
    bench.actuators(0);
    bench.limits();
    bench.plan(TdLimit::empty());
    bench
}

pub(crate) fn armed() -> Bench {
    let mut bench = on_the_pad();
    bench.keys(&[typed("AARM"), vec![Key::Enter]].concat());
    bench.answer(MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, 0);
    bench.armed = true;
    bench.phase = TdPhase::TD_PHASE_PAD_ARMED;
    bench.interlocks |= TdInterlock::TD_INTERLOCK_ARMED;
    bench.run(1.0);
    bench
}

pub(crate) fn counting() -> Bench {
    let mut bench = armed();
    bench.keys(&crate::hand::start_ladder());
    bench.answer(MavCmd::MAV_CMD_MISSION_START, 0);
    bench.countdown_ms = 3_200;
    bench.run(1.0);
    bench
}

pub(crate) fn powered() -> Bench {
    let mut bench = counting();
    bench.phase = TdPhase::TD_PHASE_POWERED;
    bench.abort_effect = TdAbortEffect::TD_ABORT_EFFECT_LAND_HERE;
    bench.countdown_ms = -2_700;
    bench.run(1.0);
    for k in 0..20_u16 {
        let fallen = f32::from(k) * 0.4;
        bench.state(-0.05 * fallen, 15.0 - fallen, -0.1, -3.4, 89.0);
        bench.run(0.1);
    }
    bench.actuators(-640);
    bench.plan(TdLimit::empty());
    bench
}

/// Until the vehicle has said its limits the screen shows none.
#[test]
fn limits_are_shown_once_the_vehicle_has_said_them() {
    let mut bench = Bench::crewed();
    bench.key(Key::Char('3'));
    bench.actuators(0);
    bench.plan(TdLimit::TD_LIMIT_AXIAL_SPEED);
    let screen = bench.screen(80, 24);
    assert!(
        screen.contains("NO u     -0.050 -- m/s") && screen.contains(" -         0         +"),
        "{screen}"
    );
    bench.limits();
    let screen = bench.screen(80, 24);
    assert!(screen.contains("NO u     -0.050 ±0.4 m/s") && screen.contains("+20 deg"), "{screen}");
}

/// A serial line's capacity stands beside its rate; a network's is unknown.
#[test]
fn the_links_capacity_is_shown_beside_its_rate() {
    let mut settings = settings(false, true);
    settings.link_capacity_bytes_s = Some(5_760);
    let mut bench = Bench::new(settings);
    bench.key(Key::Char('5'));
    bench.run(1.0);
    bench.msg(Msg::Received { bytes: 1_600, framing: FramerCounters::default() });
    assert!(bench.screen(80, 24).contains(" rx 1600/5760 B/s "), "{}", bench.screen(80, 24));
    let mut bench = Bench::crewed();
    bench.key(Key::Char('5'));
    bench.msg(Msg::Received { bytes: 1_600, framing: FramerCounters::default() });
    assert!(bench.screen(80, 24).contains(" rx 1600 B/s "));
}

#[test]
fn regress_abort_chord_and_abort() {
    let mut bench = powered();
    bench.key(Key::CtrlX);
    snapshot("abort_chord", &bench);
    bench.run(0.4);
    bench.key(Key::CtrlX);
    bench.run(1.0);
    assert!(bench.take_commands().iter().any(is_abort));
    snapshot("abort_sent", &bench);
}

pub(crate) fn descending() -> Bench {
    let mut bench = armed();
    bench.phase = TdPhase::TD_PHASE_AERO_DESCENT;
    bench.abort_effect = TdAbortEffect::TD_ABORT_EFFECT_CHUTE_NOW;
    bench.run(1.0);
    bench.state(4.0, 132.0, -0.6, -21.5, 88.0);
    bench.actuators(0);
    bench.descent(132.0);
    bench
}

/// Every screen by its digit, before and during a flight.
#[test]
fn regress_every_screen_by_its_digit() {
    for (digit, name) in [
        ('4', "review"),
        ('5', "link"),
        ('6', "messages"),
        ('7', "parameters"),
        ('8', "log"),
        ('9', "alarms"),
        ('1', "pad_held"),
    ] {
        let mut bench = powered();
        bench.key(Key::Char(digit));
        snapshot(&format!("screen_{name}"), &bench);
    }
}

#[test]
fn regress_ascii() {
    for (name, bench) in [("powered", powered()), ("descent", descending()), ("pad", on_the_pad())] {
        let ascii = Theme { colour: false, ascii: true };
        insta::assert_snapshot!(format!("ascii_{name}"), bench.draw(80, 24, ascii).backend().to_string());
    }
}

/// No page, phase, dialog or size leaves a cell that an ASCII terminal cannot show, and none panics.
#[test]
fn every_screen_at_every_size_and_in_ascii() {
    let benches = [on_the_pad(), counting(), descending(), powered()];
    for mut bench in benches {
        for digit in '0'..='9' {
            bench.key(Key::Char(digit));
            for (columns, rows) in [(1, 1), (7, 3), (20, 5), (40, 12), (79, 60), (80, 24), (300, 90)] {
                let terminal = bench.draw(columns, rows, Theme { colour: true, ascii: true });
                let cells = &terminal.backend().buffer().content;
                assert!(cells.iter().all(|cell| cell.symbol().is_ascii()), "{digit} {columns}x{rows}");
            }
        }
    }
}

/// The screen follows the flight; a held one stays; Escape follows again.
#[test]
fn screens_follow_the_flight_and_can_be_held() {
    let mut bench = descending();
    assert!(bench.screen(80, 24).contains("[2Descent]"));
    bench.key(Key::Char('h'));
    bench.phase = TdPhase::TD_PHASE_POWERED;
    bench.run(1.0);
    assert!(bench.screen(80, 24).contains("[2Descent]") && bench.screen(80, 24).contains("HELD"));
    bench.key(Key::Escape);
    assert!(bench.screen(80, 24).contains("[3Landing]") && bench.screen(80, 24).contains("auto"));
    bench.phase = TdPhase::TD_PHASE_TOUCHDOWN;
    bench.run(1.0);
    assert!(bench.screen(80, 24).contains("[4Review]"));
}

#[test]
fn regress_help() {
    let mut bench = on_the_pad();
    bench.key(Key::F1);
    snapshot("help", &bench);
}

/// Colour only repeats: without it the same words stand in the same cells, and no cell has a colour.
#[test]
fn colour_carries_nothing_alone() {
    let mut lost = powered();
    lost.speaks = false;
    lost.run(6.0);
    for mut bench in [on_the_pad(), counting(), descending(), powered(), lost] {
        for digit in '0'..='9' {
            bench.key(Key::Char(digit));
            let mono = bench.draw(80, 24, MONO);
            let coloured = bench.draw(80, 24, Theme { colour: true, ascii: false });
            let cells = |terminal: &ratatui::Terminal<ratatui::backend::TestBackend>| {
                let cells = &terminal.backend().buffer().content;
                cells.iter().map(|cell| cell.symbol().to_owned()).collect::<Vec<_>>()
            };
            assert_eq!(cells(&mono), cells(&coloured), "screen {digit}");
            let grey = |cell: &ratatui::buffer::Cell| cell.fg == Color::Reset && cell.bg == Color::Reset;
            assert!(mono.backend().buffer().content.iter().all(grey), "screen {digit}");
        }
    }
}

/// Phase, armed, countdown, link and the abort key stay where they are under every dialog.
#[test]
fn the_top_lines_keep_their_place() {
    let top = |bench: &Bench| bench.screen(80, 24).lines().take(2).collect::<String>();
    let mut bench = armed();
    let before = top(&bench);
    for key in
        [Key::Char('S'), Key::Escape, Key::Char('D'), Key::Escape, Key::F1, Key::Escape, Key::Char('q')]
    {
        bench.key(key);
        assert_eq!(top(&bench), before, "after {key:?}");
    }
}

/// One quantity has one value, wherever it stands.
#[test]
fn one_quantity_has_one_value_on_a_screen() {
    let mut bench = descending();
    // What steers the descent was told a moment before the position.
    bench.descent(131.2);
    bench.run(0.3);
    bench.state(4.0, 125.5, -0.6, -21.5, 88.0);
    let screen = bench.screen(80, 24);
    assert!(screen.contains("< 125.5 ") && screen.contains("height         125.5 m"), "{screen}");
    assert!(screen.contains(" next IGNITION in 3.1 s"), "{screen}");
    assert!(screen.contains("ignite in        3.1 s"), "{screen}");
    let mut bench = powered();
    bench.run(0.4);
    let screen = bench.screen(80, 24);
    assert!(screen.contains("in          1.9 s"), "2.3 s, told 0.4 s ago: {screen}");
    assert!(bench.screen(40, 12).contains(" next touchdown in 1.9 s"), "{}", bench.screen(40, 12));
}

#[test]
fn a_limit_to_either_side_is_plus_minus_in_ascii_too() {
    let ascii = Theme { colour: false, ascii: true };
    let screen = powered().draw(80, 24, ascii).backend().to_string();
    assert!(screen.contains("+-0.4 m/s") && !screen.contains("<0.4"), "{screen}");
}

/// A report of the pad says nothing of where a vehicle is that flies from apogee.
#[test]
fn a_prediction_does_not_begin_on_the_pad() {
    let mut bench = counting();
    bench.run(0.5);
    bench.phase = TdPhase::TD_PHASE_AERO_DESCENT;
    bench.run(0.1);
    bench.speaks = false;
    bench.run(4.0);
    let screen = bench.screen(80, 24);
    assert!(screen.contains("position unknown:") && !screen.contains("pred "), "{screen}");
    assert!(!screen.contains("15.0 m"), "the pad's: {screen}");
}

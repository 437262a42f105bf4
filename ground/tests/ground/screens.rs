//! Whole screens, as text. `cargo insta review` or `INSTA_UPDATE=always cargo test` takes new ones.

use crate::bench::{Bench, MONO, is_abort, settings, typed};
use ground::key::Key;
use ground::update::Msg;
use ground::view::theme::Theme;
use protocol::dialect::{MavCmd, TdAbortEffect, TdInterlock, TdLimit, TdPhase};
use protocol::frame::FramerCounters;
use ratatui::style::Color;

const SIZES: [(u16, u16); 3] = [(80, 24), (40, 12), (20, 5)];

fn snapshot(name: &str, bench: &Bench) {
    for (columns, rows) in SIZES {
        insta::assert_snapshot!(format!("{name}_{columns}x{rows}"), bench.screen(columns, rows));
    }
}

fn on_the_pad() -> Bench {
    let mut bench = Bench::crewed();
    bench.state(0.0, 15.0, 0.0, 0.0, 90.0);
    bench.actuators(0);
    bench.limits();
    bench.plan(TdLimit::empty());
    bench
}

fn armed() -> Bench {
    let mut bench = on_the_pad();
    bench.keys(&[typed("AARM"), vec![Key::Enter]].concat());
    bench.answer(MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, 0);
    bench.armed = true;
    bench.phase = TdPhase::TD_PHASE_PAD_ARMED;
    bench.interlocks |= TdInterlock::TD_INTERLOCK_ARMED;
    bench.run(1.0);
    bench
}

fn counting() -> Bench {
    let mut bench = armed();
    bench.keys(&[Key::Char('S'), Key::Enter]);
    bench.answer(MavCmd::MAV_CMD_MISSION_START, 0);
    bench.countdown_ms = 3_200;
    bench.run(1.0);
    bench
}

fn powered() -> Bench {
    let mut bench = counting();
    bench.phase = TdPhase::TD_PHASE_POWERED;
    bench.abort_effect = TdAbortEffect::TD_ABORT_EFFECT_UPRIGHT_ONLY;
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

#[test]
fn regress_pad() {
    snapshot("pad", &on_the_pad());
}

#[test]
fn regress_pad_no_go() {
    let mut bench = on_the_pad();
    bench.checks_failed = 0b1010;
    bench.run(0.1);
    bench.key(Key::Char('A'));
    bench.keys(&typed("AR"));
    snapshot("pad_no_go_arming", &bench);
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
fn regress_countdown() {
    snapshot("countdown", &counting());
}

#[test]
fn regress_powered() {
    snapshot("powered", &powered());
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

#[test]
fn regress_landed() {
    let mut bench = powered();
    bench.phase = TdPhase::TD_PHASE_TOUCHDOWN;
    bench.abort_effect = TdAbortEffect::TD_ABORT_EFFECT_NONE;
    bench.verdict(true, TdLimit::empty());
    bench.run(0.5);
    snapshot("landed", &bench);
}

#[test]
fn regress_not_landed() {
    let mut bench = powered();
    bench.phase = TdPhase::TD_PHASE_TOUCHDOWN;
    bench.verdict(false, TdLimit::TD_LIMIT_AXIAL_SPEED | TdLimit::TD_LIMIT_PITCH);
    bench.run(0.5);
    snapshot("not_landed", &bench);
}

/// A vehicle that judges by its legs: Table 2 is computed here, said to be, and where the figures do not tell it says so.
#[test]
fn regress_landed_on_the_legs() {
    let mut bench = burning_in_space();
    bench.phase = TdPhase::TD_PHASE_TOUCHDOWN;
    bench.abort_effect = TdAbortEffect::TD_ABORT_EFFECT_NONE;
    bench.contact([6.2, 1.545, -0.52, 0.04, 0.07], true, TdLimit::empty());
    bench.run(0.5);
    let screen = bench.screen(80, 24);
    assert!(screen.contains(" LANDED inside every limit (vehicle: legs)  Table 2* OUTSIDE"), "{screen}");
    assert!(screen.contains("u       -0.520 m/s    ok ±1      NO ±0.4"), "{screen}");
    assert!(screen.contains("q        4.011 deg/s  ok ±30     ?  ±2"), "{screen}");
    snapshot("landed_on_the_legs", &bench);
}

#[test]
fn regress_link_lost() {
    let mut bench = powered();
    bench.speaks = false;
    bench.run(6.0);
    snapshot("link_lost", &bench);
}

#[test]
fn regress_nothing_heard() {
    let mut bench = Bench::new(settings(false, true));
    bench.speaks = false;
    bench.run(1.0);
    snapshot("nothing_heard", &bench);
}

/// A vehicle that moves and leans towards the east: the plane of north and up shows nothing of it.
#[test]
fn what_points_east_is_in_every_number() {
    let mut bench = powered();
    bench.state_in_space([0.0, 30.0, 40.0], [0.0, 4.0, -3.0], (90.0, 20.0));
    bench.run(0.1);
    let screen = bench.screen(80, 24);
    for row in [
        "horizontal      4.00 m/s",
        "distance        30.0 m",
        // 4 m/s sin 20 deg - 3 m/s cos 20 deg, and what is left of 5 m/s across the axis.
        "u axial        -1.45 m/s",
        "lateral        4.785 m/s",
        "tilt           20.00 deg",
        // The nose turns by 0.02 and 0.03 rad/s.
        "turn rate       2.07 deg/s",
    ] {
        assert!(screen.contains(row), "{row}\n{screen}");
    }
    assert!(bench.screen(40, 12).contains("tilt 20.0 u -1.5 lat 4.78"), "{}", bench.screen(40, 12));
    bench.key(Key::Char('2'));
    let screen = bench.screen(80, 24);
    for row in ["horizontal       4.0 m/s", "distance        30.0 m", "tilt            20.0 deg"] {
        assert!(screen.contains(row), "{row}\n{screen}");
    }
    bench.key(Key::Char('4'));
    let screen = bench.screen(80, 24);
    for row in [
        "distance               30.0 m",
        "tilt                  20.00 deg",
        "turn rate              2.07 deg/s",
    ] {
        assert!(screen.contains(row), "{row}\n{screen}");
    }
}

/// The yaw plane's gimbal counts as much as the pitch plane's.
#[test]
fn the_greatest_gimbal_angle_is_that_of_either_axis() {
    let mut bench = powered();
    bench.gimbal([(-100, -80), (420, 390)]);
    bench.run(0.1);
    bench.key(Key::Char('4'));
    assert!(bench.screen(80, 24).contains("gimbal                 3.90 deg"), "{}", bench.screen(80, 24));
}

fn descending() -> Bench {
    let mut bench = armed();
    bench.phase = TdPhase::TD_PHASE_AERO_DESCENT;
    bench.abort_effect = TdAbortEffect::TD_ABORT_EFFECT_CHUTE_NOW;
    bench.run(1.0);
    bench.state(4.0, 132.0, -0.6, -21.5, 88.0);
    bench.actuators(0);
    bench.descent(132.0);
    bench
}

#[test]
fn regress_descent() {
    snapshot("descent", &descending());
}

/// North is up; the pad is marked where it lies, at every bearing, whatever else is drawn there.
#[test]
fn the_way_to_the_pad_is_on_the_picture_at_every_bearing() {
    let mut bench = descending();
    for bearing_deg in (0..360).step_by(15) {
        let (east, north) = libm::sincos(f64::from(bearing_deg).to_radians());
        let (north, east) = ((-40.0 * north) as f32, (-40.0 * east) as f32);
        bench.state_in_space([north, east, 120.0], [0.0, 0.0, -21.5], (0.0, 3.0));
        for (columns, rows) in [(80, 24), (100, 30), (120, 40), (133, 50)] {
            let screen = bench.screen(columns, rows);
            let picture =
                screen.lines().skip(4).take(9).map(|line| line.chars().skip(55).collect::<String>());
            let marks: usize = picture.map(|line| line.matches(['P', 'N']).count()).sum();
            assert_eq!(marks, 2, "{bearing_deg} deg\n{screen}");
        }
    }
}

#[test]
fn regress_descent_without_its_data() {
    let mut bench = armed();
    bench.phase = TdPhase::TD_PHASE_COAST;
    bench.run(1.0);
    snapshot("coast", &bench);
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
    let top = |bench: &Bench| bench.screen(80, 24).lines().take(1).collect::<String>();
    let mut bench = armed();
    let before = top(&bench);
    for key in
        [Key::Char('S'), Key::Escape, Key::Char('D'), Key::Escape, Key::F1, Key::Escape, Key::Char('q')]
    {
        bench.key(key);
        assert_eq!(top(&bench), before, "after {key:?}");
    }
}

/// A flight in space, at its burn: from 300 m down, and from ignition on.
fn burning_in_space() -> Bench {
    let mut bench = armed();
    bench.limits_of_legs();
    let mut fall = |phase, heights: std::ops::Range<u16>, lean: (f64, f64)| {
        bench.phase = phase;
        bench.run(0.2);
        for step in heights.rev() {
            let height = f32::from(step) * 4.0;
            bench.state_in_space([height * 0.3, -height * 0.2, height], [-3.0, 2.0, -20.0], lean);
            bench.run(0.1);
        }
    };
    fall(TdPhase::TD_PHASE_AERO_DESCENT, 18..75, (120.0, 6.0));
    fall(TdPhase::TD_PHASE_IGNITION, 17..18, (120.0, 6.0));
    fall(TdPhase::TD_PHASE_POWERED, 7..17, (300.0, 28.0));
    bench.abort_effect = TdAbortEffect::TD_ABORT_EFFECT_UPRIGHT_ONLY;
    bench.countdown_ms = -2_700;
    bench.run(0.2);
    bench.state_in_space([8.0, -5.5, 27.5], [-3.0, 2.0, -13.0], (300.0, 28.0));
    bench.plan_along(&[
        (8.0, 27.0),
        (6.5, 20.0),
        (5.0, 14.0),
        (3.5, 8.5),
        (2.5, 4.0),
        (1.8, 1.5),
        (1.4, 0.0),
    ]);
    bench.gimbal([(-310, -250), (420, 390)]);
    bench.actuated_fins();
    bench
}

/// From ignition on the side view shows the burn alone, at its own scale; the descent's is the whole.
#[test]
fn the_side_view_of_a_landing_begins_with_its_burn() {
    let mut bench = burning_in_space();
    assert!(bench.screen(80, 24).contains("73 m up"), "{}", bench.screen(80, 24));
    assert!(bench.screen(80, 24).contains("limit ±120 m"), "{}", bench.screen(80, 24));
    bench.key(Key::Char('2'));
    assert!(bench.screen(80, 24).contains("321 m up"), "{}", bench.screen(80, 24));
}

/// Command and measurement of both planes, where there are two.
#[test]
fn both_planes_of_a_gimbal_in_space_are_shown() {
    let bench = burning_in_space();
    let screen = bench.screen(80, 24);
    assert!(
        screen.contains("pitch o  -3.1 #  -2.5 deg") && screen.contains("yaw   o   4.2 #   3.9 deg"),
        "{screen}"
    );
    let small = bench.screen(40, 24);
    assert!(small.contains("yaw   o   4.2 #   3.9 deg"), "{small}");
}

#[test]
fn regress_powered_in_space() {
    snapshot("powered_in_space", &burning_in_space());
}

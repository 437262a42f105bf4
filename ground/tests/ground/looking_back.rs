//! The look at the past of a flight: marked, short, and never instead of header, alarms and abort.

use ground::key::Key;
use protocol::dialect::{TdInterlock, TdPhase};

use crate::rig::{Rig, is_abort};
use crate::screens::armed;

/// Falls from 200 m for ten seconds.
fn falling() -> Rig {
    let mut rig = armed();
    rig.phase = TdPhase::TD_PHASE_AERO_DESCENT;
    for k in 0..100_u16 {
        rig.state(0.0, 200.0 - f32::from(k), 0.0, -10.0, 90.0);
        rig.run(0.1);
    }
    rig
}

/// The height on the page of all values.
fn height_m(rig: &mut Rig) -> f64 {
    rig.model.pages.hold(Some(ground::model::Page::Values));
    let screen = rig.screen(80, 24);
    let text = screen.split("altitude").nth(1).and_then(|rest| rest.split_whitespace().next());
    text.and_then(|text| text.trim_start_matches('~').parse().ok()).unwrap_or_else(|| panic!("{screen}"))
}

#[test]
fn left_shows_the_past_and_says_so() {
    let mut rig = falling();
    assert!(height_m(&mut rig) < 105.0);
    rig.keys(&[Key::Left; 4]);
    let screen = rig.screen(80, 24);
    assert!(screen.contains(" PAST: ") && screen.contains("s ago. Live again in 10 s"), "{screen}");
    assert!((135.0..=146.0).contains(&height_m(&mut rig)), "{screen}");
    rig.keys(&[Key::Right; 2]);
    assert!((115.0..=126.0).contains(&height_m(&mut rig)), "{}", rig.screen(80, 24));
    rig.keys(&[Key::Right; 2]);
    assert!(!rig.screen(80, 24).contains("PAST"), "the end of the past is the present");
}

#[test]
fn the_past_ends_after_ten_seconds_with_a_key_and_on_any_alarm() {
    let mut rig = falling();
    rig.key(Key::Left);
    rig.run(9.8);
    assert!(rig.screen(80, 24).contains("PAST"));
    rig.run(0.4);
    assert!(!rig.screen(80, 24).contains("PAST"));
    for leave in [Key::Escape, Key::Char('0')] {
        rig.key(Key::Left);
        rig.key(leave);
        assert!(!rig.screen(80, 24).contains("PAST"), "{leave:?}");
    }
    rig.key(Key::Left);
    assert!(rig.screen(80, 24).contains("PAST"));
    rig.interlocks |= TdInterlock::TD_INTERLOCK_NO_LIGHT;
    rig.run(0.1);
    let screen = rig.screen(80, 24);
    assert!(screen.contains("ALARM NO LIGHT") && !screen.contains("PAST"), "{screen}");
}

/// The top lines tell the present while the page shows the past, and the abort works at once.
#[test]
fn header_and_abort_stay_live() {
    let mut rig = falling();
    rig.keys(&[Key::Left; 9]);
    rig.phase = TdPhase::TD_PHASE_LAND_ARMED;
    rig.run(0.2);
    let screen = rig.screen(80, 24);
    assert!(screen.lines().nth(1).unwrap().contains("Ready to light") && screen.contains("PAST"), "{screen}");
    assert!(
        !screen
            .lines()
            .take(24)
            .any(|line| line.contains("AERO_DESCENT -> LAND_ARMED") && line.contains("vehicle"))
    );
    rig.take_commands();
    rig.abort();
    assert!(rig.take_commands().iter().any(is_abort));
}

#[test]
fn there_is_no_past_before_a_countdown() {
    let mut rig = crate::screens::on_the_pad();
    rig.key(Key::Left);
    assert!(!rig.screen(80, 24).contains("PAST"));
}

/// The bar of the flight shows its phases, and where the shown moment is.
#[test]
fn the_bar_shows_the_phases_along_time() {
    let mut rig = falling();
    rig.phase = TdPhase::TD_PHASE_POWERED;
    for _ in 0..20 {
        rig.state(0.0, 80.0, 0.0, -10.0, 90.0);
        rig.run(0.1);
    }
    let screen = rig.screen(80, 24);
    let bar = screen.lines().nth(22).unwrap();
    let (descent, burn) = (bar.find("falls").expect(&screen), bar.rfind('●').unwrap());
    assert!(descent < burn, "{screen}");
}

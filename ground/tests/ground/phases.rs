//! Snapshots of the screen in each phase of a flight.

use ground::key::Key;
use ground::model::{Page, quantity::Quantity};
use ground::view::pictures::map::comes_down;
use ground::view::theme::{Palette, TextRole, Theme};
use ground::view::{status_lines, top_lines};
use protocol::dialect::{TdAbortEffect, TdBooster, TdCheck, TdChute, TdInterlock, TdLimit, TdPhase};

use crate::rig::{Rig, settings, typed};
use crate::screens::{armed, coasting, counting, descending, on_the_pad, powered, snapshot};

#[test]
fn regress_the_phases() {
    snapshot("pad", &on_the_pad());
    snapshot("countdown", &counting());
    snapshot("ascent", &coasting());
    snapshot("descent", &descending());
    snapshot("powered", &powered());
}

#[test]
fn regress_pad_no_go() {
    let mut rig = on_the_pad();
    rig.checks_failed = (TdCheck::TD_CHECK_PIN | TdCheck::TD_CHECK_TILT).bits();
    rig.run(0.1);
    rig.key(Key::Char('A'));
    rig.keys(&typed("AR"));
    snapshot("pad_no_go_arming", &rig);
}

/// The ascent shares the key of the descent, and gives way to it at apogee.
#[test]
fn the_ascent_page_shows_apogee_and_booster_until_it_is_over() {
    let mut rig = coasting();
    let apogee =
        |rig: &Rig| Quantity::named("apogee").and_then(|quantity| quantity.read(&rig.model, rig.now));
    assert_eq!(apogee(&rig).map(|apogee| apogee.value), Some(301.0));
    // Under the ascent motor no apogee is known.
    rig.ascent(TdBooster::TD_BOOSTER_ATTACHED, f32::NAN, f32::NAN);
    assert_eq!(apogee(&rig), None);
    assert!(!rig.screen(80, 24).contains("s to apogee"), "{}", rig.screen(80, 24));
    rig.key(Key::Char('2'));
    assert_eq!(rig.model.page(), Page::Ascent);
    rig.phase = TdPhase::TD_PHASE_AERO_DESCENT;
    rig.run(1.0);
    assert_eq!(rig.model.page(), Page::Descent);
}

#[test]
fn regress_the_ends() {
    for (name, landed, violated) in [
        ("landed", true, TdLimit::empty()),
        ("not_landed", false, TdLimit::TD_LIMIT_VERTICAL_SPEED | TdLimit::TD_LIMIT_TILT),
    ] {
        let mut rig = powered();
        rig.phase = TdPhase::TD_PHASE_TOUCHDOWN;
        rig.abort_effect = TdAbortEffect::TD_ABORT_EFFECT_NONE;
        rig.verdict(landed, violated);
        rig.run(0.5);
        snapshot(name, &rig);
    }
}

#[test]
fn regress_silence() {
    let mut rig = powered();
    rig.speaks = false;
    rig.run(6.0);
    snapshot("link_lost", &rig);
    let mut rig = Rig::new(settings(false, true));
    rig.speaks = false;
    rig.run(1.0);
    snapshot("no_vehicle", &rig);
}

/// A vehicle in space, in this phase, with this abort effect.
fn in_phase(
    phase: TdPhase,
    effect: TdAbortEffect,
    (height_m, climb_m_s): (f32, f32),
    lean: (f64, f64),
) -> Rig {
    let mut rig = armed();
    rig.limits();
    rig.run(10.0);
    rig.phase = phase;
    rig.abort_effect = effect;
    rig.state_in_space([12.0, -9.0, height_m + 6.0], [-1.5, 2.0, climb_m_s], lean);
    rig.run(0.3);
    rig.state_in_space([11.6, -8.4, height_m], [-1.5, 2.0, climb_m_s], lean);
    rig.actuated_fins();
    rig
}

fn next(rig: &Rig, beside: bool) -> Option<String> {
    status_lines::next_event(&rig.model, rig.now, beside)
}

#[test]
fn regress_coast() {
    let effect = TdAbortEffect::TD_ABORT_EFFECT_CHUTE_AT_APOGEE;
    let rig = in_phase(TdPhase::TD_PHASE_COAST, effect, (240.0, 31.0), (60.0, 4.0));
    snapshot("coast", &rig);
}

#[test]
fn regress_land_armed() {
    let effect = TdAbortEffect::TD_ABORT_EFFECT_BURN;
    let mut rig = in_phase(TdPhase::TD_PHASE_LAND_ARMED, effect, (90.0, -38.0), (200.0, 6.0));
    rig.descent_with(90.0, -38.0, TdChute::TD_CHUTE_STOWED);
    assert_eq!(next(&rig, false).as_deref(), Some(" next IGNITION in 0.8 s at 58 m, motor armed"));
    // Beside the large number the time is left out.
    assert_eq!(next(&rig, true).as_deref(), Some(" next IGNITION at 58 m, motor armed"));
    snapshot("land_armed", &rig);
}

/// The reported state of the gate: above the band, with a fin that is 6 degrees behind, and not yet
/// armed it waits for three.
#[test]
fn the_gate_waits_for_the_reported_values() {
    let mut rig = descending();
    rig.limits();
    let waits = |rig: &Rig| rig.screen(120, 36).matches("wait ").count();
    assert_eq!(waits(&rig), 3, "{}", rig.screen(120, 36));
    rig.phase = TdPhase::TD_PHASE_LAND_ARMED;
    rig.run(0.2);
    rig.state(4.0, 60.0, -0.6, -21.5, 88.0);
    rig.descent(60.0);
    assert_eq!(waits(&rig), 1, "{}", rig.screen(120, 36));
}

/// Below the commit height, with the ignition gate shut, an abort still throws out the parachute.
#[test]
fn with_the_parachute_still_to_come_no_burn_is_committed_to() {
    use TdAbortEffect::{TD_ABORT_EFFECT_BURN as BURN, TD_ABORT_EFFECT_CHUTE_NOW as CHUTE_NOW};
    use TdChute::{TD_CHUTE_FIRED as FIRED, TD_CHUTE_STOWED as STOWED};
    for (effect, chute, committed) in [(BURN, STOWED, true), (CHUTE_NOW, STOWED, false), (BURN, FIRED, false)]
    {
        let mut rig = in_phase(TdPhase::TD_PHASE_LAND_ARMED, effect, (90.0, -38.0), (200.0, 6.0));
        rig.descent_with(90.0, -38.0, chute);
        let screen = rig.screen(80, 24);
        assert_eq!(screen.contains("the band, committed"), committed, "{screen}");
        assert!(screen.contains("above the band"), "{screen}");
    }
}

/// An abort in the descent: the parachute is fired, then opens.
#[test]
fn regress_chute() {
    let effect = TdAbortEffect::TD_ABORT_EFFECT_NONE;
    let mut rig = in_phase(TdPhase::TD_PHASE_CHUTE, effect, (150.0, -30.0), (200.0, 12.0));
    rig.interlocks |= TdInterlock::TD_INTERLOCK_ABORT_LATCHED | TdInterlock::TD_INTERLOCK_MOTOR_INHIBITED;
    rig.approach_wait_s = u16::MAX;
    rig.descent_with(150.0, -30.0, TdChute::TD_CHUTE_FIRED);
    rig.run(0.1);
    assert_eq!(next(&rig, true).as_deref(), Some(" next chute opens, still fast, LIVE MOTOR"));
    rig.state_in_space([9.0, -2.0, 122.0], [1.5, 2.0, -6.1], (200.0, 3.0));
    rig.descent_with(122.0, -6.1, TdChute::TD_CHUTE_OPEN);
    rig.run(0.1);
    snapshot("chute", &rig);
}

/// The vehicle checks for arming only on the pad, so in flight the pad page shows no check as
/// passed.
#[test]
fn in_flight_no_arming_check_is_shown_as_passed() {
    let mut rig = powered();
    rig.key(Key::Char('1'));
    let screen = rig.screen(80, 24);
    assert!(screen.contains("off the pad nothing is checked for arming"), "{screen}");
    assert!(!screen.contains(" GO ") && screen.contains("▶ every check passes"), "{screen}");
}

/// Whether something on the page between the rows of the state and those of the keys looks like a
/// fault.
fn looks_wrong(rig: &Rig) -> bool {
    let theme = Theme { palette: Palette::Dark, ascii: false };
    let (caution, alarm) = (theme.style(TextRole::Caution).fg, theme.style(TextRole::Alarm).bg);
    let terminal = rig.draw(80, 24, theme);
    let page = &terminal.backend().buffer().content[3 * 80..22 * 80];
    page.iter().any(|cell| Some(cell.fg) == caution || Some(cell.bg) == alarm)
}

/// At the beginning of the fall the vehicle predicts its touchdown from a sink rate of nearly zero,
/// hundreds of metres off, and knows no band. Neither counts until it knows one; only then a
/// touchdown beyond the fence is one.
#[test]
fn what_has_not_settled_is_no_fault() {
    let mut rig = coasting();
    rig.limits();
    let lands_east_m = |rig: &Rig| comes_down(&rig.model, rig.now).map(|at| at.east_m);
    assert_eq!(lands_east_m(&rig), Some(-3.0), "on the way up");
    rig.phase = TdPhase::TD_PHASE_AERO_DESCENT;
    rig.run(0.2);
    rig.ascent(TdBooster::TD_BOOSTER_SEPARATED, 0.0, 0.0);
    assert_eq!((lands_east_m(&rig), looks_wrong(&rig)), (None, false), "{}", rig.screen(80, 24));
    rig.descent(132.0);
    assert_eq!((lands_east_m(&rig).map(f64::round), looks_wrong(&rig)), (Some(-1.0), false));
    rig.descent_to([350.0, 0.0]);
    assert!(looks_wrong(&rig), "beyond the fence");
}

/// After the flight the band is not named, and nothing is said of arming.
#[test]
fn after_the_flight_no_page_judges_its_fall() {
    let mut rig = descending();
    rig.phase = TdPhase::TD_PHASE_SAFED;
    rig.run(1.0);
    rig.state(4.0, 0.0, 0.0, 0.0, 88.0);
    rig.key(Key::Char('2'));
    assert!(!looks_wrong(&rig), "{}", rig.screen(80, 24));
    assert_eq!(top_lines::readiness(&rig.model, rig.now), None);
}

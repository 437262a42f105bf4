//! The screen in each phase of a flight: phase, what is next and what an abort would do, at a glance.

use ground::key::Key;
use protocol::dialect::{TdAbortEffect, TdChute, TdInterlock, TdLimit, TdPhase};

use crate::bench::{Bench, settings, typed};
use crate::in_space::burning_in_space;
use crate::screens::{armed, counting, descending, on_the_pad, powered, snapshot};

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

#[test]
fn regress_countdown() {
    snapshot("countdown", &counting());
}

#[test]
fn regress_powered() {
    snapshot("powered", &powered());
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

#[test]
fn regress_descent() {
    snapshot("descent", &descending());
}

/// In space, in a phase, with what an abort would do there.
fn in_phase(
    phase: TdPhase,
    effect: TdAbortEffect,
    (height_m, climb_m_s): (f32, f32),
    lean: (f64, f64),
) -> Bench {
    let mut bench = armed();
    bench.limits_of_legs();
    bench.run(10.0);
    bench.phase = phase;
    bench.abort_effect = effect;
    bench.state_in_space([12.0, -9.0, height_m + 6.0], [-1.5, 2.0, climb_m_s], lean);
    bench.run(0.3);
    bench.state_in_space([11.6, -8.4, height_m], [-1.5, 2.0, climb_m_s], lean);
    bench.actuated_fins();
    bench
}

#[test]
fn regress_safe() {
    let mut bench = Bench::new(settings(false, true));
    bench.phase = TdPhase::TD_PHASE_SAFE;
    bench.abort_effect = TdAbortEffect::TD_ABORT_EFFECT_NONE;
    bench.checks_failed = 0b1100;
    bench.run(1.0);
    snapshot("safe", &bench);
}

#[test]
fn regress_armed() {
    snapshot("armed", &armed());
}

#[test]
fn regress_boost() {
    let effect = TdAbortEffect::TD_ABORT_EFFECT_CHUTE_AT_APOGEE;
    snapshot("boost", &in_phase(TdPhase::TD_PHASE_BOOST, effect, (80.0, 62.0), (60.0, 3.0)));
}

#[test]
fn regress_coast() {
    let effect = TdAbortEffect::TD_ABORT_EFFECT_CHUTE_AT_APOGEE;
    let bench = in_phase(TdPhase::TD_PHASE_COAST, effect, (240.0, 31.0), (60.0, 4.0));
    assert!(bench.screen(80, 24).contains(" next apogee in 3.2 s, then the fins open"));
    snapshot("coast", &bench);
}

#[test]
fn regress_deploy() {
    let effect = TdAbortEffect::TD_ABORT_EFFECT_CHUTE_NOW;
    snapshot("deploy", &in_phase(TdPhase::TD_PHASE_DEPLOY, effect, (299.0, -2.0), (60.0, 5.0)));
}

#[test]
fn regress_land_armed() {
    let effect = TdAbortEffect::TD_ABORT_EFFECT_BURN;
    let mut bench = in_phase(TdPhase::TD_PHASE_LAND_ARMED, effect, (90.0, -38.0), (200.0, 6.0));
    bench.descent_with(90.0, -38.0, TdChute::TD_CHUTE_STOWED);
    let screen = bench.screen(80, 24);
    assert!(screen.contains(" next IGNITION in 0.8 s at 58 m, motor armed"), "{screen}");
    assert!(bench.screen(20, 5).contains(" next IGNITION in 0."), "{}", bench.screen(20, 5));
    snapshot("land_armed", &bench);
}

#[test]
fn regress_ignition() {
    let effect = TdAbortEffect::TD_ABORT_EFFECT_LAND_HERE;
    let mut bench = in_phase(TdPhase::TD_PHASE_IGNITION, effect, (57.0, -38.5), (200.0, 6.0));
    bench.countdown_ms = -150;
    bench.run(0.1);
    snapshot("ignition", &bench);
}

#[test]
fn regress_safed() {
    let mut bench = burning_in_space();
    bench.phase = TdPhase::TD_PHASE_TOUCHDOWN;
    bench.contact([6.2, 1.553, -0.17, 0.04, 0.02], true, TdLimit::empty());
    bench.run(1.0);
    bench.phase = TdPhase::TD_PHASE_SAFED;
    bench.abort_effect = TdAbortEffect::TD_ABORT_EFFECT_NONE;
    bench.armed = false;
    bench.run(1.0);
    snapshot("safed", &bench);
}

/// An abort in the descent: the parachute is fired, then carries.
#[test]
fn regress_chute() {
    let effect = TdAbortEffect::TD_ABORT_EFFECT_NONE;
    let mut bench = in_phase(TdPhase::TD_PHASE_CHUTE, effect, (150.0, -30.0), (200.0, 12.0));
    bench.interlocks |= TdInterlock::TD_INTERLOCK_ABORT_LATCHED | TdInterlock::TD_INTERLOCK_MOTOR_INHIBITED;
    bench.approach_wait_s = u16::MAX;
    bench.descent_with(150.0, -30.0, TdChute::TD_CHUTE_FIRED);
    bench.run(0.1);
    assert!(bench.screen(80, 24).contains(" next chute opens: fired, still falling fast"));
    bench.state_in_space([9.0, -2.0, 122.0], [1.5, 2.0, -6.1], (200.0, 3.0));
    bench.descent_with(122.0, -6.1, TdChute::TD_CHUTE_OPEN);
    bench.run(0.1);
    snapshot("chute", &bench);
}

/// The vehicle checks for arming on the pad only: in flight the pad's screen claims nothing.
#[test]
fn in_flight_no_arming_check_is_shown_as_passed() {
    let mut bench = powered();
    bench.key(Key::Char('1'));
    let screen = bench.screen(80, 24);
    assert!(screen.contains("off the pad nothing is checked for arming"), "{screen}");
    assert!(!screen.contains(" GO ") && screen.contains("[ ] every check passes"), "{screen}");
}

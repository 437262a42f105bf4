//! A vehicle that flies in three dimensions, not only in the plane of north and up.

use ground::model::dead_reckoning::{Basis, predict_position};
use ground::model::quantity::Quantity;
use protocol::dialect::{TdAbortEffect, TdChute, TdLanding, TdLimit, TdPhase};
use protocol::motion::Degrees;

use crate::rig::Rig;
use crate::screens::{armed, descending, powered, snapshot};

/// One verdict, with a word and a limit for each value.
#[test]
fn regress_landed_on_the_legs() {
    let mut rig = burning_in_space();
    rig.phase = TdPhase::TD_PHASE_TOUCHDOWN;
    rig.abort_effect = TdAbortEffect::TD_ABORT_EFFECT_NONE;
    rig.contact(
        [6.2, 0.026, -0.52, 0.04, 0.07],
        TdLanding::all() - TdLanding::TD_LANDING_TABLE_2,
        TdLimit::empty(),
    );
    rig.run(0.5);
    snapshot("landed_on_the_legs", &rig);
}

/// A vehicle that moves and leans towards the east, which the plane of north and up does not show;
/// and the gimbal's yaw counts as much as its pitch.
#[test]
fn motion_and_lean_towards_the_east_count_in_every_value() {
    let mut rig = powered();
    rig.state_in_space([0.0, 30.0, 40.0], [0.0, 4.0, -3.0], (90.0, 20.0));
    rig.gimbal([(-100, -80), (420, 390)]);
    rig.run(0.1);
    for (name, expected) in [
        ("horizontal speed", 4.0),
        ("distance", 30.0),
        // 4 m/s sin 20 deg - 3 m/s cos 20 deg, and the rest of 5 m/s across the axis.
        ("axial speed", -1.451),
        ("lateral speed", 4.785),
        ("tilt", 20.0),
        // The nose turns by 0.02 and 0.03 rad/s.
        ("turn rate", 2.066),
    ] {
        let found =
            Quantity::named(name).and_then(|quantity| quantity.read(&rig.model, rig.now)).expect(name);
        assert!((found.value - expected).abs() < 0.001, "{name}: {found:?}");
    }
    let yaw =
        Quantity::named("gimbal yaw").and_then(|yaw| yaw.read(&rig.model, rig.now)).expect("gimbal yaw");
    assert!((yaw.value - 3.9).abs() < 0.005, "{yaw:?}");
}

/// Pad and vehicle are on the map at every bearing, and so is the fence with its radius.
#[test]
fn pad_and_vehicle_are_on_the_map_at_every_bearing() {
    let mut rig = descending();
    rig.limits();
    for bearing_deg in (0..360).step_by(15) {
        let (east, north) = libm::sincos(f64::from(bearing_deg).to_radians());
        let (north, east) = ((-40.0 * north) as f32, (-40.0 * east) as f32);
        rig.state_in_space([north, east, 120.0], [0.0, 0.0, -21.5], (0.0, 3.0));
        for (columns, rows, points) in [(80, 24, 3), (140, 45, 4), (200, 60, 4)] {
            let screen = rig.screen(columns, rows);
            for mark in ["+", "pad", "fence 120 m"] {
                assert!(screen.contains(mark), "{mark} {bearing_deg} deg\n{screen}");
            }
            // One in the header, one on the height and one on the map; where it is wide, the begin
            // of the flight along its time.
            assert_eq!(screen.matches('●').count(), points, "{bearing_deg} deg\n{screen}");
        }
    }
}

/// On the pad the map shows where the crew stands, once both places are known: 0.001 degrees of
/// latitude are 111 m.
#[test]
fn the_map_of_the_pad_shows_the_crew() {
    let mut rig = crate::screens::on_the_pad();
    let pad = Degrees { latitude: 45.0, longitude: 10.0 };
    let here = Degrees { latitude: 45.001, ..pad };
    assert_eq!(rig.screen(140, 45).matches("crew").count(), 0);
    (rig.model.vehicle.pad, rig.model.settings.here) = (Some(pad), Some(here));
    assert_eq!(rig.screen(140, 45).matches("crew 111 m").count(), 1, "{}", rig.screen(140, 45));
}

/// A flight in space from 300 m to the landing burn.
fn burning_in_space() -> Rig {
    let mut rig = armed();
    rig.limits();
    let mut fall = |phase, heights: std::ops::Range<u16>, lean: (f64, f64)| {
        rig.phase = phase;
        rig.run(0.2);
        for step in heights.rev() {
            let height = f32::from(step) * 4.0;
            rig.state_in_space([height * 0.3, -height * 0.2, height], [-3.0, 2.0, -20.0], lean);
            rig.run(0.1);
        }
    };
    fall(TdPhase::TD_PHASE_AERO_DESCENT, 18..75, (120.0, 6.0));
    fall(TdPhase::TD_PHASE_IGNITION, 17..18, (120.0, 6.0));
    fall(TdPhase::TD_PHASE_POWERED, 7..17, (300.0, 28.0));
    rig.abort_effect = TdAbortEffect::TD_ABORT_EFFECT_LAND_IN_PLACE;
    rig.run(0.2);
    rig.state_in_space([8.0, -5.5, 27.5], [-3.0, 2.0, -13.0], (300.0, 28.0));
    rig.plan_along(&[(8.0, 27.0), (6.5, 20.0), (5.0, 14.0), (3.5, 8.5), (2.5, 4.0), (1.8, 1.5), (1.4, 0.0)]);
    rig.gimbal([(-310, -250), (420, 390)]);
    rig.actuated_fins();
    rig
}

/// With enough room the flight is shown from the east, with the plan, and from the south.
#[test]
fn regress_powered_in_space() {
    let rig = burning_in_space();
    snapshot("powered_in_space", &rig);
    insta::assert_snapshot!("powered_in_space_120x40", rig.screen(120, 40));
}

/// The link is lost in the descent, four seconds before the burn: the fall continues, then the burn
/// is expected.
#[test]
fn regress_link_lost_in_the_descent() {
    let mut rig = armed();
    rig.limits();
    rig.phase = TdPhase::TD_PHASE_AERO_DESCENT;
    rig.abort_effect = TdAbortEffect::TD_ABORT_EFFECT_CHUTE_NOW;
    rig.run(0.2);
    for tenth in 0..20_u8 {
        let fallen = 38.0 * 0.1 * f32::from(tenth);
        rig.state_in_space([30.0, 12.0, 282.0 - fallen], [-2.0, 1.0, -38.0], (200.0, 6.0));
        rig.run(0.1);
    }
    rig.descent_with(209.8, -38.0, TdChute::TD_CHUTE_STOWED);
    rig.speaks = false;
    rig.run(4.0);
    // 209.8 m less 4.1 s at 38 m/s, and the start of the burn at 58 m.
    let at = predict_position(&rig.model.vehicle, rig.now).unwrap();
    assert_eq!(((at.altitude_m * 10.0).round(), at.basis), (530.0, Basis::FallThenBurn));
    snapshot("link_lost_in_the_descent", &rig);
}

//! A vehicle that flies in space, where the plane of north and up does not show everything.

use ground::key::Key;
use protocol::dialect::{TdAbortEffect, TdChute, TdLimit, TdPhase};

use crate::bench::Bench;
use crate::screens::{armed, descending, powered, snapshot};

/// A vehicle that judges by its legs: Table 2 is computed here, said to be, and where the figures do not tell it says so.
#[test]
fn regress_landed_on_the_legs() {
    let mut bench = burning_in_space();
    bench.phase = TdPhase::TD_PHASE_TOUCHDOWN;
    bench.abort_effect = TdAbortEffect::TD_ABORT_EFFECT_NONE;
    bench.contact([6.2, 1.545, -0.52, 0.04, 0.07], true, TdLimit::empty());
    bench.run(0.5);
    let screen = bench.screen(80, 24);
    assert!(screen.contains(" LANDED by the legs, says the vehicle; by Table 2* not landed"), "{screen}");
    assert!(screen.contains("u       -0.520 m/s    ok ±1      NO ±0.4"), "{screen}");
    assert!(screen.contains("q        4.011 deg/s  ok ±30     ?  ±2"), "{screen}");
    snapshot("landed_on_the_legs", &bench);
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
                screen.lines().skip(5).take(9).map(|line| line.chars().skip(55).collect::<String>());
            let marks: usize = picture.map(|line| line.matches(['P', 'N']).count()).sum();
            assert_eq!(marks, 2, "{bearing_deg} deg\n{screen}");
        }
    }
}

/// A flight in space, at its burn: from 300 m down, and from ignition on.
pub(crate) fn burning_in_space() -> Bench {
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
    bench.abort_effect = TdAbortEffect::TD_ABORT_EFFECT_LAND_HERE;
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
    assert!(bench.screen(80, 24).contains("323 m up"), "{}", bench.screen(80, 24));
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

/// Where there is room it is seen from two sides: from the east with the plan, from the south what goes east.
#[test]
fn regress_powered_in_space() {
    let bench = burning_in_space();
    snapshot("powered_in_space", &bench);
    insta::assert_snapshot!("powered_in_space_120x40", bench.screen(120, 40));
}

/// The link is lost in the descent, four seconds before the burn: the fall goes on as it was, then the burn is expected.
#[test]
fn regress_link_lost_in_the_descent() {
    let mut bench = armed();
    bench.limits_of_legs();
    bench.phase = TdPhase::TD_PHASE_AERO_DESCENT;
    bench.abort_effect = TdAbortEffect::TD_ABORT_EFFECT_CHUTE_NOW;
    bench.run(0.2);
    for tenth in 0..20_u8 {
        let fallen = 38.0 * 0.1 * f32::from(tenth);
        bench.state_in_space([30.0, 12.0, 282.0 - fallen], [-2.0, 1.0, -38.0], (200.0, 6.0));
        bench.run(0.1);
    }
    bench.descent_with(209.8, -38.0, TdChute::TD_CHUTE_STOWED);
    bench.speaks = false;
    bench.run(4.0);
    let screen = bench.screen(80, 24);
    assert!(screen.contains("PREDICTED, not heard") && screen.contains("fall, then the burn"), "{screen}");
    // 209.8 m less 4.1 s at 38 m/s, and a little of the burn: 58 m of it were left.
    assert!(screen.contains("alt   pred   53.0 ±20.5 m"), "{screen}");
    snapshot("link_lost_in_the_descent", &bench);
}

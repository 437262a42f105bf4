use proptest::prelude::*;

use super::*;
use crate::vehicles::thrust_curve::from_rasp;

/// A trapezium of 120 N s: 1 s up to 40 N, 2 s level, 1 s down.
const TRAPEZIUM: &str = "; a comment\r\nT40 38 200 6-10 0.12 0.3 Some Maker\n1 40 ; inline\n3 40\n4 0\n;\n";

fn trapezium() -> ThrustCurve {
    from_rasp(TRAPEZIUM).unwrap()
}

#[test]
fn thrust_impulse_and_mass_of_a_trapezium() {
    let motor = trapezium();
    for (time_s, thrust_n, impulse_n_s) in [
        (-1.0, 0.0, 0.0),
        (0.0, 0.0, 0.0),
        (0.5, 20.0, 5.0),
        (1.0, 40.0, 20.0),
        (2.0, 40.0, 60.0),
        (3.5, 20.0, 115.0),
        (4.0, 0.0, 120.0),
        (9.0, 0.0, 120.0),
    ] {
        assert!((motor.thrust_at_n(time_s) - thrust_n).abs() < 1e-12, "{time_s}");
        assert!((motor.impulse_to_n_s(time_s) - impulse_n_s).abs() < 1e-12, "{time_s}");
        assert!((motor.propellant_left_kg(time_s) - 0.12 * (1.0 - impulse_n_s / 120.0)).abs() < 1e-12);
    }
    assert!((motor.mean_thrust_n(0.5, 3.0) - 110.0 / 3.0).abs() < 1e-12);
    assert!((motor.mean_thrust_n(2.0, 0.0) - 40.0).abs() < 1e-12);
    assert!((motor.burn_time_s() - 4.0).abs() < 1e-15);
    assert!((motor.peak_thrust_n() - 40.0).abs() < 1e-15);
}

#[test]
fn the_last_fall_of_the_thrust_through_a_value_is_found() {
    let motor = trapezium();
    assert!((motor.falls_through_s(10.0).unwrap() - 3.75).abs() < 1e-12);
    assert!((motor.falls_through_s(0.0).unwrap() - 4.0).abs() < 1e-12);
    assert_eq!(motor.falls_through_s(40.0), None);
    let two_humps = from_rasp("T 38 200 0 0.1 0.2 M\n1 30\n2 10\n3 30\n4 0").unwrap();
    assert!((two_humps.falls_through_s(20.0).unwrap() - 10.0 / 3.0).abs() < 1e-12);
}

proptest! {
    #[test]
    fn a_curve_that_parses_has_sound_numbers(
        rows in proptest::collection::vec((-1.0..9.0_f64, -1.0..99.0_f64), 0..8),
        times in proptest::collection::vec(proptest::num::f64::ANY, 4),
    ) {
        let rows = rows.iter().map(|(time_s, thrust_n)| format!("{time_s} {thrust_n}\n"));
        let text: String = core::iter::once("T 38 100 0 0.1 0.2 M\n".to_owned()).chain(rows).collect();
        if let Ok(motor) = from_rasp(&text) {
            for time_s in times {
                let thrust_n = motor.thrust_at_n(time_s);
                prop_assert!((0.0..=motor.peak_thrust_n() * (1.0 + 1e-12)).contains(&thrust_n));
                let impulse_n_s = motor.impulse_to_n_s(time_s);
                prop_assert!((0.0..=motor.total_impulse_n_s() * (1.0 + 1e-12)).contains(&impulse_n_s));
            }
        }
    }
}

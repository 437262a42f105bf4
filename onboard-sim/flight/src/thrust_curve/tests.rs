use proptest::prelude::*;

use super::*;

/// A trapezium: 1 s up to 40 N, 2 s level, 1 s down. 120 N s.
const TRAPEZIUM: &str = "; a comment\r\nT40 38 200 6-10 0.12 0.3 Some Maker\n1 40 ; inline\n3 40\n4 0\n;\n";

fn trapezium() -> ThrustCurve {
    ThrustCurve::from_rasp(TRAPEZIUM).unwrap()
}

#[test]
fn a_rasp_header_is_read_in_si() {
    let motor = trapezium();
    assert_eq!((motor.name(), motor.manufacturer()), ("T40", "Some Maker"));
    let found = [motor.diameter_m(), motor.length_m(), motor.propellant_mass_kg(), motor.total_mass_kg()];
    for (found, expected) in found.into_iter().zip([0.038, 0.2, 0.12, 0.3]) {
        assert!((found - expected).abs() < 1e-15, "{found} {expected}");
    }
    assert_eq!(motor.points().len(), 4, "(0, 0) is understood");
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
fn thrust_falls_through_a_value_once_and_for_the_last_time() {
    let motor = trapezium();
    assert!((motor.falls_through_s(10.0).unwrap() - 3.75).abs() < 1e-12);
    assert!((motor.falls_through_s(0.0).unwrap() - 4.0).abs() < 1e-12);
    assert_eq!(motor.falls_through_s(40.0), None);
    let two_humps = ThrustCurve::from_rasp("T 1 1 0 1 2 M\n1 30\n2 10\n3 30\n4 0").unwrap();
    assert!((two_humps.falls_through_s(20.0).unwrap() - 10.0 / 3.0).abs() < 1e-12);
}

#[test]
fn a_rocksim_file_is_the_same_motor() {
    let text = r#"<?xml version="1.0"?>
<engine-database><engine-list>
<engine code="T40" mfg="Some Maker" dia="38." len="200." propWt="120." initWt="300." Type="single-use">
<data><eng-data t="0." f="0." m="120."/><eng-data t="1." f="40." m="100."/>
<eng-data t="3." f="40." m="20."/><eng-data t="4." f="0." m="0."/></data>
</engine></engine-list></engine-database>"#;
    assert_eq!(ThrustCurve::from_rocksim(text).unwrap(), trapezium());
    assert_eq!(ThrustCurve::from_file_text("motors/T40.RSE", text).unwrap(), trapezium());
    assert_eq!(ThrustCurve::from_file_text("T40.eng", TRAPEZIUM).unwrap(), trapezium());
    let error = ThrustCurve::from_file_text("T40.csv", TRAPEZIUM).unwrap_err().to_string();
    assert_eq!(error, "motor file 'T40.csv': names that end in .eng (RASP) and .rse (RockSim) are accepted");
}

#[test]
fn a_bad_file_is_named_by_line_and_field() {
    let rasp = |text| ThrustCurve::from_rasp(text).unwrap_err().to_string();
    let rocksim = |text| ThrustCurve::from_rocksim(text).unwrap_err().to_string();
    for (found, expected) in [
        (rasp("; nothing"), "the motor's header is missing; a header is: name, diameter in mm"),
        (rasp("T 38 x 0 0.1 0.2 M"), "line 1: length is 'x'; a number, 0 or more, is accepted"),
        (rasp("T 38 1"), "line 1: the header is 'T 38 1'; a header is: name"),
        (rasp("T 38 1 0 0.2 0.1 M"), "line 1: propellant mass is '0.2 kg of 0.1 kg'; above 0 and below"),
        (rasp("T 1 1 0 1 2 M\n1 5\n1 4"), "line 3: time is '1'; times must increase"),
        (rasp("T 1 1 0 1 2 M\n1 -5"), "line 2: thrust is '-5'; a number, 0 or more"),
        (rasp("T 1 1 0 1 2 M\n1 nan"), "line 2: thrust is 'nan'; a number, 0 or more"),
        (rasp("T 1 1 0 1 2 M\n1 5\n2 0\nU 1 1 0 1 2 M"), "line 4: a point is 'U 1 1 0 1 2 M'; a time in s"),
        (rasp("T 1 1 0 1 2 M\n1 0"), "thrust is missing; a motor has at least one point with thrust"),
        (rasp("T 1 1 0 1 2 M"), "thrust is missing"),
        (rocksim("<engine"), "not XML: "),
        (rocksim("<a/>"), "the engine element is missing; a RockSim file holds one"),
        (rocksim("<engine code='T' initWt='2'/>"), "line 1: propWt is ''; the attribute must be there"),
        (rocksim("<a><engine/>\n<engine/></a>"), "line 2: engine is 'a second engine'; one motor a file"),
    ] {
        assert!(found.starts_with(expected), "{found}\nshould begin with\n{expected}");
    }
}

proptest! {
    #[test]
    fn any_text_is_answered(text in "\\PC*") {
        let _ = ThrustCurve::from_rasp(&text).is_ok();
        let _ = ThrustCurve::from_rocksim(&text).is_ok();
    }

    #[test]
    fn a_curve_that_parses_has_sound_numbers(
        rows in proptest::collection::vec((-1.0..9.0_f64, -1.0..99.0_f64), 0..8),
        times in proptest::collection::vec(proptest::num::f64::ANY, 4),
    ) {
        let rows = rows.iter().map(|(time_s, thrust_n)| format!("{time_s} {thrust_n}\n"));
        let text: String = core::iter::once("T 38 100 0 0.1 0.2 M\n".to_owned()).chain(rows).collect();
        if let Ok(motor) = ThrustCurve::from_rasp(&text) {
            for time_s in times {
                let thrust_n = motor.thrust_at_n(time_s);
                prop_assert!((0.0..=motor.peak_thrust_n() * (1.0 + 1e-12)).contains(&thrust_n));
                let impulse_n_s = motor.impulse_to_n_s(time_s);
                prop_assert!((0.0..=motor.total_impulse_n_s() * (1.0 + 1e-12)).contains(&impulse_n_s));
            }
        }
    }
}

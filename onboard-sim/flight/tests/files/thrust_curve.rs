use proptest::prelude::*;

use flight::vehicle::thrust_curve::ThrustCurve;
use flight::vehicles::openrocket;
use flight::vehicles::thrust_curve::{from_file_text, from_rasp, from_rocksim, from_stand};

/// A trapezium of 120 N s: 1 s up to 40 N, 2 s level, 1 s down.
const TRAPEZIUM: &str = "; a comment\r\nT40 38 200 6-10 0.12 0.3 Some Maker\n1 40 ; inline\n3 40\n4 0\n;\n";

fn trapezium() -> ThrustCurve {
    from_rasp(TRAPEZIUM).unwrap()
}

#[test]
fn a_rasp_header_is_converted_to_si_units() {
    let motor = trapezium();
    assert_eq!((motor.name(), motor.manufacturer()), ("T40", "Some Maker"));
    let found = [motor.diameter_m(), motor.length_m(), motor.propellant_mass_kg(), motor.total_mass_kg()];
    for (found, expected) in found.into_iter().zip([0.038, 0.2, 0.12, 0.3]) {
        assert!((found - expected).abs() < 1e-15, "{found} {expected}");
    }
    assert_eq!(motor.points().len(), 4, "(0, 0) is understood");
}

#[test]
fn a_rocksim_file_gives_the_same_motor_as_a_rasp_file() {
    let text = r#"<?xml version="1.0"?>
<engine-database><engine-list>
<engine code="T40" mfg="Some Maker" dia="38." len="200." propWt="120." initWt="300." Type="single-use">
<data><eng-data t="0." f="0." m="120."/><eng-data t="1." f="40." m="100."/>
<eng-data t="3." f="40." m="20."/><eng-data t="4." f="0." m="0."/></data>
</engine></engine-list></engine-database>"#;
    assert_eq!(from_rocksim(text).unwrap(), trapezium());
    assert_eq!(from_file_text("motors/T40.RSE", text).unwrap(), trapezium());
    assert_eq!(from_file_text("T40.eng", TRAPEZIUM).unwrap(), trapezium());
    let error = from_file_text("T40.csv", TRAPEZIUM).unwrap_err().to_string();
    assert_eq!(error, "motor file 'T40.csv': names that end in .eng (RASP) and .rse (RockSim) are accepted");
}

#[test]
fn the_error_for_a_bad_file_names_line_and_field() {
    let rasp = |text| from_rasp(text).unwrap_err().to_string();
    let rocksim = |text| from_rocksim(text).unwrap_err().to_string();
    for (found, expected) in [
        (rasp("; nothing"), "the motor's header is missing; a header is: name, diameter in mm"),
        (rasp("T 38 x 0 0.1 0.2 M"), "line 1: length is 'x'; a number, 0 or more, is accepted"),
        (rasp("T 38 200 0.1 0.3 M"), "line 1: delays is '0.1'; whole seconds as in 6-10-14, P or 0"),
        (rasp("T 3.8 20 0 0.1 0.3 M\n1 50\n3 0"), "line 1: diameter is '3.8 mm'; 5 to 500 mm"),
        (rasp("T 1.5 8 0 0.1 0.3 M\n1 50\n3 0"), "line 1: diameter is '1.5 mm'; 5 to 500 mm"),
        (rasp("T 38 7.9 0 0.1 0.3 M\n1 50\n3 0"), "line 1: total mass is '0.3 kg in 38 x 8 mm'"),
        (rasp("T 38 20.0 0 0.1 0.3 M\n1 50\n3 0"), "line 1: total mass is '0.3 kg in 38 x 20 mm'"),
        (
            rasp("T 38 200 0 0.1 0.3 M\n2 0\n3.5 50\n5 0"),
            "line 1: the first thrust is 'at 3.5 s'; a curve begins",
        ),
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
        let _ = from_rasp(&text).is_ok();
        let _ = from_rocksim(&text).is_ok();
        let _ = openrocket::read(&text).is_ok() || openrocket::read(&format!("time_s,mass_g\n{text}")).is_ok();
    }

    #[test]
    fn any_table_of_a_stand_is_answered(rows in prop::collection::vec((-1e3..1e3_f64, -1e6..1e6_f64), 0..60)) {
        let lines: Vec<String> = rows.into_iter().map(|(time, thrust)| format!("{time}\t{thrust}")).collect();
        let _ = from_stand("T 38 200 P 0.1 0.3", &format!("time_s\tthrust_n\n{}", lines.join("\n"))).is_ok();
    }
}

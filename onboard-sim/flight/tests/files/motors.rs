use flight::vehicles::motors::{BUILTIN, builtin, named, names, status};

/// Impulse (N s) of each motor as its maker or certifier states it, and the accepted relative error
/// of the file's curve.
#[test]
fn val_catalogue_impulse_of_the_builtin_motors() {
    for (name, impulse_n_s, share) in [
        ("F10", 76.3, 0.03),
        ("F30", 73.1, 0.01),
        ("G12", 144.0, 0.02),
        ("G33", 143.1, 0.005),
        ("H42", 186.0, 0.005),
        ("H45W", 289.0, 0.01),
        ("H53", 234.2, 0.005),
        ("HP-H45W", 320.0, 0.01),
    ] {
        let motor = builtin(name).unwrap();
        let found = motor.total_impulse_n_s();
        assert!((found / impulse_n_s - 1.0).abs() < share, "{name}: {found} N s, stated {impulse_n_s}");
    }
}

#[test]
fn every_builtin_motor_parses_and_states_its_origin() {
    for (name, text) in BUILTIN {
        let motor = builtin(name).unwrap();
        assert!(name.starts_with(motor.name().trim_end_matches('W')), "{name}: {}", motor.name());
        assert!(text.starts_with("; origin:") || text.starts_with("; DERIVED"), "{name}");
        // thrustcurve.org, as the npm package thrustcurve-db 3.0.4 has it.
        let (in_production, dated) = status(name).expect("a file says whether its motor is produced");
        assert!(in_production == (*name != "H45W") && dated.starts_with("20"), "{name}");
    }
    assert!(names().is_sorted());
}

#[test]
fn the_error_for_an_unknown_name_lists_the_available_names() {
    let error = builtin("Z99").unwrap_err().to_string();
    assert_eq!(
        error,
        "no motor is named 'Z99'; these are built in: F10, F13-RCT, F15, F16-RCJ, F30, G12, G33, H42, H45W, H53, HP-H45W, I243"
    );
}

#[test]
fn an_airframe_may_contain_the_text_of_its_motor_file() {
    let (_, rasp) = BUILTIN.iter().find(|(name, _)| *name == "H45W").expect("a built-in motor");
    assert_eq!(named(rasp), builtin("H45W"));
    let rocksim = r#"<engine-database><engine-list><engine mfg="M" code="X10" dia="24" len="70" initWt="50"
        propWt="20"><data><eng-data t="0" f="0"/><eng-data t="0.1" f="10"/><eng-data t="2" f="10"/>
        <eng-data t="2.1" f="0"/></data></engine></engine-list></engine-database>"#;
    let curve = named(rocksim).expect("a valid motor");
    assert!((curve.total_impulse_n_s() - 20.0).abs() < 1e-9, "{}", curve.total_impulse_n_s());
    assert_eq!(named(&rocksim.replace("dia=", "Itot=\"19\" dia=")), named(rocksim));
    let refused = named(&rocksim.replace("dia=", "Itot=\"200\" dia=")).expect_err("ten times the points");
    let source = std::error::Error::source(&refused).expect("the field").to_string();
    assert!(source.contains("Itot is '200'; half to twice the impulse"), "{source}");
    let refused = named("<engine-database>\n</engine-database>").expect_err("no motor in it");
    assert!(refused.to_string().contains("of the airframe"), "{refused}");
    assert!(named("H4").expect_err("no such motor").to_string().contains("H45W"));
}

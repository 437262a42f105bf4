use flight::estimation::estimator::EstimatorConfig;
use flight::guidance::powered::PoweredSettings;
use flight::vehicle::mission::Mission;
use flight::vehicle::site::Site;
use flight::vehicle::thrust_curve::ThrustCurve;
use flight::vehicles::mission::{BUILTIN, from_toml, is_meant};

#[test]
fn every_builtin_mission_is_sound() {
    for (name, text) in BUILTIN {
        let mission = from_toml(text, name).expect("a valid mission");
        assert_eq!(mission.name, *name);
    }
}

#[test]
fn the_countdown_is_range_checked_ten_seconds_and_five_in_a_text_that_does_not_say() {
    for (name, text) in BUILTIN {
        let mission = from_toml(text, name).expect("a valid mission");
        assert!((mission.start.countdown_s - 10.0).abs() < 1e-12, "{name}");
    }
    let (name, text) = BUILTIN[0];
    let text = &text.replace("countdown_s = 10.0\n", "");
    let of = |countdown: &str| from_toml(&text.replace("[start]", countdown), name);
    assert!((of("[start]").expect("a valid mission").start.countdown_s - 5.0).abs() < 1e-12);
    assert!((of("[start]\ncountdown_s = 0").expect("a valid mission").start.countdown_s).abs() < 1e-12);
    for wrong in ["-1.0", "nan", "601.0"] {
        let message = of(&format!("[start]\ncountdown_s = {wrong}")).expect_err("wrong").to_string();
        assert!(message.contains("start.countdown_s") && message.contains("must be 0 to 600"), "{message}");
    }
    assert!(is_meant(text) && !is_meant("name = \"x\"") && !is_meant("="));
}

#[test]
fn the_site_is_range_checked_and_a_known_field_by_default() {
    let (name, text) = BUILTIN[0];
    let of = |site: &str| from_toml(&text.replace("[start]", &format!("{site}\n[start]")), name);
    assert_eq!(of("").expect("a valid mission").site, Site::default());
    let given = of("[site]\nlatitude_deg = 48.1\nlongitude_deg = 11.6").expect("a valid mission").site;
    assert_eq!(given, Site { latitude_deg: 48.1, longitude_deg: 11.6 });
    let message = of("[site]\nlatitude_deg = 89.0\nlongitude_deg = 11.6").expect_err("wrong").to_string();
    assert!(message.contains("site.latitude_deg = 89") && message.contains("-85 to 85"), "{message}");
    assert!(of("[site]\nlatitude_deg = 48.1").is_err(), "a latitude without a longitude is an error");
    let sunken = text.replace("pad_altitude_m = 0.0", "pad_altitude_m = -500.0");
    let message = from_toml(&sunken, name).expect_err("wrong").to_string();
    assert!(message.contains("pad_altitude_m = -500"), "{message}");
}

#[test]
fn an_unknown_airframe_or_key_is_named_in_the_error() {
    let (name, text) = BUILTIN[0];
    let message = from_toml(&text.replace("airframe = \"mk2\"", "airframe = \"mk9\""), name)
        .expect_err("unknown")
        .to_string();
    assert!(message.contains("no airframe is named 'mk9'"), "{message}");
    let message = from_toml(&format!("colour = 1\n{text}"), name).expect_err("unknown").to_string();
    assert!(message.contains("colour"), "{message}");
}

#[test]
fn a_named_airframe_keeps_the_line_numbers_in_errors() {
    let (name, text) = BUILTIN[0];
    let wrong = text.replace("airframe = \"mk2\"", "airframe = 1");
    let line = 1 + text.lines().position(|line| line == "airframe = \"mk2\"").unwrap();
    let message = from_toml(&wrong, name).unwrap_err().to_string();
    assert!(message.contains(&format!("at line {line},")), "{message}");
}

/// mk3's text with this section `[lot]`.
fn mk3_with(lot: &str) -> Mission {
    let (_, text) = BUILTIN.iter().find(|(name, _)| *name == "mk3").unwrap();
    from_toml(&format!("{text}\n[lot]\n{lot}"), "mk3").unwrap()
}

/// Four burns 2 % above the certified impulse, with the prior's one: 1.016.
#[test]
fn val_hand_a_lot_moves_the_curve_and_narrows_what_is_expected() {
    let mk3 = flight::vehicles::mission::builtin("mk3").unwrap().unwrap();
    assert!(mk3.motor_burns() == 0 && mk3.expected.is_none());
    let known = mk3_with(
        "name = \"2609\"\nburns = 4\nimpulse = { mean = 1.02, scatter = 0.005 }\nburn_time = { mean = 1.0, scatter = 0.01 }",
    );
    assert_eq!(known.motor_burns(), 4);
    let impulse = |mission: &Mission| mission.motor_curve.total_impulse_n_s();
    assert!((impulse(&known) / impulse(&mk3) - 1.016).abs() < 1e-12);
    assert!((known.motor_curve.burn_time_s() / mk3.motor_curve.burn_time_s() - 1.0).abs() < 1e-12);
    let (before, now) = (mk3.motor, known.motor);
    assert!(now.impulse_sigma < before.impulse_sigma && now.burn_time_sigma < before.burn_time_sigma);
    let width = |[least, most]: [f64; 2]| most - least;
    let narrowed = width(known.ignition.impulse_scales) / width(mk3.ignition.impulse_scales);
    assert!((narrowed - now.impulse_sigma / before.impulse_sigma).abs() < 1e-12);
    assert_eq!(known.airframe.mass, mk3.airframe.mass);
}

#[test]
fn other_motors_and_the_curves_half_way_to_them_are_looked_up() {
    let mk3 = flight::vehicles::mission::builtin("mk3").unwrap().unwrap();
    let names: Vec<&str> = mk3.other_curves.iter().map(ThrustCurve::name).collect();
    assert_eq!(names, ["HP-H45W towards H45W", "H45W"]);
    let (_, text) = BUILTIN.iter().find(|(name, _)| *name == "mk3").unwrap();
    let wrong = from_toml(&text.replace("[\"H45W\"]", "[\"HP-H46W\"]"), "mk3").unwrap_err().to_string();
    assert!(wrong.starts_with("no motor is named 'HP-H46W'; these are built in: F10"), "{wrong}");
}

#[test]
fn the_lot_on_the_engineers_page_is_one() {
    let page = include_str!("../../../../ENGINEER.md");
    let (_, lot) = page.split_once("```toml\n[lot]\n").unwrap();
    assert_eq!(mk3_with(lot.split_once("```").unwrap().0).motor_burns(), 4);
}

#[test]
fn a_lot_without_burns_confirms_nothing_and_flies_the_certified_curve() {
    let mk3 = flight::vehicles::mission::builtin("mk3").unwrap().unwrap();
    let bought = mk3_with("name = \"2609\"\nburns = 0");
    assert_eq!(bought.motor_burns(), 0);
    assert_eq!(bought.motor_curve, mk3.motor_curve);
    assert!((bought.motor.impulse_sigma - mk3.motor.impulse_sigma).abs() < 1e-12);
}

#[test]
fn a_measured_curve_and_the_weights_of_the_day_are_flown() {
    let measured = mk3_with(
        "name = \"2609\"\nburns = 1\nweighed = { motor_kg = 0.370, vehicle_kg = 3.72 }\ncurve = \"\"\"\nHP-H45W 38 203 P 0.180 0.365 AT\n1 50\n5 40\n7 0\n\"\"\"",
    );
    assert!((measured.motor_curve.total_impulse_n_s() - 245.0).abs() < 1e-9);
    assert_eq!((measured.motor_curve.total_mass_kg(), measured.airframe.mass.loaded_kg), (0.37, 3.72));
    assert_eq!(measured.airframe.motor, "HP-H45W", "what is certified stays");
}

#[test]
fn a_lot_of_another_vehicle_or_with_a_slip_is_refused_by_its_key() {
    let (_, text) = BUILTIN.iter().find(|(name, _)| *name == "mk3").unwrap();
    for (lot, words) in [
        ("burns = 4", "missing field `name`"),
        ("name = \"a\"\nburns = 4\nimpulse = { mean = 102.0 }", "lot.impulse.mean = 102: must be 0.7 to 1.3"),
        ("name = \"a\"\nburns = 4\nburn_time = { mean = 1.0, scatter = 1.5 }", "lot.burn_time.scatter = 1.5"),
        (
            "name = \"a\"\nburns = 4\ntemperature = { burns_c = 293.0, pad_c = 5.0 }",
            "lot.temperature.burns_c",
        ),
        ("name = \"a\"\nburns = 4\nweighed = { vehicle_kg = 3320.0 }", "lot.weighed.vehicle_kg = 3320"),
        ("name = \"a\"\nburns = 4\nweighed = { motor_kg = 0.2 }", "lot.weighed.motor_kg = 0.2"),
        ("name = \"a\"\nburns = 4\ncurve = \"H45X\"", "no motor is named 'H45X'"),
    ] {
        let error = from_toml(&format!("{text}\n[lot]\n{lot}"), "mk3").unwrap_err();
        assert!(full(&error).contains(words), "{}", full(&error));
    }
}

/// The two files repeat each other, so that each can be read and changed alone. A number that changes in one of them has to
/// change in the other, except what this test names.
#[test]
fn mk3_flies_with_the_numbers_of_mk2() {
    let read = |name: &str| flight::vehicles::mission::builtin(name).expect("built in").expect("sound");
    let (mk2, mut mk3) = (read("mk2"), read("mk3"));
    // Only mk3's crew places its rail upwind.
    if let Some(launch) = &mut mk3.launch {
        assert!(launch.rail.upwind_s > 0.0);
        launch.rail.upwind_s = 0.0;
    }
    let (name, summary, airframe) = (mk2.name.clone(), mk2.summary.clone(), mk2.airframe.clone());
    assert!(mk3.estimator.gnss_age_jitter_s > 0.0);
    let estimator = EstimatorConfig { gnss_age_jitter_s: 0.0, ..mk3.estimator };
    // Only mk2 hangs below a drone, and mk3's legs bear more.
    let (drop, leg_limits) = (mk2.drop, mk2.leg_limits);
    // mk2's legs bear less: it keeps more in hand for a weak motor.
    let (caution_sigmas, ignition) = (mk2.caution_sigmas, mk2.ignition);
    // mk3's motor is one that is sold, from the height that its booster reaches, and may be an old one.
    let (motor_curve, start) = (mk2.motor_curve.clone(), mk2.start);
    let (other_motors, other_curves) = (mk2.other_motors.clone(), mk2.other_curves.clone());
    // It lands where it is nearest, sinks faster into it, and its gimbal has more room.
    let PoweredSettings { weights, homing, final_box, gimbal_deg, .. } = mk2.powered;
    let powered = PoweredSettings { weights, homing, final_box, gimbal_deg, ..mk3.powered };
    assert_eq!(
        Mission {
            name,
            summary,
            airframe,
            estimator,
            drop,
            start,
            motor_curve,
            other_motors,
            other_curves,
            leg_limits,
            caution_sigmas,
            ignition,
            powered,
            ..mk3
        },
        mk2
    );
}

#[test]
fn an_expectation_out_of_range_is_named_in_the_error() {
    let (name, text) = BUILTIN[0];
    for (key, wrong, said) in [
        ("shape_lasts_s", "0.0", "mk2: motor.shape_lasts_s = 0: must be a finite number above 0"),
        ("shape_sigma", "nan", "mk2: motor.shape_sigma = NaN: must be a finite number not below 0"),
        ("body_loss", "7.0", "mk2: exhaust.body_loss = 7: must be -1 to 1"),
        (
            "mounting_deg",
            "-2.0",
            "mk2: estimator: mounting_deg is -2, accepted is a finite number not below 0",
        ),
    ] {
        let line = text.lines().find(|line| line.starts_with(&format!("{key} ="))).unwrap();
        let error = from_toml(&text.replace(line, &format!("{key} = {wrong}")), name).unwrap_err();
        assert_eq!(full(&error), said);
    }
}

/// Every number of a mission, by its path, with another value in its place.
fn with_each_number(text: &str, value: f64, mut look: impl FnMut(&str, String)) {
    fn paths(table: &dyn toml_edit::TableLike, path: &[String], found: &mut Vec<Vec<String>>) {
        for (key, item) in table.iter() {
            let path = [path, &[key.to_owned()]].concat();
            match item {
                _ if item.is_float() => found.push(path),
                toml_edit::Item::Value(toml_edit::Value::Array(numbers)) => {
                    found.extend((0..numbers.len()).map(|at| [&path[..], &[at.to_string()]].concat()));
                }
                _ => {
                    if let Some(table) = item.as_table_like() {
                        paths(table, &path, found);
                    }
                }
            }
        }
    }
    let document: toml_edit::DocumentMut = text.parse().unwrap();
    let mut found = Vec::new();
    paths(document.as_table(), &[], &mut found);
    assert!(found.len() >= 70, "{}", found.len());
    for path in found {
        let mut changed = document.clone();
        let mut item = changed.as_item_mut();
        for key in &path {
            item = match key.parse::<usize>() {
                Ok(at) => &mut item[at],
                Err(_) => &mut item[key.as_str()],
            };
        }
        *item = toml_edit::value(value);
        look(&path.join("."), changed.to_string());
    }
}

#[test]
fn no_number_of_a_mission_may_be_nan_or_absurd() {
    for name in ["mk2", "vlr"] {
        let text = BUILTIN.iter().find(|(known, _)| *known == name).unwrap().1;
        for value in [f64::NAN, f64::INFINITY, -1e9] {
            with_each_number(text, value, |path, changed| {
                let told = from_toml(&changed, "changed").err().map(|error| full(&error));
                let key = path.split('.').rfind(|key| key.parse::<usize>().is_err()).unwrap();
                assert!(told.as_ref().is_some_and(|told| told.contains(key)), "{path} = {value}: {told:?}");
            });
        }
    }
}

/// An error with its causes.
fn full(error: &dyn core::error::Error) -> String {
    let causes = core::iter::successors(Some(error), |error| error.source());
    causes.map(ToString::to_string).collect::<Vec<_>>().join(": ")
}

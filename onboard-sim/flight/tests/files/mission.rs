use flight::vehicle::mission::Mission;
use flight::vehicle::site::Site;
use flight::vehicle::thrust_curve::ThrustCurve;
use flight::vehicles::mission::{BUILTIN, MissionError, from_toml};

use crate::missions::TEST_MISSIONS;

/// The built-in missions and those of the tests.
fn missions() -> impl Iterator<Item = &'static (&'static str, &'static str)> {
    BUILTIN.iter().chain(&TEST_MISSIONS)
}

fn text_of(name: &str) -> &'static str {
    missions().find(|(available, _)| *available == name).unwrap().1
}

fn read(name: &str) -> Mission {
    from_toml(text_of(name), name).unwrap()
}

/// The built-in mission with a value at a path, whether its file has the key or not.
fn with(name: &str, path: &str, value: impl Into<toml_edit::Value>) -> Result<Mission, MissionError> {
    let mut document: toml_edit::DocumentMut = text_of(name).parse().unwrap();
    let mut item = document.as_item_mut();
    for key in path.split('.') {
        item = &mut item[key];
    }
    *item = toml_edit::value(value);
    from_toml(&document.to_string(), name)
}

/// The error of a mission, with its causes.
fn message(mission: Result<Mission, MissionError>) -> String {
    full(&mission.unwrap_err())
}

#[test]
fn a_mission_states_at_most_fifty_values_and_none_of_the_controllers() {
    fn values(table: &toml::Table) -> usize {
        table.values().map(|value| value.as_table().map_or(1, values)).sum()
    }
    for (name, text) in missions() {
        let mission = read(name);
        assert_eq!(mission.name, *name);
        assert_eq!(mission.changed, [""; 0], "{name}");
        let stated = values(&text.parse().unwrap());
        assert!(stated <= 50, "{name}: {stated}");
    }
}

#[test]
fn a_stated_key_of_the_controller_is_flown_and_named_and_what_is_measured_is_not() {
    let mk3 = read("mk3");
    let constant = with("mk3", "powered.weights.theta", 150.0).unwrap();
    assert_eq!(constant.changed, ["powered.weights.theta"]);
    let mut expected = mk3.clone();
    expected.powered.weights.theta = 150.0;
    assert_eq!(Mission { changed: Vec::new(), ..constant }, expected);

    let formula = with("mk3", "powered.weights.x", 0.25).unwrap();
    assert_eq!(formula.changed, ["powered.weights.x"]);
    let mut expected = mk3.clone();
    expected.powered.weights.x = 0.25;
    assert_eq!(Mission { changed: Vec::new(), ..formula }, expected);

    // Not the controller's: a default, a formula of the airframe, and values that only this file
    // has.
    for (path, value) in [
        ("airframe.legs.damping_n_s_m", 30.0),
        ("airframe.gimbal.pivot_station_m", 0.1),
        ("airframe.mass.loaded_kg", 3.6),
    ] {
        assert_eq!(with("mk3", path, value).unwrap().changed, [""; 0], "{path}");
    }
}

/// Another program can be given all that is flown.
#[test]
fn an_effective_mission_read_again_is_the_same_and_states_all_of_the_controller() {
    for (name, _) in missions() {
        let mission = read(name);
        let mut again = from_toml(&effective(&mission), name).unwrap();
        assert!(again.changed.len() > 60, "{name}: {}", again.changed.len());
        again.changed.clear();
        assert_eq!(again, mission);
    }
}

fn effective(mission: &Mission) -> String {
    toml::to_string(&toml::Table::try_from(mission).unwrap()).unwrap()
}

#[test]
fn a_mission_without_a_launch_or_a_drop_gets_none() {
    let has = |name: &str| {
        let mission = read(name);
        (mission.launch.is_some(), mission.drop.is_some())
    };
    assert_eq!(has("mk3"), (true, true));
    assert_eq!(has("vlr"), (false, true));
    assert_eq!(has("mini-f10"), (false, false));
}

#[test]
fn the_countdown_is_range_checked_and_defaults_to_ten_seconds() {
    for (name, _) in missions() {
        assert!((read(name).start.countdown_s - 10.0).abs() < 1e-12, "{name}");
    }
    let of = |countdown_s: f64| with("mk2", "start.countdown_s", countdown_s);
    assert!(of(0.0).unwrap().start.countdown_s.abs() < 1e-12);
    for wrong in [-1.0, f64::NAN, 601.0] {
        let message = message(of(wrong));
        assert!(message.contains("start.countdown_s") && message.contains("must be 0 to 600"), "{message}");
    }
}

#[test]
fn the_site_is_required_and_range_checked() {
    for (name, _) in missions() {
        let Site { altitude_m, temperature_c, ground_slope_deg, .. } = read(name).site;
        assert_eq!((altitude_m, temperature_c, ground_slope_deg), (625.0, None, 0.5), "{name}: Mojave");
    }
    for (key, value, words) in [
        ("site.latitude_deg", 89.0, "site.latitude_deg = 89: must be -85 to 85"),
        ("site.latitude_deg", f64::NAN, "site.latitude_deg = NaN: must be -85 to 85"),
        ("site.longitude_deg", 181.0, "site.longitude_deg = 181: must be -180 to 180"),
        ("site.altitude_m", -500.0, "site.altitude_m = -500: must be -450 to 6000"),
        ("site.temperature_c", 95.0, "site.temperature_c = 95: must be degrees Celsius, -40 to 60"),
        ("site.ground_slope_deg", 20.0, "site.ground_slope_deg = 20: must be 0 to 15"),
        ("estimator.gravity_m_s2", 9.81, "estimator.gravity_m_s2 = 9.81: must be 9.80665"),
    ] {
        let refused = message(with("mk2", key, value));
        assert!(refused.contains(words), "{refused}");
    }
    for key in ["latitude_deg", "longitude_deg", "altitude_m"] {
        let without: String =
            text_of("mk2").split_inclusive('\n').filter(|line| !line.starts_with(key)).collect();
        let refused = message(from_toml(&without, "mk2"));
        assert!(refused.contains(&format!("missing field `{key}`")), "{refused}");
    }
    let allowed_deg = with("mk2", "site.ground_slope_deg", 2.0).unwrap().estimator.ground_slope_deg;
    assert!((allowed_deg - 2.0).abs() < 1e-12, "the estimator allows for the slope of the site");
}

/// Line and column, counted from 1, of where a text begins in another.
fn place(text: &str, part: &str) -> String {
    let before = text.split_once(part).unwrap().0;
    let column = 1 + before.chars().rev().take_while(|c| *c != '\n').count();
    format!("at line {}, column {column}\n", 1 + before.matches('\n').count())
}

#[test]
fn a_missing_key_an_unknown_key_and_a_wrong_type_are_reported_with_their_position() {
    let text = text_of("mk3");
    for (is, becomes, at, said) in [
        ("loaded_kg = 3.7\n", "", "[airframe.mass]", "missing field `loaded_kg`"),
        ("fence_radius_m = 120.0\n", "", "[gate]", "missing field `fence_radius_m`"),
        ("loaded_kg = 3.7\n", "loaded_kg = 3.7\ncolour = 1\n", "colour", "unknown field `colour`"),
        ("[gate]\n", "[powered]\nhurry = 1.0\n[gate]\n", "hurry", "unknown field `hurry`"),
        ("loaded_kg = 3.7", "loaded_kg = \"3.7 kg\"", "\"3.7 kg\"", "invalid type: string \"3.7 kg\""),
    ] {
        assert!(text.contains(is), "{is}");
        let wrong = text.replacen(is, becomes, 1);
        let message = message(from_toml(&wrong, "club.toml"));
        assert!(message.starts_with("club.toml: TOML parse error "), "{message}");
        assert!(message.contains(&place(&wrong, at)) && message.contains(said), "{message}");
    }
    let message = message(from_toml("airframe = \"mk3\"", "club.toml"));
    assert!(
        message.contains("at line 1, column 12\n") && message.contains("invalid type: string"),
        "{message}"
    );
}

/// Its place would be one in the text of the defaults.
#[test]
fn a_missing_section_is_reported_with_its_name_and_contents() {
    for (section, said) in [
        ("airframe.parachute", "club.toml: missing field `area_m2`\nin `airframe.parachute`\n"),
        ("airframe.fins", "club.toml: missing field `station_m`\nin `airframe.fins`\n"),
        ("launch.booster.fins", "club.toml: missing field `root_chord_m`\nin `launch.booster.fins`\n"),
        ("start", "club.toml: missing field `height_m`\nin `start`\n"),
        ("gate", "club.toml: missing field `fence_radius_m`\nin `gate`\n"),
    ] {
        let mut mission: toml_edit::DocumentMut = text_of("mk3").parse().unwrap();
        let mut item = mission.as_item_mut();
        for key in section.split('.') {
            item = &mut item[key];
        }
        *item = toml_edit::Item::None;
        assert_eq!(message(from_toml(&mission.to_string(), "club.toml")), said);
    }
    // Nothing fills it in.
    let text = text_of("mk3");
    let (before, rest) = text.split_once("[airframe.mass]").unwrap();
    let without = format!("{before}[airframe.body]{}", rest.split_once("[airframe.body]").unwrap().1);
    let message = message(from_toml(&without, "club.toml"));
    assert!(
        message.contains(&place(&without, "[airframe]")) && message.contains("missing field `mass`"),
        "{message}"
    );
}

/// Barrowman's equations of three fins: a middle line of 49.74 mm, 12 (43 / 74)^2 / (1 + sqrt(1 +
/// (2 x 49.74 / 150)^2)) = 1.842, times 1 + 37 / 80; 22.22 + 19.44 mm behind the root's front,
/// which stands 110 mm above the end.
#[test]
fn val_barrowman_the_fins_of_a_booster() {
    let booster = read("mk2").launch.unwrap().booster;
    let fins = booster.fins;
    let sizes_m = [fins.root_chord_m, fins.tip_chord_m, fins.span_m, fins.sweep_m, fins.above_end_m];
    assert_eq!((sizes_m, booster.length_m), ([0.1, 0.05, 0.043, 0.05, 0.01], 0.6));
    let force = booster.fin_force;
    assert!((force.slope_per_rad - 2.694).abs() < 5e-4, "{}", force.slope_per_rad);
    assert!((force.station_m + 0.5317).abs() < 5e-5, "{}", force.station_m);
    // The middle of the span, from the axis.
    assert!((booster.fin_radius_m - 0.0585).abs() < 1e-9, "{}", booster.fin_radius_m);
}

/// A motor of 203 mm burns in its middle and swings about it; a tube of 74 mm has 4,300.84 mm^2.
#[test]
fn val_hand_what_follows_from_a_builders_measures() {
    let mk3 = read("mk3");
    assert!((mk3.motor_curve.length_m() - 0.203).abs() < 1e-12);
    assert!((mk3.airframe.mass.propellant_station_m - 0.1015).abs() < 1e-12);
    assert!((mk3.airframe.gimbal.pivot_station_m - 0.1015).abs() < 1e-12);
    assert!((mk3.airframe.body.reference_area_m2 - 0.004_300_84).abs() < 5e-9);
    // The booster's motor of 365 mm, from its end up.
    let booster = mk3.launch.unwrap().booster;
    assert!((booster.motor_curve.length_m() - 0.365).abs() < 1e-12);
    assert!((booster.propellant_station_m + 0.4175).abs() < 1e-12);
    // Stated values are flown.
    let stated = with("mk3", "airframe.body.reference_area_m2", 0.0043).unwrap();
    assert!((stated.airframe.body.reference_area_m2 - 0.0043).abs() < 1e-15);
}

/// mk3's text with this section `[lot]`.
fn mk3_with(lot: &str) -> Mission {
    from_toml(&format!("{}\n[lot]\n{lot}", text_of("mk3")), "mk3").unwrap()
}

/// Four burns 2 % above the certified impulse, with the prior's one: 1.016.
#[test]
fn val_hand_a_lot_moves_the_curve_and_narrows_what_is_expected() {
    let mk3 = read("mk3");
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
fn the_curve_of_the_other_motor_is_looked_up() {
    let mk3 = read("mk3");
    assert_eq!(mk3.other_curve.as_ref().map(ThrustCurve::name), Some("H45W"));
    let wrong = message(from_toml(&text_of("mk3").replace("\"H45W\"", "\"HP-H46W\""), "mk3"));
    assert!(wrong.starts_with("no motor is named 'HP-H46W'; these are built in: F10"), "{wrong}");
}

#[test]
fn the_lot_on_the_engineers_page_is_one() {
    let page = include_str!("../../../../docs/engineer.md");
    let (_, lot) = page.split_once("```toml\n[lot]\n").unwrap();
    assert_eq!(mk3_with(lot.split_once("```").unwrap().0).motor_burns(), 4);
}

#[test]
fn a_lot_without_burns_confirms_nothing_and_flies_the_certified_curve() {
    let mk3 = read("mk3");
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
    let text = text_of("mk3");
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
        let message = message(from_toml(&format!("{text}\n[lot]\n{lot}"), "mk3"));
        assert!(message.contains(words), "{message}");
    }
}

#[test]
fn a_value_out_of_range_is_named_in_the_error() {
    for (path, wrong, said) in [
        ("motor.shape_lasts_s", 0.0, "mk2: motor.shape_lasts_s = 0: must be a finite number above 0"),
        ("motor.shape_sigma", f64::NAN, "mk2: motor.shape_sigma = NaN: must be a finite number, 0 or more"),
        ("exhaust.body_loss", 7.0, "mk2: exhaust.body_loss = 7: must be -1 to 1"),
        (
            "estimator.mounting_deg",
            -2.0,
            "mk2: estimator.mounting_deg = -2: must be a finite number, 0 or more",
        ),
        ("estimator.frame_s", 0.0, "mk2: estimator.frame_s = 0: must be 0.001 to 0.02"),
        ("estimator.lidar_m", f64::NAN, "mk2: estimator.lidar_m = NaN: must be a finite number above 0"),
    ] {
        assert_eq!(message(with("mk2", path, wrong)), said);
    }
}

/// Every number of a mission, by its path, with another value in its place.
fn with_each_number(text: &str, value: f64, mut look: impl FnMut(&str, String)) {
    fn paths(table: &dyn toml_edit::TableLike, path: &[String], found: &mut Vec<Vec<String>>) {
        for (key, item) in table.iter() {
            let path = [path, &[key.to_owned()]].concat();
            match item {
                _ if item.is_float() || item.is_integer() => found.push(path),
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
    assert!(found.len() >= 150, "{}", found.len());
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
    let mut wrong = Vec::new();
    for name in ["mk3", "vlr"] {
        let text = effective(&read(name));
        for value in [f64::NAN, f64::INFINITY, -1e9] {
            with_each_number(&text, value, |path, changed| {
                let found = from_toml(&changed, "changed").err().map(|error| full(&error));
                // Of the booster's fins it is the force that has a range.
                let key = match path.strip_prefix("launch.booster.fins.") {
                    Some(_) => "launch.booster.fins",
                    None => path.split('.').rfind(|key| key.parse::<usize>().is_err()).unwrap(),
                };
                if !found.as_ref().is_some_and(|found| found.contains(key)) {
                    wrong.push(format!("{path} = {value}: {found:?}"));
                }
            });
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// An error with its causes.
fn full(error: &dyn core::error::Error) -> String {
    let causes = core::iter::successors(Some(error), |error| error.source());
    causes.map(ToString::to_string).collect::<Vec<_>>().join(": ")
}

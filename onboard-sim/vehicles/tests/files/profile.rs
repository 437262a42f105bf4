use flight::vehicle::profile::Dispersion;
use vehicles::profile::{BUILTIN, builtin, builtin_toml, from_toml};

fn calibrated() -> &'static str {
    builtin_toml("paper-calibrated").unwrap()
}

#[test]
fn every_builtin_parses_and_carries_its_name() {
    for (name, text) in BUILTIN {
        let profile = from_toml(text, name).unwrap();
        assert_eq!(&profile.name, name);
        assert_eq!(builtin(name), Some(profile));
    }
    assert_eq!(builtin("no-such-profile"), None);
}

#[test]
fn builtins_differ_only_in_thrust_and_dispersion() {
    let calibrated = builtin("paper-calibrated").unwrap();
    let mut printed = builtin("paper-as-printed").unwrap();
    assert_eq!(printed.motor.thrust_n.to_bits(), 30.0_f64.to_bits());
    printed.motor.thrust_n = calibrated.motor.thrust_n;
    let mut dispersed = builtin("paper-dispersed").unwrap();
    dispersed.dispersion = Dispersion::default();
    for mut other in [printed, dispersed] {
        other.name.clone_from(&calibrated.name);
        other.summary.clone_from(&calibrated.summary);
        assert_eq!(other, calibrated);
    }
}

#[test]
fn the_error_for_an_unknown_key_names_the_key_and_the_file() {
    let text = calibrated().replace("mass_kg = 3.0", "mass_kg = 3.0\nmass_lb = 6.6");
    let message = from_toml(&text, "my.toml").unwrap_err().to_string();
    assert!(message.contains("my.toml") && message.contains("mass_lb"), "{message}");
}

#[test]
fn a_missing_key_is_named_in_the_error() {
    let text = calibrated().replace("thrust_n = 33.3\n", "");
    let message = from_toml(&text, "my.toml").unwrap_err().to_string();
    assert!(message.contains("thrust_n"), "{message}");
}

#[test]
fn values_out_of_range_are_refused_with_key_value_and_range() {
    let cases = [
        ("mass_kg = 3.0", "mass_kg = -3.0", "vehicle.mass_kg = -3"),
        ("mass_kg = 3.0", "mass_kg = nan", "vehicle.mass_kg = NaN"),
        ("horizon_steps = 50", "horizon_steps = 201", "nmpc.horizon_steps = 201: must be from 1 to 200"),
        ("horizon_steps = 50", "horizon_steps = 0", "nmpc.horizon_steps = 0"),
        ("actuation_delay_steps = 1", "actuation_delay_steps = 2", "nmpc.actuation_delay_steps = 2"),
        ("gimbal_deg = 20.0", "gimbal_deg = 25.0", "at most gimbal.limit_deg"),
        ("altitude_m = 15.0", "altitude_m = inf", "start.altitude_m = inf"),
        ("cg_from_mid_m = 0.17", "cg_from_mid_m = -0.5", "vehicle.cg_from_mid_m = -0.5"),
        ("delta = 1.0", "delta = 0.0", "nmpc.weights.delta = 0"),
    ];
    for (from, to, expected) in cases {
        let text = calibrated().replacen(from, to, 1);
        assert_ne!(text, calibrated(), "{from} is not in the profile");
        let message = from_toml(&text, "my.toml").unwrap_err().to_string();
        assert!(message.starts_with("my.toml: ") && message.contains(expected), "{message}");
    }
}

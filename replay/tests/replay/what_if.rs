//! Tests the margin of a flight that is flown again.

use replay::refly::{ReflyOptions, ReflyReport, margin, other_flights, refly};
use replay::settings::Setting;

use crate::settings::with;
use crate::simulated::MK2;

#[test]
fn the_margin_is_the_fraction_left_of_the_nearest_limit() {
    let recording = MK2.recording();
    let mut verdict = refly(&recording, &ReflyOptions::default()).unwrap().reflown.unwrap();
    // Legs that cannot give way.
    verdict.borne.clear();
    verdict.envelope.iter_mut().for_each(|limit| limit.value = 0.0);
    assert!((margin(&verdict) - 1.0).abs() < 1e-12);
    verdict.envelope[0].value = 0.75 * verdict.envelope[0].minimum;
    assert!((margin(&verdict) - 0.25).abs() < 1e-12);
    verdict.envelope[1].value = 2.0 * verdict.envelope[1].maximum;
    assert!((margin(&verdict) + 1.0).abs() < 1e-12);
    verdict.envelope[1].value = f64::NAN;
    assert!(margin(&verdict).is_infinite() && margin(&verdict) < 0.0);
}

/// A vehicle that fell over is as far from standing as its contact says: the harder contact has
/// less margin.
#[test]
fn failed_flights_have_an_order() {
    let recording = MK2.recording();
    let mut verdict = refly(&recording, &ReflyOptions::default()).unwrap().reflown.unwrap();
    let fell = verdict.borne.iter().position(|limit| limit.name == "leg load").unwrap();
    let mut tipped = verdict.borne[fell].clone();
    (tipped.name, tipped.value, tipped.maximum, tipped.passed) = ("tipped over".to_owned(), 1.0, 0.0, false);
    verdict.borne.push(tipped);
    let soft = margin(&verdict);
    verdict.envelope[1].value = 8.0 * verdict.envelope[1].maximum;
    let hard = margin(&verdict);
    assert!(hard.is_finite() && hard < soft && soft <= 0.0, "{hard} {soft}");
}

#[test]
fn a_setting_that_never_acts_is_reported() {
    let recording = MK2.recording();
    for (text, never) in [("ignition.delay_s=0.5@50000", true), ("ignition.delay_s=0.5", false)] {
        let report = refly(&recording, &with(&[text])).unwrap();
        assert_eq!(report.never_acted, never, "{text}: {report:?}");
    }
    let unchanged = refly(&recording, &ReflyOptions::default()).unwrap();
    assert!(!unchanged.never_acted, "nothing was to be changed");
}

/// Each flight is flown with the change and without: without a change none is saved or lost.
#[test]
fn other_flights_show_the_effect_of_a_change() {
    let recording = MK2.recording();
    let same = other_flights(&recording, &ReflyOptions::default(), 8).unwrap();
    assert_eq!((same.flights, same.saved, same.lost, same.stood), (8, 0, 0, same.stand));
    let mut none = ReflyOptions::default();
    none.faults.with.push("no-light@0".to_owned());
    let none = other_flights(&recording, &none, 8).unwrap();
    assert_eq!((none.stand, none.lost), (0, none.stood));
    let refused = other_flights(&recording, &with(&["ignition.delay_s=0.5@6"]), 8).unwrap_err();
    assert!(refused.to_string().starts_with("--flights: takes --set without a time"), "{refused}");
}

/// Every number of a section, set to its own value.
fn unchanged(prefix: &str, value: &toml::Value) -> Vec<Setting> {
    match value {
        toml::Value::Table(table) => {
            table.iter().flat_map(|(key, value)| unchanged(&format!("{prefix}.{key}"), value)).collect()
        }
        toml::Value::Float(_) | toml::Value::Integer(_) => {
            vec![Setting { path: prefix.to_owned(), value: value.clone(), at_s: None }]
        }
        _ => Vec::new(),
    }
}

/// Legs act on the ground: every frame before the contact has the recorded commands, also with
/// every other key of the airframe set to the value that it has.
#[test]
fn a_change_that_acts_late_leaves_everything_before_it_as_it_was() {
    let recording = MK2.recording();
    let mission = flight::vehicles::mission::from_toml(recording.profile_toml().unwrap(), "log").unwrap();
    let airframe = unchanged("airframe", &toml::Value::try_from(&mission.airframe).unwrap());
    assert!(airframe.len() > 30, "{}", airframe.len());
    let legs: Setting = "airframe.legs.friction_coefficient=0.123".parse().unwrap();
    let settings = [vec![legs.clone()], [airframe, vec![legs]].concat()];
    let in_the_air = |report: &ReflyReport, contact_s: f64| {
        (contact_s / 0.005) as usize - (report.start.frame - recording.release_frame) as usize
    };
    let contact_s = recording.contact_s().unwrap();
    for settings in settings {
        for options in [
            ReflyOptions { settings: settings.clone(), ..ReflyOptions::default() },
            ReflyOptions { plant_settings: settings.clone(), ..ReflyOptions::default() },
        ] {
            let report = refly(&recording, &options).unwrap();
            let same = report.commands_identical;
            let air = in_the_air(&report, contact_s);
            assert!(air > 500 && same >= air && same < report.frames, "{air} {report:?}");
        }
    }
}

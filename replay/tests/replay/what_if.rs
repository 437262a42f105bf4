//! Tests the margin of a flight that is flown again.

use replay::refly::{ReflyOptions, margin, other_flights, refly};

use crate::asked::with;
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
fn a_setting_that_never_acts_is_told() {
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
fn other_flights_say_what_a_change_does() {
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

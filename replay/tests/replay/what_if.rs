//! Tests the margin of a flight that is flown again.

use replay::refly::{ReflyOptions, margin, refly};

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

//! Tests the margin of a flight that is flown again.

use replay::refly::{ReflyOptions, margin, refly};

use crate::simulated::MK2;

#[test]
fn the_margin_is_the_fraction_left_of_the_nearest_limit() {
    let recording = MK2.recording();
    let mut verdict = refly(&recording, &ReflyOptions::default()).unwrap().reflown.unwrap();
    for limit in &mut verdict.limits {
        limit.value = 0.5 * (limit.minimum + limit.maximum);
    }
    assert!((margin(&verdict) - 1.0).abs() < 1e-12);
    verdict.limits[3].value = 0.75 * verdict.limits[3].maximum;
    assert!((margin(&verdict) - 0.25).abs() < 1e-12);
    verdict.limits[4].value = 2.0 * verdict.limits[4].maximum;
    assert!((margin(&verdict) + 1.0).abs() < 1e-12);
    verdict.limits[4].value = f64::NAN;
    assert!(margin(&verdict).is_infinite() && margin(&verdict) < 0.0);
}

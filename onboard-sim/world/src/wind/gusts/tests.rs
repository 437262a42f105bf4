use super::*;

/// MIL-F-8785C at 200 ft in 15 m/s of wind at 20 ft, worked by hand: 0.177 + 0.1646 = 0.3416; ^0.4 = 0.650739,
/// ^1.2 = 0.275565; lengths 200 / 0.275565 = 725.78 ft and 200 ft.
#[test]
fn val_mil_f_8785c_scales_at_200_ft() {
    let scales = GustScales::at(60.96, 15.0);
    for (found, expected) in [
        (scales.vertical_m_s, 1.5),
        (scales.horizontal_m_s, 2.305_07),
        (scales.vertical_m, 60.96),
        (scales.horizontal_m, 221.22),
    ] {
        assert!((found / expected - 1.0).abs() < 3e-5, "{found} {expected}");
    }
    assert_eq!(GustScales::at(0.0, 15.0), GustScales::at(3.048, 15.0));
    assert_eq!(GustScales::at(900.0, 15.0), GustScales::at(304.8, 15.0));
}

/// Variances, and the correlation a quarter and a whole length apart, over many samples. The step is longer than in a
/// simulation, which exact discretisation allows.
#[test]
fn val_mil_f_8785c_variance_and_correlation() {
    let height_m = 60.0;
    let scales = GustScales::at(height_m, 10.0);
    let path_m = scales.vertical_m / 4.0;
    let mut gusts = Gusts::new(10.0, 7);
    let samples: Vec<_> = (0..400_000).map(|_| gusts.step(height_m, path_m)).collect();
    let correlation = |axis: usize, lag: usize| {
        let sum: f64 = samples.iter().zip(&samples[lag..]).map(|(a, b)| a[axis] * b[axis]).sum();
        sum / (samples.len() - lag) as f64
    };
    let longitudinal = |share: f64| libm::exp(-share);
    // The transform of the transverse spectrum (1 + 3 x^2) / (1 + x^2)^2.
    let transverse = |share: f64| libm::exp(-share) * (1.0 - share / 2.0);
    let horizontal_share = path_m / scales.horizontal_m;
    for lag in [0, 1, 4] {
        let lags = lag as f64;
        for (axis, deviation_m_s, expected) in [
            (0, scales.horizontal_m_s, longitudinal(lags * horizontal_share)),
            (1, scales.horizontal_m_s, transverse(lags * horizontal_share)),
            (2, scales.vertical_m_s, transverse(lags * 0.25)),
        ] {
            let found = correlation(axis, lag) / (deviation_m_s * deviation_m_s);
            // Four standard errors of the slowest axis.
            assert!((found - expected).abs() < 0.02, "axis {axis}, lag {lag}: {found}, expected {expected}");
        }
    }
}

/// Many short steps equal one long step: the same decay, and the same variance at the end.
#[test]
fn standing_air_keeps_its_gust() {
    let mut gusts = Gusts::new(10.0, 3);
    let before = gusts.step(50.0, 0.0);
    for _ in 0..1000 {
        assert!((gusts.step(50.0, 0.0) - before).norm() < 1e-12);
    }
}

#[test]
fn the_same_seed_gives_the_same_gusts() {
    let flight = |seed| {
        let mut gusts = Gusts::new(8.0, seed);
        (0..1000).map(|_| gusts.step(30.0, 0.04)).collect::<Vec<_>>()
    };
    assert_eq!(flight(5), flight(5));
    assert_ne!(flight(5), flight(6));
}

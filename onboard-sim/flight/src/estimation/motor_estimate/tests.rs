//! The filter finds the parameters of simulated motors that are drawn from the prior.

use std::sync::LazyLock;

use super::*;
use crate::vehicle::thrust_curve::{MotorData, ThrustPoint};
use serde::Serialize;

const POINTS: [(f64, f64); 7] =
    [(0.0, 0.0), (0.14, 62.0), (1.3, 69.0), (2.5, 61.0), (4.1, 34.0), (5.5, 14.0), (7.2, 0.0)];

/// A regressive motor like a slow-burning H: it rises in 0.14 s, is flat for a while, then falls
/// for a long time.
static CURVE: LazyLock<ThrustCurve> = LazyLock::new(|| {
    let points = POINTS.map(|(time_s, thrust_n)| ThrustPoint { time_s, thrust_n }).to_vec();
    ThrustCurve::new(MotorData { points, ..MotorData::default() }).expect("it has thrust")
});

/// Approximately standard normal numbers from a small generator: a sum of twelve uniform numbers.
struct Normal(u64);

impl Normal {
    fn next(&mut self) -> f64 {
        let mut uniform = || {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }
}

#[derive(Debug, Clone, Copy, Serialize)]
struct Motor {
    impulse: f64,
    stretch: f64,
    ignition_s: f64,
    air: f64,
    /// Thrust divided by the curve's in the first 50 ms.
    spike: f64,
    /// The motor stops, s after ignition.
    out_s: f64,
    /// It burns for 0.1 s and is out for 0.2 s before it reignites.
    chuffs: bool,
    /// Time in which its thrust rises to the curve's, s; no propellant is lost.
    rise_s: f64,
    /// Deviation from the curve's shape: its size and its period, s.
    wave: (f64, f64),
}

const GOOD: Motor = Motor {
    impulse: 1.0,
    stretch: 1.0,
    ignition_s: 4.0,
    air: 1.0,
    spike: 1.0,
    out_s: f64::INFINITY,
    chuffs: false,
    rise_s: 0.0,
    wave: (0.0, 1.0),
};

impl Motor {
    fn drawn(normal: &mut Normal) -> Self {
        let prior = MotorPrior::default();
        Self {
            impulse: 1.0 + prior.impulse_sigma * normal.next(),
            stretch: 1.0 + prior.burn_time_sigma * normal.next(),
            ignition_s: 4.0 + 0.01 * normal.next(),
            air: 1.0 + prior.air_sigma * normal.next(),
            ..GOOD
        }
    }

    fn thrust_n(&self, time_s: f64) -> f64 {
        let since_s = time_s - self.ignition_s;
        if since_s > self.out_s || self.chuffs && (0.1..0.3).contains(&since_s) {
            return 0.0;
        }
        let since_s = if self.chuffs && since_s > 0.2 { since_s - 0.2 } else { since_s };
        let (since_s, rate) = match since_s {
            ..0.0 => (since_s, 1.0),
            since_s if since_s < self.rise_s => {
                (0.5 * since_s * since_s / self.rise_s, since_s / self.rise_s)
            }
            _ => (since_s - 0.5 * self.rise_s, 1.0),
        };
        let spike = if since_s < 0.05 { self.spike } else { 1.0 };
        let wave = 1.0 + self.wave.0 * libm::sin(core::f64::consts::TAU * since_s / self.wave.1);
        rate * spike * wave * self.impulse / self.stretch * CURVE.thrust_at_n(since_s / self.stretch)
    }

    /// Falls for four seconds, and burns until `end_s` after ignition.
    fn found_after(&self, end_s: f64, normal: &mut Normal) -> MotorEstimate {
        self.found_by(&MotorPrior::default(), end_s, normal)
    }

    fn found_by(&self, prior: &MotorPrior, end_s: f64, normal: &mut Normal) -> MotorEstimate {
        let mut estimate = MotorEstimate::new(prior);
        let frames = ((self.ignition_s + end_s) / prior.frame_s) as u32;
        for frame in 1..=frames {
            let time_s = f64::from(frame) * prior.frame_s;
            let mass_kg = 3.1;
            // The fall slows down as the motor burns.
            let speed = (1.0 - (time_s - 4.0).max(0.0) / 4.0).max(0.0);
            let axial_air_force_n = 28.0 * speed * speed;
            let gimbal_rad = [0.05 * libm::sin(3.0 * time_s), 0.03];
            let cosine = libm::cos(gimbal_rad[0]) * libm::cos(gimbal_rad[1]);
            let mean_n = (0..5)
                .map(|ms| self.thrust_n(time_s - prior.frame_s + 0.001 * (f64::from(ms) + 0.5)))
                .sum::<f64>()
                / 5.0;
            let force_n = mean_n * cosine + self.air * axial_air_force_n;
            let sensed = force_n / mass_kg + prior.accelerometer_m_s2 * normal.next();
            estimate.update(
                &CURVE,
                &MotorSample {
                    time_s,
                    axial_specific_force_m_s2: sensed,
                    mass_kg,
                    axial_air_force_n,
                    gimbal_rad,
                    may_burn: time_s > 3.8,
                },
            );
        }
        estimate
    }
}

#[test]
fn ignition_is_timed_within_a_frame_and_the_air_scale_is_estimated_before_it() {
    let mut normal = Normal(1);
    let (n, mut squares_s2) = (50, 0.0);
    for _ in 0..n {
        let motor = Motor::drawn(&mut normal);
        let estimate = motor.found_after(0.05, &mut normal);
        let late_s = estimate.ignition_s().unwrap() - motor.ignition_s;
        assert!(late_s.abs() < MotorPrior::default().frame_s, "{late_s} {motor:?}");
        squares_s2 += late_s * late_s;
        assert!((estimate.air_scale() - motor.air).abs() < 0.05, "{} {motor:?}", estimate.air_scale());
    }
    let rms_s = (squares_s2 / f64::from(n)).sqrt();
    println!("ignition timed to {:.2} ms rms", 1e3 * rms_s);
    assert!(rms_s < 0.0025, "{rms_s}");
}

/// A fall with a negative air scale has no terminal speed: its predicted speed is NaN, and the sign
/// of a NaN differs between processors.
#[test]
fn the_air_scale_stays_positive_whatever_is_measured() {
    let mut estimate = MotorEstimate::new(&MotorPrior::default());
    for frame in 0..4000 {
        // So slow that no sample is rejected.
        let axial_specific_force_m_s2 = 5.0 - 0.002 * f64::from(frame);
        let sample = MotorSample {
            time_s: 0.005 * f64::from(frame),
            axial_specific_force_m_s2,
            mass_kg: 1.0,
            axial_air_force_n: 5.0,
            gimbal_rad: [0.0; 2],
            may_burn: false,
        };
        estimate.update(&CURVE, &sample);
    }
    assert!(estimate.mean[AIR] < 0.0, "{}", estimate.mean[AIR]);
    assert!(estimate.air_scale() > 0.0);
}

#[test]
fn future_thrust_is_predicted_within_its_stated_uncertainty() {
    let mut normal = Normal(2);
    let n = 100;
    for (end_s, ahead_s, before_share) in [(0.5, 1.0, 0.35), (1.5, 1.0, 0.5), (3.0, 1.0, 0.5)] {
        let (mut squares, mut worst_n, mut informed, mut ignorant) = (0.0, 0.0_f64, 0.0, 0.0);
        for _ in 0..n {
            let motor = Motor::drawn(&mut normal);
            let estimate = motor.found_after(end_s, &mut normal);
            let time_s = motor.ignition_s + end_s + ahead_s;
            let predicted = estimate.predict(&CURVE, time_s, f64::NAN);
            let error_n = predicted.thrust_n - motor.thrust_n(time_s);
            squares += (error_n / predicted.sigma_n).powi(2);
            worst_n = worst_n.max(error_n.abs());
            informed += error_n * error_n;
            ignorant += (CURVE.thrust_at_n(end_s + ahead_s) - motor.thrust_n(time_s)).powi(2);
        }
        let mean = squares / f64::from(n);
        println!(
            "after {end_s} s: normalised {mean:.2}, worst {worst_n:.2} N, rms {:.2} of {:.2} N",
            (informed / f64::from(n)).sqrt(),
            (ignorant / f64::from(n)).sqrt()
        );
        // These motors do not have the roughness that the filter allows for, so the filter may
        // state too large an uncertainty, but not too small a one.
        assert!(mean < 1.0 + 4.0 * (2.0 / f64::from(n)).sqrt(), "after {end_s} s: {mean}");
        assert!(informed < before_share * before_share * ignorant, "after {end_s} s");
    }
}

/// Thrust that oscillates by 2 % around the curve. A filter that trusts the shape is far too
/// confident in impulse and burn time; one with a shape error is consistent.
#[test]
fn a_wrong_shape_is_no_surprise_to_a_filter_that_expects_one() {
    let trusting = MotorPrior { roughness_share: 0.003, ..MotorPrior::default() };
    let cautious = MotorPrior { shape_sigma: 0.015, shape_lasts_s: 0.7, ..trusting };
    let mut normal = Normal(6);
    let n = 100;
    let outside = |prior: &MotorPrior, normal: &mut Normal| {
        (0..n)
            .filter(|number| {
                let period_s = 1.5 + 0.02 * f64::from(*number);
                let motor = Motor { wave: (0.02, period_s), ..Motor::drawn(normal) };
                let estimate = motor.found_by(prior, 2.5, normal);
                // 95 % of a chi-square with two degrees of freedom.
                estimate.nees_of_scales(motor.impulse, motor.stretch).unwrap() > 5.991
            })
            .count()
    };
    let (trusting, cautious) = (outside(&trusting, &mut normal), outside(&cautious, &mut normal));
    println!("truth outside the 95 % ellipse: {trusting} and {cautious} of {n}");
    assert!(trusting > 50, "{trusting}");
    // 5 expected; four standard deviations more are 14.
    assert!(cautious <= 14, "{cautious}");
}

#[test]
fn an_ignition_spike_does_not_change_the_estimate() {
    let spiked = Motor { spike: 2.5, ..GOOD }.found_after(0.5, &mut Normal(3));
    let predicted_n = spiked.predict(&CURVE, 5.5, f64::NAN).thrust_n;
    assert!((predicted_n / CURVE.thrust_at_n(1.5) - 1.0).abs() < 0.015, "{predicted_n} {spiked:?}");
}

/// It reignites where it stopped, and is then estimated as well as a motor without a chuff.
#[test]
fn a_motor_that_chuffs_is_estimated_like_another() {
    let (mut normal, mut chuffed, mut at_once) = (Normal(12), 0.0, 0.0);
    for _ in 0..100 {
        let good = Motor::drawn(&mut normal);
        let motor = Motor { chuffs: true, ..good };
        let out = motor.found_after(0.25, &mut normal);
        assert_eq!((out.stage(), out.ignition_s()), (MotorStage::Waiting, None), "{motor:?}");
        let ignited = motor.found_after(1.5, &mut normal);
        assert_eq!(ignited.stage(), MotorStage::Burning, "{motor:?}");
        let late_s = ignited.ignition_s().unwrap() - motor.ignition_s;
        assert!((late_s - 0.2).abs() < 0.03, "{late_s} {motor:?}");
        chuffed += (ignited.impulse_scale() - motor.impulse).powi(2);
        at_once += (good.found_after(1.3, &mut normal).impulse_scale() - good.impulse).powi(2);
    }
    // The variances of 100 estimates each: four standard errors of their ratio are 0.57.
    assert!(chuffed < 1.57 * at_once, "{chuffed} {at_once}");
}

/// The igniter may have current from 3.8 s on, the flame is there from 4 s on, and the thrust of
/// the curve 0.5 s later.
#[test]
fn current_flame_and_thrust_are_apart() {
    let motor = Motor { rise_s: 0.5, ..GOOD };
    for (after_s, stage) in [
        (-0.05, MotorStage::Waiting),
        (0.25, MotorStage::Rising),
        (0.4, MotorStage::Rising),
        (0.55, MotorStage::Burning),
    ] {
        assert_eq!(motor.found_after(after_s, &mut Normal(7)).stage(), stage, "{after_s} s");
    }
    assert_eq!(GOOD.found_after(0.1, &mut Normal(7)).stage(), MotorStage::Burning);
    // A motor that only glows is not waited for longer than the slowest.
    let weak = Motor { impulse: 0.75, ..GOOD }.found_after(0.5, &mut Normal(7));
    assert_eq!(weak.stage(), MotorStage::Burning);
    assert!((weak.ignition_s().unwrap() - 4.0).abs() < 0.03, "{weak:?}");
}

/// A rise of T delays the burn by T / 2, and does not pass for a weak motor.
#[test]
fn a_slow_rise_delays_the_ignition_and_leaves_the_impulse() {
    let mut normal = Normal(13);
    for rise_s in [0.1, 0.3, 0.5, 0.7] {
        let (n, mut slow, mut at_once) = (50, 0.0, 0.0);
        for _ in 0..n {
            let good = Motor::drawn(&mut normal);
            let motor = Motor { rise_s, ..good };
            let found = motor.found_after(1.5 + 0.5 * rise_s, &mut normal);
            let late_s = found.ignition_s().unwrap() - motor.ignition_s;
            assert!((late_s - 0.5 * rise_s).abs() < 0.05, "{rise_s}: {late_s} {motor:?}");
            let off = found.impulse_scale() / motor.impulse - 1.0;
            assert!(off.abs() < 0.06, "{rise_s}: {off} {motor:?}");
            slow += off * off;
            at_once += (good.found_after(1.5, &mut normal).impulse_scale() / good.impulse - 1.0).powi(2);
        }
        let [slow, at_once] = [slow, at_once].map(|squares| (squares / f64::from(n)).sqrt());
        println!("rise of {rise_s} s: impulse off by {slow:.4}, {at_once:.4} without, rms");
        assert!(slow < 1.3 * at_once, "{rise_s}: {slow} {at_once}");
    }
}

#[test]
fn an_early_burnout_is_detected_and_a_weak_motor_is_not_mistaken_for_one() {
    let out = Motor { out_s: 1.2, ..GOOD }.found_after(1.4, &mut Normal(4));
    let MotorStage::EndedEarly { at_s } = out.stage() else { panic!("{out:?}") };
    assert!((at_s - 5.2).abs() < 0.01, "{at_s}");
    assert_eq!(out.predict(&CURVE, 5.3, 0.0), PredictedThrust { thrust_n: 0.0, sigma_n: 0.0 });
    let weak = Motor { impulse: 0.8, ..GOOD }.found_after(2.0, &mut Normal(5));
    assert_eq!(weak.stage(), MotorStage::Burning);
    assert!(
        (weak.predict(&CURVE, 6.5, 0.0).thrust_n / (0.8 * CURVE.thrust_at_n(2.5)) - 1.0).abs() < 0.03,
        "{weak:?}"
    );
}

#[test]
fn no_ignition_is_found_before_the_igniter_fires_and_bad_samples_change_nothing() {
    let mut estimate = MotorEstimate::new(&MotorPrior::default());
    let sample = MotorSample {
        time_s: 0.0,
        axial_specific_force_m_s2: 30.0,
        mass_kg: 3.0,
        axial_air_force_n: 0.0,
        gimbal_rad: [0.0; 2],
        may_burn: false,
    };
    for frame in 0..100 {
        estimate.update(&CURVE, &MotorSample { time_s: 0.005 * f64::from(frame), ..sample });
    }
    assert_eq!(estimate.stage(), MotorStage::Waiting);
    let before = estimate;
    for bad in [
        MotorSample { axial_specific_force_m_s2: f64::NAN, ..sample },
        MotorSample { axial_air_force_n: f64::INFINITY, ..sample },
        MotorSample { time_s: f64::NAN, ..sample },
        MotorSample { gimbal_rad: [f64::NAN, 0.0], ..sample },
    ] {
        estimate.update(&CURVE, &bad);
        assert_eq!(estimate, before, "{bad:?}");
    }
}

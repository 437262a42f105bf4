//! Flies simulated flights, fits each from what its log would hold, and counts how often the 95 % intervals hold the truth.
//!
//! `cargo run --release -p replay --example fit_coverage -- MISSION DISPERSION FLIGHTS SEED`

use std::collections::BTreeMap;
use std::io::Write as _;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::sync_channel;

use anyhow::Context as _;
use replay::fit::{Fit, Trace, fit};
use sim::recipe::Recipe;
use sim::sortie::Sortie;
use sim::world::sensors::Sensors;

/// Flies a flight and keeps what its log would hold.
fn flown(recipe: &Recipe, number: u64) -> anyhow::Result<(Trace, Sortie)> {
    let mut flight = Sortie::new(recipe, number)?;
    let mut trace = Trace::new(&format!("flight {number}"), recipe.mission.clone(), &recipe.mission_toml);
    loop {
        flight.step();
        let reported_rad = flight.world().gimbal_feedback_rad();
        let reported = (std::env::var("REPORTED").is_ok()).then_some(reported_rad);
        let computer = flight.computer();
        if let (Some(input), Some(estimate)) = (computer.flown(), flight.pilot().estimate()) {
            trace.push(&input, computer.commands(), computer.mode().phase, estimate, reported);
        }
        if !flight.goes_on() {
            return Ok((trace, flight));
        }
    }
}

/// The truth by the names of a fit's parameters.
fn truth(recipe: &Recipe, flight: &Sortie) -> anyhow::Result<BTreeMap<String, f64>> {
    let drawn = flight.drawn();
    let truth = &drawn.truth;
    let sensors = &recipe.dispersion.sensor_params;
    let errors = *Sensors::new(sensors, drawn.flight_seed, 0.0)?.errors();
    let airframe = &recipe.mission.airframe;
    let arm_m = airframe.mass.loaded_cg_station_m;
    let [pitch_rad, yaw_rad] = truth.thrust_misalignment_rad;
    let [_, y_m, z_m] = truth.cg_offset_m;
    let [oy_m, oz_m] = truth.thrust_offset_m;
    let inertia = truth.inertia_scale;
    let (sin, cos) = libm::sincos(truth.wind_towards_rad);
    let mut all = BTreeMap::new();
    let mut put = |name: &str, value: f64| {
        all.insert(name.to_owned(), value);
    };
    put("thrust_scale", truth.impulse_scale / truth.mass_scale);
    put("burn_time_scale", truth.burn_time_scale);
    put("ignition_delay", truth.ignition_delay_s);
    put("drag_scale", truth.drag_scale / truth.mass_scale);
    put("body_drag_scale", truth.drag_scale * truth.body_drag_scale / truth.mass_scale);
    put("fin_drag_scale", truth.drag_scale * truth.fin_drag_scale / truth.mass_scale);
    put("exhaust_body_loss", truth.plume_body_loss);
    for (k, amplitude) in truth.thrust_shape.iter().enumerate() {
        put(&format!("thrust_shape_{}", k + 1), *amplitude);
    }
    put("gimbal_delay", airframe.gimbal.servo.delay_s);
    put("gimbal_rate", airframe.gimbal.servo.rate_deg_s);
    put("gimbal_gain", truth.gimbal_gain / inertia);
    put("gimbal_pitch_offset", ((pitch_rad + (z_m - oz_m) / arm_m) / inertia).to_degrees());
    put("gimbal_yaw_offset", ((yaw_rad - (y_m - oy_m) / arm_m) / inertia).to_degrees());
    put("gimbal_play", airframe.gimbal.servo.slop_deg + truth.gimbal_slop_rad.to_degrees());
    put("wind_x", truth.wind_m_s * cos);
    put("wind_y", truth.wind_m_s * sin);
    put("gyro_noise", sensors.imu.gyro_noise_deg_s_sqrt_hz);
    put("accelerometer_noise", sensors.imu.accelerometer_noise_mg_sqrt_hz);
    put("barometer_noise", sensors.barometer.noise_m);
    put("gnss_velocity_noise", sensors.gnss.velocity_m_s);
    put("gnss_horizontal_noise", sensors.gnss.horizontal_white_m);
    put("gnss_vertical_noise", sensors.gnss.vertical_white_m);
    put("lidar_noise", sensors.lidar.noise_m);
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        put(&format!("gyro_bias_{name}"), errors.gyro_bias_rad_s[axis].to_degrees());
        let milli_g = errors.accelerometer_bias_m_s2[axis] / 9.806_65e-3;
        put(&format!("accelerometer_bias_{name}"), milli_g);
    }
    Ok(all)
}

/// What was found of one parameter: error, standard deviation, and whether the interval holds the truth.
#[derive(Default)]
struct Tally {
    errors: Vec<(f64, f64, bool)>,
    not_found: usize,
}

fn main() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let at = |place: usize, default: &str| arguments.get(place).map_or(default, String::as_str).to_owned();
    let recipe = Recipe::built_in(&at(0, "mk2"), &at(1, "field"))?;
    let flights: u64 = at(2, "100").parse().context("FLIGHTS")?;
    let recipe = Recipe { seed: at(3, "1").parse().context("SEED")?, ..recipe };
    let next = AtomicU64::new(0);
    let mut tallies: BTreeMap<String, Tally> = BTreeMap::new();
    std::thread::scope(|scope| -> anyhow::Result<()> {
        let (results, inbox) = sync_channel::<anyhow::Result<(u64, Fit, BTreeMap<String, f64>)>>(8);
        for _ in 0..2 {
            let (results, recipe, next) = (results.clone(), &recipe, &next);
            scope.spawn(move || {
                loop {
                    let number = next.fetch_add(1, Ordering::Relaxed);
                    if number >= flights {
                        return;
                    }
                    let one = flown(recipe, number)
                        .and_then(|(trace, flight)| Ok((number, fit(&trace), truth(recipe, &flight)?)));
                    if results.send(one).is_err() {
                        return;
                    }
                }
            });
        }
        drop(results);
        let mut stderr = std::io::stderr();
        while let Ok(one) = inbox.recv() {
            let (number, fit, truth) = one?;
            for (name, true_value) in truth {
                let tally = tallies.entry(name.clone()).or_default();
                match fit.get(&name) {
                    None => tally.not_found += 1,
                    Some(found) => {
                        let held = (found.low..=found.high).contains(&true_value);
                        if std::env::var("SHOW").is_ok_and(|shown| shown == name) {
                            let other = |name: &str| fit.get(name).map_or(f64::NAN, |found| found.value);
                            writeln!(
                                stderr,
                                "{number} truth {true_value:.5} err {:.5} sigma {:.5} wind {:.2} updraught {:.3}",
                                found.value - true_value,
                                found.sigma,
                                libm::hypot(other("wind_x"), other("wind_y")),
                                other("updraught_rms"),
                            )?;
                        }
                        tally.errors.push((found.value - true_value, found.sigma, held));
                    }
                }
            }
        }
        Ok(())
    })?;
    let mut stdout = std::io::stdout().lock();
    writeln!(
        stdout,
        "{:<26} {:>5} {:>7} {:>15} {:>10} {:>10} {:>10} {:>6} {:>6} {:>6} {:>6}",
        "parameter",
        "found",
        "held %",
        "95 % interval",
        "mean err",
        "rms err",
        "med sigma",
        "z mean",
        "z rms",
        "z 95",
        "lacks"
    )?;
    for (name, Tally { errors, not_found }) in tallies {
        let count = errors.len();
        if count == 0 {
            writeln!(stdout, "{name:<26} {count:>5} {not_found:>86}")?;
            continue;
        }
        let n = count as f64;
        let held = errors.iter().filter(|error| error.2).count();
        let (low, high) = wilson(held, count);
        let mean = errors.iter().map(|error| error.0).sum::<f64>() / n;
        let rms = (errors.iter().map(|error| error.0 * error.0).sum::<f64>() / n).sqrt();
        let mut sigmas: Vec<f64> = errors.iter().map(|error| error.1).collect();
        sigmas.sort_by(f64::total_cmp);
        let z_mean = errors.iter().map(|error| error.0 / error.1).sum::<f64>() / n;
        let z_rms = (errors.iter().map(|error| (error.0 / error.1).powi(2)).sum::<f64>() / n).sqrt();
        // As a multiple of what a normal error has.
        let mut sizes: Vec<f64> = errors.iter().map(|error| (error.0 / error.1).abs() / 1.96).collect();
        sizes.sort_by(f64::total_cmp);
        writeln!(
            stdout,
            "{name:<26} {count:>5} {:>7.1} {:>6.1} to {:>5.1} {mean:>10.5} {rms:>10.5} {:>10.5} {z_mean:>6.2} {z_rms:>6.2} {:>6.2} {not_found:>6}",
            100.0 * held as f64 / n,
            100.0 * low,
            100.0 * high,
            sigmas[count / 2],
            sizes[95 * (count - 1) / 100],
        )?;
    }
    Ok(())
}

/// E. B. Wilson's score interval.
fn wilson(count: usize, of: usize) -> (f64, f64) {
    let (n, share, z2) = (of as f64, count as f64 / of as f64, 1.96 * 1.96);
    let centre = share + z2 / (2.0 * n);
    let half = 1.96 * (share * (1.0 - share) / n + z2 / (4.0 * n * n)).sqrt();
    ((centre - half) / (1.0 + z2 / n), (centre + half) / (1.0 + z2 / n))
}

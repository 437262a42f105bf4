//! Sensors, battery and vibration, as the flight computer had them, and the mission against the built-in one.

use flight::rules::phase::Phase;
use flight::vehicles::mission::BUILTIN;

use super::DEGREES;
use crate::info::Info;
use crate::report::chart::{Chart, Line};
use crate::report::html::{charts, escaped, paragraph, table};
use crate::report::track::{Flight, InSpace};

/// The test ratio above which a measurement is refused.
const REFUSED: f64 = 1.0;

pub(super) fn sensors(flight: &Flight) -> String {
    let Some(in_space) = &flight.in_space else {
        return paragraph("The log has no frames, so what the sensors said is not known.");
    };
    let names = ["barometer", "GNSS velocity", "GNSS position", "lidar"];
    let lines = names.into_iter().zip(["thin", "a", "c", "b"]).zip(&in_space.test_ratios).map(
        |((name, class), ratios)| {
            let points = ratios.iter().map(|(time_s, ratio)| (flight.axis_s(*time_s), ratio.min(3.0)));
            Line { name, class, points: points.collect() }
        },
    );
    let ratios = Chart {
        limits: vec![REFUSED],
        full: true,
        ..flight.over_time("Test ratio of each measurement; above 1 it was refused", lines.collect())
    };
    let sigma = |name, class, place: usize| Line {
        name,
        class,
        points: in_space
            .sigmas
            .iter()
            .map(|(time_s, sigmas)| (flight.axis_s(*time_s), sigmas[place]))
            .collect(),
    };
    let sigmas = vec![sigma("height, m", "a", 0), sigma("place, m", "c", 1), sigma("velocity, m/s", "b", 2)];
    let refused = in_space
        .aids
        .iter()
        .map(|(name, used, refused)| vec![(*name).to_owned(), used.to_string(), refused.to_string()]);
    table(&["measurement", "#used", "#refused"], &refused.collect::<Vec<_>>())
        + &charts(&[
            ratios.svg(),
            flight.over_time("Standard deviations of the estimate", sigmas).svg(),
            bias(flight, in_space),
        ])
}

/// The gyro's bias as the flight computer estimates it.
fn bias(flight: &Flight, in_space: &InSpace) -> String {
    let axis = |name, class, place: usize| Line {
        name,
        class,
        points: in_space
            .gyro_bias_rad_s
            .iter()
            .map(|(time_s, bias)| (flight.axis_s(*time_s), DEGREES * bias[place]))
            .collect(),
    };
    let lines = vec![axis("roll", "a", 0), axis("pitch", "b", 1), axis("yaw", "c", 2)];
    flight.over_time("Gyro bias as estimated, deg/s", lines).svg()
}

/// Samples of one spectrum, 1.28 s at 200 Hz.
const SEGMENT: usize = 256;

pub(super) fn battery_and_vibration(flight: &Flight) -> String {
    let volts = flight
        .recording
        .frames
        .iter()
        .filter_map(|frame| Some((flight.axis_s(frame.input.time_s), frame.input.battery_v?)));
    let volts = vec![Line { name: "", class: "a", points: volts.collect() }];
    let felt = |belongs: fn(Phase) -> bool| -> Vec<f64> {
        let frames = flight.recording.frames.iter().filter(|frame| {
            u8::try_from(frame.output.phase).ok().and_then(Phase::from_index).is_some_and(belongs)
        });
        frames.map(|frame| frame.input.measured.imu.specific_force_m_s2.x).collect()
    };
    let line = |name, class, samples: &[f64]| Line { name, class, points: spectrum(samples) };
    let lines = vec![
        line("descent", "a", &felt(Phase::in_descent)),
        line("burn", "b", &felt(Phase::in_landing_burn)),
    ];
    let spectra = Chart {
        title: "Specific force along the nose, m/s^2 per sqrt(Hz)".to_owned(),
        x_label: "Hz",
        lines,
        own_x: true,
        ..Chart::default()
    };
    let pictures = [flight.over_time("Battery, V", volts).svg(), spectra.svg()];
    if pictures.iter().all(String::is_empty) {
        return paragraph("The log has neither the battery nor samples of the inertial unit.");
    }
    charts(&pictures)
}

/// Amplitude spectral density by Welch's method: half overlapping segments under a Hann window, without their means. Hz, and
/// the samples' unit over sqrt(Hz). Short: a direct transform is fast enough for a flight.
fn spectrum(samples: &[f64]) -> Vec<(f64, f64)> {
    let rate_hz = 1.0 / flight::computer::FRAME_S;
    let window: Vec<f64> = (0..SEGMENT)
        .map(|k| 0.5 - 0.5 * libm::cos(core::f64::consts::TAU * k as f64 / SEGMENT as f64))
        .collect();
    let power: f64 = window.iter().map(|weight| weight * weight).sum();
    let segments: Vec<&[f64]> = samples.windows(SEGMENT).step_by(SEGMENT / 2).collect();
    if segments.is_empty() {
        return Vec::new();
    }
    let density = |bin: usize| {
        let squared = segments.iter().map(|segment| {
            let mean = segment.iter().sum::<f64>() / SEGMENT as f64;
            let (mut real, mut imaginary) = (0.0, 0.0);
            for (k, (sample, weight)) in segment.iter().zip(&window).enumerate() {
                let (sin, cos) =
                    libm::sincos(core::f64::consts::TAU * (bin * k % SEGMENT) as f64 / SEGMENT as f64);
                real += weight * (sample - mean) * cos;
                imaginary -= weight * (sample - mean) * sin;
            }
            real * real + imaginary * imaginary
        });
        libm::sqrt(2.0 * squared.sum::<f64>() / (segments.len() as f64 * rate_hz * power))
    };
    (1..SEGMENT / 2).map(|bin| (bin as f64 * rate_hz / SEGMENT as f64, density(bin))).collect()
}

/// What of the flown mission differs from the built-in one of its name.
pub(super) fn mission(flight: &Flight, info: &Info) -> String {
    let Some(Ok(flown)) = &flight.recording.head.profile_toml else {
        return paragraph("The log has no mission.");
    };
    let name = info.profile.as_ref().and_then(|profile| profile.name.as_deref()).unwrap_or_default();
    let Some((_, built_in)) = BUILTIN.iter().find(|(known, _)| *known == name) else {
        return paragraph(&format!("No mission {name} is built into this program."));
    };
    let (Ok(flown), Ok(built_in)) = (flown.parse(), built_in.parse()) else {
        return paragraph("The mission cannot be read.");
    };
    let mut rows = Vec::new();
    differences("", Some(&toml::Value::Table(built_in)), Some(&toml::Value::Table(flown)), &mut rows);
    if rows.is_empty() {
        return paragraph(&format!("As the built-in {name}."));
    }
    table(&["value", "built-in", "flown"], &rows)
}

fn differences(path: &str, a: Option<&toml::Value>, b: Option<&toml::Value>, rows: &mut Vec<Vec<String>>) {
    let empty = toml::Table::new();
    let tables = |value: Option<&toml::Value>| value.is_none_or(toml::Value::is_table);
    if tables(a) && tables(b) {
        let (a, b) = (a.and_then(toml::Value::as_table), b.and_then(toml::Value::as_table));
        let (a, b) = (a.unwrap_or(&empty), b.unwrap_or(&empty));
        let only_b = b.keys().filter(|key| !a.contains_key(*key));
        for key in a.keys().chain(only_b) {
            let dot = if path.is_empty() { "" } else { "." };
            differences(&format!("{path}{dot}{key}"), a.get(key), b.get(key), rows);
        }
    } else if a != b {
        let words = |value: Option<&toml::Value>| {
            escaped(&value.map_or_else(|| "absent".to_owned(), ToString::to_string))
        };
        rows.push(vec![escaped(path), words(a), words(b)]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The density of white noise is its deviation over the square root of half the rate; a tone stands at its frequency.
    #[test]
    fn a_tone_stands_at_its_frequency_and_the_variance_is_kept() {
        let tone =
            |k: usize| 3.0 * libm::sin(core::f64::consts::TAU * 25.0 * k as f64 * flight::computer::FRAME_S);
        let samples: Vec<f64> = (0..2048).map(tone).collect();
        let spectrum = spectrum(&samples);
        let (peak_hz, _) = spectrum.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
        assert!((peak_hz - 25.0).abs() < 0.4, "{peak_hz}");
        let step_hz = spectrum[1].0 - spectrum[0].0;
        let variance: f64 = spectrum.iter().map(|(_, density)| density * density * step_hz).sum();
        assert!((variance - 4.5).abs() < 0.05, "{variance}");
        assert_eq!(super::spectrum(&samples[..10]), []);
    }
}

//! Vibration.

use avionics::log::frame::phase_of;
use flight::rules::phase::Phase;
use protocol::log::computer_v1::ComputerFrame;

use crate::report::chart::{Chart, line};
use crate::report::track::Flight;

/// Samples of one spectrum, 1.28 s at 200 Hz.
const SEGMENT: usize = 256;

/// What the inertial unit felt along the nose, over frequency.
pub(super) fn vibration(flight: &Flight) -> Chart {
    let felt = |name, class, belongs: fn(Phase) -> bool| {
        let frames = flight.recording.frames.iter();
        let frames = frames.filter(|frame| phase_of(&frame.output).is_some_and(belongs));
        let felt = |frame: &ComputerFrame| frame.input.measured.imu.specific_force_m_s2.x;
        line(name, class, spectrum(&frames.map(felt).collect::<Vec<f64>>()))
    };
    let lines = vec![felt("descent", "a", Phase::in_descent), felt("burn", "b", Phase::in_landing_burn)];
    Chart {
        title: "Specific force along the nose, m/s\u{b2} per \u{221a}Hz".to_owned(),
        x_name: "Hz",
        lines,
        ..Chart::default()
    }
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

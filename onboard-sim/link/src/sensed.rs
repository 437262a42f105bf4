//! What the sensors said last, and when.

use flight::estimation::estimator::Measurements;

use crate::snapshot::SensorFacts;

/// A barometer that has been silent for so many frames does not report: a quarter of a second.
const BAROMETER_FRAMES: u64 = 50;
/// The same of the satellite receiver, which speaks five times a second: one second.
const GNSS_FRAMES: u64 = 200;
/// The same of the lidar: a tenth of a second.
const LIDAR_FRAMES: u64 = 20;

/// Remembers the last samples.
#[derive(Debug, Clone, Copy, Default)]
pub struct SensorWatch {
    last: Option<Measurements>,
    pressure_altitude_m: f64,
    barometer: Option<u64>,
    gnss: Option<u64>,
    lidar: Option<u64>,
}

impl SensorWatch {
    /// Takes a frame's measurements.
    pub fn take(&mut self, measurements: &Measurements, frame: u64) {
        self.last = Some(*measurements);
        if let Some(altitude_m) = measurements.pressure_altitude_m {
            self.pressure_altitude_m = altitude_m;
            self.barometer = Some(frame);
        }
        if measurements.gnss.is_some() {
            self.gnss = Some(frame);
        }
        if measurements.lidar_range_m.is_some() {
            self.lidar = Some(frame);
        }
    }

    /// The facts at a frame; `None` where no sensors are modelled.
    pub fn facts(&self, frame: u64) -> Option<SensorFacts> {
        let within = |at: Option<u64>, frames: u64| at.is_some_and(|at| frame.saturating_sub(at) <= frames);
        Some(SensorFacts {
            last: self.last?,
            pressure_altitude_m: self.pressure_altitude_m,
            barometer: within(self.barometer, BAROMETER_FRAMES),
            gnss: within(self.gnss, GNSS_FRAMES),
            lidar: within(self.lidar, LIDAR_FRAMES),
        })
    }
}

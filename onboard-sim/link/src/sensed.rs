//! What the sensors said last, and when.

use flight::estimation::estimator::Measurements;

/// A barometer that has been silent for so many frames does not report: a quarter of a second.
const BAROMETER_FRAMES: u64 = 50;
/// The same of the satellite receiver, which speaks five times a second: one second.
const GNSS_FRAMES: u64 = 200;
/// The same of the lidar: a tenth of a second. It reports only close to the ground.
const LIDAR_FRAMES: u64 = 20;

/// Keeps the last samples.
#[derive(Debug, Clone, Copy, Default)]
pub struct SensorWatch {
    /// The last frame's; `None` where no sensors are modelled.
    pub last: Option<Measurements>,
    /// Pressure height, m, when it last reported.
    pub pressure_altitude_m: f64,
    frame: u64,
    barometer: Option<u64>,
    gnss: Option<u64>,
    lidar: Option<u64>,
}

impl SensorWatch {
    /// Takes a frame's measurements; `None` if the sensors gave none.
    pub fn take(&mut self, measurements: Option<&Measurements>, frame: u64) {
        self.frame = frame;
        let Some(measurements) = measurements else { return };
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

    /// The barometer reports.
    pub fn barometer(&self) -> bool {
        self.within(self.barometer, BAROMETER_FRAMES)
    }

    /// The satellite receiver reports.
    pub fn gnss(&self) -> bool {
        self.within(self.gnss, GNSS_FRAMES)
    }

    /// The lidar reports.
    pub fn lidar(&self) -> bool {
        self.within(self.lidar, LIDAR_FRAMES)
    }

    fn within(&self, at: Option<u64>, frames: u64) -> bool {
        at.is_some_and(|at| self.frame.saturating_sub(at) <= frames)
    }
}

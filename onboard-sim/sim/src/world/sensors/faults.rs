//! Output of a broken sensor, in place of its measurement.

use flight::computer::FRAME_S;
use flight::estimation::estimator::{GRAVITY_M_S2, GnssFix, Measurements};
use nalgebra::Vector3;

use crate::world::normal::Normal;

/// A sensor that can break.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sensor {
    Gyro,
    Accelerometer,
    Barometer,
    Gnss,
    Lidar,
}

impl Sensor {
    /// All, with their names and units in the text of a fault.
    pub const ALL: [(Self, &'static str, &'static str); 5] = [
        (Self::Gyro, "gyro", "deg/s"),
        (Self::Accelerometer, "accelerometer", "mg"),
        (Self::Barometer, "barometer", "m"),
        (Self::Gnss, "gnss", "m"),
        (Self::Lidar, "lidar", "m"),
    ];
}

/// How it breaks. Values are in the sensor's unit: deg/s, thousandths of gravity, m; on every axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Defect {
    /// No output.
    Out,
    /// Zero.
    Dead,
    /// Repeats the last output.
    Stuck,
    /// NaN.
    NotANumber,
    /// This value in every frame.
    Blocked(f64),
    /// It is off by this.
    Step(f64),
    /// It is off by this much more in every second. Satellites show the velocity, too.
    Ramp(f64),
    /// It is off by this for a tenth of a second.
    Spike(f64),
    /// Additional noise of this standard deviation.
    Noise(f64),
    /// Its values are multiplied by this.
    Scale(f64),
    /// A receiver repeats its last motion as valid fixes for this time, s.
    Stale(f64),
}

/// How long a spike lasts, s.
const SPIKE_S: f64 = 0.1;

flight::with_defaults! {
    /// The broken sensors, in the order in which they broke.
    #[derive(Debug, Clone)]
    pub struct SensorFaults {
        broken: Vec<Broken> = Vec::new(),
        noise: Normal = Normal::new(0, 0, 1.0),
    }
}

#[derive(Debug, Clone)]
struct Broken {
    sensor: Sensor,
    defect: Defect,
    since_frames: u32,
    /// The repeated output of a stuck sensor, or a satellite fix with its velocity.
    held: Option<(Vector3<f64>, Vector3<f64>)>,
}

impl SensorFaults {
    /// A sensor breaks now.
    pub fn break_down(&mut self, sensor: Sensor, defect: Defect) {
        self.broken.push(Broken { sensor, defect, since_frames: 0, held: None });
    }

    /// The measurements of a frame as received by the computer.
    pub fn distort(&mut self, measured: &Measurements) -> Measurements {
        let mut distorted = *measured;
        let Self { broken, noise } = self;
        for broken in broken {
            broken.distort(&mut distorted, noise);
            broken.since_frames += 1;
        }
        distorted
    }
}

impl Broken {
    fn distort(&mut self, sample: &mut Measurements, noise: &mut Normal) {
        let none = Vector3::zeros();
        match self.sensor {
            Sensor::Gyro => {
                let output = self.output((sample.imu.gyro_rad_s, none), 1f64.to_radians(), noise);
                sample.imu.gyro_rad_s = output.map_or(SILENT_VALUE, |(rate_rad_s, _)| rate_rad_s);
            }
            Sensor::Accelerometer => {
                let output = self.output((sample.imu.specific_force_m_s2, none), 1e-3 * GRAVITY_M_S2, noise);
                sample.imu.specific_force_m_s2 = output.map_or(SILENT_VALUE, |(force_m_s2, _)| force_m_s2);
            }
            Sensor::Barometer => self.distort_one(&mut sample.pressure_altitude_m, noise),
            Sensor::Lidar => self.distort_one(&mut sample.lidar_range_m, noise),
            Sensor::Gnss => {
                sample.gnss = sample.gnss.and_then(|fix| {
                    let (position_m, velocity_m_s) =
                        self.output((fix.position_m, fix.velocity_m_s), 1.0, noise)?;
                    Some(GnssFix { position_m, velocity_m_s, ..fix })
                });
            }
        }
    }

    fn distort_one(&mut self, value: &mut Option<f64>, noise: &mut Normal) {
        let blocked = matches!(self.defect, Defect::Blocked(_)).then_some(0.0);
        *value = value.or(blocked).and_then(|value| {
            self.output((Vector3::from_element(value), Vector3::zeros()), 1.0, noise).map(|(one, _)| one.x)
        });
    }

    /// The output, and its rate of change per second, in place of the measurement; the defect's
    /// values are in this unit.
    fn output(
        &mut self,
        measured: (Vector3<f64>, Vector3<f64>),
        unit: f64,
        noise: &mut Normal,
    ) -> Option<(Vector3<f64>, Vector3<f64>)> {
        let every = |value: f64| Vector3::from_element(unit * value);
        let since_s = f64::from(self.since_frames) * FRAME_S;
        let (value, rate) = measured;
        Some(match self.defect {
            Defect::Out => return None,
            Defect::Dead => (Vector3::zeros(), Vector3::zeros()),
            Defect::Stuck => *self.held.get_or_insert(measured),
            Defect::NotANumber => (every(f64::NAN), every(f64::NAN)),
            Defect::Blocked(at) => (every(at), Vector3::zeros()),
            Defect::Step(off) => (value + every(off), rate),
            Defect::Ramp(off_s) => (value + every(off_s * since_s), rate + every(off_s)),
            Defect::Spike(off) if since_s < SPIKE_S => (value + every(off), rate),
            Defect::Spike(_) | Defect::Stale(_) => measured,
            Defect::Scale(factor) => (value * factor, rate * factor),
            Defect::Noise(sigma) => {
                (value + noise.next3() * (unit * sigma), rate + noise.next3() * (unit * sigma))
            }
        })
    }
}

/// Output of a silent inertial unit.
const SILENT_VALUE: Vector3<f64> = Vector3::new(f64::NAN, f64::NAN, f64::NAN);

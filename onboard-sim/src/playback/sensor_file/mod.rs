//! A file of recorded sensors, resampled to the frames of the flight computer.
//!
//! CSV with a header, 50 to 2,000 inertial samples a second. An empty cell or `nan` is no new
//! sample of that sensor; other columns are not read.
//!
//! | column | unit and frame |
//! |---|---|
//! | `time_s` | s, any origin; without it the rows are evenly spaced, and their rate is given |
//! | `gyro_x`, `gyro_y`, `gyro_z` | rotation rate, rad/s, axes of the inertial unit |
//! | `accel_x`, `accel_y`, `accel_z` | specific force, m/s^2, the same axes: +9.8 upwards at rest |
//! | `barometer` | height above the pad, m |
//! | `pressure_pa` | static pressure, Pa, where `barometer` has no sample; the first is the pad's |
//! | `gnss_x`, `gnss_y`, `gnss_z` | position from the pad, m; x and y level, z up, right-handed |
//! | `gnss_vx`, `gnss_vy`, `gnss_vz` | velocity, m/s, the same axes |
//! | `gnss_time_s` | time of validity of the fix, s, as `time_s`; without it the time of its row |
//! | `lidar` | range along the tail, m |
//! | `satellites` | number of satellites of the fix |
//! | `gnss_horizontal_m`, `gnss_vertical_m` | standard deviations of the fix, by the receiver, m |
//! | `gnss_speed_m_s` | standard deviation of its velocity, m/s |

use std::io::Read;
use std::ops::RangeInclusive;

use flight::computer::{FRAME_S, flight_time_s};
use flight::estimation::estimator::{FixQuality, GnssFix, ImuSample, Measurements};
use flight::vehicle::atmosphere::pressure_altitude_m;
use nalgebra::Vector3;

use super::axes::Axes;

/// Accepted rates of inertial samples, 1/s.
const RATES_HZ: RangeInclusive<f64> = 50.0..=2_000.0;
/// Longest time between two inertial samples, s. A logger that writes to its card pauses for tens
/// of milliseconds; over a longer pause no interpolated motion is the vehicle's.
const LONGEST_PAUSE_S: f64 = 0.1;
/// A sample this share of a frame after the frame's end still belongs to it: 5 us, the rounding of
/// time stamps.
const LATE_SHARE: f64 = 1e-3;
/// The columns that are read; of the first seven all but the time are required.
#[rustfmt::skip]
const COLUMNS: [&str; 21] = [
    "time_s", "gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z", "barometer", "pressure_pa",
    "gnss_x", "gnss_y", "gnss_z", "gnss_vx", "gnss_vy", "gnss_vz", "gnss_time_s", "lidar",
    "satellites", "gnss_horizontal_m", "gnss_vertical_m", "gnss_speed_m_s",
];

/// Why a file of recorded sensors cannot be played.
#[derive(Debug, thiserror::Error)]
pub enum SensorFileError {
    #[error(transparent)]
    Table(#[from] csv::Error),
    #[error("no column `{0}`; gyro_x to gyro_z (rad/s) and accel_x to accel_z (m/s2) are required")]
    NoColumn(&'static str),
    #[error("a column time_s or --rate HZ, 50 to 2000, is required, and not both")]
    Clock,
    #[error("line {line}: {column} is `{found}`; a number, `nan` or an empty cell is accepted")]
    Cell { line: u64, column: &'static str, found: String },
    #[error("line {line}: the time is {found_s} s, after {before_s} s; times must increase")]
    Order { line: u64, found_s: f64, before_s: f64 },
    #[error(
        "line {line}: {pause_s:.3} s after the last inertial sample; at most {LONGEST_PAUSE_S} s is accepted"
    )]
    Pause { line: u64, pause_s: f64 },
    #[error("lines 2 to {line}: {found_hz:.1} inertial samples a second; 50 to 2000 are accepted")]
    Rate { line: u64, found_hz: f64 },
}

/// The samples of a file, resampled.
#[derive(Debug, Clone, Default)]
pub struct RecordedSensors {
    /// The measurements of each frame; the first ends 5 ms after the first inertial sample, and
    /// fixes are on that clock.
    pub frames: Vec<Measurements>,
    /// Mean rate of the inertial samples, 1/s.
    pub rate_hz: f64,
    /// Longest time between two of them, s.
    pub longest_pause_s: f64,
}

/// Reads a file, whose rows have a rate, 1/s, if it has no time stamps, and resamples it: the
/// inertial samples that arrive in a frame are averaged, a frame without one is interpolated. Every
/// other sample belongs to the frame in which it arrives.
///
/// # Errors
/// A cell cannot be read, times do not increase, or the rate is not accepted; the message names the
/// line.
pub fn read(
    file: impl Read,
    row_rate_hz: Option<f64>,
    axes: Axes,
) -> Result<RecordedSensors, SensorFileError> {
    let mut table = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(file);
    let header = table.headers()?.clone();
    let places = COLUMNS.map(|column| header.iter().position(|name| name == column));
    if let Some(lacking) = (1..7).find(|column| places[*column].is_none()) {
        return Err(SensorFileError::NoColumn(COLUMNS[lacking]));
    }
    let timed = places[0].is_some();
    if row_rate_hz.map_or(!timed, |rate_hz| timed || !RATES_HZ.contains(&rate_hz)) {
        return Err(SensorFileError::Clock);
    }
    let mut resampler = Resampler::default();
    let (mut first_s, mut before_s, mut line) = (None, f64::NEG_INFINITY, 1);
    let (mut last_fix_s, mut pad_m) = (None, None);
    for (number, record) in table.records().enumerate() {
        let record = record?;
        line = number as u64 + 2;
        let mut cells = [f64::NAN; COLUMNS.len()];
        for ((cell, place), column) in cells.iter_mut().zip(places).zip(COLUMNS) {
            if let Some(text) = place.and_then(|place| record.get(place)).filter(|text| !text.is_empty()) {
                let wrong = |_| SensorFileError::Cell { line, column, found: text.to_owned() };
                *cell = text.parse().map_err(wrong)?;
            }
        }
        let [time_s, .., fix_s, lidar_m, satellites, horizontal_m, vertical_m, speed_m_s] = cells;
        let found_s = row_rate_hz.map_or(time_s, |rate_hz| number as f64 / rate_hz);
        if !found_s.is_finite() || found_s <= before_s {
            return Err(SensorFileError::Order { line, found_s, before_s });
        }
        before_s = found_s;
        let imu = vector(&cells[1..4]).zip(vector(&cells[4..7])).map(|(gyro, force)| ImuSample {
            gyro_rad_s: axes.to_body(&gyro),
            specific_force_m_s2: axes.to_body(&force),
        });
        // Frames begin with the first inertial sample.
        if first_s.is_none() && imu.is_none() {
            continue;
        }
        let first_s = *first_s.get_or_insert(found_s);
        let Some(frame) = resampler.take(found_s - first_s, imu, line)? else { continue };
        let by_pressure = finite(cells[8]).map(|pressure_pa| {
            let altitude_m = pressure_altitude_m(pressure_pa);
            altitude_m - *pad_m.get_or_insert(altitude_m)
        });
        frame.pressure_altitude_m = finite(cells[7]).or(by_pressure).or(frame.pressure_altitude_m);
        frame.lidar_range_m = finite(lidar_m).or(frame.lidar_range_m);
        let reported = |cell: f64| finite(cell).unwrap_or(0.0);
        let quality = FixQuality {
            satellites: reported(satellites) as u32,
            horizontal_m: reported(horizontal_m),
            vertical_m: reported(vertical_m),
            speed_m_s: reported(speed_m_s),
        };
        // A fix without a velocity has a NaN velocity, which passes no check and corrects nothing.
        let fix = vector(&cells[9..12]).map(|position_m| GnssFix {
            position_m,
            velocity_m_s: vector(&cells[12..15]).unwrap_or(Vector3::repeat(f64::NAN)),
            valid_at_s: finite(fix_s).unwrap_or(found_s) - first_s,
            quality,
        });
        // A logger that fills every row repeats the last fix with its time.
        if let Some(fix) = fix.filter(|fix| last_fix_s != Some(fix.valid_at_s)) {
            last_fix_s = Some(fix.valid_at_s);
            frame.gnss = Some(fix);
        }
    }
    resampler.finish(line)
}

fn finite(cell: f64) -> Option<f64> {
    cell.is_finite().then_some(cell)
}

fn vector(cells: &[f64]) -> Option<Vector3<f64>> {
    let vector = Vector3::from_column_slice(cells);
    vector.iter().all(|cell| cell.is_finite()).then_some(vector)
}

/// The frames so far.
#[derive(Default)]
struct Resampler {
    recorded: RecordedSensors,
    /// The frame of the newest inertial sample, and how many samples it has.
    newest_frame: usize,
    averaged: u32,
    /// That sample, its time since the first one, s, and how many there were.
    newest: Option<ImuSample>,
    newest_s: f64,
    samples: u64,
}

impl Resampler {
    /// Takes a row at a time since the first inertial sample, s. Returns its frame.
    fn take(
        &mut self,
        time_s: f64,
        imu: Option<ImuSample>,
        line: u64,
    ) -> Result<Option<&mut Measurements>, SensorFileError> {
        let Self { recorded: RecordedSensors { frames, longest_pause_s, .. }, .. } = self;
        let pause_s = time_s - self.newest_s;
        if pause_s > LONGEST_PAUSE_S {
            return Err(SensorFileError::Pause { line, pause_s });
        }
        *longest_pause_s = longest_pause_s.max(pause_s);
        let number = ((time_s / FRAME_S - LATE_SHARE).ceil() as usize).max(1);
        let Some(held) = imu.or(self.newest) else { return Ok(None) };
        frames.resize(frames.len().max(number), Measurements::of_imu(held));
        if let Some(imu) = imu {
            let newest = self.newest.unwrap_or(imu);
            for between in self.newest_frame + 1..number {
                let share = (flight_time_s(between as u64) - self.newest_s) / pause_s;
                frames[between - 1].imu = towards(&newest, &imu, share.clamp(0.0, 1.0));
            }
            self.averaged = if number == self.newest_frame { self.averaged + 1 } else { 1 };
            let mean = &mut frames[number - 1].imu;
            *mean = towards(mean, &imu, 1.0 / f64::from(self.averaged));
            (self.newest_frame, self.newest, self.newest_s) = (number, Some(imu), time_s);
            self.samples += 1;
        }
        Ok(frames.get_mut(number - 1))
    }

    fn finish(self, line: u64) -> Result<RecordedSensors, SensorFileError> {
        let Self { mut recorded, newest_frame, newest_s, samples, .. } = self;
        let rate_hz = if samples < 2 { 0.0 } else { (samples - 1) as f64 / newest_s };
        // Time stamps are rounded.
        if !RATES_HZ.contains(&rate_hz.round()) {
            return Err(SensorFileError::Rate { line, found_hz: rate_hz });
        }
        recorded.frames.truncate(newest_frame);
        Ok(RecordedSensors { rate_hz, ..recorded })
    }
}

/// The sample at this share of the distance from one to the other.
fn towards(from: &ImuSample, to: &ImuSample, share: f64) -> ImuSample {
    ImuSample {
        gyro_rad_s: from.gyro_rad_s.lerp(&to.gyro_rad_s, share),
        specific_force_m_s2: from.specific_force_m_s2.lerp(&to.specific_force_m_s2, share),
    }
}

#[cfg(test)]
mod tests;

//! A file of recorded sensors, resampled to the frames of the flight computer.
//!
//! CSV with a header, one row for each sample of the inertial unit, 50 to 2,000 a second. An empty cell or `nan` is no
//! new sample of that sensor; columns that are not listed here are not read.
//!
//! | column | unit and frame |
//! |---|---|
//! | `time_s` | s, any origin; without it the rows are evenly spaced, and their rate is given |
//! | `gyro_x`, `gyro_y`, `gyro_z` | rotation rate, rad/s, axes of the inertial unit |
//! | `accel_x`, `accel_y`, `accel_z` | specific force, m/s^2, the same axes: +9.8 upwards at rest |
//! | `barometer` | height above the pad, m |
//! | `pressure_pa` | static pressure, Pa; read where `barometer` has no sample, zeroed over the first second |
//! | `gnss_x`, `gnss_y`, `gnss_z` | position relative to the pad, m; x and y level, z up, right-handed |
//! | `gnss_vx`, `gnss_vy`, `gnss_vz` | velocity, m/s, the same axes |
//! | `gnss_time_s` | time of validity of the fix, s, the origin of `time_s`; without it the time of its row |
//! | `lidar` | range along the tail, m |

use std::io::Read;

use flight::computer::{FRAME_S, flight_time_s};
use flight::estimation::estimator::{GnssFix, ImuSample, Measurements};
use flight::vehicle::atmosphere::pressure_altitude_m;
use nalgebra::Vector3;
use serde::Deserialize;

use super::axes::Axes;

/// Accepted sample rates of the inertial unit, 1/s.
pub const RATES_HZ: std::ops::RangeInclusive<f64> = 50.0..=2_000.0;
/// Tolerance of the rate for rounded time stamps.
const RATE_TOLERANCE: f64 = 1e-3;
/// Longest time between two inertial samples, s. A logger that writes to its card pauses for tens of milliseconds; over
/// a longer pause no interpolated motion is the vehicle's.
const LONGEST_PAUSE_S: f64 = 0.1;
/// A sample this share of a frame after the frame's end still belongs to it: 5 us, the rounding of time stamps.
const LATE_SHARE: f64 = 1e-3;
/// Frames over which the pressure on the pad is averaged: one second.
const ZEROING_FRAMES: usize = 200;
/// Columns that every file has.
const REQUIRED: [&str; 6] = ["gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z"];

/// Why a file of recorded sensors cannot be played.
#[derive(Debug, thiserror::Error)]
pub enum SensorFileError {
    #[error("line {line}: {column} cannot be read: {why}; a number, `nan` or an empty cell is accepted")]
    Cell { line: u64, column: String, why: String },
    #[error("not a table: {0}; CSV with a header and as many cells in each row is accepted")]
    Table(csv::Error),
    #[error("no column `{0}`: gyro_x to gyro_z (rad/s) and accel_x to accel_z (m/s2) are required")]
    NoColumn(&'static str),
    #[error("no column `time_s`, and no rate of the rows: give --rate")]
    NoTime,
    #[error("it has a column `time_s`: leave out --rate")]
    TwoClocks,
    #[error("--rate {given_hz}: {} to {} rows a second are accepted", RATES_HZ.start(), RATES_HZ.end())]
    GivenRate { given_hz: f64 },
    #[error(
        "line {line}: time_s is {found}, after {before}; a time after that of the row before is accepted"
    )]
    Order { line: u64, found: f64, before: f64 },
    #[error(
        "line {line}: an inertial sample {pause_s:.3} s after the one before; at most {LONGEST_PAUSE_S} s is accepted"
    )]
    Pause { line: u64, pause_s: f64 },
    #[error(
        "lines 2 to {line}: {found_hz:.1} inertial samples a second; {} to {} are accepted",
        RATES_HZ.start(),
        RATES_HZ.end()
    )]
    Rate { line: u64, found_hz: f64 },
    #[error("fewer than two rows with gyro and accelerometer")]
    Empty,
}

/// The clock and the axes of a file.
#[derive(Debug, Clone, Copy, Default)]
pub struct Reading {
    /// Rate of the rows of a file without time stamps, 1/s.
    pub rate_hz: Option<f64>,
    pub axes: Axes,
}

/// The samples of a file, resampled.
#[derive(Debug, Clone)]
pub struct RecordedSensors {
    /// The measurements of each frame. Frame 1 ends 5 ms after the first row; fixes are on the clock of the frames.
    pub frames: Vec<Measurements>,
    /// Mean rate of the inertial samples, 1/s.
    pub rate_hz: f64,
    /// Longest time between two of them, s.
    pub longest_pause_s: f64,
}

/// A row as it is in the file.
#[derive(Deserialize)]
struct Row {
    time_s: Option<f64>,
    gyro_x: Option<f64>,
    gyro_y: Option<f64>,
    gyro_z: Option<f64>,
    accel_x: Option<f64>,
    accel_y: Option<f64>,
    accel_z: Option<f64>,
    barometer: Option<f64>,
    pressure_pa: Option<f64>,
    gnss_x: Option<f64>,
    gnss_y: Option<f64>,
    gnss_z: Option<f64>,
    gnss_vx: Option<f64>,
    gnss_vy: Option<f64>,
    gnss_vz: Option<f64>,
    gnss_time_s: Option<f64>,
    lidar: Option<f64>,
}

impl Row {
    fn imu(&self, axes: &Axes) -> Option<ImuSample> {
        Some(ImuSample {
            gyro_rad_s: axes.to_body(&vector([self.gyro_x, self.gyro_y, self.gyro_z])?),
            specific_force_m_s2: axes.to_body(&vector([self.accel_x, self.accel_y, self.accel_z])?),
        })
    }

    /// A fix without a velocity has one that is not a number, which passes no check and corrects nothing.
    fn fix(&self, arrived_s: f64, first_s: f64) -> Option<GnssFix> {
        Some(GnssFix {
            position_m: vector([self.gnss_x, self.gnss_y, self.gnss_z])?,
            velocity_m_s: vector([self.gnss_vx, self.gnss_vy, self.gnss_vz])
                .unwrap_or(Vector3::repeat(f64::NAN)),
            valid_at_s: finite(self.gnss_time_s).unwrap_or(arrived_s) - first_s,
        })
    }
}

fn finite(cell: Option<f64>) -> Option<f64> {
    cell.filter(|value| value.is_finite())
}

fn vector(cells: [Option<f64>; 3]) -> Option<Vector3<f64>> {
    let [x, y, z] = cells.map(finite);
    Some(Vector3::new(x?, y?, z?))
}

/// Reads a file and resamples it: the inertial samples that arrive in a frame are averaged, a frame without one is
/// interpolated; every other sample belongs to the frame in which it arrives.
///
/// # Errors
/// A cell cannot be read, times do not increase, or the rate is not accepted; the message names the line.
pub fn read(file: impl Read, reading: &Reading) -> Result<RecordedSensors, SensorFileError> {
    let mut table = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(file);
    let header = table.headers().map_err(SensorFileError::Table)?.clone();
    let has = |column: &str| header.iter().any(|name| name == column);
    if let Some(column) = REQUIRED.into_iter().find(|column| !has(column)) {
        return Err(SensorFileError::NoColumn(column));
    }
    match (has("time_s"), reading.rate_hz) {
        (false, None) => return Err(SensorFileError::NoTime),
        (true, Some(_)) => return Err(SensorFileError::TwoClocks),
        (_, Some(rate_hz)) if !RATES_HZ.contains(&rate_hz) => {
            return Err(SensorFileError::GivenRate { given_hz: rate_hz });
        }
        _ => {}
    }
    let mut resampler = Resampler::default();
    let (mut first_s, mut before_s, mut line) = (None, f64::NEG_INFINITY, 1);
    for (number, row) in table.deserialize::<Row>().enumerate() {
        let row = row.map_err(|error| unread(error, &header))?;
        line = number as u64 + 2;
        // A row without a time is at no time.
        let time_s =
            reading.rate_hz.map_or(row.time_s.unwrap_or(f64::NAN), |rate_hz| number as f64 / rate_hz);
        let after = time_s > before_s;
        if !after {
            return Err(SensorFileError::Order { line, found: time_s, before: before_s });
        }
        before_s = time_s;
        let imu = row.imu(&reading.axes);
        // Frames begin with the first inertial sample.
        if first_s.is_none() && imu.is_none() {
            continue;
        }
        let first_s = *first_s.get_or_insert(time_s);
        resampler.take(time_s - first_s, imu, line)?;
        resampler.take_aids(&row, row.fix(time_s, first_s));
    }
    resampler.finish(line)
}

fn unread(error: csv::Error, header: &csv::StringRecord) -> SensorFileError {
    match error.kind() {
        csv::ErrorKind::Deserialize { pos: Some(position), err } => SensorFileError::Cell {
            line: position.line(),
            column: err.field().and_then(|field| header.get(field as usize)).unwrap_or("a cell").to_owned(),
            why: err.kind().to_string(),
        },
        _ => SensorFileError::Table(error),
    }
}

/// The frames so far.
#[derive(Default)]
struct Resampler {
    frames: Vec<Measurements>,
    /// Number of the frame that the newest row belongs to.
    number: usize,
    /// The frame whose inertial samples are being summed, and how many they are.
    summed: (usize, u32),
    samples: u64,
    /// The newest inertial sample, and its time since the first one, s.
    newest_s: f64,
    newest: Option<ImuSample>,
    longest_pause_s: f64,
    /// Time of validity of the last fix, s.
    fix_s: Option<f64>,
    /// Some heights are still pressures, Pa, in these frames.
    pressures: Vec<usize>,
}

impl Resampler {
    /// Takes a row at a time since the first inertial sample, s.
    fn take(&mut self, time_s: f64, imu: Option<ImuSample>, line: u64) -> Result<(), SensorFileError> {
        let pause_s = time_s - self.newest_s;
        if pause_s > LONGEST_PAUSE_S {
            return Err(SensorFileError::Pause { line, pause_s });
        }
        self.longest_pause_s = self.longest_pause_s.max(pause_s);
        self.number = ((time_s / FRAME_S - LATE_SHARE).ceil() as usize).max(1);
        // Until their own samples come, frames hold the newest one.
        let Some(held) = imu.or(self.newest) else { return Ok(()) };
        self.frames.resize(self.frames.len().max(self.number), Measurements::of_imu(held));
        let Some(imu) = imu else { return Ok(()) };
        let (summed, count) = self.summed;
        if self.number == summed {
            let mean = &mut self.frames[summed - 1].imu;
            *mean = towards(mean, &imu, 1.0 / f64::from(count + 1));
            self.summed.1 += 1;
        } else {
            let newest = self.newest.unwrap_or(imu);
            for number in summed + 1..self.number {
                let share = (flight_time_s(number as u64) - self.newest_s) / (time_s - self.newest_s);
                self.frames[number - 1].imu = towards(&newest, &imu, share.clamp(0.0, 1.0));
            }
            self.frames[self.number - 1].imu = imu;
            self.summed = (self.number, 1);
        }
        (self.newest, self.newest_s) = (Some(imu), time_s);
        self.samples += 1;
        Ok(())
    }

    /// Takes the other sensors of the row: the newest sample of a frame counts. What a receiver says of its fix beside
    /// position and velocity (`gnss_fix_type`, `gnss_speed_accuracy_m_s` and others) belongs here, too.
    fn take_aids(&mut self, row: &Row, fix: Option<GnssFix>) {
        let frame = &mut self.frames[self.number - 1];
        if let Some(height_m) = finite(row.barometer) {
            frame.pressure_altitude_m = Some(height_m);
        } else if let Some(pressure_pa) = finite(row.pressure_pa) {
            frame.pressure_altitude_m = Some(pressure_altitude_m(pressure_pa));
            self.pressures.push(self.number - 1);
        }
        frame.lidar_range_m = finite(row.lidar).or(frame.lidar_range_m);
        // A logger that fills every row repeats the last fix with its time.
        if let Some(fix) = fix.filter(|fix| self.fix_s != Some(fix.valid_at_s)) {
            self.fix_s = Some(fix.valid_at_s);
            frame.gnss = Some(fix);
        }
    }

    fn finish(mut self, line: u64) -> Result<RecordedSensors, SensorFileError> {
        if self.samples < 2 {
            return Err(SensorFileError::Empty);
        }
        let rate_hz = (self.samples - 1) as f64 / self.newest_s;
        let accepted_hz = RATES_HZ.start() * (1.0 - RATE_TOLERANCE)..=RATES_HZ.end() * (1.0 + RATE_TOLERANCE);
        if !accepted_hz.contains(&rate_hz) {
            return Err(SensorFileError::Rate { line, found_hz: rate_hz });
        }
        self.frames.truncate(self.summed.0);
        self.zero_pressures();
        let Self { frames, longest_pause_s, .. } = self;
        Ok(RecordedSensors { frames, rate_hz, longest_pause_s })
    }

    /// Heights from pressures count from the mean of the first second, as on a board that is powered up on its pad.
    fn zero_pressures(&mut self) {
        let Self { frames, pressures, .. } = self;
        pressures.dedup();
        pressures.retain(|frame| *frame < frames.len());
        let heights: Vec<f64> =
            pressures.iter().filter_map(|frame| frames[*frame].pressure_altitude_m).collect();
        let first = pressures.first().copied().unwrap_or(0);
        let count = pressures.iter().take_while(|frame| **frame < first + ZEROING_FRAMES).count();
        let pad_m = heights.iter().take(count).sum::<f64>() / count as f64;
        for (frame, height_m) in pressures.iter().zip(heights) {
            frames[*frame].pressure_altitude_m = Some(height_m - pad_m);
        }
    }
}

/// The sample this share of the way from one to the other.
fn towards(from: &ImuSample, to: &ImuSample, share: f64) -> ImuSample {
    ImuSample {
        gyro_rad_s: from.gyro_rad_s + (to.gyro_rad_s - from.gyro_rad_s) * share,
        specific_force_m_s2: from.specific_force_m_s2
            + (to.specific_force_m_s2 - from.specific_force_m_s2) * share,
    }
}

#[cfg(test)]
mod tests;

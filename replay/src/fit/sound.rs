//! Consistency of the accelerometer with the rest of a log, which every scale of a fit rests on.
//!
//! A fit of drag and thrust explains any specific force, also that of a broken sensor. So the
//! velocity and height that follow from the force are compared with what does not depend on it:
//! satellite velocities, and the ground at contact.

use flight::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;
use nalgebra::Vector3;

use super::trace::{Frame, Trace};

/// Frames with one and the same sample: a working sensor has noise in every frame.
const REPEATED_FRAMES: usize = 10;
/// Longest pause between frames, s.
const PAUSE_MAX_S: f64 = 0.03;
/// Largest difference from two satellite velocities in a row, m/s.
const VELOCITY_MAX_M_S: f64 = 2.0;
/// Largest difference from the height of the ground at contact, m.
const HEIGHT_MAX_M: f64 = 5.0;

/// Checks the accelerometer's samples of consecutive frames; `is_burn` if contact ends them.
///
/// # Errors
/// The reason why the samples cannot be those of the vehicle.
pub(super) fn check(trace: &Trace, frames: &[Frame], is_burn: bool) -> Result<(), String> {
    if let Some(at_s) = repeats_at_s(frames) {
        return Err(format!("the accelerometer repeats one sample from T+{at_s:.2} s on"));
    }
    if let Some([before, after]) = pause(frames) {
        let missing_s = after.time_s - before.time_s;
        return Err(format!(
            "{missing_s:.2} s of frames are missing from T+{:.2} s on: the flight computer was restarted, or records are lost",
            before.time_s
        ));
    }
    let path = dead_reckoned(frames);
    if let Some((at_s, off_m_s)) = off_satellites(frames, &path) {
        return Err(format!(
            "the accelerometer contradicts the satellites: at T+{at_s:.2} s its velocity is {off_m_s:.1} m/s off"
        ));
    }
    let off_m = off_ground_m(trace, &path).filter(|off_m| is_burn && off_m.abs() > HEIGHT_MAX_M);
    off_m.map_or(Ok(()), |off_m| {
        Err(format!("the accelerometer contradicts the ground: at contact its height is {off_m:+.1} m off"))
    })
}

fn repeats_at_s(frames: &[Frame]) -> Option<f64> {
    let force = |frame: &Frame| frame.measured.imu.specific_force_m_s2;
    let same = |frames: &&[Frame]| frames.iter().all(|frame| force(frame) == force(&frames[0]));
    frames.windows(REPEATED_FRAMES).find(same).map(|frames| frames[0].time_s)
}

fn pause(frames: &[Frame]) -> Option<[&Frame; 2]> {
    let mut pairs = frames.windows(2).map(|pair| [&pair[0], &pair[1]]);
    pairs.find(|[before, after]| after.time_s - before.time_s > PAUSE_MAX_S)
}

/// A state that follows from the first estimate and the specific force alone.
#[derive(Clone, Copy)]
struct Reckoned {
    time_s: f64,
    velocity_m_s: Vector3<f64>,
    height_m: f64,
}

fn dead_reckoned(frames: &[Frame]) -> Vec<Reckoned> {
    let Some(first) = frames.first() else { return Vec::new() };
    let bias_m_s2 = first.estimate.accelerometer_bias_m_s2;
    let mut now = Reckoned {
        time_s: first.time_s,
        velocity_m_s: first.estimate.state.velocity_m_s,
        height_m: first.estimate.state.position_m.z,
    };
    let mut path = vec![now];
    path.extend(frames.windows(2).map(|pair| {
        let force_m_s2 = pair[1].measured.imu.specific_force_m_s2 - bias_m_s2;
        let attitudes = [0, 1].map(|place| pair[place].estimate.state.world_from_body * force_m_s2);
        let gravity_m_s2 = Vector3::z() * STANDARD_GRAVITY_M_S2;
        let step_s = pair[1].time_s - pair[0].time_s;
        let gained_m_s = ((attitudes[0] + attitudes[1]) * 0.5 - gravity_m_s2) * step_s;
        now.height_m += (now.velocity_m_s.z + 0.5 * gained_m_s.z) * step_s;
        now.velocity_m_s += gained_m_s;
        now.time_s = pair[1].time_s;
        now
    }));
    path
}

/// Time of the largest difference between two fixes in a row and the path, s, and its size, m/s;
/// `None` if it is within [`VELOCITY_MAX_M_S`]. A single fix may be an outlier.
fn off_satellites(frames: &[Frame], path: &[Reckoned]) -> Option<(f64, f64)> {
    let fixes = frames.iter().filter_map(|frame| frame.measured.gnss.as_ref());
    let off: Vec<(f64, f64)> = fixes
        .filter_map(|fix| {
            let place = path.partition_point(|state| state.time_s < fix.valid_at_s);
            let state = path.get(place).filter(|_| place > 0)?;
            Some((fix.valid_at_s, (fix.velocity_m_s - state.velocity_m_s).norm()))
        })
        .collect();
    let least = |pair: &[(f64, f64)]| (pair[0].0, pair[0].1.min(pair[1].1));
    let worst = off.windows(2).map(least).max_by(|one, other| one.1.total_cmp(&other.1));
    worst.filter(|(_, off_m_s)| *off_m_s > VELOCITY_MAX_M_S)
}

/// Height of the feet by the path when the log has the contact, m.
fn off_ground_m(trace: &Trace, path: &[Reckoned]) -> Option<f64> {
    let last = path.last()?;
    let contact = trace.frames.iter().find(|frame| frame.contact && frame.time_s > last.time_s)?;
    let height_m = last.height_m + last.velocity_m_s.z * (contact.time_s - last.time_s);
    let cg_station_m = trace.mission.airframe.mass.loaded_cg_station_m;
    Some(height_m - trace.mission.airframe.above_feet_m(cg_station_m))
}

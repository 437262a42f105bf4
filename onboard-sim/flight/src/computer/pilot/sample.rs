//! A pilot about to fall, with inputs for it, for the tests of these modules.

use nalgebra::Vector3;

use super::Pilot;
use crate::computer::table::PhaseTable;
use crate::computer::{Computer, Input, LogState, SensedInput};
use crate::estimation::estimator::{ImuSample, Measurements, StartUncertainty};
use crate::rules::arming::Uplink;
use crate::vehicle::rigid::RigidState;

/// A phase table right after the release.
pub(super) fn released() -> PhaseTable {
    let mission = crate::vehicles::mission::builtin("mk2").unwrap().unwrap();
    let computer = Computer::at_power_up(&mission, &RigidState::upright(300.0));
    computer.released(0).table
}

/// The pilot of mk2, upright at rest, 300 m up.
pub(super) fn falling() -> Pilot {
    let mission = crate::vehicles::mission::builtin("mk2").unwrap().unwrap();
    Pilot::starting(&mission, 0.0, &RigidState::upright(300.0), &StartUncertainty::at_apogee())
}

/// A frame's input without requests, rehearsal and plan.
pub(crate) fn alone(sensed: &SensedInput) -> Input<'static> {
    Input { sensed: *sensed, requests: &[], rehearsed: None, plan_ready: false }
}

/// The input of a frame with almost no specific force, turning at a rate, of a computer that was
/// released at once.
pub(crate) fn input(frame: u64, gyro_rad_s: f64) -> SensedInput {
    let imu = ImuSample {
        gyro_rad_s: Vector3::new(0.0, gyro_rad_s, 0.0),
        specific_force_m_s2: Vector3::new(0.1, 0.0, 0.0),
    };
    SensedInput {
        frame,
        time_s: 0.005 * frame as f64,
        measured: Measurements::of_imu(imu),
        igniter_continuity: true,
        pin_out: true,
        log: LogState { running: true, space_bytes: u64::MAX },
        uplink: Uplink::NotNeeded,
        ..SensedInput::default()
    }
}

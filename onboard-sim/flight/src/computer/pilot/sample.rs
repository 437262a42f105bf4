//! A pilot about to fall, and inputs for it: for the tests of these modules.

use nalgebra::Vector3;

use super::{Pilot, PilotInput, Sensed};
use crate::computer::Computer;
use crate::computer::table::PhaseTable;
use crate::estimation::estimator::{ImuSample, Measurements, StartUncertainty};
use crate::guidance::baseline::Law;
use crate::vehicle::rigid::RigidState;

/// A phase table as it is right after the release.
pub(super) fn released() -> PhaseTable {
    let mission = crate::vehicles::mission::builtin("mk2").unwrap().unwrap();
    let computer = Computer::at_power_up(&mission, Law::Nmpc, &RigidState::upright(300.0));
    computer.released().into_table()
}

/// The pilot of mk2, upright at rest, 300 m up.
pub(super) fn falling() -> Pilot {
    let mission = crate::vehicles::mission::builtin("mk2").unwrap().unwrap();
    Pilot::starting(&mission, 0.0, &RigidState::upright(300.0), &StartUncertainty::at_apogee())
}

/// The input of a frame with almost no specific force, turning at a rate.
pub(in crate::computer) fn input(frame: u64, gyro_rad_s: f64) -> PilotInput {
    let imu = ImuSample {
        gyro_rad_s: Vector3::new(0.0, gyro_rad_s, 0.0),
        specific_force_m_s2: Vector3::new(0.1, 0.0, 0.0),
    };
    let measured = Measurements { imu, pressure_altitude_m: None, gnss: None, lidar_range_m: None };
    PilotInput {
        frame,
        time_s: 0.005 * frame as f64,
        sensed: Sensed::Measured(measured),
        fins_rad: [0.0; 4],
        contact: false,
        igniter_continuity: true,
        booster_attached: false,
        abort: false,
    }
}

//! Converts the pilot's frames between its own types and log records, bit for bit.

use flight::computer::pilot::{BoosterCommands, PilotInput, PilotOutput, Sensed};
use flight::estimation::estimator::{
    Doubt, Estimate, GnssFix, Health, HeightSources, ImuSample, Measurements, Sigmas,
};
use flight::estimation::motor_estimate::MotorEstimate;
use flight::guidance::powered::ControlLevel;
use flight::rules::phase::Phase;
use flight::vehicle::rigid::RigidState;
use log_records::flight_v1 as v1;
use nalgebra::{Quaternion, UnitQuaternion, Vector2, Vector3};

/// Why a recorded frame cannot be given to this build's pilot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum PilotLogError {
    /// A number has no meaning in this build.
    #[error("frame {frame}: {what} {found} is unknown; this build knows 0 to {most}")]
    Unknown {
        frame: u64,
        /// The meaning of the number.
        what: &'static str,
        /// The number.
        found: u32,
        /// The largest known number.
        most: usize,
    },
    /// A list has the wrong length.
    #[error("frame {frame}: {what} has {found} values and should have {should}")]
    Length {
        frame: u64,
        what: &'static str,
        /// The length found.
        found: usize,
        /// The length that it should have.
        should: usize,
    },
    /// Neither measurements nor a known state, or both.
    #[error("frame {frame}: needs measurements or a known state, and one of them only")]
    Sensed { frame: u64 },
}

const DOUBTS: [Doubt; 7] = [
    Doubt::Restarted,
    Doubt::Imu,
    Doubt::Surprised,
    Doubt::Velocity,
    Doubt::Height,
    Doubt::Horizontal,
    Doubt::Tilt,
];

/// A vector as a record.
pub fn vector_to_log(vector: &Vector3<f64>) -> v1::Vector3 {
    v1::Vector3 { x: vector.x, y: vector.y, z: vector.z }
}

/// A recorded vector.
pub fn vector_from_log(vector: &v1::Vector3) -> Vector3<f64> {
    Vector3::new(vector.x, vector.y, vector.z)
}

/// A state as a record.
pub fn state_to_log(state: &RigidState) -> v1::RigidState {
    let attitude = state.world_from_body.quaternion();
    v1::RigidState {
        position_m: vector_to_log(&state.position_m),
        velocity_m_s: vector_to_log(&state.velocity_m_s),
        world_from_body: v1::Quaternion { w: attitude.w, x: attitude.i, y: attitude.j, z: attitude.k },
        rate_rad_s: vector_to_log(&state.rate_rad_s),
    }
}

/// A recorded state.
pub fn state_from_log(state: &v1::RigidState) -> RigidState {
    let attitude = &state.world_from_body;
    RigidState {
        position_m: vector_from_log(&state.position_m),
        velocity_m_s: vector_from_log(&state.velocity_m_s),
        // It had length 1 when it was written; normalising it again could change a bit.
        world_from_body: UnitQuaternion::new_unchecked(Quaternion::new(
            attitude.w, attitude.x, attitude.y, attitude.z,
        )),
        rate_rad_s: vector_from_log(&state.rate_rad_s),
    }
}

/// Measurements as a record.
pub fn measurements_to_log(measurements: &Measurements) -> v1::Measurements {
    v1::Measurements {
        gyro_rad_s: vector_to_log(&measurements.imu.gyro_rad_s),
        specific_force_m_s2: vector_to_log(&measurements.imu.specific_force_m_s2),
        pressure_altitude_m: measurements.pressure_altitude_m,
        gnss: measurements.gnss.as_ref().map(|fix| v1::GnssFix {
            position_m: vector_to_log(&fix.position_m),
            velocity_m_s: vector_to_log(&fix.velocity_m_s),
            valid_at_s: fix.valid_at_s,
        }),
        lidar_range_m: measurements.lidar_range_m,
    }
}

/// Recorded measurements.
pub fn measurements_from_log(measurements: &v1::Measurements) -> Measurements {
    Measurements {
        imu: ImuSample {
            gyro_rad_s: vector_from_log(&measurements.gyro_rad_s),
            specific_force_m_s2: vector_from_log(&measurements.specific_force_m_s2),
        },
        pressure_altitude_m: measurements.pressure_altitude_m,
        gnss: measurements.gnss.as_ref().map(|fix| GnssFix {
            position_m: vector_from_log(&fix.position_m),
            velocity_m_s: vector_from_log(&fix.velocity_m_s),
            valid_at_s: fix.valid_at_s,
        }),
        lidar_range_m: measurements.lidar_range_m,
    }
}

/// An estimate as a record.
pub fn estimate_to_log(estimate: &Estimate) -> v1::Estimate {
    let sigmas = &estimate.sigmas;
    let health = match estimate.health {
        Health::Good => 0,
        Health::Doubtful(doubt) => {
            1 + DOUBTS.iter().position(|known| *known == doubt).unwrap_or(DOUBTS.len()) as u32
        }
    };
    v1::Estimate {
        time_s: estimate.time_s,
        state: state_to_log(&estimate.state),
        specific_force_m_s2: vector_to_log(&estimate.specific_force_m_s2),
        wind_x_m_s: estimate.wind_m_s.x,
        wind_y_m_s: estimate.wind_m_s.y,
        gyro_bias_rad_s: vector_to_log(&estimate.gyro_bias_rad_s),
        accelerometer_bias_m_s2: vector_to_log(&estimate.accelerometer_bias_m_s2),
        sigmas: v1::Sigmas {
            position_m: vector_to_log(&sigmas.position_m),
            velocity_m_s: vector_to_log(&sigmas.velocity_m_s),
            attitude_rad: vector_to_log(&sigmas.attitude_rad),
            gyro_bias_rad_s: vector_to_log(&sigmas.gyro_bias_rad_s),
            accelerometer_bias_m_s2: vector_to_log(&sigmas.accelerometer_bias_m_s2),
            wind_x_m_s: sigmas.wind_m_s.x,
            wind_y_m_s: sigmas.wind_m_s.y,
        },
        inertial_height_m: estimate.heights.inertial_m,
        inertial_height_sigma_m: estimate.heights.inertial_sigma_m,
        barometric_height_m: estimate.heights.barometric_m,
        health,
        motor: None,
    }
}

/// The motor's estimate as a record; none before ignition.
pub fn motor_to_log(motor: &MotorEstimate) -> Option<v1::MotorEstimate> {
    let ignition_s = motor.ignition_s()?;
    let [
        impulse_scale_sigma,
        burn_time_scale_sigma,
        ignition_sigma_s,
        air_scale_sigma,
        shape_deviation_sigma,
    ] = motor.sigmas();
    Some(v1::MotorEstimate {
        impulse_scale: motor.impulse_scale(),
        burn_time_scale: motor.burn_time_stretch(),
        ignition_s,
        air_scale: motor.air_scale(),
        shape_deviation: motor.shape_deviation(),
        impulse_scale_sigma,
        burn_time_scale_sigma,
        ignition_sigma_s,
        air_scale_sigma,
        shape_deviation_sigma,
    })
}

/// The recorded estimate of a frame.
///
/// # Errors
/// This build does not know its health.
pub fn estimate_from_log(estimate: &v1::Estimate, frame: u64) -> Result<Estimate, PilotLogError> {
    let sigmas = &estimate.sigmas;
    let found = estimate.health;
    let unknown = PilotLogError::Unknown { frame, what: "health", found, most: DOUBTS.len() };
    let health = match found.checked_sub(1) {
        None => Health::Good,
        Some(index) => Health::Doubtful(*DOUBTS.get(index as usize).ok_or(unknown)?),
    };
    Ok(Estimate {
        time_s: estimate.time_s,
        state: state_from_log(&estimate.state),
        specific_force_m_s2: vector_from_log(&estimate.specific_force_m_s2),
        wind_m_s: Vector2::new(estimate.wind_x_m_s, estimate.wind_y_m_s),
        gyro_bias_rad_s: vector_from_log(&estimate.gyro_bias_rad_s),
        accelerometer_bias_m_s2: vector_from_log(&estimate.accelerometer_bias_m_s2),
        sigmas: Sigmas {
            position_m: vector_from_log(&sigmas.position_m),
            velocity_m_s: vector_from_log(&sigmas.velocity_m_s),
            attitude_rad: vector_from_log(&sigmas.attitude_rad),
            gyro_bias_rad_s: vector_from_log(&sigmas.gyro_bias_rad_s),
            accelerometer_bias_m_s2: vector_from_log(&sigmas.accelerometer_bias_m_s2),
            wind_m_s: Vector2::new(sigmas.wind_x_m_s, sigmas.wind_y_m_s),
        },
        heights: HeightSources {
            inertial_m: estimate.inertial_height_m,
            inertial_sigma_m: estimate.inertial_height_sigma_m,
            barometric_m: estimate.barometric_height_m,
        },
        health,
    })
}

/// A frame's input as a record.
pub fn input_to_log(input: &PilotInput) -> v1::PilotInput {
    let (measured, known) = match &input.sensed {
        Sensed::Measured(measurements) => (Some(measurements_to_log(measurements)), None),
        Sensed::Known(estimate) => (None, Some(estimate_to_log(estimate))),
    };
    v1::PilotInput {
        frame: input.frame,
        time_s: input.time_s,
        measured,
        known,
        fins_rad: input.fins_rad.to_vec(),
        contact: input.contact,
        igniter_continuity: input.igniter_continuity,
        abort: input.abort,
        booster_attached: input.booster_attached.then_some(true),
    }
}

/// A recorded input.
///
/// # Errors
/// This build does not know some value of it.
pub fn input_from_log(input: &v1::PilotInput) -> Result<PilotInput, PilotLogError> {
    let frame = input.frame;
    let sensed = match (&input.measured, &input.known) {
        (Some(measurements), None) => Sensed::Measured(measurements_from_log(measurements)),
        (None, Some(estimate)) => Sensed::Known(estimate_from_log(estimate, frame)?),
        _ => return Err(PilotLogError::Sensed { frame }),
    };
    Ok(PilotInput {
        frame,
        time_s: input.time_s,
        sensed,
        fins_rad: list(&input.fins_rad, frame, "fin angles")?,
        contact: input.contact,
        igniter_continuity: input.igniter_continuity,
        abort: input.abort,
        booster_attached: input.booster_attached.unwrap_or(false),
    })
}

/// A frame's output as a record.
pub fn output_to_log(output: &PilotOutput) -> v1::PilotOutput {
    v1::PilotOutput {
        gimbal_rad: output.gimbal_rad.to_vec(),
        fins_rad: output.fins_rad.to_vec(),
        ignite: output.ignite,
        parachute: output.parachute,
        phase: u32::from(output.phase.index()),
        level: u32::from(output.level.index()),
        ignite_booster: output.booster.ignite.then_some(true),
        separate_booster: output.booster.separate.then_some(true),
    }
}

/// The recorded output of a frame.
///
/// # Errors
/// This build does not know some value of it.
pub fn output_from_log(output: &v1::PilotOutput, frame: u64) -> Result<PilotOutput, PilotLogError> {
    let unknown = |what, found, known: usize| PilotLogError::Unknown { frame, what, found, most: known - 1 };
    let phase = u8::try_from(output.phase).ok().and_then(Phase::from_index);
    let level = ControlLevel::ALL.get(output.level as usize).copied();
    Ok(PilotOutput {
        gimbal_rad: list(&output.gimbal_rad, frame, "gimbal angles")?,
        fins_rad: list(&output.fins_rad, frame, "fin angles")?,
        ignite: output.ignite,
        parachute: output.parachute,
        phase: phase.ok_or_else(|| unknown("phase", output.phase, Phase::ALL.len()))?,
        level: level.ok_or_else(|| unknown("control level", output.level, ControlLevel::ALL.len()))?,
        booster: BoosterCommands {
            ignite: output.ignite_booster.unwrap_or(false),
            separate: output.separate_booster.unwrap_or(false),
        },
    })
}

pub(crate) fn list<const N: usize>(
    values: &[f64],
    frame: u64,
    what: &'static str,
) -> Result<[f64; N], PilotLogError> {
    let wrong = |_| PilotLogError::Length { frame, what, found: values.len(), should: N };
    values.try_into().map_err(wrong)
}

/// A whole frame as a record. `state_digest` is the pilot's [digest](flight::computer::pilot::Pilot::digest) after it.
pub fn tick_to_log(input: &PilotInput, output: &PilotOutput, state_digest: u64) -> v1::PilotTick {
    v1::PilotTick { input: input_to_log(input), output: output_to_log(output), state_digest }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use prost::Message as _;

    /// Any bit pattern: NaN payloads, both zeros, infinities, subnormals.
    fn any_bits() -> impl Strategy<Value = f64> {
        prop_oneof![any::<u64>().prop_map(f64::from_bits), Just(0.0), Just(-0.0), Just(f64::NAN)]
    }

    fn vector(numbers: &[f64], from: usize) -> Vector3<f64> {
        Vector3::from_fn(|axis, _| numbers[from + axis])
    }

    fn state(numbers: &[f64]) -> RigidState {
        RigidState {
            position_m: vector(numbers, 0),
            velocity_m_s: vector(numbers, 3),
            world_from_body: UnitQuaternion::new_unchecked(Quaternion::new(
                numbers[6], numbers[7], numbers[8], numbers[9],
            )),
            rate_rad_s: vector(numbers, 10),
        }
    }

    fn estimate(numbers: &[f64], health: usize) -> Estimate {
        Estimate {
            time_s: numbers[13],
            state: state(numbers),
            specific_force_m_s2: vector(numbers, 14),
            wind_m_s: Vector2::new(numbers[17], numbers[18]),
            gyro_bias_rad_s: vector(numbers, 19),
            accelerometer_bias_m_s2: vector(numbers, 22),
            sigmas: Sigmas {
                position_m: vector(numbers, 25),
                velocity_m_s: vector(numbers, 28),
                attitude_rad: vector(numbers, 31),
                gyro_bias_rad_s: vector(numbers, 34),
                accelerometer_bias_m_s2: vector(numbers, 37),
                wind_m_s: Vector2::new(numbers[40], numbers[41]),
            },
            heights: HeightSources {
                inertial_m: numbers[42],
                inertial_sigma_m: numbers[43],
                barometric_m: health.is_multiple_of(2).then_some(numbers[44]),
            },
            health: health.checked_sub(1).map_or(Health::Good, |doubt| Health::Doubtful(DOUBTS[doubt])),
        }
    }

    fn measurements(numbers: &[f64], there: [bool; 3]) -> Measurements {
        let fix = || GnssFix {
            position_m: vector(numbers, 6),
            velocity_m_s: vector(numbers, 9),
            valid_at_s: numbers[12],
        };
        Measurements {
            imu: ImuSample { gyro_rad_s: vector(numbers, 0), specific_force_m_s2: vector(numbers, 3) },
            pressure_altitude_m: there[0].then_some(numbers[13]),
            gnss: there[1].then(fix),
            lidar_range_m: there[2].then_some(numbers[14]),
        }
    }

    proptest! {
        #[test]
        fn a_frame_survives_the_log_bit_for_bit(
            frame: u64,
            numbers in prop::collection::vec(any_bits(), 56),
            there: [bool; 3],
            flags: [bool; 7],
            health in 0..=DOUBTS.len(),
            phase in 0..Phase::ALL.len(),
            level in 0..ControlLevel::ALL.len(),
        ) {
            let sensed = if flags[3] {
                Sensed::Measured(measurements(&numbers, there))
            } else {
                Sensed::Known(estimate(&numbers, health))
            };
            let input = PilotInput {
                frame,
                time_s: numbers[45],
                sensed,
                fins_rad: [46, 47, 48, 49].map(|place: usize| numbers[place]),
                contact: flags[0],
                igniter_continuity: flags[1],
                abort: flags[2],
                booster_attached: flags[4],
            };
            let output = PilotOutput {
                gimbal_rad: [numbers[50], numbers[51]],
                fins_rad: [52, 53, 54, 55].map(|place: usize| numbers[place]),
                ignite: flags[1],
                parachute: flags[2],
                phase: Phase::ALL[phase],
                level: ControlLevel::ALL[level],
                booster: BoosterCommands { ignite: flags[5], separate: flags[6] },
            };
            let bytes = tick_to_log(&input, &output, frame).encode_to_vec();
            let read = v1::PilotTick::decode(bytes.as_slice()).unwrap();
            let (input_read, output_read) =
                (input_from_log(&read.input).unwrap(), output_from_log(&read.output, frame).unwrap());
            // Compared as bytes as well, because a NaN never equals itself.
            prop_assert_eq!(tick_to_log(&input_read, &output_read, frame).encode_to_vec(), bytes);
            prop_assert_eq!(input_read.time_s.to_bits(), input.time_s.to_bits());
            prop_assert_eq!((input_read.frame, input_read.booster_attached), (frame, flags[4]));
            prop_assert_eq!(output_read.booster, output.booster);
            prop_assert_eq!((output_read.phase, output_read.level), (output.phase, output.level));
        }
    }

    #[test]
    fn an_unknown_value_is_refused_with_its_number() {
        let output = v1::PilotOutput {
            gimbal_rad: vec![0.0; 2],
            fins_rad: vec![0.0; 4],
            phase: 13,
            ..v1::PilotOutput::default()
        };
        let error = output_from_log(&output, 7).unwrap_err().to_string();
        assert_eq!(error, "frame 7: phase 13 is unknown; this build knows 0 to 12");
        let error = output_from_log(&v1::PilotOutput { fins_rad: vec![0.0], ..output }, 7).unwrap_err();
        assert_eq!(error.to_string(), "frame 7: fin angles has 1 values and should have 4");
        let error = input_from_log(&v1::PilotInput { frame: 8, ..v1::PilotInput::default() }).unwrap_err();
        assert_eq!(error, PilotLogError::Sensed { frame: 8 });
    }
}

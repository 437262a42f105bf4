//! Converts states, measurements and estimates between the flight computer's types and log records, bit for bit.

use flight::computer::pilot::Pilot;
use flight::estimation::estimator::{
    Doubt, Estimate, GnssFix, Health, HeightSources, ImuSample, Measurements, Sigmas,
};
use flight::estimation::motor_estimate::MotorEstimate;
use flight::vehicle::rigid::RigidState;
use nalgebra::{Quaternion, UnitQuaternion, Vector2, Vector3};
use protocol::records::flight_v1 as v1;

/// Why a recorded frame cannot be given to this build's flight computer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum RecordError {
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

/// What the pilot thought after a frame: its estimate, with the motor's. `None` before it has one.
pub fn thought_to_log(pilot: &Pilot) -> Option<v1::Estimate> {
    let estimate = pilot.estimate()?;
    Some(v1::Estimate { motor: motor_to_log(pilot.motor()), ..estimate_to_log(estimate) })
}

/// The motor's estimate as a record; none before ignition.
fn motor_to_log(motor: &MotorEstimate) -> Option<v1::MotorEstimate> {
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
pub fn estimate_from_log(estimate: &v1::Estimate, frame: u64) -> Result<Estimate, RecordError> {
    let sigmas = &estimate.sigmas;
    let found = estimate.health;
    let unknown = RecordError::Unknown { frame, what: "health", found, most: DOUBTS.len() };
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

pub(crate) fn list<const N: usize>(
    values: &[f64],
    frame: u64,
    what: &'static str,
) -> Result<[f64; N], RecordError> {
    let wrong = |_| RecordError::Length { frame, what, found: values.len(), should: N };
    values.try_into().map_err(wrong)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use proptest::prelude::*;
    use prost::Message as _;

    /// Any bit pattern: NaN payloads, both zeros, infinities, subnormals.
    pub(crate) fn any_bits() -> impl Strategy<Value = f64> {
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
        fn an_estimate_and_measurements_survive_the_log_bit_for_bit(
            frame: u64,
            numbers in prop::collection::vec(any_bits(), 45),
            there: [bool; 3],
            health in 0..=DOUBTS.len(),
        ) {
            // Compared as bytes, because a NaN never equals itself.
            let bytes = estimate_to_log(&estimate(&numbers, health)).encode_to_vec();
            let read = estimate_from_log(&v1::Estimate::decode(bytes.as_slice()).unwrap(), frame).unwrap();
            prop_assert_eq!(estimate_to_log(&read).encode_to_vec(), bytes);
            let bytes = measurements_to_log(&measurements(&numbers, there)).encode_to_vec();
            let read = measurements_from_log(&v1::Measurements::decode(bytes.as_slice()).unwrap());
            prop_assert_eq!(measurements_to_log(&read).encode_to_vec(), bytes);
            prop_assert_eq!(read.imu.gyro_rad_s.x.to_bits(), numbers[0].to_bits());
        }
    }
}

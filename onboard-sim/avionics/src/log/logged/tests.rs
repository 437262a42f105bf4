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
        health: HEALTHS[health],
    }
}

fn measurements(numbers: &[f64], there: [bool; 3]) -> Measurements {
    let fix = || GnssFix {
        position_m: vector(numbers, 6),
        velocity_m_s: vector(numbers, 9),
        valid_at_s: numbers[12],
        quality: FixQuality {
            satellites: 9,
            horizontal_m: numbers[6],
            vertical_m: numbers[7],
            speed_m_s: numbers[8],
        },
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
        health in 0..HEALTHS.len(),
    ) {
        let at = At { frame, field: "" };
        // Compared as bytes, because a NaN never equals itself.
        let bytes = estimate(&numbers, health).to_log().encode_to_vec();
        let read = Estimate::from_log(&flight_v1::Estimate::decode(bytes.as_slice()).unwrap(), at).unwrap();
        prop_assert_eq!(read.to_log().encode_to_vec(), bytes);
        let bytes = measurements(&numbers, there).to_log().encode_to_vec();
        let read = Measurements::from_log(&flight_v1::Measurements::decode(bytes.as_slice()).unwrap(), at).unwrap();
        prop_assert_eq!(read.to_log().encode_to_vec(), bytes);
        prop_assert_eq!(read.imu.gyro_rad_s.x.to_bits(), numbers[0].to_bits());
    }
}

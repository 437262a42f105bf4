//! Where the vehicle is and how it moves: attitude as angles and the position on the globe, for the maps and
//! instruments of other clients, and descent, estimator and sensors of the rocket in space.

use flight::computer::pilot::ApogeeAhead;
use flight::estimation::estimator::{Doubt, Health};
use protocol::dialect::{
    ATTITUDE_DATA, ESTIMATOR_STATUS_DATA, EstimatorStatusFlags, GLOBAL_POSITION_INT_DATA, GPS_RAW_INT_DATA,
    GpsFixType, HIGHRES_IMU_DATA, HOME_POSITION_DATA, HighresImuUpdatedFlags, MavMessage, MavSysStatusSensor,
    SYSTEM_TIME_DATA, TD_DESCENT_DATA, TdBooster, TdChute,
};

use super::boot_ms;
use crate::snapshot::{Booster, Chute, DescentFacts, Snapshot};

/// Sine of pitch above which roll and heading are the same rotation: above 0.99999 (0.26 degrees from upright) single
/// precision cannot separate them.
const UPRIGHT_SINE: f64 = 0.999_99;

/// Roll, pitch and yaw, rad, of a rotation from the body to north-east-down. Upright, roll and yaw are the same
/// rotation, and all of it counts as yaw.
fn roll_pitch_yaw_rad([w, x, y, z]: &[f64; 4]) -> [f64; 3] {
    let sine = 2.0 * (w * y - x * z);
    if sine.abs() > UPRIGHT_SINE {
        let up = libm::copysign(1.0, sine);
        return [0.0, up * core::f64::consts::FRAC_PI_2, wrapped_rad(-2.0 * up * libm::atan2(*x, *w))];
    }
    [
        libm::atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
        libm::asin(sine),
        libm::atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)),
    ]
}

/// The same angle between minus and plus half a turn.
fn wrapped_rad(angle_rad: f64) -> f64 {
    libm::atan2(libm::sin(angle_rad), libm::cos(angle_rad))
}

/// The compass heading of the vehicle, degrees from north over east, 0 to 360. If the nose is steeper than 45 degrees,
/// the heading is that of the belly, as for an aircraft that has pitched up from that heading.
pub(super) fn heading_deg([w, x, y, z]: &[f64; 4]) -> f64 {
    let nose = [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z)];
    let belly = [2.0 * (x * z + w * y), 2.0 * (y * z - w * x)];
    let nose_down = 2.0 * (x * z - w * y);
    let [north, east] = match nose_down {
        steep if steep < -core::f64::consts::FRAC_1_SQRT_2 => belly,
        steep if steep > core::f64::consts::FRAC_1_SQRT_2 => belly.map(|part| -part),
        _ => nose,
    };
    let heading_deg = libm::atan2(east, north).to_degrees();
    if heading_deg < 0.0 { heading_deg + 360.0 } else { heading_deg }
}

pub(super) fn attitude(snapshot: &Snapshot) -> MavMessage {
    let [roll, pitch, yaw] = roll_pitch_yaw_rad(&snapshot.motion.ned_from_body).map(|angle| angle as f32);
    let [rollspeed, pitchspeed, yawspeed] = snapshot.motion.rate_rad_s.map(|rate| rate as f32);
    MavMessage::ATTITUDE(ATTITUDE_DATA {
        time_boot_ms: boot_ms(snapshot.time_s),
        roll,
        pitch,
        yaw,
        rollspeed,
        pitchspeed,
        yawspeed,
    })
}

/// Latitude and longitude, 1e-7 degrees, of a point at this distance north and east of the pad, m.
fn degrees_e7(snapshot: &Snapshot, north_m: f64, east_m: f64) -> (i32, i32) {
    let (latitude_deg, longitude_deg) = snapshot.site.at_deg(north_m, east_m);
    (libm::round(1e7 * latitude_deg) as i32, libm::round(1e7 * longitude_deg) as i32)
}

fn millimetres(length_m: f64) -> i32 {
    libm::round(1000.0 * length_m) as i32
}

pub(super) fn position(snapshot: &Snapshot) -> MavMessage {
    let [north_m, east_m, down_m] = snapshot.motion.position_m;
    let [vx, vy, vz] = snapshot.motion.velocity_m_s.map(|speed_m_s| libm::round(100.0 * speed_m_s) as i16);
    let (lat, lon) = degrees_e7(snapshot, north_m, east_m);
    MavMessage::GLOBAL_POSITION_INT(GLOBAL_POSITION_INT_DATA {
        time_boot_ms: boot_ms(snapshot.time_s),
        lat,
        lon,
        alt: millimetres(snapshot.pad_altitude_m - down_m),
        relative_alt: millimetres(-down_m),
        vx,
        vy,
        vz,
        hdg: libm::round(100.0 * heading_deg(&snapshot.motion.ned_from_body)) as u16 % 36_000,
    })
}

/// The pad. The slope of the ground and the approach direction are unknown.
pub(super) fn home(snapshot: &Snapshot) -> MavMessage {
    let (latitude, longitude) = degrees_e7(snapshot, 0.0, 0.0);
    MavMessage::HOME_POSITION(HOME_POSITION_DATA {
        latitude,
        longitude,
        altitude: millimetres(snapshot.pad_altitude_m),
        x: 0.0,
        y: 0.0,
        z: 0.0,
        q: [f32::NAN; 4],
        approach_x: f32::NAN,
        approach_y: f32::NAN,
        approach_z: f32::NAN,
        time_usec: (1e6 * snapshot.time_s) as u64,
    })
}

/// GPS_RAW_INT: whether the satellite receiver reports. Its position is the estimated one, because single fixes are not
/// kept. A vehicle without sensors has no receiver.
pub(super) fn gps(snapshot: &Snapshot) -> MavMessage {
    let [north_m, east_m, down_m] = snapshot.motion.position_m;
    let [north_m_s, east_m_s, _] = snapshot.motion.velocity_m_s;
    let (lat, lon) = degrees_e7(snapshot, north_m, east_m);
    let course_deg = libm::atan2(east_m_s, north_m_s).to_degrees();
    let fix_type = match &snapshot.sensors {
        None => GpsFixType::GPS_FIX_TYPE_NO_GPS,
        Some(sensors) if sensors.gnss => GpsFixType::GPS_FIX_TYPE_3D_FIX,
        Some(_) => GpsFixType::GPS_FIX_TYPE_NO_FIX,
    };
    let unknown = GPS_RAW_INT_DATA {
        time_usec: (1e6 * snapshot.time_s) as u64,
        eph: u16::MAX,
        epv: u16::MAX,
        vel: u16::MAX,
        cog: u16::MAX,
        fix_type,
        satellites_visible: u8::MAX,
        ..GPS_RAW_INT_DATA::default()
    };
    MavMessage::GPS_RAW_INT(if fix_type == GpsFixType::GPS_FIX_TYPE_3D_FIX {
        GPS_RAW_INT_DATA {
            lat,
            lon,
            alt: millimetres(snapshot.pad_altitude_m - down_m),
            vel: libm::round(100.0 * libm::hypot(north_m_s, east_m_s)) as u16,
            cog: libm::round(100.0 * if course_deg < 0.0 { course_deg + 360.0 } else { course_deg }) as u16
                % 36_000,
            ..unknown
        }
    } else {
        unknown
    })
}

/// No clock on board knows the time of day, so the field is zero, as the standard requires.
pub(super) fn system_time(snapshot: &Snapshot) -> MavMessage {
    MavMessage::SYSTEM_TIME(SYSTEM_TIME_DATA { time_unix_usec: 0, time_boot_ms: boot_ms(snapshot.time_s) })
}

// Messages of the rocket in space only: descent, estimator, sensors.

/// The sensors that exist, and those that are silent. The lidar works only close to the ground, so its silence means
/// nothing.
pub(super) fn sensors(snapshot: &Snapshot) -> (MavSysStatusSensor, MavSysStatusSensor) {
    use MavSysStatusSensor as S;
    let mut silent = S::empty();
    let Some(sensors) = &snapshot.sensors else { return (silent, silent) };
    let present = S::MAV_SYS_STATUS_SENSOR_3D_GYRO
        | S::MAV_SYS_STATUS_SENSOR_3D_ACCEL
        | S::MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE
        | S::MAV_SYS_STATUS_SENSOR_GPS
        | S::MAV_SYS_STATUS_SENSOR_LASER_POSITION;
    silent.set(S::MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE, !sensors.barometer);
    silent.set(S::MAV_SYS_STATUS_SENSOR_GPS, !sensors.gnss);
    (present, silent)
}

pub(super) fn descent(snapshot: &Snapshot) -> Option<MavMessage> {
    let descent = snapshot.descent.as_ref()?;
    let known = |value: Option<f64>| value.map_or(f32::NAN, |value| value as f32);
    let [wind_x_m_s, wind_y_m_s] = descent.wind_m_s.map(|speed| speed as f32);
    let [touchdown_x_m, touchdown_y_m] = descent.touchdown_m.map(|place| place as f32);
    Some(MavMessage::TD_DESCENT(TD_DESCENT_DATA {
        time_boot_ms: boot_ms(snapshot.time_s),
        height_m: descent.height_m as f32,
        vertical_speed_m_s: descent.vertical_m_s as f32,
        band_low_m: known(descent.band_m.map(|(low_m, _)| low_m)),
        band_high_m: known(descent.band_m.map(|(_, high_m)| high_m)),
        chosen_height_m: known(descent.chosen_m),
        commit_height_m: descent.commit_height_m as f32,
        time_to_ignition_s: known(descent.ignition_in_s),
        wind_x_m_s,
        wind_y_m_s,
        drag_scale: descent.drag_scale as f32,
        thrust_scale: descent.thrust_scale as f32,
        touchdown_x_m,
        touchdown_y_m,
        chute: match descent.chute {
            Chute::Stowed => TdChute::TD_CHUTE_STOWED,
            Chute::Fired => TdChute::TD_CHUTE_FIRED,
            Chute::Open => TdChute::TD_CHUTE_OPEN,
        },
        booster: booster(descent.ascent.map(|ascent| ascent.booster)),
        apogee_m: on_the_way_up(descent, |apogee| apogee.height_m),
        time_to_apogee_s: on_the_way_up(descent, |apogee| apogee.in_s),
    }))
}

fn booster(booster: Option<Booster>) -> TdBooster {
    match booster {
        None => TdBooster::TD_BOOSTER_NONE,
        Some(Booster::Attached) => TdBooster::TD_BOOSTER_ATTACHED,
        Some(Booster::Separating) => TdBooster::TD_BOOSTER_SEPARATING,
        Some(Booster::Separated) => TdBooster::TD_BOOSTER_SEPARATED,
    }
}

/// A value of the apogee ahead. Zeros at the end of a message are not sent, so a descent costs nothing.
fn on_the_way_up(descent: &DescentFacts, read: impl Fn(&ApogeeAhead) -> f64) -> f32 {
    match descent.ascent.filter(|ascent| !ascent.over) {
        None => 0.0,
        Some(ascent) => ascent.apogee.as_ref().map_or(f32::NAN, |apogee| read(apogee) as f32),
    }
}

/// The outputs that are valid, by the estimator's own doubts; its test ratios are not kept and are sent as unknown.
pub(super) fn estimator(snapshot: &Snapshot) -> Option<MavMessage> {
    use EstimatorStatusFlags as F;
    let estimator = snapshot.estimator.as_ref()?;
    let (velocity, horizontal, vertical) = (
        F::ESTIMATOR_VELOCITY_HORIZ | F::ESTIMATOR_VELOCITY_VERT,
        F::ESTIMATOR_POS_HORIZ_REL | F::ESTIMATOR_POS_HORIZ_ABS,
        F::ESTIMATOR_POS_VERT_ABS,
    );
    let mut flags = F::ESTIMATOR_ATTITUDE | velocity | horizontal | vertical;
    match estimator.health {
        Health::Good => {}
        Health::Doubtful(Doubt::Restarted) => flags = F::empty(),
        Health::Doubtful(Doubt::Imu) => flags = F::ESTIMATOR_ACCEL_ERROR,
        Health::Doubtful(Doubt::Surprised) => flags = (flags - velocity) | F::ESTIMATOR_GPS_GLITCH,
        Health::Doubtful(Doubt::Velocity) => flags -= velocity,
        Health::Doubtful(Doubt::Height) => flags -= vertical,
        Health::Doubtful(Doubt::Horizontal) => flags -= horizontal,
        Health::Doubtful(Doubt::Tilt) => flags -= F::ESTIMATOR_ATTITUDE,
    }
    let lidar = snapshot.sensors.as_ref().is_some_and(|sensors| sensors.lidar);
    flags.set(F::ESTIMATOR_POS_VERT_AGL, lidar && flags.contains(vertical));
    Some(MavMessage::ESTIMATOR_STATUS(ESTIMATOR_STATUS_DATA {
        time_usec: (1e6 * snapshot.time_s) as u64,
        flags,
        vel_ratio: f32::NAN,
        pos_horiz_ratio: f32::NAN,
        pos_vert_ratio: f32::NAN,
        mag_ratio: f32::NAN,
        hagl_ratio: f32::NAN,
        tas_ratio: f32::NAN,
        pos_horiz_accuracy: estimator.horizontal_sigma_m as f32,
        pos_vert_accuracy: estimator.height_sigma_m as f32,
    }))
}

/// There is no magnetometer and no thermometer: their fields are not marked as updated.
pub(super) fn imu(snapshot: &Snapshot) -> Option<MavMessage> {
    use HighresImuUpdatedFlags as U;
    let sensors = snapshot.sensors.as_ref()?;
    let mut fields_updated = U::HIGHRES_IMU_UPDATED_XACC
        | U::HIGHRES_IMU_UPDATED_YACC
        | U::HIGHRES_IMU_UPDATED_ZACC
        | U::HIGHRES_IMU_UPDATED_XGYRO
        | U::HIGHRES_IMU_UPDATED_YGYRO
        | U::HIGHRES_IMU_UPDATED_ZGYRO;
    fields_updated.set(U::HIGHRES_IMU_UPDATED_PRESSURE_ALT, sensors.barometer);
    let imu = &sensors.last.imu;
    let [xacc, yacc, zacc] = <[f64; 3]>::from(imu.specific_force_m_s2).map(|force| force as f32);
    let [xgyro, ygyro, zgyro] = <[f64; 3]>::from(imu.gyro_rad_s).map(|rate| rate as f32);
    Some(MavMessage::HIGHRES_IMU(HIGHRES_IMU_DATA {
        time_usec: (1e6 * snapshot.time_s) as u64,
        xacc,
        yacc,
        zacc,
        xgyro,
        ygyro,
        zgyro,
        pressure_alt: sensors.pressure_altitude_m as f32,
        fields_updated,
        ..HIGHRES_IMU_DATA::default()
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Yaw, then pitch, then roll, degrees.
    fn ned_from_body(yaw_deg: f64, pitch_deg: f64, roll_deg: f64) -> [f64; 4] {
        let turn = nalgebra::UnitQuaternion::from_euler_angles(
            roll_deg.to_radians(),
            pitch_deg.to_radians(),
            yaw_deg.to_radians(),
        );
        [turn.w, turn.i, turn.j, turn.k]
    }

    fn close(found: f64, expected: f64) -> bool {
        // The shorter way around.
        let off = (found - expected).rem_euclid(360.0);
        off.min(360.0 - off) < 1e-6
    }

    #[test]
    fn angles_are_recovered_from_the_rotation() {
        for (yaw, pitch, roll) in
            [(0.0, 0.0, 0.0), (30.0, 20.0, -40.0), (-120.0, 80.0, 10.0), (170.0, -60.0, 5.0)]
        {
            let found = roll_pitch_yaw_rad(&ned_from_body(yaw, pitch, roll)).map(f64::to_degrees);
            let expected = [roll, pitch, yaw];
            assert!(found.iter().zip(expected).all(|(found, expected)| close(*found, expected)), "{found:?}");
        }
    }

    #[test]
    fn upright_there_is_no_roll_and_the_yaw_is_what_is_left() {
        for (yaw, pitch) in [(0.0, 90.0), (75.0, 90.0), (-160.0, 90.0), (75.0, -90.0)] {
            let found = roll_pitch_yaw_rad(&ned_from_body(yaw, pitch, 0.0)).map(f64::to_degrees);
            assert!(close(found[0], 0.0) && close(found[1], pitch) && close(found[2], yaw), "{found:?}");
        }
    }

    #[test]
    fn the_heading_is_the_compass_s_at_every_pitch() {
        for yaw in [0.0, 75.0, 200.0, 359.0] {
            for pitch in [-90.0, -50.0, -10.0, 0.0, 44.0, 46.0, 85.0, 90.0] {
                let found = heading_deg(&ned_from_body(yaw, pitch, 0.0));
                assert!(close(found, yaw), "yaw {yaw}, pitch {pitch}: {found}");
            }
        }
        // A rocket that leans over backwards does not change its heading.
        assert!(close(heading_deg(&ned_from_body(75.0 + 180.0, 80.0, 180.0)), 75.0));
    }
}

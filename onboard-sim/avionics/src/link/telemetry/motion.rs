//! Where the vehicle is and how it moves: attitude as angles and the position on the globe, for the
//! maps and instruments of other clients, and descent, estimator and sensors of the rocket in
//! space.

use flight::computer::pilot::ApogeeAhead;
use flight::estimation::estimator::{Health, HealthIssue};
use flight::rules::outputs::PyroOutput;
use flight::rules::phase::Phase;
use flight::vehicle::mission::StartPoint;
use protocol::dialect::{
    ATTITUDE_DATA, ESTIMATOR_STATUS_DATA, EstimatorStatusFlags, GLOBAL_POSITION_INT_DATA, GPS_RAW_INT_DATA,
    GpsFixType, HIGHRES_IMU_DATA, HOME_POSITION_DATA, HighresImuUpdatedFlags, MavMessage, MavSysStatusSensor,
    SYSTEM_TIME_DATA, TD_DESCENT_DATA, TdBooster, TdChute,
};

use super::boot_ms;
use crate::link::vehicle::{Airborne, VehicleState, pad_of};

/// Sine of pitch above which roll and heading are the same rotation: above 0.99999 (0.26 degrees
/// from upright) single precision cannot separate them.
const UPRIGHT_SINE: f64 = 0.999_99;

/// Roll, pitch and yaw, rad, of a rotation from the body to north-east-down. Upright, roll and yaw
/// are the same rotation, and all of it counts as yaw.
fn roll_pitch_yaw_rad([w, x, y, z]: &[f64; 4]) -> [f64; 3] {
    let sine = 2.0 * (w * y - x * z);
    if sine.abs() > UPRIGHT_SINE {
        let up = libm::copysign(1.0, sine);
        let turned_rad = -2.0 * up * libm::atan2(*x, *w);
        let yaw_rad = libm::atan2(libm::sin(turned_rad), libm::cos(turned_rad));
        return [0.0, up * core::f64::consts::FRAC_PI_2, yaw_rad];
    }
    [
        libm::atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
        libm::asin(sine),
        libm::atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)),
    ]
}

/// The compass heading of the vehicle, degrees from north over east, 0 to 360. If the nose is
/// steeper than 45 degrees, the heading is that of the belly, as for an aircraft that has pitched
/// up from that heading.
pub(super) fn heading_deg([w, x, y, z]: &[f64; 4]) -> f64 {
    let nose = [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z)];
    let belly = [2.0 * (x * z + w * y), 2.0 * (y * z - w * x)];
    let nose_down = 2.0 * (x * z - w * y);
    let [north, east] = match nose_down {
        steep if steep < -core::f64::consts::FRAC_1_SQRT_2 => belly,
        steep if steep > core::f64::consts::FRAC_1_SQRT_2 => belly.map(|part| -part),
        _ => nose,
    };
    compass_deg(north, east)
}

/// The direction of a vector from north over east, degrees, 0 to 360.
fn compass_deg(north: f64, east: f64) -> f64 {
    let deg = libm::atan2(east, north).to_degrees();
    if deg < 0.0 { deg + 360.0 } else { deg }
}

pub(super) fn attitude(state: &VehicleState<'_>) -> MavMessage {
    let motion = state.motion();
    let [roll, pitch, yaw] = roll_pitch_yaw_rad(&motion.ned_from_body).map(|angle| angle as f32);
    let [rollspeed, pitchspeed, yawspeed] = motion.rate_rad_s.map(|rate| rate as f32);
    MavMessage::ATTITUDE(ATTITUDE_DATA {
        time_boot_ms: boot_ms(state.time_s),
        roll,
        pitch,
        yaw,
        rollspeed,
        pitchspeed,
        yawspeed,
    })
}

/// Latitude and longitude, 1e-7 degrees, of a point at this distance north and east of the pad, m.
fn degrees_e7(state: &VehicleState<'_>, north_m: f64, east_m: f64) -> (i32, i32) {
    let at = pad_of(state.mission()).moved(north_m, east_m);
    (libm::round(1e7 * at.latitude) as i32, libm::round(1e7 * at.longitude) as i32)
}

fn millimetres(length_m: f64) -> i32 {
    libm::round(1000.0 * length_m) as i32
}

pub(super) fn position(state: &VehicleState<'_>) -> MavMessage {
    let motion = state.motion();
    let [north_m, east_m, down_m] = motion.position_m;
    let [vx, vy, vz] = motion.velocity_m_s.map(|speed_m_s| libm::round(100.0 * speed_m_s) as i16);
    let (lat, lon) = degrees_e7(state, north_m, east_m);
    MavMessage::GLOBAL_POSITION_INT(GLOBAL_POSITION_INT_DATA {
        time_boot_ms: boot_ms(state.time_s),
        lat,
        lon,
        alt: millimetres(state.mission().site.altitude_m - down_m),
        relative_alt: millimetres(-down_m),
        vx,
        vy,
        vz,
        hdg: libm::round(100.0 * heading_deg(&motion.ned_from_body)) as u16 % 36_000,
    })
}

/// The pad. The slope of the ground and the approach direction are unknown.
pub(super) fn home(state: &VehicleState<'_>) -> MavMessage {
    let (latitude, longitude) = degrees_e7(state, 0.0, 0.0);
    MavMessage::HOME_POSITION(HOME_POSITION_DATA {
        latitude,
        longitude,
        altitude: millimetres(state.mission().site.altitude_m),
        x: 0.0,
        y: 0.0,
        z: 0.0,
        q: [f32::NAN; 4],
        approach_x: f32::NAN,
        approach_y: f32::NAN,
        approach_z: f32::NAN,
        time_usec: (1e6 * state.time_s) as u64,
    })
}

/// GPS_RAW_INT: whether the satellite receiver reports. Its position is the estimated one, because
/// single fixes are not stored.
pub(super) fn gps(state: &VehicleState<'_>) -> MavMessage {
    let mut gps = GPS_RAW_INT_DATA {
        time_usec: (1e6 * state.time_s) as u64,
        eph: u16::MAX,
        epv: u16::MAX,
        vel: u16::MAX,
        cog: u16::MAX,
        fix_type: GpsFixType::GPS_FIX_TYPE_NO_FIX,
        satellites_visible: u8::MAX,
        ..GPS_RAW_INT_DATA::default()
    };
    if state.computer.sensors().gnss_speaks() {
        let motion = state.motion();
        let [north_m, east_m, down_m] = motion.position_m;
        let [north_m_s, east_m_s, _] = motion.velocity_m_s;
        gps.fix_type = GpsFixType::GPS_FIX_TYPE_3D_FIX;
        (gps.lat, gps.lon) = degrees_e7(state, north_m, east_m);
        gps.alt = millimetres(state.mission().site.altitude_m - down_m);
        gps.vel = libm::round(100.0 * libm::hypot(north_m_s, east_m_s)) as u16;
        gps.cog = libm::round(100.0 * compass_deg(north_m_s, east_m_s)) as u16 % 36_000;
    }
    MavMessage::GPS_RAW_INT(gps)
}

/// No clock on board has the time of day, so the field is zero, as the standard requires.
pub(super) fn system_time(state: &VehicleState<'_>) -> MavMessage {
    MavMessage::SYSTEM_TIME(SYSTEM_TIME_DATA { time_unix_usec: 0, time_boot_ms: boot_ms(state.time_s) })
}

// Messages of the rocket in space only: descent, estimator, sensors.

/// The sensors that exist, and those that are silent. The lidar works only close to the ground, so
/// its silence means nothing.
pub(super) fn sensors(state: &VehicleState<'_>) -> (MavSysStatusSensor, MavSysStatusSensor) {
    use MavSysStatusSensor as S;
    let mut silent = S::empty();
    let sensors = state.computer.sensors();
    let present = S::MAV_SYS_STATUS_SENSOR_3D_GYRO
        | S::MAV_SYS_STATUS_SENSOR_3D_ACCEL
        | S::MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE
        | S::MAV_SYS_STATUS_SENSOR_GPS
        | S::MAV_SYS_STATUS_SENSOR_LASER_POSITION;
    silent.set(S::MAV_SYS_STATUS_SENSOR_3D_ACCEL, sensors.accelerometer_frozen_s().is_some());
    silent.set(S::MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE, sensors.pressure_altitude_m().is_none());
    silent.set(S::MAV_SYS_STATUS_SENSOR_GPS, !sensors.gnss_speaks());
    (present, silent)
}

pub(super) fn descent(state: &VehicleState<'_>, boot_number: u32) -> Option<MavMessage> {
    let air = state.airborne()?;
    let phase = state.phase();
    let pilot = state.computer.pilot();
    let (prediction, motor) = (pilot.prediction(), pilot.motor());
    let ignition = &prediction.ignition;
    let known = |value: Option<f64>| value.map_or(f32::NAN, |value| value as f32);
    let touchdown_m = state.touchdown_m(&air);
    let ascends = state.mission().start.at == StartPoint::Pad;
    let apogee = pilot.apogee_ahead(phase);
    // Zeros at the end of a message are not sent, so a descent costs nothing.
    let on_the_way_up = |value: fn(ApogeeAhead) -> f64| {
        if ascends && phase.before_apogee() { known(apogee.map(value)) } else { 0.0 }
    };
    Some(MavMessage::TD_DESCENT(TD_DESCENT_DATA {
        boot_number,
        time_boot_ms: boot_ms(state.time_s),
        height_m: air.height_m() as f32,
        vertical_speed_m_s: air.estimate.state.velocity_m_s.z as f32,
        band_low_m: known(ignition.band.map(|band| band.low_m)),
        band_high_m: known(ignition.band.map(|band| band.high_m)),
        chosen_height_m: known(ignition.chosen_m),
        commit_height_m: prediction.commit_height_m as f32,
        time_to_ignition_s: known(ignition.command_in_s.filter(|_| phase.in_descent())),
        // North is x, east is against y.
        wind_x_m_s: air.estimate.wind_m_s.x as f32,
        wind_y_m_s: -air.estimate.wind_m_s.y as f32,
        drag_scale: motor.air_scale() as f32,
        thrust_scale: state.computer.pilot().motor().impulse_scale() as f32,
        touchdown_x_m: touchdown_m.x as f32,
        touchdown_y_m: -touchdown_m.y as f32,
        chute: chute(state, &air),
        booster: if ascends { booster(state, &air) } else { TdBooster::TD_BOOSTER_NONE },
        apogee_m: on_the_way_up(|apogee| apogee.height_m),
        time_to_apogee_s: on_the_way_up(|apogee| apogee.in_s),
    }))
}

fn chute(state: &VehicleState<'_>, air: &Airborne<'_>) -> TdChute {
    match state.phase() {
        Phase::Chute if state.is_carried(air) => TdChute::TD_CHUTE_OPEN,
        Phase::Chute => TdChute::TD_CHUTE_FIRED,
        // Also on the ground, after a descent under it.
        _ if state.parachute_ejected => TdChute::TD_CHUTE_OPEN,
        _ => TdChute::TD_CHUTE_STOWED,
    }
}

fn booster(state: &VehicleState<'_>, air: &Airborne<'_>) -> TdBooster {
    let separating = state.computer.commands().outputs.is_on(PyroOutput::Separation);
    match (air.flown.booster_attached, separating) {
        (true, false) => TdBooster::TD_BOOSTER_ATTACHED,
        (true, true) => TdBooster::TD_BOOSTER_SEPARATING,
        (false, _) => TdBooster::TD_BOOSTER_SEPARATED,
    }
}

/// The valid outputs, by the estimator's health, and the innovation of each sensor's last
/// measurement relative to its gate.
pub(super) fn estimator(state: &VehicleState<'_>) -> Option<MavMessage> {
    use EstimatorStatusFlags as F;
    let estimate = state.airborne()?.estimate;
    let sigmas_m = &estimate.sigmas.position_m;
    let aids = state.computer.pilot().estimator().aids();
    let (velocity, horizontal, vertical) = (
        F::ESTIMATOR_VELOCITY_HORIZ | F::ESTIMATOR_VELOCITY_VERT,
        F::ESTIMATOR_POS_HORIZ_REL | F::ESTIMATOR_POS_HORIZ_ABS,
        F::ESTIMATOR_POS_VERT_ABS,
    );
    let mut flags = F::ESTIMATOR_ATTITUDE | velocity | horizontal | vertical;
    match estimate.health {
        Health::Good => {}
        Health::Unhealthy(HealthIssue::Restarted) => flags = F::empty(),
        Health::Unhealthy(HealthIssue::Imu) => flags = F::ESTIMATOR_ACCEL_ERROR,
        Health::Unhealthy(HealthIssue::Surprised) => flags = (flags - velocity) | F::ESTIMATOR_GPS_GLITCH,
        Health::Unhealthy(HealthIssue::Velocity) => flags -= velocity,
        Health::Unhealthy(HealthIssue::Height) => flags -= vertical,
        Health::Unhealthy(HealthIssue::Horizontal) => flags -= horizontal,
        Health::Unhealthy(HealthIssue::Tilt) => flags -= F::ESTIMATOR_ATTITUDE,
    }
    let lidar = state.computer.sensors().lidar_range_m().is_some();
    flags.set(F::ESTIMATOR_POS_VERT_AGL, lidar && flags.contains(vertical));
    Some(MavMessage::ESTIMATOR_STATUS(ESTIMATOR_STATUS_DATA {
        time_usec: (1e6 * state.time_s) as u64,
        flags,
        vel_ratio: aids.gnss_velocity.test_ratio as f32,
        pos_horiz_ratio: aids.gnss_position.test_ratio as f32,
        pos_vert_ratio: aids.barometer.test_ratio as f32,
        mag_ratio: f32::NAN,
        hagl_ratio: aids.lidar.test_ratio as f32,
        tas_ratio: f32::NAN,
        pos_horiz_accuracy: sigmas_m.xy().max() as f32,
        pos_vert_accuracy: sigmas_m.z as f32,
    }))
}

/// There is no magnetometer and no thermometer: their fields are not marked as updated.
pub(super) fn imu(state: &VehicleState<'_>) -> MavMessage {
    use HighresImuUpdatedFlags as U;
    let imu = state.input().measured.imu;
    let pressure_altitude_m = state.computer.sensors().pressure_altitude_m();
    let mut fields_updated = U::HIGHRES_IMU_UPDATED_XACC
        | U::HIGHRES_IMU_UPDATED_YACC
        | U::HIGHRES_IMU_UPDATED_ZACC
        | U::HIGHRES_IMU_UPDATED_XGYRO
        | U::HIGHRES_IMU_UPDATED_YGYRO
        | U::HIGHRES_IMU_UPDATED_ZGYRO;
    fields_updated.set(U::HIGHRES_IMU_UPDATED_PRESSURE_ALT, pressure_altitude_m.is_some());
    let [xacc, yacc, zacc] = <[f64; 3]>::from(imu.specific_force_m_s2).map(|force| force as f32);
    let [xgyro, ygyro, zgyro] = <[f64; 3]>::from(imu.gyro_rad_s).map(|rate| rate as f32);
    MavMessage::HIGHRES_IMU(HIGHRES_IMU_DATA {
        time_usec: (1e6 * state.time_s) as u64,
        xacc,
        yacc,
        zacc,
        xgyro,
        ygyro,
        zgyro,
        pressure_alt: pressure_altitude_m.unwrap_or(f64::NAN) as f32,
        fields_updated,
        ..HIGHRES_IMU_DATA::default()
    })
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

//! Messages of the rocket in space only: descent, estimator, sensors.

use flight::computer::pilot::ApogeeAhead;
use flight::estimation::estimator::{Doubt, Health};
use mavlink_core::MessageData as _;
use protocol::dialect::{
    ESTIMATOR_STATUS_DATA, EstimatorStatusFlags, HIGHRES_IMU_DATA, HighresImuUpdatedFlags, MavMessage,
    MavSysStatusSensor, TD_DESCENT_DATA, TdBooster, TdChute,
};

use super::boot_ms;
use crate::snapshot::{Booster, Chute, DescentFacts, Snapshot};

/// The message of this id, or `None` if the vehicle has no such message or no data for it.
pub(super) fn message(message_id: u32, snapshot: &Snapshot) -> Option<MavMessage> {
    match message_id {
        TD_DESCENT_DATA::ID => descent(snapshot),
        ESTIMATOR_STATUS_DATA::ID => estimator(snapshot),
        HIGHRES_IMU_DATA::ID => imu(snapshot),
        _ => None,
    }
}

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

fn descent(snapshot: &Snapshot) -> Option<MavMessage> {
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
fn estimator(snapshot: &Snapshot) -> Option<MavMessage> {
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
fn imu(snapshot: &Snapshot) -> Option<MavMessage> {
    use HighresImuUpdatedFlags as U;
    let sensors = snapshot.sensors.as_ref()?;
    let mut fields_updated = U::HIGHRES_IMU_UPDATED_XACC
        | U::HIGHRES_IMU_UPDATED_YACC
        | U::HIGHRES_IMU_UPDATED_ZACC
        | U::HIGHRES_IMU_UPDATED_XGYRO
        | U::HIGHRES_IMU_UPDATED_YGYRO
        | U::HIGHRES_IMU_UPDATED_ZGYRO;
    fields_updated.set(U::HIGHRES_IMU_UPDATED_PRESSURE_ALT, sensors.barometer);
    let [xacc, yacc, zacc] = sensors.specific_force_m_s2.map(|force| force as f32);
    let [xgyro, ygyro, zgyro] = sensors.gyro_rad_s.map(|rate| rate as f32);
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

//! Applies MAVLink messages to the model and converts units, axes and ranges.

use std::time::Duration;

use mavlink::MessageData;
use protocol::dialect::{
    BATTERY_STATUS_DATA, HEARTBEAT_DATA, MavMessage, MavModeFlag, MavState, MavSysStatusSensor,
    STORAGE_INFORMATION_DATA, SYS_STATUS_DATA, TD_FINS_DATA, TD_GIMBAL_DATA, TD_LANDING_VERDICT_DATA,
    TD_MISSION_DATA, TD_PREDICTED_PATH_DATA, TdLimit, TdStart,
};
use protocol::mission::MissionHash;
use protocol::motion::Degrees;
pub use protocol::reported::{phase_from_number, phase_of};

use super::words::fixed;
use super::{
    Attitude, Battery, Deflection, FlownMission, Gimbal, Heartbeat, Motion, PadCheck, Prediction, Sample,
    Touchdown, Vehicle, Verdict, extend_path, is_on_pad, may_be_ours,
};

/// Applies a message to the vehicle that sent it.
pub fn apply(vehicle: &mut Vehicle, message: &MavMessage, now: Duration) {
    if apply_foreign(vehicle, message, now) {
        return;
    }
    vehicle.boot.note(message);
    vehicle.reported.update(message);
    vehicle.events.note(message, now);
    vehicle.store(message, now);
    match message {
        MavMessage::HEARTBEAT(data) => vehicle.heartbeat = Some(Sample::new(heartbeat(data), now)),
        MavMessage::TD_FLIGHT_STATUS(status) => {
            vehicle.status = Some(Sample::new(status.clone(), now));
            vehicle.note_checks();
        }
        MavMessage::ATTITUDE_QUATERNION(data) => {
            if let Some(attitude) = Attitude::of(data) {
                vehicle.attitude = Some(Sample::new(attitude, now));
            }
        }
        MavMessage::LOCAL_POSITION_NED(data) => {
            let motion = Motion::of(data);
            vehicle.motion = Some(Sample::new(motion, now));
            let phase = vehicle.phase_now();
            vehicle.trend.note(data.time_boot_ms, &motion, phase);
            if vehicle.in_flight() {
                extend_path(&mut vehicle.flown, &motion);
            }
        }
        MavMessage::GLOBAL_POSITION_INT(data) => {
            vehicle.hud = Some(Sample::new(Motion::of_global(data), now));
            // Until the vehicle reports its pad. The two positions are at most a quarter of a
            // second apart.
            vehicle.pad = vehicle.pad.or_else(|| {
                let motion = vehicle.motion?.value;
                Some(Degrees::of_e7(data.lat, data.lon)?.moved(-motion.x_m, -motion.y_m))
            });
        }
        MavMessage::HOME_POSITION(data) => {
            vehicle.pad = Degrees::of_e7(data.latitude, data.longitude).or(vehicle.pad);
        }
        MavMessage::TD_TOUCHDOWN_PREDICTION(data) => {
            let [distance, height, rate] = [data.distance_m, data.height_m, data.rate_rad_s];
            let at = [distance, height, data.vertical_m_s, data.lateral_m_s, data.tilt_rad, rate];
            let touchdown = touchdown(at, data.limits_violated);
            let time_to_go_s = f64::from(data.time_to_go_ms) / 1_000.0;
            vehicle.prediction = Some(Sample::new(Prediction { time_to_go_s, touchdown }, now));
        }
        MavMessage::TD_PREDICTED_PATH(data) => vehicle.path = Some(Sample::new(path(data), now)),
        MavMessage::TD_OPERATOR(data) => {
            vehicle.operators.insert(data.number, (data.role, name(&data.name[..])));
        }
        MavMessage::TD_PAD_CHECK(data) => {
            vehicle.pad_check = Some(PadCheck::with(vehicle.pad_check.take(), data, now));
        }
        MavMessage::TD_FINDING(data) => vehicle.findings.take(data, name(&data.text[..])),
        _ => {}
    }
    // The flight may have passed in silence: a later phase shows that it took place.
    match vehicle.phase().map(|phase| is_on_pad(phase.value)) {
        Some(true) if vehicle.verdict().is_none() => vehicle.left_pad_at = None,
        Some(_) => drop(vehicle.left_pad_at.get_or_insert(now)),
        None => {}
    }
}

// Values converted on access.
impl Vehicle {
    pub fn fins(&self) -> Option<Sample<[Deflection; 4]>> {
        self.converted(|data: &TD_FINS_DATA| {
            std::array::from_fn(|k| Deflection::of_centidegrees(data.commanded[k], data.measured[k]))
        })
    }

    pub fn gimbal(&self) -> Option<Sample<Gimbal>> {
        self.converted(|data: &TD_GIMBAL_DATA| Gimbal {
            pitch: Deflection::of_centidegrees(data.pitch_commanded, data.pitch_measured),
            yaw: Deflection::of_centidegrees(data.yaw_commanded, data.yaw_measured),
        })
    }

    /// The vehicle's own verdict on its landing.
    pub fn verdict(&self) -> Option<Sample<Verdict>> {
        self.converted(|data: &TD_LANDING_VERDICT_DATA| {
            let [distance, rate] = [data.distance_m, data.rate_rad_s];
            let at = [distance, 0.0, data.vertical_m_s, data.lateral_m_s, data.tilt_rad, rate];
            Verdict { landing: data.landing, touchdown: touchdown(at, data.limits_violated) }
        })
    }

    /// `None` if the vehicle has no battery that it measures.
    pub fn battery(&self) -> Option<Sample<Battery>> {
        let status = self.last::<SYS_STATUS_DATA>().filter(|data| data.value.voltage_battery != u16::MAX)?;
        Some(status.map(|data| Battery {
            volts: f64::from(data.voltage_battery) / 1e3,
            percent: u8::try_from(data.battery_remaining).ok(),
        }))
    }

    /// The voltage of its battery, and that of its servos' if it reports one.
    pub(crate) fn volts(&self) -> Option<String> {
        let volts = self.battery()?.value.volts;
        let servos = self.converted(|data: &BATTERY_STATUS_DATA| f64::from(data.voltages[0]) / 1e3);
        let one = || format!("{} V", fixed(volts, 2));
        Some(servos.map_or_else(one, |servos| format!("{}/{} V", fixed(volts, 1), fixed(servos.value, 1))))
    }

    /// Whether it reports that its log does not run.
    pub fn log_has_stopped(&self) -> bool {
        self.is_unhealthy(MavSysStatusSensor::MAV_SYS_STATUS_LOGGING)
    }

    /// Whether it reports that this part does not work; a receiver without a fix does not.
    pub fn is_unhealthy(&self, part: MavSysStatusSensor) -> bool {
        self.last::<SYS_STATUS_DATA>().is_some_and(|Sample { value, .. }| {
            value.onboard_control_sensors_present.contains(part)
                && !value.onboard_control_sensors_health.contains(part)
        })
    }

    /// Free space for the vehicle's log, MiB.
    pub fn log_space_mib(&self) -> Option<Sample<f64>> {
        self.converted(|data: &STORAGE_INFORMATION_DATA| data.available_capacity.into())
    }

    /// What it flies.
    pub fn mission(&self) -> Option<FlownMission> {
        let data = self.last::<TD_MISSION_DATA>()?.value;
        let start = match data.start {
            TdStart::TD_START_UNKNOWN => None,
            TdStart::TD_START_PAD => Some("pad"),
            TdStart::TD_START_APOGEE => Some("apogee"),
            TdStart::TD_START_DRONE => Some("drone"),
        };
        let (hash, name, motor_burns) = (MissionHash(data.hash), name(&data.name[..]), data.motor_burns);
        Some(FlownMission { hash, name, start, motor_burns })
    }

    fn converted<M: MessageData, T>(&self, convert: impl FnOnce(&M) -> T) -> Option<Sample<T>> {
        self.last().map(|message| message.map(convert))
    }
}

/// Applies a message of another autopilot. Returns whether it is one: then it is not read as a
/// message of our vehicles.
fn apply_foreign(vehicle: &mut Vehicle, message: &MavMessage, now: Duration) -> bool {
    match message {
        MavMessage::HEARTBEAT(beat) if !may_be_ours(beat) => {
            // Beside one of ours it is a second vehicle, and our vehicle's values stay.
            if vehicle.status.is_none() {
                *vehicle = Vehicle { boot: std::mem::take(&mut vehicle.boot), ..Vehicle::default() };
                vehicle.heartbeat = Some(Sample::new(heartbeat(beat), now));
            }
            vehicle.foreign = Some(Sample::new(beat.clone(), now));
            true
        }
        MavMessage::HEARTBEAT(_) | MavMessage::TD_FLIGHT_STATUS(_) => false,
        _ => vehicle.as_foreign().is_some(),
    }
}

fn heartbeat(data: &HEARTBEAT_DATA) -> Heartbeat {
    Heartbeat {
        armed: data.base_mode.contains(MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED),
        phase: phase_of(data),
        terminated: data.system_status == MavState::MAV_STATE_FLIGHT_TERMINATION,
    }
}

fn path(data: &TD_PREDICTED_PATH_DATA) -> Vec<(f64, f64)> {
    let metres = |cm: i16| f64::from(cm) / 100.0;
    let points = data.x.iter().zip(&data.altitude).map(|(x, altitude)| (metres(*x), metres(*altitude)));
    points.take(usize::from(data.count)).collect()
}

/// The text of a field of characters, without what a terminal would act on.
fn name(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
    protocol::text::printable(&bytes[..end])
}

/// Distance, height, vertical and lateral speed, tilt and rate at touchdown, in the order of both
/// messages.
fn touchdown(at: [f32; 6], violated: TdLimit) -> Touchdown {
    let [distance_m, height_m, vertical_m_s, lateral_m_s, tilt_rad, rate_rad_s] = at.map(f64::from);
    Touchdown { distance_m, height_m, vertical_m_s, lateral_m_s, tilt_rad, rate_rad_s, violated }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::dialect::{ATTITUDE_QUATERNION_DATA, LOCAL_POSITION_NED_DATA};

    const NOW: Duration = Duration::from_secs(1);

    fn at_pitch(pitch_deg: f64) -> MavMessage {
        let (sin, cos) = libm::sincos(pitch_deg.to_radians() / 2.0);
        MavMessage::ATTITUDE_QUATERNION(ATTITUDE_QUATERNION_DATA {
            q1: cos as f32,
            q3: sin as f32,
            pitchspeed: 0.1,
            ..Default::default()
        })
    }

    fn moving(vx: f32, vz_down: f32) -> MavMessage {
        MavMessage::LOCAL_POSITION_NED(LOCAL_POSITION_NED_DATA {
            vx,
            vz: vz_down,
            z: -15.0,
            ..Default::default()
        })
    }

    fn speeds(pitch_deg: f64, vx: f32, vz_down: f32) -> (f64, f64) {
        let mut vehicle = Vehicle::default();
        apply(&mut vehicle, &at_pitch(pitch_deg), NOW);
        apply(&mut vehicle, &moving(vx, vz_down), NOW);
        let speed = vehicle.body_speed().unwrap().value;
        (speed.u_m_s, speed.w_m_s)
    }

    fn close(found: f64, expected: f64) {
        assert!((found - expected).abs() < 1e-5, "{found} is not {expected}");
    }

    #[test]
    fn upright_descent_is_negative_axial_speed() {
        let (u, w) = speeds(90.0, 0.2, 5.0);
        close(u, -5.0);
        close(w, 0.2);
    }

    #[test]
    fn tilted_speeds_follow_the_body_axes() {
        // Falling at 1 m/s with the nose 60 deg above the horizon: u = -sin 60, w = +cos 60.
        let (u, w) = speeds(60.0, 0.0, 1.0);
        close(u, -0.866_025);
        close(w, 0.5);
        // Leaning to the other side of the vertical.
        let (u, w) = speeds(120.0, 0.0, 1.0);
        close(u, -0.866_025);
        close(w, -0.5);
    }

    #[test]
    fn pitch_has_no_jump_at_the_vertical_and_tilt_is_measured_from_it() {
        for pitch_deg in [10.0, 60.0, 89.0, 90.0, 91.0, 120.0] {
            let mut vehicle = Vehicle::default();
            apply(&mut vehicle, &at_pitch(pitch_deg), NOW);
            let attitude = vehicle.attitude.unwrap().value;
            close(attitude.pitch_rad.to_degrees(), pitch_deg);
            assert!((attitude.tilt_rad.to_degrees() - (pitch_deg - 90.0).abs()).abs() < 0.03);
        }
    }

    #[test]
    fn an_invalid_quaternion_is_ignored() {
        let mut vehicle = Vehicle::default();
        let zero = MavMessage::ATTITUDE_QUATERNION(ATTITUDE_QUATERNION_DATA::default());
        apply(&mut vehicle, &zero, NOW);
        assert!(vehicle.attitude.is_none());
    }

    #[test]
    fn every_phase_number_of_the_dialect_is_accepted_and_no_other() {
        for number in 0..=12 {
            assert_eq!(phase_from_number(number).map(|phase| phase as u32), Some(number));
        }
        assert_eq!(phase_from_number(13), None);
    }
}

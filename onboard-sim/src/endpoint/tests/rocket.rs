//! A rocket from apogee on the wire: what it sends in which phase, and within which budget.

use campaign::dispersion::Dispersion;
use protocol::dialect::{
    BATTERY_STATUS_DATA, ESTIMATOR_STATUS_DATA, EstimatorStatusFlags, HIGHRES_IMU_DATA, MavSysStatusSensor,
    SYS_STATUS_DATA, TD_CONTROLLER_DATA, TD_DESCENT_DATA, TD_PREDICTED_PATH_DATA, TdChute,
};

use super::*;
use crate::fly::{LoadedFlight, load_profile};
use crate::rocket::Rocket;
use crate::streams::FROM_APOGEE;

struct Airborne {
    rocket: Rocket,
    endpoint: VehicleEndpoint,
}

impl Airborne {
    fn on_the_pad(dispersion: &str) -> Self {
        let LoadedFlight::FromApogee(mut flight) = load_profile("mk2").unwrap() else {
            panic!("from apogee")
        };
        flight.order.dispersion = Dispersion::builtin(dispersion).unwrap();
        let mut rocket = Rocket::new(&flight).unwrap();
        rocket.set_log_state(LogState { running: true, space_bytes: u64::MAX });
        rocket.pull_pin();
        let mut airborne = Self { rocket, endpoint: VehicleEndpoint::sending(&FROM_APOGEE) };
        airborne.run_while(|rocket| rocket.snapshot().checks_failed != 0);
        airborne
    }

    fn let_go(dispersion: &str) -> Self {
        let mut airborne = Self::on_the_pad(dispersion);
        airborne.rocket.request(crate::craft::Request::Arm);
        airborne.rocket.request(crate::craft::Request::Start);
        airborne.run_while(|rocket| rocket.phase().on_pad());
        airborne
    }

    fn run_while(&mut self, mut holds: impl FnMut(&Rocket) -> bool) -> Vec<Frame> {
        let mut sent = Vec::new();
        while holds(&self.rocket) {
            for event in self.rocket.advance_frame(&mut || Duration::ZERO) {
                self.endpoint.on_event(&event);
            }
            sent.extend(self.endpoint.poll(&self.rocket, &self.rocket.snapshot()));
        }
        sent
    }

    fn run(&mut self, duration_s: f64) -> Vec<Frame> {
        let end_s = self.rocket.time_s() + duration_s;
        self.run_while(|rocket| rocket.time_s() < end_s)
    }

    /// The message, asked for once.
    fn request(&mut self, message_id: u32) -> MavMessage {
        let request = CommandRequest {
            source: GROUND,
            target: VEHICLE,
            command: 512,
            params: [message_id as f32, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            confirmation: 0,
        };
        self.endpoint.on_command(&request, &mut self.rocket);
        let sent = self.run(0.3);
        let found = sent
            .iter()
            .filter(|frame| frame.message_id() == message_id)
            .find_map(|frame| frame.decode().ok());
        found.unwrap()
    }
}

#[test]
fn its_standard_rates_fit_the_radio_signed_or_not() {
    for streams in [Streams::of(&FROM_APOGEE), Streams::signed(&FROM_APOGEE)] {
        let total = streams.bytes_s();
        assert!(total <= f64::from(RADIO_BUDGET_BYTES_S), "{total} B/s");
    }
}

#[test]
fn its_whole_flight_stays_within_the_radio_s_budget_in_every_second() {
    let mut airborne = Airborne::let_go("field");
    let mut worst = 0;
    while !airborne.rocket.is_over() {
        let second: usize = airborne.run(1.0).iter().map(|frame| frame.as_bytes().len()).sum();
        worst = worst.max(second);
    }
    assert!(worst as f64 <= f64::from(RADIO_BUDGET_BYTES_S) + BURST_BYTES, "{worst} B in one second");
    assert!(worst > 1_200, "it had much to say: {worst} B");
}

#[test]
fn in_the_descent_the_band_is_told_four_times_a_second() {
    let mut airborne = Airborne::let_go("field");
    airborne.run_while(|rocket| rocket.phase() != Phase::LandArmed);
    let sent = airborne.run(2.0);
    let told = count(&sent, TD_DESCENT_DATA::ID);
    assert!((7..=9).contains(&told), "{told} in 2 s");
    let last = sent.iter().rev().find_map(|frame| match frame.decode() {
        Ok(MavMessage::TD_DESCENT(descent)) => Some(descent),
        _ => None,
    });
    let last = last.unwrap();
    assert!(last.band_low_m < last.chosen_height_m && last.chosen_height_m < last.band_high_m, "{last:?}");
    assert!(last.height_m > last.band_high_m && last.vertical_speed_m_s < -30.0, "{last:?}");
    assert!((60.0..120.0).contains(&last.commit_height_m), "{last:?}");
    assert!((0.0..3.0).contains(&last.time_to_ignition_s), "{last:?}");
    assert!((0.9..1.1).contains(&last.drag_scale) && (0.9..1.1).contains(&last.thrust_scale), "{last:?}");
    assert_eq!(last.chute, TdChute::TD_CHUTE_STOWED);
    let estimator = sent.iter().find_map(|frame| match frame.decode() {
        Ok(MavMessage::ESTIMATOR_STATUS(status)) => Some(status),
        _ => None,
    });
    let estimator = estimator.unwrap();
    assert!(estimator.flags.contains(EstimatorStatusFlags::ESTIMATOR_POS_HORIZ_ABS), "{estimator:?}");
    assert!(estimator.vel_ratio.is_nan() && (0.01..5.0).contains(&estimator.pos_vert_accuracy));
    let sensors = MavSysStatusSensor::MAV_SYS_STATUS_SENSOR_GPS
        | MavSysStatusSensor::MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE;
    let healthy = sent.iter().any(|frame| {
        matches!(frame.decode(), Ok(MavMessage::SYS_STATUS(status)) if status.onboard_control_sensors_health.contains(sensors))
    });
    assert!(healthy);
}

#[test]
fn the_landing_burn_tells_its_plan() {
    let mut airborne = Airborne::let_go("none");
    airborne.run_while(|rocket| rocket.phase() != Phase::Powered);
    airborne.run(0.5);
    let sent = airborne.run(2.0);
    assert!(count(&sent, TD_CONTROLLER_DATA::ID) >= 7 && count(&sent, TD_PREDICTED_PATH_DATA::ID) >= 1);
    // The truth is the estimate here: there is no estimator to speak of, and no sensor.
    assert_eq!(count(&sent, ESTIMATOR_STATUS_DATA::ID), 0);
    let absent = sent.iter().any(|frame| {
        matches!(frame.decode(), Ok(MavMessage::SYS_STATUS(status))
            if !status.onboard_control_sensors_present.contains(MavSysStatusSensor::MAV_SYS_STATUS_SENSOR_GPS))
    });
    assert!(absent && count(&sent, SYS_STATUS_DATA::ID) >= 1);
}

#[test]
fn what_is_off_can_be_asked_for_and_what_is_not_modelled_is_unknown() {
    let mut airborne = Airborne::on_the_pad("field");
    let MavMessage::HIGHRES_IMU(imu) = airborne.request(HIGHRES_IMU_DATA::ID) else { panic!("not the IMU") };
    assert!((imu.xacc - 9.81).abs() < 0.3 && imu.ygyro.abs() < 0.1, "{imu:?}");
    let MavMessage::BATTERY_STATUS(battery) = airborne.request(BATTERY_STATUS_DATA::ID) else {
        panic!("not the battery")
    };
    assert_eq!((battery.voltages[0], battery.current_battery, battery.battery_remaining), (u16::MAX, -1, -1));
}

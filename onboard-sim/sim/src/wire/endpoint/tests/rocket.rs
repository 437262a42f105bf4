//! Tests a rocket from apogee on the wire: its messages in each phase, and its budget.

use crate::dispersion::Dispersion;
use flight::rules::arming::{Check, UPLINK_CHECK};
use protocol::dialect::{
    BATTERY_STATUS_DATA, ESTIMATOR_STATUS_DATA, EstimatorStatusFlags, GLOBAL_POSITION_INT_DATA,
    GPS_RAW_INT_DATA, GpsFixType, HIGHRES_IMU_DATA, LOCAL_POSITION_NED_DATA, MavSysStatusSensor,
    STORAGE_INFORMATION_DATA, SYS_STATUS_DATA, TD_CONTROLLER_DATA, TD_DESCENT_DATA, TD_PAD_CHECK_DATA,
    TD_PREDICTED_PATH_DATA, TdChute, TdPadCheckState,
};

use super::*;
use crate::wire::field::pad_of;
use crate::wire::fly::{Delayed, load_flight};

struct Airborne {
    rocket: Vehicle,
    endpoint: VehicleEndpoint,
    /// Frames that the ground sends now.
    uplink: Vec<Frame>,
    received: Delayed<Frame>,
    sent: Delayed<Frame>,
}

impl Airborne {
    fn on_the_pad(dispersion: &str) -> Self {
        Self::with_faults(dispersion, &[])
    }

    fn with_faults(dispersion: &str, faults: &[&str]) -> Self {
        let mut flight = load_flight(flight::vehicles::mission::DEFAULT).unwrap();
        flight.recipe.dispersion = Dispersion::builtin(dispersion).unwrap();
        flight.recipe.faults = faults.iter().map(|fault| fault.parse().unwrap()).collect();
        let mut rocket = Vehicle::on_the_pad(&flight).unwrap();
        rocket.set_log_state(LogState { running: true, space_bytes: u64::MAX });
        rocket.set_pin_out(true);
        let mut airborne = Self {
            rocket,
            endpoint: VehicleEndpoint::new(VehicleKind::Simulated),
            uplink: Vec::new(),
            received: Delayed::default(),
            sent: Delayed::default(),
        };
        // No station is received, and the vehicle's programme needs none.
        let waits = |check: &Check| !check.passed && check.name != UPLINK_CHECK;
        airborne.run_while(|rocket| rocket.arming_checks().iter().any(waits));
        airborne
    }

    fn let_go(dispersion: &str) -> Self {
        Self::let_go_with_faults(dispersion, &[])
    }

    fn let_go_with_faults(dispersion: &str, faults: &[&str]) -> Self {
        let mut airborne = Self::with_faults(dispersion, faults);
        frame(&mut airborne.rocket, &mut airborne.endpoint, &[CrewCommand::Arm, CrewCommand::Start]);
        airborne.run_while(|rocket| rocket.phase().on_pad());
        airborne
    }

    fn run_while(&mut self, mut holds: impl FnMut(&Vehicle) -> bool) -> Vec<Frame> {
        let mut sent = Vec::new();
        while holds(&self.rocket) {
            let time_s = self.rocket.time_s();
            let uplink = std::mem::take(&mut self.uplink);
            for frame in self.received.pass(uplink, time_s, self.rocket.radio()) {
                self.endpoint.on_frame(0, &frame, &self.rocket.state());
            }
            let (_, leaving) = frame(&mut self.rocket, &mut self.endpoint, &[]);
            let leaving = leaving.into_iter().map(|outgoing| outgoing.frame).collect();
            sent.extend(self.sent.pass(leaving, self.rocket.time_s(), self.rocket.radio()));
        }
        sent
    }

    fn run(&mut self, duration_s: f64) -> Vec<Frame> {
        let end_s = self.rocket.time_s() + duration_s;
        self.run_while(|rocket| rocket.time_s() < end_s)
    }

    /// The message, requested once.
    fn request(&mut self, message_id: u32) -> MavMessage {
        let request = asking(512, [message_id as f32, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        self.endpoint.on_command(0, (&request, None), &self.rocket.state());
        let sent = self.run(0.3);
        let found = sent
            .iter()
            .filter(|frame| frame.message_id() == message_id)
            .find_map(|frame| frame.decode().ok());
        found.unwrap()
    }
}

/// Twenty commands a second that are refused with a text, all the way from apogee to the ground.
#[test]
fn a_flight_stays_within_the_radio_budget_in_every_second_and_refusals_delay_no_position() {
    let mut airborne = Airborne::let_go("field");
    let mut ground = Encoder::new(GROUND);
    let mut sent = Vec::new();
    let (mut frame, began_s) = (0u64, airborne.rocket.time_s());
    while !airborne.rocket.is_over() {
        if frame.is_multiple_of(10) {
            airborne.uplink.push(
                ground.encode(&MavMessage::COMMAND_LONG(command(MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, 1.0))),
            );
        }
        frame += 1;
        let time_s = airborne.rocket.time_s();
        sent.extend(airborne.run(0.001).into_iter().map(|frame| (time_s, frame)));
    }
    let flown_s = airborne.rocket.time_s() - began_s;
    let sizes: Vec<_> = sent.iter().map(|(time_s, frame)| (*time_s, frame.as_bytes().len())).collect();
    let worst = super::budget::worst_second(&sizes);
    assert!(worst <= RADIO_BUDGET_BYTES_S as usize, "{worst} B in one second");
    assert!(worst > 1_200, "the link was busy: {worst} B");
    // From the first to the last: the time before and after them is not an interval.
    let at_s: Vec<f64> = sent
        .iter()
        .filter(|(_, frame)| frame.message_id() == LOCAL_POSITION_NED_DATA::ID)
        .map(|(time_s, _)| *time_s)
        .collect();
    let span_s = at_s[at_s.len() - 1] - at_s[0];
    assert!(span_s > flown_s - 0.3, "{span_s} of {flown_s} s");
    let hz = (at_s.len() - 1) as f64 / span_s;
    // Eight a second are due. Predictions in the burn and the texts of the touchdown take the room
    // of some: 7.5 of them over this flight.
    assert!((7.3..8.2).contains(&hz), "{hz} positions a second in {flown_s} s");
}

#[test]
fn in_the_descent_the_band_is_reported_four_times_a_second() {
    let mut airborne = Airborne::let_go("field");
    airborne.run_while(|rocket| rocket.phase() != Phase::LandArmed);
    let sent = airborne.run(2.0);
    let reported = count(&sent, TD_DESCENT_DATA::ID);
    assert!((7..=9).contains(&reported), "{reported} in 2 s");
    let last = decoded!(sent, TD_DESCENT).last();
    let last = last.unwrap();
    assert!(last.band_low_m < last.chosen_height_m && last.chosen_height_m < last.band_high_m, "{last:?}");
    assert!(last.height_m > last.band_high_m && last.vertical_speed_m_s < -30.0, "{last:?}");
    assert!((60.0..120.0).contains(&last.commit_height_m), "{last:?}");
    assert!((0.0..3.0).contains(&last.time_to_ignition_s), "{last:?}");
    assert!((0.9..1.1).contains(&last.drag_scale) && (0.9..1.1).contains(&last.thrust_scale), "{last:?}");
    assert_eq!(last.chute, TdChute::TD_CHUTE_STOWED);
    let estimator = decoded!(sent, ESTIMATOR_STATUS).next();
    let estimator = estimator.unwrap();
    assert!(estimator.flags.contains(EstimatorStatusFlags::ESTIMATOR_POS_HORIZ_ABS), "{estimator:?}");
    assert!((0.0..1.0).contains(&estimator.vel_ratio) && (0.0..1.0).contains(&estimator.pos_vert_ratio));
    assert!((0.01..5.0).contains(&estimator.pos_vert_accuracy));
    let sensors = MavSysStatusSensor::MAV_SYS_STATUS_SENSOR_GPS
        | MavSysStatusSensor::MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE;
    let mut status = decoded!(sent, SYS_STATUS);
    assert!(status.any(|status| status.onboard_control_sensors_health.contains(sensors)));
}

fn findings(sent: &[Frame]) -> Vec<(u8, u8, String)> {
    decoded!(sent, TD_FINDING)
        .map(|found| (found.place, found.found, String::from(found.text.to_str().unwrap())))
        .collect()
}

/// The station receives findings as they occur and, after the landing, repeatedly.
#[test]
fn findings_are_reported() {
    let mut airborne = Airborne::let_go_with_faults("field", &["gnss-out@1"]);
    let sent = airborne.run_while(|rocket| rocket.phase() != Phase::Touchdown);
    let lost = "GNSS lost for";
    let first = findings(&sent).into_iter().next().unwrap();
    assert!((first.0, first.1) == (0, 1) && first.2.starts_with(lost), "{first:?}");
    let after = findings(&airborne.run(10.0));
    let count = usize::from(after[0].1);
    // One a second, and those that waited for room in the second before.
    assert!((9..=12).contains(&after.len()), "{after:?}");
    assert!(
        (0..count).all(|place| after.iter().any(|reported| usize::from(reported.0) == place)),
        "{after:?}"
    );

    // Here are sensors that are nearly exact.
    let mut airborne = Airborne::let_go("none");
    let mut sent = airborne.run_while(|rocket| rocket.phase() != Phase::Touchdown);
    sent.extend(airborne.run(3.0));
    let reported = findings(&sent);
    assert!(
        reported.len() >= 3 && reported.iter().all(|reported| *reported == (0, 0, String::new())),
        "{reported:?}"
    );
}

#[test]
fn the_landing_burn_reports_its_plan() {
    let mut airborne = Airborne::let_go("none");
    airborne.run_while(|rocket| rocket.phase() != Phase::Powered);
    airborne.run(0.5);
    let sent = airborne.run(2.0);
    assert!(count(&sent, TD_CONTROLLER_DATA::ID) >= 5 && count(&sent, TD_PREDICTED_PATH_DATA::ID) >= 1);
    assert!(count(&sent, ESTIMATOR_STATUS_DATA::ID) >= 1 && count(&sent, SYS_STATUS_DATA::ID) >= 1);
}

#[test]
fn messages_that_are_off_can_be_requested_and_unknown_values_are_marked() {
    let mut airborne = Airborne::on_the_pad("field");
    let MavMessage::HIGHRES_IMU(imu) = airborne.request(HIGHRES_IMU_DATA::ID) else { panic!("not the IMU") };
    assert!((imu.xacc - 9.81).abs() < 0.3 && imu.ygyro.abs() < 0.1, "{imu:?}");
    // The packs take turns.
    let mut packs = [airborne.request(BATTERY_STATUS_DATA::ID), {
        airborne.run(0.7);
        airborne.request(BATTERY_STATUS_DATA::ID)
    }]
    .map(|message| match message {
        MavMessage::BATTERY_STATUS(battery) => battery,
        _ => panic!("not a battery"),
    });
    packs.sort_by_key(|pack| pack.id);
    let [battery, servos] = packs;
    assert_eq!((battery.id, servos.id), (0, 1));
    // Three cells, just charged.
    assert!((12_400..12_600).contains(&servos.voltages[0]), "{servos:?}");
    assert!(battery.fault_bitmask.is_empty());
    // Two cells, just charged.
    assert!((8_200..8_400).contains(&battery.voltages[0]), "{battery:?}");
    assert_eq!(
        (battery.battery_remaining, battery.current_consumed, battery.temperature),
        (100, -1, i16::MAX)
    );
}

#[test]
fn the_storage_is_reported_if_present() {
    let mut airborne = Airborne::on_the_pad("none");
    airborne.rocket.set_log_state(LogState { running: true, space_bytes: 3 << 30 });
    airborne.run(0.02);
    let MavMessage::STORAGE_INFORMATION(storage) = airborne.request(STORAGE_INFORMATION_DATA::ID) else {
        panic!("not the storage")
    };
    assert_eq!((storage.available_capacity, storage.storage_count), (3072.0, 1));
    airborne.rocket.set_log_state(LogState { running: true, space_bytes: u64::MAX });
    let sent = airborne.run(12.0);
    assert_eq!(count(&sent, STORAGE_INFORMATION_DATA::ID), 0, "the operator flies without a log");
}

/// Every value of a check arrives over a radio, within its budget, and again for a station that
/// joins late.
#[test]
fn a_check_is_reported_value_by_value() {
    let mut airborne = Airborne::on_the_pad("field");
    assert_eq!(count(&airborne.run(3.0), TD_PAD_CHECK_DATA::ID), 0, "there was none");
    frame(&mut airborne.rocket, &mut airborne.endpoint, &[CrewCommand::Check]);
    let mut places = std::collections::BTreeSet::new();
    let mut last = None;
    let sent = airborne.run(24.0);
    for reported in decoded!(sent, TD_PAD_CHECK) {
        if reported.found > 0 {
            places.insert(reported.place);
        }
        last = Some(reported);
    }
    let last = last.unwrap();
    assert_eq!(last.state, TdPadCheckState::TD_PAD_CHECK_STATE_PASSED);
    assert_eq!((usize::from(last.found), last.progress, last.run), (places.len(), 100, 1));
    assert_eq!(places.len(), 32);
    airborne.run(40.0);
    let late = airborne.run(10.0);
    assert!((9..=11).contains(&count(&late, TD_PAD_CHECK_DATA::ID)), "once a second");
    frame(&mut airborne.rocket, &mut airborne.endpoint, &[CrewCommand::Arm]);
    airborne.run(0.5);
    assert_eq!(count(&airborne.run(5.0), TD_PAD_CHECK_DATA::ID), 0, "not while armed");
}

fn abort() -> Frame {
    Encoder::new(GROUND).encode(&MavMessage::COMMAND_LONG(command(MavCmd::MAV_CMD_DO_FLIGHTTERMINATION, 1.0)))
}

/// Outcome: it lands as if nothing had happened; aborts that are not received change nothing.
#[test]
fn a_link_that_is_lost_changes_nothing_about_the_flight() {
    let mut lost = Airborne::let_go_with_faults("field", &["link-loss@descent"]);
    lost.run_while(|rocket| rocket.phase() != Phase::AeroDescent);
    lost.run(0.01);
    let mut sent = Vec::new();
    while !lost.rocket.is_over() {
        lost.uplink.push(abort());
        sent.extend(lost.run(0.5));
    }
    assert!(sent.is_empty(), "{} frames through a silent radio", sent.len());
    assert!(!lost.rocket.aborted());
    let mut whole = Airborne::let_go("field");
    whole.run_while(|rocket| !rocket.is_over());
    assert_eq!(lost.rocket.judged(), whole.rocket.judged());
    assert!(lost.rocket.judged().unwrap().landing.stands);
}

/// Outcome: the request is carried out later by the delay; its answer comes later by twice the
/// delay.
#[test]
fn over_a_slow_link_an_abort_is_late_but_still_works() {
    let mut late = Airborne::let_go_with_faults("field", &["link-delay:1.5@descent"]);
    late.run_while(|rocket| rocket.phase() != Phase::AeroDescent);
    late.run(0.5);
    let requested_at_s = late.rocket.time_s();
    late.uplink.push(abort());
    late.run_while(|rocket| rocket.phase() != Phase::Chute);
    let received_after_s = late.rocket.time_s() - requested_at_s;
    assert!((1.5..1.52).contains(&received_after_s), "{received_after_s}");
    let mut answered_after_s = None;
    while answered_after_s.is_none() {
        let answers = late.run(0.02).iter().filter_map(CommandAnswer::from_frame).count();
        answered_after_s = (answers > 0).then(|| late.rocket.time_s() - requested_at_s);
    }
    assert!((3.0..3.05).contains(&answered_after_s.unwrap()), "{answered_after_s:?}");
}

#[test]
fn its_map_position_is_at_the_pad_of_its_mission() {
    let mut airborne = Airborne::let_go("field");
    airborne.run_while(|rocket| rocket.phase() != Phase::LandArmed);
    let MavMessage::GLOBAL_POSITION_INT(place) = airborne.request(GLOBAL_POSITION_INT_DATA::ID) else {
        panic!("not the position")
    };
    let pad = pad_of(airborne.rocket.state().mission());
    // Within a few hundred metres of the pad, some 200 m up; a degree is 111 km.
    assert!((f64::from(place.lat) * 1e-7 - pad.latitude).abs() < 5e-3, "{place:?}");
    assert!((f64::from(place.lon) * 1e-7 - pad.longitude).abs() < 5e-3, "{place:?}");
    assert!((50_000..400_000).contains(&place.relative_alt) && place.vz > 100, "{place:?}");
    let MavMessage::GPS_RAW_INT(fix) = airborne.request(GPS_RAW_INT_DATA::ID) else { panic!("not the fix") };
    assert_eq!((fix.fix_type, fix.satellites_visible), (GpsFixType::GPS_FIX_TYPE_3D_FIX, u8::MAX));
}

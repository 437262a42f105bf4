//! Tests what a standard ground station gets without asking.

use protocol::dialect::{
    ATTITUDE_DATA, BATTERY_STATUS_DATA, CURRENT_MODE_DATA, GLOBAL_POSITION_INT_DATA, GPS_RAW_INT_DATA,
    HOME_POSITION_DATA, LOCAL_POSITION_NED_DATA, SYS_STATUS_DATA, VFR_HUD_DATA,
};
use protocol::identity::NETWORK_BUDGET_BYTES_S;

use super::*;

const OF_EVERY_VEHICLE: [u32; 7] = [
    ATTITUDE_DATA::ID,
    GLOBAL_POSITION_INT_DATA::ID,
    GPS_RAW_INT_DATA::ID,
    HOME_POSITION_DATA::ID,
    SYS_STATUS_DATA::ID,
    VFR_HUD_DATA::ID,
    CURRENT_MODE_DATA::ID,
];

#[test]
fn over_a_network_a_standard_station_sees_attitude_position_battery_and_mode_every_second() {
    let mut wire =
        Wire { endpoint: VehicleEndpoint::new().over_links(&[NETWORK_BUDGET_BYTES_S]), ..Wire::new() };
    let sent = wire.run(10.0);
    for message_id in OF_EVERY_VEHICLE {
        let found = count(&sent, message_id);
        assert!(found >= 9, "{found} of message {message_id} in 10 s");
    }
    // More than asked for may be asked for.
    let attitude = ATTITUDE_DATA::ID as f32;
    assert_eq!(wire.ask(511, attitude, 20_000.0).0, MavResult::MAV_RESULT_ACCEPTED as u8);
}

#[test]
fn over_a_radio_a_standard_station_gets_what_it_asks_for_and_the_fast_messages_give_way() {
    for (endpoint, signature_len) in
        [(VehicleEndpoint::new(), 0), (VehicleEndpoint::sending_signed(), SIGNATURE_LEN)]
    {
        let mut wire = Wire { endpoint, ..Wire::new() };
        let before = count(&wire.run(10.0), ATTITUDE_QUATERNION_DATA::ID);
        for message_id in OF_EVERY_VEHICLE {
            let result = wire.ask(511, message_id as f32, 1e6).0;
            assert_eq!(result, MavResult::MAV_RESULT_ACCEPTED as u8, "message {message_id}");
        }
        wire.run(2.0);
        let sent = wire.run(10.0);
        for message_id in OF_EVERY_VEHICLE {
            assert!((9..=11).contains(&count(&sent, message_id)), "message {message_id} at 1 Hz");
        }
        let attitudes = count(&sent, ATTITUDE_QUATERNION_DATA::ID);
        assert!((29..before).contains(&attitudes), "{attitudes} attitudes in 10 s after {before}");
        let bytes: usize = sent.iter().map(|frame| frame.as_bytes().len() + signature_len).sum();
        assert!(bytes <= 10 * RADIO_BUDGET_BYTES_S as usize, "{bytes} B in 10 s");
        for message_id in OF_EVERY_VEHICLE {
            assert_eq!(wire.ask(511, message_id as f32, 0.0).0, 0);
        }
        let again = count(&wire.run(10.0), ATTITUDE_QUATERNION_DATA::ID);
        assert!(again.abs_diff(before) <= 1, "{again} again, {before} before");
    }
}

#[test]
fn the_rates_of_every_kind_of_link_fit_it() {
    for kind in [Streams::new, Streams::signed, Streams::with_crew] {
        for capacity_bytes_s in [384, 768, 1_536, RADIO_BUDGET_BYTES_S, 4_608, NETWORK_BUDGET_BYTES_S] {
            let mut streams = kind();
            streams.set_capacity(capacity_bytes_s);
            let words = format!("{:.0} of {capacity_bytes_s} B/s", streams.bytes_s());
            assert!(streams.fit(), "{words}");
            let rate = |message_id| streams.rate_hz(message_id);
            let position = rate(LOCAL_POSITION_NED_DATA::ID);
            assert!(rate(HEARTBEAT_DATA::ID) >= 1.0 && rate(TD_FLIGHT_STATUS_DATA::ID) >= 1.0, "{words}");
            assert!(position >= 0.45, "{words}: {position} Hz");
            if capacity_bytes_s >= NETWORK_BUDGET_BYTES_S {
                assert!(OF_EVERY_VEHICLE.iter().all(|id| rate(*id) >= 1.0), "{words}");
                assert!(rate(BATTERY_STATUS_DATA::ID) >= 1.0);
            }
        }
    }
}

//! Battery and storage.

use mavlink_core::MessageData as _;
use mavlink_core::types::CharArray;
use protocol::dialect::{
    BATTERY_STATUS_DATA, MavBatteryFault, MavMessage, MavSysStatusSensor, STORAGE_INFORMATION_DATA,
    StorageStatus, StorageType, StorageUsageFlag, TdCheck,
};

use super::boot_ms;
use crate::snapshot::Snapshot;

pub(super) fn message(message_id: u32, snapshot: &Snapshot) -> Option<MavMessage> {
    match message_id {
        BATTERY_STATUS_DATA::ID => Some(battery(snapshot)),
        STORAGE_INFORMATION_DATA::ID => storage(snapshot),
        _ => None,
    }
}

/// What SYS_STATUS says to be there.
pub(super) fn present(snapshot: &Snapshot) -> MavSysStatusSensor {
    let mut present = MavSysStatusSensor::MAV_SYS_STATUS_LOGGING;
    present.set(MavSysStatusSensor::MAV_SYS_STATUS_SENSOR_BATTERY, snapshot.battery.is_some());
    present
}

/// What of it fails: a log that does not run, and on the pad a battery below its limit.
pub(super) fn failing(snapshot: &Snapshot) -> MavSysStatusSensor {
    let mut failing = MavSysStatusSensor::empty();
    failing.set(MavSysStatusSensor::MAV_SYS_STATUS_LOGGING, !snapshot.log.running);
    let checks = TdCheck::from_bits_truncate(snapshot.checks_failed);
    failing
        .set(MavSysStatusSensor::MAV_SYS_STATUS_SENSOR_BATTERY, checks.contains(TdCheck::TD_CHECK_BATTERY));
    failing
}

/// mV; `UINT16_MAX`: not known.
pub(super) fn millivolts(snapshot: &Snapshot) -> u16 {
    snapshot.battery.map_or(u16::MAX, |battery| libm::round(1000.0 * battery.volts) as u16)
}

/// cA; -1: not known.
pub(super) fn centiamperes(snapshot: &Snapshot) -> i16 {
    let current_a = snapshot.battery.and_then(|battery| battery.current_a);
    current_a.map_or(-1, |current_a| libm::round(100.0 * current_a) as i16)
}

/// Percent; -1: not known.
pub(super) fn percent(snapshot: &Snapshot) -> i8 {
    let left = snapshot.battery.and_then(|battery| battery.left);
    left.map_or(-1, |left| libm::round(100.0 * left) as i8)
}

fn battery(snapshot: &Snapshot) -> MavMessage {
    let mut voltages = [u16::MAX; 10];
    voltages[0] = millivolts(snapshot);
    MavMessage::BATTERY_STATUS(BATTERY_STATUS_DATA {
        temperature: i16::MAX,
        voltages,
        current_battery: centiamperes(snapshot),
        current_consumed: -1,
        energy_consumed: -1,
        battery_remaining: percent(snapshot),
        // The generated default is the first flag.
        fault_bitmask: MavBatteryFault::empty(),
        ..BATTERY_STATUS_DATA::default()
    })
}

/// `None` if the operator chose to fly without a log. How large the storage is, and how fast, is not known: 0.
fn storage(snapshot: &Snapshot) -> Option<MavMessage> {
    let log = snapshot.log;
    let has_storage = log.space_bytes != u64::MAX;
    has_storage.then(|| {
        MavMessage::STORAGE_INFORMATION(STORAGE_INFORMATION_DATA {
            time_boot_ms: boot_ms(snapshot.time_s),
            available_capacity: (log.space_bytes >> 10) as f32 / 1024.0,
            storage_id: 1,
            storage_count: 1,
            status: if log.running {
                StorageStatus::STORAGE_STATUS_READY
            } else {
                StorageStatus::STORAGE_STATUS_NOT_SUPPORTED
            },
            mavtype: StorageType::STORAGE_TYPE_UNKNOWN,
            storage_usage: StorageUsageFlag::empty(),
            name: CharArray::new([0; 32]),
            ..STORAGE_INFORMATION_DATA::default()
        })
    })
}

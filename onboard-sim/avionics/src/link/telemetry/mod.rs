//! A vehicle's state as MAVLink messages.
//!
//! Frames: north-east-down, as in [`Motion`]; an upright rocket has 90 degrees of pitch. Values are
//! narrowed to the fields' types here and only here; values out of range saturate.
//!
//! Quantities that are not modelled are sent as MAVLink's "unknown" and never invented.
//!
//! [`Motion`]: crate::link::vehicle::Motion

mod motion;
mod ours;

use alloc::vec::Vec;

use flight::computer::pilot::planner::PLAN_WITHIN_S;
use flight::rules::phase::Phase;
use mavlink::MessageData as _;
use mavlink::types::CharArray;
#[expect(deprecated, reason = "only [`protocol_version`] uses it")]
use protocol::dialect::PROTOCOL_VERSION_DATA;
use protocol::dialect::{
    ACTUATOR_OUTPUT_STATUS_DATA, ATTITUDE_DATA, ATTITUDE_QUATERNION_DATA, AUTOPILOT_VERSION_DATA,
    AVAILABLE_MODES_DATA, BATTERY_STATUS_DATA, CURRENT_MODE_DATA, ESTIMATOR_STATUS_DATA,
    EXTENDED_SYS_STATE_DATA, GLOBAL_POSITION_INT_DATA, GPS_RAW_INT_DATA, HEARTBEAT_DATA, HIGHRES_IMU_DATA,
    HOME_POSITION_DATA, LOCAL_POSITION_NED_DATA, MavAutopilot, MavBatteryFault, MavLandedState, MavMessage,
    MavModeFlag, MavModeProperty, MavProtocolCapability, MavStandardMode, MavState, MavSysStatusSensor,
    MavSysStatusSensorExtended, MavType, MavVtolState, STORAGE_INFORMATION_DATA, SYS_STATUS_DATA,
    SYSTEM_TIME_DATA, StorageStatus, StorageType, StorageUsageFlag, TD_CONTROLLER_DATA, TD_CREW_DATA,
    TD_DESCENT_DATA, TD_EVENTS_DATA, TD_FINS_DATA, TD_FLIGHT_STATUS_DATA, TD_GIMBAL_DATA,
    TD_LANDING_VERDICT_DATA, TD_MISSION_DATA, TD_OPERATOR_DATA, TD_PREDICTED_PATH_DATA,
    TD_TOUCHDOWN_LIMITS_DATA, TD_TOUCHDOWN_PREDICTION_DATA, TdCheck, VFR_HUD_DATA,
};
use protocol::identity::{GIT_COMMIT, PHASE_BITS};
use protocol::mission::MissionHash;

pub use self::ours::events;
pub(crate) use self::ours::{finding, pad_check};
use crate::link::vehicle::{BatteryFacts, Identity, VehicleKind, VehicleState};

/// PROTOCOL_VERSION: deprecated late in 2025, but some clients still request it first.
const PROTOCOL_VERSION_ID: u32 = 300;

/// The message of this id in the current state, or `None` if the vehicle has no such message or no
/// data for it.
pub fn message(message_id: u32, state: &VehicleState<'_>, identity: Identity) -> Option<MavMessage> {
    let boot = identity.boot_number;
    match message_id {
        HEARTBEAT_DATA::ID => Some(heartbeat(state, identity)),
        SYS_STATUS_DATA::ID => Some(sys_status(state)),
        EXTENDED_SYS_STATE_DATA::ID => Some(extended_sys_state(state)),
        ATTITUDE_QUATERNION_DATA::ID => Some(attitude(state)),
        LOCAL_POSITION_NED_DATA::ID => Some(position(state)),
        VFR_HUD_DATA::ID => Some(vfr_hud(state)),
        CURRENT_MODE_DATA::ID => Some(current_mode(state, boot)),
        AUTOPILOT_VERSION_DATA::ID => Some(autopilot_version(identity.uid)),
        PROTOCOL_VERSION_ID => Some(protocol_version()),
        ACTUATOR_OUTPUT_STATUS_DATA::ID => Some(actuators(state)),
        TD_FLIGHT_STATUS_DATA::ID => Some(ours::flight_status(state, identity)),
        TD_FINS_DATA::ID => Some(ours::fins(state, boot)),
        TD_GIMBAL_DATA::ID => Some(ours::gimbal(state, boot)),
        TD_CONTROLLER_DATA::ID => ours::controller(state, boot),
        TD_TOUCHDOWN_PREDICTION_DATA::ID => ours::touchdown_prediction(state, boot),
        TD_PREDICTED_PATH_DATA::ID => ours::predicted_path(state, boot),
        TD_LANDING_VERDICT_DATA::ID => ours::landing_verdict(state, boot),
        TD_TOUCHDOWN_LIMITS_DATA::ID => Some(ours::touchdown_limits(state, boot)),
        TD_CREW_DATA::ID => ours::crew(state, boot),
        TD_OPERATOR_DATA::ID => ours::operator(state, boot),
        // It matters before the flight only, and there it costs no position.
        TD_MISSION_DATA::ID => state.phase().on_pad().then(|| ours::mission(state, boot)),
        TD_EVENTS_DATA::ID => ours::events(&state.findings.events, boot),
        TD_DESCENT_DATA::ID => motion::descent(state, boot),
        ESTIMATOR_STATUS_DATA::ID => motion::estimator(state),
        HIGHRES_IMU_DATA::ID => Some(motion::imu(state)),
        BATTERY_STATUS_DATA::ID => Some(battery(state)),
        STORAGE_INFORMATION_DATA::ID => storage(state),
        ATTITUDE_DATA::ID => Some(motion::attitude(state)),
        GLOBAL_POSITION_INT_DATA::ID => Some(motion::position(state)),
        HOME_POSITION_DATA::ID => Some(motion::home(state)),
        GPS_RAW_INT_DATA::ID => Some(motion::gps(state)),
        SYSTEM_TIME_DATA::ID => Some(motion::system_time(state)),
        _ => None,
    }
}

/// The mode of a phase: it is in the lowest byte, and the boot above it.
fn custom_mode(phase: Phase, boot: u32) -> u32 {
    u32::from(phase.index()) | boot << PHASE_BITS
}

/// One AVAILABLE_MODES for each phase.
pub fn available_modes(boot: u32) -> impl Iterator<Item = MavMessage> {
    Phase::ALL.into_iter().map(move |phase| {
        MavMessage::AVAILABLE_MODES(AVAILABLE_MODES_DATA {
            custom_mode: custom_mode(phase, boot),
            properties: MavModeProperty::MAV_MODE_PROPERTY_NOT_USER_SELECTABLE,
            number_modes: Phase::ALL.len() as u8,
            mode_index: phase.index() + 1,
            standard_mode: MavStandardMode::MAV_STANDARD_MODE_NON_STANDARD,
            mode_name: characters(phase.name()),
        })
    })
}

fn heartbeat(state: &VehicleState<'_>, identity: Identity) -> MavMessage {
    let mut base_mode =
        MavModeFlag::MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | MavModeFlag::MAV_MODE_FLAG_AUTO_ENABLED;
    base_mode.set(MavModeFlag::MAV_MODE_FLAG_HIL_ENABLED, identity.kind == VehicleKind::Simulated);
    base_mode.set(MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED, state.mode().interlocks.armed);
    let system_status = match state.phase() {
        _ if state.mode().interlocks.abort_latched => MavState::MAV_STATE_FLIGHT_TERMINATION,
        _ if state.mode().interlocks.no_light_latched => MavState::MAV_STATE_EMERGENCY,
        Phase::Safe => MavState::MAV_STATE_BOOT,
        Phase::PadIdle | Phase::PadArmed | Phase::Touchdown | Phase::Safed => MavState::MAV_STATE_STANDBY,
        Phase::Chute => MavState::MAV_STATE_EMERGENCY,
        _ => MavState::MAV_STATE_ACTIVE,
    };
    MavMessage::HEARTBEAT(HEARTBEAT_DATA {
        custom_mode: custom_mode(state.phase(), identity.boot_number),
        mavtype: MavType::MAV_TYPE_ROCKET,
        autopilot: MavAutopilot::MAV_AUTOPILOT_GENERIC,
        base_mode,
        system_status,
        mavlink_version: 3,
    })
}

fn sys_status(state: &VehicleState<'_>) -> MavMessage {
    use MavSysStatusSensor as S;
    let (sensors, silent) = motion::sensors(state);
    let mut present = sensors
        | S::MAV_SYS_STATUS_PREARM_CHECK
        | S::MAV_SYS_STATUS_SENSOR_ATTITUDE_STABILIZATION
        | S::MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS
        | S::MAV_SYS_STATUS_LOGGING;
    present.set(S::MAV_SYS_STATUS_SENSOR_BATTERY, state.battery.is_some());
    let checks_failed = state.checks_failed();
    let mut healthy = present - silent;
    healthy.set(S::MAV_SYS_STATUS_LOGGING, state.input().log.running);
    if TdCheck::from_bits_truncate(checks_failed).contains(TdCheck::TD_CHECK_BATTERY) {
        healthy -= S::MAV_SYS_STATUS_SENSOR_BATTERY;
    }
    healthy.set(S::MAV_SYS_STATUS_PREARM_CHECK, checks_failed == 0);
    let (voltage_battery, current_battery, battery_remaining) = figures(state);
    MavMessage::SYS_STATUS(SYS_STATUS_DATA {
        onboard_control_sensors_present: present,
        onboard_control_sensors_enabled: present,
        onboard_control_sensors_health: healthy,
        load: (1000.0 * state.solve_time_s() / PLAN_WITHIN_S).clamp(0.0, 1000.0) as u16,
        voltage_battery,
        current_battery,
        battery_remaining,
        // Explicitly empty: the generated default of a set of flags is its first flag.
        onboard_control_sensors_present_extended: MavSysStatusSensorExtended::empty(),
        onboard_control_sensors_enabled_extended: MavSysStatusSensorExtended::empty(),
        onboard_control_sensors_health_extended: MavSysStatusSensorExtended::empty(),
        ..SYS_STATUS_DATA::default()
    })
}

fn extended_sys_state(state: &VehicleState<'_>) -> MavMessage {
    let landed_state = match state.phase() {
        Phase::Safe | Phase::PadIdle | Phase::PadArmed | Phase::Touchdown | Phase::Safed => {
            MavLandedState::MAV_LANDED_STATE_ON_GROUND
        }
        Phase::Boost => MavLandedState::MAV_LANDED_STATE_TAKEOFF,
        Phase::LandArmed | Phase::Ignition | Phase::Powered => MavLandedState::MAV_LANDED_STATE_LANDING,
        Phase::Coast | Phase::Deploy | Phase::AeroDescent | Phase::Chute => {
            MavLandedState::MAV_LANDED_STATE_IN_AIR
        }
    };
    MavMessage::EXTENDED_SYS_STATE(EXTENDED_SYS_STATE_DATA {
        vtol_state: MavVtolState::MAV_VTOL_STATE_UNDEFINED,
        landed_state,
    })
}

fn attitude(state: &VehicleState<'_>) -> MavMessage {
    let motion = state.motion();
    let [q1, q2, q3, q4] = motion.ned_from_body.map(|part| part as f32);
    let [rollspeed, pitchspeed, yawspeed] = motion.rate_rad_s.map(|rate| rate as f32);
    MavMessage::ATTITUDE_QUATERNION(ATTITUDE_QUATERNION_DATA {
        time_boot_ms: boot_ms(state.time_s),
        q1,
        q2,
        q3,
        q4,
        rollspeed,
        pitchspeed,
        yawspeed,
        ..ATTITUDE_QUATERNION_DATA::default()
    })
}

fn position(state: &VehicleState<'_>) -> MavMessage {
    let motion = state.motion();
    let [x, y, z] = motion.position_m.map(|metres| metres as f32);
    let [vx, vy, vz] = motion.velocity_m_s.map(|speed| speed as f32);
    MavMessage::LOCAL_POSITION_NED(LOCAL_POSITION_NED_DATA {
        time_boot_ms: boot_ms(state.time_s),
        x,
        y,
        z,
        vx,
        vy,
        vz,
    })
}

fn vfr_hud(state: &VehicleState<'_>) -> MavMessage {
    let motion = state.motion();
    let [north_m_s, east_m_s, down_m_s] = motion.velocity_m_s;
    MavMessage::VFR_HUD(VFR_HUD_DATA {
        airspeed: motion.airspeed_m_s as f32,
        groundspeed: libm::hypot(north_m_s, east_m_s) as f32,
        // Above mean sea level, as the standard has it; LOCAL_POSITION_NED has the height above the
        // pad.
        alt: (state.mission().site.altitude_m - motion.position_m[2]) as f32,
        climb: -down_m_s as f32,
        heading: libm::round(motion::heading_deg(&motion.ned_from_body)) as i16 % 360,
        throttle: if state.thrust_n() > 0.0 { 100 } else { 0 },
    })
}

fn current_mode(state: &VehicleState<'_>, boot: u32) -> MavMessage {
    MavMessage::CURRENT_MODE(CURRENT_MODE_DATA {
        custom_mode: custom_mode(state.phase(), boot),
        standard_mode: MavStandardMode::MAV_STANDARD_MODE_NON_STANDARD,
        ..CURRENT_MODE_DATA::default()
    })
}

/// The unique id is below two letters, so that it is never zero.
fn autopilot_version(uid: u16) -> MavMessage {
    let version = env!("CARGO_PKG_VERSION").split('.').map(|part| part.parse::<u32>().unwrap_or(0));
    MavMessage::AUTOPILOT_VERSION(AUTOPILOT_VERSION_DATA {
        capabilities: MavProtocolCapability::MAV_PROTOCOL_CAPABILITY_MAVLINK2
            | MavProtocolCapability::MAV_PROTOCOL_CAPABILITY_COMMAND_INT
            | MavProtocolCapability::MAV_PROTOCOL_CAPABILITY_FLIGHT_TERMINATION
            | MavProtocolCapability::MAV_PROTOCOL_CAPABILITY_FTP
            | MavProtocolCapability::MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST,
        // Major, minor, patch, then 0 for a development version.
        flight_sw_version: version.take(3).fold(0, |packed, part| (packed << 8) | (part & 0xff)) << 8,
        uid: u64::from_be_bytes(*b"TD\0\0\0\0\0\0") | u64::from(uid),
        flight_custom_version: version_hash(),
        ..AUTOPILOT_VERSION_DATA::default()
    })
}

/// The first 8 bytes of the commit, as the standard has it; in a development build, which names
/// none, a hash of its version.
fn version_hash() -> [u8; 8] {
    let byte = |place: usize| u8::from_str_radix(GIT_COMMIT.get(2 * place..2 * place + 2)?, 16).ok();
    let bytes: Option<Vec<u8>> = (0..8).map(byte).collect();
    bytes
        .and_then(|bytes| bytes.first_chunk().copied())
        .unwrap_or_else(|| MissionHash::of(concat!("development build of ", env!("CARGO_PKG_VERSION"))).0)
}

/// MAVLink 2 and nothing older: 100 times the version.
#[expect(deprecated, reason = "the standard has dropped it; clients in use still ask")]
fn protocol_version() -> MavMessage {
    MavMessage::PROTOCOL_VERSION(PROTOCOL_VERSION_DATA {
        version: 200,
        min_version: 200,
        max_version: 200,
        ..PROTOCOL_VERSION_DATA::default()
    })
}

/// Outputs 1 to 4 the fins (0 closed, 1 fully deployed), 5 and 6 the gimbal (-1 to 1, stop to
/// stop).
fn actuators(state: &VehicleState<'_>) -> MavMessage {
    let mut actuator = [0.0; 32];
    for (output, angle_rad) in actuator.iter_mut().zip(state.input().fins_rad) {
        *output = (angle_rad / core::f64::consts::FRAC_PI_2) as f32;
    }
    let limit_rad = state.mission().airframe.gimbal.limit_rad();
    for (output, angle_rad) in actuator[4..].iter_mut().zip(state.input().gimbal_rad) {
        *output = (angle_rad / limit_rad) as f32;
    }
    MavMessage::ACTUATOR_OUTPUT_STATUS(ACTUATOR_OUTPUT_STATUS_DATA {
        time_usec: (1e6 * state.time_s) as u64,
        active: 0b11_1111,
        actuator,
    })
}

fn boot_ms(time_s: f64) -> u32 {
    libm::round(1000.0 * time_s) as u32
}

fn centidegrees(angle_rad: f64) -> i16 {
    libm::round(100.0 * angle_rad.to_degrees()) as i16
}

fn centimetres(length_m: f64) -> i16 {
    libm::round(100.0 * length_m) as i16
}

fn characters<const N: usize>(text: &str) -> CharArray<N> {
    let mut bytes = [0; N];
    for (place, byte) in bytes.iter_mut().zip(text.bytes()) {
        *place = byte;
    }
    CharArray::new(bytes)
}

// Battery and storage.

/// mV, cA and percent of the battery; `UINT16_MAX`, -1 and -1: not available.
fn figures(state: &VehicleState<'_>) -> (u16, i16, i8) {
    let Some(BatteryFacts { volts, current_a, left, .. }) = state.battery else { return (u16::MAX, -1, -1) };
    let hundred = |value: Option<f64>| value.map_or(-1.0, |value| libm::round(100.0 * value));
    (libm::round(1000.0 * volts) as u16, hundred(current_a) as i16, hundred(left) as i8)
}

/// Instance 0, the flight computer's pack; in every other second instance 1, that of servos and
/// igniters, if it is measured.
fn battery(state: &VehicleState<'_>) -> MavMessage {
    let mut voltages = [u16::MAX; 10];
    let servos = state.battery.and_then(|battery| battery.servo_volts);
    let servos = servos.filter(|_| libm::floor(state.time_s) % 2.0 > 0.5);
    let (millivolts, current_battery, battery_remaining) = match servos {
        Some(volts) => (libm::round(1000.0 * volts) as u16, -1, -1),
        None => figures(state),
    };
    voltages[0] = millivolts;
    MavMessage::BATTERY_STATUS(BATTERY_STATUS_DATA {
        id: u8::from(servos.is_some()),
        temperature: i16::MAX,
        voltages,
        current_battery,
        current_consumed: -1,
        energy_consumed: -1,
        battery_remaining,
        // The generated default is the first flag.
        fault_bitmask: MavBatteryFault::empty(),
        ..BATTERY_STATUS_DATA::default()
    })
}

/// `None` if the operator chose to fly without a log. Size and speed of the storage are not
/// available: 0.
fn storage(state: &VehicleState<'_>) -> Option<MavMessage> {
    let log = state.input().log;
    let has_storage = log.space_bytes != u64::MAX;
    has_storage.then(|| {
        MavMessage::STORAGE_INFORMATION(STORAGE_INFORMATION_DATA {
            time_boot_ms: boot_ms(state.time_s),
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

//! Readings, starts and answers as MAVLink messages.

use flight::computer::FRAME_MS;
use flight::vehicle::atmosphere::Air;
use hil::carried::{CarriedCommands, CarriedFix, CarriedReadings};
use hil::computer::Answer;
use hil::readings::Switches;
use hil::start::{Pace, Start};
use protocol::dialect::{
    DISTANCE_SENSOR_DATA, HIL_ACTUATOR_CONTROLS_DATA, HIL_GPS_DATA, HIL_SENSOR_DATA,
    HilActuatorControlsFlags, HilSensorUpdatedFlags, MavDistanceSensor, MavMessage, MavModeFlag,
    MavSensorOrientation, TD_HIL_COMPUTER_DATA, TD_HIL_START_DATA, TD_HIL_VEHICLE_DATA, TdHilPace,
    TdHilSwitch,
};
use protocol::mission::MissionHash;

use vehicle_link::telemetry::td_phase;

/// Length of a frame, us.
pub const FRAME_US: u64 = FRAME_MS as u64 * 1000;

/// HIL_SENSOR's flags for the inertial unit, which reports in every frame.
const INERTIAL: HilSensorUpdatedFlags = HilSensorUpdatedFlags::HIL_SENSOR_UPDATED_XACC
    .union(HilSensorUpdatedFlags::HIL_SENSOR_UPDATED_YACC)
    .union(HilSensorUpdatedFlags::HIL_SENSOR_UPDATED_ZACC)
    .union(HilSensorUpdatedFlags::HIL_SENSOR_UPDATED_XGYRO)
    .union(HilSensorUpdatedFlags::HIL_SENSOR_UPDATED_YGYRO)
    .union(HilSensorUpdatedFlags::HIL_SENSOR_UPDATED_ZGYRO);
/// Its flag for the barometer's height.
pub(super) const BAROMETER: HilSensorUpdatedFlags = HilSensorUpdatedFlags::HIL_SENSOR_UPDATED_PRESSURE_ALT;

/// Channels of HIL_ACTUATOR_CONTROLS. Servos are in quarter turns; a current that flows is 1.
pub mod channel {
    /// Gimbal pitch and yaw.
    pub const GIMBAL: usize = 0;
    /// Fins 1 to 4.
    pub const FINS: usize = 2;
    /// The landing motor's igniter.
    pub const IGNITE: usize = 6;
    pub const PARACHUTE: usize = 7;
    /// The ascent motor's igniter.
    pub const IGNITE_BOOSTER: usize = 8;
    pub const SEPARATE: usize = 9;
}

/// The message that begins a flight.
pub fn of_start(start: &Start, mission: MissionHash) -> MavMessage {
    let state = &start.believed;
    let attitude = state.world_from_body;
    MavMessage::TD_HIL_START(TD_HIL_START_DATA {
        position_m: state.position_m.into(),
        velocity_m_s: state.velocity_m_s.into(),
        world_from_body: [attitude.w, attitude.i, attitude.j, attitude.k],
        rate_rad_s: state.rate_rad_s.into(),
        flight_id: start.flight_id,
        mission_hash: mission.0,
        pace: match start.pace {
            Pace::Lockstep => TdHilPace::TD_HIL_PACE_LOCKSTEP,
            Pace::RealTime => TdHilPace::TD_HIL_PACE_REAL_TIME,
        },
    })
}

/// The messages of a frame, in the order in which they are sent.
pub fn of_frame(flight_id: u32, frame: u64, readings: &CarriedReadings) -> Vec<MavMessage> {
    let time_usec = frame * FRAME_US;
    let mut messages = Vec::with_capacity(4);
    messages.push(MavMessage::TD_HIL_VEHICLE(TD_HIL_VEHICLE_DATA {
        time_usec,
        gnss_time_usec: readings.fix.map_or(u64::MAX, |fix| fix.valid_at_us),
        flight_id,
        gimbal: readings.gimbal_rad,
        fins: readings.fins_rad,
        // The world simulates no supply.
        battery: u16::MAX,
        switches: of_switches(readings.switches),
        range: u8::from(readings.range_cm.is_some()),
    }));
    messages.extend(readings.fix.as_ref().map(of_fix));
    messages.extend(readings.range_cm.map(|range_cm| of_range(time_usec, range_cm)));
    messages.push(of_sensor(time_usec, readings));
    messages
}

fn of_switches(switches: Switches) -> TdHilSwitch {
    let Switches { contact, igniter_continuity, booster_attached, pin_out } = switches;
    let mut flags = TdHilSwitch::empty();
    flags.set(TdHilSwitch::TD_HIL_SWITCH_CONTACT, contact);
    flags.set(TdHilSwitch::TD_HIL_SWITCH_IGNITER, igniter_continuity);
    flags.set(TdHilSwitch::TD_HIL_SWITCH_BOOSTER, booster_attached);
    flags.set(TdHilSwitch::TD_HIL_SWITCH_PIN_OUT, pin_out);
    flags
}

fn of_fix(fix: &CarriedFix) -> MavMessage {
    let [vn, ve, vd] = fix.velocity_cm_s;
    MavMessage::HIL_GPS(HIL_GPS_DATA {
        time_usec: fix.valid_at_us,
        fix_type: 3,
        lat: fix.latitude_e7,
        lon: fix.longitude_e7,
        alt: fix.altitude_mm,
        eph: u16::MAX,
        epv: u16::MAX,
        vel: u16::MAX,
        vn,
        ve,
        vd,
        cog: u16::MAX,
        satellites_visible: u8::MAX,
        ..HIL_GPS_DATA::default()
    })
}

/// The lidar looks backwards along the body's axis.
fn of_range(time_usec: u64, range_cm: u16) -> MavMessage {
    MavMessage::DISTANCE_SENSOR(DISTANCE_SENSOR_DATA {
        time_boot_ms: (time_usec / 1000) as u32,
        min_distance: 0,
        max_distance: u16::MAX,
        current_distance: range_cm,
        mavtype: MavDistanceSensor::MAV_DISTANCE_SENSOR_LASER,
        orientation: MavSensorOrientation::MAV_SENSOR_ROTATION_PITCH_180,
        covariance: u8::MAX,
        ..DISTANCE_SENSOR_DATA::default()
    })
}

/// Body axes are MAVLink's: x to the nose, y right, z down. The pressure is for computers that do not use the height.
fn of_sensor(time_usec: u64, readings: &CarriedReadings) -> MavMessage {
    let [xgyro, ygyro, zgyro] = readings.gyro_rad_s;
    let [xacc, yacc, zacc] = readings.specific_force_m_s2;
    let inertial = HIL_SENSOR_DATA {
        time_usec,
        xacc,
        yacc,
        zacc,
        xgyro,
        ygyro,
        zgyro,
        fields_updated: INERTIAL,
        ..HIL_SENSOR_DATA::default()
    };
    MavMessage::HIL_SENSOR(match readings.pressure_altitude_m {
        None => inertial,
        Some(height_m) => {
            let air = Air::at_geopotential_m(f64::from(height_m));
            HIL_SENSOR_DATA {
                pressure_alt: height_m,
                abs_pressure: (0.01 * air.pressure_pa) as f32,
                fields_updated: INERTIAL
                    .union(BAROMETER)
                    .union(HilSensorUpdatedFlags::HIL_SENSOR_UPDATED_ABS_PRESSURE),
                ..inertial
            }
        }
    })
}

/// The messages of an answer, in the order in which they are sent.
pub fn of_answer(answer: &Answer, pace: Pace) -> Vec<MavMessage> {
    let time_usec = answer.frame * FRAME_US;
    let flags = match pace {
        Pace::Lockstep => HilActuatorControlsFlags::HIL_ACTUATOR_CONTROLS_FLAGS_LOCKSTEP,
        Pace::RealTime => HilActuatorControlsFlags::empty(),
    };
    vec![
        MavMessage::TD_HIL_COMPUTER(TD_HIL_COMPUTER_DATA {
            time_usec,
            digest: answer.digest,
            flight_id: answer.flight_id,
            frames_held: answer.held as u32,
            phase: td_phase(answer.phase),
        }),
        MavMessage::HIL_ACTUATOR_CONTROLS(HIL_ACTUATOR_CONTROLS_DATA {
            time_usec,
            flags,
            controls: of_commands(&answer.commands),
            mode: MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED | MavModeFlag::MAV_MODE_FLAG_HIL_ENABLED,
        }),
    ]
}

fn of_commands(commands: &CarriedCommands) -> [f32; 16] {
    let mut controls = [0.0; 16];
    controls[channel::GIMBAL..channel::FINS].copy_from_slice(&commands.gimbal_quarter_turns);
    controls[channel::FINS..channel::IGNITE].copy_from_slice(&commands.fins_quarter_turns);
    for (channel, current) in [
        (channel::IGNITE, commands.ignite),
        (channel::PARACHUTE, commands.parachute),
        (channel::IGNITE_BOOSTER, commands.booster.ignite),
        (channel::SEPARATE, commands.booster.separate),
    ] {
        controls[channel] = f32::from(u8::from(current));
    }
    controls
}

//! A vehicle's state as MAVLink messages.
//!
//! Frames: north-east-down, as in [`Motion`]; an upright rocket has 90 degrees of pitch. Values are narrowed to the
//! fields' types here and only here; what does not fit saturates.
//!
//! What is not modelled is told as MAVLink's "unknown", never invented: there is no battery in any craft.
//!
//! [`Motion`]: crate::craft::Motion

mod space;

use flight::phase::{Interlocks, Phase};
use mavlink::MessageData as _;
use mavlink::types::CharArray;
#[expect(deprecated, reason = "only [`protocol_version`] uses it")]
use protocol::dialect::PROTOCOL_VERSION_DATA;
use protocol::dialect::{
    ACTUATOR_OUTPUT_STATUS_DATA, ATTITUDE_QUATERNION_DATA, AUTOPILOT_VERSION_DATA, AVAILABLE_MODES_DATA,
    CURRENT_MODE_DATA, EXTENDED_SYS_STATE_DATA, HEARTBEAT_DATA, LOCAL_POSITION_NED_DATA, MavAutopilot,
    MavLandedState, MavMessage, MavModeFlag, MavModeProperty, MavProtocolCapability, MavStandardMode,
    MavState, MavSysStatusSensor, MavSysStatusSensorExtended, MavType, MavVtolState, SYS_STATUS_DATA,
    TD_CONTROLLER_DATA, TD_FINS_DATA, TD_FLIGHT_STATUS_DATA, TD_GIMBAL_DATA, TD_LANDING_VERDICT_DATA,
    TD_PREDICTED_PATH_DATA, TD_TOUCHDOWN_LIMITS_DATA, TD_TOUCHDOWN_PREDICTION_DATA, TdAbortEffect, TdCheck,
    TdControlLevel, TdInterlock, TdLimit, TdPhase, TdSolverStatus, VFR_HUD_DATA,
};

use crate::craft::{AbortEffect, PATH_POINTS, Snapshot};

/// Deprecated late in 2025, but still what some clients begin with.
const PROTOCOL_VERSION_ID: u32 = 300;

/// The message of this id as things stand, or `None` if the vehicle has none or nothing to say in it.
pub fn message(message_id: u32, snapshot: &Snapshot) -> Option<MavMessage> {
    match message_id {
        HEARTBEAT_DATA::ID => Some(heartbeat(snapshot)),
        SYS_STATUS_DATA::ID => Some(sys_status(snapshot)),
        EXTENDED_SYS_STATE_DATA::ID => Some(extended_sys_state(snapshot)),
        ATTITUDE_QUATERNION_DATA::ID => Some(attitude(snapshot)),
        LOCAL_POSITION_NED_DATA::ID => Some(position(snapshot)),
        VFR_HUD_DATA::ID => Some(vfr_hud(snapshot)),
        CURRENT_MODE_DATA::ID => Some(current_mode(snapshot)),
        AUTOPILOT_VERSION_DATA::ID => Some(autopilot_version()),
        PROTOCOL_VERSION_ID => Some(protocol_version()),
        ACTUATOR_OUTPUT_STATUS_DATA::ID => Some(actuators(snapshot)),
        TD_FLIGHT_STATUS_DATA::ID => Some(flight_status(snapshot)),
        TD_FINS_DATA::ID => Some(fins(snapshot)),
        TD_GIMBAL_DATA::ID => Some(gimbal(snapshot)),
        TD_CONTROLLER_DATA::ID => controller(snapshot),
        TD_TOUCHDOWN_PREDICTION_DATA::ID => touchdown_prediction(snapshot),
        TD_PREDICTED_PATH_DATA::ID => predicted_path(snapshot),
        TD_LANDING_VERDICT_DATA::ID => landing_verdict(snapshot),
        TD_TOUCHDOWN_LIMITS_DATA::ID => Some(touchdown_limits(snapshot)),
        _ => space::message(message_id, snapshot),
    }
}

/// One AVAILABLE_MODES a phase.
pub fn available_modes() -> impl Iterator<Item = MavMessage> {
    Phase::ALL.into_iter().map(|phase| {
        MavMessage::AVAILABLE_MODES(AVAILABLE_MODES_DATA {
            custom_mode: u32::from(phase.index()),
            properties: MavModeProperty::MAV_MODE_PROPERTY_NOT_USER_SELECTABLE,
            number_modes: Phase::ALL.len() as u8,
            mode_index: phase.index() + 1,
            standard_mode: MavStandardMode::MAV_STANDARD_MODE_NON_STANDARD,
            mode_name: characters(phase.name()),
        })
    })
}

fn heartbeat(snapshot: &Snapshot) -> MavMessage {
    let mut base_mode =
        MavModeFlag::MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | MavModeFlag::MAV_MODE_FLAG_AUTO_ENABLED;
    base_mode.set(MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED, snapshot.interlocks.armed);
    let system_status = match snapshot.phase {
        _ if snapshot.interlocks.abort_latched => MavState::MAV_STATE_FLIGHT_TERMINATION,
        _ if snapshot.interlocks.no_light_latched => MavState::MAV_STATE_EMERGENCY,
        Phase::Safe => MavState::MAV_STATE_BOOT,
        Phase::PadIdle | Phase::PadArmed | Phase::Touchdown | Phase::Safed => MavState::MAV_STATE_STANDBY,
        Phase::Chute => MavState::MAV_STATE_EMERGENCY,
        _ => MavState::MAV_STATE_ACTIVE,
    };
    MavMessage::HEARTBEAT(HEARTBEAT_DATA {
        custom_mode: u32::from(snapshot.phase.index()),
        mavtype: MavType::MAV_TYPE_ROCKET,
        autopilot: MavAutopilot::MAV_AUTOPILOT_GENERIC,
        base_mode,
        system_status,
        mavlink_version: 3,
    })
}

fn sys_status(snapshot: &Snapshot) -> MavMessage {
    let (sensors, silent) = space::sensors(snapshot);
    let present = MavSysStatusSensor::MAV_SYS_STATUS_PREARM_CHECK
        | MavSysStatusSensor::MAV_SYS_STATUS_SENSOR_ATTITUDE_STABILIZATION
        | MavSysStatusSensor::MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS
        | sensors;
    let mut healthy = present - silent;
    healthy.set(MavSysStatusSensor::MAV_SYS_STATUS_PREARM_CHECK, snapshot.checks_failed == 0);
    MavMessage::SYS_STATUS(SYS_STATUS_DATA {
        onboard_control_sensors_present: present,
        onboard_control_sensors_enabled: present,
        onboard_control_sensors_health: healthy,
        load: (1000.0 * snapshot.solve_time_s / snapshot.deadline_s).clamp(0.0, 1000.0) as u16,
        voltage_battery: u16::MAX,
        current_battery: -1,
        battery_remaining: -1,
        // Empty by name: the generated default of a set of flags is its first flag.
        onboard_control_sensors_present_extended: MavSysStatusSensorExtended::empty(),
        onboard_control_sensors_enabled_extended: MavSysStatusSensorExtended::empty(),
        onboard_control_sensors_health_extended: MavSysStatusSensorExtended::empty(),
        ..SYS_STATUS_DATA::default()
    })
}

fn extended_sys_state(snapshot: &Snapshot) -> MavMessage {
    let landed_state = match snapshot.phase {
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

fn attitude(snapshot: &Snapshot) -> MavMessage {
    let [q1, q2, q3, q4] = snapshot.motion.ned_from_body.map(|part| part as f32);
    let [rollspeed, pitchspeed, yawspeed] = snapshot.motion.rate_rad_s.map(|rate| rate as f32);
    MavMessage::ATTITUDE_QUATERNION(ATTITUDE_QUATERNION_DATA {
        time_boot_ms: boot_ms(snapshot.time_s),
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

fn position(snapshot: &Snapshot) -> MavMessage {
    let [x, y, z] = snapshot.motion.position_m.map(|metres| metres as f32);
    let [vx, vy, vz] = snapshot.motion.velocity_m_s.map(|speed| speed as f32);
    MavMessage::LOCAL_POSITION_NED(LOCAL_POSITION_NED_DATA {
        time_boot_ms: boot_ms(snapshot.time_s),
        x,
        y,
        z,
        vx,
        vy,
        vz,
    })
}

fn vfr_hud(snapshot: &Snapshot) -> MavMessage {
    let motion = &snapshot.motion;
    let [north_m_s, east_m_s, down_m_s] = motion.velocity_m_s;
    MavMessage::VFR_HUD(VFR_HUD_DATA {
        airspeed: motion.airspeed_m_s as f32,
        groundspeed: libm::hypot(north_m_s, east_m_s) as f32,
        alt: -motion.position_m[2] as f32,
        climb: -down_m_s as f32,
        heading: 0,
        throttle: if snapshot.thrust_n > 0.0 { 100 } else { 0 },
    })
}

fn current_mode(snapshot: &Snapshot) -> MavMessage {
    MavMessage::CURRENT_MODE(CURRENT_MODE_DATA {
        custom_mode: u32::from(snapshot.phase.index()),
        standard_mode: MavStandardMode::MAV_STANDARD_MODE_NON_STANDARD,
        ..CURRENT_MODE_DATA::default()
    })
}

fn autopilot_version() -> MavMessage {
    let version = env!("CARGO_PKG_VERSION").split('.').map(|part| part.parse::<u32>().unwrap_or(0));
    MavMessage::AUTOPILOT_VERSION(AUTOPILOT_VERSION_DATA {
        capabilities: MavProtocolCapability::MAV_PROTOCOL_CAPABILITY_MAVLINK2
            | MavProtocolCapability::MAV_PROTOCOL_CAPABILITY_COMMAND_INT
            | MavProtocolCapability::MAV_PROTOCOL_CAPABILITY_FLIGHT_TERMINATION
            | MavProtocolCapability::MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST,
        // Major, minor, patch, then 0 for a development version.
        flight_sw_version: version.take(3).fold(0, |packed, part| (packed << 8) | (part & 0xff)) << 8,
        ..AUTOPILOT_VERSION_DATA::default()
    })
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

/// Outputs 1 to 4 the fins (0 closed, 1 fully deployed), 5 and 6 the gimbal (-1 to 1, stop to stop).
fn actuators(snapshot: &Snapshot) -> MavMessage {
    let mut actuator = [0.0; 32];
    for (output, angle_rad) in actuator.iter_mut().zip(snapshot.fins_rad.1) {
        *output = (angle_rad / core::f64::consts::FRAC_PI_2) as f32;
    }
    for (output, (_, actual_rad)) in actuator[4..].iter_mut().zip(snapshot.gimbal_rad) {
        *output = (actual_rad / snapshot.gimbal_limit_rad) as f32;
    }
    MavMessage::ACTUATOR_OUTPUT_STATUS(ACTUATOR_OUTPUT_STATUS_DATA {
        time_usec: (1e6 * snapshot.time_s) as u64,
        active: 0b11_1111,
        actuator,
    })
}

fn flight_status(snapshot: &Snapshot) -> MavMessage {
    let seconds = snapshot.countdown_s.or(snapshot.since_ignition_s.map(|since_s| -since_s));
    let locks = snapshot.interlocks;
    MavMessage::TD_FLIGHT_STATUS(TD_FLIGHT_STATUS_DATA {
        time_boot_ms: boot_ms(snapshot.time_s),
        countdown_ms: seconds.map_or(i32::MAX, |s| (1000.0 * s).round() as i32),
        interlocks: interlocks(locks),
        checks_failed: TdCheck::from_bits_truncate(snapshot.checks_failed),
        pad_wait_s: snapshot.pad_wait_s.map_or(0, |s| s.ceil() as u16),
        phase: td_phase(snapshot.phase),
        abort_effect: match snapshot.abort_effect {
            AbortEffect::None => TdAbortEffect::TD_ABORT_EFFECT_NONE,
            AbortEffect::SafeOnPad => TdAbortEffect::TD_ABORT_EFFECT_SAFE_ON_PAD,
            AbortEffect::ChuteAtApogee => TdAbortEffect::TD_ABORT_EFFECT_CHUTE_AT_APOGEE,
            AbortEffect::ChuteNow => TdAbortEffect::TD_ABORT_EFFECT_CHUTE_NOW,
            AbortEffect::BurnOrInhibit => TdAbortEffect::TD_ABORT_EFFECT_BURN_OR_INHIBIT,
            AbortEffect::UprightOnly => TdAbortEffect::TD_ABORT_EFFECT_UPRIGHT_ONLY,
        },
    })
}

fn interlocks(locks: Interlocks) -> TdInterlock {
    let mut bits = TdInterlock::empty();
    bits.set(TdInterlock::TD_INTERLOCK_PIN_OUT, locks.pin_out);
    bits.set(TdInterlock::TD_INTERLOCK_ARMED, locks.armed);
    bits.set(TdInterlock::TD_INTERLOCK_MOTOR_INHIBITED, locks.landing_motor_inhibited);
    bits.set(TdInterlock::TD_INTERLOCK_ABORT_LATCHED, locks.abort_latched);
    bits.set(TdInterlock::TD_INTERLOCK_NO_LIGHT, locks.no_light_latched);
    bits.set(TdInterlock::TD_INTERLOCK_DEGRADED, locks.degraded);
    bits
}

fn td_phase(phase: Phase) -> TdPhase {
    match phase {
        Phase::Safe => TdPhase::TD_PHASE_SAFE,
        Phase::PadIdle => TdPhase::TD_PHASE_PAD_IDLE,
        Phase::PadArmed => TdPhase::TD_PHASE_PAD_ARMED,
        Phase::Boost => TdPhase::TD_PHASE_BOOST,
        Phase::Coast => TdPhase::TD_PHASE_COAST,
        Phase::Deploy => TdPhase::TD_PHASE_DEPLOY,
        Phase::AeroDescent => TdPhase::TD_PHASE_AERO_DESCENT,
        Phase::LandArmed => TdPhase::TD_PHASE_LAND_ARMED,
        Phase::Ignition => TdPhase::TD_PHASE_IGNITION,
        Phase::Powered => TdPhase::TD_PHASE_POWERED,
        Phase::Touchdown => TdPhase::TD_PHASE_TOUCHDOWN,
        Phase::Safed => TdPhase::TD_PHASE_SAFED,
        Phase::Chute => TdPhase::TD_PHASE_CHUTE,
    }
}

fn fins(snapshot: &Snapshot) -> MavMessage {
    let (commanded, measured) = snapshot.fins_rad;
    MavMessage::TD_FINS(TD_FINS_DATA {
        time_boot_ms: boot_ms(snapshot.time_s),
        commanded: commanded.map(centidegrees),
        measured: measured.map(centidegrees),
    })
}

fn gimbal(snapshot: &Snapshot) -> MavMessage {
    let [pitch, yaw] = snapshot.gimbal_rad;
    MavMessage::TD_GIMBAL(TD_GIMBAL_DATA {
        time_boot_ms: boot_ms(snapshot.time_s),
        pitch_commanded: centidegrees(pitch.0),
        pitch_measured: centidegrees(pitch.1),
        yaw_commanded: centidegrees(yaw.0),
        yaw_measured: centidegrees(yaw.1),
    })
}

fn controller(snapshot: &Snapshot) -> Option<MavMessage> {
    let controller = snapshot.controller.as_ref()?;
    let microseconds = |s: f64| (1e6 * s).round();
    Some(MavMessage::TD_CONTROLLER(TD_CONTROLLER_DATA {
        time_boot_ms: boot_ms(snapshot.time_s),
        tick: controller.tick as u32,
        cost: controller.cost as f32,
        kkt_stationarity: controller.kkt_stationarity as f32,
        kkt_feasibility: controller.kkt_feasibility as f32,
        thrust_scale: snapshot.thrust_scale as f32,
        solve_time_us: microseconds(snapshot.solve_time_s) as u32,
        deadline_margin_us: microseconds(snapshot.deadline_s - snapshot.solve_time_s) as i32,
        iterations: u16::try_from(controller.iterations).unwrap_or(u16::MAX),
        level: td_level(controller.level),
        solver_status: td_status(controller.status),
    }))
}

fn td_level(level: flight::controller::ControlLevel) -> TdControlLevel {
    use flight::controller::ControlLevel as L;
    match level {
        L::Idle => TdControlLevel::TD_CONTROL_LEVEL_IDLE,
        L::Rehearsal => TdControlLevel::TD_CONTROL_LEVEL_REHEARSAL,
        L::Converged => TdControlLevel::TD_CONTROL_LEVEL_CONVERGED,
        L::BestFeasible => TdControlLevel::TD_CONTROL_LEVEL_BEST_FEASIBLE,
        L::ShiftedPlan => TdControlLevel::TD_CONTROL_LEVEL_SHIFTED_PLAN,
        L::Stabiliser => TdControlLevel::TD_CONTROL_LEVEL_STABILISER,
    }
}

fn td_status(status: flight::nmpc::SolveStatus) -> TdSolverStatus {
    use flight::nmpc::SolveStatus as S;
    match status {
        S::NotRun => TdSolverStatus::TD_SOLVER_STATUS_NOT_RUN,
        S::Converged => TdSolverStatus::TD_SOLVER_STATUS_CONVERGED,
        S::IterationLimit => TdSolverStatus::TD_SOLVER_STATUS_ITERATION_LIMIT,
        S::Stalled => TdSolverStatus::TD_SOLVER_STATUS_STALLED,
        S::SubproblemFailed => TdSolverStatus::TD_SOLVER_STATUS_SUBPROBLEM_FAILED,
        S::NotLandable => TdSolverStatus::TD_SOLVER_STATUS_NOT_LANDABLE,
        S::BadInput => TdSolverStatus::TD_SOLVER_STATUS_BAD_INPUT,
    }
}

fn touchdown_prediction(snapshot: &Snapshot) -> Option<MavMessage> {
    let prediction = snapshot.prediction.as_ref()?;
    let end = &prediction.state;
    Some(MavMessage::TD_TOUCHDOWN_PREDICTION(TD_TOUCHDOWN_PREDICTION_DATA {
        time_boot_ms: boot_ms(snapshot.time_s),
        time_to_go_ms: (1000.0 * prediction.time_to_go_s).round() as i32,
        x_m: end.x_m as f32,
        altitude_m: end.z_m as f32,
        pitch_rad: end.theta_rad as f32,
        u_m_s: end.u_m_s as f32,
        w_m_s: end.w_m_s as f32,
        q_rad_s: end.q_rad_s as f32,
        limits_violated: TdLimit::from_bits_truncate(prediction.violations),
    }))
}

fn predicted_path(snapshot: &Snapshot) -> Option<MavMessage> {
    let path = snapshot.path.as_ref()?;
    let along = path.points_m.map(|(along_m, _)| centimetres(along_m));
    let altitude = path.points_m.map(|(_, up_m)| centimetres(up_m));
    let [x, altitude]: [[i16; PATH_POINTS]; 2] = [along, altitude];
    Some(MavMessage::TD_PREDICTED_PATH(TD_PREDICTED_PATH_DATA {
        time_boot_ms: boot_ms(snapshot.time_s),
        x,
        altitude,
        count: path.count as u8,
    }))
}

fn landing_verdict(snapshot: &Snapshot) -> Option<MavMessage> {
    let judged = snapshot.judged.as_ref()?;
    let impact = &judged.impact;
    Some(MavMessage::TD_LANDING_VERDICT(TD_LANDING_VERDICT_DATA {
        time_boot_ms: boot_ms(impact.time_s),
        x_m: impact.state.x_m as f32,
        altitude_m: impact.state.z_m as f32,
        pitch_rad: impact.state.theta_rad as f32,
        u_m_s: impact.state.u_m_s as f32,
        w_m_s: impact.state.w_m_s as f32,
        q_rad_s: impact.state.q_rad_s as f32,
        limits_violated: TdLimit::from_bits_truncate(judged.violations()),
        landed: u8::from(judged.landed),
    }))
}

fn touchdown_limits(snapshot: &Snapshot) -> MavMessage {
    let limits = &snapshot.limits;
    MavMessage::TD_TOUCHDOWN_LIMITS(TD_TOUCHDOWN_LIMITS_DATA {
        x_m: limits.x_m as f32,
        altitude_min_m: limits.altitude_min_m as f32,
        altitude_max_m: limits.altitude_max_m as f32,
        pitch_error_rad: limits.pitch_error_rad as f32,
        u_m_s: limits.u_m_s as f32,
        w_m_s: limits.w_m_s as f32,
        q_rad_s: limits.pitch_rate_rad_s as f32,
        gimbal_limit_rad: snapshot.gimbal_limit_rad as f32,
    })
}

fn boot_ms(time_s: f64) -> u32 {
    (1000.0 * time_s).round() as u32
}

fn centidegrees(angle_rad: f64) -> i16 {
    (100.0 * angle_rad.to_degrees()).round() as i16
}

fn centimetres(length_m: f64) -> i16 {
    (100.0 * length_m).round() as i16
}

fn characters<const N: usize>(text: &str) -> CharArray<N> {
    let mut bytes = [0; N];
    for (place, byte) in bytes.iter_mut().zip(text.bytes()) {
        *place = byte;
    }
    CharArray::new(bytes)
}

#[cfg(test)]
mod tests {
    use flight::nmpc::SolveStatus as S;
    use flight::profile::Profile;

    use super::*;
    use crate::craft::Craft as _;
    use crate::scatter::draw;
    use crate::vehicle::{DeadlinePolicy, Vehicle};

    /// The bits of `checks_failed` follow the order of the vehicle's checks: each bit's name begins its check's.
    #[test]
    fn the_dialect_names_the_arming_checks_in_their_order() {
        let profile = Profile::builtin("paper-calibrated").unwrap();
        let vehicle = Vehicle::new(&profile, draw(&profile, 1), DeadlinePolicy::Observe).unwrap();
        let checks = vehicle.arming_checks();
        let bits: Vec<_> = TdCheck::all().iter_names().collect();
        assert_eq!(bits.len(), checks.len());
        for (place, (check, (name, bit))) in checks.iter().zip(bits).enumerate() {
            assert_eq!(bit.bits(), 1 << place);
            let words = name.trim_start_matches("TD_CHECK_").to_lowercase().replace('_', " ");
            assert!(
                check.name.replace('-', " ").starts_with(&words),
                "bit {place}: {name} is not {}",
                check.name
            );
        }
    }

    #[test]
    fn phases_levels_and_statuses_have_the_same_numbers_on_the_wire_and_in_flight() {
        for phase in Phase::ALL {
            assert_eq!(td_phase(phase) as u32, u32::from(phase.index()));
        }
        for level in flight::controller::ControlLevel::ALL {
            assert_eq!(td_level(level) as u32, u32::from(level.index()));
        }
        for status in [
            S::NotRun,
            S::Converged,
            S::IterationLimit,
            S::Stalled,
            S::SubproblemFailed,
            S::NotLandable,
            S::BadInput,
        ] {
            assert_eq!(td_status(status) as u32, u32::from(status.index()));
        }
    }
}

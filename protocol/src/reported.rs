//! The state that a vehicle reports, as one record of the log. A station records it on reception.

use mavlink::MessageData as _;
use num_traits::FromPrimitive as _;

use crate::dialect::{
    HEARTBEAT_DATA, MavAutopilot, MavMessage, MavType, TD_BOOK_KEPT_DATA, TD_CONTROLLER_DATA, TD_EVENTS_DATA,
    TD_FINS_DATA, TD_FLIGHT_STATUS_DATA, TD_GIMBAL_DATA, TdPhase,
};
use crate::frame::Frame;
use crate::identity::PHASE_BITS;
use crate::log::v1::Telemetry;
use crate::motion::{Attitude, Deflection, Motion};

/// Whether a heartbeat is one that our vehicles send. Whether it is ours only its
/// `TD_FLIGHT_STATUS` shows.
pub fn may_be_ours(beat: &HEARTBEAT_DATA) -> bool {
    beat.autopilot == MavAutopilot::MAV_AUTOPILOT_GENERIC && beat.mavtype == MavType::MAV_TYPE_ROCKET
}

/// The phase in a HEARTBEAT; `None` if another autopilot has sent it.
pub fn phase_of(beat: &HEARTBEAT_DATA) -> Option<TdPhase> {
    phase_from_number(beat.custom_mode & ((1 << PHASE_BITS) - 1)).filter(|_| may_be_ours(beat))
}

/// The phase for the `custom_mode` of a HEARTBEAT; `None` for a number that is not in the dialect.
pub fn phase_from_number(number: u32) -> Option<TdPhase> {
    TdPhase::from_u32(number)
}

/// The boot named in a frame of one of our vehicles: in a HEARTBEAT above the phase, in our
/// messages in the first number. `None` if there is none.
pub fn boot_of(frame: &Frame) -> Option<u32> {
    let payload = frame.padded_payload();
    let number =
        |at: usize| u32::from_le_bytes([payload[at], payload[at + 1], payload[at + 2], payload[at + 3]]);
    let boot = match frame.message_id() {
        HEARTBEAT_DATA::ID => number(0) >> PHASE_BITS,
        // It begins with 64 bits.
        TD_BOOK_KEPT_DATA::ID => number(8),
        54_000..=54_099 => number(0),
        _ => 0,
    };
    (boot > 0).then_some(boot)
}

/// The event that begins a phase, as screens and reports name it; `None` on the pad.
pub fn event_of(phase: TdPhase) -> Option<&'static str> {
    Some(match phase {
        TdPhase::TD_PHASE_SAFE | TdPhase::TD_PHASE_PAD_IDLE | TdPhase::TD_PHASE_PAD_ARMED => return None,
        TdPhase::TD_PHASE_BOOST => "lift-off",
        TdPhase::TD_PHASE_COAST => "burnout",
        TdPhase::TD_PHASE_DEPLOY => "apogee",
        TdPhase::TD_PHASE_AERO_DESCENT => "falls",
        TdPhase::TD_PHASE_LAND_ARMED => "ready",
        TdPhase::TD_PHASE_IGNITION => "ignition",
        TdPhase::TD_PHASE_POWERED => "thrust",
        TdPhase::TD_PHASE_TOUCHDOWN => "touchdown",
        TdPhase::TD_PHASE_SAFED => "over",
        TdPhase::TD_PHASE_CHUTE => "parachute",
    })
}

/// An event of a flight: the entry of a phase.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "program", derive(serde::Serialize))]
pub struct FlightEvent {
    /// As screens and reports name it.
    pub name: &'static str,
    /// Time since the release, s.
    pub at_s: f64,
    /// Height of the feet above the pad, m.
    pub height_m: f64,
    #[cfg_attr(feature = "program", serde(skip))]
    pub phase: TdPhase,
}

/// The events of a flight, as far as the vehicle's reports have arrived.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReceivedEvents {
    boot_number: u32,
    /// In order of time.
    pub events: Vec<FlightEvent>,
}

impl ReceivedEvents {
    /// Takes a report. Events that a restarted flight computer no longer reports remain.
    pub fn take(&mut self, message: &TD_EVENTS_DATA) {
        if message.boot_number != self.boot_number {
            *self = Self { boot_number: message.boot_number, events: Vec::new() };
        }
        for (place, (at, height)) in message.at.into_iter().zip(message.height).enumerate() {
            let number = TdPhase::TD_PHASE_BOOST as u32 + place as u32;
            let phase = phase_from_number(number).filter(|_| message.entered >> number & 1 == 1);
            let Some((phase, name)) = phase.and_then(|phase| Some((phase, event_of(phase)?))) else {
                continue;
            };
            self.events.retain(|event| event.phase != phase);
            let (at_s, height_m) = (f64::from(at) / 100.0, f64::from(height) / 10.0);
            self.events.push(FlightEvent { name, at_s, height_m, phase });
        }
        self.events.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
    }
}

/// The last of each message that is part of the record.
#[derive(Debug, Clone, Default)]
pub struct ReportedState {
    phase: Option<TdPhase>,
    status: Option<TD_FLIGHT_STATUS_DATA>,
    attitude: Option<Attitude>,
    motion: Option<Motion>,
    /// Only height and climb.
    vertical: Option<Motion>,
    fins: Option<TD_FINS_DATA>,
    gimbal: Option<TD_GIMBAL_DATA>,
    controller: Option<TD_CONTROLLER_DATA>,
}

impl ReportedState {
    /// Takes a message of the vehicle. Returns whether it is part of the record.
    pub fn update(&mut self, message: &MavMessage) -> bool {
        match message {
            MavMessage::HEARTBEAT(data) => self.phase = phase_of(data).or(self.phase),
            MavMessage::TD_FLIGHT_STATUS(data) => {
                let booted = |before: &TD_FLIGHT_STATUS_DATA| before.boot_number != data.boot_number;
                if self.status.as_ref().is_some_and(booted) {
                    *self = Self::default();
                }
                self.phase = Some(data.phase);
                self.status = Some(data.clone());
            }
            // An invalid quaternion is ignored.
            MavMessage::ATTITUDE_QUATERNION(data) => self.attitude = Attitude::of(data).or(self.attitude),
            MavMessage::LOCAL_POSITION_NED(data) => self.motion = Some(Motion::of(data)),
            MavMessage::GLOBAL_POSITION_INT(data) => self.vertical = Some(Motion::of_global(data)),
            MavMessage::TD_FINS(data) => self.fins = Some(data.clone()),
            MavMessage::TD_GIMBAL(data) => self.gimbal = Some(data.clone()),
            MavMessage::TD_CONTROLLER(data) => self.controller = Some(data.clone()),
            _ => return false,
        }
        true
    }

    /// The complete state as one record, without data on the link.
    pub fn record(&self, time_s: f64) -> Telemetry {
        let motion = self.motion.or(self.vertical);
        let known = |value: f64| Some(value).filter(|value| value.is_finite());
        let fins: Vec<Deflection> = self
            .fins
            .iter()
            .flat_map(|fins| {
                fins.commanded
                    .iter()
                    .zip(&fins.measured)
                    .map(|(commanded, measured)| Deflection::of_centidegrees(*commanded, *measured))
            })
            .collect();
        let gimbal: Vec<Deflection> = self
            .gimbal
            .iter()
            .flat_map(|data| {
                [(data.pitch_commanded, data.pitch_measured), (data.yaw_commanded, data.yaw_measured)]
                    .map(|(commanded, measured)| Deflection::of_centidegrees(commanded, measured))
            })
            .collect();
        let controller = self.controller.as_ref();
        Telemetry {
            time_s,
            phase: self.phase.map(|phase| phase as u32),
            interlocks: self.status.as_ref().map(|status| u32::from(status.interlocks.bits())),
            countdown_ms: self
                .status
                .as_ref()
                .map(|status| status.countdown_ms)
                .filter(|left| *left != i32::MAX),
            north_m: motion.and_then(|motion| known(motion.x_m)),
            east_m: motion.and_then(|motion| known(motion.y_m)),
            altitude_m: motion.map(|motion| motion.altitude_m),
            north_m_s: motion.and_then(|motion| known(motion.vx_m_s)),
            east_m_s: motion.and_then(|motion| known(motion.vy_m_s)),
            climb_m_s: motion.map(|motion| motion.climb_m_s),
            tilt_rad: self.attitude.map(|attitude| attitude.tilt_rad),
            turn_rate_rad_s: self.attitude.map(|attitude| attitude.turn_rate_rad_s()),
            fin_commanded_rad: fins.iter().map(|fin| fin.commanded_rad).collect(),
            fin_measured_rad: fins.iter().map(|fin| fin.measured_rad).collect(),
            gimbal_commanded_rad: gimbal.iter().map(|angle| angle.commanded_rad).collect(),
            gimbal_measured_rad: gimbal.iter().map(|angle| angle.measured_rad).collect(),
            control_level: controller.map(|controller| controller.level as u32),
            solver_status: controller.map(|controller| controller.solver_status as u32),
            iterations: controller.map(|controller| u32::from(controller.iterations)),
            solve_time_s: controller.map(|controller| f64::from(controller.solve_time_us) * 1e-6),
            ..Telemetry::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dialect::{ATTITUDE_QUATERNION_DATA, LOCAL_POSITION_NED_DATA};

    /// The record of a vehicle that falls with 20 m/s, after rotations about its body axes: to its
    /// pitch, then a roll.
    fn falling(pitch_deg: f64, roll_deg: f64, sign: f64) -> Telemetry {
        let half = |angle_deg: f64| libm::sincos(angle_deg.to_radians() / 2.0);
        let ((sin_p, cos_p), (sin_r, cos_r)) = (half(pitch_deg), half(roll_deg));
        let [q1, q2, q3, q4] =
            [cos_p * cos_r, cos_p * sin_r, sin_p * cos_r, -sin_p * sin_r].map(|part| (sign * part) as f32);
        let mut reported = ReportedState::default();
        let attitude = ATTITUDE_QUATERNION_DATA { q1, q2, q3, q4, ..Default::default() };
        reported.update(&MavMessage::ATTITUDE_QUATERNION(attitude));
        let position = LOCAL_POSITION_NED_DATA { vz: 20.0, ..Default::default() };
        reported.update(&MavMessage::LOCAL_POSITION_NED(position));
        reported.record(0.0)
    }

    /// A report is of one boot; what a restarted computer of that boot no longer reports remains.
    #[test]
    fn events_are_merged_within_a_boot_and_dropped_with_it() {
        let report = |boot_number, phase: TdPhase, at| {
            let mut data = TD_EVENTS_DATA { boot_number, entered: 1 << phase as u16, ..Default::default() };
            let place = phase as usize - TdPhase::TD_PHASE_BOOST as usize;
            (data.at[place], data.height[place]) = (at, 514);
            data
        };
        let mut received = ReceivedEvents::default();
        received.take(&report(1, TdPhase::TD_PHASE_IGNITION, 1_471));
        received.take(&report(1, TdPhase::TD_PHASE_DEPLOY, 724));
        let found: Vec<_> = received.events.iter().map(|event| (event.name, event.at_s)).collect();
        assert_eq!(found, [("apogee", 7.24), ("ignition", 14.71)]);
        received.take(&report(2, TdPhase::TD_PHASE_CHUTE, 900));
        assert_eq!(received.events.iter().map(|event| event.name).collect::<Vec<_>>(), ["parachute"]);
    }

    /// A roll does not change where the nose points, and both signs of a quaternion are one
    /// attitude.
    #[test]
    fn tilt_does_not_depend_on_the_roll() {
        for roll_deg in [0.0, 50.0, 180.0, 300.0] {
            for sign in [1.0, -1.0] {
                let record = falling(60.0, roll_deg, sign);
                let near = |found: Option<f64>, expected: f64| {
                    assert!((found.unwrap() - expected).abs() < 1e-5, "{found:?}, not {expected}");
                };
                near(record.tilt_rad, 30.0_f64.to_radians());
                near(record.climb_m_s, -20.0);
            }
        }
    }
}

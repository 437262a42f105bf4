//! The vehicle's end of MAVLink, without sockets: frames in, frames out.
//!
//! Telemetry is scheduled within a radio's budget; answers and texts go first and count against it.

use flight::phase::Phase;
use mavlink::MessageData as _;
use protocol::command::{CommandAnswer, CommandRequest};
#[expect(deprecated, reason = "only [`pong`] uses it")]
use protocol::dialect::PING_DATA;
use protocol::dialect::{
    ATTITUDE_QUATERNION_DATA, AVAILABLE_MODES_DATA, EXTENDED_SYS_STATE_DATA, HEARTBEAT_DATA,
    LOCAL_POSITION_NED_DATA, MESSAGE_INTERVAL_DATA, MavMessage, MavResult, MavSeverity, SYS_STATUS_DATA,
    TD_CONTROLLER_DATA, TD_FINS_DATA, TD_FLIGHT_STATUS_DATA, TD_GIMBAL_DATA, TD_LANDING_VERDICT_DATA,
    TD_PREDICTED_PATH_DATA, TD_TOUCHDOWN_PREDICTION_DATA, TIMESYNC_DATA, VFR_HUD_DATA,
};
use protocol::frame::{Encoder, Frame};
use protocol::identity::{Address, RADIO_BUDGET_BYTES_S, VEHICLE};
use protocol::text;

use crate::commands::{self, Command};
use crate::telemetry;
use crate::vehicle::{Severity, Snapshot, Vehicle, VehicleEvent};

/// Bytes around a payload: header and checksum.
const FRAME_OVERHEAD: usize = 12;
/// Unsent telemetry may save up this much of the budget for a burst.
const BURST_BYTES: f64 = 400.0;

/// A message that is sent by itself, with its longest payload and its default rate.
struct Standard {
    message_id: u32,
    payload_len: usize,
    rate_hz: f64,
}

const fn standard(message_id: u32, payload_len: usize, rate_hz: f64) -> Standard {
    Standard { message_id, payload_len, rate_hz }
}

/// What is sent unasked. In the order in which it is given up when the budget runs short: last first.
const STANDARD: [Standard; 13] = [
    standard(HEARTBEAT_DATA::ID, HEARTBEAT_DATA::ENCODED_LEN, 1.0),
    standard(TD_FLIGHT_STATUS_DATA::ID, TD_FLIGHT_STATUS_DATA::ENCODED_LEN, 5.0),
    standard(TD_LANDING_VERDICT_DATA::ID, TD_LANDING_VERDICT_DATA::ENCODED_LEN, 1.0),
    // Without its optional offset quaternion, which is never set and therefore cut.
    standard(ATTITUDE_QUATERNION_DATA::ID, 32, 10.0),
    standard(LOCAL_POSITION_NED_DATA::ID, LOCAL_POSITION_NED_DATA::ENCODED_LEN, 10.0),
    standard(TD_GIMBAL_DATA::ID, TD_GIMBAL_DATA::ENCODED_LEN, 10.0),
    standard(TD_CONTROLLER_DATA::ID, TD_CONTROLLER_DATA::ENCODED_LEN, 5.0),
    standard(TD_FINS_DATA::ID, TD_FINS_DATA::ENCODED_LEN, 2.0),
    standard(TD_TOUCHDOWN_PREDICTION_DATA::ID, TD_TOUCHDOWN_PREDICTION_DATA::ENCODED_LEN, 2.0),
    standard(TD_PREDICTED_PATH_DATA::ID, TD_PREDICTED_PATH_DATA::ENCODED_LEN, 1.0),
    standard(SYS_STATUS_DATA::ID, SYS_STATUS_DATA::ENCODED_LEN, 1.0),
    standard(EXTENDED_SYS_STATE_DATA::ID, EXTENDED_SYS_STATE_DATA::ENCODED_LEN, 1.0),
    standard(VFR_HUD_DATA::ID, VFR_HUD_DATA::ENCODED_LEN, 1.0),
];

#[derive(Debug, Clone, Copy)]
struct Stream {
    message_id: u32,
    payload_len: usize,
    default_interval_s: f64,
    /// `None`: switched off.
    interval_s: Option<f64>,
    due_s: f64,
}

impl Stream {
    fn bytes_s(&self, interval_s: Option<f64>) -> f64 {
        interval_s.map_or(0.0, |interval_s| (self.payload_len + FRAME_OVERHEAD) as f64 / interval_s)
    }
}

/// The vehicle's end of its links.
pub struct VehicleEndpoint {
    encoder: Encoder,
    streams: Vec<Stream>,
    /// Answers and texts that wait to be sent.
    urgent: Vec<Frame>,
    text_id: u16,
    credit_bytes: f64,
    last_poll_s: f64,
    warned_of_twin: bool,
}

impl Default for VehicleEndpoint {
    fn default() -> Self {
        Self::new()
    }
}

impl VehicleEndpoint {
    /// With the standard messages at their default rates.
    pub fn new() -> Self {
        let streams = STANDARD.iter().enumerate().map(|(place, standard)| Stream {
            message_id: standard.message_id,
            payload_len: standard.payload_len,
            default_interval_s: 1.0 / standard.rate_hz,
            interval_s: Some(1.0 / standard.rate_hz),
            // Spread, so that the slow ones do not all fall into the same instant.
            due_s: 0.02 * place as f64,
        });
        Self {
            encoder: Encoder::new(VEHICLE),
            streams: streams.collect(),
            urgent: Vec::new(),
            text_id: 0,
            credit_bytes: BURST_BYTES,
            last_poll_s: 0.0,
            warned_of_twin: false,
        }
    }

    /// Takes a frame from a link and acts on it; the answers come out of [`VehicleEndpoint::poll`].
    pub fn on_frame(&mut self, frame: &Frame, vehicle: &mut Vehicle) {
        if frame.source() == VEHICLE {
            if !self.warned_of_twin {
                self.warned_of_twin = true;
                self.say(Severity::Warning, "another system 1 component 1 is on this link");
            }
            return;
        }
        if let Some(request) = CommandRequest::from_frame(frame) {
            if VEHICLE.accepts(request.target) {
                self.on_command(&request, vehicle);
            }
            return;
        }
        match frame.decode() {
            Ok(MavMessage::TIMESYNC(sync)) if sync.tc1 == 0 => {
                let answer = TIMESYNC_DATA {
                    tc1: (1e9 * vehicle.time_s()) as i64,
                    ts1: sync.ts1,
                    target_system: frame.source().system_id,
                    target_component: frame.source().component_id,
                };
                self.answer(&MavMessage::TIMESYNC(answer));
            }
            #[expect(deprecated, reason = "older ground stations still measure their round trip with PING")]
            Ok(MavMessage::PING(ping)) if ping.target_system == 0 => {
                let answer = PING_DATA {
                    target_system: frame.source().system_id,
                    target_component: frame.source().component_id,
                    ..ping
                };
                self.answer(&MavMessage::PING(answer));
            }
            Ok(message) => {
                if let Some(pong) = pong(&message, frame.source()) {
                    self.answer(&pong);
                }
            }
            // Nothing we know: no answer is better than a guess.
            Err(_) => {}
        }
    }

    /// Takes note of what the vehicle reports.
    pub fn on_event(&mut self, event: &VehicleEvent) {
        match event {
            VehicleEvent::Text { severity, text } => self.say(*severity, text),
            VehicleEvent::PhaseChanged { .. } => {
                // The crew learns of a new phase at once, by the two messages that carry it.
                self.hurry(HEARTBEAT_DATA::ID);
                self.hurry(TD_FLIGHT_STATUS_DATA::ID);
            }
            VehicleEvent::Verdict { .. } => self.hurry(TD_LANDING_VERDICT_DATA::ID),
            VehicleEvent::Tick(_) => {}
        }
    }

    /// What is to be sent now.
    pub fn poll(&mut self, snapshot: &Snapshot) -> Vec<Frame> {
        let now_s = snapshot.time_s;
        let earned = f64::from(RADIO_BUDGET_BYTES_S) * (now_s - self.last_poll_s).max(0.0);
        self.credit_bytes = (self.credit_bytes + earned).min(BURST_BYTES);
        self.last_poll_s = now_s;
        let mut frames = std::mem::take(&mut self.urgent);
        for stream in &mut self.streams {
            let Some(interval_s) = stream.interval_s else {
                continue;
            };
            if now_s < stream.due_s {
                continue;
            }
            let pending: usize = frames.iter().map(|frame| frame.as_bytes().len()).sum();
            // The heartbeat is what the ground believes us alive by: it is never held back.
            if self.credit_bytes < pending as f64 && stream.message_id != HEARTBEAT_DATA::ID {
                continue;
            }
            if let Some(message) = telemetry::message(stream.message_id, snapshot) {
                frames.push(self.encoder.encode(&message));
            }
            // From when it was due, not from now, or the frame grid would eat into the rate.
            stream.due_s = (stream.due_s + interval_s).max(now_s);
        }
        let sent: usize = frames.iter().map(|frame| frame.as_bytes().len()).sum();
        self.credit_bytes -= sent as f64;
        frames
    }

    fn on_command(&mut self, request: &CommandRequest, vehicle: &mut Vehicle) {
        let (result, reason) = match commands::parse(request) {
            Err(unfit) => (unfit.result, unfit.reason),
            Ok(Command::Vehicle(asked)) => {
                // The vehicle says its reason itself, for the log and every ground.
                (commands::mav_result(&vehicle.request(asked)), None)
            }
            Ok(Command::SetInterval { message_id, interval_us }) => {
                self.set_interval(message_id, interval_us)
            }
            Ok(Command::SendMessage { message_id, of }) => self.send_message(message_id, of, vehicle),
        };
        if let Some(frame) = CommandAnswer::to(request, result).encode(&mut self.encoder) {
            self.urgent.push(frame);
        }
        if let Some(reason) = reason {
            self.say(Severity::Warning, &reason);
        }
    }

    fn set_interval(&mut self, message_id: u32, interval_us: f32) -> (MavResult, Option<String>) {
        let Some(place) = self.streams.iter().position(|stream| stream.message_id == message_id) else {
            return (
                MavResult::MAV_RESULT_FAILED,
                Some(format!("message {message_id} is not sent by this vehicle")),
            );
        };
        let wanted = match interval_us {
            -1.0 => None,
            0.0 => Some(self.streams[place].default_interval_s),
            us if us >= 1.0 => Some(f64::from(us) * 1e-6),
            _ => {
                let reason =
                    format!("interval {interval_us} us: must be -1 (off), 0 (default) or 1 and above");
                return (MavResult::MAV_RESULT_DENIED, Some(reason));
            }
        };
        let others: f64 = self
            .streams
            .iter()
            .enumerate()
            .filter(|(other, _)| *other != place)
            .map(|(_, stream)| stream.bytes_s(stream.interval_s))
            .sum();
        let total = others + self.streams[place].bytes_s(wanted);
        if wanted.is_some() && total > f64::from(RADIO_BUDGET_BYTES_S) {
            let reason = format!(
                "message {message_id}: {total:.0} B/s in all, the link's budget is {RADIO_BUDGET_BYTES_S}"
            );
            return (MavResult::MAV_RESULT_DENIED, Some(reason));
        }
        self.streams[place].interval_s = wanted;
        (MavResult::MAV_RESULT_ACCEPTED, None)
    }

    fn send_message(&mut self, message_id: u32, of: u32, vehicle: &Vehicle) -> (MavResult, Option<String>) {
        if message_id == AVAILABLE_MODES_DATA::ID {
            // 0 asks for all of them, k for the k-th.
            for (place, message) in telemetry::available_modes().enumerate() {
                if of == 0 || of as usize == place + 1 {
                    self.answer(&message);
                }
            }
            let known = of as usize <= Phase::ALL.len();
            return (if known { MavResult::MAV_RESULT_ACCEPTED } else { MavResult::MAV_RESULT_DENIED }, None);
        }
        if message_id == MESSAGE_INTERVAL_DATA::ID {
            let interval = self.streams.iter().find(|stream| stream.message_id == of).map(|s| s.interval_s);
            let interval_us = match interval {
                Some(Some(interval_s)) => (1e6 * interval_s).round() as i32,
                Some(None) => -1,
                // As the standard has it: 0 means the message is not available.
                None => 0,
            };
            let message_id = u16::try_from(of).unwrap_or(u16::MAX);
            self.answer(&MavMessage::MESSAGE_INTERVAL(MESSAGE_INTERVAL_DATA { interval_us, message_id }));
            return (MavResult::MAV_RESULT_ACCEPTED, None);
        }
        match telemetry::message(message_id, &vehicle.snapshot()) {
            Some(message) => {
                self.answer(&message);
                (MavResult::MAV_RESULT_ACCEPTED, None)
            }
            None => (MavResult::MAV_RESULT_UNSUPPORTED, None),
        }
    }

    fn answer(&mut self, message: &MavMessage) {
        let frame = self.encoder.encode(message);
        self.urgent.push(frame);
    }

    fn say(&mut self, severity: Severity, words: &str) {
        self.text_id = self.text_id.wrapping_add(1).max(1);
        let severity = match severity {
            Severity::Info => MavSeverity::MAV_SEVERITY_INFO,
            Severity::Notice => MavSeverity::MAV_SEVERITY_NOTICE,
            Severity::Warning => MavSeverity::MAV_SEVERITY_WARNING,
            Severity::Error => MavSeverity::MAV_SEVERITY_ERROR,
            Severity::Critical => MavSeverity::MAV_SEVERITY_CRITICAL,
        };
        for chunk in text::chunks(severity, words, self.text_id) {
            self.answer(&MavMessage::STATUSTEXT(chunk));
        }
    }

    fn hurry(&mut self, message_id: u32) {
        for stream in self.streams.iter_mut().filter(|stream| stream.message_id == message_id) {
            stream.due_s = f64::NEG_INFINITY;
        }
    }
}

/// The answer to a PING that asks for one. Deprecated, but older ground stations still measure with it.
#[expect(deprecated, reason = "the standard has replaced PING by TIMESYNC; older ground stations have not")]
fn pong(message: &MavMessage, asker: Address) -> Option<MavMessage> {
    let MavMessage::PING(ping) = message else {
        return None;
    };
    let (target_system, target_component) = (asker.system_id, asker.component_id);
    (ping.target_system == 0)
        .then(|| MavMessage::PING(PING_DATA { target_system, target_component, ..ping.clone() }))
}

#[cfg(test)]
mod tests;

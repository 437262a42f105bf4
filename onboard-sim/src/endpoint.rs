//! The vehicle's end of MAVLink, without sockets: frames in, frames out.
//!
//! Telemetry is scheduled within a radio's budget; answers and texts go first and count against it.

mod latch;
mod questions;
mod uplink;

use std::collections::{BTreeSet, VecDeque};

use flight::phase::Phase;
use mavlink::MessageData as _;
use protocol::command::{CommandAnswer, CommandRequest};
#[expect(deprecated, reason = "only [`pong`] uses it")]
use protocol::dialect::PING_DATA;
use protocol::dialect::{
    AVAILABLE_MODES_DATA, HEARTBEAT_DATA, MESSAGE_INTERVAL_DATA, MavMessage, MavResult, MavSeverity,
    TD_FLIGHT_STATUS_DATA, TD_LANDING_VERDICT_DATA, TD_TOUCHDOWN_LIMITS_DATA, TIMESYNC_DATA,
};
use protocol::frame::{Encoder, Frame, SIGNATURE_LEN};
use protocol::identity::{Address, RADIO_BUDGET_BYTES_S, VEHICLE};
use protocol::signing::Rejection;
use protocol::text;

use crate::commands::{self, Command};
use crate::craft::{Craft, Request, Severity, VehicleEvent};
use crate::stations::Stations;
use crate::streams::{STANDARD, Standard, Streams};
use crate::telemetry;

/// Unsent telemetry may save up this much of the budget for a burst.
const BURST_BYTES: f64 = 400.0;

/// Requested messages that may wait; more are refused for the time being.
const MAX_REQUESTED: usize = 32;
/// Commands that were not believed are spoken of this often at most.
const REJECTED_SAID_EVERY_S: f64 = 5.0;
/// Sources that are greeted; a forged flood of ids cannot grow memory.
const MAX_KNOWN: usize = 16;
/// The vehicle's end of its links.
pub struct VehicleEndpoint {
    encoder: Encoder,
    /// What a signature adds to every frame, bytes; 0 without a key.
    signature_len: usize,
    streams: Streams,
    /// Answers and texts that wait to be sent.
    urgent: Vec<Frame>,
    /// Messages that were asked for; they wait for room in the budget.
    requested: VecDeque<MavMessage>,
    /// The next parameter of a list that was asked for; none when the list has been sent.
    next_parameter: Option<u16>,
    text_id: u16,
    credit_bytes: f64,
    last_poll_s: f64,
    warned_of_twin: bool,
    say_rejected_after_s: f64,
    /// Who is heard, and how well.
    stations: Stations,
    /// The vehicle starts by itself: no station has to be heard.
    starts_by_itself: bool,
    /// Aborts that were taken and are answered once their latch is seen.
    latching: Vec<CommandRequest>,
    /// Whoever has sent anything yet; a newcomer is told the limits at once.
    known: BTreeSet<Address>,
}

impl Default for VehicleEndpoint {
    fn default() -> Self {
        Self::new()
    }
}

impl VehicleEndpoint {
    /// With the standard messages of the planar vehicle at their default rates.
    pub fn new() -> Self {
        Self::sending(&STANDARD)
    }

    /// With these messages at their default rates.
    pub fn sending(standard: &'static [Standard]) -> Self {
        Self {
            encoder: Encoder::new(VEHICLE),
            signature_len: 0,
            streams: Streams::of(standard),
            urgent: Vec::new(),
            requested: VecDeque::new(),
            next_parameter: None,
            text_id: 0,
            credit_bytes: BURST_BYTES,
            last_poll_s: 0.0,
            warned_of_twin: false,
            say_rejected_after_s: 0.0,
            stations: Stations::default(),
            starts_by_itself: false,
            latching: Vec::new(),
            known: BTreeSet::new(),
        }
    }

    /// The same where every frame will be signed, and is longer for it.
    pub fn sending_signed(standard: &'static [Standard]) -> Self {
        let streams = Streams::signed(standard);
        Self { signature_len: SIGNATURE_LEN, streams, ..Self::sending(standard) }
    }

    /// Takes a frame from a link and acts on it; the answers come out of [`VehicleEndpoint::poll`].
    pub fn on_frame(&mut self, frame: &Frame, vehicle: &mut dyn Craft) {
        if frame.source() == VEHICLE {
            if !self.warned_of_twin {
                self.warned_of_twin = true;
                self.say(Severity::Warning, "another system 1 component 1 is on this link");
            }
            return;
        }
        self.stations.accepted(frame, vehicle.time_s());
        if self.known.len() < MAX_KNOWN && self.known.insert(frame.source()) {
            self.streams.hurry(TD_TOUCHDOWN_LIMITS_DATA::ID);
        }
        if let Some(request) = CommandRequest::from_frame(frame) {
            if VEHICLE.accepts(request.target) {
                self.on_command(&request, vehicle);
            }
            return;
        }
        if self.on_question(frame, vehicle) {
            return;
        }
        match frame.decode() {
            Ok(MavMessage::TIMESYNC(sync))
                if sync.tc1 == 0 && is_for_us(sync.target_system, sync.target_component) =>
            {
                let answer = TIMESYNC_DATA {
                    tc1: (1e9 * vehicle.time_s()) as i64,
                    ts1: sync.ts1,
                    target_system: frame.source().system_id,
                    target_component: frame.source().component_id,
                };
                self.answer(&MavMessage::TIMESYNC(answer));
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

    /// Says that a command was not believed; now and then, because a flood of them must not fill the radio. It is not
    /// acknowledged: a forger could have the true ground's own command answered by it.
    pub fn on_rejected(&mut self, frame: &Frame, why: Rejection) {
        self.stations.refused(frame.source(), why, self.last_poll_s);
        let Some(request) = CommandRequest::from_frame(frame).filter(|asked| VEHICLE.accepts(asked.target))
        else {
            return;
        };
        if self.last_poll_s < self.say_rejected_after_s {
            return;
        }
        self.say_rejected_after_s = self.last_poll_s + REJECTED_SAID_EVERY_S;
        let Address { system_id, component_id } = request.source;
        let words = format!("command {} from {system_id}/{component_id} refused: {why}", request.command);
        self.say(Severity::Warning, &words);
    }

    /// Takes note of what the vehicle reports.
    pub fn on_event(&mut self, event: &VehicleEvent) {
        match event {
            VehicleEvent::Text { severity, text } => self.say(*severity, text),
            VehicleEvent::PhaseChanged { .. } => {
                // The crew learns of a new phase at once, by the two messages that carry it.
                self.streams.hurry(HEARTBEAT_DATA::ID);
                self.streams.hurry(TD_FLIGHT_STATUS_DATA::ID);
            }
            VehicleEvent::Verdict { .. } => self.streams.hurry(TD_LANDING_VERDICT_DATA::ID),
            VehicleEvent::Tick(_) | VehicleEvent::Planned { .. } => {}
        }
    }

    /// What is to be sent now.
    pub fn poll(&mut self, vehicle: &dyn Craft) -> Vec<Frame> {
        let now_s = vehicle.time_s();
        // In most frames nothing is due, and the state is not put together for nothing.
        let mut snapshot = None;
        let earned = f64::from(RADIO_BUDGET_BYTES_S) * (now_s - self.last_poll_s).max(0.0);
        self.credit_bytes = (self.credit_bytes + earned).min(BURST_BYTES);
        self.last_poll_s = now_s;
        self.answer_latched(vehicle);
        let mut frames = std::mem::take(&mut self.urgent);
        for message in self.stations.due(now_s) {
            frames.push(self.encoder.encode(&message));
        }
        for message_id in self.streams.due(now_s) {
            let pending = self.bytes_of(&frames);
            // The heartbeat is what the ground believes us alive by: it is never held back.
            if self.credit_bytes < pending as f64 && message_id != HEARTBEAT_DATA::ID {
                continue;
            }
            let snapshot = snapshot.get_or_insert_with(|| vehicle.snapshot());
            if let Some(message) = telemetry::message(message_id, snapshot) {
                frames.push(self.encoder.encode(&message));
            }
            self.streams.on_sent(message_id, now_s);
        }
        let mut sent = self.bytes_of(&frames);
        // What was asked for comes after what the crew lives by.
        while self.credit_bytes >= sent as f64
            && let Some(message) = self.next_requested(vehicle)
        {
            let frame = self.encoder.encode(&message);
            sent += frame.as_bytes().len() + self.signature_len;
            frames.push(frame);
        }
        // A flood of commands, each answered, must not silence telemetry for longer than a burst.
        self.credit_bytes = (self.credit_bytes - sent as f64).max(-BURST_BYTES);
        frames
    }

    fn bytes_of(&self, frames: &[Frame]) -> usize {
        frames.iter().map(|frame| frame.as_bytes().len() + self.signature_len).sum()
    }

    fn on_command(&mut self, request: &CommandRequest, vehicle: &mut dyn Craft) {
        let (result, reason) = match commands::parse(request) {
            Err(unfit) => (unfit.result, unfit.reason),
            Ok(Command::Vehicle(asked)) => {
                let answer = self.put(asked, request.source, vehicle);
                let result = commands::mav_result(&answer);
                if asked == Request::Abort && result == MavResult::MAV_RESULT_ACCEPTED && !vehicle.aborted() {
                    self.answer_when_latched(request);
                    return;
                }
                // The vehicle says its reason itself, for the log and every ground.
                (result, None)
            }
            Ok(Command::SetInterval { message_id, interval_us }) => {
                self.streams.set_interval(message_id, interval_us, self.last_poll_s)
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

    fn send_message(&mut self, message_id: u32, of: u32, vehicle: &dyn Craft) -> (MavResult, Option<String>) {
        let messages: Vec<MavMessage> = match message_id {
            // 0 asks for all of them, k for the k-th.
            AVAILABLE_MODES_DATA::ID if of as usize > Phase::ALL.len() => {
                let reason = format!("mode {of}: there are {}", Phase::ALL.len());
                return (MavResult::MAV_RESULT_DENIED, Some(reason));
            }
            AVAILABLE_MODES_DATA::ID => telemetry::available_modes()
                .enumerate()
                .filter(|(place, _)| of == 0 || of as usize == place + 1)
                .map(|(_, message)| message)
                .collect(),
            MESSAGE_INTERVAL_DATA::ID => vec![self.streams.interval_of(of)],
            _ => telemetry::message(message_id, &vehicle.snapshot()).into_iter().collect(),
        };
        if messages.is_empty() {
            return (MavResult::MAV_RESULT_UNSUPPORTED, None);
        }
        if self.requested.len() + messages.len() > MAX_REQUESTED {
            return (MavResult::MAV_RESULT_TEMPORARILY_REJECTED, None);
        }
        self.requested.extend(messages);
        (MavResult::MAV_RESULT_ACCEPTED, None)
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
}

fn is_for_us(system_id: u8, component_id: u8) -> bool {
    VEHICLE.accepts(Address { system_id, component_id })
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

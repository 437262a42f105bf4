//! The periodic messages and their rates; also the values of a check on the pad and the findings of
//! the flight, in turn.

use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use flight::computer::pad_check::CheckState;
use flight::rules::phase::Phase;
use mavlink::MessageData;
use protocol::dialect::{
    ACTUATOR_OUTPUT_STATUS_DATA, ATTITUDE_DATA, ATTITUDE_QUATERNION_DATA, BATTERY_STATUS_DATA,
    CURRENT_MODE_DATA, ESTIMATOR_STATUS_DATA, EXTENDED_SYS_STATE_DATA, GLOBAL_POSITION_INT_DATA,
    GPS_RAW_INT_DATA, HEARTBEAT_DATA, HIGHRES_IMU_DATA, HOME_POSITION_DATA, LOCAL_POSITION_NED_DATA,
    MESSAGE_INTERVAL_DATA, MavMessage, MavResult, STORAGE_INFORMATION_DATA, SYS_STATUS_DATA,
    SYSTEM_TIME_DATA, TD_CONTROLLER_DATA, TD_CREW_DATA, TD_DESCENT_DATA, TD_EVENTS_DATA, TD_FINS_DATA,
    TD_FLIGHT_STATUS_DATA, TD_GIMBAL_DATA, TD_LANDING_VERDICT_DATA, TD_MISSION_DATA, TD_OPERATOR_DATA,
    TD_PREDICTED_PATH_DATA, TD_TOUCHDOWN_LIMITS_DATA, TD_TOUCHDOWN_PREDICTION_DATA, TD_UPLINK_DATA,
    VFR_HUD_DATA,
};
use protocol::frame::SIGNATURE_LEN;
use protocol::hub::line::SHARE;
use protocol::identity::RADIO_BUDGET_BYTES_S;

use crate::link::telemetry;
use crate::link::vehicle::VehicleState;

/// The span that the budget holds for, s: a second, and the 20 ms by which a busy machine may send
/// a frame late, so that no second on the wire carries more.
pub(crate) const WINDOW_S: f64 = 1.02;

/// Bytes around a payload: header and checksum.
const FRAME_OVERHEAD: usize = 12;
/// Time, mask and six of the 32 outputs; the others are zero and therefore truncated.
const ACTUATOR_PAYLOAD_LEN: usize = 12 + 6 * 4;
/// Highest default rates, Hz; the first one that fits the link is used. Signed frames need it on a
/// radio, because a signature is as long as a short message, and so do clients' requests. Vital
/// messages are not slowed down.
const RATES_MAX_HZ: [f64; 12] = [f64::INFINITY, 9.0, 8.0, 7.0, 6.0, 5.5, 5.0, 4.5, 4.0, 3.5, 3.25, 3.0];
/// A line slower than a radio: a frame that takes longer than this is not sent, s.
const LINE_HOLDS_S: f64 = 0.3;
/// On such a line: the share of vital messages, and of all periodic ones. The rest is for answers,
/// texts and requests.
const VITAL_SHARE: f64 = 0.3;
const PERIODIC_SHARE: f64 = 0.85;
/// Lowest rate of a message stretched to fit such a line, Hz, if its rate was as high before.
const STRETCHED_HZ: f64 = 0.04;
/// Longest interval that can be requested, s.
const MAX_INTERVAL_S: f64 = 60.0;

/// The longest text (STATUSTEXT), signed, bytes.
const TEXT_FRAME_LEN: usize = 54 + FRAME_OVERHEAD + SIGNATURE_LEN;
/// The longest answer to an abort (COMMAND_ACK), bytes of payload.
const ACK_PAYLOAD_LEN: usize = 10;
/// The rate of the uplink report (TD_UPLINK), Hz.
const UPLINK_HZ: f64 = 2.0;
/// The same over a line slower than a radio.
pub(crate) const SLOW_UPLINK_HZ: f64 = 1.0;
/// While a client reads a file over the link, a message is sent at most this often, s: vital ones,
/// and others. The vehicle is disarmed on the ground then.
const SPARED_VITAL_S: f64 = 1.0;
const SPARED_S: f64 = 10.0;
/// Shortest interval of a message that is sent early, s.
pub(crate) const HURRIED_S: f64 = 0.1;

/// Bytes reserved for vital messages: a heartbeat, a flight status and the answer to an abort, all
/// in one instant. They never wait for telemetry.
pub(crate) fn reserved_bytes(signature_len: usize) -> usize {
    let payload = HEARTBEAT_DATA::ENCODED_LEN + TD_FLIGHT_STATUS_DATA::ENCODED_LEN + ACK_PAYLOAD_LEN;
    payload + 3 * (FRAME_OVERHEAD + signature_len)
}

/// A link's share for answers, and the same for texts, bytes per second. The rest is always for
/// telemetry. A line of any speed carries one text a second.
pub(crate) fn share_bytes_s(capacity_bytes_s: u32) -> usize {
    (capacity_bytes_s as usize / 5).max(TEXT_FRAME_LEN)
}

/// Whether a budget is that of a line slower than a radio: four fifths of the capacity of its baud
/// rate.
pub(crate) fn is_slow(capacity_bytes_s: u32) -> bool {
    capacity_bytes_s < RADIO_BUDGET_BYTES_S
}

/// A periodic message, with its longest payload and its default rate.
#[derive(Debug)]
pub struct Standard {
    pub message_id: u32,
    /// The parameter that holds its rate.
    pub parameter: &'static str,
    payload_len: usize,
    /// Default rate, Hz; 0 is off.
    pub rate_hz: f64,
    /// The same over a link that carries more than a radio, Hz.
    pub network_hz: f64,
    /// Only a vehicle with operators sends it.
    of_crew: bool,
}

const fn standard<M: MessageData>(parameter: &'static str, rate_hz: f64) -> Standard {
    Standard {
        message_id: M::ID,
        parameter,
        payload_len: M::ENCODED_LEN,
        rate_hz,
        network_hz: rate_hz,
        of_crew: false,
    }
}

impl Standard {
    /// Length without the trailing fields that are never set and therefore truncated.
    const fn cut_to(self, payload_len: usize) -> Self {
        Self { payload_len, ..self }
    }

    const fn of_crew(self) -> Self {
        Self { of_crew: true, ..self }
    }

    /// More often over a link that carries more than a radio, for other clients.
    const fn on_network(self, network_hz: f64) -> Self {
        Self { network_hz, ..self }
    }
}

/// Without its extensions, which are not used here.
const STORAGE: Standard = standard::<STORAGE_INFORMATION_DATA>("RATE_STORAGE", 0.1).cut_to(27);

/// The periodic messages. If the budget runs short, the last ones are dropped first.
pub const STANDARD: &[Standard] = &[
    standard::<HEARTBEAT_DATA>("RATE_HEARTBEAT", 1.0),
    standard::<TD_FLIGHT_STATUS_DATA>("RATE_FLIGHT_STAT", 5.0),
    // More often whenever something changes.
    standard::<TD_CREW_DATA>("RATE_CREW", 1.0).of_crew(),
    standard::<TD_OPERATOR_DATA>("RATE_OPERATOR", 0.5).of_crew(),
    standard::<TD_LANDING_VERDICT_DATA>("RATE_VERDICT", 0.5),
    // Without its optional offset quaternion.
    standard::<ATTITUDE_QUATERNION_DATA>("RATE_ATTITUDE", 8.0).cut_to(32),
    standard::<LOCAL_POSITION_NED_DATA>("RATE_POSITION", 8.0),
    // Without its extensions, which are zero from apogee on. On the way up there is no plan to
    // send.
    standard::<TD_DESCENT_DATA>("RATE_DESCENT", 4.0).cut_to(61),
    standard::<TD_GIMBAL_DATA>("RATE_GIMBAL", 3.0),
    standard::<TD_CONTROLLER_DATA>("RATE_CONTROLLER", 3.0),
    standard::<TD_FINS_DATA>("RATE_FINS", 2.0),
    standard::<TD_TOUCHDOWN_PREDICTION_DATA>("RATE_PREDICTION", 2.0),
    standard::<TD_PREDICTED_PATH_DATA>("RATE_PATH", 1.0),
    standard::<SYS_STATUS_DATA>("RATE_SYS_STATUS", 1.0),
    standard::<EXTENDED_SYS_STATE_DATA>("RATE_EXT_STATE", 1.0),
    standard::<ESTIMATOR_STATUS_DATA>("RATE_ESTIMATOR", 0.5),
    // The positions of vehicle and pad on the Earth, for the search, over any link. At 20 m/s the
    // last position is within 40 m when the link falls silent.
    standard::<GLOBAL_POSITION_INT_DATA>("RATE_GLOBAL", 0.5).on_network(4.0),
    standard::<HOME_POSITION_DATA>("RATE_HOME", 0.1).on_network(1.0),
    standard::<TD_TOUCHDOWN_LIMITS_DATA>("RATE_LIMITS", 0.2),
    // For other clients. A radio has no room for all of them: the messages above already have this
    // data.
    standard::<HIGHRES_IMU_DATA>("RATE_IMU", 0.0),
    standard::<BATTERY_STATUS_DATA>("RATE_BATTERY", 0.0).on_network(1.0),
    standard::<ACTUATOR_OUTPUT_STATUS_DATA>("RATE_ACTUATORS", 0.0)
        .cut_to(ACTUATOR_PAYLOAD_LEN)
        .on_network(1.0),
    standard::<VFR_HUD_DATA>("RATE_VFR_HUD", 0.0).on_network(1.0),
    standard::<CURRENT_MODE_DATA>("RATE_MODE", 0.0).on_network(1.0),
    standard::<ATTITUDE_DATA>("RATE_EULER", 0.0).on_network(4.0),
    // Without its extensions, which are not available here.
    standard::<GPS_RAW_INT_DATA>("RATE_GPS", 0.0).cut_to(30).on_network(1.0),
    standard::<SYSTEM_TIME_DATA>("RATE_TIME", 0.0).on_network(1.0),
    standard::<TD_MISSION_DATA>("RATE_MISSION", 0.1),
    STORAGE,
];

#[derive(Debug, Clone, Copy)]
pub(crate) struct Stream {
    pub(crate) message_id: u32,
    /// Its longest frame, bytes.
    pub(crate) frame_len: usize,
    /// `None`: off unless requested.
    default_interval_s: Option<f64>,
    /// `None`: switched off.
    interval_s: Option<f64>,
    /// The interval was requested by a client.
    requested: bool,
    due_s: f64,
    sent_s: f64,
}

impl Stream {
    pub(crate) fn is_vital(&self) -> bool {
        is_vital(self.message_id)
    }

    fn bytes_s(&self, interval_s: Option<f64>) -> f64 {
        interval_s.map_or(0.0, |interval_s| self.frame_len as f64 / interval_s)
    }
}

/// Every stream of a vehicle over one link, in the order of its messages.
#[derive(Debug, Clone)]
pub struct Streams {
    pub(crate) signature_len: usize,
    crew: bool,
    capacity_bytes_s: u32,
    each: Vec<Stream>,
}

impl Streams {
    /// Every message at its default rate, within a radio's budget: the fastest are slowed down
    /// until it holds. `signature_len`: bytes of each frame's signature; `crew`: the vehicle has
    /// operators.
    pub fn over_a_radio(signature_len: usize, crew: bool) -> Self {
        let mut place = 0_usize;
        let streams = STANDARD.iter().map(|standard| {
            // Spread in time, so that the slow messages are not all due at the same instant.
            let due_s = 0.02 * place as f64;
            place += usize::from(crew || !standard.of_crew);
            Stream {
                message_id: standard.message_id,
                frame_len: standard.payload_len + FRAME_OVERHEAD + signature_len,
                default_interval_s: None,
                interval_s: None,
                requested: false,
                due_s,
                sent_s: f64::NEG_INFINITY,
            }
        });
        let each = streams.collect();
        let mut streams = Self { signature_len, crew, capacity_bytes_s: 0, each };
        streams.set_capacity(RADIO_BUDGET_BYTES_S);
        streams
    }

    /// The default rates for this budget, Hz: as high as they fit.
    fn default_rates_hz(&self) -> Vec<f64> {
        let fits = |rates: &Vec<f64>| self.load_bytes_s(rates) <= self.for_telemetry_bytes_s();
        let capped = RATES_MAX_HZ.into_iter().map(|most_hz| self.rates_hz(most_hz));
        capped.into_iter().find(fits).unwrap_or_else(|| self.stretched_rates_hz())
    }

    /// The rates of the messages for this kind of link, none of them but vital ones above this, Hz.
    fn rates_hz(&self, most_hz: f64) -> Vec<f64> {
        let network = self.capacity_bytes_s > RADIO_BUDGET_BYTES_S;
        let rate = |standard: &Standard| match standard {
            Standard { of_crew: true, .. } if !self.crew => 0.0,
            Standard { message_id, rate_hz, .. } if is_vital(*message_id) => *rate_hz,
            Standard { rate_hz, network_hz, .. } => {
                (if network { network_hz.max(*rate_hz) } else { *rate_hz }).min(most_hz)
            }
        };
        STANDARD.iter().map(rate).collect()
    }

    /// The rates for a line slower than a radio: less often in the same proportion, vital messages
    /// less so.
    fn stretched_rates_hz(&self) -> Vec<f64> {
        let capacity_bytes_s = f64::from(self.capacity_bytes_s);
        let longest = LINE_HOLDS_S * capacity_bytes_s / SHARE;
        let mut rates = self.rates_hz(f64::INFINITY);
        let mut for_vital = VITAL_SHARE * capacity_bytes_s;
        for (rate_hz, stream) in rates.iter_mut().zip(&self.each) {
            if stream.is_vital() {
                *rate_hz = rate_hz.min((for_vital / stream.frame_len as f64).max(1.0));
                for_vital -= *rate_hz * stream.frame_len as f64;
            } else if stream.frame_len as f64 > longest {
                *rate_hz = 0.0;
            }
        }
        let room = PERIODIC_SHARE * self.for_telemetry_bytes_s();
        for _ in 0..100 {
            if self.load_bytes_s(&rates) <= room {
                break;
            }
            for (rate_hz, stream) in rates.iter_mut().zip(&self.each) {
                let is_place = stream.message_id == GLOBAL_POSITION_INT_DATA::ID;
                if !stream.is_vital() && !is_place && *rate_hz > STRETCHED_HZ {
                    *rate_hz = (*rate_hz / 1.05).max(STRETCHED_HZ);
                }
            }
        }
        rates
    }

    /// Load of these rates, bytes per second, besides the requested intervals.
    fn load_bytes_s(&self, rates_hz: &[f64]) -> f64 {
        let load = |(stream, rate_hz): (&Stream, &f64)| match stream {
            Stream { requested: true, interval_s, .. } => stream.bytes_s(*interval_s),
            Stream { frame_len, .. } => *frame_len as f64 * rate_hz,
        };
        self.each.iter().zip(rates_hz).map(load).sum()
    }

    /// The link's budget, bytes per second.
    pub fn capacity_bytes_s(&self) -> u32 {
        self.capacity_bytes_s
    }

    /// Sets another budget of the link. Intervals that were not requested are those of this budget
    /// from now on.
    pub fn set_capacity(&mut self, capacity_bytes_s: u32) {
        if capacity_bytes_s == self.capacity_bytes_s {
            return;
        }
        self.capacity_bytes_s = capacity_bytes_s;
        self.give_way();
    }

    /// Slows down messages without a requested interval as far as the rest needs the room, and no
    /// further.
    fn give_way(&mut self) {
        let rates_hz = self.default_rates_hz();
        for (stream, rate_hz) in self.each.iter_mut().zip(rates_hz) {
            stream.default_interval_s = (rate_hz > 0.0).then(|| 1.0 / rate_hz);
            if !stream.requested {
                stream.interval_s = stream.default_interval_s;
            }
        }
    }

    /// Whether all of it fits the link's budget.
    pub fn fit(&self) -> bool {
        self.bytes_s() <= self.for_telemetry_bytes_s()
    }

    /// The part of the link's budget for telemetry, bytes per second: without the reserve for vital
    /// messages and the uplink reports. The reserve of a slow line is the unused part of its baud
    /// rate.
    fn for_telemetry_bytes_s(&self) -> f64 {
        let uplink_len = (TD_UPLINK_DATA::ENCODED_LEN + FRAME_OVERHEAD + self.signature_len) as f64;
        let capacity_bytes_s = f64::from(self.capacity_bytes_s);
        if is_slow(self.capacity_bytes_s) {
            return capacity_bytes_s / WINDOW_S - SLOW_UPLINK_HZ * uplink_len;
        }
        (capacity_bytes_s - reserved_bytes(self.signature_len) as f64) / WINDOW_S - UPLINK_HZ * uplink_len
    }

    /// The messages that are due, most important first; fewer if the link is reserved for files.
    pub(crate) fn due(&self, now_s: f64, spared: bool) -> Vec<Stream> {
        let due = |stream: &&Stream| {
            let least_s = if stream.is_vital() { SPARED_VITAL_S } else { SPARED_S };
            let is_spared = spared && now_s - stream.sent_s < least_s - 1e-9;
            stream.interval_s.is_some() && now_s >= stream.due_s && !is_spared
        };
        self.each.iter().filter(due).copied().collect()
    }

    /// Notes that a message was sent, or that it had no content.
    pub fn on_sent(&mut self, message_id: u32, now_s: f64) {
        for stream in self.each.iter_mut().filter(|stream| stream.message_id == message_id) {
            stream.sent_s = now_s;
            let Some(interval_s) = stream.interval_s else { continue };
            // Count from the due time, not from now; otherwise the frame grid would lower the rate.
            // A message that was sent early or held back is not sent twice.
            let next_s = stream.due_s + interval_s;
            stream.due_s = if next_s > now_s { next_s } else { now_s + interval_s };
        }
    }

    /// Sends a message at most this long after the last one; on a slow line as often as it takes
    /// half of it.
    pub(crate) fn at_least_every(&mut self, message_id: u32, interval_s: f64) {
        let half_bytes_s = 0.5 * f64::from(self.capacity_bytes_s);
        let slow = is_slow(self.capacity_bytes_s);
        for stream in self.each.iter_mut().filter(|stream| stream.message_id == message_id) {
            let least_s = if slow { stream.frame_len as f64 / half_bytes_s } else { 0.0 };
            stream.due_s = stream.due_s.min(stream.sent_s + interval_s.max(least_s));
        }
    }

    /// Bytes per second of all of them, at their longest.
    pub fn bytes_s(&self) -> f64 {
        self.each.iter().map(|stream| stream.bytes_s(stream.interval_s)).sum()
    }

    /// The longest frame of those that are sent, bytes.
    pub(crate) fn longest_frame_len(&self) -> usize {
        let sent = self.each.iter().filter(|stream| stream.interval_s.is_some());
        sent.map(|stream| stream.frame_len).max().unwrap_or(0)
    }

    /// The interval of each, in their order; `None` is off.
    pub(crate) fn intervals(&self) -> Vec<Option<f64>> {
        self.each.iter().map(|stream| stream.interval_s).collect()
    }

    /// MAV_CMD_SET_MESSAGE_INTERVAL: -1 off, 0 default, else microseconds; the result and, if
    /// refused, why.
    pub fn set_interval(
        &mut self,
        message_id: u32,
        interval_us: f32,
        now_s: f64,
    ) -> (MavResult, Option<String>) {
        let Some(place) = self.each.iter().position(|stream| stream.message_id == message_id) else {
            let reason = format!("message {message_id} is not sent by this vehicle");
            return (MavResult::MAV_RESULT_FAILED, Some(reason));
        };
        let denied = |reason| (MavResult::MAV_RESULT_DENIED, Some(reason));
        let before = self.each[place];
        let wanted = match interval_us {
            -1.0 => None,
            0.0 => before.default_interval_s,
            us if us >= 1.0 && f64::from(us) * 1e-6 <= MAX_INTERVAL_S => Some(f64::from(us) * 1e-6),
            _ => {
                let range = "-1 (off), 0 (default) or 1 to 60000000";
                return denied(format!("interval {interval_us} us: must be {range}"));
            }
        };
        let slower = |interval_s| before.default_interval_s.is_none_or(|default_s| interval_s > default_s);
        if is_vital(message_id) && wanted.is_none_or(slower) {
            return denied(format!("message {message_id}: vital messages are not slowed down"));
        }
        let all_before = self.each.clone();
        self.each[place].interval_s = wanted;
        self.each[place].requested = interval_us != 0.0;
        self.give_way();
        let (total, free) = (self.bytes_s(), self.for_telemetry_bytes_s());
        if before.bytes_s(wanted) > before.bytes_s(before.interval_s) && total > free {
            self.each = all_before;
            return denied(format!(
                "message {message_id}: {total:.0} B/s in all; the link's budget is {}, {free:.0} of it for telemetry",
                self.capacity_bytes_s
            ));
        }
        let stream = &mut self.each[place];
        // A new rate counts from now, also after a long interval.
        if let Some(interval_s) = stream.interval_s {
            stream.due_s = stream.due_s.min(now_s + interval_s);
        }
        (MavResult::MAV_RESULT_ACCEPTED, None)
    }

    /// Rate of a message, Hz; 0 if it is off or unknown.
    pub fn rate_hz(&self, message_id: u32) -> f64 {
        let stream = self.each.iter().find(|stream| stream.message_id == message_id);
        stream.and_then(|stream| stream.interval_s).map_or(0.0, |interval_s| 1.0 / interval_s)
    }

    /// MESSAGE_INTERVAL of a message.
    pub fn interval_of(&self, message_id: u32) -> MavMessage {
        let stream = self.each.iter().find(|stream| stream.message_id == message_id);
        let interval_us = match stream.map(|stream| stream.interval_s) {
            Some(Some(interval_s)) => libm::round(1e6 * interval_s) as i32,
            Some(None) => -1,
            // As the standard has it: 0 means the message is not available.
            None => 0,
        };
        let message_id = u16::try_from(message_id).unwrap_or(u16::MAX);
        MavMessage::MESSAGE_INTERVAL(MESSAGE_INTERVAL_DATA { interval_us, message_id })
    }
}

/// Whether the message is vital: it never waits for other messages.
fn is_vital(message_id: u32) -> bool {
    matches!(message_id, HEARTBEAT_DATA::ID | TD_FLIGHT_STATUS_DATA::ID)
}

// Reports the values of the check on the pad, and the findings of the flight, to the stations: one
// value after the other, repeatedly.
//
// The values are requested messages, after all telemetry: there is room for them on the pad within
// a radio's budget, and in flight they wait.

/// Interval of the values during a check, and until every value has been sent twice after it, s:
/// 250 B/s when signed.
const OFTEN_S: f64 = 0.2;
/// Interval later, and for findings, s: for a station that joins late.
const SELDOM_S: f64 = 1.0;

/// Whose turn it is.
#[derive(Debug, Default)]
struct Turn {
    place: usize,
    /// Number of values when the last one was sent.
    found: usize,
    /// Number of times that every value has been sent.
    rounds: u32,
}

impl Turn {
    /// Index of the next of this many values: new ones first.
    fn next(&mut self, found: usize) -> usize {
        let is_new = found > self.found;
        if is_new {
            self.place = self.found;
        } else if self.place >= found {
            (self.place, self.rounds) = (0, self.rounds.saturating_add(1));
        }
        let place = self.place;
        self.place += 1;
        self.found = if is_new { place + 1 } else { found };
        place
    }
}

/// Reports the values of a check.
#[derive(Debug, Default)]
pub(super) struct CheckReporter {
    last_state: Option<(u16, CheckState)>,
    turn: Turn,
    due_s: f64,
}

impl CheckReporter {
    /// The message to send now.
    pub(super) fn due(&mut self, vehicle: &VehicleState<'_>, boot: u32, now_s: f64) -> Option<MavMessage> {
        let check = vehicle.computer.pad_check();
        let mode = vehicle.mode();
        let now = (check.run, check.state);
        if check.state == CheckState::NotRun || !mode.phase.on_pad() || mode.interlocks.armed {
            return None;
        }
        if self.last_state != Some(now) {
            // At once: a new check, or its end.
            (self.last_state, self.turn.rounds, self.due_s) = (Some(now), 0, now_s);
        }
        if now_s < self.due_s {
            return None;
        }
        let place = self.turn.next(check.findings.len());
        let often = check.is_running() || self.turn.rounds < 2;
        self.due_s = now_s + if often { OFTEN_S } else { SELDOM_S };
        Some(telemetry::pad_check(check, place, vehicle.time_s, boot))
    }
}

/// Reports the findings of the flight.
#[derive(Debug, Default)]
pub(super) struct FindingReporter {
    turn: Turn,
    due_s: f64,
}

impl FindingReporter {
    /// The message to send now.
    pub(super) fn due(&mut self, vehicle: &VehicleState<'_>, boot: u32, now_s: f64) -> Option<MavMessage> {
        let found = vehicle.findings.as_found().len();
        let flew = vehicle.computer.released_at_s().is_some();
        let over =
            flew && (vehicle.input().contact || matches!(vehicle.phase(), Phase::Touchdown | Phase::Safed));
        // A new one does not wait.
        if (found == 0 && !over) || (now_s < self.due_s && found <= self.turn.found) {
            return None;
        }
        self.due_s = now_s + SELDOM_S;
        Some(telemetry::finding(vehicle.findings, self.turn.next(found), vehicle.time_s, boot))
    }
}

/// Reports the events of the flight: with each, and repeatedly.
#[derive(Debug, Default)]
pub(super) struct EventReporter {
    entered: u16,
    due_s: f64,
}

impl EventReporter {
    /// The message to send now.
    pub(super) fn due(&mut self, vehicle: &VehicleState<'_>, boot: u32, now_s: f64) -> Option<MavMessage> {
        let message = telemetry::events(&vehicle.findings.events, boot)?;
        let MavMessage::TD_EVENTS(TD_EVENTS_DATA { entered, .. }) = message else { return None };
        if now_s < self.due_s && entered == self.entered {
            return None;
        }
        (self.entered, self.due_s) = (entered, now_s + 2.0 * SELDOM_S);
        Some(message)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::dialect::message_name;

    /// The dialect of a board has these messages and ours alone.
    #[test]
    fn every_standard_message_is_in_the_dialect_of_a_board() {
        let known: Vec<&str> =
            include_str!("../../../../protocol/dialect/of_a_vehicle.txt").split_whitespace().collect();
        for standard in STANDARD {
            let name = message_name(standard.message_id).expect("a message of the dialect");
            assert!(name.starts_with("TD_") || known.contains(&name), "{name} is not in of_a_vehicle.txt");
        }
    }
}

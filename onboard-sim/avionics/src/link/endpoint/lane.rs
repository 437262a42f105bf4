//! A lane: links that carry the same frames, their budget, and the queues of messages that wait for
//! room on them.
//!
//! All links begin in one lane, so that a ground station on several of them can recognise copies by
//! their sequence numbers. A link with different message intervals gets a separate lane with
//! separate sequence numbers.

use alloc::boxed::Box;
use alloc::collections::VecDeque;
use alloc::vec;
use alloc::vec::Vec;
use core::time::Duration;

use protocol::command::CommandAnswer;
use protocol::dialect::MavMessage;
use protocol::frame::{Encoder, Frame};
use protocol::hub::line::{RadioShare, SHARE};
use protocol::identity::{NETWORK_BUDGET_BYTES_S, VEHICLE};

use super::questions::FileService;
use super::{Context, MAX_REQUESTED, Outgoing};
use crate::link::stations::MAX_STATIONS;
use crate::link::streams::{
    SLOW_UPLINK_HZ, Stream, Streams, WINDOW_S, is_slow, reserved_bytes, share_bytes_s,
};
use crate::link::vehicle::VehicleState;
use crate::link::{parameters, telemetry};

/// Most answers that may wait, and most texts. More are dropped; a station that needs an answer
/// must repeat its request.
const MAX_WAITING: usize = 32;
/// The longest frame with a piece of a file, without its signature.
const PIECE_FRAME_LEN: usize = protocol::ftp::packet::PAYLOAD_LEN + 12;
/// Shortest interval between answers to a repeated abort, s.
const ABORT_ANSWERED_S: f64 = 0.09;
/// The same on a line slower than a radio, s.
const SLOW_ABORT_ANSWERED_S: f64 = 0.3;
/// Bytes per second of files over a link that carries at least a network's telemetry: 15 % of the
/// slowest Wi-Fi (802.11b, 11 Mbit/s). A smaller budget may be that of a radio somewhere on the
/// way; files then use the budget that telemetry leaves.
const NETWORK_FILES_BYTES_S: f64 = 200_000.0;
/// A piece of a file that would hold a line for longer than this is not sent, s.
const LINE_HOLDS_S: f64 = 0.3;

/// An answer in the queue.
#[derive(Debug, Clone)]
pub(super) enum QueuedAnswer {
    Message(Box<MavMessage>),
    Command(CommandAnswer),
}

impl From<MavMessage> for QueuedAnswer {
    fn from(message: MavMessage) -> Self {
        Self::Message(Box::new(message))
    }
}

flight::with_defaults! {
    /// Links that carry the same frames.
    #[derive(Clone)]
    pub(super) struct Lane {
        pub(super) links: Vec<usize> = vec![0],
        pub(super) streams: Streams = Streams::over_a_radio(0, false),
        pub(super) encoder: Encoder = Encoder::new(VEHICLE),
        sent: Window = Window::of(WINDOW_S),
        /// Telemetry of the last [`BRIEFLY_S`] seconds.
        telemetry_briefly: Window = Window::of(BRIEFLY_S),
        /// Answers and texts of the last [`BRIEFLY_S`] seconds.
        answers_briefly: Window = Window::of(BRIEFLY_S),
        answered: Window = Window::of(WINDOW_S),
        /// Texts of the last second.
        texts_briefly: Window = Window::of(WINDOW_S),
        /// Uplink reports (TD_UPLINK) that are not yet sent.
        uplinks: VecDeque<MavMessage> = VecDeque::new(),
        /// Answers to aborts, at most one for each station.
        aborts: VecDeque<CommandAnswer> = VecDeque::new(),
        abort_answered_s: f64 = f64::NEG_INFINITY,
        texts: VecDeque<QueuedAnswer> = VecDeque::new(),
        answers: VecDeque<QueuedAnswer> = VecDeque::new(),
        /// Requested messages; they are sent after all vital messages.
        requested: VecDeque<MavMessage> = VecDeque::new(),
        /// The next parameter of a requested list; `None` when the list has been sent.
        pub(super) next_parameter: Option<u16> = None,
        /// When the next piece of a file may be sent: they are spread evenly, as the link carries
        /// them.
        piece_due_s: f64 = 0.0,
        /// The budget that the lane was given, bytes per second; a radio may leave less of it.
        granted_bytes_s: u32 = 0,
        radio: RadioShare = RadioShare::default(),
        /// Time at which a line slower than a radio has sent everything given to it. All but vital
        /// messages wait for that, so that nothing queues behind them.
        line_free_at_s: f64 = 0.0,
        /// When the next uplink reports go over such a line.
        uplinks_at_s: f64 = 0.0,
    }
}

impl Lane {
    pub(super) fn new(streams: Streams, encoder: Encoder) -> Self {
        let mut lane = Self { streams, encoder, ..Self::default() };
        let capacity_bytes_s = lane.streams.capacity_bytes_s();
        lane.set_capacity(capacity_bytes_s, 0.0);
        lane
    }

    pub(super) fn set_capacity(&mut self, granted_bytes_s: u32, now_s: f64) {
        self.granted_bytes_s = granted_bytes_s;
        self.share_with_the_radio(now_s);
    }

    /// Takes a radio's report about its buffer.
    pub(super) fn on_radio(&mut self, free_percent: u8, now_s: f64) {
        self.radio.on_report(free_percent, Duration::try_from_secs_f64(now_s).unwrap_or_default());
        self.share_with_the_radio(now_s);
    }

    /// Uses the share of the budget that the radio reports as free.
    fn share_with_the_radio(&mut self, now_s: f64) {
        let share = self.radio.at(Duration::try_from_secs_f64(now_s).unwrap_or_default());
        let capacity_bytes_s = (share * f64::from(self.granted_bytes_s)) as u32;
        self.streams.set_capacity(capacity_bytes_s);
        // The reserve of a slow line is the unused part of its baud rate.
        let reserve = if is_slow(capacity_bytes_s) { reserved_bytes(self.streams.signature_len) } else { 0 };
        self.sent.set_limit(capacity_bytes_s as usize + reserve);
        // Over a slow line frames go one by one, so that there are no bursts.
        let briefly = |bytes| if is_slow(capacity_bytes_s) { usize::MAX } else { bytes };
        self.telemetry_briefly.set_limit(briefly(capacity_bytes_s as usize * 22 / 100));
        self.answers_briefly.set_limit(briefly(capacity_bytes_s as usize / 6));
        self.answered.set_limit(share_bytes_s(capacity_bytes_s));
        self.texts_briefly.set_limit(share_bytes_s(capacity_bytes_s));
    }

    /// A copy of this lane for one of its links, with its history and queue.
    pub(super) fn split_off(&mut self, link: usize) -> Self {
        self.links.retain(|other| *other != link);
        Self { links: vec![link], ..self.clone() }
    }

    /// Queues an answer to an abort, unless one is already waiting.
    pub(super) fn answer_abort(&mut self, answer: CommandAnswer) {
        if !self.aborts.contains(&answer) && self.aborts.len() < MAX_WAITING {
            self.aborts.push_back(answer);
        }
    }

    /// Queues an uplink report; it replaces an older one that is not yet sent.
    pub(super) fn queue_uplink_report(&mut self, message: MavMessage) {
        self.uplinks.truncate(MAX_STATIONS - 1);
        self.uplinks.push_front(message);
    }

    pub(super) fn answer(&mut self, answer: QueuedAnswer) {
        if self.answers.len() < MAX_WAITING {
            self.answers.push_back(answer);
        }
    }

    pub(super) fn queue_text(&mut self, chunk: MavMessage) {
        if self.texts.len() < MAX_WAITING {
            self.texts.push_back(chunk.into());
        }
    }

    /// Queues requested messages; returns whether there was room in the queue. Otherwise they are
    /// dropped, and the station must repeat its request.
    pub(super) fn request(&mut self, messages: Vec<MavMessage>) -> bool {
        let fits = self.requested.len() + messages.len() <= MAX_REQUESTED;
        if fits {
            self.requested.extend(messages);
        }
        fits
    }

    /// The frames to send now: vital messages first, then answers, then texts (in the fall after
    /// telemetry), then telemetry by importance, then requested messages, then pieces of files. The
    /// budget holds in every second.
    pub(super) fn poll(
        &mut self,
        context: &Context,
        vehicle: &VehicleState<'_>,
        files: &mut FileService,
    ) -> Vec<Outgoing> {
        let now_s = context.now_s;
        self.share_with_the_radio(now_s);
        let slow = is_slow(self.streams.capacity_bytes_s());
        let Self { sent, telemetry_briefly, answers_briefly, answered, texts_briefly, .. } = self;
        for window in [sent, telemetry_briefly, answers_briefly, answered, texts_briefly] {
            window.move_to(now_s);
        }
        let mut frames = Vec::new();
        let due = self.streams.due(now_s, files.is_busy(&self.links, now_s));
        for due in due.iter().filter(|due| due.is_vital()) {
            if due.frame_len > self.sent.room() {
                break;
            }
            self.send(due, context, vehicle, &mut frames);
        }
        let answered_every_s = if slow { SLOW_ABORT_ANSWERED_S } else { ABORT_ANSWERED_S };
        if now_s - self.abort_answered_s >= answered_every_s
            && let Some(answer) = self.aborts.front().copied()
            && let Some(frame) = self.encode(&QueuedAnswer::Command(answer), self.sent.room())
        {
            self.put(frame, now_s, &mut frames);
            self.abort_answered_s = now_s;
            self.aborts.pop_front();
        }
        while (!slow || now_s >= self.uplinks_at_s)
            && self.is_line_free(now_s)
            && let Some(message) = self.uplinks.front().cloned()
        {
            let Some(frame) = self.encode(&message.into(), self.room()) else { break };
            self.put(frame, now_s, &mut frames);
            self.uplinks.pop_front();
            if self.uplinks.is_empty() {
                self.uplinks_at_s = now_s + 0.9 / SLOW_UPLINK_HZ;
            }
        }
        while self.is_line_free(now_s)
            && let Some(answer) = self.answers.front().cloned()
        {
            let room = self.room_for_answers().min(self.answered.room());
            let Some(frame) = self.encode(&answer, room) else { break };
            self.answered.take(self.len_of(&frame), now_s);
            self.answers_briefly.take(self.len_of(&frame), now_s);
            self.put(frame, now_s, &mut frames);
            self.answers.pop_front();
        }
        let falls = vehicle.phase().in_descent() || vehicle.phase().in_landing_burn();
        if !falls {
            self.send_texts(now_s, &mut frames);
        }
        for due in due.iter().filter(|due| !due.is_vital()) {
            // The check uses the longest form of the message, so that no frame is built for
            // nothing. Less important messages do not overtake it.
            if due.frame_len > self.room_for_telemetry() || !self.is_line_free(now_s) {
                break;
            }
            self.send(due, context, vehicle, &mut frames);
        }
        // In the fall the place of the vehicle does not wait for words.
        if falls {
            self.send_texts(now_s, &mut frames);
        }
        while self.requested.len() < MAX_REQUESTED
            && let Some(answer) = files.next_answer(&self.links)
        {
            self.requested.push_back(answer);
        }
        let longest = if slow { 0 } else { self.streams.longest_frame_len() };
        while self.is_line_free(now_s)
            && let Some(message) = self.next_requested(vehicle)
        {
            // Some room is also reserved for telemetry that falls due in the meantime.
            let room = self.room_for_telemetry().saturating_sub(longest);
            let Some(frame) = self.encode(&message.into(), room) else { break };
            self.telemetry_briefly.take(self.len_of(&frame), now_s);
            self.put(frame, now_s, &mut frames);
            if self.requested.pop_front().is_none() {
                self.next_parameter = self.next_parameter.map(|place| place + 1);
            }
        }
        self.send_pieces(now_s, files, &mut frames);
        frames.into_iter().map(|frame| Outgoing { frame, links: self.links.clone() }).collect()
    }

    /// Sends texts within their share.
    fn send_texts(&mut self, now_s: f64, frames: &mut Vec<Frame>) {
        while self.is_line_free(now_s)
            && let Some(chunk) = self.texts.front().cloned()
        {
            let room = self.room_for_answers().min(self.texts_briefly.room());
            let Some(frame) = self.encode(&chunk, room) else { break };
            self.texts_briefly.take(self.len_of(&frame), now_s);
            self.answers_briefly.take(self.len_of(&frame), now_s);
            self.put(frame, now_s, frames);
            self.texts.pop_front();
        }
    }

    /// Sends pieces of files in all the room that is left, evenly spread.
    fn send_pieces(&mut self, now_s: f64, files: &mut FileService, frames: &mut Vec<Frame>) {
        let longest = PIECE_FRAME_LEN + self.streams.signature_len;
        let has_own_room = self.granted_bytes_s >= NETWORK_BUDGET_BYTES_S;
        let bytes_s =
            if has_own_room { NETWORK_FILES_BYTES_S } else { f64::from(self.streams.capacity_bytes_s()) };
        let spacing_s = longest as f64 / bytes_s;
        if self.line_takes_s(longest) > LINE_HOLDS_S {
            return;
        }
        // A late poll is caught up with, a pause is not.
        self.piece_due_s = self.piece_due_s.max(now_s - spacing_s);
        while now_s >= self.piece_due_s
            && self.is_line_free(now_s)
            && (has_own_room || self.room() >= longest)
            && let Some(message) = files.next_piece(&self.links, now_s)
        {
            let frame = self.encoder.encode(&message);
            self.piece_due_s += spacing_s;
            if has_own_room { frames.push(frame) } else { self.put(frame, now_s, frames) }
        }
    }

    /// Room for messages that are not vital. Some of the budget is reserved so that vital messages
    /// never wait.
    fn room(&self) -> usize {
        self.sent.room().saturating_sub(reserved_bytes(self.streams.signature_len))
    }

    fn room_for_answers(&self) -> usize {
        self.room().min(self.answers_briefly.room())
    }

    fn room_for_telemetry(&self) -> usize {
        self.room().min(self.telemetry_briefly.room())
    }

    fn send(&mut self, due: &Stream, context: &Context, vehicle: &VehicleState<'_>, frames: &mut Vec<Frame>) {
        if let Some(message) = telemetry::message(due.message_id, vehicle, context.identity) {
            let frame = self.encoder.encode(&message);
            // Vital messages do not count as recent telemetry: a change of phase must not delay a
            // position.
            if !due.is_vital() {
                self.telemetry_briefly.take(self.len_of(&frame), context.now_s);
            }
            self.put(frame, context.now_s, frames);
        }
        self.streams.on_sent(due.message_id, context.now_s);
    }

    /// The next requested message: single messages first, then the list of parameters.
    fn next_requested(&mut self, vehicle: &VehicleState<'_>) -> Option<MavMessage> {
        if let Some(message) = self.requested.front() {
            return Some(message.clone());
        }
        self.next_parameter = self.next_parameter.filter(|place| *place < parameters::COUNT);
        self.next_parameter
            .map(|place| parameters::value(place, &self.streams, &vehicle.mission().powered.weights))
    }

    /// The frame, if it is not longer than this; a frame that is not sent uses no sequence number.
    fn encode(&mut self, answer: &QueuedAnswer, room: usize) -> Option<Frame> {
        let mut encoder = self.encoder.clone();
        let frame = match answer {
            QueuedAnswer::Message(message) => encoder.encode(message),
            // The dialect always has COMMAND_ACK.
            QueuedAnswer::Command(answer) => answer.encode(&mut encoder)?,
        };
        if self.len_of(&frame) > room {
            return None;
        }
        self.encoder = encoder;
        Some(frame)
    }

    fn len_of(&self, frame: &Frame) -> usize {
        frame.as_bytes().len() + self.streams.signature_len
    }

    /// How long these bytes hold the line, s. Only a line slower than a radio is held.
    fn line_takes_s(&self, bytes: usize) -> f64 {
        let capacity_bytes_s = self.streams.capacity_bytes_s();
        if is_slow(capacity_bytes_s) { bytes as f64 * SHARE / f64::from(capacity_bytes_s) } else { 0.0 }
    }

    fn is_line_free(&self, now_s: f64) -> bool {
        now_s >= self.line_free_at_s - 1e-9
    }

    fn put(&mut self, frame: Frame, now_s: f64, frames: &mut Vec<Frame>) {
        let bytes = self.len_of(&frame);
        self.sent.take(bytes, now_s);
        self.line_free_at_s = self.line_free_at_s.max(now_s) + self.line_takes_s(bytes);
        frames.push(frame);
    }
}

// Tracks how much a link has carried recently and how much room it has left.

/// In any fifth of a second telemetry may take 22 % of the budget of one second, and answers and
/// texts a sixth of it. Otherwise a burst could spend the whole budget, and even vital messages
/// would wait.
pub(super) const BRIEFLY_S: f64 = 0.2;

/// The bytes sent in a sliding window of time.
#[derive(Debug, Clone)]
pub(super) struct Window {
    span_s: f64,
    limit: usize,
    sent: VecDeque<(f64, usize)>,
    bytes: usize,
}

impl Window {
    /// A window of this length; it has no room until it gets a limit.
    pub(super) fn of(span_s: f64) -> Self {
        Self { span_s, limit: 0, sent: VecDeque::new(), bytes: 0 }
    }

    /// Sets the most bytes in any window from now on.
    pub(super) fn set_limit(&mut self, limit: usize) {
        self.limit = limit;
    }

    /// Drops bytes that were sent before the window.
    pub(super) fn move_to(&mut self, now_s: f64) {
        // Times are multiples of a frame; rounding must not retain an entry one frame too long.
        while let Some((sent_s, bytes)) = self.sent.front()
            && now_s - sent_s >= self.span_s - 1e-9
        {
            self.bytes -= bytes;
            self.sent.pop_front();
        }
    }

    /// Bytes that may still be sent now.
    pub(super) fn room(&self) -> usize {
        self.limit.saturating_sub(self.bytes)
    }

    /// Notes bytes sent now.
    pub(super) fn take(&mut self, bytes: usize, now_s: f64) {
        self.sent.push_back((now_s, bytes));
        self.bytes += bytes;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::streams::WINDOW_S;

    #[test]
    fn sent_bytes_count_for_a_second_and_no_longer() {
        let mut window = Window::of(WINDOW_S);
        assert_eq!(window.room(), 0);
        window.set_limit(100);
        window.take(60, 0.0);
        window.take(40, 0.5);
        window.move_to(1.0);
        assert_eq!(window.room(), 0);
        window.move_to(WINDOW_S);
        assert_eq!(window.room(), 60);
        window.set_limit(30);
        assert_eq!(window.room(), 0);
        window.move_to(0.5 + WINDOW_S);
        assert_eq!(window.room(), 30);
    }
}

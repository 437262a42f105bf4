//! A line of a known speed: its queue, and the choice and time of the next frame.
//!
//! Bytes given to a driver cannot be taken back. So the line gets no more than it can have sent by
//! now. Everything else waits here, where the present state of a sender replaces an older one, and
//! an abort overtakes earlier frames.

use alloc::collections::VecDeque;
use core::time::Duration;

use mavlink::MessageData as _;

use crate::command::CommandRequest;
use crate::dialect::{
    ATTITUDE_DATA, ATTITUDE_QUATERNION_DATA, BATTERY_STATUS_DATA, EXTENDED_SYS_STATE_DATA,
    GLOBAL_POSITION_INT_DATA, GPS_RAW_INT_DATA, HEARTBEAT_DATA, LOCAL_POSITION_NED_DATA, SYS_STATUS_DATA,
    TD_CONTROLLER_DATA, TD_DESCENT_DATA, TD_FINS_DATA, TD_FLIGHT_STATUS_DATA, TD_GIMBAL_DATA,
    TD_PREDICTED_PATH_DATA, TD_TOUCHDOWN_PREDICTION_DATA, VFR_HUD_DATA,
};
use crate::frame::Frame;

/// Average utilisation of the line. The rest is for clock differences, and for the overhead of a
/// radio.
pub const SHARE: f64 = 0.8;
/// The line may be given a frame this long before it has sent the last one, because its owner looks
/// only now and then.
const AHEAD: Duration = Duration::from_millis(20);
/// Frames wait at most this long, and the average may be exceeded for this long.
const HOLDS: Duration = Duration::from_millis(300);
/// So many frames that are not dropped for others may wait.
const MAX_UNDROPPABLE: usize = 64;
/// Share of its budget that a line retains in spite of a radio's reports: reports can be forged.
const LEAST: f64 = 0.25;
/// Validity of a radio's report.
const REPORT_HOLDS: Duration = Duration::from_secs(10);

const COMMAND_ACK_ID: u32 = 77;
const STATUSTEXT_ID: u32 = 253;
const TIMESYNC_ID: u32 = 111;
/// MAV_CMD_DO_FLIGHTTERMINATION.
const ABORT: u16 = 185;

/// Of these only the newest counts: they carry the present state of the sender.
const PRESENT_STATE: [u32; 17] = [
    HEARTBEAT_DATA::ID,
    TD_FLIGHT_STATUS_DATA::ID,
    ATTITUDE_DATA::ID,
    ATTITUDE_QUATERNION_DATA::ID,
    BATTERY_STATUS_DATA::ID,
    EXTENDED_SYS_STATE_DATA::ID,
    GLOBAL_POSITION_INT_DATA::ID,
    GPS_RAW_INT_DATA::ID,
    LOCAL_POSITION_NED_DATA::ID,
    SYS_STATUS_DATA::ID,
    VFR_HUD_DATA::ID,
    TD_CONTROLLER_DATA::ID,
    TD_DESCENT_DATA::ID,
    TD_FINS_DATA::ID,
    TD_GIMBAL_DATA::ID,
    TD_PREDICTED_PATH_DATA::ID,
    TD_TOUCHDOWN_PREDICTION_DATA::ID,
];

/// In this order frames leave.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Rank {
    /// An abort, and the answer to a command.
    Abort,
    /// Signs of life, and an abort.
    Vital,
    /// Commands, texts and measurements of time.
    Crew,
    /// Everything else; it is dropped if it would wait for too long.
    Telemetry,
}

/// The number of the command, if it is one.
fn command_of(frame: &Frame) -> Option<u16> {
    CommandRequest::from_frame(frame).map(|request| request.command)
}

fn rank(frame: &Frame) -> Rank {
    match (frame.message_id(), command_of(frame)) {
        (COMMAND_ACK_ID, _) | (_, Some(ABORT)) => Rank::Abort,
        (HEARTBEAT_DATA::ID | TD_FLIGHT_STATUS_DATA::ID, _) => Rank::Vital,
        (STATUSTEXT_ID | TIMESYNC_ID, _) | (_, Some(_)) => Rank::Crew,
        _ => Rank::Telemetry,
    }
}

/// Whether `new` makes `old` obsolete: a newer state, or a repetition of the same command.
fn replaces(new: &Frame, old: &Frame) -> bool {
    new.message_id() == old.message_id()
        && new.source() == old.source()
        && match command_of(new) {
            // All but `confirmation`, the last byte.
            Some(_) => new.padded_payload()[..32] == old.padded_payload()[..32],
            None => PRESENT_STATE.contains(&new.message_id()),
        }
}

/// A line, with its queue.
#[derive(Debug)]
pub(super) struct Line {
    bytes_s: f64,
    /// Signature bytes added to each frame.
    added: usize,
    waiting: VecDeque<Frame>,
    /// Time at which the line has sent everything given to it.
    free_at: Duration,
    /// When that is paid for out of the budget.
    paid_at: Duration,
    pub(super) radio: RadioShare,
    /// The last frame that left.
    last: Option<Frame>,
    dropped: u64,
}

impl Line {
    /// A line that carries this much, bytes per second.
    pub(super) fn new(bytes_s: u32, added: usize) -> Self {
        Self {
            bytes_s: f64::from(bytes_s),
            added,
            waiting: VecDeque::new(),
            free_at: Duration::ZERO,
            paid_at: Duration::ZERO,
            radio: RadioShare::default(),
            last: None,
            dropped: 0,
        }
    }

    fn len_of(&self, frame: &Frame) -> usize {
        frame.as_bytes().len() + self.added
    }

    /// Queues a frame. Removes frames that it makes obsolete, and telemetry that would wait too
    /// long.
    pub(super) fn push(&mut self, frame: Frame) {
        self.waiting.retain(|old| !replaces(&frame, old));
        self.waiting.push_back(frame);
        let most = HOLDS.as_secs_f64() * self.bytes_s;
        while self.waiting.len() > 1
            && self.waiting.iter().map(|frame| self.len_of(frame)).sum::<usize>() as f64 > most
        {
            let oldest = self.waiting.iter().position(|frame| rank(frame) == Rank::Telemetry);
            let place = match oldest {
                Some(place) => place,
                None if self.waiting.len() > MAX_UNDROPPABLE => self.waiting.len() - 1,
                None => break,
            };
            self.waiting.remove(place);
            self.dropped += 1;
        }
    }

    /// When the next frame may leave; `None` if none waits.
    pub(super) fn due_at(&self) -> Option<Duration> {
        let at = self.free_at.saturating_sub(AHEAD).max(self.paid_at.saturating_sub(HOLDS));
        (!self.waiting.is_empty()).then_some(at)
    }

    /// The frame to give to the line now, if it is free.
    pub(super) fn pop(&mut self, now: Duration) -> Option<Frame> {
        if self.due_at()? > now {
            return None;
        }
        // Repetitions alternate with the rest: a heartbeat passes between two transmissions of an
        // abort.
        let again = |frame: &Frame| self.last.as_ref().is_some_and(|last| replaces(frame, last));
        let (place, _) =
            self.waiting.iter().enumerate().min_by_key(|(_, frame)| (again(frame), rank(frame)))?;
        let frame = self.waiting.remove(place)?;
        let bytes = self.len_of(&frame) as f64;
        self.free_at = self.free_at.max(now) + Duration::from_secs_f64(bytes / self.bytes_s);
        let budget = SHARE * self.radio.at(now) * self.bytes_s;
        self.paid_at = self.paid_at.max(now) + Duration::from_secs_f64(bytes / budget);
        self.last = Some(frame.clone());
        Some(frame)
    }

    /// How many frames were dropped because they would have waited for too long.
    pub(super) fn dropped(&self) -> u64 {
        self.dropped
    }
}

/// The share of a line's budget that its radio leaves, and the time of its last report. SiK radios
/// report once a second.
#[derive(Debug, Clone, Copy, Default)]
pub struct RadioShare(Option<(f64, Duration)>);

impl RadioShare {
    /// Notes how much of its buffer the radio has free, percent. Below a half it is given less,
    /// above three quarters more.
    pub fn on_report(&mut self, free_percent: u8, now: Duration) {
        let factor = match free_percent {
            0..25 => 0.7,
            25..50 => 0.9,
            50..75 => 1.0,
            75.. => 1.15,
        };
        self.0 = Some(((self.at(now) * factor).clamp(LEAST, 1.0), now));
    }

    /// The share at this time; all of it once the report has expired.
    pub fn at(self, now: Duration) -> f64 {
        self.0.filter(|(_, at)| now.saturating_sub(*at) <= REPORT_HOLDS).map_or(1.0, |(share, _)| share)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dialect::{COMMAND_LONG_DATA, MavCmd, MavMessage, STATUSTEXT_DATA};
    use crate::frame::Encoder;
    use crate::identity::{GROUND, VEHICLE};

    fn ms(milliseconds: u64) -> Duration {
        Duration::from_millis(milliseconds)
    }

    fn position(x: f32) -> MavMessage {
        MavMessage::LOCAL_POSITION_NED(LOCAL_POSITION_NED_DATA { x, z: 1.0, ..Default::default() })
    }

    fn abort(confirmation: u8) -> MavMessage {
        MavMessage::COMMAND_LONG(COMMAND_LONG_DATA {
            param1: 1.0,
            command: MavCmd::MAV_CMD_DO_FLIGHTTERMINATION,
            target_system: 1,
            target_component: 1,
            confirmation,
            ..Default::default()
        })
    }

    /// The frames sent within a time, polled every millisecond, with their times.
    fn leaving(line: &mut Line, from_ms: u64, to_ms: u64) -> Vec<(u64, Frame)> {
        let mut left = Vec::new();
        for now in from_ms..to_ms {
            while let Some(frame) = line.pop(ms(now)) {
                left.push((now, frame));
            }
        }
        left
    }

    #[test]
    fn the_newest_position_leaves_and_the_older_ones_never_do() {
        let mut line = Line::new(960, 0);
        let mut encoder = Encoder::new(VEHICLE);
        for x in 0..100 {
            line.push(encoder.encode(&position(x as f32)));
        }
        let left = leaving(&mut line, 0, 1_000);
        assert_eq!(left.len(), 1);
        let newest = |it: &LOCAL_POSITION_NED_DATA| it.x.to_bits() == 99.0f32.to_bits();
        assert!(matches!(left[0].1.decode(), Ok(MavMessage::LOCAL_POSITION_NED(it)) if newest(&it)));
    }

    #[test]
    fn the_line_gets_no_more_than_it_can_have_sent_and_four_fifths_of_it_on_average() {
        for bytes_s in [480, 960, 5_760] {
            let mut line = Line::new(bytes_s, 13);
            let mut encoder = Encoder::new(VEHICLE);
            let mut sent = Vec::new();
            for now in 0..10_000 {
                line.push(encoder.encode(&position(now as f32)));
                line.push(encoder.encode(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default())));
                while let Some(frame) = line.pop(ms(now)) {
                    sent.push((now, frame.as_bytes().len() + 13));
                }
                // Bytes in the line, of all given to it.
                let given: usize = sent.iter().map(|(_, bytes)| bytes).sum();
                let carried = u64::from(bytes_s) * (now + 1) / 1_000;
                let longest = 53 + u64::from(bytes_s) * 20 / 1_000 + 1;
                assert!(given as u64 <= carried + longest, "{given} B after {now} ms at {bytes_s} B/s");
            }
            let all: usize = sent.iter().map(|(_, bytes)| bytes).sum();
            let share = all as f64 / (10.0 * f64::from(bytes_s));
            assert!((0.79..0.84).contains(&share), "{share} of {bytes_s} B/s");
        }
    }

    #[test]
    fn an_abort_overtakes_what_waits_and_its_repetitions_leave_room_for_heartbeats() {
        let mut line = Line::new(480, 0);
        let (mut station, mut other) = (Encoder::new(GROUND), Encoder::new(VEHICLE));
        for _ in 0..4 {
            line.push(other.encode(&MavMessage::STATUSTEXT(STATUSTEXT_DATA::default())));
        }
        line.push(station.encode(&abort(0)));
        assert!(command_of(&line.pop(ms(0)).unwrap()) == Some(ABORT));
        leaving(&mut line, 0, 5_000);
        let mut left = Vec::new();
        for now in 5_000..15_000 {
            if now % 50 == 0 {
                line.push(station.encode(&abort((now / 50) as u8)));
            }
            if now % 100 == 0 {
                line.push(station.encode(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default())));
            }
            left.extend(line.pop(ms(now)).map(|frame| (now, frame)));
            assert!(line.waiting.len() <= 2, "nothing piles up");
        }
        let aborts = left.iter().filter(|(_, frame)| command_of(frame) == Some(ABORT)).count();
        let beats = left.len() - aborts;
        assert!(aborts >= 55 && beats >= 50, "{aborts} aborts, {beats} heartbeats in 10 s");
    }

    #[test]
    fn telemetry_is_dropped_before_it_waits_too_long_and_texts_and_answers_are_not() {
        let mut line = Line::new(480, 0);
        let mut encoder = Encoder::new(VEHICLE);
        let text = |line: &mut Line, encoder: &mut Encoder| {
            let text = STATUSTEXT_DATA { text: [b'a'; 50].into(), ..Default::default() };
            line.push(encoder.encode(&MavMessage::STATUSTEXT(text)));
        };
        for _ in 0..5 {
            text(&mut line, &mut encoder);
        }
        for id in 54_010..54_015 {
            line.push(encoder.encode_payload(id, &[1; 20]).unwrap());
        }
        let left = leaving(&mut line, 0, 10_000);
        let texts = left.iter().filter(|(_, frame)| frame.message_id() == STATUSTEXT_ID).count();
        assert_eq!((texts, line.dropped()), (5, 5));
    }

    #[test]
    fn a_radio_with_a_full_buffer_gets_less_and_again_more_when_it_has_room() {
        let rate = |line: &mut Line, from_s: u64| {
            let mut encoder = Encoder::new(VEHICLE);
            let mut bytes = 0;
            for now in from_s * 1_000..(from_s + 8) * 1_000 {
                line.push(encoder.encode(&position(now as f32)));
                bytes += line.pop(ms(now)).map_or(0, |frame| frame.as_bytes().len());
            }
            bytes as f64 / 8.0
        };
        let mut line = Line::new(1_000, 0);
        let full = rate(&mut line, 0);
        for second in 10..20 {
            line.radio.on_report(5, ms(1_000 * second));
        }
        let least = rate(&mut line, 20);
        assert!((least / full - LEAST).abs() < 0.03, "{least} of {full} B/s");
        for second in 30..45 {
            line.radio.on_report(95, ms(1_000 * second));
        }
        assert!(rate(&mut line, 45) > 0.95 * full);
        line.radio.on_report(0, ms(60_000));
        assert!(rate(&mut line, 71) > 0.95 * full, "a radio that says nothing any more");
    }
}

//! The history for a screen that attaches: the newest messages of the station, and every older one
//! that its state follows from.
//!
//! An hour on the pad is 700,000 messages, and nearly all of them repeat a state. An abort, its
//! answers and every change of the vehicle's state are retained however old they are, so a screen
//! that attaches late shows the same alarms as one that has been there all along.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::time::Duration;

use protocol::dialect::{MavMessage, TD_FLIGHT_STATUS_DATA, TdInterlock, TdMotor, TdPhase};
use protocol::frame::Frame;

use crate::attach::ToScreen;
use crate::attach::codec::{decode_to_screen, encode_to_screen, split};
use crate::update::Msg;

/// Size of the newest messages: an hour of telemetry in flight, half a minute of the worst flood.
const RECENT_BYTES_MAX: usize = 16 * 1024 * 1024;
/// Size of what is retained of older messages: 10,000 commands with their answers.
const OLDER_BYTES_MAX: usize = 2 * 1024 * 1024;
/// Messages are stored together in blocks of this size: one by one, each would take as much again
/// for its entry.
const BLOCK_BYTES: usize = 64 * 1024;
/// Maximum number of sources and messages whose last frame is retained; a vehicle sends some fifty.
const FRAMES_MAX: usize = 1_024;

pub(super) type Bytes = Arc<[u8]>;

/// The state that a status reports. A status with another one is retained.
type Reported = (TdPhase, TdInterlock, TdMotor, u32);

fn reported(status: &TD_FLIGHT_STATUS_DATA) -> Reported {
    (status.phase, status.interlocks, status.motor, status.boot_number)
}

/// The messages for screens that attach later.
#[derive(Default)]
pub(super) struct Backlog {
    /// Complete messages, each with its length before it.
    blocks: VecDeque<Bytes>,
    /// The block that is being filled.
    last: Vec<u8>,
    /// Size of both.
    bytes: usize,
    older: Older,
}

/// The retained part of messages that no longer fit.
#[derive(Default)]
struct Older {
    /// Commands, answers, texts and changes of state, each with its time.
    events: VecDeque<(Duration, Bytes)>,
    bytes: usize,
    /// The last frame of each source and message.
    frames: BTreeMap<(u8, u8, u32), (Duration, Bytes)>,
    /// State in the last retained status of each source.
    reported: BTreeMap<(u8, u8), Reported>,
}

impl Backlog {
    pub(super) fn push(&mut self, message: &[u8]) {
        if self.last.len() + message.len() > BLOCK_BYTES && !self.last.is_empty() {
            self.blocks.push_back(Bytes::from(&self.last[..]));
            self.last.clear();
        }
        self.last.extend_from_slice(message);
        self.bytes += message.len();
        while self.bytes > RECENT_BYTES_MAX {
            let Some(oldest) = self.blocks.pop_front() else { break };
            self.bytes -= oldest.len();
            for message in split(&oldest) {
                self.older.retain(message);
            }
        }
    }

    /// All of it, in order.
    pub(super) fn all(&self) -> impl Iterator<Item = Bytes> {
        let Older { events, frames, .. } = &self.older;
        let mut older: Vec<_> = events.iter().chain(frames.values()).collect();
        older.sort_by_key(|(at, _)| *at);
        let older: Vec<Bytes> = older.into_iter().map(|(_, message)| Arc::clone(message)).collect();
        older.into_iter().chain(self.blocks.iter().cloned()).chain([Bytes::from(&self.last[..])])
    }
}

impl Older {
    /// Retains a message if later ones do not replace it.
    fn retain(&mut self, message: &[u8]) {
        // A message that cannot be decoded was of no use to any screen.
        let Ok((ToScreen::Msg(msg), at)) = decode_to_screen(message) else { return };
        match &msg {
            Msg::Tick
            | Msg::Received { .. }
            | Msg::Sent { .. }
            | Msg::Links { .. }
            | Msg::OverLink(_)
            | Msg::Here(_) => {}
            Msg::Frame(frame) if !self.is_event(frame) => {
                let source = frame.source();
                let key = (source.system_id, source.component_id, frame.message_id());
                if self.frames.len() < FRAMES_MAX || self.frames.contains_key(&key) {
                    self.frames.insert(key, (at, prefixed(&msg, at)));
                }
            }
            _ => {
                let message = prefixed(&msg, at);
                self.bytes += message.len();
                self.events.push_back((at, message));
                while self.bytes > OLDER_BYTES_MAX {
                    let Some((_, oldest)) = self.events.pop_front() else { break };
                    self.bytes -= oldest.len();
                }
            }
        }
    }

    /// Whether a frame is an answer, a text, or a status with another state than the one before.
    fn is_event(&mut self, frame: &Frame) -> bool {
        match frame.decode() {
            Ok(MavMessage::COMMAND_ACK(_) | MavMessage::STATUSTEXT(_)) => true,
            Ok(MavMessage::TD_FLIGHT_STATUS(status)) => {
                let (source, now) = (frame.source(), reported(&status));
                self.reported.insert((source.system_id, source.component_id), now) != Some(now)
            }
            _ => false,
        }
    }
}

fn prefixed(msg: &Msg, at: Duration) -> Bytes {
    encode_to_screen(&ToScreen::Msg(msg.clone()), at).unwrap_or_default().into()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use protocol::dialect::{HEARTBEAT_DATA, STATUSTEXT_DATA};
    use protocol::frame::Encoder;
    use protocol::identity::VEHICLE;

    use super::*;
    use crate::attach::codec::split;
    use crate::model::{CommandKind, Model, Seat, Settings};
    use crate::update::update;

    /// Feeds a station's model and the backlog of its screens.
    struct Station {
        model: Model,
        backlog: Backlog,
        vehicle: Encoder,
        now: Duration,
    }

    impl Station {
        fn take(&mut self, msg: Msg) {
            self.backlog.push(&prefixed(&msg, self.now));
            update(&mut self.model, msg, self.now);
        }

        fn receive(&mut self, message: &MavMessage) {
            let frame = self.vehicle.encode(message);
            self.take(Msg::Frame(frame));
        }

        fn status(&mut self, status: TD_FLIGHT_STATUS_DATA) {
            self.receive(&MavMessage::TD_FLIGHT_STATUS(status));
            self.take(Msg::Tick);
        }
    }

    fn shown(model: &Model) -> BTreeSet<String> {
        model
            .alarms
            .list()
            .iter()
            .filter(|alarm| alarm.is_active())
            .map(|alarm| alarm.what.text.clone())
            .collect()
    }

    /// What a screen shows that attaches now.
    fn attached(backlog: &Backlog) -> Model {
        let mut screen = Model::new(Settings { vehicle: VEHICLE, ..Settings::on_screen("udpin:1") });
        for block in backlog.all() {
            for message in split(&block) {
                let Ok((ToScreen::Msg(msg), at)) = decode_to_screen(message) else { panic!("a message") };
                update(&mut screen, msg, at);
            }
        }
        screen
    }

    #[test]
    fn a_screen_that_attaches_after_700_000_frames_shows_the_same_alarms() {
        let model = Model::new(Settings { vehicle: VEHICLE, ..Settings::on_screen("udpin:1") });
        let vehicle = Encoder::new(VEHICLE);
        let mut station = Station { model, backlog: Backlog::default(), vehicle, now: Duration::ZERO };
        // Aborted on its pad with a live motor; another abort is never acknowledged.
        let mut aborted = TD_FLIGHT_STATUS_DATA {
            phase: TdPhase::TD_PHASE_PAD_IDLE,
            interlocks: TdInterlock::TD_INTERLOCK_ABORT_LATCHED | TdInterlock::TD_INTERLOCK_MOTOR_INHIBITED,
            motor: TdMotor::TD_MOTOR_LIVE,
            boot_number: 7,
            ..TD_FLIGHT_STATUS_DATA::default()
        };
        station.status(aborted.clone());
        station.take(Msg::command(CommandKind::Abort, Seat::default()));
        station.receive(&MavMessage::STATUSTEXT(STATUSTEXT_DATA::default()));
        for frame in 0..700_000_u32 {
            station.now = Duration::from_millis(5 * u64::from(frame));
            if frame % 20 == 0 {
                aborted.time_boot_ms = 5 * frame;
                station.status(aborted.clone());
            } else {
                station.receive(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
            }
        }
        assert!(!station.backlog.older.events.is_empty() && station.backlog.older.events.len() < 10);
        let alarms = shown(&station.model);
        assert!(alarms.iter().any(|text| text.starts_with("ONE PERSON: PIN IN")), "{alarms:?}");
        assert!(alarms.iter().any(|text| text.starts_with("ABORT NOT ACKNOWLEDGED")), "{alarms:?}");
        assert_eq!(shown(&attached(&station.backlog)), alarms);
    }

    #[test]
    fn the_newest_messages_are_complete_and_the_backlog_is_bounded() {
        let mut backlog = Backlog::default();
        let words = |number: u64| Msg::LinkWarning(format!("{number}{}", "x".repeat(number as usize % 300)));
        for number in 0..200_000 {
            backlog.push(&prefixed(&words(number), Duration::from_nanos(number)));
            assert!(backlog.bytes <= RECENT_BYTES_MAX && backlog.older.bytes <= OLDER_BYTES_MAX);
        }
        let all: Vec<u64> = backlog
            .all()
            .flat_map(|block| {
                split(&block).map(|m| decode_to_screen(m).unwrap().1.as_nanos() as u64).collect::<Vec<_>>()
            })
            .collect();
        assert!(all.windows(2).all(|pair| pair[1] == pair[0] + 1) && all.last() == Some(&199_999));
        assert!(backlog.blocks.len() <= RECENT_BYTES_MAX / (BLOCK_BYTES - 400) + 1);
    }
}

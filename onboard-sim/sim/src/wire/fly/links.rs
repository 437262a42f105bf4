//! The open links: removes copies, checks and adds signatures if a key is set, and records the
//! frames. Here are the people who may command over them, too, and a radio that is broken.

use std::collections::VecDeque;
use std::time::Duration;

use crate::sortie::Radio;
use flight::computer::crew::People;
use flight::rules::operator::{Name, Operator, Role};
use mavlink::MessageData as _;
use protocol::command::CommandRequest;
use protocol::crew_file::{CrewFile, Mode};
use protocol::dialect::{MavMessage, TD_BOOK_HEAD_DATA};
use protocol::frame::Frame;
use protocol::hub::LinkEvent;
use protocol::identity::Address;
use protocol::key_file::KeyFile;
use protocol::links::{self, MAX_AT_ONCE, Now};
use protocol::log::record::Direction;
use protocol::log::recorder::Recorder;
use protocol::signing::Anchor;
use protocol::transport::LinkAddress;

use super::FlyError;
use super::recording::{note, record_raw};
use crate::wire::endpoint::{Outgoing, Path};

/// Most received frames recorded in a second, so that a flood neither fills the log nor stops it.
const MAX_RECORDED_S: u32 = 500;

/// Every link of the vehicle.
pub(super) struct Links {
    open: links::Links,
    intake: Intake,
    stamps: Stamps,
    recorder: Option<Recorder>,
    /// Failures of links that are not reported yet.
    pub(super) down: Vec<String>,
    pub(super) tx_bytes: u64,
}

/// Received frames on their way into the log.
struct Intake {
    recorder: Option<Recorder>,
    second: u64,
    recorded: u32,
    left_out: u64,
}

impl Intake {
    fn record(&mut self, link: &str, frame: &Frame, time_s: f64) {
        let second = time_s as u64;
        if second != self.second {
            if self.left_out > 0 {
                let words = format!("a flood: {} frames are not recorded", self.left_out);
                note(self.recorder.as_ref(), time_s, &words);
            }
            (self.second, self.recorded, self.left_out) = (second, 0, 0);
        }
        if self.recorded >= MAX_RECORDED_S {
            self.left_out += 1;
            return;
        }
        self.recorded += 1;
        let recorder = self.recorder.as_ref();
        record_raw(recorder, Direction::Rx, link, frame, time_s);
        if let Some(CommandRequest { source, command, .. }) = CommandRequest::from_frame(frame) {
            let (system, component) = (source.system_id, source.component_id);
            note(recorder, time_s, &format!("command {command} from {system}/{component} over {link}"));
        } else if frame.message_id() == TD_BOOK_HEAD_DATA::ID
            && let Ok(MavMessage::TD_BOOK_HEAD(head)) = frame.decode()
        {
            let Address { system_id, component_id } = frame.source();
            let (entries, hash) = (head.entries, protocol::book::shown(&head.hash));
            note(recorder, time_s, &format!("book of {system_id}/{component_id}: {entries}:{hash}"));
        }
    }
}

impl Links {
    pub(super) async fn open(
        endpoints: &[LinkAddress],
        key_file: Option<&std::path::Path>,
        crew: Option<&CrewFile>,
        recorder: Option<Recorder>,
    ) -> Result<Self, FlyError> {
        let key = key_file.map(|path| KeyFile::open(path, "vehicle")).transpose()?;
        let operators = crew.map(CrewFile::keys).transpose()?.unwrap_or_default();
        let key = key.map(|(file, signing)| (file, signing.with_operators(operators)));
        let links = links::Links::open(endpoints, key).await?;
        let intake = Intake { recorder: recorder.clone(), second: 0, recorded: 0, left_out: 0 };
        Ok(Self { open: links, intake, down: Vec::new(), stamps: Stamps::begin(), recorder, tx_bytes: 0 })
    }

    fn now(&self, time_s: f64) -> Now {
        Now { time: Duration::from_secs_f64(time_s), stamp: self.stamps.now() }
    }

    /// Returns what has arrived, with its paths.
    pub(super) fn receive(&mut self, time_s: f64) -> Vec<(Path, LinkEvent)> {
        let now = self.now(time_s);
        let Self { open: links, intake, recorder, down, .. } = self;
        let recorder = recorder.as_ref();
        let mut received = Vec::new();
        let mut accepted = false;
        for number in 0..links.count() {
            let name = links.name(number).to_owned();
            for _ in 0..MAX_AT_ONCE {
                let Some(data) = links.try_receive(number) else { break };
                let path = Path { link: number, origin: data.origin() };
                for event in links.take(number, data, now) {
                    match &event {
                        LinkEvent::Accepted(_) => accepted = true,
                        LinkEvent::Frame(frame) | LinkEvent::Copy(frame) => {
                            intake.record(&name, frame, time_s);
                        }
                        // Counted but not recorded: a flood of forgeries must not fill the log.
                        LinkEvent::Rejected(..) => {}
                        LinkEvent::UnknownSenders(words) => {
                            note(recorder, time_s, &format!("link {name}: {words}"));
                        }
                        LinkEvent::Up(peer) => note(recorder, time_s, &format!("link {name} up: {peer}")),
                        LinkEvent::Down(why) => {
                            let words = format!("link {name} down: {why}");
                            note(recorder, time_s, &words);
                            down.push(words);
                        }
                    }
                    received.push((path, event));
                }
            }
        }
        // Save the timestamp before acting on the frame, so that it cannot be replayed after a
        // restart.
        if self.open.saves_timestamps_at(now.stamp) || accepted {
            self.save_timestamps(time_s);
        }
        received
    }

    /// Sends a frame. For a slow line it may wait until [`Links::send_what_waits`].
    pub(super) fn send(&mut self, Outgoing { frame, links: to }: &Outgoing, time_s: f64) {
        let now = self.now(time_s);
        let Self { open: links, recorder, tx_bytes, .. } = self;
        let count = links.count();
        for number in to.iter().copied().filter(|number| *number < count) {
            links.send(number, frame, None, now, &mut |name, frame, bytes| {
                *tx_bytes += bytes as u64;
                record_raw(recorder.as_ref(), Direction::Tx, name, frame, time_s);
            });
        }
    }

    /// Sends over each slow line as much as it can carry by now.
    pub(super) fn send_what_waits(&mut self, time_s: f64) {
        let now = self.now(time_s);
        let Self { open: links, recorder, tx_bytes, .. } = self;
        links.send_what_waits(now, &mut |name, frame, bytes| {
            *tx_bytes += bytes as u64;
            record_raw(recorder.as_ref(), Direction::Tx, name, frame, time_s);
        });
    }

    /// Number of frames dropped because their link had no room.
    pub(super) fn dropped(&self) -> u64 {
        self.open.dropped()
    }

    /// Writes the final statistics into the log: traffic of each link, and frames refused for their
    /// signature.
    pub(super) fn close(&mut self, time_s: f64) {
        let now = Duration::from_secs_f64(time_s);
        for (name, link) in self.open.each() {
            let (figures, framing) = (link.stats().figures(now), link.framing());
            let words = format!(
                "link {name}: {} frames received, {} copies, loss {:.1} %, {} bad checksums, {} unknown ids",
                framing.frames,
                link.copies(),
                100.0 * figures.loss,
                framing.crc_errors,
                framing.unknown_ids
            );
            note(self.recorder.as_ref(), time_s, &words);
        }
        if let Some(counters) = self.open.hub().signing() {
            let words = format!(
                "signatures: {} accepted, {} unsigned, {} wrong, {} replayed, {} too old, {} too new",
                counters.accepted,
                counters.unsigned,
                counters.wrong,
                counters.replayed,
                counters.too_old,
                counters.too_new
            );
            note(self.recorder.as_ref(), time_s, &words);
        }
        self.save_timestamps(time_s);
    }

    fn save_timestamps(&mut self, time_s: f64) {
        if let Err(error) = self.open.save_timestamps() {
            note(self.recorder.as_ref(), time_s, &format!("timestamps are not saved: {error}"));
        }
    }
}

/// The time for signatures: the time of day at the start, and from then on the time since. A clock
/// that is set while the vehicle runs does not move it.
struct Stamps {
    started: std::time::Instant,
    anchor: Anchor,
}

#[expect(
    clippy::disallowed_methods,
    reason = "signatures need the time of day; nothing in flight depends on it"
)]
impl Stamps {
    fn begin() -> Self {
        let of_day = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default();
        Self { started: std::time::Instant::now(), anchor: Anchor::at(of_day) }
    }

    fn now(&self) -> u64 {
        self.anchor.stamp(self.started.elapsed())
    }
}

// Conversion of a crew file's operators into the vehicle's types.

/// The operators with keys, in the order of the file.
pub(super) fn operators_of(crew: &CrewFile) -> Vec<Operator> {
    let operator = |member: &protocol::crew_file::Member| {
        let (number, _) = member.key.as_ref()?;
        let role = Role::from_index(member.role as u8)?;
        Some(Operator { number: *number, role, name: Name::new(&member.name) })
    };
    crew.members.iter().filter_map(operator).collect()
}

/// Number of people who must agree to arm and start. The proposal numbers begin elsewhere at each
/// boot.
pub(super) fn people_of(crew: &CrewFile, boot_number: u32) -> People {
    match crew.mode {
        Mode::OnePerson => People::One,
        Mode::TwoPerson => People::Two { first: boot_number as u16 },
    }
}

// Simulates a broken radio, by simulated time: frames are lost or arrive late.

/// One direction of the radio.
pub(crate) struct Delayed<T> {
    /// Frames under way with their arrival times, s, in the order they were sent.
    on_its_way: VecDeque<(f64, T)>,
}

impl<T> Default for Delayed<T> {
    fn default() -> Self {
        Self { on_its_way: VecDeque::new() }
    }
}

impl<T> Delayed<T> {
    /// The frames that arrive at a time; takes the frames sent at that time.
    pub(crate) fn pass(&mut self, sent: Vec<T>, time_s: f64, radio: Radio) -> Vec<T> {
        if radio.silent {
            self.on_its_way.clear();
            return Vec::new();
        }
        self.on_its_way.extend(sent.into_iter().map(|sent| (time_s + radio.delay_s, sent)));
        let arrived = self.on_its_way.iter().take_while(|(at_s, _)| *at_s <= time_s).count();
        self.on_its_way.drain(..arrived).map(|(_, sent)| sent).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERFECT: Radio = Radio { silent: false, delay_s: 0.0 };

    #[test]
    fn a_working_radio_delays_nothing() {
        let mut radio = Delayed::default();
        assert_eq!(radio.pass(vec![1, 2], 0.0, PERFECT), [1, 2]);
        assert!(radio.pass(Vec::new(), 0.1, PERFECT).is_empty());
    }

    #[test]
    fn late_frames_arrive_in_order_and_none_is_lost() {
        let late = Radio { delay_s: 0.5, ..PERFECT };
        let mut radio = Delayed::default();
        assert!(radio.pass(vec!['a'], 0.0, late).is_empty());
        assert!(radio.pass(vec!['b'], 0.25, late).is_empty());
        assert_eq!(radio.pass(Vec::new(), 0.5, late), ['a']);
        // The radio works again: frames sent earlier still arrive first.
        assert!(radio.pass(vec!['c'], 0.625, PERFECT).is_empty());
        assert_eq!(radio.pass(Vec::new(), 0.75, PERFECT), ['b', 'c']);
    }

    #[test]
    fn a_silent_radio_also_loses_frames_on_their_way() {
        let late = Radio { delay_s: 0.5, ..PERFECT };
        let silent = Radio { silent: true, ..late };
        let mut radio = Delayed::default();
        radio.pass(vec!['a'], 0.0, late);
        assert!(radio.pass(vec!['b'], 0.1, silent).is_empty());
        assert!(radio.pass(Vec::new(), 1.0, late).is_empty());
    }
}

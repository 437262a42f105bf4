//! The open links: turns bytes into messages and back, and records every frame.

use std::collections::VecDeque;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, ToSocketAddrs as _, UdpSocket};
use std::time::Duration;

use anyhow::Context as _;
use protocol::dialect::{MavCmd, MavMessage};
use protocol::frame::{Encoder, Frame, FramerCounters};
use protocol::hub::{HubLink, LinkEvent, Origin, Received};
use protocol::identity::Address;
use protocol::key_file::KeyFile;
use protocol::links::{Links, MAX_AT_ONCE, Now};
use protocol::log::record::{Direction, RawFrame, Record};
use protocol::log::recorder::Recorder;
use protocol::signing::{Anchor, Lockouts, Signing};
use protocol::transport::LinkAddress;

use super::clock::{Clock, LogTime};
use crate::model::{EXPIRES_AFTER, LinkReport};
use crate::update::Msg;

const FLIGHT_STATUS_ID: u32 = 54_000;
/// Time after which the run loop counts as stalled: stopped, swapped out, or asleep with its
/// computer.
const STOOD_STILL: Duration = Duration::from_secs(1);
/// How long after a stall the arriving data have waited.
const WAITED_FOR: Duration = Duration::from_millis(500);
/// Number of boots stored for each link.
const BOOTS_MAX: usize = 8;

/// The open links to one vehicle.
pub struct Wire {
    links: Links,
    /// The origins of the vehicle's boots, for each link.
    boots: Vec<BootOrigins>,
    vehicle: Address,
    lockouts: Lockouts,
    sources: Sources,
    /// When the run loop last came round.
    awake_at: Duration,
    /// Until then arriving data are stale: they are recorded and not shown.
    old_until: Duration,
    /// Whether a failure to save timestamps was reported.
    save_failure_reported: bool,
    encoder: Encoder,
    clock: Clock,
    pub(super) recorder: Option<Recorder>,
    log_time: LogTime,
    /// Receivers of every frame; they are never read from.
    listeners: Vec<UdpSocket>,
    /// Bytes that left and are not reported yet.
    sent_bytes: usize,
}

/// The origin of each boot's last frame over a link, and its time.
#[derive(Default)]
struct BootOrigins(Vec<(u32, Origin, Duration)>);

impl BootOrigins {
    /// Stores the origin of a boot.
    fn note(&mut self, boot: u32, from: Origin, now: Duration) {
        self.0.retain(|(known, _, at)| *known != boot && now.saturating_sub(*at) < EXPIRES_AFTER);
        self.0.push((boot, from, now));
        self.0.drain(..self.0.len().saturating_sub(BOOTS_MAX));
    }

    /// The origin of this boot; `None` if unknown.
    ///
    /// # Errors
    /// Only other boots are received over this link.
    fn origin_of(&self, boot: u32, now: Duration) -> Result<Option<Origin>, OtherVehicles> {
        let source = self.0.iter().find(|(known, ..)| *known == boot).map(|(_, from, _)| *from);
        let others = self.0.iter().any(|(_, _, at)| now.saturating_sub(*at) < EXPIRES_AFTER);
        if source.is_none() && others && boot != 0 { Err(OtherVehicles) } else { Ok(source) }
    }
}

/// Only other vehicles are received over a link.
struct OtherVehicles;

/// The result of one pass over the links.
#[derive(Default)]
struct Taken {
    msgs: Vec<Msg>,
    bytes: usize,
    accepted: bool,
}

impl Wire {
    /// Opens the links; `us` is our own address, `vehicle` that of the vehicle.
    ///
    /// # Errors
    /// An address cannot be bound or resolved.
    pub async fn open(
        (us, vehicle): (Address, Address),
        endpoints: Vec<LinkAddress>,
        key: Option<(KeyFile, Signing)>,
        clock: Clock,
        recorder: Option<Recorder>,
        log_time: LogTime,
    ) -> anyhow::Result<Self> {
        let links = Links::open(&endpoints, key).await?;
        Ok(Self {
            boots: endpoints.iter().map(|_| BootOrigins::default()).collect(),
            links,
            vehicle,
            lockouts: Lockouts::default(),
            sources: Sources::default(),
            awake_at: clock.now(),
            old_until: Duration::ZERO,
            save_failure_reported: false,
            encoder: Encoder::new(us),
            clock,
            recorder,
            log_time,
            listeners: Vec::new(),
            sent_bytes: 0,
        })
    }

    /// Forwards every received frame to these hosts and ports.
    ///
    /// # Errors
    /// A host is unknown.
    pub fn forward_to(&mut self, hosts: &[String]) -> anyhow::Result<()> {
        for host in hosts {
            let to = host.to_socket_addrs().ok().and_then(|mut found| found.next());
            let to = to.with_context(|| format!("forward: `{host}` is not known"))?;
            let any: IpAddr =
                if to.is_ipv4() { Ipv4Addr::UNSPECIFIED.into() } else { Ipv6Addr::UNSPECIFIED.into() };
            let socket = UdpSocket::bind((any, 0)).and_then(|socket| {
                socket.set_broadcast(true)?;
                socket.connect(to)?;
                socket.set_nonblocking(true)?;
                Ok(socket)
            });
            self.listeners.push(socket.with_context(|| format!("forward to {host}"))?);
        }
        Ok(())
    }

    /// The addresses of the links.
    pub fn endpoints(&self) -> impl Iterator<Item = &LinkAddress> {
        self.links.each().map(|(address, _)| address)
    }

    /// Capacity of the only link, bytes per second; `None` if no bound is known, and for several
    /// links.
    pub fn capacity_bytes_s(&self) -> Option<u32> {
        let mut all = self.endpoints();
        all.next().filter(|_| all.next().is_none())?.capacity_bytes_s()
    }

    /// The next data of any link, with the number of the link. Frames waiting for a slow line are
    /// sent meanwhile.
    pub async fn receive(&mut self) -> (usize, Received) {
        loop {
            let (clock, due_at) = (self.clock, self.links.hub().due_at());
            tokio::select! {
                received = self.links.next() => return received,
                () = clock.sleep_until(due_at) => self.send_what_waits(),
            }
        }
    }

    /// Records a pass of the run loop. Returns a message if it was stalled.
    pub(super) fn note_awake(&mut self) -> Option<Msg> {
        let now = self.clock.now();
        let stalled = now.saturating_sub(std::mem::replace(&mut self.awake_at, now));
        (stalled >= STOOD_STILL).then(|| {
            self.old_until = now + WAITED_FOR;
            Msg::StoodStill(stalled)
        })
    }

    /// Turns received data, and everything else that waits on the links, into messages.
    pub fn take(&mut self, (number, first): (usize, Received)) -> Vec<Msg> {
        let mut taken = Taken::default();
        taken.msgs.extend(self.note_awake());
        self.take_one(number, first, &mut taken);
        for number in 0..self.links.count() {
            for _ in 0..MAX_AT_ONCE {
                let Some(received) = self.links.try_receive(number) else { break };
                self.take_one(number, received, &mut taken);
            }
        }
        let Taken { mut msgs, bytes, accepted } = taken;
        msgs.push(Msg::Received { bytes, framing: self.framing() });
        // Saved before the frames are used, so that nothing can be replayed after a crash.
        if accepted {
            msgs.splice(0..0, self.save_timestamps());
        }
        msgs
    }

    fn take_one(&mut self, number: usize, received: Received, taken: &mut Taken) {
        if let Received::Datagram { bytes, .. } | Received::Stream(_, bytes) = &received {
            taken.bytes += bytes.len();
        }
        let from = received.origin();
        let msgs = &mut taken.msgs;
        let name = self.links.name(number).to_owned();
        let now = self.now();
        for event in self.links.take(number, received, now) {
            match event {
                LinkEvent::Frame(frame) => {
                    self.lockouts.accepted(&frame);
                    self.record(Direction::Rx, &name, &frame);
                    for listener in &self.listeners {
                        // The receiver may not listen yet.
                        let _ = listener.send(frame.as_bytes());
                    }
                    if now.time < self.old_until {
                        continue;
                    }
                    self.note_boot(number, &frame, from);
                    if self.links.count() > 1 {
                        msgs.push(Msg::OverLink(number));
                    }
                    if frame.source() == self.vehicle {
                        // On a link with one peer it is the same source after the line was opened
                        // again.
                        let several = name.starts_with("udp") || name.starts_with("tcpin");
                        msgs.extend(self.sources.turn_to((number, from.filter(|_| several))));
                    }
                    msgs.push(Msg::Frame(frame));
                }
                LinkEvent::Copy(frame) => {
                    self.record(Direction::Rx, &name, &frame);
                    self.note_boot(number, &frame, from);
                }
                LinkEvent::Accepted(_) => taken.accepted = true,
                LinkEvent::UnknownSenders(words) => msgs.push(Msg::LinkWarning(self.named(&name, words))),
                // Counted and shown in the report of the link; a sender that is locked out is
                // reported.
                LinkEvent::Rejected(frame, why) => {
                    let lockout = self.lockouts.refused(&frame, why, now.time, now.stamp);
                    msgs.extend(lockout.map(Msg::LinkWarning));
                }
                LinkEvent::Up(peer) => msgs.push(Msg::LinkUp(self.named(&name, peer))),
                LinkEvent::Down(why) if self.links.each().all(|(_, link)| link.trouble().is_some()) => {
                    msgs.push(Msg::LinkDown(why));
                }
                LinkEvent::Down(why) => msgs.push(Msg::LinkWarning(format!("one link down: {why}"))),
            }
        }
    }

    /// The text, with the name of the link if there are several.
    fn named(&self, name: &str, words: String) -> String {
        if self.links.count() > 1 { format!("{name}: {words}") } else { words }
    }

    fn framing(&self) -> FramerCounters {
        self.links.each().fold(FramerCounters::default(), |mut sum, (_, link)| {
            sum += link.framing();
            sum
        })
    }

    /// Stores the origin of a boot of the vehicle: commands for it go there.
    fn note_boot(&mut self, number: usize, frame: &Frame, from: Option<Origin>) {
        if frame.source() == self.vehicle
            && frame.message_id() == FLIGHT_STATUS_ID
            && let (Some(from), Ok(MavMessage::TD_FLIGHT_STATUS(status))) = (from, frame.decode())
        {
            let now = self.clock.now();
            self.boots[number].note(status.boot_number, from, now);
        }
    }

    /// Sends a message over every link and returns the message that counts the bytes. For a slow
    /// line it may wait. On a link that listens, a message for the vehicle goes only to the origin
    /// of its shown `boot`; a heartbeat, an abort, a hold and a disarm go to every peer there. 0:
    /// the vehicle has reported no boot.
    pub fn send(&mut self, message: &MavMessage, boot: u32) -> Msg {
        let frame = self.encoder.encode(message);
        let now = self.now();
        for number in 0..self.links.count() {
            let origin = || self.boots[number].origin_of(boot, now.time);
            let to = if concerns_all(message) { Ok(None) } else { origin() };
            // Only other vehicles are received over this link.
            let Ok(to) = to else { continue };
            let Self { links, recorder, log_time, sent_bytes, .. } = self;
            links.send(number, &frame, to, now, &mut |name, frame, count| {
                *sent_bytes += count;
                record(recorder.as_ref(), log_time, Direction::Tx, name, frame);
            });
        }
        self.send_what_waits();
        Msg::Sent { bytes: std::mem::take(&mut self.sent_bytes), drops: self.links.dropped() }
    }

    /// Gives each slow line what it can carry by now.
    fn send_what_waits(&mut self) {
        let now = self.now();
        let Self { links, recorder, log_time, sent_bytes, .. } = self;
        links.send_what_waits(now, &mut |name, frame, count| {
            *sent_bytes += count;
            record(recorder.as_ref(), log_time, Direction::Tx, name, frame);
        });
    }

    /// Reports the state of each link. Also saves signing timestamps now and then.
    pub fn report(&mut self) -> Vec<Msg> {
        let now = self.now();
        let mut msgs = Vec::new();
        if self.links.saves_timestamps_at(now.stamp) {
            msgs.extend(self.save_timestamps());
        }
        let links = self.links.each().map(|(address, link)| report_of(address, link, now.time));
        msgs.push(Msg::Links { links: links.collect(), signing: self.links.hub().signing() });
        msgs
    }

    /// Saves signing timestamps for the next run; reports a failure once.
    pub fn save_timestamps(&mut self) -> Option<Msg> {
        let failed = self.links.save_timestamps().err();
        let was_reported = std::mem::replace(&mut self.save_failure_reported, failed.is_some());
        let what = "signing time stamps are not saved, so frames could be replayed later";
        failed.filter(|_| !was_reported).map(|why| Msg::LinkWarning(format!("{what}: {why}")))
    }

    fn now(&self) -> Now {
        let time = self.clock.now();
        Now { time, stamp: Anchor::at(Duration::from_nanos(self.clock.start_unix_ns())).stamp(time) }
    }

    fn record(&self, direction: Direction, link: &str, frame: &Frame) {
        record(self.recorder.as_ref(), &self.log_time, direction, link, frame);
    }
}

fn record(recorder: Option<&Recorder>, log_time: &LogTime, direction: Direction, link: &str, frame: &Frame) {
    if let Some(recorder) = recorder
        && let Some(bytes) = frame.for_log()
    {
        let frame = RawFrame { direction, endpoint: "ground", link: link.to_owned(), bytes };
        recorder.try_record(Record::RawFrame(frame), log_time.now_ns());
    }
}

/// Whether a message goes to every peer of the link.
fn concerns_all(message: &MavMessage) -> bool {
    let MavMessage::COMMAND_LONG(sent) = message else { return matches!(message, MavMessage::HEARTBEAT(_)) };
    match sent.command {
        MavCmd::MAV_CMD_DO_FLIGHTTERMINATION | MavCmd::MAV_CMD_DO_PAUSE_CONTINUE => true,
        MavCmd::MAV_CMD_COMPONENT_ARM_DISARM => sent.param1 == 0.0,
        _ => false,
    }
}

fn report_of(address: &LinkAddress, link: &HubLink, now: Duration) -> LinkReport {
    LinkReport {
        name: address.to_string(),
        figures: link.stats().figures(now),
        sources: link.stats().sources(now),
        capacity_bytes_s: address.capacity_bytes_s(),
        copies: link.copies(),
        trouble: link.trouble().map(str::to_owned),
    }
}

/// How many sources are distinguished; a reboot gives a vehicle that connects by itself another
/// one.
const SOURCES_MAX: usize = 64;

/// Numbers the sources of the vehicle's frames, by link and address.
#[derive(Default)]
struct Sources {
    numbers: VecDeque<((usize, Option<Origin>), u16)>,
    next: u16,
    reported: u16,
}

impl Sources {
    /// Frames come from this source from now on. Returns the message about it, if the last ones
    /// came from another source.
    fn turn_to(&mut self, source: (usize, Option<Origin>)) -> Option<Msg> {
        let found = self.numbers.iter().find(|(known, _)| *known == source).map(|(_, number)| *number);
        let number = found.unwrap_or_else(|| {
            // The link's number in the upper byte.
            self.next = (source.0 as u16) << 8 | (self.next.wrapping_add(1) & 0xff);
            self.numbers.drain(..(self.numbers.len() + 1).saturating_sub(SOURCES_MAX));
            self.numbers.push_back((source, self.next));
            self.next
        });
        (std::mem::replace(&mut self.reported, number) != number).then_some(Msg::FromSource(number))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::dialect::HEARTBEAT_DATA;
    use protocol::identity::{GROUND, VEHICLE};
    use protocol::log::reader::{LogItem, LogReader};
    use protocol::log::writer::LogHeader;

    /// More frames than the queue has room for, before anything can leave it.
    #[test]
    fn a_frame_that_the_queue_does_not_take_is_not_recorded_as_sent() {
        const FRAMES: u64 = 3_000;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sent.mcap");
        let recorder = Recorder::create(&path, false, &LogHeader::default()).unwrap();
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        let (mut reported_drops, mut reported_bytes) = (0, 0);
        runtime.block_on(async {
            let clock = Clock::start();
            let link = vec![LinkAddress::UdpOut("127.0.0.1:9".to_owned())];
            let (log, time) = (Some(recorder.clone()), LogTime::Run(clock));
            let mut wire = Wire::open((GROUND, VEHICLE), link, None, clock, log, time).await.unwrap();
            for _ in 0..FRAMES {
                let sent = wire.send(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()), 0);
                let Msg::Sent { bytes, drops } = sent else { panic!("{sent:?}") };
                (reported_drops, reported_bytes) = (drops, reported_bytes + bytes);
            }
        });
        assert_eq!(recorder.dropped(), 0);
        recorder.finish().unwrap();
        let mut reader = LogReader::new(std::fs::File::open(&path).unwrap());
        let (mut recorded, mut bytes) = (0, 0);
        while let Some(item) = reader.next_item().unwrap() {
            if let LogItem::Message { data, .. } = item {
                (recorded, bytes) = (recorded + 1, bytes + data.len());
            }
        }
        assert!(reported_drops > 0 && recorded > 0, "{reported_drops} dropped, {recorded} recorded");
        assert_eq!((recorded + reported_drops, bytes), (FRAMES, reported_bytes));
    }

    /// A phone's map and a whole network receive the station's frames; an answer is not accepted.
    #[test]
    fn a_listener_receives_the_vehicle_and_its_frames_are_ignored() {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        runtime.block_on(async {
            let clock = Clock::start();
            let link = vec![LinkAddress::UdpIn("127.0.0.1:0".to_owned())];
            let time = LogTime::Run(clock);
            let mut wire = Wire::open((GROUND, VEHICLE), link, None, clock, None, time).await.unwrap();
            let phone = UdpSocket::bind("127.0.0.1:0").unwrap();
            let anybody = UdpSocket::bind("0.0.0.0:0").unwrap();
            let network = format!("127.255.255.255:{}", anybody.local_addr().unwrap().port());
            wire.forward_to(&[phone.local_addr().unwrap().to_string(), network]).unwrap();
            let Some(LinkAddress::UdpIn(station)) = wire.endpoints().next().cloned() else { panic!() };
            let vehicle = UdpSocket::bind("127.0.0.1:0").unwrap();
            let (mut said, mut stranger) = (Encoder::new(VEHICLE), Encoder::new(GROUND));
            for _ in 0..3 {
                let frame = said.encode(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
                vehicle.send_to(frame.as_bytes(), &station).unwrap();
                let mut frames = Vec::new();
                while frames.is_empty() {
                    let received = wire.receive().await;
                    let msgs = wire.take(received).into_iter();
                    frames.extend(
                        msgs.filter_map(|msg| if let Msg::Frame(frame) = msg { Some(frame) } else { None }),
                    );
                }
                assert_eq!(frames, std::slice::from_ref(&frame));
                let mut bytes = [0; 300];
                let (count, from) = phone.recv_from(&mut bytes).unwrap();
                assert_eq!(&bytes[..count], frame.as_bytes());
                let count = anybody.recv(&mut bytes).unwrap();
                assert_eq!(&bytes[..count], frame.as_bytes());
                let answer = stranger.encode(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()));
                phone.send_to(answer.as_bytes(), from).unwrap();
            }
        });
    }
}

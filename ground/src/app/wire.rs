//! The link: bytes to messages and back, every frame into the log.

use anyhow::Context as _;
use protocol::dialect::MavMessage;
use protocol::frame::{Encoder, Framer};
use protocol::identity::GROUND;
use protocol::log::record::{Direction, RawFrame, Record};
use protocol::log::recorder::Recorder;
use protocol::transport::{Endpoint, Received, Transport, TransportSender};

use super::clock::LogTime;
use crate::update::Msg;

/// An open link with its framing.
pub struct Wire {
    transport: Transport,
    sender: TransportSender,
    framer: Framer,
    encoder: Encoder,
    recorder: Option<Recorder>,
    log_time: LogTime,
    name: String,
    ended: bool,
}

impl Wire {
    /// Opens a link.
    ///
    /// # Errors
    /// A UDP address cannot be bound or resolved.
    pub async fn open(
        endpoint: Endpoint,
        recorder: Option<Recorder>,
        log_time: LogTime,
    ) -> anyhow::Result<Self> {
        let transport = Transport::open(endpoint.clone())
            .await
            .with_context(|| format!("opening the link {endpoint}"))?;
        Ok(Self {
            sender: transport.sender(),
            name: transport.endpoint().to_string(),
            transport,
            framer: Framer::new(),
            encoder: Encoder::new(GROUND),
            recorder,
            log_time,
            ended: false,
        })
    }

    /// Where it leads.
    pub fn endpoint(&self) -> &Endpoint {
        self.transport.endpoint()
    }

    /// The next thing the link brings.
    pub async fn receive(&mut self) -> Received {
        if !self.ended {
            if let Some(received) = self.transport.receive().await {
                return received;
            }
            self.ended = true;
            return Received::Down(format!("{}: the link has ended", self.name));
        }
        std::future::pending().await
    }

    /// What was received, and whatever waits behind it, as messages.
    pub fn take(&mut self, first: Received) -> Vec<Msg> {
        let mut msgs = Vec::new();
        let mut next = Some(first);
        while let Some(received) = next {
            match received {
                Received::Datagram(bytes) => {
                    self.framer.push_datagram(&bytes);
                    self.take_frames(bytes.len(), &mut msgs);
                }
                Received::Stream(bytes) => {
                    self.framer.push(&bytes);
                    self.take_frames(bytes.len(), &mut msgs);
                }
                Received::Silence => {
                    self.framer.on_silence();
                    self.take_frames(0, &mut msgs);
                }
                Received::Up(peer) => msgs.push(Msg::LinkUp(peer)),
                Received::Down(why) => msgs.push(Msg::LinkDown(why)),
            }
            next = self.transport.try_receive();
        }
        msgs
    }

    fn take_frames(&mut self, bytes: usize, msgs: &mut Vec<Msg>) {
        while let Some(frame) = self.framer.next_frame() {
            self.record(Direction::Rx, frame.as_bytes());
            msgs.push(Msg::Frame(frame));
        }
        msgs.push(Msg::Received { bytes, framing: self.framer.counters() });
    }

    /// Sends a message; returns what is to be counted.
    pub fn send(&mut self, message: &MavMessage) -> Msg {
        let frame = self.encoder.encode(message);
        self.record(Direction::Tx, frame.as_bytes());
        let bytes = frame.as_bytes().to_vec();
        let count = bytes.len();
        self.sender.send(bytes);
        Msg::Sent { bytes: count, drops: self.sender.dropped() }
    }

    fn record(&self, direction: Direction, bytes: &[u8]) {
        if let Some(recorder) = &self.recorder {
            let frame =
                RawFrame { direction, endpoint: "ground", link: self.name.clone(), bytes: bytes.to_vec() };
            recorder.try_record(Record::RawFrame(frame), self.log_time.now_ns());
        }
    }
}

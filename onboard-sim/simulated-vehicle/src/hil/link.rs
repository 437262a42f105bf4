//! One link between a world and a flight computer: messages in and out.

use std::collections::BTreeMap;
use std::io;

use protocol::dialect::MavMessage;
use protocol::frame::{Encoder, Framer};
use protocol::hub::{Origin, Received, StreamId};
use protocol::identity::Address;
use protocol::transport::{LinkAddress, Transport, TransportSender};

/// An open link. Nothing is signed: it is a cable on a bench.
pub struct HilLink {
    transport: Transport,
    sender: TransportSender,
    encoder: Encoder,
    datagrams: Framer,
    streams: BTreeMap<StreamId, Framer>,
}

/// What a link brought.
#[derive(Debug, Clone, PartialEq)]
pub enum Brought {
    Messages(Vec<MavMessage>),
    /// The link works; the text names the peer.
    Up(String),
    /// The link does not work; the text says why. It is opened again by itself.
    Down(String),
}

impl HilLink {
    /// Opens a link for a component. It must be called within a tokio runtime.
    ///
    /// # Errors
    /// The address cannot be bound or resolved.
    pub async fn open(address: LinkAddress, source: Address) -> io::Result<Self> {
        let transport = Transport::open(address).await?;
        Ok(Self {
            sender: transport.sender(),
            transport,
            encoder: Encoder::new(source),
            datagrams: Framer::new(),
            streams: BTreeMap::new(),
        })
    }

    /// The address; with port 0 it names the port that the system chose.
    pub fn address(&self) -> &LinkAddress {
        self.transport.address()
    }

    /// Sends messages together: one datagram, or one write.
    pub fn send(&mut self, messages: &[MavMessage]) {
        let bytes = messages.iter().flat_map(|message| self.encoder.encode(message).as_bytes().to_vec());
        // A full queue drops the frame, as a wire would: it is sent again or flown without.
        let _ = self.sender.send(bytes.collect());
    }

    /// Waits for what the link brings next; `None` once its task has ended.
    pub async fn receive(&mut self) -> Option<Brought> {
        let received = self.transport.receive().await?;
        Some(self.read(received))
    }

    /// What has arrived already, without waiting.
    pub fn try_receive(&mut self) -> Option<Brought> {
        let received = self.transport.try_receive()?;
        Some(self.read(received))
    }

    fn read(&mut self, received: Received) -> Brought {
        match received {
            Received::Datagram { from, bytes } => {
                self.datagrams.push_datagram(&bytes);
                let messages = messages_of(&mut self.datagrams);
                if !messages.is_empty() {
                    self.sender.believe(Origin::Datagram(from));
                }
                Brought::Messages(messages)
            }
            Received::Stream(stream, bytes) => {
                let framer = self.streams.entry(stream).or_default();
                framer.push(&bytes);
                Brought::Messages(messages_of(framer))
            }
            Received::Silence(stream) => {
                let framer = self.streams.entry(stream).or_default();
                framer.on_silence();
                Brought::Messages(messages_of(framer))
            }
            Received::Gone(stream) => {
                self.streams.remove(&stream);
                Brought::Messages(Vec::new())
            }
            Received::Up(peer) => Brought::Up(peer),
            Received::Strangers(words) | Received::Down(words) => Brought::Down(words),
        }
    }
}

/// The messages of whole frames. A value outside the dialect makes a message unknown, and it is left out.
fn messages_of(framer: &mut Framer) -> Vec<MavMessage> {
    let mut messages = Vec::new();
    while let Some(view) = framer.next_view() {
        messages.extend(view.decode().ok());
    }
    messages
}

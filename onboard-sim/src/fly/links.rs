//! The open links, their framing and their raw frames in the log.

use protocol::frame::{Frame, Framer};
use protocol::log::record::Direction;
use protocol::log::recorder::Recorder;
use protocol::transport::{Endpoint, Received, Transport};

use super::FlyError;
use super::recording::{note, record_raw};

/// Every link of the vehicle.
pub(super) struct Links {
    open: Vec<(Transport, Framer, String)>,
    recorder: Option<Recorder>,
    pub(super) tx_bytes: u64,
}

impl Links {
    pub(super) async fn open(endpoints: &[Endpoint], recorder: Option<Recorder>) -> Result<Self, FlyError> {
        let mut open = Vec::new();
        for endpoint in endpoints {
            let name = endpoint.to_string();
            let transport = Transport::open(endpoint.clone())
                .await
                .map_err(|source| FlyError::Link { link: name.clone(), source })?;
            open.push((transport, Framer::new(), name));
        }
        Ok(Self { open, recorder, tx_bytes: 0 })
    }

    pub(super) fn receive(&mut self, time_s: f64) -> Vec<Frame> {
        let mut frames = Vec::new();
        for (transport, framer, name) in &mut self.open {
            while let Some(received) = transport.try_receive() {
                match received {
                    Received::Datagram(bytes) => framer.push_datagram(&bytes),
                    Received::Stream(bytes) => framer.push(&bytes),
                    Received::Silence => framer.on_silence(),
                    Received::Up(peer) => {
                        note(self.recorder.as_ref(), time_s, &format!("link {name} up: {peer}"));
                    }
                    Received::Down(why) => {
                        note(self.recorder.as_ref(), time_s, &format!("link {name} down: {why}"));
                    }
                }
                while let Some(frame) = framer.next_frame() {
                    record_raw(self.recorder.as_ref(), Direction::Rx, name, frame.as_bytes(), time_s);
                    frames.push(frame);
                }
            }
        }
        frames
    }

    pub(super) fn send(&mut self, bytes: &[u8], time_s: f64) {
        for (transport, _, name) in &self.open {
            // What found no room was not sent, and the log must not say so.
            if transport.sender().send(bytes.to_vec()) {
                self.tx_bytes += bytes.len() as u64;
                record_raw(self.recorder.as_ref(), Direction::Tx, name, bytes, time_s);
            }
        }
    }

    /// Frames that found no room on their link.
    pub(super) fn dropped(&self) -> u64 {
        self.open.iter().map(|(transport, ..)| transport.sender().dropped()).sum()
    }
}

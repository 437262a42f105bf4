//! The open links of a program, together: their transports, the hub over them, and the file of the
//! key that signs.

use std::io;
use std::time::Duration;

use crate::frame::Frame;
use crate::hub::{Hub, HubLink, LinkEvent, Origin, Received};
use crate::key_file::{KeyFile, KeyFileError};
use crate::signing::Signing;
use crate::transport::{LinkAddress, Transport, TransportSender};

/// The longest time between two savings of the signing timestamps, in their unit of 10 us: 1 s.
const SAVE_EVERY: u64 = 100_000;
/// Most items to take from one link at once, so that a flood delays nothing else.
pub const MAX_AT_ONCE: usize = 1024;

/// Why there are no links.
#[derive(Debug, thiserror::Error)]
#[error("cannot open the link {link}")]
pub struct OpenError {
    pub link: String,
    pub source: io::Error,
}

/// The present, by both clocks of a link.
#[derive(Debug, Clone, Copy)]
pub struct Now {
    /// Since an epoch that the caller chooses.
    pub time: Duration,
    /// For signatures, in units of 10 us.
    pub stamp: u64,
}

/// Takes note of a frame that has left: the name of its link, the frame, and its bytes on the line.
pub type OnSent<'a> = &'a mut dyn FnMut(&str, &Frame, usize);

/// The open links to one peer.
#[derive(Debug)]
pub struct Links {
    open: Vec<OpenLink>,
    hub: Hub,
    key_file: Option<KeyFile>,
    saved_at: u64,
}

#[derive(Debug)]
struct OpenLink {
    transport: Transport,
    sender: TransportSender,
    name: String,
    ended: bool,
}

impl Links {
    /// Opens the links, within a tokio runtime.
    ///
    /// # Errors
    /// An address cannot be bound or resolved.
    pub async fn open(addresses: &[LinkAddress], key: Option<(KeyFile, Signing)>) -> Result<Self, OpenError> {
        let mut open = Vec::new();
        for address in addresses {
            let transport = Transport::open(address.clone())
                .await
                .map_err(|source| OpenError { link: address.to_string(), source })?;
            let name = transport.address().to_string();
            open.push(OpenLink { sender: transport.sender(), transport, name, ended: false });
        }
        let (key_file, signing) = key.unzip();
        let carried: Vec<_> = open.iter().map(|link| link.transport.address().capacity_bytes_s()).collect();
        let hub = Hub::new(open.len(), signing).over(&carried);
        Ok(Self { open, hub, key_file, saved_at: 0 })
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.open.len()
    }

    pub fn name(&self, number: usize) -> &str {
        &self.open[number].name
    }

    /// Each link with its address.
    pub fn each(&self) -> impl Iterator<Item = (&LinkAddress, &HubLink)> {
        self.open.iter().map(|link| link.transport.address()).zip(self.hub.links())
    }

    pub fn hub(&self) -> &Hub {
        &self.hub
    }

    /// The next data of any link, with its number.
    pub async fn next(&mut self) -> (usize, Received) {
        std::future::poll_fn(|context| {
            for (number, link) in self.open.iter_mut().enumerate().filter(|(_, link)| !link.ended) {
                match link.transport.poll_receive(context) {
                    std::task::Poll::Pending => {}
                    std::task::Poll::Ready(Some(received)) => {
                        return std::task::Poll::Ready((number, received));
                    }
                    std::task::Poll::Ready(None) => {
                        link.ended = true;
                        let why = format!("{}: the link has ended", link.name);
                        return std::task::Poll::Ready((number, Received::Down(why)));
                    }
                }
            }
            std::task::Poll::Pending
        })
        .await
    }

    /// Returns data that waits on a link.
    pub fn try_receive(&mut self, number: usize) -> Option<Received> {
        self.open[number].transport.try_receive()
    }

    /// Interprets received data. Accepted senders are reported to the link.
    pub fn take(&mut self, number: usize, received: Received, now: Now) -> Vec<LinkEvent> {
        let events = self.hub.take(number, received, now.time, now.stamp);
        for event in &events {
            if let LinkEvent::Accepted(origin) = event {
                self.open[number].sender.accept(*origin);
            }
        }
        events
    }

    /// Sends a frame over one link, to all its peers or `to` one of them. For a slow line it may
    /// wait until [`Self::send_what_waits`].
    pub fn send(&mut self, number: usize, frame: &Frame, to: Option<Origin>, now: Now, on_sent: OnSent<'_>) {
        if let Some(bytes) = self.hub.send(number, frame, now.stamp) {
            self.hand_over(number, frame, bytes, to, now, on_sent);
        }
    }

    /// Sends over each slow line as much as it can carry by now.
    pub fn send_what_waits(&mut self, now: Now, on_sent: OnSent<'_>) {
        for number in 0..self.open.len() {
            while let Some((frame, bytes)) = self.hub.leaving(number, now.time, now.stamp) {
                self.hand_over(number, &frame, bytes, None, now, on_sent);
            }
        }
    }

    fn hand_over(
        &mut self,
        number: usize,
        frame: &Frame,
        bytes: Vec<u8>,
        to: Option<Origin>,
        now: Now,
        on_sent: OnSent<'_>,
    ) {
        let OpenLink { sender, name, .. } = &self.open[number];
        let count = bytes.len();
        // A frame that finds no room in the queue has not been sent, and no log may contain it.
        if sender.send_to(bytes, to) {
            self.hub.on_sent(number, count, now.time);
            on_sent(name, frame, count);
        }
    }

    /// Number of frames dropped because their link had no room.
    pub fn dropped(&self) -> u64 {
        let of_lines: u64 = self.hub.links().iter().map(HubLink::dropped).sum();
        of_lines + self.open.iter().map(|link| link.sender.dropped()).sum::<u64>()
    }

    /// Whether the signing timestamps were last saved a second ago or earlier; then they count as
    /// saved now.
    pub fn saves_timestamps_at(&mut self, stamp: u64) -> bool {
        let due = stamp.saturating_sub(self.saved_at) >= SAVE_EVERY;
        if due {
            self.saved_at = stamp;
        }
        due
    }

    /// Saves the signing timestamps for the next run.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn save_timestamps(&mut self) -> Result<(), KeyFileError> {
        match (&mut self.key_file, self.hub.signing_memory()) {
            (Some(file), Some(memory)) => file.remember(&memory),
            _ => Ok(()),
        }
    }
}

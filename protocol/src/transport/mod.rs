//! Thin drivers: bytes between this process and a link. Framing, numbering, signing and statistics are
//! the callers'.
//!
//! A [`Transport`] is two bounded queues and a task. The task outlives trouble: a serial line that goes
//! away and a connection that breaks are tried again twice a second, and a UDP peer that restarts on another port is
//! picked up. A link that anybody can send to answers only those of whom its owner says that it believed a frame.

mod endpoint;
mod serial;
mod stream;
mod tcp;
mod udp;

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use tokio::sync::mpsc;

pub use crate::hub::{Origin, Received};
pub use endpoint::{Endpoint, EndpointError};

const QUEUE: usize = 1024;
/// Senders that were believed and that the link has not taken note of yet; the next frame of one says it again.
const BELIEVED: usize = 256;
/// What does not work is tried again after this long.
const REOPEN_AFTER: Duration = Duration::from_millis(500);

/// An open link.
#[derive(Debug)]
pub struct Transport {
    endpoint: Endpoint,
    received: mpsc::Receiver<Received>,
    sender: TransportSender,
}

/// The sending half of a [`Transport`].
#[derive(Debug, Clone)]
pub struct TransportSender {
    queue: mpsc::Sender<Vec<u8>>,
    believed: mpsc::Sender<Origin>,
    dropped: Arc<AtomicU64>,
}

impl TransportSender {
    /// Queues bytes; says whether there was room. A link that is too slow to take them drops and counts them.
    pub fn send(&self, bytes: Vec<u8>) -> bool {
        let queued = self.queue.try_send(bytes).is_ok();
        if !queued {
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
        queued
    }

    /// Tells the link that a frame of this sender was believed ([`crate::hub::News::Believed`]): only then is it
    /// answered, and only such a sender keeps its place against others.
    pub fn believe(&self, origin: Origin) {
        // Where there is no room its next frame says it again.
        let _ = self.believed.try_send(origin);
    }

    /// Writes that found no room.
    pub fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }
}

impl Transport {
    /// Opens a link. Must be called within a tokio runtime.
    ///
    /// # Errors
    /// An address cannot be bound or, for UDP, resolved. A serial device that is not there and a TCP server that does
    /// not answer are no error: they may come later, and [`Received::Down`] says so until then.
    pub async fn open(mut endpoint: Endpoint) -> io::Result<Self> {
        let is_udp = matches!(endpoint, Endpoint::UdpIn(_) | Endpoint::UdpOut(_));
        let (inbox, received) = mpsc::channel(if is_udp { udp::AHEAD } else { QUEUE });
        let (queue, outbox) = mpsc::channel(QUEUE);
        let (believed, believed_by_owner) = mpsc::channel(BELIEVED);
        match &mut endpoint {
            Endpoint::UdpIn(address) => {
                let bound =
                    udp::listen(address, udp::Ends { inbox, outbox, believed: believed_by_owner }).await?;
                // Port 0 lets the system choose; the endpoint then names its choice.
                if address.ends_with(":0") {
                    *address = bound.to_string();
                }
            }
            Endpoint::UdpOut(address) => {
                udp::connect(address, udp::Ends { inbox, outbox, believed: believed_by_owner }).await?;
            }
            Endpoint::TcpIn(address) => {
                let bound = tcp::listen(address, inbox, outbox).await?;
                if address.ends_with(":0") {
                    *address = bound.to_string();
                }
            }
            Endpoint::TcpOut(address) => tcp::connect(address.clone(), inbox, outbox),
            Endpoint::Serial { path, baud } => serial::open(path.clone(), *baud, inbox, outbox),
        }
        let sender = TransportSender { queue, believed, dropped: Arc::new(AtomicU64::new(0)) };
        Ok(Self { endpoint, received, sender })
    }

    /// Where it leads; for `udpin` and `tcpin` with port 0, with the port that the system chose.
    pub fn endpoint(&self) -> &Endpoint {
        &self.endpoint
    }

    /// The next thing the link brings; `None` once its task has ended.
    pub async fn receive(&mut self) -> Option<Received> {
        self.received.recv().await
    }

    /// As [`Transport::receive`], to wait for several links at once.
    pub fn poll_receive(
        &mut self,
        context: &mut std::task::Context<'_>,
    ) -> std::task::Poll<Option<Received>> {
        self.received.poll_recv(context)
    }

    /// What is waiting already, without waiting for more.
    pub fn try_receive(&mut self) -> Option<Received> {
        self.received.try_recv().ok()
    }

    /// A handle to send with.
    pub fn sender(&self) -> TransportSender {
        self.sender.clone()
    }
}

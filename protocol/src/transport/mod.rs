//! Thin drivers: bytes between this process and a link. Framing, numbering, signing and statistics are
//! the callers'.
//!
//! A [`Transport`] is two bounded queues and a task. The task outlives trouble: a serial line that goes
//! away is tried again twice a second, and a UDP peer that restarts on another port is picked up.

mod endpoint;
mod serial;
mod udp;

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use tokio::sync::mpsc;

pub use endpoint::{Endpoint, EndpointError};

const QUEUE: usize = 256;

/// What a link brings.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Received {
    /// One datagram: its end is the end of its frames.
    Datagram(Vec<u8>),
    /// A piece of a stream.
    Stream(Vec<u8>),
    /// The stream has paused for longer than a frame may: what is incomplete will stay so.
    Silence,
    /// The link works; says with whom.
    Up(String),
    /// The link does not work; says why. It is tried again.
    Down(String),
}

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

    /// Writes that found no room.
    pub fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }
}

impl Transport {
    /// Opens a link. Must be called within a tokio runtime.
    ///
    /// # Errors
    /// A UDP address cannot be bound or resolved. A serial device that is not there is no error: it
    /// may be plugged in later, and [`Received::Down`] says so until then.
    pub async fn open(mut endpoint: Endpoint) -> io::Result<Self> {
        let (inbox, received) = mpsc::channel(QUEUE);
        let (queue, outbox) = mpsc::channel(QUEUE);
        match &mut endpoint {
            Endpoint::UdpIn(address) => {
                let bound = udp::listen(address, inbox, outbox).await?;
                // Port 0 lets the system choose; the endpoint then names its choice.
                if address.ends_with(":0") {
                    *address = bound.to_string();
                }
            }
            Endpoint::UdpOut(address) => udp::connect(address, inbox, outbox).await?,
            Endpoint::Serial { path, baud } => serial::open(path.clone(), *baud, inbox, outbox),
        }
        let sender = TransportSender { queue, dropped: Arc::new(AtomicU64::new(0)) };
        Ok(Self { endpoint, received, sender })
    }

    /// Where it leads; for `udpin` with port 0, with the port that the system chose.
    pub fn endpoint(&self) -> &Endpoint {
        &self.endpoint
    }

    /// The next thing the link brings; `None` once its task has ended.
    pub async fn receive(&mut self) -> Option<Received> {
        self.received.recv().await
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

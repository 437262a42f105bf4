//! Moves bytes between this process and a link. Framing, signing and statistics are the caller's ([`crate::hub`]).
//!
//! A [`Transport`] is two bounded queues and a task. The task survives failures: it tries twice a second to reopen a
//! serial line or a connection that broke, and it finds a UDP peer that restarts on another port. A link that anybody
//! can send to answers only those senders of which its owner has accepted a frame.

mod address;
mod serial;
mod stream;
mod tcp;
mod udp;

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use tokio::sync::mpsc;

use crate::hub::{Origin, Received};

pub use address::{LinkAddress, LinkAddressError};

const QUEUE_LEN: usize = 1024;
/// This many notices of accepted senders may wait for the link. If the queue is full, a notice is dropped, and the
/// sender's next frame repeats it.
const BELIEVED_QUEUE_LEN: usize = 256;

/// Bytes to send. With an origin, a link that answers several senders sends them to that one alone.
type Outgoing = (Vec<u8>, Option<Origin>);

#[derive(Debug)]
pub struct Transport {
    address: LinkAddress,
    received: mpsc::Receiver<Received>,
    sender: TransportSender,
}

/// The sending half of a [`Transport`].
#[derive(Debug, Clone)]
pub struct TransportSender {
    queue: mpsc::Sender<Outgoing>,
    believed: mpsc::Sender<Origin>,
    dropped: Arc<AtomicU64>,
}

impl TransportSender {
    /// Queues bytes to be sent and returns whether there was room. A link that is too slow drops bytes and counts the
    /// drops.
    pub fn send(&self, bytes: Vec<u8>) -> bool {
        self.send_to(bytes, None)
    }

    /// As [`TransportSender::send`]. On a link that listens, only this origin gets the bytes; `None` stands for all that
    /// are answered.
    pub fn send_to(&self, bytes: Vec<u8>, to: Option<Origin>) -> bool {
        let queued = self.queue.try_send((bytes, to)).is_ok();
        if !queued {
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
        queued
    }

    /// Tells the link that a frame of this sender was accepted ([`crate::hub::News::Believed`]). Only then is the
    /// sender answered and protected from being displaced by other senders.
    pub fn believe(&self, origin: Origin) {
        // When the queue is full, the sender's next frame repeats this.
        let _ = self.believed.try_send(origin);
    }

    /// Returns how many writes were dropped because the queue was full.
    pub fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }
}

impl Transport {
    /// Opens a link. It must be called within a tokio runtime.
    ///
    /// # Errors
    /// The address cannot be bound or, for UDP, resolved. A missing serial device and a TCP server that does not
    /// answer are no errors, because they may appear later; until then the link reports [`Received::Down`].
    pub async fn open(mut address: LinkAddress) -> io::Result<Self> {
        let is_udp = matches!(address, LinkAddress::UdpIn(_) | LinkAddress::UdpOut(_));
        let (inbox, received) = mpsc::channel(if is_udp { udp::INBOX_LEN } else { QUEUE_LEN });
        let (queue, outbox) = mpsc::channel(QUEUE_LEN);
        let (believed, believed_by_owner) = mpsc::channel(BELIEVED_QUEUE_LEN);
        match &mut address {
            LinkAddress::UdpIn(local) => {
                let queues = udp::Queues { inbox, outbox, believed: believed_by_owner };
                let bound = udp::listen(local, queues).await?;
                // With port 0 the system chooses a port, and the address then names it.
                if local.ends_with(":0") {
                    *local = bound.to_string();
                }
            }
            LinkAddress::UdpOut(remote) => {
                let queues = udp::Queues { inbox, outbox, believed: believed_by_owner };
                udp::connect(remote, queues).await?;
            }
            LinkAddress::TcpIn(local) => {
                let bound = tcp::listen(local, inbox, outbox).await?;
                if local.ends_with(":0") {
                    *local = bound.to_string();
                }
            }
            LinkAddress::TcpOut(remote) => tcp::connect(remote.clone(), inbox, outbox),
            LinkAddress::Serial { path, baud } => serial::open(path.clone(), *baud, inbox, outbox),
        }
        let sender = TransportSender { queue, believed, dropped: Arc::new(AtomicU64::new(0)) };
        Ok(Self { address, received, sender })
    }

    /// Returns the link's address. For `udpin` and `tcpin` with port 0 it names the port that the system chose.
    pub fn address(&self) -> &LinkAddress {
        &self.address
    }

    /// Waits for what the link brings next; `None` once its task has ended.
    pub async fn receive(&mut self) -> Option<Received> {
        self.received.recv().await
    }

    /// As [`Transport::receive`], for an owner that waits for several links at once.
    pub fn poll_receive(
        &mut self,
        context: &mut std::task::Context<'_>,
    ) -> std::task::Poll<Option<Received>> {
        self.received.poll_recv(context)
    }

    /// Returns what has arrived already, without waiting.
    pub fn try_receive(&mut self) -> Option<Received> {
        self.received.try_recv().ok()
    }

    pub fn sender(&self) -> TransportSender {
        self.sender.clone()
    }
}

#[cfg(test)]
mod tests {
    use std::net::SocketAddr;

    use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
    use tokio::net::{TcpStream, UdpSocket};

    use super::*;

    /// The next sender of which bytes arrive, believed as its owner does with an accepted frame.
    async fn next_origin(link: &mut Transport) -> Origin {
        loop {
            let origin = match link.receive().await.unwrap() {
                Received::Datagram { from, .. } => Origin::Datagram(from),
                Received::Stream(id, _) => Origin::Stream(id),
                _ => continue,
            };
            link.sender().believe(origin);
            return origin;
        }
    }

    fn run(test: impl Future<Output = ()>) {
        tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap().block_on(test);
    }

    #[test]
    fn on_udp_bytes_for_one_sender_reach_that_one_alone() {
        run(async {
            let mut link = Transport::open(LinkAddress::UdpIn("127.0.0.1:0".to_owned())).await.unwrap();
            let LinkAddress::UdpIn(address) = link.address().clone() else { unreachable!() };
            let (mut clients, mut origins) = (Vec::new(), Vec::new());
            for _ in 0..2 {
                let client = UdpSocket::bind("127.0.0.1:0").await.unwrap();
                client.send_to(b"here", &address).await.unwrap();
                origins.push(next_origin(&mut link).await);
                // The link has taken the notice once it names the new peer.
                while !matches!(link.receive().await, Some(Received::Up(_))) {}
                clients.push(client);
            }
            link.sender().send_to(b"one".to_vec(), Some(origins[1]));
            link.sender().send(b"all".to_vec());
            let mut first = [[0; 3]; 2];
            for (client, bytes) in clients.iter().zip(&mut first) {
                client.recv(bytes).await.unwrap();
            }
            assert_eq!(first, [*b"all", *b"one"]);
        });
    }

    #[test]
    fn on_tcp_bytes_for_one_sender_reach_that_one_alone() {
        run(async {
            let mut link = Transport::open(LinkAddress::TcpIn("127.0.0.1:0".to_owned())).await.unwrap();
            let LinkAddress::TcpIn(address) = link.address().clone() else { unreachable!() };
            let address: SocketAddr = address.parse().unwrap();
            let (mut clients, mut origins) = (Vec::new(), Vec::new());
            for _ in 0..2 {
                let mut client = TcpStream::connect(address).await.unwrap();
                client.write_all(b"here").await.unwrap();
                origins.push(next_origin(&mut link).await);
                clients.push(client);
            }
            link.sender().send_to(b"one".to_vec(), Some(origins[1]));
            link.sender().send(b"all".to_vec());
            let mut first = [[0; 3]; 2];
            for (client, bytes) in clients.iter_mut().zip(&mut first) {
                client.read_exact(bytes).await.unwrap();
            }
            assert_eq!(first, [*b"all", *b"one"]);
        });
    }
}

//! Moves bytes between this process and a link. Framing, signing and statistics are the caller's
//! ([`crate::hub`]).
//!
//! A [`Transport`] is two bounded queues and a task. The task survives failures: it tries twice a
//! second to reopen a serial line or a connection that broke, and it finds a UDP peer that restarts
//! on another port. A link that anybody can send to answers only those senders of which its owner
//! has accepted a frame.

mod stream;
mod udp;

use std::net::SocketAddr;
use std::str::FromStr;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::{fmt, io};

use tokio::sync::mpsc;

use crate::hub::{Origin, Received};

const QUEUE_LEN: usize = 1024;
/// This many notices of accepted senders may wait for the link. If the queue is full, a notice is
/// dropped, and the sender's next frame repeats it.
const ACCEPTED_QUEUE_LEN: usize = 256;

/// Bytes to send. With an origin, a link that answers several senders sends them to that one alone.
type Outgoing = (Vec<u8>, Option<Origin>);

/// The queues between a link and its owner.
struct Queues {
    inbox: mpsc::Sender<Received>,
    outbox: mpsc::Receiver<Outgoing>,
    /// Senders of which the owner accepted a frame.
    accepted: mpsc::Receiver<Origin>,
}

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
    accepted: mpsc::Sender<Origin>,
    dropped: Arc<AtomicU64>,
}

impl TransportSender {
    /// Queues bytes to be sent and returns whether there was room. A link that is too slow drops
    /// bytes and counts the drops.
    pub fn send(&self, bytes: Vec<u8>) -> bool {
        self.send_to(bytes, None)
    }

    /// As [`TransportSender::send`]. On a link that listens, only this origin gets the bytes;
    /// `None` stands for all answered ones.
    pub fn send_to(&self, bytes: Vec<u8>, to: Option<Origin>) -> bool {
        let queued = self.queue.try_send((bytes, to)).is_ok();
        if !queued {
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
        queued
    }

    /// Notifies the link that a frame of this sender was accepted
    /// ([`crate::hub::LinkEvent::Accepted`]). Only then is the sender answered and protected from
    /// being displaced by other senders.
    pub fn accept(&self, origin: Origin) {
        // When the queue is full, the sender's next frame repeats this.
        let _ = self.accepted.try_send(origin);
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
    /// The address cannot be bound or, for UDP, resolved. A missing serial device and a TCP server
    /// that does not answer are no errors, because they may appear later; until then the link
    /// reports [`Received::Down`].
    pub async fn open(mut address: LinkAddress) -> io::Result<Self> {
        let is_udp = matches!(address, LinkAddress::UdpIn(_) | LinkAddress::UdpOut(_));
        let (inbox, received) = mpsc::channel(if is_udp { udp::INBOX_LEN } else { QUEUE_LEN });
        let (queue, outbox) = mpsc::channel(QUEUE_LEN);
        let (accepted, accepted_by_owner) = mpsc::channel(ACCEPTED_QUEUE_LEN);
        let queues = Queues { inbox, outbox, accepted: accepted_by_owner };
        match &mut address {
            LinkAddress::UdpIn(local) => udp::listen(local, queues).await?,
            LinkAddress::UdpOut(remote) => udp::connect(remote, queues).await?,
            LinkAddress::TcpIn(local) => stream::listen_tcp(local, queues).await?,
            LinkAddress::TcpOut(remote) => stream::connect_tcp(remote.clone(), queues),
            LinkAddress::Serial { path, baud } => stream::open_serial(path.clone(), *baud, queues)?,
        }
        let sender = TransportSender { queue, accepted, dropped: Arc::new(AtomicU64::new(0)) };
        Ok(Self { address, received, sender })
    }

    /// Returns the link's address. For `udpin` and `tcpin` with port 0 it names the port that the
    /// system chose.
    pub fn address(&self) -> &LinkAddress {
        &self.address
    }

    /// Waits for the next data of the link; `None` once its task has ended.
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

    /// Returns data that has arrived already, without waiting.
    pub fn try_receive(&mut self) -> Option<Received> {
        self.received.try_recv().ok()
    }

    pub fn sender(&self) -> TransportSender {
        self.sender.clone()
    }
}

/// Names the port that the system chose in an address with port 0.
fn name_port(address: &mut String, bound: SocketAddr) {
    if address.ends_with(":0") {
        *address = bound.to_string();
    }
}

// The address of a link, as a user types it on a command line.

/// The address of a link.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LinkAddress {
    /// `udpin:ADDRESS:PORT` binds the address and answers its senders.
    UdpIn(String),
    /// `udpout:HOST:PORT` sends to the host first.
    UdpOut(String),
    /// `tcpin:ADDRESS:PORT` serves its clients.
    TcpIn(String),
    /// `tcpout:HOST:PORT` connects to the host.
    TcpOut(String),
    /// `serial:DEVICE:BAUD`.
    Serial {
        /// The device file, for example `/dev/ttyUSB0`.
        path: String,
        baud: u32,
    },
}

impl LinkAddress {
    /// Returns the capacity of the link, bytes per second; `None` if unlimited.
    pub fn capacity_bytes_s(&self) -> Option<u32> {
        match self {
            // A byte takes ten bits: a start bit, eight data bits, a stop bit.
            Self::Serial { baud, .. } => Some(baud / 10),
            Self::UdpIn(_) | Self::UdpOut(_) | Self::TcpIn(_) | Self::TcpOut(_) => None,
        }
    }
}

/// Why a link's address was not understood.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{given}`: {problem}; write udpin:ADDRESS:PORT, udpout:HOST:PORT, tcpin:ADDRESS:PORT, tcpout:HOST:PORT or serial:DEVICE:BAUD"
)]
pub struct LinkAddressError {
    given: String,
    problem: String,
}

impl FromStr for LinkAddress {
    type Err = LinkAddressError;

    fn from_str(given: &str) -> Result<Self, LinkAddressError> {
        let refuse = |problem: String| LinkAddressError { given: given.to_owned(), problem };
        let (kind, rest) = given.split_once(':').unwrap_or((given, ""));
        let of_network: Option<fn(String) -> Self> = match kind {
            "udpin" => Some(Self::UdpIn),
            "udpout" => Some(Self::UdpOut),
            "tcpin" => Some(Self::TcpIn),
            "tcpout" => Some(Self::TcpOut),
            "serial" => None,
            _ => return Err(refuse(format!("`{kind}` is no kind of link"))),
        };
        let parts = if of_network.is_some() { "an address and a port" } else { "a device and a baud rate" };
        let (head, tail) = rest
            .rsplit_once(':')
            .filter(|(head, _)| !head.is_empty())
            .ok_or_else(|| refuse(format!("{kind} needs {parts}")))?;
        if let Some(of_network) = of_network {
            let port = tail.parse::<u16>();
            return port
                .map(|_in_range| of_network(rest.to_owned()))
                .map_err(|_not_a_port| refuse(format!("the port `{tail}` is not a number from 0 to 65535")));
        }
        let baud = tail.parse().ok().filter(|baud| (1_200..=4_000_000).contains(baud));
        baud.map(|baud| Self::Serial { path: head.to_owned(), baud })
            .ok_or_else(|| refuse(format!("the baud rate `{tail}` is not a number from 1200 to 4000000")))
    }
}

impl fmt::Display for LinkAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UdpIn(address) => write!(f, "udpin:{address}"),
            Self::UdpOut(address) => write!(f, "udpout:{address}"),
            Self::TcpIn(address) => write!(f, "tcpin:{address}"),
            Self::TcpOut(address) => write!(f, "tcpout:{address}"),
            Self::Serial { path, baud } => write!(f, "serial:{path}:{baud}"),
        }
    }
}

#[cfg(test)]
mod tests {

    use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
    use tokio::net::{TcpStream, UdpSocket};

    use super::*;

    /// The next sender of which bytes arrive, accepted as its owner does with an accepted frame.
    async fn next_origin(link: &mut Transport) -> Origin {
        loop {
            let origin = match link.receive().await.unwrap() {
                Received::Datagram { from, .. } => Origin::Datagram(from),
                Received::Stream(id, _) => Origin::Stream(id),
                _ => continue,
            };
            link.sender().accept(origin);
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

    /// Every station of a network receives the vehicle, and each may answer it.
    #[test]
    fn a_station_answers_a_vehicle_that_broadcasts() {
        run(async {
            let station = UdpSocket::bind("0.0.0.0:0").await.unwrap();
            let everyone = format!("127.255.255.255:{}", station.local_addr().unwrap().port());
            let mut link = Transport::open(LinkAddress::UdpOut(everyone)).await.unwrap();
            let mut bytes = [0; 4];
            link.sender().send(b"all1".to_vec());
            let (_, vehicle) = station.recv_from(&mut bytes).await.unwrap();
            station.send_to(b"here", vehicle).await.unwrap();
            let origin = next_origin(&mut link).await;
            while !matches!(link.receive().await, Some(Received::Up(_))) {}
            // A datagram for every station arrives once.
            link.sender().send(b"all2".to_vec());
            link.sender().send_to(b"mine".to_vec(), Some(origin));
            for expected in [b"all2", b"mine"] {
                station.recv(&mut bytes).await.unwrap();
                assert_eq!(&bytes, expected);
            }
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

    #[test]
    fn four_silent_tcp_connections_do_not_lock_the_station_out() {
        run(async {
            let mut link = Transport::open(LinkAddress::TcpIn("127.0.0.1:0".to_owned())).await.unwrap();
            let LinkAddress::TcpIn(address) = link.address().clone() else { unreachable!() };
            let address: SocketAddr = address.parse().unwrap();
            let mut silent = Vec::new();
            for _ in 0..4 {
                silent.push(TcpStream::connect(address).await.unwrap());
                while !matches!(link.receive().await, Some(Received::Up(_))) {}
            }
            let mut station = TcpStream::connect(address).await.unwrap();
            station.write_all(b"here").await.unwrap();
            let origin = next_origin(&mut link).await;
            link.sender().send_to(b"one".to_vec(), Some(origin));
            let mut bytes = [0; 3];
            station.read_exact(&mut bytes).await.unwrap();
            assert_eq!(bytes, *b"one");
            // The oldest of them has lost its place.
            assert_eq!(silent[0].read(&mut bytes).await.unwrap(), 0);
        });
    }

    #[test]
    fn an_address_is_written_as_it_was_read() {
        for name in [
            "udpin:0.0.0.0:14550",
            "udpin:[::]:14550",
            "udpout:[::1]:14550",
            "tcpin:0.0.0.0:5760",
            "tcpout:[::1]:5760",
            "serial:/dev/ttyUSB0:57600",
        ] {
            let address: LinkAddress = name.parse().unwrap();
            assert_eq!(address.to_string(), name);
        }
        assert_eq!(
            "serial:/dev/ttyUSB0:57600".parse::<LinkAddress>().unwrap().capacity_bytes_s(),
            Some(5760)
        );
    }

    #[test]
    fn a_wrong_address_is_refused_with_the_valid_forms() {
        for (name, problem) in [
            ("", "`` is no kind of link"),
            ("127.0.0.1:24320", "`127.0.0.1` is no kind of link"),
            ("/dev/ttyUSB0:57600", "`/dev/ttyUSB0` is no kind of link"),
            ("[::1]:14550", "`[` is no kind of link"),
            ("tcp:host:1", "`tcp` is no kind of link"),
            ("udpin", "udpin needs an address and a port"),
            ("udpin:14550", "udpin needs an address and a port"),
            ("tcpin::5760", "tcpin needs an address and a port"),
            ("udpin:host:x", "the port `x` is not a number from 0 to 65535"),
            ("serial:/dev/x", "serial needs a device and a baud rate"),
            ("serial::57600", "serial needs a device and a baud rate"),
            ("serial:/dev/x:9", "the baud rate `9` is not a number from 1200 to 4000000"),
        ] {
            let error = name.parse::<LinkAddress>().unwrap_err().to_string();
            let expected = format!("`{name}`: {problem}; write udpin:ADDRESS:PORT, ");
            assert!(error.starts_with(&expected), "{error}");
        }
    }
}

//! UDP links: `udpin` answers every sender of which a frame was accepted; `udpout` sends first, and
//! only to one peer or to all of a network.

mod peers;

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, VecDeque};
use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use tokio::net::{UdpSocket, lookup_host};
use tokio::time::Instant;

use self::peers::{Newcomer, Peers};
use super::{Queues, name_port};
use crate::hub::{Origin, Received};

const MAX_DATAGRAM: usize = 2048;
/// This many datagrams may lie in the owner's queue, where senders no longer take turns. At fifty
/// polls a second, as the vehicle makes, that is enough for 12,800 datagrams a second.
pub(super) const INBOX_LEN: usize = 256;
/// The link stores this many unread reports about itself.
const MAX_REPORTS: usize = 8;
/// The link pauses for this long after an error.
const PAUSE: Duration = Duration::from_millis(10);

/// Binds and listens. Afterwards the address names the port.
pub(super) async fn listen(address: &mut String, queues: Queues) -> io::Result<()> {
    let socket = UdpSocket::bind(&*address).await?;
    name_port(address, socket.local_addr()?);
    tokio::spawn(run(socket, Peers::any(), queues));
    Ok(())
}

pub(super) async fn connect(address: &str, queues: Queues) -> io::Result<()> {
    let peer = lookup_host(address).await?.next().ok_or_else(|| {
        io::Error::new(io::ErrorKind::NotFound, format!("`{address}` resolves to no address"))
    })?;
    let any: SocketAddr = if peer.is_ipv4() { ([0, 0, 0, 0], 0).into() } else { ([0u16; 8], 0).into() };
    // The socket stays unconnected: otherwise an ICMP "port unreachable", from a ground that starts
    // later, would end the link.
    let socket = UdpSocket::bind(any).await?;
    // The system refuses the address of a whole network to a socket that may not broadcast.
    let refused = std::net::UdpSocket::bind(any)?.connect(peer);
    let is_network = refused.is_err_and(|error| error.kind() == io::ErrorKind::PermissionDenied);
    socket.set_broadcast(true)?;
    let peers = if is_network { Peers::of_network(peer) } else { Peers::only(peer) };
    if queues.inbox.send(Received::Up(peer.to_string())).await.is_ok() {
        tokio::spawn(run(socket, peers, queues));
    }
    Ok(())
}

async fn run(socket: UdpSocket, mut peers: Peers, queues: Queues) {
    let Queues { inbox, mut outbox, mut accepted } = queues;
    let mut buffer = [0; MAX_DATAGRAM];
    let mut queue = DatagramQueue::new();
    // Reports of the link about itself go before the datagrams it carries.
    let mut reports = VecDeque::new();
    let opened_at = Instant::now();
    loop {
        let report_due_at =
            peers.report_due_at().filter(|_| reports.len() < MAX_REPORTS).map(|at| opened_at + at);
        tokio::select! {
            arrived = socket.recv_from(&mut buffer) => match arrived {
                Ok((count, from)) => {
                    if let Some(standing) = peers.on_datagram(from, opened_at.elapsed()) {
                        queue.push(from, standing, &buffer[..count]);
                    }
                }
                // The error is about an earlier datagram of ours. If it persists, it must not use a
                // complete core.
                Err(_) => tokio::time::sleep(PAUSE).await,
            },
            place = inbox.reserve(), if !reports.is_empty() || !queue.is_empty() => {
                let Ok(place) = place else { return };
                let datagram = || queue.pop().map(|(from, bytes)| Received::Datagram { from, bytes });
                if let Some(received) = reports.pop_front().or_else(datagram) {
                    place.send(received);
                }
            }
            outgoing = outbox.recv() => {
                let Some((bytes, to)) = outgoing else { return };
                for peer in peers.receivers(to) {
                    // A datagram that cannot be sent counts as lost; the link's statistics and
                    // heartbeats show it.
                    let _ = socket.send_to(&bytes, peer).await;
                }
            }
            origin = accepted.recv() => {
                let Some(origin) = origin else { return };
                let Origin::Datagram(from) = origin else { continue };
                if let Some(newcomer) = peers.on_accepted(from, opened_at.elapsed()) {
                    queue.prove(from);
                    if newcomer == Newcomer::Named && reports.len() < MAX_REPORTS {
                        reports.push_back(Received::Up(from.to_string()));
                    }
                }
            }
            () = tokio::time::sleep_until(report_due_at.unwrap_or(opened_at)), if report_due_at.is_some() => {
                reports.extend(peers.report(opened_at.elapsed()).map(Received::UnknownSenders));
            }
        }
    }
}

// Queues datagrams fairly: each sender has a separate queue and the senders take turns, so that a
// flood loses only its datagrams.

/// This many datagrams of proven senders may wait; the senders share the places equally. It holds a
/// fifth of a second of the fastest simulated telemetry, 5,000 datagrams a second.
const PROVEN_PLACES: usize = 1024;
/// This many datagrams of all other senders together may wait.
const UNPROVEN_PLACES: usize = 256;

/// Whether a frame of a sender was accepted before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Standing {
    Proven,
    Unproven,
}

/// Queues of senders that share a number of places.
#[derive(Debug)]
struct FairQueue {
    most: usize,
    /// The queue of each sender that has datagrams waiting.
    queues: BTreeMap<SocketAddr, VecDeque<Vec<u8>>>,
    turns: VecDeque<SocketAddr>,
}

impl FairQueue {
    fn new(most: usize) -> Self {
        Self { most, queues: BTreeMap::new(), turns: VecDeque::new() }
    }

    fn push(&mut self, from: SocketAddr, bytes: &[u8]) -> bool {
        let senders = self.queues.len();
        match self.queues.entry(from) {
            // A sender that queued when there were fewer senders may hold more than its share; it
            // gets no more places until it holds less.
            Entry::Occupied(queue) if queue.get().len() >= (self.most / senders).max(1) => return false,
            Entry::Occupied(mut queue) => queue.get_mut().push_back(bytes.to_vec()),
            Entry::Vacant(_) if senders >= self.most => return false,
            Entry::Vacant(place) => {
                place.insert(VecDeque::from([bytes.to_vec()]));
                self.turns.push_back(from);
            }
        }
        true
    }

    fn pop(&mut self) -> Option<(SocketAddr, Vec<u8>)> {
        let from = self.turns.pop_front()?;
        let queue = self.queues.get_mut(&from)?;
        let bytes = queue.pop_front()?;
        if queue.is_empty() {
            self.queues.remove(&from);
        } else {
            self.turns.push_back(from);
        }
        Some((from, bytes))
    }
}

/// The waiting datagrams. Proven senders as a group and all others as a group take turns, too.
#[derive(Debug)]
struct DatagramQueue {
    proven: FairQueue,
    unproven: FairQueue,
    proven_next: bool,
}

impl DatagramQueue {
    fn new() -> Self {
        Self {
            proven: FairQueue::new(PROVEN_PLACES),
            unproven: FairQueue::new(UNPROVEN_PLACES),
            proven_next: true,
        }
    }

    /// Queues a datagram and returns true, or drops it because its sender has too many waiting
    /// already.
    fn push(&mut self, from: SocketAddr, standing: Standing, bytes: &[u8]) -> bool {
        match standing {
            Standing::Proven => self.proven.push(from, bytes),
            Standing::Unproven => self.unproven.push(from, bytes),
        }
    }

    /// Marks a sender as proven; its waiting datagrams stay in order.
    fn prove(&mut self, sender: SocketAddr) {
        let Some(queue) = self.unproven.queues.remove(&sender) else { return };
        self.unproven.turns.retain(|other| *other != sender);
        if !self.proven.queues.contains_key(&sender) {
            self.proven.turns.push_back(sender);
        }
        self.proven.queues.entry(sender).or_default().extend(queue);
    }

    fn is_empty(&self) -> bool {
        self.proven.turns.is_empty() && self.unproven.turns.is_empty()
    }

    /// Takes the datagram whose turn it is.
    fn pop(&mut self) -> Option<(SocketAddr, Vec<u8>)> {
        let [first, second] = if self.proven_next {
            [&mut self.proven, &mut self.unproven]
        } else {
            [&mut self.unproven, &mut self.proven]
        };
        let taken = first.pop().or_else(|| second.pop());
        self.proven_next = !self.proven_next;
        taken
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(port: u16) -> SocketAddr {
        ([127, 0, 0, 1], port).into()
    }

    /// Returns how many datagrams are taken before the first one of this sender.
    fn ahead_of(waiting: &mut DatagramQueue, sender: SocketAddr) -> usize {
        std::iter::from_fn(|| waiting.pop()).position(|(from, _)| from == sender).unwrap()
    }

    #[test]
    fn a_flood_does_not_displace_another_sender() {
        for flooding in [Standing::Proven, Standing::Unproven] {
            let mut waiting = DatagramQueue::new();
            for _ in 0..10_000 {
                for port in 1..=40 {
                    waiting.push(at(port), flooding, b"flood");
                }
            }
            assert!(
                waiting.push(at(99), Standing::Proven, b"abort"),
                "it is kept although the places of the others are full"
            );
            let ahead = ahead_of(&mut waiting, at(99));
            assert!(ahead <= 80, "{ahead} of {flooding:?} are taken first");
            assert!(waiting.push(at(98), Standing::Unproven, b"a newcomer"));
        }
    }

    #[test]
    fn the_queue_is_bounded() {
        let mut waiting = DatagramQueue::new();
        for port in 1..=60_000 {
            for _ in 0..3 {
                waiting.push(at(port), Standing::Unproven, b"a port for every datagram");
            }
        }
        for _ in 0..5_000 {
            waiting.push(at(1), Standing::Proven, b"one sender, faster than it is read");
        }
        let count = std::iter::from_fn(|| waiting.pop()).count();
        // Early senders got more places than their later share: at worst most * (1/1 + 1/2 + ...).
        assert!(count <= PROVEN_PLACES + 7 * UNPROVEN_PLACES, "{count}");
        assert!(waiting.is_empty());
    }

    #[test]
    fn the_order_of_one_sender_is_preserved_when_it_is_accepted() {
        let mut waiting = DatagramQueue::new();
        for number in 0..3 {
            waiting.push(at(1), Standing::Unproven, &[number]);
        }
        waiting.prove(at(1));
        waiting.push(at(1), Standing::Proven, &[3]);
        let taken: Vec<u8> = std::iter::from_fn(|| waiting.pop()).map(|(_, bytes)| bytes[0]).collect();
        assert_eq!(taken, [0, 1, 2, 3]);
    }
}

//! UDP links: `udpin` answers every sender of which a frame was accepted; `udpout` sends first, and only to one peer.

mod peers;
mod queue;

use std::collections::VecDeque;
use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use tokio::net::{UdpSocket, lookup_host};
use tokio::sync::mpsc::{Receiver, Sender};
use tokio::time::Instant;

use self::peers::{Newcomer, Peers};
use self::queue::DatagramQueue;
use super::Outgoing;
use crate::hub::{Origin, Received};

const MAX_DATAGRAM: usize = 2048;
/// This many datagrams may lie in the owner's queue, where senders no longer take turns. At fifty polls a second, as
/// the vehicle makes, that is enough for 12,800 datagrams a second.
pub(super) const INBOX_LEN: usize = 256;
/// The link keeps this many unread reports about itself.
const MAX_REPORTS: usize = 8;
/// The link pauses for this long after an error.
const PAUSE: Duration = Duration::from_millis(10);

/// The queues between a link and its owner.
pub(super) struct Queues {
    pub(super) inbox: Sender<Received>,
    pub(super) outbox: Receiver<Outgoing>,
    /// Senders of which the owner accepted a frame.
    pub(super) believed: Receiver<Origin>,
}

/// Binds and listens. Returns the bound address, which names the port that the system chose if `address` has port 0.
pub(super) async fn listen(address: &str, queues: Queues) -> io::Result<SocketAddr> {
    let socket = UdpSocket::bind(address).await?;
    let bound = socket.local_addr()?;
    tokio::spawn(run(socket, Peers::any(), queues));
    Ok(bound)
}

pub(super) async fn connect(address: &str, queues: Queues) -> io::Result<()> {
    let peer = lookup_host(address).await?.next().ok_or_else(|| {
        io::Error::new(io::ErrorKind::NotFound, format!("`{address}` resolves to no address"))
    })?;
    let any: SocketAddr = if peer.is_ipv4() { ([0, 0, 0, 0], 0).into() } else { ([0u16; 8], 0).into() };
    // The socket stays unconnected: otherwise an ICMP "port unreachable", from a ground that starts later, would end
    // the link.
    let socket = UdpSocket::bind(any).await?;
    if queues.inbox.send(Received::Up(peer.to_string())).await.is_ok() {
        tokio::spawn(run(socket, Peers::only(peer), queues));
    }
    Ok(())
}

async fn run(socket: UdpSocket, mut peers: Peers, queues: Queues) {
    let Queues { inbox, mut outbox, mut believed } = queues;
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
                // The error is about an earlier datagram of ours. If it persists, it must not use a whole core.
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
                for peer in peers.answered().filter(|peer| to.is_none_or(|to| to == Origin::Datagram(*peer))) {
                    // A datagram that cannot be sent counts as lost; the link's statistics and heartbeats show it.
                    let _ = socket.send_to(&bytes, peer).await;
                }
            }
            origin = believed.recv() => {
                let Some(origin) = origin else { return };
                let Origin::Datagram(from) = origin else { continue };
                if let Some(newcomer) = peers.on_believed(from, opened_at.elapsed()) {
                    queue.prove(from);
                    if newcomer == Newcomer::Named && reports.len() < MAX_REPORTS {
                        reports.push_back(Received::Up(from.to_string()));
                    }
                }
            }
            () = tokio::time::sleep_until(report_due_at.unwrap_or(opened_at)), if report_due_at.is_some() => {
                reports.extend(peers.report(opened_at.elapsed()).map(Received::Strangers));
            }
        }
    }
}

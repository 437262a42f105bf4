//! UDP: `udpin` answers whoever has proven itself, `udpout` speaks first and to one peer alone.

mod peers;
mod waiting;

use std::collections::VecDeque;
use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use tokio::net::{UdpSocket, lookup_host};
use tokio::sync::mpsc::{Receiver, Sender};
use tokio::time::Instant;

use self::peers::{Newcomer, Peers};
use self::waiting::Waiting;
use super::Received;
use crate::hub::Origin;

const MAX_DATAGRAM: usize = 2048;
/// Datagrams that are on their way to the reader already and have no turn to wait for any more. Fifty polls a second,
/// as the vehicle's, still take 12,800 datagrams a second.
pub(super) const AHEAD: usize = 256;
/// Things that the link says of itself and nobody has read yet.
const MAX_SAID: usize = 8;
/// After an error.
const PAUSE: Duration = Duration::from_millis(10);

/// What a link and its owner tell each other.
pub(super) struct Ends {
    pub(super) inbox: Sender<Received>,
    pub(super) outbox: Receiver<Vec<u8>>,
    /// Who sent a frame that was believed.
    pub(super) believed: Receiver<Origin>,
}

/// Binds and listens; returns the address that was bound, which names the port if `address` left it open.
pub(super) async fn listen(address: &str, ends: Ends) -> io::Result<SocketAddr> {
    let socket = UdpSocket::bind(address).await?;
    let bound = socket.local_addr()?;
    tokio::spawn(run(socket, Peers::anybody(), ends));
    Ok(bound)
}

pub(super) async fn connect(address: &str, ends: Ends) -> io::Result<()> {
    let peer = lookup_host(address).await?.next().ok_or_else(|| {
        io::Error::new(io::ErrorKind::NotFound, format!("the name in `{address}` has no address"))
    })?;
    let any: SocketAddr = if peer.is_ipv4() { ([0, 0, 0, 0], 0).into() } else { ([0u16; 8], 0).into() };
    // Not connected: an ICMP "port unreachable" from a ground that starts later must not end the link.
    let socket = UdpSocket::bind(any).await?;
    if ends.inbox.send(Received::Up(peer.to_string())).await.is_ok() {
        tokio::spawn(run(socket, Peers::only(peer), ends));
    }
    Ok(())
}

async fn run(socket: UdpSocket, mut peers: Peers, ends: Ends) {
    let Ends { inbox, mut outbox, mut believed } = ends;
    let mut buffer = [0; MAX_DATAGRAM];
    let mut waiting = Waiting::new();
    // What the link says of itself, which comes before what it carries.
    let mut said = VecDeque::new();
    let opened_at = Instant::now();
    loop {
        let say_at = peers.say_at().filter(|_| said.len() < MAX_SAID).map(|at| opened_at + at);
        tokio::select! {
            arrived = socket.recv_from(&mut buffer) => match arrived {
                Ok((count, from)) => {
                    if let Some(standing) = peers.on_datagram(from, opened_at.elapsed()) {
                        waiting.push(from, standing, &buffer[..count]);
                    }
                }
                // It speaks of an earlier datagram of ours; should it last, it must not run hot.
                Err(_) => tokio::time::sleep(PAUSE).await,
            },
            place = inbox.reserve(), if !said.is_empty() || !waiting.is_empty() => {
                let Ok(place) = place else { return };
                let datagram = || waiting.pop().map(|(from, bytes)| Received::Datagram { from, bytes });
                if let Some(received) = said.pop_front().or_else(datagram) {
                    place.send(received);
                }
            }
            bytes = outbox.recv() => {
                let Some(bytes) = bytes else { return };
                for peer in peers.answered() {
                    // Lost like any datagram; the link's statistics and heartbeats show it.
                    let _ = socket.send_to(&bytes, peer).await;
                }
            }
            origin = believed.recv() => {
                let Some(origin) = origin else { return };
                let Origin::Datagram(from) = origin else { continue };
                if let Some(newcomer) = peers.on_believed(from, opened_at.elapsed()) {
                    waiting.prove(from);
                    if newcomer == Newcomer::Named && said.len() < MAX_SAID {
                        said.push_back(Received::Up(from.to_string()));
                    }
                }
            }
            () = tokio::time::sleep_until(say_at.unwrap_or(opened_at)), if say_at.is_some() => {
                said.extend(peers.say(opened_at.elapsed()).map(Received::Strangers));
            }
        }
    }
}

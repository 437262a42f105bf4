//! UDP: `udpin` answers whoever spoke last few, `udpout` speaks first.

use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use tokio::net::{UdpSocket, lookup_host};
use tokio::sync::mpsc::{Receiver, Sender};

use super::Received;

const MAX_DATAGRAM: usize = 2048;
/// Peers that a listening socket answers at the same time.
const MAX_PEERS: usize = 4;
/// After an error.
const PAUSE: Duration = Duration::from_millis(10);

/// Binds and listens; returns the address that was bound, which names the port if `address` left it open.
pub(super) async fn listen(
    address: &str,
    inbox: Sender<Received>,
    outbox: Receiver<Vec<u8>>,
) -> io::Result<SocketAddr> {
    let socket = UdpSocket::bind(address).await?;
    let bound = socket.local_addr()?;
    tokio::spawn(run(socket, Vec::new(), false, inbox, outbox));
    Ok(bound)
}

pub(super) async fn connect(
    address: &str,
    inbox: Sender<Received>,
    outbox: Receiver<Vec<u8>>,
) -> io::Result<()> {
    let peer = lookup_host(address).await?.next().ok_or_else(|| {
        io::Error::new(io::ErrorKind::NotFound, format!("the name in `{address}` has no address"))
    })?;
    let any: SocketAddr = if peer.is_ipv4() { ([0, 0, 0, 0], 0).into() } else { ([0u16; 8], 0).into() };
    // Not connected: an ICMP "port unreachable" from a ground that starts later must not end the link.
    let socket = UdpSocket::bind(any).await?;
    tokio::spawn(run(socket, vec![peer], true, inbox, outbox));
    Ok(())
}

async fn run(
    socket: UdpSocket,
    mut peers: Vec<SocketAddr>,
    fixed: bool,
    inbox: Sender<Received>,
    mut outbox: Receiver<Vec<u8>>,
) {
    let mut buffer = [0; MAX_DATAGRAM];
    for peer in &peers {
        if inbox.send(Received::Up(peer.to_string())).await.is_err() {
            return;
        }
    }
    loop {
        tokio::select! {
            arrived = socket.recv_from(&mut buffer) => {
                let Ok((count, from)) = arrived else {
                    // It speaks of an earlier datagram of ours; should it last, it must not run hot.
                    tokio::time::sleep(PAUSE).await;
                    continue;
                };
                if fixed && !peers.contains(&from) {
                    continue;
                }
                if let Some(place) = peers.iter().position(|peer| *peer == from) {
                    // The most recent last: strangers displace whoever has been silent longest.
                    peers[place..].rotate_left(1);
                } else {
                    if peers.len() == MAX_PEERS {
                        peers.remove(0);
                    }
                    peers.push(from);
                    if inbox.send(Received::Up(from.to_string())).await.is_err() {
                        return;
                    }
                }
                if inbox.send(Received::Datagram(buffer[..count].to_vec())).await.is_err() {
                    return;
                }
            }
            bytes = outbox.recv() => {
                let Some(bytes) = bytes else { return };
                for peer in &peers {
                    // Lost like any datagram; the link's statistics and heartbeats show it.
                    let _ = socket.send_to(&bytes, peer).await;
                }
            }
        }
    }
}

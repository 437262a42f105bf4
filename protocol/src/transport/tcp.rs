//! TCP: `tcpin` serves a few clients, `tcpout` connects and connects again.

use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::broadcast;
use tokio::sync::mpsc::{Receiver, Sender};

use super::{REOPEN_AFTER, Received};
use crate::hub::Peer;

/// Clients served at the same time; more are turned away.
const MAX_CLIENTS: usize = 4;
/// Writes that may wait for a client; one that takes nothing loses the oldest.
const CLIENT_QUEUE: usize = 256;
/// A connection attempt is given up after this long.
const CONNECT_WITHIN: Duration = Duration::from_secs(5);
/// A pause longer than a frame's pieces may be apart.
const SILENCE: Duration = Duration::from_secs(1);

/// Binds and serves; returns the address that was bound, which names the port if `address` left it open.
pub(super) async fn listen(
    address: &str,
    inbox: Sender<Received>,
    outbox: Receiver<Vec<u8>>,
) -> io::Result<SocketAddr> {
    let listener = TcpListener::bind(address).await?;
    let bound = listener.local_addr()?;
    tokio::spawn(serve(listener, inbox, outbox));
    Ok(bound)
}

async fn serve(listener: TcpListener, inbox: Sender<Received>, mut outbox: Receiver<Vec<u8>>) {
    let (all, _) = broadcast::channel::<Vec<u8>>(CLIENT_QUEUE);
    let mut peer: Peer = 0;
    loop {
        tokio::select! {
            accepted = listener.accept() => match accepted {
                Ok((stream, from)) if all.receiver_count() < MAX_CLIENTS => {
                    if inbox.send(Received::Up(from.to_string())).await.is_err() {
                        return;
                    }
                    tokio::spawn(attend(stream, peer, inbox.clone(), all.subscribe()));
                    peer += 1;
                }
                // One client too many; dropping it closes it.
                Ok(_) => {}
                // No descriptor left, for instance: not a reason to run hot.
                Err(_) => tokio::time::sleep(REOPEN_AFTER).await,
            },
            bytes = outbox.recv() => {
                let Some(bytes) = bytes else { return };
                // Nobody listening is no error.
                let _ = all.send(bytes);
            }
        }
    }
}

/// One client until it goes.
async fn attend(
    stream: TcpStream,
    peer: Peer,
    inbox: Sender<Received>,
    mut all: broadcast::Receiver<Vec<u8>>,
) {
    // Telemetry of now must not wait for more bytes to come; where it cannot be set, it waits a moment.
    let _ = stream.set_nodelay(true);
    let (mut reader, mut writer) = stream.into_split();
    let write = async {
        loop {
            match all.recv().await {
                Ok(bytes) => {
                    if writer.write_all(&bytes).await.is_err() {
                        return;
                    }
                }
                // A slow client has lost frames; its sequence numbers show it how many.
                Err(broadcast::error::RecvError::Lagged(_)) => {}
                Err(broadcast::error::RecvError::Closed) => return,
            }
        }
    };
    tokio::select! {
        _ = read_all(&mut reader, peer, &inbox) => {}
        () = write => {}
    }
    // Fails only when nobody wants the link any more.
    let _ = inbox.send(Received::Gone(peer)).await;
}

/// Reads until the stream ends; says why. `None`: nobody wants the link any more.
async fn read_all(
    reader: &mut tokio::net::tcp::OwnedReadHalf,
    peer: Peer,
    inbox: &Sender<Received>,
) -> Option<String> {
    let mut buffer = [0; 4096];
    let mut in_burst = false;
    loop {
        let count = match tokio::time::timeout(SILENCE, reader.read(&mut buffer)).await {
            Ok(Ok(0)) => return Some("the peer has closed the connection".to_owned()),
            Ok(Ok(count)) => count,
            Ok(Err(error)) => return Some(error.to_string()),
            Err(_elapsed) => {
                // Said once a burst, not every second.
                if std::mem::take(&mut in_burst) {
                    inbox.send(Received::Silence(peer)).await.ok()?;
                }
                continue;
            }
        };
        in_burst = true;
        inbox.send(Received::Stream(peer, buffer[..count].to_vec())).await.ok()?;
    }
}

pub(super) fn connect(address: String, inbox: Sender<Received>, outbox: Receiver<Vec<u8>>) {
    tokio::spawn(keep_connected(address, inbox, outbox));
}

async fn keep_connected(address: String, inbox: Sender<Received>, mut outbox: Receiver<Vec<u8>>) {
    let mut last_trouble = String::new();
    for peer in 0.. {
        let trouble = match tokio::time::timeout(CONNECT_WITHIN, TcpStream::connect(&address)).await {
            Ok(Ok(stream)) => {
                last_trouble.clear();
                if inbox.send(Received::Up(address.clone())).await.is_err() {
                    return;
                }
                let trouble = carry(stream, peer, &inbox, &mut outbox).await;
                if inbox.send(Received::Gone(peer)).await.is_err() {
                    return;
                }
                match trouble {
                    Some(trouble) => trouble,
                    None => return,
                }
            }
            Ok(Err(error)) => error.to_string(),
            Err(_elapsed) => format!("no answer within {CONNECT_WITHIN:?}"),
        };
        // Said once, not twice a second.
        if trouble != last_trouble {
            if inbox.send(Received::Down(format!("{address}: {trouble}"))).await.is_err() {
                return;
            }
            last_trouble = trouble;
        }
        tokio::time::sleep(REOPEN_AFTER).await;
        // What was queued for a dead connection is stale.
        while outbox.try_recv().is_ok() {}
        if inbox.is_closed() || outbox.is_closed() {
            return;
        }
    }
}

/// Carries bytes until the connection fails (says why) or nobody wants it any more (`None`). Reading and writing do
/// not wait for each other: a peer that takes nothing must still be heard.
async fn carry(
    stream: TcpStream,
    peer: Peer,
    inbox: &Sender<Received>,
    outbox: &mut Receiver<Vec<u8>>,
) -> Option<String> {
    // A command must not wait for more bytes to come; where it cannot be set, it waits a moment.
    let _ = stream.set_nodelay(true);
    let (mut reader, mut writer) = stream.into_split();
    let write = async {
        loop {
            if let Err(error) = writer.write_all(&outbox.recv().await?).await {
                return Some(error.to_string());
            }
        }
    };
    tokio::select! {
        ended = read_all(&mut reader, peer, inbox) => ended,
        ended = write => ended,
    }
}

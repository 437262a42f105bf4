//! TCP: `tcpin` serves a few clients, `tcpout` connects and connects again.

use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use tokio::io::AsyncWriteExt as _;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::broadcast;
use tokio::sync::mpsc::{Receiver, Sender};

use super::stream::{Line, keep_open, read_all};
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
    let (reader, mut writer) = stream.into_split();
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
        _ = read_all(reader, peer, SILENCE, &inbox) => {}
        () = write => {}
    }
    // Fails only when nobody wants the link any more.
    let _ = inbox.send(Received::Gone(peer)).await;
}

pub(super) fn connect(address: String, inbox: Sender<Received>, outbox: Receiver<Vec<u8>>) {
    tokio::spawn(keep_open(Connection { address }, inbox, outbox));
}

struct Connection {
    address: String,
}

impl Line for Connection {
    type Io = TcpStream;
    const SILENCE: Duration = SILENCE;
    const ENDED: &str = "the peer has closed the connection";
    const BEGINS_ANEW: bool = true;

    fn name(&self) -> &str {
        &self.address
    }

    async fn open(&self) -> Result<TcpStream, String> {
        let stream = tokio::time::timeout(CONNECT_WITHIN, TcpStream::connect(&self.address))
            .await
            .map_err(|_elapsed| format!("no answer within {CONNECT_WITHIN:?}"))?
            .map_err(|error| error.to_string())?;
        // A command must not wait for more bytes to come; where it cannot be set, it waits a moment.
        let _ = stream.set_nodelay(true);
        Ok(stream)
    }
}

//! TCP links: `tcpin` serves a few clients; `tcpout` connects, and reconnects after a failure.

use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use tokio::io::AsyncWriteExt as _;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::broadcast;
use tokio::sync::mpsc::{Receiver, Sender};

use super::Outgoing;
use super::stream::{Line, REOPEN_AFTER, keep_open, read_all};
use crate::hub::{Origin, Received, StreamId};

/// This many clients are served at the same time; further ones are disconnected.
const MAX_CLIENTS: usize = 4;
/// This many writes wait for each client; a slow client loses the oldest ones.
const CLIENT_QUEUE: usize = 256;
/// A connection attempt fails after this time.
const CONNECT_WITHIN: Duration = Duration::from_secs(5);
/// A pause this long means that no more bytes of a begun frame will follow.
const SILENCE: Duration = Duration::from_secs(1);

/// Binds and serves. Returns the bound address, which names the port that the system chose if `address` has port 0.
pub(super) async fn listen(
    address: &str,
    inbox: Sender<Received>,
    outbox: Receiver<Outgoing>,
) -> io::Result<SocketAddr> {
    let listener = TcpListener::bind(address).await?;
    let bound = listener.local_addr()?;
    tokio::spawn(serve(listener, inbox, outbox));
    Ok(bound)
}

async fn serve(listener: TcpListener, inbox: Sender<Received>, mut outbox: Receiver<Outgoing>) {
    let (all, _) = broadcast::channel::<Outgoing>(CLIENT_QUEUE);
    let mut stream_id: StreamId = 0;
    loop {
        tokio::select! {
            accepted = listener.accept() => match accepted {
                Ok((stream, from)) if all.receiver_count() < MAX_CLIENTS => {
                    if inbox.send(Received::Up(from.to_string())).await.is_err() {
                        return;
                    }
                    tokio::spawn(serve_client(stream, stream_id, inbox.clone(), all.subscribe()));
                    stream_id += 1;
                }
                // There are too many clients; dropping this one closes its connection.
                Ok(_) => {}
                // This happens when no file descriptor is left, for instance. Trying again at once would use a whole
                // core.
                Err(_) => tokio::time::sleep(REOPEN_AFTER).await,
            },
            outgoing = outbox.recv() => {
                let Some(outgoing) = outgoing else { return };
                // It fails when no client is connected, which is no error.
                let _ = all.send(outgoing);
            }
        }
    }
}

/// Serves one client until it disconnects.
async fn serve_client(
    stream: TcpStream,
    stream_id: StreamId,
    inbox: Sender<Received>,
    mut all: broadcast::Receiver<Outgoing>,
) {
    // Without this, TCP delays telemetry to collect more bytes. If the option cannot be set, the delay is accepted.
    let _ = stream.set_nodelay(true);
    let (reader, mut writer) = stream.into_split();
    let write = async {
        loop {
            match all.recv().await {
                Ok((_, Some(to))) if to != Origin::Stream(stream_id) => {}
                Ok((bytes, _)) => {
                    if writer.write_all(&bytes).await.is_err() {
                        return;
                    }
                }
                // A slow client has lost frames; the sequence numbers tell it how many.
                Err(broadcast::error::RecvError::Lagged(_)) => {}
                Err(broadcast::error::RecvError::Closed) => return,
            }
        }
    };
    tokio::select! {
        _ = read_all(reader, stream_id, SILENCE, &inbox) => {}
        () = write => {}
    }
    // It fails only when the owner has dropped the link.
    let _ = inbox.send(Received::Gone(stream_id)).await;
}

pub(super) fn connect(address: String, inbox: Sender<Received>, outbox: Receiver<Outgoing>) {
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
        // Without this, TCP delays commands to collect more bytes. If the option cannot be set, the delay is
        // accepted.
        let _ = stream.set_nodelay(true);
        Ok(stream)
    }
}

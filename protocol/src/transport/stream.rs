//! Serial lines and TCP connections: carries their bytes, and opens them again when they fail.

use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use tokio::io::{AsyncRead, AsyncReadExt as _, AsyncWrite, AsyncWriteExt as _};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::broadcast;
use tokio::sync::mpsc::{Receiver, Sender};
use tokio_serial::{SerialPortBuilderExt as _, SerialStream};

use super::Outgoing;
use crate::hub::{Origin, Received, StreamId};

const READ_LEN: usize = 4096;
/// A failed stream is opened again after this time.
pub(super) const REOPEN_AFTER: Duration = Duration::from_millis(500);

/// A byte stream that this side opens, and opens again whenever it fails.
pub(super) trait Line: Send + 'static {
    /// The open stream.
    type Io: AsyncRead + AsyncWrite + Send;
    /// A pause this long means that no more bytes of a begun frame will follow.
    const SILENCE: Duration;
    /// The reason that is reported when the other side ends the stream.
    const ENDED: &str;
    /// Whether each opening begins a new stream, instead of continuing the previous one.
    const BEGINS_ANEW: bool;

    /// Its name in messages to the crew.
    fn name(&self) -> &str;

    /// Opens the stream; the error says why that failed.
    fn open(&self) -> impl Future<Output = Result<Self::Io, String>> + Send;
}

/// Keeps a stream open and carries bytes over it until the owner drops the link.
pub(super) async fn keep_open<L: Line>(line: L, inbox: Sender<Received>, mut outbox: Receiver<Outgoing>) {
    let mut last_trouble = String::new();
    for opening in 0.. {
        let stream_id: StreamId = if L::BEGINS_ANEW { opening } else { 0 };
        let trouble = match line.open().await {
            Ok(io) => {
                last_trouble.clear();
                if inbox.send(Received::Up(line.name().to_owned())).await.is_err() {
                    return;
                }
                let trouble = carry::<L>(io, stream_id, &inbox, &mut outbox).await;
                if L::BEGINS_ANEW && inbox.send(Received::Gone(stream_id)).await.is_err() {
                    return;
                }
                match trouble {
                    Some(trouble) => trouble,
                    None => return,
                }
            }
            Err(trouble) => trouble,
        };
        // The same trouble is reported once, not twice a second.
        if trouble != last_trouble {
            if inbox.send(Received::Down(format!("{}: {trouble}", line.name()))).await.is_err() {
                return;
            }
            last_trouble = trouble;
        }
        tokio::time::sleep(REOPEN_AFTER).await;
        // Bytes that were queued while the stream was down are out of date.
        while outbox.try_recv().is_ok() {}
        if inbox.is_closed() || outbox.is_closed() {
            return;
        }
    }
}

/// Carries bytes until the stream fails, and returns why; returns `None` once the owner has dropped the link. Reading
/// does not wait for writing: a peer that takes no bytes may still deliver an abort.
async fn carry<L: Line>(
    io: L::Io,
    stream_id: StreamId,
    inbox: &Sender<Received>,
    outbox: &mut Receiver<Outgoing>,
) -> Option<String> {
    let (reader, mut writer) = tokio::io::split(io);
    let write = async {
        loop {
            if let Err(error) = writer.write_all(&outbox.recv().await?.0).await {
                return Some(error.to_string());
            }
        }
    };
    tokio::select! {
        ended = read_all(reader, stream_id, L::SILENCE, inbox) => ended.map(|error| {
            error.map_or_else(|| L::ENDED.to_owned(), |error| error.to_string())
        }),
        ended = write => ended,
    }
}

/// Reads until the stream ends, and returns the error that ended it, if any. Returns `None` once the owner has
/// dropped the link.
pub(super) async fn read_all(
    mut reader: impl AsyncRead + Unpin,
    stream_id: StreamId,
    silence: Duration,
    inbox: &Sender<Received>,
) -> Option<Option<std::io::Error>> {
    let mut buffer = [0; READ_LEN];
    let mut in_burst = false;
    loop {
        let count = match tokio::time::timeout(silence, reader.read(&mut buffer)).await {
            Ok(Ok(0)) => return Some(None),
            Ok(Ok(count)) => count,
            Ok(Err(error)) => return Some(Some(error)),
            Err(_elapsed) => {
                // A silence is reported once after each burst.
                if std::mem::take(&mut in_burst) {
                    inbox.send(Received::Silence(stream_id)).await.ok()?;
                }
                continue;
            }
        };
        in_burst = true;
        inbox.send(Received::Stream(stream_id, buffer[..count].to_vec())).await.ok()?;
    }
}

// Serial lines: opened again when the device comes back.

pub(super) fn open_serial(path: String, baud: u32, inbox: Sender<Received>, outbox: Receiver<Outgoing>) {
    tokio::spawn(keep_open(Port { path, baud }, inbox, outbox));
}

struct Port {
    path: String,
    baud: u32,
}

impl Line for Port {
    type Io = SerialStream;
    /// Bytes of one frame follow each other without a pause: at 9,600 baud the longest frame takes 0.3 s.
    const SILENCE: Duration = Duration::from_millis(100);
    const ENDED: &str = "the line was closed";
    /// A serial line stays one stream however often it is reopened.
    const BEGINS_ANEW: bool = false;

    fn name(&self) -> &str {
        &self.path
    }

    async fn open(&self) -> Result<SerialStream, String> {
        tokio_serial::new(&self.path, self.baud).open_native_async().map_err(|error| error.to_string())
    }
}

// TCP links: `tcpin` serves a few clients; `tcpout` connects, and reconnects after a failure.

/// This many clients are served at the same time; further ones are disconnected.
const MAX_CLIENTS: usize = 4;
/// This many writes wait for each client; a slow client loses the oldest ones.
const CLIENT_QUEUE: usize = 256;
/// A connection attempt fails after this time.
const CONNECT_WITHIN: Duration = Duration::from_secs(5);
/// A pause this long means that no more bytes of a begun frame will follow.
const SILENCE: Duration = Duration::from_secs(1);

/// Binds and serves. Returns the bound address, which names the port that the system chose if `address` has port 0.
pub(super) async fn listen_tcp(
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

pub(super) fn connect_tcp(address: String, inbox: Sender<Received>, outbox: Receiver<Outgoing>) {
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

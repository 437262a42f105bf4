//! Serial lines and TCP connections: carries their bytes, and opens them again when they fail.

use std::io;
use std::time::Duration;

use tokio::io::{AsyncRead, AsyncReadExt as _, AsyncWrite, AsyncWriteExt as _};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::mpsc::{Receiver, Sender};
use tokio::sync::{broadcast, oneshot};
use tokio::time::Instant;
use tokio_serial::{SerialPortBuilderExt as _, SerialStream};

use super::{Outgoing, Queues, name_port};
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

    /// Opens the stream; the error gives the reason of a failure.
    fn open(&self) -> impl Future<Output = Result<Self::Io, String>> + Send;
}

/// Keeps a stream open and carries bytes over it until the owner drops the link.
async fn run<L: Line>(line: L, queues: Queues) {
    let Queues { inbox, mut outbox, .. } = queues;
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

/// Carries bytes until the stream fails, and returns why; returns `None` once the owner has dropped
/// the link. Reading does not wait for writing: a peer that takes no bytes may still deliver an
/// abort.
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

/// Reads until the stream ends, and returns the error that ended it, if any. Returns `None` once
/// the owner has dropped the link.
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

/// Serves a serial line in a thread of its own. Opening the device can wait for a file system that
/// stalls. Reading or polling it can wait for the kernel's worker, on a busy machine for seconds.
pub(super) fn open_serial(path: String, baud: u32, queues: Queues) -> io::Result<()> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let serve = move || runtime.block_on(run(Port { path, baud }, queues));
    std::thread::Builder::new().name("serial".to_owned()).spawn(serve).map(drop)
}

struct Port {
    path: String,
    baud: u32,
}

impl Line for Port {
    type Io = SerialStream;
    /// Bytes of one frame follow each other without a pause: at 9,600 baud the longest frame takes
    /// 0.3 s.
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

/// Most clients served at the same time. A further one replaces the one without a valid frame for
/// the longest time; if all have sent one recently, it is disconnected.
const MAX_CLIENTS: usize = 4;
/// Time for which an accepted client is protected without another accepted frame: ten heartbeats of
/// a station.
const PROTECTED_FOR: Duration = Duration::from_secs(10);
/// This many writes wait for each client; a slow client loses the oldest ones.
const CLIENT_QUEUE: usize = 256;
/// A connection attempt fails after this time.
const CONNECT_WITHIN: Duration = Duration::from_secs(5);
/// A pause this long means that no more bytes of a begun frame will follow.
const SILENCE: Duration = Duration::from_secs(1);

/// Binds and serves. Afterwards the address names the port.
pub(super) async fn listen_tcp(address: &mut String, queues: Queues) -> io::Result<()> {
    let listener = TcpListener::bind(&*address).await?;
    name_port(address, listener.local_addr()?);
    tokio::spawn(serve(listener, queues));
    Ok(())
}

/// A client that is being served; dropping it disconnects.
struct Client {
    stream_id: StreamId,
    /// When its last frame was accepted, if one was.
    accepted_at: Option<Instant>,
    leave: oneshot::Sender<()>,
}

/// Makes room for one more client if possible; the clients are in order of arrival.
fn make_room(clients: &mut Vec<Client>, now: Instant) -> bool {
    clients.retain(|client| !client.leave.is_closed());
    if clients.len() < MAX_CLIENTS {
        return true;
    }
    // One that was never accepted sorts before every time.
    let quietest = clients.iter().enumerate().min_by_key(|(_, client)| client.accepted_at);
    let leaves = quietest.filter(|(_, client)| {
        client.accepted_at.is_none_or(|at| now.saturating_duration_since(at) >= PROTECTED_FOR)
    });
    let Some((place, _)) = leaves else { return false };
    clients.remove(place);
    true
}

async fn serve(listener: TcpListener, queues: Queues) {
    let Queues { inbox, mut outbox, mut accepted } = queues;
    let (all, _) = broadcast::channel::<Outgoing>(CLIENT_QUEUE);
    let mut clients: Vec<Client> = Vec::new();
    let mut stream_id: StreamId = 0;
    loop {
        tokio::select! {
            connected = listener.accept() => match connected {
                Ok((stream, from)) => {
                    // The queued notices are processed before a client is selected to leave.
                    while let Ok(origin) = accepted.try_recv() {
                        note_accepted(&mut clients, origin);
                    }
                    if !make_room(&mut clients, Instant::now()) {
                        // Dropping the stream closes its connection.
                        continue;
                    }
                    if inbox.send(Received::Up(from.to_string())).await.is_err() {
                        return;
                    }
                    let (leave, left) = oneshot::channel();
                    clients.push(Client { stream_id, accepted_at: None, leave });
                    tokio::spawn(serve_client(stream, stream_id, inbox.clone(), (all.subscribe(), left)));
                    stream_id += 1;
                }
                // This happens when no file descriptor is left, for instance. Retrying at once
                // would use a complete core.
                Err(_) => tokio::time::sleep(REOPEN_AFTER).await,
            },
            Some(origin) = accepted.recv() => note_accepted(&mut clients, origin),
            outgoing = outbox.recv() => {
                let Some(outgoing) = outgoing else { return };
                // It fails when no client is connected, which is no error.
                let _ = all.send(outgoing);
            }
        }
    }
}

fn note_accepted(clients: &mut [Client], origin: Origin) {
    for client in clients.iter_mut().filter(|client| Origin::Stream(client.stream_id) == origin) {
        client.accepted_at = Some(Instant::now());
    }
}

/// Serves one client until it disconnects or loses its place.
async fn serve_client(
    stream: TcpStream,
    stream_id: StreamId,
    inbox: Sender<Received>,
    (mut all, left): (broadcast::Receiver<Outgoing>, oneshot::Receiver<()>),
) {
    // Without this, TCP delays telemetry to collect more bytes. If the option cannot be set, the
    // delay is accepted.
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
                // A slow client has lost frames; it can count them by the sequence numbers.
                Err(broadcast::error::RecvError::Lagged(_)) => {}
                Err(broadcast::error::RecvError::Closed) => return,
            }
        }
    };
    tokio::select! {
        _ = read_all(reader, stream_id, SILENCE, &inbox) => {}
        () = write => {}
        _ = left => {}
    }
    // It fails only when the owner has dropped the link.
    let _ = inbox.send(Received::Gone(stream_id)).await;
}

pub(super) fn connect_tcp(address: String, queues: Queues) {
    tokio::spawn(run(Connection { address }, queues));
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
        // Without this, TCP delays commands to collect more bytes. If the option cannot be set, the
        // delay is accepted.
        let _ = stream.set_nodelay(true);
        Ok(stream)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Clients whose last accepted frame is this many seconds old; `None`: they were never
    /// accepted.
    fn clients(ages_s: &[Option<u64>], now: Instant) -> (Vec<Client>, Vec<oneshot::Receiver<()>>) {
        let client = |(stream_id, age_s): (usize, &Option<u64>)| {
            let (leave, left) = oneshot::channel();
            let accepted_at = age_s.map(|age_s| now - Duration::from_secs(age_s));
            (Client { stream_id: stream_id as StreamId, accepted_at, leave }, left)
        };
        ages_s.iter().enumerate().map(client).unzip()
    }

    #[test]
    fn a_new_client_replaces_the_oldest_without_a_valid_frame_and_never_an_active_station() {
        let now = Instant::now() + Duration::from_hours(1);
        for (ages_s, leaves) in [
            ([None, None, None, None], Some(0)),
            ([Some(0), None, None, Some(20)], Some(1)),
            ([Some(0), Some(11), Some(30), Some(9)], Some(2)),
            ([Some(0), Some(1), Some(2), Some(9)], None),
        ] {
            let (mut served, mut left) = clients(&ages_s, now);
            assert_eq!(make_room(&mut served, now), leaves.is_some(), "{ages_s:?}");
            let gone =
                left.iter_mut().position(|left| left.try_recv() != Err(oneshot::error::TryRecvError::Empty));
            assert_eq!(gone, leaves, "{ages_s:?}");
        }
        let (mut served, mut left) = clients(&[Some(0); 4], now);
        left.pop();
        assert!(make_room(&mut served, now), "one that has disconnected takes no place");
    }
}

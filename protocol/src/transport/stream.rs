//! Carries bytes over a serial line or a TCP connection, and opens it again when it fails.

use std::time::Duration;

use tokio::io::{AsyncRead, AsyncReadExt as _, AsyncWrite, AsyncWriteExt as _};
use tokio::sync::mpsc::{Receiver, Sender};

use super::Outgoing;
use crate::hub::{Received, StreamId};

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

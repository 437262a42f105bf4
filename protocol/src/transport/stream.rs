//! Byte streams: read with an eye on pauses, and opened again when they fail.

use std::time::Duration;

use tokio::io::{AsyncRead, AsyncReadExt as _, AsyncWrite, AsyncWriteExt as _};
use tokio::sync::mpsc::{Receiver, Sender};

use super::{REOPEN_AFTER, Received};
use crate::hub::Peer;

/// How much is read in one go.
const READ_LEN: usize = 4096;

/// A link of which this side is to open one end, again whenever it fails.
pub(super) trait Line: Send + 'static {
    /// What carries bytes while it is open.
    type Io: AsyncRead + AsyncWrite + Send;
    /// A pause longer than a frame's pieces may be apart.
    const SILENCE: Duration;
    /// Why it has ended, when nothing more comes.
    const ENDED: &str;
    /// Whether each opening begins a stream of its own, rather than going on with the one there was.
    const BEGINS_ANEW: bool;

    /// Its name, for a person.
    fn name(&self) -> &str;

    /// Opens it, or says why it cannot be opened.
    fn open(&self) -> impl Future<Output = Result<Self::Io, String>> + Send;
}

/// Opens a line, carries bytes over it, and opens it again when it fails, until nobody wants it any more.
pub(super) async fn keep_open<L: Line>(line: L, inbox: Sender<Received>, mut outbox: Receiver<Vec<u8>>) {
    let mut last_trouble = String::new();
    for opening in 0.. {
        let peer: Peer = if L::BEGINS_ANEW { opening } else { 0 };
        let trouble = match line.open().await {
            Ok(io) => {
                last_trouble.clear();
                if inbox.send(Received::Up(line.name().to_owned())).await.is_err() {
                    return;
                }
                let trouble = carry::<L>(io, peer, &inbox, &mut outbox).await;
                if L::BEGINS_ANEW && inbox.send(Received::Gone(peer)).await.is_err() {
                    return;
                }
                match trouble {
                    Some(trouble) => trouble,
                    None => return,
                }
            }
            Err(trouble) => trouble,
        };
        // Said once, not twice a second.
        if trouble != last_trouble {
            if inbox.send(Received::Down(format!("{}: {trouble}", line.name()))).await.is_err() {
                return;
            }
            last_trouble = trouble;
        }
        tokio::time::sleep(REOPEN_AFTER).await;
        // What was queued for a dead line is stale.
        while outbox.try_recv().is_ok() {}
        if inbox.is_closed() || outbox.is_closed() {
            return;
        }
    }
}

/// Carries bytes until the line fails (says why) or nobody wants it any more (`None`). Reading and writing do
/// not wait for each other: an end that takes nothing must still be heard, and may still deliver an abort.
async fn carry<L: Line>(
    io: L::Io,
    peer: Peer,
    inbox: &Sender<Received>,
    outbox: &mut Receiver<Vec<u8>>,
) -> Option<String> {
    let (reader, mut writer) = tokio::io::split(io);
    let write = async {
        loop {
            if let Err(error) = writer.write_all(&outbox.recv().await?).await {
                return Some(error.to_string());
            }
        }
    };
    tokio::select! {
        ended = read_all(reader, peer, L::SILENCE, inbox) => ended.map(|error| {
            error.map_or_else(|| L::ENDED.to_owned(), |error| error.to_string())
        }),
        ended = write => ended,
    }
}

/// Reads until the stream ends; returns the error that ended it, if one did. `None`: nobody wants the link any more.
pub(super) async fn read_all(
    mut reader: impl AsyncRead + Unpin,
    peer: Peer,
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
                // Said once a burst, not again and again.
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

//! Serial lines, reopened when they come back.

use std::time::Duration;

use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _, ReadHalf, WriteHalf};
use tokio::sync::mpsc::{Receiver, Sender};
use tokio_serial::{SerialPortBuilderExt as _, SerialStream};

use super::{REOPEN_AFTER, Received};

/// A serial line is one stream, however often it is reopened.
const STREAM: crate::hub::Peer = 0;
/// A pause longer than any within a frame: at 9,600 baud the longest frame takes 0.3 s, but without pauses.
const SILENCE: Duration = Duration::from_millis(100);

pub(super) fn open(path: String, baud: u32, inbox: Sender<Received>, outbox: Receiver<Vec<u8>>) {
    tokio::spawn(run(path, baud, inbox, outbox));
}

async fn run(path: String, baud: u32, inbox: Sender<Received>, mut outbox: Receiver<Vec<u8>>) {
    let mut last_trouble = String::new();
    loop {
        let trouble = match tokio_serial::new(&path, baud).open_native_async() {
            Ok(port) => {
                last_trouble.clear();
                if inbox.send(Received::Up(path.clone())).await.is_err() {
                    return;
                }
                match carry(port, &inbox, &mut outbox).await {
                    Some(trouble) => trouble,
                    None => return,
                }
            }
            Err(error) => error.to_string(),
        };
        // Said once, not twice a second.
        if trouble != last_trouble {
            if inbox.send(Received::Down(format!("{path}: {trouble}"))).await.is_err() {
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
/// not wait for each other: a line that takes nothing must still deliver an abort.
async fn carry(
    port: SerialStream,
    inbox: &Sender<Received>,
    outbox: &mut Receiver<Vec<u8>>,
) -> Option<String> {
    let (reader, writer) = tokio::io::split(port);
    tokio::select! {
        ended = read_all(reader, inbox) => ended,
        ended = write_all(writer, outbox) => ended,
    }
}

async fn read_all(mut reader: ReadHalf<SerialStream>, inbox: &Sender<Received>) -> Option<String> {
    let mut buffer = [0; 1024];
    let mut in_burst = false;
    loop {
        let count = match tokio::time::timeout(SILENCE, reader.read(&mut buffer)).await {
            Ok(Ok(0)) => return Some("the line was closed".to_owned()),
            Ok(Ok(count)) => count,
            Ok(Err(error)) => return Some(error.to_string()),
            Err(_elapsed) => {
                // Said once a burst, not ten times a second.
                if std::mem::take(&mut in_burst) {
                    inbox.send(Received::Silence(STREAM)).await.ok()?;
                }
                continue;
            }
        };
        in_burst = true;
        inbox.send(Received::Stream(STREAM, buffer[..count].to_vec())).await.ok()?;
    }
}

async fn write_all(mut writer: WriteHalf<SerialStream>, outbox: &mut Receiver<Vec<u8>>) -> Option<String> {
    loop {
        if let Err(error) = writer.write_all(&outbox.recv().await?).await {
            return Some(error.to_string());
        }
    }
}

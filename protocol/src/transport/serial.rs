//! Serial lines, reopened when they come back.

use std::time::Duration;

use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::sync::mpsc::{Receiver, Sender};
use tokio_serial::{SerialPortBuilderExt as _, SerialStream};

use super::Received;

const REOPEN_AFTER: Duration = Duration::from_millis(500);

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

/// Carries bytes until the line fails (says why) or nobody wants it any more (`None`).
async fn carry(
    port: SerialStream,
    inbox: &Sender<Received>,
    outbox: &mut Receiver<Vec<u8>>,
) -> Option<String> {
    let (mut reader, mut writer) = tokio::io::split(port);
    let mut buffer = [0; 1024];
    loop {
        tokio::select! {
            count = reader.read(&mut buffer) => match count {
                Ok(0) => return Some("the line was closed".to_owned()),
                Ok(count) => inbox.send(Received::Stream(buffer[..count].to_vec())).await.ok()?,
                Err(error) => return Some(error.to_string()),
            },
            bytes = outbox.recv() => {
                if let Err(error) = writer.write_all(&bytes?).await {
                    return Some(error.to_string());
                }
            }
        }
    }
}

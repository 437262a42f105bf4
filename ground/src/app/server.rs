//! The station's side of its screens: history for who comes, news for who is there, requests back.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use anyhow::Context as _;
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::UnixStream;
use tokio::net::unix::OwnedReadHalf;
use tokio::sync::{broadcast, mpsc};

use crate::attach::codec::{Asked, Hello, Told, VERSION, decode_asked, encode_told, length};
use crate::attach::place;
use crate::model::Model;
use crate::update::Msg;

/// History kept: some hours of a radio.
const HISTORY_BYTES_MAX: usize = 24 * 1024 * 1024;
/// A screen that falls this many messages behind is let go; it attaches again.
const BEHIND_MAX: usize = 4_096;
/// Requests waiting at most.
const REQUESTS_MAX: usize = 64;

type Bytes = Arc<[u8]>;

#[derive(Default)]
struct History {
    hello: Option<Bytes>,
    kept: VecDeque<Bytes>,
    bytes: usize,
}

/// Serves screens until it goes out of scope.
pub struct Server {
    path: PathBuf,
    history: Arc<Mutex<History>>,
    news: broadcast::Sender<Bytes>,
    requests: mpsc::Receiver<Asked>,
    accepting: tokio::task::JoinHandle<()>,
}

impl Server {
    /// Listens on the socket.
    ///
    /// # Errors
    /// A station runs there already, or the place cannot be written.
    pub async fn open(path: &Path, hello: Hello) -> anyhow::Result<Self> {
        let listener =
            place::listen(path).await.with_context(|| format!("serving screens on {}", path.display()))?;
        let (news, _) = broadcast::channel(BEHIND_MAX);
        let (ask, requests) = mpsc::channel(REQUESTS_MAX);
        let hello = encode_told(&Told::Hello(hello), Duration::ZERO).map(Bytes::from);
        let history = Arc::new(Mutex::new(History { hello, ..History::default() }));
        let (for_screens, known) = (news.clone(), Arc::clone(&history));
        let accepting = tokio::spawn(async move {
            loop {
                match listener.accept().await {
                    Ok((stream, _)) if place::own(&stream).is_ok() => {
                        let (past, live) = snapshot(&known, &for_screens);
                        tokio::spawn(serve(stream, past, live, ask.clone()));
                    }
                    Ok(_) => {}
                    // Out of descriptors: others may be freed meanwhile.
                    Err(_) => tokio::time::sleep(Duration::from_millis(200)).await,
                }
            }
        });
        Ok(Self { path: path.to_owned(), history, news, requests, accepting })
    }

    /// Hands a message to every screen, now and later.
    pub fn publish(&mut self, msg: &Msg, now: Duration) {
        let Some(bytes) = encode_told(&Told::Msg(msg.clone()), now).map(Bytes::from) else { return };
        let Ok(mut history) = self.history.lock() else { return };
        history.bytes += bytes.len();
        history.kept.push_back(Arc::clone(&bytes));
        while history.bytes > HISTORY_BYTES_MAX {
            let Some(oldest) = history.kept.pop_front() else { break };
            history.bytes -= oldest.len();
        }
        // Nobody there is no failure.
        let _ = self.news.send(bytes);
    }

    /// The next request of a screen.
    pub async fn next(&mut self) -> Asked {
        match self.requests.recv().await {
            Some(asked) => asked,
            None => std::future::pending().await,
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.accepting.abort();
        // A socket that stays behind is replaced by the next station.
        let _ = std::fs::remove_file(&self.path);
    }
}

/// What a station tells a screen first.
pub(super) fn hello(model: &Model) -> Hello {
    let settings = &model.settings;
    Hello {
        version: VERSION,
        auto: settings.auto,
        link_capacity_bytes_s: settings.link_capacity_bytes_s.unwrap_or(0),
        system_ids: [settings.us.system_id, settings.vehicle.system_id],
        link_name: settings.link_name.clone(),
        log_path: settings.log_path.clone().unwrap_or_default(),
        tlog_path: settings.tlog_path.clone().unwrap_or_default(),
    }
}

/// Everything so far, and what comes after it: nothing twice, nothing missing.
fn snapshot(
    history: &Mutex<History>,
    news: &broadcast::Sender<Bytes>,
) -> (Vec<Bytes>, broadcast::Receiver<Bytes>) {
    let Ok(history) = history.lock() else { return (Vec::new(), news.subscribe()) };
    let past = history.hello.iter().chain(&history.kept).cloned().collect();
    (past, news.subscribe())
}

async fn serve(
    stream: UnixStream,
    past: Vec<Bytes>,
    mut live: broadcast::Receiver<Bytes>,
    ask: mpsc::Sender<Asked>,
) {
    let (read, mut write) = stream.into_split();
    let mut listening = tokio::spawn(listen_to(read, ask));
    let mut out = Vec::new();
    for bytes in past {
        out.extend_from_slice(&bytes);
        if out.len() > 256 * 1024 {
            if write.write_all(&out).await.is_err() {
                return;
            }
            out.clear();
        }
    }
    out.extend(encode_told(&Told::Live, Duration::ZERO).unwrap_or_default());
    if write.write_all(&out).await.is_err() {
        return;
    }
    loop {
        tokio::select! {
            // Lagged behind, or the station ends: the screen sees its end and attaches again.
            news = live.recv() => match news {
                Ok(bytes) if write.write_all(&bytes).await.is_ok() => {}
                _ => break,
            },
            _ = &mut listening => return,
        }
    }
    listening.abort();
}

/// Reads a screen's requests until it ends or says what no screen says.
async fn listen_to(mut read: OwnedReadHalf, ask: mpsc::Sender<Asked>) {
    let mut may_ask = false;
    while let Some(bytes) = read_one(&mut read).await {
        match decode_asked(&bytes) {
            Ok(Asked::Hello { watch }) => may_ask = !watch,
            Ok(asked) if may_ask => {
                if ask.send(asked).await.is_err() {
                    return;
                }
            }
            // A screen that only watches is not heard.
            Ok(_) => {}
            Err(_) => return,
        }
    }
}

/// One message's bytes without their length; `None` at the end.
pub async fn read_one(read: &mut OwnedReadHalf) -> Option<Vec<u8>> {
    let mut prefix = [0; 4];
    read.read_exact(&mut prefix).await.ok()?;
    let mut bytes = vec![0; length(prefix).ok()?];
    read.read_exact(&mut bytes).await.ok()?;
    Some(bytes)
}

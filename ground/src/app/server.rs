//! The station's side of its screens: history for who comes, news for who is there, requests back.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use anyhow::Context as _;
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::UnixStream;
use tokio::net::unix::{OwnedReadHalf, OwnedWriteHalf};
use tokio::sync::{broadcast, mpsc, oneshot};

use crate::attach::codec::{Asked, Hello, Told, VERSION, decode_asked, encode_told, length};
use crate::attach::place;
use crate::model::Model;
use crate::model::seat::Seat;
use crate::update::Msg;

/// History kept: some hours of a radio.
const HISTORY_BYTES_MAX: usize = 24 * 1024 * 1024;
/// A screen that falls this many messages behind is let go; it attaches again.
const BEHIND_MAX: usize = 4_096;
/// Requests waiting at most.
const REQUESTS_MAX: usize = 64;
/// Who connects says what it wants within this time.
const SPEAKS_WITHIN: Duration = Duration::from_secs(5);

type Bytes = Arc<[u8]>;

/// What reaches a station over its socket.
#[derive(Debug)]
pub enum News {
    /// A screen is there.
    Came {
        /// Its number and its operator.
        seat: Seat,
        /// It commands nothing.
        watch: bool,
    },
    /// The screen of this number is gone.
    Left(u32),
    /// A screen asks for something.
    Asked(Seat, Asked),
    /// Somebody without a screen asks, and waits for the answer.
    Wants(Asked, oneshot::Sender<Told>),
}

struct History {
    hello: Hello,
    kept: VecDeque<Bytes>,
    bytes: usize,
}

/// Serves screens until it goes out of scope.
pub struct Server {
    paths: Vec<PathBuf>,
    shared: Arc<Shared>,
    requests: mpsc::Receiver<News>,
    accepting: tokio::task::JoinHandle<()>,
}

/// What every screen's task needs.
struct Shared {
    history: Mutex<History>,
    news: broadcast::Sender<Bytes>,
    next_screen: AtomicU32,
}

impl Server {
    /// Listens at this place, or at the usual one. Screens are numbered from `first_screen` on.
    ///
    /// # Errors
    /// A station runs there already, or the place cannot be written.
    pub async fn open(asked_for: Option<&Path>, hello: Hello, first_screen: u32) -> anyhow::Result<Self> {
        let path = asked_for.map_or_else(place::own_path, Path::to_owned);
        let serving = || format!("serving screens on {}", path.display());
        let listener = place::listen(&path).await.with_context(serving)?;
        let mut paths = vec![path.clone()];
        if asked_for.is_some() {
            paths.push(place::make_known(&path).with_context(serving)?);
        }
        let (news, _) = broadcast::channel(BEHIND_MAX);
        let (ask, requests) = mpsc::channel(REQUESTS_MAX);
        let history = Mutex::new(History { hello, kept: VecDeque::new(), bytes: 0 });
        let shared = Arc::new(Shared { history, news, next_screen: AtomicU32::new(first_screen) });
        let for_screens = Arc::clone(&shared);
        let accepting = tokio::spawn(async move {
            loop {
                match listener.accept().await {
                    Ok((stream, _)) if place::own(&stream).is_ok() => {
                        tokio::spawn(receive(stream, Arc::clone(&for_screens), ask.clone()));
                    }
                    Ok(_) => {}
                    // Out of descriptors: others may be freed meanwhile.
                    Err(_) => tokio::time::sleep(Duration::from_millis(200)).await,
                }
            }
        });
        Ok(Self { paths, shared, requests, accepting })
    }

    /// Hands a message to every screen, now and later.
    pub fn publish(&mut self, msg: &Msg, now: Duration) {
        let Some(bytes) = encode_told(&Told::Msg(msg.clone()), now).map(Bytes::from) else { return };
        let Ok(mut history) = self.shared.history.lock() else { return };
        history.bytes += bytes.len();
        history.kept.push_back(Arc::clone(&bytes));
        while history.bytes > HISTORY_BYTES_MAX {
            let Some(oldest) = history.kept.pop_front() else { break };
            history.bytes -= oldest.len();
        }
        // Nobody there is no failure.
        let _ = self.shared.news.send(bytes);
    }

    /// What comes next.
    pub async fn next(&mut self) -> News {
        match self.requests.recv().await {
            Some(news) => news,
            None => std::future::pending().await,
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.accepting.abort();
        for path in &self.paths {
            // What stays behind is replaced by the next station there.
            let _ = std::fs::remove_file(path);
        }
    }
}

/// What a station tells a screen first.
pub(super) fn hello(model: &Model) -> Hello {
    let settings = &model.settings;
    Hello {
        version: VERSION,
        screen: 0,
        auto: settings.auto,
        demonstration: settings.demonstration,
        link_capacity_bytes_s: settings.link_capacity_bytes_s.unwrap_or(0),
        system_ids: [settings.us.system_id, settings.vehicle.system_id],
        link_name: settings.link_name.clone(),
        log_path: settings.log_path.clone().unwrap_or_default(),
        tlog_path: settings.tlog_path.clone().unwrap_or_default(),
    }
}

impl Shared {
    /// Everything so far, and what comes after it: nothing twice, nothing missing.
    fn snapshot(&self, screen: u32) -> (Vec<Bytes>, broadcast::Receiver<Bytes>) {
        let Ok(history) = self.history.lock() else { return (Vec::new(), self.news.subscribe()) };
        let hello = Told::Hello(Hello { screen, ..history.hello.clone() });
        let hello = encode_told(&hello, Duration::ZERO).map(Bytes::from);
        let past = hello.iter().chain(&history.kept).cloned().collect();
        (past, self.news.subscribe())
    }
}

/// Somebody has connected: a screen, or one question.
async fn receive(stream: UnixStream, shared: Arc<Shared>, ask: mpsc::Sender<News>) {
    let (mut read, mut write) = stream.into_split();
    let Ok(Some(first)) = tokio::time::timeout(SPEAKS_WITHIN, read_one(&mut read)).await else { return };
    match decode_asked(&first) {
        Ok(Asked::Hello { watch, operator }) => {
            let screen = shared.next_screen.fetch_add(1, Ordering::Relaxed);
            let seat = Seat::new(screen, operator);
            if ask.send(News::Came { seat: seat.clone(), watch }).await.is_ok() {
                serve(read, write, &shared, (seat, watch), ask.clone()).await;
                // Only a station that ends hears it no more.
                let _ = ask.send(News::Left(screen)).await;
            }
        }
        Ok(question @ (Asked::Status | Asked::Stop { .. })) => {
            let (answer, answered) = oneshot::channel();
            if ask.send(News::Wants(question, answer)).await.is_ok()
                && let Ok(told) = answered.await
            {
                // Who asked may be gone.
                let _ = write.write_all(&encode_told(&told, Duration::ZERO).unwrap_or_default()).await;
            }
        }
        Ok(_) => {}
        // Perhaps a screen of another version: it is told ours.
        Err(_) => {
            let ours = Told::Hello(Hello { version: VERSION, ..Hello::default() });
            let _ = write.write_all(&encode_told(&ours, Duration::ZERO).unwrap_or_default()).await;
        }
    }
}

async fn serve(
    read: OwnedReadHalf,
    mut write: OwnedWriteHalf,
    shared: &Shared,
    (seat, watch): (Seat, bool),
    ask: mpsc::Sender<News>,
) {
    let (past, mut live) = shared.snapshot(seat.screen);
    let mut listening = tokio::spawn(listen_to(read, seat, watch, ask));
    let mut out = Vec::new();
    for bytes in past {
        out.extend_from_slice(&bytes);
        if out.len() > 256 * 1024 {
            if write.write_all(&out).await.is_err() {
                return hear_out(write, listening).await;
            }
            out.clear();
        }
    }
    out.extend(encode_told(&Told::Live, Duration::ZERO).unwrap_or_default());
    if write.write_all(&out).await.is_err() {
        return hear_out(write, listening).await;
    }
    loop {
        tokio::select! {
            // Lagged behind, or gone: it sees its end and attaches again.
            news = live.recv() => match news {
                Ok(bytes) if write.write_all(&bytes).await.is_ok() => {}
                _ => break,
            },
            _ = &mut listening => return,
        }
    }
    hear_out(write, listening).await;
}

/// A screen that nothing can be told any more may have asked for something with its last breath, for an abort perhaps.
async fn hear_out(write: OwnedWriteHalf, mut listening: tokio::task::JoinHandle<()>) {
    // Its end of the news; it closes its own then.
    drop(write);
    if tokio::time::timeout(SPEAKS_WITHIN, &mut listening).await.is_err() {
        listening.abort();
    }
}

/// Reads a screen's requests until it ends or says what no screen says.
async fn listen_to(mut read: OwnedReadHalf, seat: Seat, watch: bool, ask: mpsc::Sender<News>) {
    while let Some(bytes) = read_one(&mut read).await {
        match decode_asked(&bytes) {
            // A screen that only watches is not heard.
            Ok(_) if watch => {}
            Ok(asked) => {
                if ask.send(News::Asked(seat.clone(), asked)).await.is_err() {
                    return;
                }
            }
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

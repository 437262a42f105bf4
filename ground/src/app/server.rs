//! The station's side of its socket: sends history and updates to attached screens, and receives
//! their requests.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use anyhow::Context as _;
use futures_util::StreamExt as _;
use tokio::io::AsyncWriteExt as _;
use tokio::net::UnixStream;
use tokio::net::unix::{OwnedReadHalf, OwnedWriteHalf};
use tokio::sync::{broadcast, mpsc, oneshot};
use tokio_util::codec::{FramedRead, LengthDelimitedCodec};

use super::backlog::{Backlog, Bytes};
use super::output::absolute;
use crate::attach::codec::{decode_to_station, encode_to_screen, messages};
use crate::attach::{Hello, ToScreen, ToStation, socket};
use crate::model::{Model, Seat, Settings};
use crate::update::Msg;

/// A screen that is this many messages behind is disconnected; it attaches again.
const BEHIND_MAX: usize = 4_096;
/// How many requests may wait.
const REQUESTS_MAX: usize = 64;
/// How long a new connection may take to send its first message.
const SPEAKS_WITHIN: Duration = Duration::from_secs(5);

/// The messages of a screen.
type ScreenMessages = FramedRead<OwnedReadHalf, LengthDelimitedCodec>;

/// An event of the station's socket.
#[derive(Debug)]
pub enum ServerEvent {
    /// A screen with this number and operator has attached.
    ScreenJoined { seat: Seat, watch: bool },
    /// The screen with this number has left.
    ScreenLeft(u32),
    /// A request of a screen.
    FromScreen(Seat, ToStation),
    /// A query of a command without a screen, which waits for the answer.
    Question(ToStation, oneshot::Sender<ToScreen>),
}

#[derive(Default)]
struct History {
    hello: Hello,
    /// The latest checklist, which is sent also if the backlog no longer reaches back to it.
    checklist: Option<Bytes>,
    backlog: Backlog,
}

/// Serves screens until it goes out of scope.
pub struct Server {
    paths: Vec<PathBuf>,
    shared: Arc<Shared>,
    requests: mpsc::Receiver<ServerEvent>,
    accepting: tokio::task::JoinHandle<()>,
}

/// The state shared by the tasks of all screens.
struct Shared {
    history: Mutex<History>,
    updates: broadcast::Sender<Bytes>,
    next_screen: AtomicU32,
}

impl Server {
    /// Listens on this path, or on the usual one. Screens are numbered from `first_screen` on.
    ///
    /// # Errors
    /// A station already runs there, or the path cannot be written.
    pub async fn open(named: Option<&Path>, hello: Hello, first_screen: u32) -> anyhow::Result<Self> {
        let path = named.map_or_else(socket::default_path, Path::to_owned);
        let serving = || format!("serving screens on {}", path.display());
        let listener = socket::listen(&path).await.with_context(serving)?;
        let mut paths = vec![path.clone()];
        if named.is_some() {
            paths.push(socket::link_from_directory(&path).with_context(serving)?);
        }
        let (updates, _) = broadcast::channel(BEHIND_MAX);
        let (events, requests) = mpsc::channel(REQUESTS_MAX);
        let history = Mutex::new(History { hello, ..History::default() });
        let shared = Arc::new(Shared { history, updates, next_screen: AtomicU32::new(first_screen) });
        let for_screens = Arc::clone(&shared);
        let accepting = tokio::spawn(async move {
            loop {
                match listener.accept().await {
                    Ok((stream, _)) if socket::check_peer(&stream).is_ok() => {
                        tokio::spawn(receive(stream, Arc::clone(&for_screens), events.clone()));
                    }
                    Ok(_) => {}
                    // Probably out of file descriptors; some may be free later.
                    Err(_) => tokio::time::sleep(Duration::from_millis(200)).await,
                }
            }
        });
        Ok(Self { paths, shared, requests, accepting })
    }

    /// Sends a message to every screen, and stores it for later ones.
    pub fn publish(&mut self, msg: &Msg, now: Duration) {
        let Some(bytes) = encode_to_screen(&ToScreen::Msg(msg.clone()), now).map(Bytes::from) else { return };
        let Ok(mut history) = self.shared.history.lock() else { return };
        if matches!(msg, Msg::Checklist(_)) {
            history.checklist = Some(Arc::clone(&bytes));
        }
        history.backlog.push(&bytes);
        // Fails only if no screen is attached.
        let _ = self.shared.updates.send(bytes);
    }

    /// Greets later screens with this.
    pub(super) fn greet_with(&self, hello: Hello) {
        if let Ok(mut history) = self.shared.history.lock() {
            history.hello = hello;
        }
    }

    /// The next event.
    pub async fn next(&mut self) -> ServerEvent {
        match self.requests.recv().await {
            Some(updates) => updates,
            None => std::future::pending().await,
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.accepting.abort();
        for path in &self.paths {
            // A socket that stays behind is replaced by the next station.
            let _ = std::fs::remove_file(path);
        }
    }
}

/// The first message to a screen, which may run in another folder.
pub(super) fn hello(model: &Model) -> Hello {
    let log_path = model.settings.log_path.as_deref().map(absolute);
    Hello { screen: 0, station: Settings { log_path, ..model.settings.clone() } }
}

impl Shared {
    /// The history, and a receiver for everything after it, with no gap and no overlap.
    fn snapshot(&self, screen: u32) -> (Vec<Bytes>, broadcast::Receiver<Bytes>) {
        let Ok(history) = self.history.lock() else { return (Vec::new(), self.updates.subscribe()) };
        let hello = ToScreen::Hello(Box::new(Hello { screen, ..history.hello.clone() }));
        let hello = encode_to_screen(&hello, Duration::ZERO).map(Bytes::from);
        let past = hello.iter().chain(&history.checklist).cloned().chain(history.backlog.all()).collect();
        (past, self.updates.subscribe())
    }
}

/// Serves a new connection: a screen, or a single query.
async fn receive(stream: UnixStream, shared: Arc<Shared>, events: mpsc::Sender<ServerEvent>) {
    let (read, mut write) = stream.into_split();
    let mut read = messages(read);
    let Ok(Some(Ok(first))) = tokio::time::timeout(SPEAKS_WITHIN, read.next()).await else { return };
    match decode_to_station(&first) {
        Ok(ToStation::Hello { watch, operator }) => {
            let screen = shared.next_screen.fetch_add(1, Ordering::Relaxed);
            let seat = Seat::new(screen, operator);
            if events.send(ServerEvent::ScreenJoined { seat: seat.clone(), watch }).await.is_ok() {
                serve(read, write, &shared, (seat, watch), events.clone()).await;
                // Fails only if the station is ending.
                let _ = events.send(ServerEvent::ScreenLeft(screen)).await;
            }
        }
        Ok(question @ (ToStation::Status | ToStation::Stop { .. })) => {
            let (answer, answered) = oneshot::channel();
            if events.send(ServerEvent::Question(question, answer)).await.is_ok()
                && let Ok(answer) = answered.await
            {
                // The querying process may have ended.
                let _ = write.write_all(&encode_to_screen(&answer, Duration::ZERO).unwrap_or_default()).await;
            }
        }
        Ok(_) => {}
        // Perhaps a screen of another version: every message has ours.
        Err(_) => {
            let ours = encode_to_screen(&ToScreen::Live, Duration::ZERO);
            let _ = write.write_all(&ours.unwrap_or_default()).await;
        }
    }
}

async fn serve(
    read: ScreenMessages,
    mut write: OwnedWriteHalf,
    shared: &Shared,
    (seat, watch): (Seat, bool),
    events: mpsc::Sender<ServerEvent>,
) {
    let (past, mut live) = shared.snapshot(seat.screen);
    let mut listening = tokio::spawn(listen_to(read, seat, watch, events));
    let live_now = encode_to_screen(&ToScreen::Live, Duration::ZERO).map(Bytes::from);
    for bytes in past.into_iter().chain(live_now) {
        if write.write_all(&bytes).await.is_err() {
            return read_last_requests(write, listening).await;
        }
    }
    loop {
        tokio::select! {
            // Too far behind or lost; the screen receives the end and attaches again.
            updates = live.recv() => match updates {
                Ok(bytes) if write.write_all(&bytes).await.is_ok() => {}
                _ => break,
            },
            _ = &mut listening => return,
        }
    }
    read_last_requests(write, listening).await;
}

/// Reads the last requests of a screen that can no longer be written to; there may be an abort
/// among them.
async fn read_last_requests(write: OwnedWriteHalf, mut listening: tokio::task::JoinHandle<()>) {
    // Closes our side; the screen then closes its own.
    drop(write);
    if tokio::time::timeout(SPEAKS_WITHIN, &mut listening).await.is_err() {
        listening.abort();
    }
}

/// Reads a screen's requests until it closes or sends something invalid.
async fn listen_to(mut read: ScreenMessages, seat: Seat, watch: bool, events: mpsc::Sender<ServerEvent>) {
    while let Some(Ok(bytes)) = read.next().await {
        match decode_to_station(&bytes) {
            // Requests of a screen that only watches are ignored.
            Ok(_) if watch => {}
            Ok(message) => {
                if events.send(ServerEvent::FromScreen(seat.clone(), message)).await.is_err() {
                    return;
                }
            }
            Err(_) => return,
        }
    }
}

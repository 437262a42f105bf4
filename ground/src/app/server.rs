//! The station's side of its sockets: sends history and news to attached screens and to watchers, and receives the
//! requests of screens.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use anyhow::Context as _;
use tokio::io::{AsyncRead, AsyncReadExt as _, AsyncWriteExt as _};

use tokio::net::unix::{OwnedReadHalf, OwnedWriteHalf};
use tokio::net::{TcpListener, TcpStream, UnixStream, tcp};
use tokio::sync::{Semaphore, broadcast, mpsc, oneshot};

use crate::attach::codec::{decode_to_station, encode_to_screen, length};
use crate::attach::{Hello, ToScreen, ToStation, VERSION, socket};
use crate::model::{Model, Seat, Settings};
use crate::update::Msg;

/// The size of the kept history: an hour of telemetry in flight, half a minute of the worst flood. It is most of what a station
/// ever needs.
const HISTORY_BYTES_MAX: usize = 16 * 1024 * 1024;
/// Messages are kept together in blocks of this size: one by one, each would take as much again for its place.
const BLOCK_BYTES: usize = 64 * 1024;
/// A screen that is this many messages behind is disconnected; it attaches again.
const BEHIND_MAX: usize = 4_096;
/// How many requests may wait.
const REQUESTS_MAX: usize = 64;
/// How long a new connection may take to send its first message.
const SPEAKS_WITHIN: Duration = Duration::from_secs(5);

type Bytes = Arc<[u8]>;

/// What a station receives over its socket.
#[derive(Debug)]
pub enum ServerEvent {
    /// A screen has attached.
    ScreenJoined {
        /// Its number and operator.
        seat: Seat,
        watch: bool,
    },
    /// The screen with this number is gone.
    ScreenLeft(u32),
    /// A screen asks for something.
    FromScreen(Seat, ToStation),
    /// A command without a screen asks and waits for the answer.
    Question(ToStation, oneshot::Sender<ToScreen>),
}

struct History {
    hello: Hello,
    /// The latest checklist, which is sent also if the history no longer reaches back to it.
    checklist: Option<Bytes>,
    /// Whole messages, each with its length before it.
    blocks: VecDeque<Bytes>,
    /// The block that is being filled.
    last: Vec<u8>,
    /// The size of all of them.
    bytes: usize,
}

impl History {
    fn new(hello: Hello) -> Self {
        Self { hello, checklist: None, blocks: VecDeque::new(), last: Vec::new(), bytes: 0 }
    }

    fn keep(&mut self, message: &[u8]) {
        if self.last.len() + message.len() > BLOCK_BYTES && !self.last.is_empty() {
            self.blocks.push_back(Bytes::from(&self.last[..]));
            self.last.clear();
        }
        self.last.extend_from_slice(message);
        self.bytes += message.len();
        while self.bytes > HISTORY_BYTES_MAX {
            let Some(oldest) = self.blocks.pop_front() else { break };
            self.bytes -= oldest.len();
        }
    }

    /// All of it, in order.
    fn kept(&self) -> impl Iterator<Item = Bytes> {
        self.blocks.iter().cloned().chain([Bytes::from(&self.last[..])])
    }
}

/// The end of a block: whole messages, at most this much of them.
fn end_of(block: &[u8], most_bytes: usize) -> &[u8] {
    let mut rest = block;
    while rest.len() > most_bytes
        && let Some((prefix, _)) = rest.split_first_chunk()
        && let Ok(length) = length(*prefix)
    {
        rest = rest.get(prefix.len() + length..).unwrap_or_default();
    }
    rest
}

/// Serves screens until it goes out of scope.
pub struct Server {
    paths: Vec<PathBuf>,
    shared: Arc<Shared>,
    requests: mpsc::Receiver<ServerEvent>,
    accepting: tokio::task::JoinHandle<()>,
}

/// What the tasks of all screens share.
pub(super) struct Shared {
    history: Mutex<History>,
    news: broadcast::Sender<Bytes>,
    next_screen: AtomicU32,
}

impl Server {
    /// Listens on this path, or on the usual one. Screens are numbered from `first_screen` on.
    ///
    /// # Errors
    /// A station already runs there, or the path cannot be written.
    pub async fn open(asked_for: Option<&Path>, hello: Hello, first_screen: u32) -> anyhow::Result<Self> {
        let path = asked_for.map_or_else(socket::own_path, Path::to_owned);
        let serving = || format!("serving screens on {}", path.display());
        let listener = socket::listen(&path).await.with_context(serving)?;
        let mut paths = vec![path.clone()];
        if asked_for.is_some() {
            paths.push(socket::link_from_directory(&path).with_context(serving)?);
        }
        let (news, _) = broadcast::channel(BEHIND_MAX);
        let (ask, requests) = mpsc::channel(REQUESTS_MAX);
        let history = Mutex::new(History::new(hello));
        let shared = Arc::new(Shared { history, news, next_screen: AtomicU32::new(first_screen) });
        let for_screens = Arc::clone(&shared);
        let accepting = tokio::spawn(async move {
            loop {
                match listener.accept().await {
                    Ok((stream, _)) if socket::check_peer(&stream).is_ok() => {
                        tokio::spawn(receive(stream, Arc::clone(&for_screens), ask.clone()));
                    }
                    Ok(_) => {}
                    // Probably out of file descriptors; some may be free later.
                    Err(_) => tokio::time::sleep(Duration::from_millis(200)).await,
                }
            }
        });
        Ok(Self { paths, shared, requests, accepting })
    }

    /// What a feed for watchers tells.
    pub(super) fn shared(&self) -> Arc<Shared> {
        Arc::clone(&self.shared)
    }

    /// Sends a message to every screen, and keeps it for later ones.
    pub fn publish(&mut self, msg: &Msg, now: Duration) {
        let Some(bytes) = encode_to_screen(&ToScreen::Msg(msg.clone()), now).map(Bytes::from) else { return };
        let Ok(mut history) = self.shared.history.lock() else { return };
        if matches!(msg, Msg::Checklist(_)) {
            history.checklist = Some(Arc::clone(&bytes));
        }
        history.keep(&bytes);
        // Fails only if no screen is attached.
        let _ = self.shared.news.send(bytes);
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
            Some(news) => news,
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

/// The first message to a screen.
pub(super) fn hello(model: &Model) -> Hello {
    let log_path = model.settings.log_path.as_deref().map(absolute);
    Hello { version: VERSION, screen: 0, station: Settings { log_path, ..model.settings.clone() } }
}

/// An attached screen may run in another folder.
fn absolute(path: &str) -> String {
    std::path::absolute(path).map_or_else(|_| path.to_owned(), |path| path.display().to_string())
}

impl Shared {
    /// The greeting, at most this much of the latest past, and a receiver for everything after it.
    pub(super) fn for_watcher(&self, past_bytes: usize) -> (Vec<u8>, broadcast::Receiver<Bytes>) {
        let (all, live) = self.snapshot(0);
        let has_checklist = self.history.lock().is_ok_and(|history| history.checklist.is_some());
        // The greeting and the checklist come first, before what may be left out.
        let first = all.len().min(1 + usize::from(has_checklist));
        let (first, past) = all.split_at(first);
        let mut left = past_bytes;
        let mut latest: Vec<&[u8]> = Vec::new();
        for block in past.iter().rev() {
            let end = end_of(block, left);
            latest.push(end);
            left -= end.len();
            if end.len() < block.len() {
                break;
            }
        }
        let live_mark = encode_to_screen(&ToScreen::Live, Duration::ZERO).map(Bytes::from);
        let first = first.iter().map(|bytes| &bytes[..]);
        let told = first.chain(latest.into_iter().rev()).chain(live_mark.iter().map(|bytes| &bytes[..]));
        (told.flatten().copied().collect(), live)
    }

    /// The history, and a receiver for everything after it, with no gap and no overlap.
    fn snapshot(&self, screen: u32) -> (Vec<Bytes>, broadcast::Receiver<Bytes>) {
        let Ok(history) = self.history.lock() else { return (Vec::new(), self.news.subscribe()) };
        let hello = ToScreen::Hello(Box::new(Hello { screen, ..history.hello.clone() }));
        let hello = encode_to_screen(&hello, Duration::ZERO).map(Bytes::from);
        let past = hello.iter().chain(&history.checklist).cloned().chain(history.kept()).collect();
        (past, self.news.subscribe())
    }
}

/// Serves a new connection: a screen, or a single question.
async fn receive(stream: UnixStream, shared: Arc<Shared>, ask: mpsc::Sender<ServerEvent>) {
    let (mut read, mut write) = stream.into_split();
    let Ok(Some(first)) = tokio::time::timeout(SPEAKS_WITHIN, read_one(&mut read)).await else { return };
    match decode_to_station(&first) {
        Ok(ToStation::Hello { watch, operator }) => {
            let screen = shared.next_screen.fetch_add(1, Ordering::Relaxed);
            let seat = Seat::new(screen, operator);
            if ask.send(ServerEvent::ScreenJoined { seat: seat.clone(), watch }).await.is_ok() {
                serve(read, write, &shared, (seat, watch), ask.clone()).await;
                // Fails only if the station is ending.
                let _ = ask.send(ServerEvent::ScreenLeft(screen)).await;
            }
        }
        Ok(question @ (ToStation::Status | ToStation::Stop { .. })) => {
            let (answer, answered) = oneshot::channel();
            if ask.send(ServerEvent::Question(question, answer)).await.is_ok()
                && let Ok(told) = answered.await
            {
                // The asking process may be gone.
                let _ = write.write_all(&encode_to_screen(&told, Duration::ZERO).unwrap_or_default()).await;
            }
        }
        Ok(_) => {}
        // Perhaps a screen of another version, so send it our version.
        Err(_) => {
            let ours = ToScreen::Hello(Box::new(Hello { version: VERSION, ..Hello::default() }));
            let _ = write.write_all(&encode_to_screen(&ours, Duration::ZERO).unwrap_or_default()).await;
        }
    }
}

async fn serve(
    read: OwnedReadHalf,
    mut write: OwnedWriteHalf,
    shared: &Shared,
    (seat, watch): (Seat, bool),
    ask: mpsc::Sender<ServerEvent>,
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
    out.extend(encode_to_screen(&ToScreen::Live, Duration::ZERO).unwrap_or_default());
    if write.write_all(&out).await.is_err() {
        return hear_out(write, listening).await;
    }
    loop {
        tokio::select! {
            // Too far behind or gone; the screen sees the end and attaches again.
            news = live.recv() => match news {
                Ok(bytes) if write.write_all(&bytes).await.is_ok() => {}
                _ => break,
            },
            _ = &mut listening => return,
        }
    }
    hear_out(write, listening).await;
}

/// Reads the last requests of a screen that can no longer be written to; there may be an abort among them.
async fn hear_out(write: OwnedWriteHalf, mut listening: tokio::task::JoinHandle<()>) {
    // Closes our side; the screen then closes its own.
    drop(write);
    if tokio::time::timeout(SPEAKS_WITHIN, &mut listening).await.is_err() {
        listening.abort();
    }
}

/// Reads a screen's requests until it closes or sends something invalid.
async fn listen_to(mut read: OwnedReadHalf, seat: Seat, watch: bool, ask: mpsc::Sender<ServerEvent>) {
    while let Some(bytes) = read_one(&mut read).await {
        match decode_to_station(&bytes) {
            // Requests of a screen that only watches are ignored.
            Ok(_) if watch => {}
            Ok(asked) => {
                if ask.send(ServerEvent::FromScreen(seat.clone(), asked)).await.is_err() {
                    return;
                }
            }
            Err(_) => return,
        }
    }
}

/// The bytes of one message without its length; `None` at the end.
pub async fn read_one(read: &mut (impl AsyncRead + Unpin)) -> Option<Vec<u8>> {
    let mut prefix = [0; 4];
    read.read_exact(&mut prefix).await.ok()?;
    let mut bytes = vec![0; length(prefix).ok()?];
    read.read_exact(&mut bytes).await.ok()?;
    Some(bytes)
}

// The feed for watchers: what every screen gets, over TCP, one way. Nothing that a watcher sends is ever read, so
// nobody can command through it.

/// How many may watch at once.
pub(super) const WATCHERS_MAX: usize = 8;
/// The most that one watcher is sent, bytes per second: ten times a radio link with its framing.
const BYTES_S: u32 = 32 * 1024;
/// The most that is written at once.
const PART_BYTES: usize = 4 * 1024;
/// How much of the past a watcher gets.
const PAST_BYTES: usize = 64 * 1024;
/// A watcher that takes nothing for so long is gone.
const TAKES_WITHIN: Duration = Duration::from_secs(10);

/// Serves watchers until it goes out of scope.
pub(super) struct Watchers {
    accepting: tokio::task::JoinHandle<()>,
}

impl Watchers {
    /// Listens on this address.
    ///
    /// # Errors
    /// The address is in use, or is none of this machine's.
    pub(super) async fn open(address: &str, shared: Arc<Shared>) -> anyhow::Result<Self> {
        let listening = || format!("serving watchers on {address}");
        let listener = TcpListener::bind(address).await.with_context(listening)?;
        Ok(Self::serving(listener, shared))
    }

    fn serving(listener: TcpListener, shared: Arc<Shared>) -> Self {
        let accepting = tokio::spawn(async move {
            let seats = Arc::new(Semaphore::new(WATCHERS_MAX));
            let mut feeds = tokio::task::JoinSet::new();
            loop {
                let Ok((stream, _)) = listener.accept().await else {
                    // Probably out of file descriptors; some may be free later.
                    tokio::time::sleep(Duration::from_millis(200)).await;
                    continue;
                };
                // Tasks that have ended are dropped.
                while feeds.try_join_next().is_some() {}
                if let Ok(seat) = Arc::clone(&seats).try_acquire_owned() {
                    let shared = Arc::clone(&shared);
                    feeds.spawn(async move {
                        feed(stream, &shared).await;
                        drop(seat);
                    });
                }
            }
        });
        Self { accepting }
    }
}

impl Drop for Watchers {
    fn drop(&mut self) {
        self.accepting.abort();
    }
}

/// Tells one watcher the latest past, and then everything.
async fn feed(stream: TcpStream, shared: &Shared) {
    // The half that reads stays closed in here: it is never used.
    let (_unread, mut write) = stream.into_split();
    let (past, mut live) = shared.for_watcher(PAST_BYTES);
    if send(&mut write, &past).await.is_err() {
        return;
    }
    // Too far behind, or gone; the watcher sees the end and connects again.
    while let Ok(bytes) = live.recv().await {
        if send(&mut write, &bytes).await.is_err() {
            return;
        }
    }
}

/// Writes in parts, with a pause after each, so that no watcher takes more than its share of a link.
async fn send(write: &mut tcp::OwnedWriteHalf, bytes: &[u8]) -> std::io::Result<()> {
    for part in bytes.chunks(PART_BYTES) {
        tokio::time::timeout(TAKES_WITHIN, write.write_all(part)).await??;
        tokio::time::sleep(pause(part.len())).await;
    }
    Ok(())
}

/// How long nothing is sent after so many bytes.
fn pause(bytes: usize) -> Duration {
    Duration::from_secs_f64(bytes as f64 / f64::from(BYTES_S))
}

#[cfg(test)]
mod server_tests {
    use super::*;

    fn message(number: u32) -> Vec<u8> {
        let content = [&number.to_le_bytes()[..], &vec![7; 16 + number as usize % 300]].concat();
        [&(content.len() as u32).to_le_bytes()[..], &content].concat()
    }

    fn numbers(mut bytes: &[u8]) -> Vec<u32> {
        let mut numbers = Vec::new();
        while let Some((prefix, rest)) = bytes.split_first_chunk() {
            let length = length(*prefix).unwrap();
            numbers.push(u32::from_le_bytes(*rest.first_chunk().unwrap()));
            bytes = &rest[length..];
        }
        numbers
    }

    #[test]
    fn the_history_keeps_the_latest_messages_whole_and_is_bounded() {
        let mut history = History::new(Hello::default());
        for number in 0..200_000 {
            history.keep(&message(number));
            assert!(history.bytes <= HISTORY_BYTES_MAX);
        }
        let kept: Vec<u8> = history.kept().flat_map(|block| block.to_vec()).collect();
        assert_eq!(kept.len(), history.bytes);
        let numbers = numbers(&kept);
        assert!(numbers.windows(2).all(|pair| pair[1] == pair[0] + 1) && numbers.last() == Some(&199_999));
        assert!(kept.len() > HISTORY_BYTES_MAX - 2 * BLOCK_BYTES, "no more than a block is given up at once");
        assert!(history.blocks.len() <= HISTORY_BYTES_MAX / (BLOCK_BYTES - 400) + 1);
    }

    #[test]
    fn a_watcher_gets_the_end_of_the_past_in_whole_messages() {
        let all: Vec<u8> = (0..100).flat_map(message).collect();
        for most in [0, 1, 400, 1_000, all.len() - 1, all.len(), all.len() + 1] {
            let end = end_of(&all, most);
            assert!(end.len() <= most && all.ends_with(end));
            let numbers = numbers(end);
            assert!(numbers.last().is_none_or(|last| *last == 99));
            let more = numbers.first().map_or(99, |first| first.saturating_sub(1));
            assert!(end.len() == all.len() || end.len() + message(more).len() > most, "no less than fits");
        }
    }
}

#[cfg(test)]
mod watchers_tests {
    use super::*;
    use proptest::prelude::*;

    use crate::attach::codec::{decode_to_screen, encode_to_station};
    use crate::attach::{Hello, ToScreen, ToStation, VERSION, socket};
    use crate::model::{CommandKind, Request};
    use crate::update::Msg;

    #[test]
    fn a_watcher_is_told_everything_and_asks_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.sock");
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        runtime.block_on(async {
            let hello = Hello { version: VERSION, station: Settings::on_screen("a"), ..Hello::default() };
            let mut server = Server::open(Some(&path), hello, 1).await.unwrap();
            server.publish(&Msg::LinkUp("before".to_owned()), Duration::from_secs(1));
            let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
            let address = listener.local_addr().unwrap();
            let watchers = Watchers::serving(listener, server.shared());
            let mut watcher = TcpStream::connect(address).await.unwrap();
            // A greeting and a command, as an attached screen would send them.
            let operator = "Eve".to_owned();
            for asked in [
                ToStation::Hello { watch: false, operator },
                ToStation::Request(Request::Command(CommandKind::Arm)),
            ] {
                watcher.write_all(&encode_to_station(&asked)).await.unwrap();
            }
            let mut told = Vec::new();
            while told.len() < 3 {
                let length = watcher.read_u32_le().await.unwrap();
                let mut bytes = vec![0; length as usize];
                watcher.read_exact(&mut bytes).await.unwrap();
                told.push(decode_to_screen(&bytes).unwrap().0);
            }
            assert!(matches!(&told[0], ToScreen::Hello(hello) if hello.station.link_name == "a"));
            assert_eq!(told[1], ToScreen::Msg(Msg::LinkUp("before".to_owned())));
            assert_eq!(told[2], ToScreen::Live);
            server.publish(&Msg::LinkUp("after".to_owned()), Duration::from_secs(2));
            let length = watcher.read_u32_le().await.unwrap();
            let mut bytes = vec![0; length as usize];
            watcher.read_exact(&mut bytes).await.unwrap();
            assert_eq!(decode_to_screen(&bytes).unwrap().0, ToScreen::Msg(Msg::LinkUp("after".to_owned())));
            // The first that the station hears of anybody is a screen on its own socket.
            let (_read, mut write) = socket::connect(&path).await.unwrap().into_split();
            let hello = ToStation::Hello { watch: true, operator: "Ann".to_owned() };
            write.write_all(&encode_to_station(&hello)).await.unwrap();
            let first = format!("{:?}", server.next().await);
            assert!(first.contains("ScreenJoined") && first.contains("Ann"), "{first}");
            drop(watchers);
        });
    }

    proptest! {
        /// Whatever is sent, its pauses keep it below the bound.
        #[test]
        fn the_pauses_keep_the_rate(sizes in prop::collection::vec(1..=PART_BYTES, 1..200)) {
            let sent: usize = sizes.iter().sum();
            let paused: Duration = sizes.iter().map(|size| pause(*size)).sum();
            prop_assert!(paused.as_secs_f64() * f64::from(BYTES_S) >= sent as f64 * 0.999);
        }
    }
}

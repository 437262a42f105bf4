//! The feed for watchers: what every screen is told, over TCP, one way. Nothing that a watcher sends is ever read, so
//! nobody can command through it.

use std::sync::Arc;
use std::time::Duration;

use anyhow::Context as _;
use tokio::io::AsyncWriteExt as _;
use tokio::net::tcp::OwnedWriteHalf;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;

use super::server::Shared;

/// How many may watch at once.
pub(super) const WATCHERS_MAX: usize = 8;
/// The most that one watcher is sent, bytes per second: ten times a radio link with its framing.
const BYTES_S: u32 = 32 * 1024;
/// The most that is written at once.
const PART_BYTES: usize = 4 * 1024;
/// How much of the past a watcher is told.
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
                // Tasks that have ended are let go.
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
async fn send(write: &mut OwnedWriteHalf, bytes: &[u8]) -> std::io::Result<()> {
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
mod tests {
    use super::super::server::Server;
    use super::*;
    use crate::attach::codec::{decode_to_screen, encode_to_station};
    use crate::attach::message::{Hello, ToScreen, ToStation, VERSION};
    use crate::attach::socket;
    use crate::model::action::Request;
    use crate::model::command::CommandKind;
    use crate::update::Msg;
    use proptest::prelude::*;
    use tokio::io::AsyncReadExt as _;

    #[test]
    fn a_watcher_is_told_everything_and_asks_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.sock");
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        runtime.block_on(async {
            let hello = Hello { version: VERSION, link_name: "a".to_owned(), ..Hello::default() };
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
            assert!(matches!(&told[0], ToScreen::Hello(hello) if hello.link_name == "a"));
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

//! Serves the records of the log live, by Foxglove's WebSocket protocol.
//!
//! The recorder's thread publishes each record to the queue of each client; a thread here sends
//! them. A slow client loses the oldest of its [`QUEUE_MESSAGES`]; the run loop and the log never
//! wait for one.

use std::net::SocketAddr;
use std::sync::Arc;

use anyhow::{Context as _, bail};
use foxglove::{Context, WebSocketServerHandle};
use tokio::sync::oneshot;

use super::programs::in_a_thread;
use crate::cli::LogChoice;

/// Messages that wait for one client: about 2 s of a demonstration, which has the most.
const QUEUE_MESSAGES: usize = 4096;

/// A server of live values; it ends when this is dropped.
pub(super) struct Live {
    /// Where records are published.
    pub(super) context: Arc<Context>,
    /// The address and port that it listens on.
    pub(super) at: SocketAddr,
    _ends: oneshot::Sender<()>,
}

impl Live {
    /// Listens at the address.
    ///
    /// # Errors
    /// The address is in use or not of this machine, or no log is written.
    pub(super) fn open(at: SocketAddr, log: Option<&LogChoice>) -> anyhow::Result<Self> {
        if log == Some(&LogChoice::None) {
            bail!("--foxglove serves the records of the log: give it without `--log none`");
        }
        let context = Context::new();
        let server = context.websocket_server().name("touchdown").message_backlog_size(QUEUE_MESSAGES);
        // With the brackets of an IPv6 address.
        let shown = at.to_string();
        let host = shown.rsplit_once(':').map_or("", |(host, _)| host);
        let server = server.bind(host, at.port());
        let (ends, ended) = oneshot::channel::<()>();
        let (opened, is_open) = std::sync::mpsc::sync_channel(1);
        let serve = move || -> anyhow::Result<()> {
            let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
            runtime.block_on(async {
                let server = server.start().await;
                let port = server.as_ref().map(WebSocketServerHandle::port);
                let _ = opened.send(port.map_err(ToString::to_string));
                // The sender is dropped, which is the end.
                let _ = ended.await;
                drop(server.map(WebSocketServerHandle::stop));
            });
            Ok(())
        };
        drop(in_a_thread("live values", serve).context("starting the thread of the live values")?);
        let port = is_open.recv().context("the thread of the live values ended")?;
        let port =
            port.map_err(|why| anyhow::anyhow!("--foxglove {at}: {why}; give another address or port"))?;
        Ok(Self { context, at: SocketAddr::new(at.ip(), port), _ends: ends })
    }
}

//! Opens a serial line, and opens it again when its device comes back.

use std::time::Duration;

use tokio::sync::mpsc::{Receiver, Sender};
use tokio_serial::{SerialPortBuilderExt as _, SerialStream};

use super::Outgoing;
use super::stream::{Line, keep_open};
use crate::hub::Received;

pub(super) fn open(path: String, baud: u32, inbox: Sender<Received>, outbox: Receiver<Outgoing>) {
    tokio::spawn(keep_open(Port { path, baud }, inbox, outbox));
}

struct Port {
    path: String,
    baud: u32,
}

impl Line for Port {
    type Io = SerialStream;
    /// Bytes of one frame follow each other without a pause: at 9,600 baud the longest frame takes 0.3 s.
    const SILENCE: Duration = Duration::from_millis(100);
    const ENDED: &str = "the line was closed";
    /// A serial line stays one stream however often it is reopened.
    const BEGINS_ANEW: bool = false;

    fn name(&self) -> &str {
        &self.path
    }

    async fn open(&self) -> Result<SerialStream, String> {
        tokio_serial::new(&self.path, self.baud).open_native_async().map_err(|error| error.to_string())
    }
}

//! Sends a recording to a viewer that is running.

use std::time::Duration;

use rerun::{RecordingStream, RecordingStreamBuilder};

use crate::ExportError;
use crate::rrd::Batches;

/// Where a viewer listens unless told otherwise.
pub const DEFAULT_ADDRESS: &str = rerun::DEFAULT_CONNECT_URL;

/// How long a viewer may take to receive what was sent.
const PATIENCE: Duration = Duration::from_secs(10);

/// A recording on its way to a viewer.
pub(crate) struct Viewer {
    recording: RecordingStream,
    address: String,
}

impl Viewer {
    pub(crate) fn connect(
        builder: RecordingStreamBuilder,
        address: &str,
        batches: Batches,
    ) -> Result<Self, ExportError> {
        let recording = builder.batcher_config(batches.config()).connect_grpc_opts(address)?;
        recording.set_log_tick_enabled(false);
        recording.set_log_time_enabled(false);
        Ok(Self { recording, address: address.to_owned() })
    }

    /// The stream to record into.
    pub(crate) fn recording(&self) -> &RecordingStream {
        &self.recording
    }

    /// Waits until everything so far has been sent; an error if no viewer takes it.
    pub(crate) fn arrived(&self) -> Result<(), ExportError> {
        self.recording.flush_with_timeout(PATIENCE).map_err(|error| ExportError::NoViewer {
            address: self.address.clone(),
            reason: error.to_string(),
        })
    }
}

//! A recording written as an `.rrd` stream, with every failure to write reported.

use std::io::Write;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use re_sdk::external::re_log_encoding::{EncodeError, Encoder};
use re_sdk::log::{ChunkBatcherConfig, LogMsg};
use re_sdk::sink::{LogSink, SinkFlushError};
use re_sdk::{RecordingStream, RecordingStreamBuilder};

use crate::ExportError;

/// A recording that is being written.
pub(crate) struct RrdWriter<W: Write + Send + 'static> {
    recording: RecordingStream,
    output: Arc<Mutex<Output<W>>>,
}

struct Output<W: Write> {
    encoder: Option<Encoder<W>>,
    failure: Option<EncodeError>,
}

struct Sink<W: Write>(Arc<Mutex<Output<W>>>);

impl<W: Write + Send + 'static> RrdWriter<W> {
    /// Begins the recording that `builder` describes.
    pub(crate) fn new(builder: RecordingStreamBuilder, output: W) -> Result<Self, ExportError> {
        let encoder = Encoder::new_eager(
            re_sdk::build_info().version,
            re_sdk::external::re_log_encoding::EncodingOptions::PROTOBUF_COMPRESSED,
            output,
        )
        .map_err(encode_error)?;
        let output = Arc::new(Mutex::new(Output { encoder: Some(encoder), failure: None }));
        // A few large chunks, because no viewer is connected while this is written.
        let batches =
            ChunkBatcherConfig { flush_tick: Duration::from_hours(1), ..ChunkBatcherConfig::DEFAULT };
        let (_, store, properties, batches, hooks, _) = builder.batcher_config(batches).into_args();
        let sink = Box::new(Sink(Arc::clone(&output)));
        let recording = RecordingStream::new(store, properties, batches, hooks, sink)?;
        // The time at which this program wrote a record is not of interest.
        recording.set_log_tick_enabled(false);
        recording.set_log_time_enabled(false);
        Ok(Self { recording, output })
    }

    /// The stream to record into.
    pub(crate) fn recording(&self) -> &RecordingStream {
        &self.recording
    }

    /// Writes the remaining records and the footer.
    pub(crate) fn finish(self) -> Result<W, ExportError> {
        let flushed = self.recording.flush_blocking();
        let mut output = locked(&self.output);
        if let Some(failure) = output.failure.take() {
            return Err(encode_error(failure));
        }
        flushed.map_err(|error| ExportError::Encode { reason: error.to_string() })?;
        let Some(mut encoder) = output.encoder.take() else {
            return Err(ExportError::Encode { reason: "the recording was ended before".to_owned() });
        };
        encoder.finish().and_then(|()| encoder.flush_blocking()).map_err(encode_error)?;
        encoder.into_inner().map_err(encode_error)
    }
}

impl<W: Write + Send + 'static> LogSink for Sink<W> {
    fn send(&self, message: LogMsg) {
        let mut output = locked(&self.0);
        let Output { encoder: Some(encoder), failure } = &mut *output else {
            return;
        };
        if failure.is_none() {
            *failure = encoder.append(&message).err();
        }
    }

    fn flush_blocking(&self, _timeout: Duration) -> Result<(), SinkFlushError> {
        Ok(())
    }
}

fn locked<W: Write>(output: &Mutex<Output<W>>) -> MutexGuard<'_, Output<W>> {
    output.lock().unwrap_or_else(PoisonError::into_inner)
}

#[expect(clippy::needless_pass_by_value, reason = "for map_err")]
fn encode_error(error: EncodeError) -> ExportError {
    let mut reason = error.to_string();
    let mut cause = std::error::Error::source(&error);
    while let Some(error) = cause {
        reason = format!("{reason}: {error}");
        cause = error.source();
    }
    ExportError::Encode { reason }
}

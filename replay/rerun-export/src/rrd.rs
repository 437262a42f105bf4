//! A recording written as an `.rrd` stream, with every failure to write reported.

use std::io::Write;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rerun::external::re_log_encoding::{EncodeError, Encoder};
use rerun::log::{Chunk, ChunkBatcherConfig, LogMsg};
use rerun::sink::{LogSink, SinkFlushError};
use rerun::{RecordingStream, RecordingStreamBuilder, RecordingStreamResult};

use crate::ExportError;
use crate::entity;

/// How many rows are sent at once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Batches {
    /// A few large chunks, because no viewer is connected while this is written.
    Large,
    /// What happened in a tenth of a second, for a viewer that looks on.
    Prompt,
}

impl Batches {
    pub(crate) fn config(self) -> ChunkBatcherConfig {
        let flush_tick = match self {
            Self::Large => Duration::from_hours(1),
            Self::Prompt => Duration::from_millis(100),
        };
        ChunkBatcherConfig { flush_tick, ..ChunkBatcherConfig::DEFAULT }
    }
}

/// A recording that is being written.
pub(crate) struct RrdWriter<W: Write + Send + 'static> {
    recording: RecordingStream,
    output: Arc<Mutex<Output<W>>>,
}

struct Output<W: Write> {
    encoder: Option<Encoder<W>>,
    failure: Option<ExportError>,
}

struct Sink<W: Write> {
    output: Arc<Mutex<Output<W>>>,
    beside: bool,
}

fn stream(
    builder: RecordingStreamBuilder,
    batches: Batches,
    sink: Box<dyn LogSink>,
) -> RecordingStreamResult<RecordingStream> {
    let (_, store, properties, batches, hooks, _) = builder.batcher_config(batches.config()).into_args();
    let recording = RecordingStream::new(store, properties, batches, hooks, sink)?;
    // The time at which this program wrote a record is not of interest.
    recording.set_log_tick_enabled(false);
    recording.set_log_time_enabled(false);
    Ok(recording)
}

/// A message of the flight that lies beside another one; `None` for what a recording has once.
fn moved_beside(message: LogMsg) -> Result<Option<LogMsg>, String> {
    let LogMsg::ArrowMsg(store, rows) = message else { return Ok(None) };
    let chunk = Chunk::from_arrow_msg(&rows).map_err(|error| error.to_string())?;
    let path = entity::beside(&chunk.entity_path().to_string());
    let moved = chunk.clone_with_new_entity_path(path.into());
    let rows = moved.to_arrow_msg().map_err(|error| error.to_string())?;
    Ok(Some(LogMsg::ArrowMsg(store, rows)))
}

impl<W: Write + Send + 'static> RrdWriter<W> {
    /// Begins the recording that `builder` describes.
    pub(crate) fn new(
        builder: RecordingStreamBuilder,
        output: W,
        batches: Batches,
    ) -> Result<Self, ExportError> {
        let encoder = Encoder::new_eager(
            rerun::build_info().version,
            rerun::external::re_log_encoding::EncodingOptions::PROTOBUF_COMPRESSED,
            output,
        )
        .map_err(encode_error)?;
        let output = Arc::new(Mutex::new(Output { encoder: Some(encoder), failure: None }));
        let sink = Box::new(Sink { output: Arc::clone(&output), beside: false });
        let recording = stream(builder, batches, sink)?;
        Ok(Self { recording, output })
    }

    /// Another stream into the same recording, whose entities lie beside the first one's (`world/rocket` becomes
    /// `world/beside/rocket`). It needs the builder that this recording began with.
    pub(crate) fn beside(&self, builder: RecordingStreamBuilder) -> Result<RecordingStream, ExportError> {
        let sink = Box::new(Sink { output: Arc::clone(&self.output), beside: true });
        Ok(stream(builder.send_properties(false), Batches::Large, sink)?)
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
            return Err(failure);
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
        let moved = if self.beside { moved_beside(message) } else { Ok(Some(message)) };
        let mut output = locked(&self.output);
        let Output { encoder: Some(encoder), failure } = &mut *output else {
            return;
        };
        if failure.is_some() {
            return;
        }
        match moved {
            Ok(Some(message)) => *failure = encoder.append(&message).err().map(encode_error),
            Ok(None) => {}
            Err(reason) => *failure = Some(ExportError::Encode { reason }),
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

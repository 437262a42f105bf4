//! Identifies a recording among those in the viewer.

use std::path::Path;

use rerun::RecordingStreamBuilder;

use crate::survey::Survey;

/// Recordings of one application share a layout in the viewer, so that a flight and its re-flown version can be
/// compared.
pub(crate) const APPLICATION: &str = "touchdown";

/// The recording's identity: always the same for the same log, and different for different runs.
pub(crate) fn builder(log_name: &str, survey: &Survey) -> RecordingStreamBuilder {
    let stem = Path::new(log_name).file_stem().map_or(log_name.into(), |stem| stem.to_string_lossy());
    let start_ns = survey.start_unix_ns();
    let (kind, kind_in_words) = if survey.run.contains_key("reflown_from") {
        ("reflown", "flown again")
    } else {
        ("recorded", "recorded")
    };
    let id =
        start_ns.map_or_else(|| format!("{kind}-{stem}"), |start_ns| format!("{kind}-{start_ns}-{stem}"));
    let builder = RecordingStreamBuilder::new(APPLICATION)
        .enabled(true)
        .recording_id(id)
        .recording_name(format!("{stem} ({kind_in_words})"))
        .send_properties(true);
    match start_ns.and_then(|start_ns| i64::try_from(start_ns).ok()) {
        Some(start_ns) => builder.recording_started(start_ns),
        None => builder,
    }
}

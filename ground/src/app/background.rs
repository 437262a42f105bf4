//! Files that the station writes outside its run loop.

use protocol::log::recorder::Recorder;

use super::files::LogFiles;

/// A file that a job writes, in order of urgency.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Target {
    /// The unconfirmed abort and the reason to stay away, for the next run.
    Unfinished,
    /// A numbered entry of the checklist's signatures.
    Signature(u64),
    /// The last position of the vehicle with this boot number.
    Position(u32),
    NextLog,
    /// Size and presence of the log's files.
    LogFiles,
}

/// Outcome of a job.
pub(super) enum Outcome {
    Written,
    NotWritten(Target, anyhow::Error),
    LogFiles(LogFiles),
    /// The next log; `None` if no log is wanted.
    NextLog(anyhow::Result<Option<Recorder>>),
}

pub(super) type Background = protocol::background::Background<Target, Outcome>;

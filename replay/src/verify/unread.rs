//! Facts about the unread part of a damaged log, from the end of the file.

use std::path::Path;

use serde::Serialize;

use crate::log::summary_of;

/// The unread part of a damaged log.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Unread {
    /// Ticks or frames that were not read, and their number in the whole file; `None` if the end of the file does not
    /// say.
    pub ticks: Option<(u64, u64)>,
    /// Time from the last record read to the last record of the file, s.
    pub seconds: Option<f64>,
}

impl Unread {
    pub(super) fn of(path: &Path, ticks_read: u64, read_until_ns: Option<u64>) -> Self {
        let summary = summary_of(path);
        let all = summary.as_ref().map(|summary| summary.ticks).filter(|all| *all >= ticks_read);
        let seconds = summary.zip(read_until_ns).and_then(|(summary, until_ns)| {
            Some(summary.last_log_time_ns.checked_sub(until_ns)? as f64 / 1e9)
        });
        Self { ticks: all.map(|all| (all - ticks_read, all)), seconds }
    }
}

//! What a damaged log still says about the part of it that could not be read.

use std::path::Path;

use serde::Serialize;

use crate::log::summary_of;

/// What was not read of a damaged log.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Unread {
    /// Ticks or frames that were not read, and how many the whole file has; `None` if its end does not tell.
    pub ticks: Option<(u64, u64)>,
    /// From the last record read to the last of the file, s.
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

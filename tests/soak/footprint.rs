//! What a process holds of the machine, sampled through hours.

use std::path::{Path, PathBuf};

use e2e::{resident_bytes, status_of};

use crate::SAMPLE_EVERY;

/// Growth of resident memory that is called flat: what the `long` test of `ground` allows for its
/// allocator in nine hours.
pub(crate) const GROWTH_MAX_BYTES: u64 = 1024 * 1024;

/// What a log's recorder keeps until its end: where each chunk is. Five chunks a second take 4 MB
/// an hour (measured).
pub(crate) const LOG_INDEX_BYTES_H: u64 = 5_000_000;
/// What a station keeps besides for screens that are attached later: telemetry, up to 24 MiB of it.
/// Measured: 21 MB an hour with the index of its log, until that bound is reached after about two
/// hours.
pub(crate) const HISTORY_BYTES_H: u64 = 25_000_000;

/// What a process holds at one moment.
#[derive(Debug, Clone, Copy, Default)]
struct Footprint {
    resident_bytes: u64,
    descriptors: u64,
    threads: u64,
    log_bytes: u64,
}

/// A process that lives through the whole run.
pub(crate) struct Watched {
    name: &'static str,
    process: u32,
    log: Option<PathBuf>,
    /// What it may grow by in an hour, bytes, because it keeps something on purpose.
    retained_bytes_h: u64,
    samples: Vec<Footprint>,
}

impl Watched {
    pub(crate) fn new(name: &'static str, process: u32) -> Self {
        Self { name, process, log: None, retained_bytes_h: 0, samples: Vec::new() }
    }

    pub(crate) fn keeping(self, retained_bytes_h: u64) -> Self {
        Self { retained_bytes_h, ..self }
    }

    pub(crate) fn with_log(self, log: PathBuf) -> Self {
        Self { log: Some(log), ..self }
    }

    /// Looks at the process; one that has ended is a problem that `judge` reports.
    pub(crate) fn sample(&mut self) {
        self.samples.extend(footprint(self.process, self.log.as_deref()));
    }

    /// A row of the table, and what is wrong.
    pub(crate) fn judge(&self, expected_samples: usize) -> (String, Vec<String>) {
        let third = self.samples.len() / 3;
        let median = |of: fn(&Footprint) -> u64, part: &[Footprint]| {
            let mut values: Vec<u64> = part.iter().map(of).collect();
            values.sort_unstable();
            values.get(values.len() / 2).copied().unwrap_or(0)
        };
        let (first, middle, last) =
            (&self.samples[..third], &self.samples[third..2 * third], &self.samples[2 * third..]);
        let over = |of: fn(&Footprint) -> u64| [median(of, first), median(of, middle), median(of, last)];
        let (memory, descriptors, threads) =
            (over(|at| at.resident_bytes), over(|at| at.descriptors), over(|at| at.threads));
        let mut wrong = Vec::new();
        if self.samples.len() + 1 < expected_samples {
            wrong.push(format!(
                "{} ended early: {} of {expected_samples} samples",
                self.name,
                self.samples.len()
            ));
        }
        let kept_bytes = self.retained_bytes_h * third as u64 * SAMPLE_EVERY.as_secs() / 3600;
        if memory[2] > memory[1] + GROWTH_MAX_BYTES + kept_bytes {
            wrong.push(format!("{}: memory grew from {} to {} bytes", self.name, memory[1], memory[2]));
        }
        for (what, [_, middle, last]) in [("descriptors", descriptors), ("threads", threads)] {
            if last > middle {
                wrong.push(format!("{}: {what} grew from {middle} to {last}", self.name));
            }
        }
        let mebibytes = memory.map(|bytes| format!("{:.1}", bytes as f64 / 1_048_576.0)).join(" ");
        let log = self.log.as_ref().map_or_else(String::new, |_| self.log_rates());
        let row = format!(
            "| {} | {mebibytes} | {} | {} | {log} |",
            self.name,
            descriptors.map(|count| count.to_string()).join(" "),
            threads.map(|count| count.to_string()).join(" "),
        );
        (row, wrong)
    }

    /// Bytes that the log grew by in each third.
    fn log_rates(&self) -> String {
        let third = self.samples.len() / 3;
        let at = |index: usize| self.samples.get(index).map_or(0, |sample| sample.log_bytes);
        let grown = [(0, third), (third, 2 * third), (2 * third, self.samples.len().saturating_sub(1))]
            .map(|(from, to)| format!("{:.1}", at(to).saturating_sub(at(from)) as f64 / 1e6));
        grown.join(" ")
    }
}

/// `None` if the process is gone.
fn footprint(process: u32, log: Option<&Path>) -> Option<Footprint> {
    Some(Footprint {
        resident_bytes: resident_bytes(process)?,
        descriptors: std::fs::read_dir(format!("/proc/{process}/fd")).ok()?.count() as u64,
        threads: status_of(process, "Threads:")?,
        log_bytes: log.and_then(|log| std::fs::metadata(log).ok()).map_or(0, |file| file.len()),
    })
}

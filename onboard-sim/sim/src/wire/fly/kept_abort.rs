//! An abort on the pad outlives the vehicle's power switch, in a small file: when it was, by the
//! wall clock.

use std::fs;
use std::path::PathBuf;
use std::time::{SystemTime, UNIX_EPOCH};

use crate::wire::vehicle::Vehicle;

pub(super) struct KeptAbort {
    file: Option<PathBuf>,
    /// Whether the file is there.
    kept: bool,
}

impl KeptAbort {
    /// Opens the file, and says how long ago the abort was, s. One that cannot be read was just
    /// now: nobody is told less.
    pub(super) fn open(file: Option<PathBuf>) -> (Self, Option<f64>) {
        let kept = file.as_ref().filter(|file| file.exists());
        let ago_s = kept.map(|file| ago_s(&fs::read_to_string(file).unwrap_or_default(), unix_s()));
        (Self { kept: ago_s.is_some(), file }, ago_s)
    }

    /// Writes the abort of this vehicle, or forgets it when people may have approached. Says if
    /// that fails.
    pub(super) fn keep(&mut self, vehicle: &Vehicle) -> Option<String> {
        let abort_s = vehicle.mode().abort_to_keep_s(vehicle.time_s());
        let file = self.file.as_ref().filter(|_| abort_s.is_some() != self.kept)?;
        self.kept = abort_s.is_some();
        // Complete or absent.
        let beside = file.with_added_extension("new");
        let written = match abort_s.map(|abort_s| unix_s() - (vehicle.time_s() - abort_s)) {
            Some(at_s) => fs::write(&beside, format!("{at_s:.1}\n")).and_then(|()| fs::rename(&beside, file)),
            None => fs::remove_file(file),
        };
        written.err().map(|why| format!("the wait after an abort is not kept: {}: {why}", file.display()))
    }
}

fn ago_s(text: &str, now_s: f64) -> f64 {
    let at_s = text.trim().parse().ok().filter(|at_s: &f64| at_s.is_finite());
    // A clock that was set back ends no wait.
    at_s.map_or(0.0, |at_s| (now_s - at_s).max(0.0))
}

#[expect(
    clippy::disallowed_methods,
    reason = "only the wall clock goes on while the vehicle is off; no flight reads it"
)]
fn unix_s() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |since| since.as_secs_f64())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_abort_is_as_old_as_the_clock_says_and_was_just_now_if_the_file_or_the_clock_is_wrong() {
        let cases = [("980.0\n", 20), ("", 0), ("nonsense", 0), ("NaN", 0), ("inf", 0), ("1000.1", 0)];
        for (text, expected) in cases {
            assert_eq!(ago_s(text, 1_000.0) as u32, expected, "{text}");
        }
    }
}

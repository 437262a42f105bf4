//! Checks whether the controller makes the recorded decisions again, bit for bit.
//!
//! [`verify`] builds the controller from the profile in the log and runs it on every recorded input in tick order. It
//! compares every field of the output, and the digest of the memory, with the record. Measured times are not compared.
//!
//! A log of this release has every frame of the whole flight computer from power-up on. The whole
//! computer is then run again, so self-test, arming, countdown, gate and abort are compared as well. Older logs, and
//! logs of flights that begin at their release, have only ticks from the release on, and the report says so.
//!
//! The controller remembers its plan, so a tick can be re-executed only if every tick before it can be. The comparison
//! ends at a gap, and the report says so.
//!
//! A log joined by other tools may hold several flights; each has its own report. A flight without comparisons is never
//! identical, and a flight whose record ends before the flight did is reported as cut.
//!
//! For a divergence, the report says how it grows from tick to tick. If a whole file is verified, it also says whether
//! the landing would end differently: only for this, the flight is simulated from the first tick that differs.

mod consequence;
mod difference;
mod flight;
mod from_power_up;
mod growth;
mod report;
mod tally;
mod unread;
mod verifier;

pub use consequence::Consequence;
pub use difference::{FieldDifference, FieldValue, differences, ulp_distance};
pub use growth::{Growth, GrowthStep};
pub use report::{FlightPlace, FramesReport, Obstacle, Verification, VerifyReport};
pub use tally::Divergence;
pub use unread::Unread;
pub use verifier::Verifier;

use std::io::Read;
use std::path::Path;

use flight::FlightVerifier;
use protocol::log::reader::Damage;
use report::FileFacts;

use crate::log::{Entry, FlightLog, Flights, Head, LogError, LoggedFlight, Recording};

/// Verifies a log file: one report on each of its flights, or one report if it has none.
///
/// # Errors
/// The file is not a flight log or cannot be read. A log that cannot be replayed is a report, not an error.
pub fn verify(path: &Path) -> Result<Vec<VerifyReport>, LogError> {
    let mut log = FlightLog::open(path)?;
    let mut reports = verify_log(&mut log, || {
        // Another tool may have moved the attachments to the end of the file, after the messages.
        let mut whole = FlightLog::open(path)?;
        while whole.next_entry()?.is_some() {}
        Ok(whole.head().clone())
    })?;
    let read = reports.iter().map(|report| report.ticks_recorded).sum();
    // A recovered log is read to its end; what is lost is not in it.
    let unread = !matches!(log.damage(), Some(Damage::Recovered(_)));
    for report in reports.iter_mut().filter(|report| unread && report.damage.is_some()) {
        report.unread = Some(Unread::of(path, read, log.last_log_time_ns()));
    }
    // A log that is too long to be flown again, or has several flights, has still been compared.
    if let [report] = reports.as_mut_slice()
        && let Some(first) = &report.first_divergence
        && let Ok(recording) = Recording::open(path)
    {
        report.consequence = Some(Consequence::of(&recording, first.tick));
    }
    Ok(reports)
}

/// Verifies a log that is being read. `whole_head` is called for the log's whole head if its first tick comes before
/// its profile.
///
/// # Errors
/// As [`verify`].
pub fn verify_log<R: Read>(
    log: &mut FlightLog<R>,
    whole_head: impl Fn() -> Result<Head, LogError>,
) -> Result<Vec<VerifyReport>, LogError> {
    let mut flights = Flights::default();
    let mut computers: Vec<FlightVerifier> = Vec::new();
    // An unreadable record before the first flight may have been its beginning.
    let mut unreadable = None;
    while let Some(stamped) = log.next_entry()? {
        if flights.note(&stamped.entry) {
            computers.push(FlightVerifier::new(!computers.is_empty(), unreadable.take()));
        }
        let Some(computer) = computers.last_mut() else {
            if let Entry::Unreadable { reason } = stamped.entry {
                unreadable.get_or_insert(reason);
            }
            continue;
        };
        computer.take(stamped, log, &whole_head)?;
    }
    if computers.is_empty() {
        computers.push(FlightVerifier::new(false, unreadable));
    }
    let of = computers.len();
    let mut reports = Vec::new();
    for (place, computer) in computers.into_iter().enumerate() {
        let flight = (of > 1).then_some(FlightPlace { number: place + 1, of });
        let cut = flights.found().get(place).and_then(LoggedFlight::cut);
        // Damage ends the reading, so it belongs to the last flight.
        let damage = log.damage().filter(|_| place + 1 == of).map(ToString::to_string);
        let facts =
            FileFacts { file: log.name().to_owned(), flight, cut, damage, build: log.head().compare_build() };
        reports.push(computer.into_report(facts));
    }
    Ok(reports)
}

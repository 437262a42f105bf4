//! Whether a divergence would change the outcome of the flight.

use serde::Serialize;

use crate::info::VerdictFacts;
use crate::log::Recording;
use crate::refly::{ReflyOptions, StartAt, refly};

/// Whether this build's controller would land differently if it flew from the first tick that differs. This is closed
/// loop, unlike the comparison itself.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Consequence {
    /// The tick from which the flight was flown again.
    pub from_tick: u64,
    /// The recorded verdict.
    pub recorded: Option<VerdictFacts>,
    /// The verdict with this build's controller; `None` if the vehicle does not come down.
    pub reflown: Option<VerdictFacts>,
    /// Whether the verdict changed between landed and not landed; `None` if unknown.
    pub changed: Option<bool>,
    /// Why the flight was not flown again.
    pub obstacle: Option<String>,
}

impl Consequence {
    /// Flies from a tick, or from the beginning of the landing if that comes later.
    pub(super) fn of(recording: &Recording, first_divergence: u64) -> Self {
        let at = |start| refly(recording, &ReflyOptions { start, ..ReflyOptions::default() });
        let flown = at(StartAt::Landing).and_then(|landing| {
            if landing.start.tick >= first_divergence {
                return Ok(landing);
            }
            at(StartAt::Tick(first_divergence))
        });
        match flown {
            Ok(report) => Self {
                from_tick: report.start.tick,
                recorded: report.recorded,
                reflown: report.reflown,
                changed: report.verdict_changed,
                obstacle: None,
            },
            Err(error) => Self {
                from_tick: first_divergence,
                recorded: recording.verdict.as_ref().map(VerdictFacts::of),
                reflown: None,
                changed: None,
                obstacle: Some(error.to_string()),
            },
        }
    }
}

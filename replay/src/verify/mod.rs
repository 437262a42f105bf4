//! Does the controller decide again, bit for bit, what it decided then?
//!
//! [`verify`] builds the controller from the profile in the log, feeds it every recorded input in tick order and
//! compares every field of what it decides (and the digest of what it remembers) with the record. Measured times
//! are not compared.
//!
//! The log of a flight from apogee to touchdown holds frames of the whole flight computer; they are verified in the same
//! way, from what it believed when it was let go.
//!
//! The controller remembers its plan, so a tick can be re-executed only if every tick before it can: at a gap the
//! comparison ends, and the report says so.
//!
//! Of a divergence the report says how it grows from tick to tick, and, when a whole file is verified, whether the
//! landing would end otherwise: for that alone the flight is flown on in simulation from the first tick that differs.

mod consequence;
mod difference;
mod growth;
mod report;
mod tally;
mod verifier;

pub use consequence::Consequence;
pub use difference::{FieldDifference, FieldValue, differences, ulp_distance};
pub use growth::{Growth, GrowthStep};
pub use report::{Divergence, Obstacle, Outcome, VerifyReport};
pub use verifier::Verifier;

use std::io::Read;
use std::path::Path;

use flight::profile::Profile;

use tally::Tally;

use crate::controller::{LoggedController, LoggedPilot, PilotStartError, settings_in_flight};
use crate::log::{Entry, FlightLog, FrameOrder, Gap, Head, LogError, Ordered, Recording, TickOrder};

/// Verifies a log file.
///
/// # Errors
/// The file is not a flight log or cannot be read. A log that cannot be replayed is a report, not an error.
pub fn verify(path: &Path) -> Result<VerifyReport, LogError> {
    let mut log = FlightLog::open(path)?;
    let mut report = verify_log(&mut log, || {
        // Another tool may have moved the attachments behind the messages.
        let mut whole = FlightLog::open(path)?;
        while whole.next_entry()?.is_some() {}
        Ok(whole.head().clone())
    })?;
    // A log too long to fly on from has been compared all the same.
    if let Some(first) = &report.first_divergence
        && let Ok(recording) = Recording::open(path)
    {
        report.consequence = Some(Consequence::of(&recording, first.tick));
    }
    Ok(report)
}

/// Verifies a log that is being read. `whole_head` is asked for the log's whole head if its first tick comes
/// before its profile.
///
/// # Errors
/// As [`verify`].
pub fn verify_log<R: Read>(
    log: &mut FlightLog<R>,
    whole_head: impl Fn() -> Result<Head, LogError>,
) -> Result<VerifyReport, LogError> {
    let mut order = TickOrder::new();
    let mut verifier = None;
    let mut pilot = None;
    let mut found = Found::default();
    let mut frame_order = FrameOrder::default();
    while let Some(stamped) = log.next_entry()? {
        match stamped.entry {
            Entry::Tick(tick) => {
                found.ticks += 1;
                if found.obstacle.is_some() {
                    continue;
                }
                if verifier.is_none() {
                    match controller_of(log, &whole_head)? {
                        Ok(controller) => verifier = Some(Verifier::new(controller)),
                        Err(obstacle) => found.obstacle = Some(obstacle),
                    }
                }
                if let Some(Ordered::Repeated { tick }) = order.push(tick) {
                    found.obstacle.get_or_insert(Obstacle::Repeated { tick });
                }
                found.advance(&mut order, verifier.as_mut(), false);
            }
            Entry::PilotStart(start) => match text_of(log, &whole_head)? {
                Ok(mission) => {
                    let in_flight = settings_in_flight(&log.head().run).map_err(PilotStartError::from);
                    match in_flight.and_then(|settings| LoggedPilot::new(&mission, &start, &settings)) {
                        Ok(controller) => pilot = Some(Verifier::new(controller)),
                        Err(error) => {
                            found.obstacle = Some(Obstacle::ProfileUnreadable { reason: error.to_string() });
                        }
                    }
                }
                Err(obstacle) => found.obstacle = Some(obstacle),
            },
            Entry::PilotTick(tick) => {
                found.ticks += 1;
                let lost = frame_order.note(tick.input.frame, stamped.sequence);
                if found.obstacle.is_none() {
                    found.obstacle = match (lost, &mut pilot) {
                        (_, None) => Some(Obstacle::NoStart),
                        (Some(Gap { after: 0, before }), _) => {
                            Some(Obstacle::BeginningMissing { first: before })
                        }
                        (Some(Gap { after, before }), _) => Some(Obstacle::Gap { after, before }),
                        (None, Some(pilot)) => pilot.check(&tick).err().map(Obstacle::Frame),
                    };
                }
            }
            Entry::Unreadable { reason } => {
                found.unreadable.get_or_insert(reason);
            }
            _ => {}
        }
    }
    found.advance(&mut order, verifier.as_mut(), true);
    // One flight has one computer; its frames stand for the ticks inside them.
    let tally = pilot.map(|pilot| pilot.tally).or(verifier.map(|verifier| verifier.tally));
    Ok(found.into_report(log, tally))
}

/// What came up on the way through a log.
#[derive(Default)]
struct Found {
    ticks: u64,
    obstacle: Option<Obstacle>,
    unreadable: Option<String>,
}

impl Found {
    /// Compares every tick whose turn it is.
    fn advance(
        &mut self,
        order: &mut TickOrder,
        verifier: Option<&mut Verifier<LoggedController>>,
        at_end: bool,
    ) {
        let Some(verifier) = verifier else {
            return;
        };
        while self.obstacle.is_none()
            && let Some(next) = order.pop(at_end)
        {
            match next {
                Ordered::Tick(tick) => {
                    self.obstacle = verifier.check(&tick).err().map(Obstacle::Input);
                }
                Ordered::Missing { from: 0, next } => {
                    self.obstacle = Some(Obstacle::BeginningMissing { first: next });
                }
                Ordered::Missing { from, next } => {
                    self.obstacle = Some(Obstacle::Gap { after: from - 1, before: next });
                }
                Ordered::Repeated { tick } => self.obstacle = Some(Obstacle::Repeated { tick }),
            }
        }
    }

    fn into_report<R: Read>(self, log: &FlightLog<R>, tally: Option<Tally>) -> VerifyReport {
        let obstacle = match (self.obstacle, self.unreadable) {
            // An unreadable tick leaves a gap; what made it unreadable says more than the gap.
            (None | Some(Obstacle::Gap { .. } | Obstacle::BeginningMissing { .. }), Some(reason)) => {
                Some(Obstacle::Unreadable { reason })
            }
            (None, None) if self.ticks == 0 => Some(Obstacle::NoTicks),
            (obstacle, _) => obstacle,
        };
        VerifyReport::new(
            log.name().to_owned(),
            self.ticks,
            tally,
            obstacle,
            log.damage().map(ToString::to_string),
            log.head().compare_build(),
        )
    }
}

fn controller_of<R: Read>(
    log: &FlightLog<R>,
    whole_head: &impl Fn() -> Result<Head, LogError>,
) -> Result<Result<LoggedController, Obstacle>, LogError> {
    Ok(text_of(log, whole_head)?.and_then(|text| {
        let unreadable = |reason: String| Obstacle::ProfileUnreadable { reason };
        let profile =
            Profile::from_toml(&text, "profile.toml").map_err(|error| unreadable(error.to_string()))?;
        LoggedController::recorded(&profile, &text, &log.head().run)
            .map_err(|error| unreadable(error.to_string()))
    }))
}

fn text_of<R: Read>(
    log: &FlightLog<R>,
    whole_head: &impl Fn() -> Result<Head, LogError>,
) -> Result<Result<String, Obstacle>, LogError> {
    let found = match &log.head().profile_toml {
        Some(found) => Some(found.clone()),
        None => whole_head()?.profile_toml,
    };
    Ok(match found {
        None => Err(Obstacle::NoProfile),
        Some(Err(error)) => Err(Obstacle::ProfileUnreadable { reason: error.to_string() }),
        Some(Ok(text)) => Ok(text),
    })
}

//! The report of a verification.

use serde::Serialize;

use super::consequence::Consequence;
use super::growth::Growth;
use super::tally::{Divergence, Tally};
use super::unread::Unread;
use crate::controller::FrameError;
use crate::log::{BuildComparison, Cut};

/// The result of a verification.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verification {
    /// The flight is whole, has ticks, and every tick is identical.
    Identical,
    /// The log is damaged or ends before its flight did, and every tick that could be read is identical.
    IdenticalReadablePart,
    /// Some tick differs.
    Diverged,
    /// Some tick could not be re-executed, and all others are identical.
    NotReplayable,
}

/// Why ticks were not compared.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Obstacle {
    /// No tick in the log.
    #[error(
        "it has no frames of a flight computer that this build knows: replay needs the log of the vehicle or of the demonstration, not of a ground station"
    )]
    NoTicks,
    /// No profile in the log.
    #[error("it has no attachment profile.toml, and without the profile the controller cannot be built")]
    NoProfile,
    /// This build cannot use the profile in the log.
    #[error("its profile cannot be used by this build: {reason}")]
    ProfileUnreadable {
        /// What is wrong with the profile.
        reason: String,
    },
    /// The log does not begin with the first tick.
    #[error(
        "it begins with tick {first}, and the ticks before it are missing: what the controller remembered then is unknown"
    )]
    BeginningMissing {
        /// The first tick in the log.
        first: u64,
    },
    /// Ticks are missing.
    #[error(
        "after tick {after} comes tick {before}: what the controller remembered there is unknown, and nothing behind the gap was compared"
    )]
    Gap {
        /// The last tick before the gap.
        after: u64,
        /// The first tick after the gap.
        before: u64,
    },
    /// A tick is recorded twice.
    #[error(
        "tick {tick} is recorded twice, as if two controllers had written: nothing behind it was compared"
    )]
    Repeated {
        /// Its number.
        tick: u64,
    },
    /// Frames of the flight computer are missing.
    #[error(
        "after frame {after} of the flight computer comes frame {before}: what it remembered there is unknown, and nothing after the gap was compared"
    )]
    FramesLost {
        /// The last frame before the gap.
        after: u64,
        /// The first after it.
        before: u64,
    },
    /// A tick was computed and is not in the log.
    #[error("the flight computer made tick {tick}, and the log has lost its record")]
    TickLost { tick: u64 },
    /// A recorded tick belongs to no frame of the flight computer.
    #[error("tick {tick} belongs to no frame of the flight computer that was run again")]
    TickWithoutFrame { tick: u64 },
    /// A record cannot be read.
    #[error("a record cannot be read: {reason}")]
    Unreadable { reason: String },
    /// A flight computer was released, and none of its frames follow.
    #[error("it has a record /pilot/start and no frame of the flight computer behind it")]
    NoFrames,
    /// There are frames of a flight computer, and no record of its release.
    #[error("it has frames of the flight computer and no record /pilot/start before them to begin from")]
    NoStart,
    /// A frame cannot be given to this build's flight computer.
    #[error("{0}")]
    Frame(#[from] FrameError),
}

/// As text.
impl Serialize for Obstacle {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// Result of comparing the flight computer's frames.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FramesReport {
    /// Frames that could be read.
    pub recorded: u64,
    /// Frames that were run again and compared.
    pub compared: u64,
    /// Frames that differ.
    pub different: u64,
    /// The first frame that differs.
    pub first_divergence: Option<Divergence>,
    /// Vehicle time of the last frame that was compared, s.
    pub until_s: Option<f64>,
}

/// The place of a flight in a log that holds several.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct FlightPlace {
    /// Its number, from 1.
    pub number: usize,
    /// Number of flights.
    pub of: usize,
}

/// Facts about a flight's record besides its ticks.
pub(super) struct FileFacts {
    pub(super) file: String,
    pub(super) flight: Option<FlightPlace>,
    pub(super) cut: Option<Cut>,
    pub(super) damage: Option<String>,
    pub(super) build: BuildComparison,
}

/// The report on one flight.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VerifyReport {
    /// The log.
    pub file: String,
    /// The place of the flight, if the log holds several.
    pub flight: Option<FlightPlace>,
    /// The result of a verification.
    pub outcome: Verification,
    /// The frames of the flight computer from power-up on; `None` if the log has none, so that only its ticks were
    /// compared.
    pub frames: Option<FramesReport>,
    /// Whether digests of the computer's memory were compared as well. Digests of another schema are not compared.
    pub digests_compared: bool,
    /// Ticks that could be read.
    pub ticks_recorded: u64,
    /// Ticks that were re-executed and compared.
    pub ticks_compared: u64,
    /// Ticks identical in every bit.
    pub ticks_identical: u64,
    pub ticks_different: u64,
    /// Fields that differ, over all ticks.
    pub fields_different: u64,
    /// The first and the last tick compared.
    pub span: Option<(u64, u64)>,
    /// Vehicle time from the first tick compared to the last, s.
    pub flight_s: Option<f64>,
    /// The first tick that differs.
    pub first_divergence: Option<Divergence>,
    /// How the divergence grows.
    pub growth: Option<Growth>,
    /// Whether the landing would end differently; only for whole files.
    pub consequence: Option<Consequence>,
    /// Why not every tick was compared.
    pub obstacle: Option<Obstacle>,
    /// Where the record ends, if that is before the end of the flight.
    pub cut: Option<Cut>,
    /// Why the log could not be read to its end.
    pub damage: Option<String>,
    /// The part that was not read because of the damage; only for files.
    pub unread: Option<Unread>,
    /// Comparison of the build that wrote the log with this one.
    pub build: BuildComparison,
}

impl VerifyReport {
    pub(super) fn new(
        facts: FileFacts,
        (ticks_recorded, counts): (u64, Tally),
        frames: Option<FramesReport>,
        obstacle: Option<Obstacle>,
    ) -> Self {
        let (first_divergence, growth) = (counts.divergence, counts.growth);
        let FileFacts { file, flight, cut, damage, build } = facts;
        let frame_differs = frames.as_ref().is_some_and(|frames| frames.different > 0);
        let outcome = if first_divergence.is_some() || frame_differs {
            Verification::Diverged
        } else if obstacle.is_some() {
            Verification::NotReplayable
        } else if damage.is_some() || cut.is_some() {
            Verification::IdenticalReadablePart
        } else {
            Verification::Identical
        };
        Self {
            file,
            flight,
            outcome,
            frames,
            digests_compared: true,
            ticks_recorded,
            ticks_compared: counts.ticks,
            ticks_identical: counts.ticks - counts.ticks_different,
            ticks_different: counts.ticks_different,
            fields_different: counts.fields_different,
            span: counts.first.zip(counts.last).map(|(first, last)| (first.tick, last.tick)),
            flight_s: counts.first.zip(counts.last).map(|(first, last)| last.time_s - first.time_s),
            growth: first_divergence.is_some().then_some(growth),
            first_divergence,
            consequence: None,
            obstacle,
            cut,
            damage,
            unread: None,
            build,
        }
    }
}

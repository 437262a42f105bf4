//! Counts the frames of a flight computer and finds which of them can be re-executed.

use protocol::log::flight_v1::PilotTiming;
use serde::Serialize;

use super::solve_times::SolveTimeCounter;
use super::{Grade, GradeLevel, ProfileFacts, SolveTimes};
use crate::log::{FrameOrder, Gap, TickRanges};

/// The frames of the flight computer.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FrameFacts {
    /// The lowest number.
    pub first: u64,
    /// The highest number.
    pub last: u64,
    /// Ranges of numbers left out because the computer was dead.
    pub restarts: usize,
    /// Ranges that the log has lost.
    pub lost: usize,
    /// The first lost range: no frame after it can be re-executed.
    pub first_lost: Option<Gap>,
    pub repeated: u64,
    /// Whether the log has the computer's start record.
    pub start: bool,
    /// Solve times of the planning frames; `None` for a flight simulated without a clock.
    pub solve_time: Option<SolveTimes>,
}

/// Counts frames.
#[derive(Debug, Default)]
pub(super) struct FrameCounter {
    frames: TickRanges,
    order: FrameOrder,
    lost: usize,
    first_lost: Option<Gap>,
    solve_times: SolveTimeCounter,
    /// Notes the start record of the flight computer.
    start: bool,
}

impl FrameCounter {
    pub(super) fn let_go(&mut self) {
        self.start = true;
    }

    /// Counts a frame; `record` is the sequence number of its record in the channel.
    pub(super) fn count(&mut self, frame: u64, record: u32) {
        self.frames.insert(frame);
        if let Some(gap) = self.order.note(frame, record) {
            self.lost += 1;
            self.first_lost.get_or_insert(gap);
        }
    }

    pub(super) fn time(&mut self, timing: &PilotTiming) {
        self.solve_times.count(timing.solve_time_s, timing.deadline_s);
    }

    pub(super) fn into_facts(self) -> Option<FrameFacts> {
        let (first, last) = self.frames.bounds()?;
        // A loss before the first frame is not a gap between frames.
        let lost_between = self.lost - usize::from(self.first_lost.is_some_and(|gap| gap.after == 0));
        Some(FrameFacts {
            first,
            last,
            restarts: self.frames.gaps().count().saturating_sub(lost_between),
            lost: self.lost,
            first_lost: self.first_lost,
            repeated: self.frames.repeated(),
            start: self.start,
            solve_time: self.solve_times.into_facts(),
        })
    }
}

impl Grade {
    pub(super) fn of_frames(frames: &FrameFacts, profile: Option<&ProfileFacts>) -> Self {
        let numeric = |why: &str| Self { level: GradeLevel::Numeric, reason: format!("frames, but {why}") };
        match profile {
            _ if !frames.start => numeric("no start record of the flight computer"),
            None => numeric("no attachment profile.toml to build the flight computer from"),
            Some(ProfileFacts { problem: Some(problem), .. }) => numeric(problem),
            Some(ProfileFacts { name, .. }) => {
                Self::of_replayable_frames(frames, name.as_deref().unwrap_or_default())
            }
        }
    }

    /// The grade of a log whose frames can be executed again up to the first loss.
    fn of_replayable_frames(frames: &FrameFacts, mission: &str) -> Self {
        let FrameFacts { first, last, restarts, lost, first_lost, repeated, .. } = frames;
        let level = GradeLevel::BitExact;
        let reason = match first_lost {
            Some(Gap { after: 0, before }) => {
                let reason =
                    format!("frames, but they begin with frame {before}, and those before it are lost");
                return Self { level: GradeLevel::Numeric, reason };
            }
            Some(Gap { after, before }) => {
                let more = if *lost > 1 { format!(", the first of {lost} gaps") } else { String::new() };
                format!(
                    "up to frame {after} of {last}: those up to frame {before} are lost{more}, and nothing after them can be run again; mission {mission}"
                )
            }
            None if *repeated > 0 => format!(
                "frames {first} to {last} of the flight computer up to the first that is there twice; mission {mission}"
            ),
            None => {
                let restarted = match restarts {
                    0 => String::new(),
                    1 => ", restarted once".to_owned(),
                    times => format!(", restarted {times} times"),
                };
                format!(
                    "frames {first} to {last} of the flight computer{restarted}, its start and its mission {mission}"
                )
            }
        };
        Self { level, reason }
    }
}

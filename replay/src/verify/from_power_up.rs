//! Runs a flight computer again from power-up on, and compares its frames and its ticks.
//!
//! A log holds the decision of a frame twice: in the frame itself, and in the tick of the pilot, which the other tools
//! read. Both are compared with the same run of the computer. They are matched by
//! their numbers, because another tool may have sorted the records.

use std::collections::BTreeMap;

use protocol::log::computer_v1;
use protocol::log::flight_v1::PilotTick;

use super::report::{FramesReport, Obstacle};
use super::tally::Tally;
use super::verifier::Verifier;
use crate::controller::{LoggedComputer, LoggedPilot, Replayed as _};
use crate::log::{FrameOrder, Gap};

/// The flight computer being run again.
pub(super) struct FromPowerUp {
    verifier: Verifier<LoggedComputer>,
    order: FrameOrder,
    recorded: u64,
    ticks: Tally,
    /// Ticks that were computed again and whose records have not been read yet.
    made: BTreeMap<u64, PilotTick>,
    /// Recorded ticks whose frames have not been read yet.
    waiting: BTreeMap<u64, PilotTick>,
    last_compared: Option<u64>,
    obstacle: Option<Obstacle>,
}

impl FromPowerUp {
    pub(super) fn new(computer: LoggedComputer, order: FrameOrder) -> Self {
        Self {
            verifier: Verifier::new(computer),
            order,
            recorded: 0,
            ticks: Tally::default(),
            made: BTreeMap::new(),
            waiting: BTreeMap::new(),
            last_compared: None,
            obstacle: None,
        }
    }

    /// Whether every frame so far was run again.
    pub(super) fn is_unbroken(&self) -> bool {
        self.obstacle.is_none()
    }

    /// Takes a frame; `sequence` is the sequence number of its record in the channel.
    pub(super) fn take_frame(&mut self, frame: &computer_v1::ComputerFrame, sequence: u32) {
        self.recorded += 1;
        let lost = self.order.note(frame.input.frame, sequence);
        if self.obstacle.is_some() {
            return;
        }
        self.obstacle = match lost {
            Some(Gap { after, before }) => Some(Obstacle::FramesLost { after, before }),
            None => self.verifier.check(frame).err().map(Obstacle::Frame),
        };
        if self.obstacle.is_none()
            && let Some(made) = self.verifier.controller().pilot_tick()
        {
            match self.waiting.remove(&made.input.frame) {
                Some(recorded) => self.compare(&recorded, &made),
                None => {
                    self.made.insert(made.input.frame, made);
                }
            }
        }
    }

    /// Takes a recorded tick.
    pub(super) fn take_tick(&mut self, recorded: PilotTick) {
        let number = recorded.input.frame;
        match self.made.remove(&number) {
            Some(made) => self.compare(&recorded, &made),
            None if self.last_compared.is_some_and(|last| number <= last) => {
                self.obstacle.get_or_insert(Obstacle::Repeated { tick: number });
            }
            None => {
                if self.waiting.insert(number, recorded).is_some() {
                    self.obstacle.get_or_insert(Obstacle::Repeated { tick: number });
                }
            }
        }
    }

    fn compare(&mut self, recorded: &PilotTick, made: &PilotTick) {
        self.last_compared = self.last_compared.max(Some(recorded.input.frame));
        self.ticks.compare::<LoggedPilot>(LoggedPilot::descriptor().as_ref(), recorded, made);
    }

    /// The compared ticks, the report on the frames, and why not all of them were compared. `whole`: the log was read
    /// to its end.
    pub(super) fn finish(mut self, whole: bool) -> (Tally, FramesReport, Option<Obstacle>) {
        if whole {
            // A tick that was computed and is missing in the log, although a later tick is there.
            let lost = self.made.keys().find(|tick| self.last_compared > Some(**tick));
            let alone = self.waiting.keys().next();
            let missing = lost.map(|tick| Obstacle::TickLost { tick: *tick });
            let missing = missing.or(alone.map(|tick| Obstacle::TickWithoutFrame { tick: *tick }));
            self.obstacle = self.obstacle.or(missing);
        }
        let frames = self.verifier.tally;
        let report = FramesReport {
            recorded: self.recorded,
            compared: frames.ticks,
            different: frames.ticks_different,
            first_divergence: frames.divergence,
            until_s: frames.last.map(|last| last.time_s),
        };
        (self.ticks, report, self.obstacle)
    }
}

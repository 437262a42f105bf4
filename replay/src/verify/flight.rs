//! Verifies one flight of a log, record by record.

use std::io::Read;

use protocol::log::record::SCHEMA_VERSION;

use super::from_power_up::FromPowerUp;
use super::report::{FileFacts, Obstacle, VerifyReport};
use super::verifier::Verifier;
use crate::controller::{LoggedComputer, LoggedPilot};
use crate::log::{Entry, FlightLog, FrameOrder, Gap, Head, LogError, StampedEntry};

/// One flight being verified.
pub(super) struct FlightVerifier {
    /// The whole flight computer, if the log begins at its power-up.
    from_power_up: Option<FromPowerUp>,
    digests_compared: bool,
    frame_order: FrameOrder,
    pilot: Option<Verifier<LoggedPilot>>,
    ticks: u64,
    obstacle: Option<Obstacle>,
    /// Why some record could not be read.
    unreadable: Option<String>,
}

impl FlightVerifier {
    /// A flight before its first record. `behind_another`: another flight comes before it in the log. `unreadable`: why
    /// a record that may have been its beginning could not be read.
    pub(super) fn new(behind_another: bool, unreadable: Option<String>) -> Self {
        Self {
            from_power_up: None,
            digests_compared: true,
            frame_order: if behind_another { FrameOrder::behind_another() } else { FrameOrder::default() },
            pilot: None,
            ticks: 0,
            obstacle: None,
            unreadable,
        }
    }

    /// Takes a record of the flight.
    pub(super) fn take<R: Read>(
        &mut self,
        stamped: StampedEntry,
        log: &FlightLog<R>,
        whole_head: &impl Fn() -> Result<Head, LogError>,
    ) -> Result<(), LogError> {
        match stamped.entry {
            Entry::ComputerStart(start) => match text_of(log, whole_head)? {
                Ok(toml) => match LoggedComputer::recorded(&toml, &start, &log.head().run) {
                    Ok(computer) => {
                        self.from_power_up = Some(FromPowerUp::new(computer, self.frame_order));
                    }
                    Err(error) => {
                        self.obstacle = Some(Obstacle::ProfileUnreadable { reason: error.to_string() });
                    }
                },
                Err(obstacle) => self.obstacle = Some(obstacle),
            },
            Entry::ComputerFrame(frame) => {
                if let Some(computer) = &mut self.from_power_up {
                    computer.take_frame(&frame, stamped.sequence);
                }
            }
            Entry::PilotTick(tick) if self.pilot.is_none() && self.from_power_up.is_some() => {
                self.ticks += 1;
                if let Some(computer) = &mut self.from_power_up {
                    computer.take_tick(*tick);
                }
            }
            // The pilot needs no run of its own. If frames before the release were lost, it is run again from here.
            Entry::PilotStart(_) if self.from_power_up.as_ref().is_some_and(FromPowerUp::is_unbroken) => {}
            Entry::PilotStart(start) => match text_of(log, whole_head)? {
                Ok(mission) => match LoggedPilot::recorded(&mission, &start, &log.head().run, &[]) {
                    Ok(controller) if log.head().schema_version() == SCHEMA_VERSION => {
                        self.pilot = Some(Verifier::new(controller));
                    }
                    Ok(controller) => {
                        self.pilot = Some(Verifier::new(controller.without_digests()));
                        self.digests_compared = false;
                    }
                    Err(error) => {
                        self.obstacle = Some(Obstacle::ProfileUnreadable { reason: error.to_string() });
                    }
                },
                Err(obstacle) => self.obstacle = Some(obstacle),
            },
            Entry::PilotTick(tick) => {
                self.ticks += 1;
                let lost = self.frame_order.note(tick.input.frame, stamped.sequence);
                if self.obstacle.is_none() {
                    self.obstacle = match (lost, &mut self.pilot) {
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
                self.unreadable.get_or_insert(reason);
            }
            _ => {}
        }
        Ok(())
    }

    pub(super) fn into_report(mut self, facts: FileFacts) -> VerifyReport {
        let let_go = self.pilot.is_some();
        let by_ticks = self.pilot.map(|pilot| pilot.tally);
        let (mut tally, mut frames) = (by_ticks.clone().unwrap_or_default(), None);
        if let Some(computer) = self.from_power_up {
            let (ticks, report, obstacle) = computer.finish(facts.damage.is_none());
            if by_ticks.is_none() {
                tally = ticks;
            }
            frames = Some(report);
            self.obstacle = self.obstacle.or(obstacle);
        }
        let compared = tally.ticks + frames.as_ref().map_or(0, |frames| frames.compared);
        let obstacle = match (self.obstacle, self.unreadable) {
            // An unreadable tick leaves a gap; the reason why it is unreadable says more than the gap.
            (
                None
                | Some(Obstacle::Gap { .. } | Obstacle::FramesLost { .. } | Obstacle::BeginningMissing { .. }),
                Some(reason),
            ) => Some(Obstacle::Unreadable { reason }),
            // If nothing was compared, the result must not be "identical".
            (None, None) if compared == 0 && let_go => Some(Obstacle::NoFrames),
            (None, None) if compared == 0 => Some(Obstacle::NoTicks),
            (obstacle, _) => obstacle,
        };
        VerifyReport {
            digests_compared: self.digests_compared,
            ..VerifyReport::new(facts, (self.ticks, tally), frames, obstacle)
        }
    }
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

//! Verifies one flight of a log, record by record.

use std::io::Read;

use protocol::log::record::SCHEMA_VERSION;

use super::from_power_up::{FromPowerUp, Tick};
use super::report::{FileFacts, Obstacle, VerifyReport};
use super::verifier::Verifier;
use crate::controller::{LoggedComputer, LoggedController, LoggedPilot};
use crate::log::{Entry, FlightLog, FrameOrder, Gap, Head, LogError, Ordered, StampedEntry, TickOrder};
use crate::settings::explained;

/// One flight being verified.
pub(super) struct FlightVerifier {
    /// The whole flight computer, if the log begins at its power-up.
    from_power_up: Option<FromPowerUp>,
    digests_compared: bool,
    order: TickOrder,
    frame_order: FrameOrder,
    verifier: Option<Verifier<LoggedController>>,
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
            order: TickOrder::new(),
            frame_order: if behind_another { FrameOrder::behind_another() } else { FrameOrder::default() },
            verifier: None,
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
            Entry::Tick(tick) if self.from_power_up.is_some() => {
                self.ticks += 1;
                if let Some(computer) = &mut self.from_power_up {
                    computer.take_tick(Tick::Plane(tick));
                }
            }
            Entry::PilotTick(tick) if self.pilot.is_none() && self.from_power_up.is_some() => {
                self.ticks += 1;
                if let Some(computer) = &mut self.from_power_up {
                    computer.take_tick(Tick::Space(tick));
                }
            }
            // The pilot needs no run of its own. If frames before the release were lost, it is run again from here.
            Entry::PilotStart(_) if self.from_power_up.as_ref().is_some_and(FromPowerUp::is_unbroken) => {}
            Entry::Tick(tick) => {
                self.ticks += 1;
                if self.obstacle.is_some() {
                    return Ok(());
                }
                if self.verifier.is_none() {
                    match controller_of(log, whole_head)? {
                        Ok(controller) => self.verifier = Some(Verifier::new(controller)),
                        Err(obstacle) => self.obstacle = Some(obstacle),
                    }
                }
                if let Some(Ordered::Repeated { tick }) = self.order.push(tick) {
                    self.obstacle.get_or_insert(Obstacle::Repeated { tick });
                }
                self.advance(false);
            }
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

    /// Compares every tick that is next in order.
    fn advance(&mut self, at_end: bool) {
        let Some(verifier) = &mut self.verifier else {
            return;
        };
        while self.obstacle.is_none()
            && let Some(next) = self.order.pop(at_end)
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

    pub(super) fn into_report(mut self, facts: FileFacts) -> VerifyReport {
        self.advance(true);
        let let_go = self.pilot.is_some();
        let by_ticks = self.pilot.map(|pilot| pilot.tally).or(self.verifier.map(|verifier| verifier.tally));
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

fn controller_of<R: Read>(
    log: &FlightLog<R>,
    whole_head: &impl Fn() -> Result<Head, LogError>,
) -> Result<Result<LoggedController, Obstacle>, LogError> {
    Ok(text_of(log, whole_head)?.and_then(|text| {
        let unreadable = |reason: String| Obstacle::ProfileUnreadable { reason };
        let profile = vehicles::profile::from_toml(&text, "profile.toml")
            .map_err(|error| unreadable(explained(&error.to_string())))?;
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

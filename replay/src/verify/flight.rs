//! Verifies one flight of a log, record by record.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;

use protocol::log::computer_v1;
use protocol::log::flight_v1::PilotTick;
use protocol::log::record::SCHEMA_VERSION;
use serde::Serialize;

use super::Verifier;
use super::difference::Tally;
use super::{FileFacts, FramesReport, Obstacle, VerifyReport};
use crate::controller::{LoggedComputer, LoggedPilot, Replayed as _};
use crate::info::VerdictFacts;
use crate::log::{Entry, FlightLog, FrameOrder, Gap, Head, LogError, Recording, StampedEntry, summary_of};
use crate::refly::{ReflyOptions, StartAt, refly};

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

/// The unread part of a damaged log.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Unread {
    /// Ticks or frames that were not read, and their number in the whole file; `None` if the end of the file does not
    /// say.
    pub ticks: Option<(u64, u64)>,
    /// Time from the last record read to the last record of the file, s.
    pub seconds: Option<f64>,
}

impl Unread {
    pub(super) fn of(path: &Path, ticks_read: u64, read_until_ns: Option<u64>) -> Self {
        let summary = summary_of(path);
        let all = summary.as_ref().map(|summary| summary.ticks).filter(|all| *all >= ticks_read);
        let seconds = summary.zip(read_until_ns).and_then(|(summary, until_ns)| {
            Some(summary.last_log_time_ns.checked_sub(until_ns)? as f64 / 1e9)
        });
        Self { ticks: all.map(|all| (all - ticks_read, all)), seconds }
    }
}

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

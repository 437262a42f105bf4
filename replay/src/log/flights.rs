//! Separates the flights of a log: where each begins, and whether it was recorded to its end.
//!
//! A log normally has one flight. A log joined by other tools has several, and a log cut by a tool may end in the
//! middle of its flight although every checksum is right. A flight begins with its record `/computer/start`. If the log
//! has none, a flight begins with `/pilot/start`. Each flight ends with its verdict.

use std::fmt;

use flight::computer::FRAME_S;
use flight::rules::phase::Phase;
use serde::Serialize;

use super::{Clock, ClockTime, Entry};

/// Tolerance for rounding: times are sums of periods.
const ROUNDING_S: f64 = 1e-6;

/// A flight of a log.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LoggedFlight {
    /// Frames from the release on.
    pub ticks: u64,
    /// Vehicle time, s, and phase of the latest of them.
    last: Option<(f64, u32)>,
    /// The latest frame of the flight computer since power-up: its time, s, and phase.
    on_the_pad: Option<(f64, u32)>,
    /// Time of contact in the verdict, s.
    contact_s: Option<f64>,
}

/// Where an incomplete record of a flight ends.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Cut {
    /// Time of the last tick on its clock, s.
    pub time_s: f64,
    /// The clock: a log that ends before the release has no T+.
    pub clock: Clock,
    pub phase: &'static str,
    /// It ends before the vehicle left its pad.
    pub on_pad: bool,
    /// Time of contact in the verdict, s, if the verdict is there and only ticks are missing.
    pub contact_s: Option<f64>,
}

impl fmt::Display for Cut {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { time_s, clock, phase, on_pad, contact_s } = self;
        let place = if *on_pad { "on the pad, " } else { "" };
        let time = ClockTime { clock: *clock, time_s: *time_s };
        write!(formatter, "ends {place}at {time} in {phase}, ")?;
        match contact_s {
            Some(contact_s) => write!(formatter, "before its contact at T+{contact_s:.3} s"),
            None => write!(formatter, "without a verdict"),
        }
    }
}

impl LoggedFlight {
    fn note(&mut self, time_s: f64, phase: u32) {
        self.ticks += 1;
        // Ticks in the file may be slightly out of order.
        if self.last.is_none_or(|(last_s, _)| last_s <= time_s) {
            self.last = Some((time_s, phase));
        }
    }

    /// Where the record ends, if that is before the end of the flight; `None` also for a flight without ticks.
    pub fn cut(&self) -> Option<Cut> {
        let flown = self.last.map(|last| (last, Clock::Flight));
        let ((time_s, phase), clock) = flown.or(self.on_the_pad.map(|last| (last, Clock::Boot)))?;
        let reached = self.contact_s.is_some_and(|contact_s| contact_s - time_s <= FRAME_S + ROUNDING_S);
        let phase = u8::try_from(phase).ok().and_then(Phase::from_index);
        (!reached).then_some(Cut {
            time_s,
            clock,
            phase: phase.map_or("an unknown phase", Phase::name),
            on_pad: clock == Clock::Boot && phase.is_some_and(Phase::on_pad),
            contact_s: self.contact_s,
        })
    }
}

/// Separates flights while the records of a log are read.
#[derive(Debug, Clone, Default)]
pub struct Flights {
    found: Vec<LoggedFlight>,
    /// The last flight began with the power-up of its flight computer.
    powered_up: bool,
}

impl Flights {
    /// Notes a record. Returns whether a flight begins with it.
    pub fn note(&mut self, entry: &Entry) -> bool {
        let before = self.found.len();
        match entry {
            Entry::ComputerStart(_) => {
                self.begin();
                self.powered_up = true;
            }
            Entry::ComputerFrame(frame) => {
                if let Some(flight) = self.found.last_mut().filter(|_| self.powered_up) {
                    flight.on_the_pad = Some((frame.input.time_s, frame.output.phase));
                }
            }
            // If the log has the power-up of this flight computer, its release does not begin another flight.
            Entry::PilotStart(_)
                if self.powered_up && self.found.last().is_some_and(|flight| flight.ticks == 0) => {}
            Entry::PilotStart(_) => self.begin(),
            Entry::PilotTick(tick) => {
                // The start may be lost.
                if self.found.is_empty() {
                    self.begin();
                }
                if let Some(flight) = self.found.last_mut() {
                    flight.note(tick.input.time_s, tick.output.phase);
                }
            }
            Entry::Verdict(verdict) => {
                if let Some(flight) = self.found.last_mut() {
                    flight.contact_s = Some(verdict.time_s);
                }
            }
            _ => {}
        }
        self.found.len() > before
    }

    fn begin(&mut self) {
        self.found.push(LoggedFlight::default());
        self.powered_up = false;
    }

    /// Every flight so far, in file order.
    pub fn found(&self) -> &[LoggedFlight] {
        &self.found
    }

    /// Where the record ends, for the first flight that is incomplete.
    pub fn cut(&self) -> Option<Cut> {
        self.found.iter().find_map(LoggedFlight::cut)
    }

    /// How many flights have ticks.
    pub fn flown(&self) -> usize {
        self.found.iter().filter(|flight| flight.ticks > 0).count()
    }
}

//! Separates the flights of a log: where each begins, and whether it was recorded to its end.
//!
//! A log normally has one flight. A log joined by other tools has several, and a log cut by a tool may end in the
//! middle of its flight although every checksum is right. A flight begins with its record `/computer/start`. If the log
//! has none, a flight from apogee begins with `/pilot/start`, and a planar one with tick 0. Each flight ends with its
//! verdict.

use std::fmt;

use flight::computer::FRAME_S;
use flight::rules::phase::Phase;
use serde::Serialize;

use super::{Clock, ClockTime, Entry};

/// Longest time between the last tick and the verdict's time of contact, s: the last planar tick comes at most one
/// period (0.1 s) before contact.
const PLANAR_TICK_S: f64 = 0.1;
/// Tolerance for rounding: times are sums of periods.
const ROUNDING_S: f64 = 1e-6;

/// The computer that flew.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FlightKind {
    /// The controller of the planar landing.
    Planar,
    /// The flight computer of a flight from apogee.
    InSpace,
}

/// A flight of a log.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoggedFlight {
    /// The computer that flew.
    pub kind: FlightKind,
    /// Ticks or frames.
    pub ticks: u64,
    /// Vehicle time, s, and phase of the latest tick.
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
    fn new(kind: FlightKind) -> Self {
        Self { kind, ticks: 0, last: None, on_the_pad: None, contact_s: None }
    }

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
        let period_s = match self.kind {
            FlightKind::Planar => PLANAR_TICK_S,
            FlightKind::InSpace => FRAME_S,
        };
        let reached = self.contact_s.is_some_and(|contact_s| contact_s - time_s <= period_s + ROUNDING_S);
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
    /// Tick 0 of the last flight has been seen: the next tick 0 belongs to another flight.
    tick_0_seen: bool,
    /// The last flight began with the power-up of its flight computer.
    powered_up: bool,
}

impl Flights {
    /// Notes a record. Returns whether a flight begins with it.
    pub fn note(&mut self, entry: &Entry) -> bool {
        let before = self.found.len();
        match entry {
            Entry::ComputerStart(start) => {
                self.begin(if start.in_space.is_some() { FlightKind::InSpace } else { FlightKind::Planar });
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
            Entry::PilotStart(_) => self.begin(FlightKind::InSpace),
            Entry::PilotTick(tick) => {
                self.present(FlightKind::InSpace, false).note(tick.input.time_s, tick.output.phase);
            }
            Entry::Tick(tick) => {
                let again = tick.input.tick == 0 && self.tick_0_seen;
                let flight = self.present(FlightKind::Planar, again);
                flight.note(tick.input.time_s, tick.input.phase);
                self.tick_0_seen |= tick.input.tick == 0;
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

    fn begin(&mut self, kind: FlightKind) {
        self.found.push(LoggedFlight::new(kind));
        self.tick_0_seen = false;
        self.powered_up = false;
    }

    /// The flight that a tick belongs to; it begins a new flight if the kind differs or the start is lost.
    fn present(&mut self, kind: FlightKind, another: bool) -> &mut LoggedFlight {
        if another || self.found.last().is_none_or(|flight| flight.kind != kind) {
            self.begin(kind);
        }
        let last = self.found.len() - 1;
        &mut self.found[last]
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

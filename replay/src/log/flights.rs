//! The flights of a log, told apart: where each begins, and whether it was recorded to its end.
//!
//! A log has one flight. Logs joined by other tools have several, and a log cut by one may end in the middle of its
//! flight while every checksum holds. A flight from apogee begins with its record `/pilot/start`, a planar one with tick 0,
//! and each ends with its verdict.

use std::fmt;

use flight::phase::Phase;
use serde::Serialize;

use super::Entry;

/// Ticks may end so long before the verdict's time of contact, s: the last planar tick stands at most one period (0.1 s)
/// before it.
const PLANAR_TICK_S: f64 = 0.1;
/// The same of the flight computer's frames, which last 5 ms.
const FRAME_S: f64 = 0.005;
/// Times are sums of periods, and rounded.
const ROUNDING_S: f64 = 1e-6;

/// Which computer flew.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FlightKind {
    /// The controller of the planar landing.
    Planar,
    /// The flight computer of a flight from apogee.
    FromApogee,
}

/// A flight of a log.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoggedFlight {
    /// Which computer flew.
    pub kind: FlightKind,
    /// Ticks or frames.
    pub ticks: u64,
    /// Vehicle time and phase of the latest of them, s.
    last: Option<(f64, u32)>,
    /// Time of contact as its verdict says it, s.
    contact_s: Option<f64>,
}

/// Where the record of a flight ends that has no end.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Cut {
    /// Vehicle time of the last tick, s.
    pub time_s: f64,
    /// Its phase.
    pub phase: &'static str,
    /// Time of contact as the verdict says it, s, if that is there and only ticks are missing.
    pub contact_s: Option<f64>,
}

impl fmt::Display for Cut {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { time_s, phase, contact_s } = self;
        write!(formatter, "ends at T+{time_s:.3} s in {phase}, ")?;
        match contact_s {
            Some(contact_s) => write!(formatter, "before its contact at T+{contact_s:.3} s"),
            None => write!(formatter, "without a verdict"),
        }
    }
}

impl LoggedFlight {
    fn new(kind: FlightKind) -> Self {
        Self { kind, ticks: 0, last: None, contact_s: None }
    }

    fn note(&mut self, time_s: f64, phase: u32) {
        self.ticks += 1;
        // Ticks may be shuffled a little in the file.
        if self.last.is_none_or(|(last_s, _)| last_s <= time_s) {
            self.last = Some((time_s, phase));
        }
    }

    /// Where its record ends, if that is before the flight's end; `None` also of a flight without ticks.
    pub fn cut(&self) -> Option<Cut> {
        let (time_s, phase) = self.last?;
        let period_s = match self.kind {
            FlightKind::Planar => PLANAR_TICK_S,
            FlightKind::FromApogee => FRAME_S,
        };
        let reached = self.contact_s.is_some_and(|contact_s| contact_s - time_s <= period_s + ROUNDING_S);
        let phase =
            u8::try_from(phase).ok().and_then(Phase::from_index).map_or("an unknown phase", Phase::name);
        (!reached).then_some(Cut { time_s, phase, contact_s: self.contact_s })
    }
}

/// Watches a log's records go by.
#[derive(Debug, Clone, Default)]
pub struct Flights {
    found: Vec<LoggedFlight>,
    /// Tick 0 of the last flight has been seen: the next one is another flight's.
    tick_0_seen: bool,
}

impl Flights {
    /// Notes a record. Returns whether a flight begins with it.
    pub fn note(&mut self, entry: &Entry) -> bool {
        let before = self.found.len();
        match entry {
            Entry::PilotStart(_) => self.begin(FlightKind::FromApogee),
            Entry::PilotTick(tick) => {
                self.present(FlightKind::FromApogee, false).note(tick.input.time_s, tick.output.phase);
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
    }

    /// The flight that a tick of a kind belongs to, begun here if it is another one or its beginning is lost.
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

    /// Where the first flight's record ends that was not recorded to its end.
    pub fn cut(&self) -> Option<Cut> {
        self.found.iter().find_map(LoggedFlight::cut)
    }

    /// How many flights have ticks.
    pub fn flown(&self) -> usize {
        self.found.iter().filter(|flight| flight.ticks > 0).count()
    }
}

//! The past of the flight: its timeline, and every quantity over time.

use std::time::Duration;

use protocol::dialect::{MavMessage, TdPhase};
use protocol::reported::ReceivedEvents;

use super::quantity::{ALL, COUNT, Quantity};
use super::{Model, every_second, is_flight, is_on_pad};

/// The longest timeline, so that a vehicle that keeps changing its phase cannot fill the memory.
pub(crate) const TIMELINE_MAX: usize = 64;

/// What the review page shows.
#[derive(Debug, Clone, Default)]
pub struct History {
    /// Each phase and when it began, since the start of the run: when it was received, until its
    /// event is reported.
    pub timeline: Vec<(TdPhase, Duration)>,
    /// The longest time without a heartbeat in flight.
    pub silence: Duration,
    pub trace: Trace,
}

/// The events that a vehicle has reported, and its release on the clock of the station.
#[derive(Debug, Clone, Default)]
pub struct ReportedEvents {
    received: ReceivedEvents,
    /// By the status that took least time to arrive.
    released_at: Option<Duration>,
}

impl ReportedEvents {
    pub(crate) fn note(&mut self, message: &MavMessage, now: Duration) {
        match message {
            MavMessage::TD_EVENTS(data) => self.received.take(data),
            MavMessage::TD_FLIGHT_STATUS(status) if status.countdown_ms < 0 => {
                let since = Duration::from_millis(status.countdown_ms.unsigned_abs().into());
                self.released_at = self.released_at.into_iter().chain(now.checked_sub(since)).min();
            }
            _ => {}
        }
    }

    /// Time since the release, s, and height, m, of the event that begins a phase.
    pub fn of(&self, phase: TdPhase) -> Option<(f64, f64)> {
        let event = self.received.events.iter().find(|event| event.phase == phase)?;
        Some((event.at_s, event.height_m))
    }

    /// T+0: the release, or if it is not reported the first phase in flight.
    pub(crate) fn flight_began(&self, timeline: &[(TdPhase, Duration)]) -> Option<Duration> {
        let first = timeline.iter().find(|(phase, _)| !is_on_pad(*phase)).map(|(_, at)| *at);
        first.map(|first| self.released_at.unwrap_or(first))
    }

    /// Dates the phases as the vehicle reports them, not as its messages arrive.
    pub(crate) fn date(&self, timeline: &mut Vec<(TdPhase, Duration)>) {
        for event in &self.received.events {
            let since = Duration::try_from_secs_f64(event.at_s).ok();
            let Some((released_at, since)) = self.released_at.zip(since) else { continue };
            timeline.retain(|(phase, _)| *phase != event.phase);
            timeline.push((event.phase, released_at + since));
        }
        timeline.sort_by_key(|(_, at)| *at);
    }
}

// Every quantity over time, in a bounded number of rows: the recent past in full, the distant past
// in steps.

/// The most rows. When they are full, every second one is dropped.
const ROWS_MAX: usize = 1_200;
/// How often a row is added in flight, and otherwise.
const FLIGHT_STEP: Duration = Duration::from_millis(200);
const CALM_STEP: Duration = Duration::from_secs(1);

/// A trend compares the ends of this time, each averaged over this part.
const TREND_OVER: Duration = Duration::from_mins(1);
const TREND_PART: Duration = Duration::from_secs(10);

/// The values of one moment, in the order of [`ALL`]; NaN where a value was unknown or stale.
type Row = [f32; COUNT];

#[derive(Debug, Clone, Default)]
pub struct Trace {
    rows: Vec<(Duration, Row)>,
}

impl Trace {
    /// When the next row is due.
    fn due_at(&self, in_flight: bool) -> Duration {
        let step = if in_flight { FLIGHT_STEP } else { CALM_STEP };
        self.rows.last().map_or(Duration::ZERO, |(at, _)| *at + step)
    }

    /// The known values of a quantity from a time to another, oldest first.
    pub fn values(
        &self,
        quantity: &Quantity,
        from: Duration,
        to: Duration,
    ) -> impl Iterator<Item = (Duration, f64)> {
        let place = quantity.place();
        let inside = self.rows.iter().filter(move |(at, _)| (from..=to).contains(at));
        inside.map(move |(at, row)| (*at, f64::from(row[place]))).filter(|(_, value)| value.is_finite())
    }

    /// How much a quantity has risen within the last minute: the mean of the newest part less that
    /// of the oldest; `None` without both.
    pub fn rise(&self, quantity: &Quantity, now: Duration) -> Option<f64> {
        let mean = |from: Duration, to: Duration| {
            let count = self.values(quantity, from, to).count();
            let sum: f64 = self.values(quantity, from, to).map(|(_, value)| value).sum();
            (count > 0).then(|| sum / count as f64)
        };
        let begin = now.checked_sub(TREND_OVER)?;
        Some(mean(now.saturating_sub(TREND_PART), now)? - mean(begin, begin + TREND_PART)?)
    }

    fn push(&mut self, at: Duration, row: Row) {
        if self.rows.len() >= ROWS_MAX {
            every_second(&mut self.rows);
        }
        self.rows.push((at, row));
    }
}

/// Silence from which no value of a flight is repeated: twice the longest pause between any two
/// messages of a vehicle in flight on the slowest link.
const SILENT_FROM: Duration = Duration::from_millis(400);

/// Adds a row with the present values, if one is due, and notes the silence in flight.
pub(crate) fn note_trace(model: &mut Model, now: Duration) {
    let in_flight = model.vehicle.phase_now().is_some_and(is_flight);
    if let Some(last_frame_at) = model.link.last_frame_at.filter(|_| in_flight) {
        model.history.silence = model.history.silence.max(now.saturating_sub(last_frame_at));
    }
    // A flight whose link is silent is not at its last height.
    let last_at = model.link.last_frame_at.map(|at| model.link.uplink.pace.of_the_vehicle(at, now));
    let is_silent = in_flight && last_at.is_none_or(|at| now.saturating_sub(at) > SILENT_FROM);
    if is_silent || now < model.history.trace.due_at(in_flight) || model.vehicle.heartbeat.is_none() {
        return;
    }
    let row = std::array::from_fn(|place| {
        let value = ALL[place].read(model, now).filter(|sample| !sample.is_stale(now));
        value.map_or(f32::NAN, |sample| sample.value as f32)
    });
    model.history.trace.push(now, row);
}

/// T+0 of the flight.
pub fn flight_began(model: &Model) -> Option<Duration> {
    model.vehicle.events.flight_began(&model.history.timeline)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_trace_is_bounded_and_the_recent_past_complete() {
        let mut trace = Trace::default();
        let height = Quantity::named("height").unwrap();
        for second in 0..20_000_u32 {
            let mut row = [f32::NAN; COUNT];
            row[height.place()] = second as f32;
            trace.push(Duration::from_secs(second.into()), row);
        }
        assert!(trace.rows.len() <= ROWS_MAX);
        let last = |seconds: u64| {
            let (from, to) = (Duration::from_secs(19_999 - seconds), Duration::from_secs(19_999));
            trace.values(height, from, to).map(|(_, value)| value).collect::<Vec<_>>()
        };
        assert_eq!(last(2), [19_997.0, 19_998.0, 19_999.0]);
        assert!(trace.values(height, Duration::ZERO, Duration::from_mins(250)).count() > 1);
        let tilt = Quantity::named("tilt").unwrap();
        assert_eq!(trace.values(tilt, Duration::ZERO, Duration::MAX).count(), 0, "NaN is no value");
    }
}

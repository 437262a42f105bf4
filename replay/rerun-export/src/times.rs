//! The recording's timelines.

use rerun::{RecordingStream, TimeCell};

use crate::entity::{TIMELINE_FLIGHT_TIME, TIMELINE_TICK};

/// The current position of the export on the timelines.
#[derive(Debug, Default)]
pub(crate) struct Times {
    /// Log time of vehicle time 0, ns since the Unix epoch.
    zero_log_ns: Option<i128>,
    tick: Option<u64>,
    first_tick: Option<u64>,
    span: Option<(Instant, Instant)>,
}

/// A position on both timelines.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Instant {
    flight_ns: i64,
    tick: Option<u64>,
}

impl Times {
    /// Whether log times can be converted to vehicle time yet.
    pub(crate) fn known(&self) -> bool {
        self.zero_log_ns.is_some()
    }

    /// Learns the offset between vehicle time and log time from the first record that has both.
    pub(crate) fn learn(&mut self, vehicle_time_s: f64, log_time_ns: u64) {
        self.zero_log_ns.get_or_insert(i128::from(log_time_ns) - i128::from(nanoseconds(vehicle_time_s)));
    }

    /// Sets the number of the current tick.
    pub(crate) fn tick(&mut self, tick: u64) {
        self.tick = Some(tick);
        self.first_tick.get_or_insert(tick);
    }

    /// Sets the position of the next record to a vehicle time, s.
    pub(crate) fn at_vehicle_time(&mut self, recording: &RecordingStream, time_s: f64) {
        self.at(recording, nanoseconds(time_s));
    }

    /// Sets the position of the next record to a log time, ns since the Unix epoch.
    pub(crate) fn at_log_time(&mut self, recording: &RecordingStream, log_time_ns: u64) {
        let zero_ns = *self.zero_log_ns.get_or_insert(i128::from(log_time_ns));
        let flight_ns = i128::from(log_time_ns) - zero_ns;
        self.at(recording, i64::try_from(flight_ns).unwrap_or(i64::MAX));
    }

    /// The first and the last position used. The first one counts as part of the first tick, which may come later.
    pub(crate) fn span(&self) -> Option<(Instant, Instant)> {
        let (first, last) = self.span?;
        Some((Instant { tick: first.tick.or(self.first_tick), ..first }, last))
    }

    /// Sets the position of the next record.
    pub(crate) fn at_instant(recording: &RecordingStream, instant: Instant) {
        recording.set_time(TIMELINE_FLIGHT_TIME, TimeCell::from_duration_nanos(instant.flight_ns));
        match instant.tick.and_then(|tick| i64::try_from(tick).ok()) {
            Some(tick) => recording.set_time(TIMELINE_TICK, TimeCell::from_sequence(tick)),
            None => recording.disable_timeline(TIMELINE_TICK),
        }
    }

    fn at(&mut self, recording: &RecordingStream, flight_ns: i64) {
        let here = Instant { flight_ns, tick: self.tick };
        let (first, last) = self.span.get_or_insert((here, here));
        if here.flight_ns < first.flight_ns {
            *first = here;
        }
        if here.flight_ns >= last.flight_ns {
            *last = here;
        }
        Self::at_instant(recording, here);
    }
}

/// A time in whole nanoseconds. NaN becomes 0; values out of range become an end of the range.
fn nanoseconds(time_s: f64) -> i64 {
    (time_s * 1e9).round() as i64
}

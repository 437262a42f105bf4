//! The events of the log, in order.

use crate::log::{Clock, ClockTime};
use crate::report::html::{escaped, paragraph, table};
use crate::report::track::Flight;

/// Most events that a page lists.
const SHOWN: usize = 200;

pub(super) fn html(flight: &Flight) -> String {
    let events = &flight.recording.events;
    if events.is_empty() {
        return paragraph("The log has no events.");
    }
    let clocks = &flight.recording.clocks;
    let (clock, heading) =
        if clocks.flight_zero_s.is_some() { (Clock::Flight, "#T+, s") } else { (Clock::Log, "#log, s") };
    let rows: Vec<Vec<String>> = events
        .iter()
        .take(SHOWN)
        .map(|(log_s, event)| {
            let time = clocks.convert(ClockTime { clock: Clock::Log, time_s: *log_s }, clock);
            let time_s = time.map_or(*log_s, |time| time.time_s);
            vec![format!("{:.3}", time_s + 0.0), escaped(&event.name), escaped(&event.message)]
        })
        .collect();
    let more = events.len().saturating_sub(SHOWN);
    let rest = if more > 0 { paragraph(&format!("And {more} more.")) } else { String::new() };
    table(&[heading, "from", "event"], &rows) + &rest
}

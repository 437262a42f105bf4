//! Events, mission and contents of the log.

use flight::vehicles::mission::BUILTIN;

use crate::cli::Answer as _;
use crate::info::{Info, Profile};
use crate::log::{Clock, ClockTime, differing};
use crate::report::html::{escaped, paragraph, table};
use crate::report::track::Flight;
use crate::settings::settings_of_mission;

/// The description of the log by `info`.
pub(super) fn described(info: &Info) -> String {
    format!("<pre>{}\n</pre>\n", escaped(&info.sentences().join("\n")))
}

/// Most events that a page lists.
const SHOWN: usize = 200;

pub(super) fn events(flight: &Flight) -> Option<String> {
    let events = &flight.recording.events;
    events.first()?;
    let clocks = &flight.recording.clocks;
    let (clock, heading) =
        if clocks.flight_zero_s.is_some() { (Clock::Flight, "#T+, s") } else { (Clock::Log, "#log, s") };
    let rows = events.iter().take(SHOWN).map(|(log_s, event)| {
        let time = clocks.convert(ClockTime { clock: Clock::Log, time_s: *log_s }, clock);
        let time_s = time.map_or(*log_s, |time| time.time_s);
        [format!("{:.3}", time_s + 0.0), escaped(&event.name), escaped(&event.message)]
    });
    let more = events.len().saturating_sub(SHOWN);
    let rest = if more > 0 { paragraph(&format!("And {more} more.")) } else { String::new() };
    Some(table(&[heading, "from", "event"], rows) + &rest)
}

/// What of the flown mission differs from the built-in one of its name, and whether its controller
/// is the standard one.
pub(super) fn mission(flight: &Flight, info: &Info) -> Option<String> {
    let flown = flight.recording.profile_toml().ok()?;
    let profile = info.profile.as_ref();
    let name = profile.and_then(|profile| profile.name.as_deref()).unwrap_or_default();
    let controller = profile.and_then(Profile::controller);
    let controller =
        controller.map_or_else(String::new, |controller| paragraph(&format!("Controller: {controller}.")));
    let Some((_, built_in)) = BUILTIN.iter().find(|(known, _)| *known == name) else {
        return Some(controller + &paragraph(&format!("No mission {name} is built into this program.")));
    };
    let differences = differing(&settings_of_mission(built_in)?, &settings_of_mission(flown)?);
    if differences.is_empty() {
        return Some(paragraph(&format!("As the built-in {name}.")));
    }
    let words = |value: Option<String>| escaped(&value.unwrap_or_else(|| "absent".to_owned()));
    let rows = differences.into_iter();
    let rows = rows.map(|(setting, [built_in, flown])| [escaped(&setting), words(built_in), words(flown)]);
    Some(controller + &table(&["value", "built-in", "flown"], rows))
}

//! The whole flight: its moments, its path, its events, its mission, and what the log holds.

use flight::computer::pilot::Pilot;
use flight::rules::phase::Phase;
use flight::vehicles::mission::BUILTIN;

use super::burn::View;
use crate::cli::Answer as _;
use crate::compare::compared;
use crate::info::{Info, Profile};
use crate::log::{Clock, ClockTime};
use crate::report::chart::{Chart, line};
use crate::report::html::{charts, escaped, paragraph, table};
use crate::report::track::{Flight, Part, Sample};

/// What `info` says of the log.
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
    let shown = table(&[heading, "from", "event"], rows) + &rest;
    Some(format!("<details><summary>{} events</summary>\n{shown}</details>\n", events.len()))
}

/// What of the flown mission differs from the built-in one of its name, and whether its controller is the standard one.
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
    let [built_in, flown] = [built_in, flown].map(|text| (name.to_owned(), text.to_owned()));
    let differences = compared(built_in, flown).ok()?.differences;
    if differences.is_empty() {
        return Some(paragraph(&format!("As the built-in {name}.")));
    }
    let words = |value: Option<String>| escaped(&value.unwrap_or_else(|| "absent".to_owned()));
    let rows = differences.into_iter();
    let rows = rows.map(|differs| [escaped(&differs.setting), words(differs.baseline), words(differs.other)]);
    Some(controller + &table(&["value", "built-in", "flown"], rows))
}

/// A stage of the flight: its name, its class, and whether a phase belongs to it.
type Stage = (&'static str, &'static str, fn(Phase) -> bool);

const STAGES: [Stage; 4] = [
    ("ascent", "c", |phase| phase.before_apogee()),
    ("descent", "a", |phase| phase.in_descent()),
    ("burn", "b", |phase| phase.in_landing_burn() || phase == Phase::Touchdown),
    ("parachute", "d", |phase| phase == Phase::Chute),
];

pub(super) const FROM_ABOVE: View =
    ("Seen from above: ground track", ["east, m", "north, m"], |state| (state[1], state[0]));
const SIDES: [View; 2] = [
    ("Seen from the west: north and height", ["north, m", "height, m"], |state| (state[0], state[2])),
    ("Seen from the south: east and height", ["east, m", "height, m"], |state| (state[1], state[2])),
];

/// The flown path, its stages and its main moments; a ground track has equal scales.
pub(super) fn view(flight: &Flight, (title, labels, see): View, equal_scales: bool) -> String {
    let flown = || flight.track.iter().filter(|sample| flight.has(Part::Air, sample.time_s));
    let lines = STAGES.iter().map(|(name, class, belongs)| {
        // Another stage ends a line.
        let point = |sample: &Sample| {
            if sample.phase.is_some_and(belongs) { see(&sample.state) } else { (f64::NAN, f64::NAN) }
        };
        line(name, class, flown().map(point).collect())
    });
    let lines = lines.filter(|line| line.points.iter().any(|point| point.0.is_finite()));
    let places = moments(flight).into_iter().filter(|(_, _, drawn)| *drawn);
    let place = |(name, sample, _): (&str, &Sample, bool)| {
        let (x, y) = see(&sample.state);
        (x, y, name.to_owned())
    };
    let mut chart = Chart::new(title, labels, lines.collect());
    (chart.panel.places, chart.panel.equal_scales) = (places.map(place).collect(), equal_scales);
    chart.svg()
}

pub(super) fn moments_and_views(flight: &Flight) -> String {
    let row = |(name, sample, _): (&str, &Sample, bool)| -> Vec<String> {
        let [north, east, height_m, level_m_s, up_m_s, ..] = sample.state;
        let cells = [height_m, north, east, level_m_s, up_m_s].map(|value| format!("{:.1}", value + 0.0));
        [name.to_owned(), format!("{:.3}", flight.axis_s(sample.time_s))].into_iter().chain(cells).collect()
    };
    let time = format!("#{}", flight.axis_name());
    let heads = ["moment", &time, "#height, m", "#north, m", "#east, m", "#level, m/s", "#up, m/s"];
    paragraph("Up to contact. Each axis has its own scale.")
        + &table(&heads, moments(flight).into_iter().map(row))
        + &charts(&SIDES.map(|seen| view(flight, seen, false)))
}

/// What happened when, as far as it did, and whether the pictures show it.
fn moments(flight: &Flight) -> Vec<(&'static str, &Sample, bool)> {
    let world = &flight.recording.world;
    let flown = || flight.track.iter().filter(|sample| flight.has(Part::Air, sample.time_s));
    let enters = |wanted: Phase| flown().find(|sample| sample.phase == Some(wanted));
    let highest =
        flown().filter(|sample| sample.state[2].is_finite()).max_by(|a, b| a.state[2].total_cmp(&b.state[2]));
    let rises = flown().any(|sample| sample.phase.is_some_and(Phase::before_apogee));
    let at = |time_s: f64| flown().find(|sample| sample.time_s >= time_s);
    let mut pairs = world.windows(2);
    let separated =
        pairs.find(|pair| pair[0].booster_thrust_n.is_some() && pair[1].booster_thrust_n.is_none());
    let mission = flight.pilot.as_ref().map(Pilot::mission);
    let lit = mission.and_then(|mission| {
        let half_n = 0.5 * mission.motor_curve.total_impulse_n_s() / mission.motor_curve.burn_time_s();
        world.iter().find(|sample| sample.thrust_n >= half_n)
    });
    let carried = mission.and_then(|mission| {
        world.iter().rposition(|sample| sample.thrust_n > sample.mass_kg * mission.gravity_m_s2)
    });
    let falls = carried.and_then(|last| flight.track.get(last + 1));
    let moments = [
        ("lift-off", enters(Phase::Boost), true),
        ("burn-out", enters(Phase::Coast), true),
        ("separation", separated.and_then(|pair| at(pair[1].time_s)), true),
        ("apogee", highest.filter(|_| rises), true),
        ("parachute", enters(Phase::Chute), true),
        ("ignition", flight.ignition_s.and_then(at), true),
        ("half of nominal thrust", lit.and_then(|sample| at(sample.time_s)), false),
        ("thrust confirmed on board", enters(Phase::Powered), false),
        ("contact", flown().next_back().filter(|_| flight.touchdown_s.is_some()), true),
        ("thrust fell through weight", falls, false),
    ];
    // Telemetry may begin without a place.
    let known = |sample: &&Sample| sample.state[..5].iter().all(|value| value.is_finite());
    let known =
        moments.into_iter().filter_map(|(name, sample, drawn)| Some((name, sample.filter(known)?, drawn)));
    let mut moments: Vec<_> = known.collect();
    moments.sort_by(|a, b| a.1.time_s.total_cmp(&b.1.time_s));
    moments
}

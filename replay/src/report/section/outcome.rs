//! How the flight ended: verdict, phases, events, link, and what the log holds.

use flight::rules::phase::Phase;

use super::rms_and_max;
use crate::info::{Info, PhaseSpan, print_info};
use crate::log::{Clock, ClockTime};
use crate::report::chart::Line;
use crate::report::html::{charts, escaped, paragraph, put, table};
use crate::report::track::Flight;

/// What `info` says of the log.
pub(super) fn described(info: &Info) -> String {
    let mut text = Vec::new();
    // Writing into memory cannot fail.
    let _ = print_info(info, &mut text);
    format!("<pre>{}</pre>\n", escaped(&String::from_utf8_lossy(&text)))
}

/// Most events that a page lists.
const SHOWN: usize = 200;

pub(super) fn events(flight: &Flight) -> String {
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
    let shown = table(&[heading, "from", "event"], &rows) + &rest;
    format!("<details><summary>{} events</summary>\n{shown}</details>\n", events.len())
}

pub(super) fn phases(flight: &Flight, info: &Info) -> String {
    let Some(timeline) = info.phases.first() else {
        return paragraph("The log has no phases.");
    };
    let html = strip(flight, &timeline.spans);
    let known = moments(flight).into_iter().filter_map(|(what, time_s)| Some((what, time_s?)));
    let mut rows: Vec<Vec<String>> =
        known.map(|(what, time_s)| vec![escaped(what), format!("{time_s:.3} s")]).collect();
    if let (Some(through_s), Some(touchdown_s)) = (thrust_through_weight_s(flight), flight.touchdown_s) {
        let words = if through_s <= touchdown_s { "before" } else { "after" };
        rows.push(vec![
            "thrust fell through weight".to_owned(),
            format!("{:.3} s {words} touchdown", (touchdown_s - through_s).abs()),
        ]);
    }
    if rows.is_empty() {
        return html + &paragraph("The log has no ignition of the landing motor.");
    }
    html + &table(&["moment", "#"], &rows)
}

/// The phases as a strip, with their times.
fn strip(flight: &Flight, spans: &[PhaseSpan]) -> String {
    const WIDTH: f64 = 1040.0;
    let Some((first, last)) = spans.first().zip(spans.last()) else {
        return String::new();
    };
    let length_s = (last.until_s - first.from_s).max(1e-9);
    let mut svg = format!(
        "<figure class=\"full\"><svg viewBox=\"0 0 {WIDTH} 76\" role=\"img\" aria-label=\"phases\">\n"
    );
    let at = |time_s: f64| 4.0 + (time_s - first.from_s) / length_s * (WIDTH - 8.0);
    for (place, span) in spans.iter().enumerate() {
        let until_s = spans.get(place + 1).map_or(span.until_s, |next| next.from_s);
        let (left, right) = (at(span.from_s), at(until_s));
        let class = ["fa", "fb", "fc", "fd"][place % 4];
        put(
            &mut svg,
            format_args!(
                "<rect class=\"{class}\" x=\"{left:.1}\" y=\"22\" width=\"{:.1}\" height=\"16\"/>",
                (right - left).max(1.5)
            ),
        );
        // Labels of short neighbouring phases are put on different lines.
        let y = [14.0, 54.0, 70.0][place % 3];
        let anchor = if left > 0.85 * WIDTH { "end" } else { "start" };
        put(
            &mut svg,
            format_args!(
                "<text x=\"{left:.1}\" y=\"{y}\" text-anchor=\"{anchor}\">{} {:.2} s</text>\n",
                escaped(&span.phase),
                rounded(flight.axis_s(span.from_s))
            ),
        );
    }
    svg.push_str("</svg></figure>\n");
    svg + &format!("<p class=\"muted\">Times in {}.</p>\n", flight.axis_name())
}

/// To hundredths, without a negative zero.
fn rounded(time_s: f64) -> f64 {
    (100.0 * time_s).round() / 100.0 + 0.0
}

/// The key figures of the flight.
fn moments(flight: &Flight) -> Vec<(&'static str, Option<f64>)> {
    let lit_s = thrust_above_half_s(flight);
    let delay_s = lit_s.zip(flight.ignition_s).map(|(lit_s, command_s)| lit_s - command_s);
    let confirmed = flight.track.iter().find(|sample| sample.phase == Some(Phase::Powered));
    let confirmed_s = confirmed.map(|sample| sample.time_s).zip(flight.ignition_s).map(|(a, b)| a - b);
    let burn_s = flight.touchdown_s.zip(flight.ignition_s).map(|(a, b)| a - b);
    vec![
        ("ignition command, T+", flight.ignition_s),
        ("ignition delay: command to half of nominal thrust", delay_s),
        ("command to thrust confirmed on board", confirmed_s),
        ("command to touchdown", burn_s),
    ]
}

fn thrust_above_half_s(flight: &Flight) -> Option<f64> {
    let half_n = flight.vehicle.as_ref()?.half_thrust_n;
    let lit = flight.plant.iter().find(|plant| plant.thrust_n >= half_n)?;
    Some(lit.sample.time_s)
}

/// The last time thrust falls from above the weight to below it.
fn thrust_through_weight_s(flight: &Flight) -> Option<f64> {
    let gravity_m_s2 = flight.vehicle.as_ref()?.gravity_m_s2;
    let last = flight.plant.iter().rposition(|plant| plant.thrust_n > plant.mass_kg * gravity_m_s2)?;
    let after = flight.plant.get(last + 1)?.sample;
    after.phase.map(|_| after.time_s)
}

pub(super) fn link(flight: &Flight) -> String {
    let heard = &flight.recording.telemetry;
    if heard.is_empty() {
        return paragraph("No ground station wrote into this log, so the link's age and loss are not known.");
    }
    let of = |value: &dyn Fn(&protocol::log::v1::Telemetry) -> Option<f64>| -> Vec<(f64, f64)> {
        heard.iter().filter_map(|told| Some((flight.axis_s(told.time_s), value(told)?))).collect()
    };
    let series = [
        ("Age of the last heartbeat, s", of(&|told| told.link_age_s)),
        ("Frames lost, %", of(&|told| told.link_loss.map(|loss| 100.0 * loss))),
        ("Received, bytes/s", of(&|told| told.link_rx_bytes_s)),
    ];
    let mut rows = Vec::new();
    let mut pictures = Vec::new();
    for (name, points) in series {
        if let Some((_, max)) = rms_and_max(points.iter().map(|point| point.1)) {
            rows.push(vec![name.to_owned(), format!("{max:.2}")]);
        }
        let lines = vec![Line { name: "", class: "a", points }];
        pictures.push(flight.over_time(name, lines).svg());
    }
    table(&["as the ground station knew it", "#largest"], &rows) + &charts(&pictures)
}

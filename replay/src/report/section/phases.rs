//! The phases and the important moments of the flight.

use flight::rules::phase::Phase;

use crate::info::{Info, PhaseSpan};
use crate::report::html::{escaped, paragraph, put, table};
use crate::report::track::Flight;

pub(super) fn html(flight: &Flight, info: &Info) -> String {
    let Some(timeline) = info.phases.first() else {
        return paragraph("The log has no phases.");
    };
    let mut html = strip(flight, &timeline.spans);
    html.push_str(&times(flight, &timeline.spans));
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

/// The same in numbers, for narrow screens and screen readers.
fn times(flight: &Flight, spans: &[PhaseSpan]) -> String {
    let seconds = |time_s: f64| format!("{:.2} s", rounded(time_s));
    let rows: Vec<Vec<String>> = spans
        .iter()
        .enumerate()
        .map(|(place, span)| {
            let until_s = spans.get(place + 1).map_or(span.until_s, |next| next.from_s);
            vec![escaped(&span.phase), seconds(flight.axis_s(span.from_s)), seconds(until_s - span.from_s)]
        })
        .collect();
    table(&["phase", "#from", "#for"], &rows)
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

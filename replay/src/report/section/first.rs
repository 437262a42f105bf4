//! The first screen: how the flight ended, what went wrong, the whole flight, its place and its limits.

use flight::rules::verdict::Landing;
use onboard_sim::figure::Panel;
use protocol::log::v1::LimitResult;

use crate::findings::{Finding, over};
use crate::info::{Info, rounded};
use crate::log::{Verdict, worst_first};
use crate::refly::{FaultChanges, ReflyOptions, refly_flight};
use crate::report::chart::Chart;
use crate::report::html::{escaped, paragraph, table};
use crate::report::track::Flight;

use super::pictures::{IGNITION, Picture, TOUCHDOWN};
use super::whole::{FROM_ABOVE, view};

pub(super) fn html(flight: &Flight, info: &Info, pictures: &[Picture<'_>]) -> String {
    let mut html = verdict(info);
    html += "<div class=\"first\">\n<div>\n";
    html += &findings(flight, info);
    html += &limits(info);
    html += "</div>\n<div class=\"charts\">\n";
    for picture in pictures.iter().filter(|picture| picture.section == "first") {
        let panel = &picture.chart.panel;
        let mut panel = Panel { spans: flight.spans.clone(), ..panel.clone() };
        // The backgrounds say what the phases' marks would; a crew's notes stay.
        panel.marks.retain(|(_, name)| ![IGNITION, TOUCHDOWN].contains(&&**name));
        html += &Chart { panel, ..picture.chart.clone() }.svg();
    }
    html += &view(flight, FROM_ABOVE, true);
    html += "</div>\n</div>\n";
    html + &paragraph(
        "Backgrounds are phases; red numbers are the findings, where they begin. Drag in a picture to see a part of the \
         time in all of them, double click for the whole.",
    )
}

/// The ending, the worst limit, and the first sign.
fn verdict(info: &Info) -> String {
    let ending = info.ending.as_deref().unwrap_or("No verdict in this log");
    let class = match &info.verdict {
        Some(Verdict { landing: Landing { stands: false, .. }, .. }) => " bad",
        Some(Verdict { landing: Landing { envelope: true, .. }, .. }) => " good",
        // It stands, and its legs were not designed for it.
        Some(_) | None => "",
    };
    let mut html = format!("<p class=\"verdict{class}\">{}</p>\n", escaped(ending));
    if let Some(first) = info.findings.iter().flatten().next() {
        html += &paragraph(&format!("First sign: {}, at T+{:.2} s.", first.words, first.since_s));
    }
    let Some(verdict) = &info.verdict else {
        let none = "The vehicle did not touch down while it was recorded, or its verdict was not recorded.";
        return html + &paragraph(none);
    };
    let sorted = worst_first(verdict.of_the_legs());
    let (all, broken) = (sorted.len(), sorted.iter().filter(|(limit, _)| !limit.passed).count());
    if let Some((worst, share)) = sorted.first().filter(|(_, share)| share.is_finite()) {
        let far = if *share > 1.0 { over(*share) } else { format!("{:.0} % of its limit", 100.0 * share) };
        let LimitResult { name, value, unit, .. } = worst;
        let value = value.abs();
        html += &paragraph(&format!(
            "Worst of the legs' limits: {name} {value:.2} {unit}, {far}; {broken} of {all} broken."
        ));
    }
    html + &paragraph(&format!("Touchdown at {}.", info.clocks.words(verdict.contact())))
}

fn findings(flight: &Flight, info: &Info) -> String {
    let mut html = "<h3 id=\"findings\">Findings, first in time</h3>\n".to_owned();
    let Some(findings) = &info.findings else {
        let none = "Nothing was looked for: the log has no frames, or this build does not make their decisions again.";
        return html + &paragraph(none);
    };
    if findings.is_empty() {
        html += &paragraph(info.no_findings());
    }
    let item = |finding: &Finding| {
        let Finding { since_s, section, words, .. } = finding;
        format!("<li><b>T+{since_s:.2} s</b> <a href=\"#{section}\">{}</a></li>\n", escaped(words))
    };
    let items: String = findings.iter().map(item).collect();
    html + "<ol class=\"findings\">\n" + &items + "</ol>\n" + &without_its_faults(flight)
}

/// A simulated flight flown again with nothing broken in it.
fn without_its_faults(flight: &Flight) -> String {
    let faults = flight.recording.head.run.get("faults").map_or("", String::as_str);
    if faults.is_empty() {
        return String::new();
    }
    let changes = FaultChanges { without: vec!["all".to_owned()], ..FaultChanges::default() };
    let options = ReflyOptions { faults: changes, ..ReflyOptions::default() };
    let flown = refly_flight(&flight.recording, &options).ok().and_then(|(_, flown)| flown.verdict);
    let Some(verdict) = flown else { return String::new() };
    let ending = verdict.ending.unwrap_or_default();
    paragraph(&format!("Simulated: flown again without {faults}: {ending}."))
}

fn limits(info: &Info) -> String {
    let Some(verdict) = &info.verdict else { return String::new() };
    let [_, _, envelope, table_2] = Landing::WORDS;
    let more = limit_table(table_2, &verdict.table_2);
    limit_table("borne", &verdict.borne)
        + &limit_table(envelope, &verdict.envelope)
        + &format!("<details><summary>{table_2}</summary>\n{more}</details>\n")
}

fn limit_table(title: &str, limits: &[LimitResult]) -> String {
    let row = |(limit, share): (&LimitResult, f64)| {
        let (class, word) = if limit.passed { ("good", "inside") } else { ("bad", "OUTSIDE") };
        [
            escaped(&limit.name),
            format!("{:.2} {}", limit.value + 0.0, escaped(&limit.unit)),
            format!("{} to {}", rounded(limit.minimum) + 0.0, rounded(limit.maximum) + 0.0),
            bar(limit, share),
            format!("<span class=\"{class}\">{word}</span>"),
        ]
    };
    if limits.is_empty() {
        return String::new();
    }
    let heads = [title, "#value", "#limit", "share; the mark is the limit", ""];
    let html = table(&heads, worst_first(limits.iter()).into_iter().map(row));
    // On a narrow screen its pictures are left out.
    html.replacen("class=\"wide\"", "class=\"wide limits\"", 1)
}

/// A value's share of its limit, up to half more than it.
fn bar(limit: &LimitResult, share: f64) -> String {
    const WIDTH: f64 = 120.0;
    const LONGEST: f64 = 1.5;
    if !share.is_finite() {
        return String::new();
    }
    let class = if limit.passed { "bar" } else { "barbad" };
    let px = |share: f64| WIDTH * share.min(LONGEST) / LONGEST;
    format!(
        "<svg viewBox=\"0 0 {WIDTH} 14\" style=\"width:{WIDTH}px\" aria-hidden=\"true\"><rect class=\"room\" x=\"0\" y=\"3\" \
         width=\"{WIDTH}\" height=\"8\"/><rect class=\"{class}\" x=\"0\" y=\"3\" width=\"{:.1}\" height=\"8\"/>\
         <rect class=\"mark\" x=\"{:.1}\" y=\"0\" width=\"2\" height=\"14\"/></svg>",
        px(share),
        px(1.0) - 1.0
    )
}

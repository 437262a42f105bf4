//! Prints the description of a log for people.

use std::collections::BTreeMap;
use std::io::{self, Write};

use time::OffsetDateTime;
use time::format_description::well_known::Rfc3339;

use super::{counted, shown};
use crate::info::{ChannelFacts, FrameFacts, Info, PhaseSource, PhaseTimeline, SolveTimes};

/// Writes a description of a log as text.
///
/// # Errors
/// The output failed.
pub fn print_info(info: &Info, output: &mut impl Write) -> io::Result<()> {
    let size = info.size_bytes.map(|bytes| format!(", {}", size_text(bytes))).unwrap_or_default();
    writeln!(output, "{}{size}", shown(&info.file))?;
    row(output, "grade", &format!("{}: {}", info.grade.level.name(), shown(&info.grade.reason)))?;
    row(output, "complete", &completeness(info))?;
    if info.completeness.flights > 1 {
        row(output, "flights", &format!("{}; `replay verify` reports on each", info.completeness.flights))?;
    }
    print_origin(info, output)?;
    let schema = &info.schema;
    if schema.version != schema.this_build {
        let newer = schema.version > schema.this_build;
        let words =
            if newer { "newer than this build reads" } else { "without the flight computer's frames" };
        row(
            output,
            "schema",
            &format!("{}, {words} (this build writes {})", schema.version, schema.this_build),
        )?;
    }
    if let Some(span) = &info.span {
        let (first, last) = (utc(span.first_ns), utc(span.last_ns));
        row(output, "time", &format!("{first} to {last}, {:.3} s", span.duration_s))?;
    }
    if let Some(timeline) = info.phases.first() {
        print_phases(timeline, output)?;
    }
    print_verdict(info, output)?;
    if let Some(frames) = &info.frames {
        print_frames(frames, output)?;
    }
    print_channels(&info.channels, output)?;
    let attached: Vec<String> = info
        .attachments
        .iter()
        .map(|attachment| format!("{} ({})", shown(&attachment.name), size_text(attachment.bytes as u64)))
        .collect();
    row(output, "attached", &or_none(attached.join(", ")))?;
    if let Some(reason) = &info.unreadable {
        row(output, "unreadable", &shown(reason))?;
    }
    Ok(())
}

fn row(output: &mut impl Write, name: &str, text: &str) -> io::Result<()> {
    writeln!(output, "{}", format!("{name:<11} {text}").trim_end())
}

fn completeness(info: &Info) -> String {
    let found = &info.completeness;
    if found.complete {
        return "yes: ended properly, every checksum holds".to_owned();
    }
    let mut faults = Vec::new();
    if let Some(damage) = &found.damage {
        faults.push(shown(damage));
        faults.push(match found.readable_until_s {
            None => "no record could be read".to_owned(),
            Some(until_s) => format!("readable until {until_s:.3} s after the first record"),
        });
        faults.extend(found.missing_s.map(|missing_s| format!("{missing_s:.3} s after that are lost")));
    }
    if found.messages_lost > 0 {
        faults.push(format!("{} lost", counted(found.messages_lost, "message")));
    }
    faults.extend(found.cut.as_ref().map(|cut| format!("the flight {cut}")));
    format!("NO: {}", faults.join("; "))
}

fn print_origin(info: &Info, output: &mut impl Write) -> io::Result<()> {
    row(output, "written by", &or_none(shown(&info.library)))?;
    let listed = |entries: &BTreeMap<String, String>| {
        let listed: Vec<String> =
            entries.iter().map(|(key, value)| format!("{} {}", shown(key), or_none(short(value)))).collect();
        or_none(listed.join(", "))
    };
    row(output, "run", &listed(&info.run))?;
    let comparison = &info.build_comparison;
    if !comparison.recorded {
        row(output, "build", "not recorded")?;
    } else if comparison.differences.is_empty() {
        row(output, "build", &format!("this one: {}", listed(&info.build)))?;
    } else {
        row(output, "build", "differs from this build:")?;
        for difference in &comparison.differences {
            let value =
                |value: &Option<String>| value.as_deref().map_or_else(|| "not noted".to_owned(), short);
            let (recorded, this) = (value(&difference.recorded), value(&difference.this_build));
            row(output, "", &format!("{}: {recorded} (this one: {this})", shown(&difference.fact)))?;
        }
    }
    let profile = match &info.profile {
        None => "not attached".to_owned(),
        Some(profile) => match (&profile.name, &profile.summary) {
            (Some(name), Some(summary)) => format!("{}: {}", shown(name), shown(summary)),
            _ => format!("cannot be used: {}", shown(profile.problem.as_deref().unwrap_or_default())),
        },
    };
    row(output, "profile", &profile)
}

fn print_phases(timeline: &PhaseTimeline, output: &mut impl Write) -> io::Result<()> {
    for (index, span) in timeline.spans.iter().enumerate() {
        let clock = match timeline.source {
            PhaseSource::Vehicle => "T+",
            PhaseSource::Telemetry => "the station's clock",
        };
        let from = if index == 0 {
            format!("   ({clock}, from the {})", timeline.source.name())
        } else {
            String::new()
        };
        let name = if index == 0 { "phases" } else { "" };
        row(output, name, &format!("{:>9.3} to {:>9.3} s  {}{from}", span.from_s, span.until_s, span.phase))?;
    }
    if timeline.further_changes > 0 {
        row(output, "", &format!("and {} more", counted(timeline.further_changes, "change")))?;
    }
    Ok(())
}

fn print_verdict(info: &Info, output: &mut impl Write) -> io::Result<()> {
    if let Some(ending) = &info.ending {
        row(output, "verdict", &shown(ending))?;
    }
    let Some(verdict) = &info.verdict else {
        return Ok(());
    };
    let contact = info.clocks.words(verdict.contact());
    row(output, "", &format!("touchdown at {contact}"))?;
    let by = if verdict.table_2.is_empty() { "" } else { "by the limits of the legs:" };
    for (title, limits) in [(by, &verdict.limits), ("by the landing paper's Table 2:", &verdict.table_2)] {
        if !title.is_empty() && !limits.is_empty() {
            row(output, "", title)?;
        }
        for limit in limits {
            let passed = if limit.passed { "inside" } else { "OUTSIDE" };
            let text = format!(
                "{:<14} {:>9.4} {:<6} {passed} {} to {}",
                shown(&limit.name),
                limit.value,
                shown(&limit.unit),
                rounded(limit.minimum),
                rounded(limit.maximum)
            );
            row(output, "", &text)?;
        }
    }
    Ok(())
}

fn print_frames(frames: &FrameFacts, output: &mut impl Write) -> io::Result<()> {
    let FrameFacts { first, last, restarts, lost, repeated, start, solve_time, .. } = frames;
    let start = if *start { "" } else { ", start NOT RECORDED" };
    let lost = match lost {
        0 => "none lost".to_owned(),
        gaps => format!("{} LOST", counted(*gaps as u64, "gap")),
    };
    let restarts = counted(*restarts as u64, "restart");
    row(output, "frames", &format!("{first} to {last}, {restarts}, {lost}{start}"))?;
    if *repeated > 0 {
        row(output, "", &format!("{repeated} repeated"))?;
    }
    let text = solve_time.as_ref().map_or_else(
        || "not recorded: simulated without a clock".to_owned(),
        |times| format!("{}, of {} that planned", solve_time_text(times), counted(times.count, "frame")),
    );
    row(output, "solve time", &text)
}

fn solve_time_text(times: &SolveTimes) -> String {
    format!(
        "median {:.2} ms, p99 {:.2} ms, worst {:.2} ms; deadline {:.0} ms: {} over it",
        times.median_s * 1e3,
        times.p99_s * 1e3,
        times.max_s * 1e3,
        times.deadline_s * 1e3,
        times.over_deadline
    )
}

fn print_channels(channels: &[ChannelFacts], output: &mut impl Write) -> io::Result<()> {
    for (index, channel) in channels.iter().enumerate() {
        let ChannelFacts { topic, schema, messages, lost, unreadable, metadata, .. } = channel;
        let mut remarks: Vec<String> = ["endpoint", "link"]
            .iter()
            .filter_map(|key| metadata.get(*key))
            .map(|value| shown(value))
            .collect();
        if *lost > 0 {
            remarks.push(format!("{lost} LOST"));
        }
        if *unreadable > 0 {
            remarks.push(format!("{unreadable} UNREADABLE"));
        }
        let text =
            format!("{:<16} {messages:>8}  {:<31} {}", shown(topic), shown(schema), remarks.join(", "));
        row(output, if index == 0 { "channels" } else { "" }, &text)?;
    }
    Ok(())
}

/// Only the beginning of a hash; JSON has all of it.
fn short(value: &str) -> String {
    const HASH_MIN: usize = 40;
    const SHOWN: usize = 12;
    let hash = value.len() >= HASH_MIN && value.bytes().all(|byte| byte.is_ascii_hexdigit());
    shown(if hash { &value[..SHOWN] } else { value })
}

/// Rounds away the error of converting degrees to radians and back.
fn rounded(limit: f64) -> f64 {
    (limit * 1e6).round() / 1e6
}

fn or_none(text: String) -> String {
    if text.is_empty() { "none".to_owned() } else { text }
}

fn size_text(bytes: u64) -> String {
    match bytes {
        0..10_000 => format!("{bytes} bytes"),
        10_000..10_000_000 => format!("{:.0} kB", bytes as f64 / 1e3),
        _ => format!("{:.1} MB", bytes as f64 / 1e6),
    }
}

/// To the millisecond.
fn utc(unix_ns: u64) -> String {
    const MILLISECOND_NS: u64 = 1_000_000;
    OffsetDateTime::from_unix_timestamp_nanos(i128::from(unix_ns - unix_ns % MILLISECOND_NS))
        .ok()
        .and_then(|time| time.format(&Rfc3339).ok())
        .unwrap_or_else(|| format!("{unix_ns} ns"))
}

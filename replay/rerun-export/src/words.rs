//! Records events, phases and the verdict as text.

use std::fmt::Write as _;

use protocol::log::record::EventLevel;
use protocol::log::v1::LandingVerdict;
use protocol::text::printable;
use rerun::archetypes::{TextDocument, TextLog};
use rerun::components::{MediaType, TextLogLevel};
use rerun::{RecordingStream, RecordingStreamResult};

use crate::entity;
use crate::survey::{StampedEvent, Survey};

/// Records an event.
pub(crate) fn event(recording: &RecordingStream, event: &StampedEvent) -> RecordingStreamResult<()> {
    let level = match event.level {
        EventLevel::Info => TextLogLevel::INFO,
        EventLevel::Warning => TextLogLevel::WARN,
        EventLevel::Error => TextLogLevel::ERROR,
        EventLevel::Fatal => TextLogLevel::CRITICAL,
    };
    recording.log(entity::EVENTS, &TextLog::new(event.text.as_str()).with_level(level))
}

/// Records that a phase began.
pub(crate) fn phase(recording: &RecordingStream, name: &str) -> RecordingStreamResult<()> {
    recording.log(entity::PHASES, &TextLog::new(format!("phase {name}")).with_level(TextLogLevel::INFO))
}

/// Records the verdict at its time.
pub(crate) fn verdict(recording: &RecordingStream, verdict: &LandingVerdict) -> RecordingStreamResult<()> {
    let broken: Vec<String> = verdict
        .limits
        .iter()
        .filter(|limit| !limit.passed)
        .map(|limit| printable(limit.name.as_bytes()))
        .collect();
    let (text, level) = if verdict.landed {
        ("touchdown: LANDED inside every limit".to_owned(), TextLogLevel::INFO)
    } else {
        (format!("touchdown outside its limits: {}", broken.join(", ")), TextLogLevel::ERROR)
    };
    recording.log(entity::VERDICT, &TextLog::new(text).with_level(level))
}

/// Records the result of running the controller again.
pub(crate) fn replay(recording: &RecordingStream, text: &str) -> RecordingStreamResult<()> {
    recording.log(entity::REPLAY, &TextLog::new(text).with_level(TextLogLevel::WARN))
}

/// Further facts about a log.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Remarks<'a> {
    /// What ended the reading early.
    pub(crate) damage: Option<&'a str>,
    /// The result of running the controller again.
    pub(crate) again: Option<&'a str>,
}

/// Records which flight this is and how it ended, as a document.
pub(crate) fn report(
    recording: &RecordingStream,
    log_name: &str,
    survey: &Survey,
    verdict: Option<&LandingVerdict>,
    remarks: Remarks<'_>,
) -> RecordingStreamResult<()> {
    let text = report_text(log_name, survey, verdict, remarks);
    let document = TextDocument::new(text).with_media_type(MediaType::MARKDOWN);
    recording.log_static(entity::REPORT, &document)
}

fn report_text(
    log_name: &str,
    survey: &Survey,
    verdict: Option<&LandingVerdict>,
    remarks: Remarks<'_>,
) -> String {
    let heading = match verdict {
        None => "No touchdown recorded",
        Some(verdict) if verdict.landed => "LANDED inside every limit",
        Some(_) => "Touchdown outside its limits",
    };
    let mut text = format!("# {heading}\n\n");
    if let Some(verdict) = verdict {
        text.push_str("| | value | limits | |\n|---|---|---|---|\n");
        for limit in &verdict.limits {
            let (name, unit) = (cell(&limit.name), cell(&limit.unit));
            let judged = if limit.passed { "ok" } else { "**FAILED**" };
            let _ = writeln!(
                text,
                "| {name} | {:.4} {unit} | {} to {} | {judged} |",
                limit.value, limit.minimum, limit.maximum
            );
        }
        text.push('\n');
    }
    if let Some(damage) = remarks.damage {
        let _ = writeln!(text, "**The log is damaged:** {damage}. Only what stands before is shown.\n");
    }
    if let Some(again) = remarks.again {
        let _ = writeln!(text, "The controller: {}.\n", cell(again));
    }
    let _ = writeln!(text, "Log `{}`", cell(log_name));
    if let Some(mission) = &survey.mission {
        let _ = writeln!(text, "\nMission **{}**: {}", cell(&mission.name), cell(&mission.summary));
    } else if let Some(problem) = &survey.profile_problem {
        let _ = writeln!(text, "\nThe profile in it cannot be used: {}", cell(problem));
    }
    for (title, facts) in [("Run", &survey.run), ("Build", &survey.build)] {
        if !facts.is_empty() {
            let _ = writeln!(text, "\n| {title} | |\n|---|---|");
            for (name, value) in facts {
                let _ = writeln!(text, "| {} | {} |", cell(name), cell(value));
            }
        }
    }
    text
}

/// Escapes text from a log for a table cell.
fn cell(text: &str) -> String {
    printable(text.as_bytes()).replace('|', "/")
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::log::v1::LimitResult;

    #[test]
    fn the_report_says_the_verdict_first_and_what_failed() {
        let limit = LimitResult {
            name: "u".to_owned(),
            value: -0.75,
            minimum: -0.4,
            maximum: 0.4,
            unit: "m/s".to_owned(),
            passed: false,
        };
        let verdict = LandingVerdict { limits: vec![limit], landed: false, ..LandingVerdict::default() };
        let remarks = Remarks { damage: Some("cut"), again: Some("run again") };
        let text = report_text("a|b.mcap", &Survey::default(), Some(&verdict), remarks);
        assert!(text.starts_with("# Touchdown outside its limits\n"), "{text}");
        assert!(text.contains("| u | -0.7500 m/s | -0.4 to 0.4 | **FAILED** |"), "{text}");
        assert!(text.contains("damaged:** cut") && text.contains("`a/b.mcap`"), "{text}");
        assert!(text.contains("The controller: run again."), "{text}");
    }
}

//! The page after a flight: verdict, limits, what went wrong, height and place.

use std::time::Duration;

use protocol::dialect::TdPhase;
use ratatui::Frame;
use ratatui::layout::Constraint::{Fill, Length, Percentage};
use ratatui::layout::Rect;
use ratatui::text::Line;

use super::flight::LIMIT_ROWS;
use crate::model::{Act, Model, RED_AFTER};
use crate::view::band::{Room, draw_band};
use crate::view::shared::{FROM_ABOVE, events, height, map};
use crate::view::widgets::{columns, rows, table};
use crate::view::{TextRole, Theme, bars, fixed, headline, lists, panels};

/// Columns of the time before a finding.
const FINDING_TIME_COLUMNS: usize = 10;

const FINDINGS_TITLE: &str = "what went wrong";

/// Draws the verdict in large letters with its sentence, the limits as bars, the whole flight and
/// the place.
pub fn draw_review(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let ended = panels::ending_role(model, now).map(|(ending, role)| (ending.sentence(&model.vehicle), role));
    let settles = model.vehicle.phase_now() == Some(TdPhase::TD_PHASE_TOUCHDOWN);
    let none = if settles {
        ("at the ground; the vehicle judges its landing once it is at rest".to_owned(), TextRole::Plain)
    } else {
        ("no verdict received yet".to_owned(), TextRole::Caution)
    };
    let (words, role) = ended.unwrap_or(none);
    let silent = silence_words(model, now).map_or_else(String::new, |words| format!("; {words}"));
    let report = Act::Report.works(model, now);
    let report = report.then(|| theme.label(format!("  {} writes the report", Act::Report.key_name())));
    let mut sentence = Line::from(theme.span(format!(" {words}{silent}"), role));
    // A small screen has no room behind a long sentence.
    let room_for = usize::from(area.width.saturating_sub(sentence.width() as u16));
    sentence.extend(report.filter(|report| report.width() <= room_for));
    let area = draw_band((&headline::verdict(model, now), sentence, &[]), theme, frame, area);
    if Room::of(frame.area()) == Room::Small {
        let [left, mut right] = columns(area, [Fill(6), Fill(5)]);
        let found = findings(model, theme, usize::from(right.width.saturating_sub(2)));
        if model.vehicle.findings.count.is_some_and(|count| count > 0) {
            // What went wrong first: half of the panel's height at most, or all of it where the
            // pictures have no room.
            let wanted = u16::try_from(found.len()).unwrap_or(u16::MAX).saturating_add(2);
            let taken = if area.height < 14 { area.height } else { wanted.min(area.height / 2) };
            let [above, below] = rows(right, [Length(taken), Fill(1)]);
            table(FINDINGS_TITLE, &found, theme, frame, above);
            right = below;
        }
        let [limits, below] = rows(left, [Length(LIMIT_ROWS.min(area.height)), Fill(1)]);
        bars::draw_limits(model, theme, now, frame, limits);
        if below.height > 5 {
            height(model, theme, now, frame, below);
            map(FROM_ABOVE, model, theme, now, frame, right);
        } else if right.height > 2 {
            let [place, flight] = columns(right, [Fill(1), Fill(1)]);
            map(FROM_ABOVE, model, theme, now, frame, place);
            height(model, theme, now, frame, flight);
        }
        return;
    }
    let [above, below] = rows(area, [Fill(1), Length(LIMIT_ROWS)]);
    let [left, right] = columns(above, [Percentage(60), Fill(1)]);
    height(model, theme, now, frame, left);
    map(FROM_ABOVE, model, theme, now, frame, right);
    let [left, middle, right] = columns(below, [Percentage(42), Percentage(30), Fill(1)]);
    bars::draw_limits(model, theme, now, frame, left);
    let lines = findings(model, theme, usize::from(middle.width.saturating_sub(2)));
    table(FINDINGS_TITLE, &lines, theme, frame, middle);
    events(model, theme, frame, right);
}

/// The vehicle's findings of what went wrong, each with its T+.
fn findings(model: &Model, theme: Theme, columns: usize) -> Vec<Line<'static>> {
    let findings = &model.vehicle.findings;
    let label = |words| vec![theme.line(words, TextRole::Label)];
    let count = match findings.count {
        None => return label(" not reported yet"),
        Some(0) if model.vehicle.verdict().is_none() => return label(" none reported so far"),
        Some(0) => return label(" nothing went wrong"),
        Some(count) => count,
    };
    let arrived = findings.in_time();
    let missing = usize::from(count).saturating_sub(arrived.len());
    let room = columns.saturating_sub(FINDING_TIME_COLUMNS).max(8);
    let mut lines = Vec::new();
    for (since_s, words) in arrived {
        let time = format!(" T+{:<7}", fixed(since_s, 1));
        for (row, part) in lists::wrap(words, room).into_iter().enumerate() {
            let time = if row == 0 { time.clone() } else { " ".repeat(FINDING_TIME_COLUMNS) };
            lines.push(Line::from(vec![theme.label(time), theme.span(part, TextRole::Caution)]));
        }
    }
    if missing > 0 {
        lines.push(theme.line(format!(" {missing} more not received yet"), TextRole::Label));
    }
    lines
}

/// The longest silence of a flight, if it was long enough to count.
fn silence_words(model: &Model, now: Duration) -> Option<String> {
    let silence = Some(model.history.silence).filter(|silence| *silence > RED_AFTER)?;
    if model.vehicle.in_flight() && !model.link.state(now).carries() {
        return Some("link LOST before touchdown".to_owned());
    }
    Some(format!("silent for {} s of the flight", fixed(silence.as_secs_f64(), 1)))
}

//! The event list and the link's figures.

use std::time::Duration;

use protocol::log::record::EventLevel;
use ratatui::text::{Line, Span};

use super::theme::{Role, Theme};
use crate::model::link::RADIO_FRESH;
use crate::model::{self, Model};

/// Columns before an event's text: time, speaker, mark.
const BEFORE_TEXT: usize = 18;
/// Narrower than this, a text is cut rather than wrapped.
const WRAP_COLUMNS_MIN: usize = 20;

/// The newest events in this many lines of this width, oldest first; long texts wrap, because the end
/// of a refusal is its reason.
pub fn events(model: &Model, theme: Theme, columns: usize, rows: usize) -> Vec<Line<'static>> {
    let text_columns = columns.saturating_sub(BEFORE_TEXT);
    let mut lines: Vec<Line> = model
        .events
        .newest(rows)
        .flat_map(|event| {
            let role = match event.level {
                EventLevel::Info => Role::Plain,
                EventLevel::Warning => Role::Caution,
                EventLevel::Error | EventLevel::Fatal => Role::Alarm,
            };
            let head = format!("{:>7.1} {:<7} ", event.at.as_secs_f64(), event.speaker.name());
            let mark = event.mark();
            let mut pieces = wrap(&event.text, text_columns).into_iter();
            let first = pieces.next().unwrap_or_default();
            let first = Line::from(vec![
                Span::styled(head, theme.style(Role::Label)),
                Span::styled(format!("{mark}{first}"), theme.style(role)),
            ]);
            let rest = pieces.map(move |piece| {
                Line::from(vec![Span::raw(" ".repeat(BEFORE_TEXT)), Span::styled(piece, theme.style(role))])
            });
            std::iter::once(first).chain(rest).collect::<Vec<_>>()
        })
        .collect();
    lines.drain(..lines.len().saturating_sub(rows));
    lines
}

/// Breaks a text at spaces; a word longer than a line is broken where the line ends.
fn wrap(text: &str, columns: usize) -> Vec<String> {
    if columns < WRAP_COLUMNS_MIN {
        return vec![text.to_owned()];
    }
    let mut lines = Vec::new();
    let (mut line, mut used) = (String::new(), 0);
    for word in text.split(' ') {
        let length = word.chars().count();
        if used > 0 && used + 1 + length > columns {
            lines.push(std::mem::take(&mut line));
            used = 0;
        } else if used > 0 {
            line.push(' ');
            used += 1;
        }
        for c in word.chars() {
            if used == columns {
                lines.push(std::mem::take(&mut line));
                used = 0;
            }
            line.push(c);
            used += 1;
        }
    }
    lines.push(line);
    lines
}

/// What the link carries, and how the log does, in a line of this width. What would be cut is left out:
/// half a number is a wrong one.
pub fn link(model: &Model, theme: Theme, now: Duration, columns: usize) -> Line<'static> {
    if let Some(why) = &model.link.trouble {
        return Line::styled(format!(" LINK DOWN {why}"), theme.style(Role::Alarm));
    }
    if model.link.reports.len() > 1 {
        return several_links(model, theme, now, columns);
    }
    let figures = model.link.stats.figures(now);
    let round_trip = match model.link.round_trip {
        Some(round_trip) => format!("{:.0} ms", round_trip.as_secs_f64() * 1_000.0),
        None => "--".to_owned(),
    };
    let loss = model.link.loss(now);
    let loss_role = if loss.is_some_and(|loss| loss > 0.05) { Role::Caution } else { Role::Plain };
    let unsigned = model.link.signing.map_or(0, |signing| signing.rejected());
    let rejected =
        model.link.framing.crc_errors + model.link.framing.unknown_ids + model.link.undecodable + unsigned;
    let span = |text: String, role: Role| Span::styled(text, theme.style(role));
    let capacity = model.settings.link_capacity_bytes_s.map_or_else(String::new, |most| format!("/{most}"));
    let received = span(format!(" rx {:.0}{capacity} B/s", figures.rx_bytes_s), Role::Plain);
    let refused = (rejected > 0 || model.link.send_drops > 0)
        .then(|| span(format!("  rejected {rejected}  unsent {}", model.link.send_drops), Role::Caution));
    // In the order of their weight; what comes first has room in the narrowest panel.
    let mut pieces = vec![received, span(format!("  loss {}", percent(loss)), loss_role)];
    pieces.push(log(model, theme));
    pieces.extend(refused);
    pieces.push(span(format!("  rtt {round_trip}"), Role::Plain));
    pieces.extend(radio(model, now).map(|words| span(words, Role::Plain)));
    pieces.push(span(format!("  tx {:.0} B/s", figures.tx_bytes_s), Role::Plain));
    let mut used = 0;
    let fits = |piece: &Span| {
        used += piece.width();
        used <= columns
    };
    Line::from(pieces.into_iter().take_while(fits).collect::<Vec<_>>())
}

/// A share that was lost; where nothing arrives, nobody can tell.
pub fn percent(share: Option<f64>) -> String {
    share.map_or_else(|| "unknown".to_owned(), |share| format!("{:.1} %", share * 100.0))
}

/// What a radio says of itself: signal and noise, here and at the other end, in its own units.
fn radio(model: &Model, now: Duration) -> Option<String> {
    let (radio, at) = model.link.radio.as_ref()?;
    let fresh = now.saturating_sub(*at) < RADIO_FRESH;
    fresh.then(|| {
        let [rssi, remote, noise, remote_noise] =
            [radio.rssi, radio.remrssi, radio.noise, radio.remnoise].map(known);
        format!("  rssi {rssi}/{remote} noise {noise}/{remote_noise}")
    })
}

/// 255 says that it is not known.
fn known(value: u8) -> String {
    if value == u8::MAX { "--".to_owned() } else { value.to_string() }
}

/// Several links to one vehicle: what is left of the loss, and each link by itself as far as there is room.
fn several_links(model: &Model, theme: Theme, now: Duration, columns: usize) -> Line<'static> {
    let all = model.link.loss(now);
    let role = |loss: f64| if loss > 0.05 { Role::Caution } else { Role::Plain };
    let mut spans = vec![
        Span::styled(
            format!(" {} links, loss {}", model.link.reports.len(), percent(all)),
            theme.style(role(all.unwrap_or(0.0))),
        ),
        log(model, theme),
    ];
    if let Some(refused) = model.link.signing.map(|signing| signing.rejected()).filter(|refused| *refused > 0)
    {
        spans.push(Span::styled(format!("  refused {refused}"), theme.style(Role::Caution)));
    }
    let mut used: usize = spans.iter().map(Span::width).sum();
    for report in &model.link.reports {
        let kind = report.name.split(':').next().unwrap_or_default();
        let span = if report.trouble.is_some() {
            Span::styled(format!("  {kind} DOWN"), theme.style(Role::Alarm))
        } else {
            let (rate, loss) = (report.figures.rx_bytes_s, report.figures.loss);
            let capacity = report.capacity_bytes_s.map_or_else(String::new, |most| format!("/{most}"));
            let known = (report.figures.rx_frames_s > 0.0).then_some(loss);
            let words = format!("  {kind} {rate:.0}{capacity} B/s {}", percent(known));
            Span::styled(words, theme.style(role(loss)))
        };
        used += span.width();
        if used > columns {
            break;
        }
        spans.push(span);
    }
    if let Some(words) = radio(model, now).filter(|words| used + words.len() <= columns) {
        spans.push(Span::styled(words, theme.style(Role::Plain)));
    }
    Line::from(spans)
}

fn log(model: &Model, theme: Theme) -> Span<'static> {
    let (words, role) = if model.settings.role == model::Role::Replaying {
        ("  replay".to_owned(), Role::Plain)
    } else if model.settings.log_path.is_none() {
        ("  no log".to_owned(), Role::Caution)
    } else if model.log.failed {
        ("  LOG FAILED".to_owned(), Role::Alarm)
    } else if model.log.dropped > 0 {
        (format!("  log runs, {} DROPPED", model.log.dropped), Role::Caution)
    } else {
        ("  log ok".to_owned(), Role::Good)
    };
    Span::styled(words, theme.style(role))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_wrap_at_spaces_and_keep_every_character() {
        assert_eq!(wrap("one two", 20), ["one two"]);
        assert_eq!(wrap("arming refused: pin: found in", 20), ["arming refused: pin:", "found in"]);
        assert_eq!(wrap(&"x".repeat(45), 20).concat().len(), 45);
        assert_eq!(wrap("", 20), [""]);
    }
}

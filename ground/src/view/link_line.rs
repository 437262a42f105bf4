//! One line about the link and the log: rates, loss, rejected frames, radio, whether the log records.

use std::time::Duration;

use ratatui::text::{Line, Span};

use super::theme::{TextRole, Theme};
use crate::model::link::RADIO_FRESH;
use crate::model::{Model, Role};

/// The line in this width. Parts that do not fit are left out whole, because half a number would be wrong.
pub fn link(model: &Model, theme: Theme, now: Duration, columns: usize) -> Line<'static> {
    if model.look_back.is_some() {
        return Line::styled(" link: only live", theme.style(TextRole::Label));
    }
    if let Some(why) = &model.link.trouble {
        return Line::styled(format!(" LINK DOWN {why}"), theme.style(TextRole::Alarm));
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
    let loss_role = if loss.is_some_and(|loss| loss > 0.05) { TextRole::Caution } else { TextRole::Plain };
    let unsigned = model.link.signing.map_or(0, |signing| signing.rejected());
    let rejected =
        model.link.framing.crc_errors + model.link.framing.unknown_ids + model.link.undecodable + unsigned;
    let span = |text: String, role: TextRole| Span::styled(text, theme.style(role));
    let capacity = model.settings.link_capacity_bytes_s.map_or_else(String::new, |most| format!("/{most}"));
    let received = span(format!(" rx {:.0}{capacity} B/s", figures.rx_bytes_s), TextRole::Plain);
    let refused = (rejected > 0 || model.link.send_drops > 0)
        .then(|| span(format!("  rejected {rejected}  unsent {}", model.link.send_drops), TextRole::Caution));
    // The most important parts first, so that they fit into the narrowest panel.
    let mut pieces = vec![received, span(format!("  loss {}", percent(loss)), loss_role)];
    pieces.push(log(model, theme));
    pieces.extend(refused);
    pieces.push(span(format!("  rtt {round_trip}"), TextRole::Plain));
    pieces.extend(radio(model, now).map(|words| span(words, TextRole::Plain)));
    pieces.push(span(format!("  tx {:.0} B/s", figures.tx_bytes_s), TextRole::Plain));
    let mut used = 0;
    let fits = |piece: &Span| {
        used += piece.width();
        used <= columns
    };
    Line::from(pieces.into_iter().take_while(fits).collect::<Vec<_>>())
}

/// A loss in percent; unknown while nothing arrives.
pub fn percent(share: Option<f64>) -> String {
    share.map_or_else(|| "unknown".to_owned(), |share| format!("{:.1} %", share * 100.0))
}

/// A radio's report about itself: signal and noise at both ends, in its own units.
fn radio(model: &Model, now: Duration) -> Option<String> {
    let (radio, at) = model.link.radio.as_ref()?;
    let fresh = now.saturating_sub(*at) < RADIO_FRESH;
    fresh.then(|| {
        let [rssi, remote, noise, remote_noise] =
            [radio.rssi, radio.remrssi, radio.noise, radio.remnoise].map(known);
        format!("  rssi {rssi}/{remote} noise {noise}/{remote_noise}")
    })
}

/// 255 means unknown.
fn known(value: u8) -> String {
    if value == u8::MAX { "--".to_owned() } else { value.to_string() }
}

/// The line for several links: the loss over all of them, then each link as far as there is room.
fn several_links(model: &Model, theme: Theme, now: Duration, columns: usize) -> Line<'static> {
    let all = model.link.loss(now);
    let role = |loss: f64| if loss > 0.05 { TextRole::Caution } else { TextRole::Plain };
    let mut spans = vec![
        Span::styled(
            format!(" {} links, loss {}", model.link.reports.len(), percent(all)),
            theme.style(role(all.unwrap_or(0.0))),
        ),
        log(model, theme),
    ];
    if let Some(refused) = model.link.signing.map(|signing| signing.rejected()).filter(|refused| *refused > 0)
    {
        spans.push(Span::styled(format!("  refused {refused}"), theme.style(TextRole::Caution)));
    }
    let mut used: usize = spans.iter().map(Span::width).sum();
    for report in &model.link.reports {
        let kind = report.name.split(':').next().unwrap_or_default();
        let span = if report.trouble.is_some() {
            Span::styled(format!("  {kind} DOWN"), theme.style(TextRole::Alarm))
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
        spans.push(Span::styled(words, theme.style(TextRole::Plain)));
    }
    Line::from(spans)
}

fn log(model: &Model, theme: Theme) -> Span<'static> {
    let (words, role) = if model.settings.role == Role::Replaying {
        ("  replay".to_owned(), TextRole::Plain)
    } else if model.settings.log_path.is_none() {
        ("  no log".to_owned(), TextRole::Caution)
    } else if model.log.failed {
        ("  STATION LOG FAILED".to_owned(), TextRole::Alarm)
    } else if model.log.dropped > 0 {
        (format!("  log runs, {} DROPPED", model.log.dropped), TextRole::Caution)
    } else {
        ("  log ok".to_owned(), TextRole::Good)
    };
    Span::styled(words, theme.style(role))
}

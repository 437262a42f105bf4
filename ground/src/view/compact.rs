//! The screen below 80x24, down to 20x5 and less: lines, the most important first.

use std::time::Duration;

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Paragraph, Wrap};

use super::number::{STALE_MARK, fixed};
use super::theme::{Role, Theme};
use super::{actuators, controller, dialog, draw_lines, happenings, top, touchdown};
use crate::model::Model;
use crate::model::command::CommandKind;
use crate::model::vehicle::Sample;

/// Lines that no dialog covers.
const FIXED_ROWS: u16 = 3;

/// Draws everything that fits.
pub fn draw(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let mut lines = vec![
        Line::from(vec![top::phase(model, theme, now), Span::raw(" "), top::armed(model, theme, now)]),
        Line::from(vec![top::countdown(model, theme, now), Span::raw("  "), top::link(model, theme, now)]),
        abort(model, theme, now),
    ];
    if let Some((_, text)) = dialog::lines(model, theme, now) {
        draw_lines(frame, area, &lines);
        let fixed = FIXED_ROWS.min(area.height);
        let below = Rect { y: area.y + fixed, height: area.height - fixed, ..area };
        frame.render_widget(Paragraph::new(text).wrap(Wrap { trim: false }), below);
        return;
    }
    lines.extend(top::pad_wait(model, theme));
    lines.push(motion(model, theme, now));
    let rows = usize::from(area.height);
    // The newest event earns a line before anything else does.
    lines.extend(happenings_short(model, theme));
    // An abort has its place above.
    if let Some(track) = model.commands.tracks.iter().rfind(|track| track.kind != CommandKind::Abort) {
        lines.push(top::facts_short(track, theme, now));
    }
    lines.push(attitude(model, theme, now));
    let (title, touchdown) = touchdown::panel(model, theme, now);
    let mut verdict = Line::styled(format!(" {title}: "), theme.style(Role::Label));
    verdict.spans.extend(touchdown.into_iter().next_back().into_iter().flat_map(|line| {
        let style = line.style;
        line.spans.into_iter().map(move |span| span.patch_style(style))
    }));
    lines.push(verdict);
    lines.extend(controller::rows(model, theme, now).into_iter().take(2));
    lines.extend(actuators::gimbal_rows(model, theme, now).into_iter().take(2));
    lines.extend(actuators::fin_rows(model, theme, now));
    lines.push(happenings::link(model, theme, now, usize::from(area.width)));
    let room = rows.saturating_sub(lines.len());
    lines.extend(happenings::events(model, theme, usize::from(area.width), room));
    draw_lines(frame, area, &lines);
}

fn abort(model: &Model, theme: Theme, now: Duration) -> Line<'static> {
    let line = top::abort(model, theme, now);
    if model.abort_chord.is_begun(now) {
        return line;
    }
    if let Some(track) = model.commands.of(CommandKind::Abort) {
        return top::facts_short(track, theme, now);
    }
    let mut spans = vec![Span::styled(" ^X^X ABORT:", theme.style(Role::Key))];
    spans.extend(line.spans.into_iter().skip(1).flat_map(|span| [Span::raw(" "), span]));
    Line::from(spans)
}

fn value(
    theme: Theme,
    label: &str,
    sample: Option<Sample<f64>>,
    decimals: usize,
    now: Duration,
) -> Vec<Span<'static>> {
    let text = sample.map_or_else(|| "--".to_owned(), |sample| fixed(sample.value, decimals));
    let stale = sample.is_some_and(|sample| sample.is_stale(now));
    let mark = if stale { STALE_MARK } else { "" };
    let role = if stale { Role::Stale } else { Role::Plain };
    vec![
        Span::styled(format!(" {label} "), theme.style(Role::Label)),
        Span::styled(format!("{mark}{text}"), theme.style(role)),
    ]
}

fn motion(model: &Model, theme: Theme, now: Duration) -> Line<'static> {
    let motion = model.vehicle.best_motion();
    let altitude =
        motion.map(|motion| Sample { value: motion.value.altitude_m, received_at: motion.received_at });
    let climb =
        motion.map(|motion| Sample { value: motion.value.climb_m_s, received_at: motion.received_at });
    let mut spans = value(theme, "alt", altitude, 1, now);
    spans.extend(value(theme, "vz", climb, 1, now));
    Line::from(spans)
}

fn attitude(model: &Model, theme: Theme, now: Duration) -> Line<'static> {
    let body = model.vehicle.body_speed();
    let attitude = model.vehicle.attitude;
    let u = body.map(|body| Sample { value: body.value.u_m_s, received_at: body.received_at });
    let w = body.map(|body| Sample { value: body.value.w_m_s, received_at: body.received_at });
    let pitch = attitude.map(|attitude| Sample {
        value: attitude.value.pitch_rad.to_degrees(),
        received_at: attitude.received_at,
    });
    let mut spans = value(theme, "pitch", pitch, 1, now);
    spans.extend(value(theme, "u", u, 1, now));
    spans.extend(value(theme, "w", w, 2, now));
    Line::from(spans)
}

fn happenings_short(model: &Model, theme: Theme) -> Option<Line<'static>> {
    let event = model.events.newest(1).next()?;
    Some(Line::styled(format!(" {}{}", event.mark().trim_start(), event.text), theme.style(Role::Plain)))
}

//! Values as bars: the limits of a touchdown with their marks, fins and gimbal.

use std::time::Duration;

use protocol::dialect::TdLanding;
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::{Line, Span};

use super::panels::{decimals, limit_rows};
use super::theme::Ink;
use super::{STALE_MARK, TextRole, Theme, age_mark, draw_line, fixed, shortest, widgets};
use crate::model::{Deflection, Ending, Gimbal, Model, Sample, Verdict, words};

/// Position of the limit on a bar, as a share, so that an excess can be seen.
const LIMIT_AT: f64 = 0.8;
/// Columns before the bar of a limit: mark, name and value.
const BEFORE_BAR: u16 = 19;
/// Columns of a limit with its unit.
const LIMIT_COLUMNS: u16 = 11;
/// Maximum columns of a bar: a longer one shows no more.
const BAR_COLUMNS: u16 = 30;
/// The widest panel without room for the limits.
const NARROW: u16 = 40;

/// Two marks with their words, at the right end of a title.
pub fn legend(measured: [&'static str; 2], predicted: [&'static str; 2], theme: Theme) -> Line<'static> {
    let of = |[mark, words]: [&'static str; 2], ink| {
        [Span::styled(mark, theme.ground().fg(theme.ink(ink))), theme.label(words)]
    };
    Line::from([of(measured, Ink::Measured), of(predicted, Ink::Predicted)].concat())
}

/// A bar in one row from one share of it to another, with a mark across it. Half a row high, so
/// that rows stay apart.
fn bar([from, to]: [f64; 2], ink: Style, mark: Option<(f64, Style)>, frame: &mut Frame, at: Rect) {
    if at.width < 3 || at.height == 0 {
        return;
    }
    let at = Rect { width: at.width.min(BAR_COLUMNS), ..at };
    let column = |share: f64| {
        let share = if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 };
        (share * f64::from(at.width)).round() as u16
    };
    let (begin, end) = (column(from.min(to)), column(from.max(to)));
    frame.buffer_mut().set_string(at.x + begin, at.y, "▄".repeat((end - begin).into()), ink);
    if let Some((place, style)) = mark {
        let column = (place.clamp(0.0, 1.0) * f64::from(at.width - 1)).round() as u16;
        frame.buffer_mut().set_string(at.x + column, at.y, "│", style);
    }
}

/// Draws the panel of the six limits: reached or predicted, each with its mark.
pub fn draw_limits(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let vehicle = &model.vehicle;
    let judged = vehicle.verdict().map(|verdict| verdict.map(|verdict| verdict.touchdown));
    let predicted = vehicle.prediction.map(|prediction| prediction.map(|prediction| prediction.touchdown));
    let is_judged = judged.is_some();
    let title = if is_judged { "touchdown" } else { "touchdown predicted" };
    let Some(at) = judged.or(predicted) else {
        let inside = widgets::framed(title, Line::default(), theme, frame, area);
        return draw_line(frame, inside, theme.line(" no prediction", TextRole::Label));
    };
    let in_table_2 = |verdict: Sample<Verdict>| verdict.value.landing.contains(TdLanding::TD_LANDING_TABLE_2);
    let under_parachute = Ending::of(vehicle, now) == Some(Ending::UnderParachute);
    let outside_table_2 = !under_parachute && vehicle.verdict().is_some_and(|verdict| !in_table_2(verdict));
    let rows = limit_rows(&at.value, vehicle.limits().as_ref(), under_parachute);
    let failed: Vec<_> = rows.iter().filter(|row| !row.is_met).map(|row| row.name).collect();
    let words = match () {
        () if !failed.is_empty() => theme.line(format!(" OUTSIDE {} ", failed.join(", ")), TextRole::Alarm),
        () if under_parachute => theme.line(" under the parachute ", TextRole::Label),
        () if outside_table_2 => theme.line(" T2: the paper's Table 2 ", TextRole::Caution),
        () => theme.line(" inside the envelope ", TextRole::Good),
    };
    let words = Some(words).filter(|words| words.width() + title.len() + 4 <= usize::from(area.width));
    let words = words.unwrap_or_default();
    let inside = widgets::framed(title, words, theme, frame, area);
    let (mark, role) = if is_judged { (" ", TextRole::Plain) } else { age_mark(&at, now, TextRole::Plain) };
    let ink = theme.ground().fg(theme.ink(if is_judged { Ink::Measured } else { Ink::Predicted }));
    let limit_ink = theme.ground().fg(theme.ink(Ink::Limit));
    let limit_columns = if inside.width < NARROW { 0 } else { LIMIT_COLUMNS };
    for (row, y) in rows.into_iter().zip(inside.top()..inside.bottom()) {
        let at = Rect { y, height: 1, ..inside };
        let table_2 = outside_table_2 && row.is_met && row.value.abs() > row.table_2;
        let (word, word_role) = match () {
            () if !row.is_met => ("NO", TextRole::Alarm),
            () if table_2 => ("T2", TextRole::Caution),
            () if row.limit.is_empty() => ("  ", TextRole::Plain),
            () => ("ok", TextRole::Good),
        };
        let limit =
            if table_2 { format!("T2 {} {}", shortest(row.table_2), row.unit) } else { row.limit.clone() };
        let value = format!("{mark}{:>5}", fixed(row.value, decimals(row.value)));
        let name = theme.label(format!(" {:<8}", row.name));
        let words = [theme.span(word, word_role), name, theme.span(value, strong(role))];
        draw_line(frame, at, Line::from_iter(words));
        let room = at.width.saturating_sub(BEFORE_BAR + limit_columns);
        let limit_at = if table_2 { LIMIT_AT * row.used * row.table_2 / row.value.abs() } else { LIMIT_AT };
        let mark = row.used.is_finite().then_some((limit_at, limit_ink));
        bar([0.0, LIMIT_AT * row.used], ink, mark, frame, Rect { x: at.x + BEFORE_BAR, width: room, ..at });
        let words = theme.either_side(&format!(" {limit}"));
        let beside = Rect { x: at.right() - limit_columns, width: limit_columns, ..at };
        draw_line(frame, beside, Line::styled(words, limit_ink));
    }
}

/// The role of a value beside its bar.
fn strong(role: TextRole) -> TextRole {
    if role == TextRole::Plain { TextRole::Title } else { role }
}

/// Phase, and fins and gimbal as numbers: measured, and commanded behind the stroke, degrees. It
/// has the same columns in every phase.
pub fn surfaces_line(model: &Model, theme: Theme, now: Duration) -> Line<'static> {
    let vehicle = &model.vehicle;
    let mark = |stale: bool| if stale { STALE_MARK } else { " " };
    let pair = |angle: Option<Deflection>, text: fn(f64) -> String| {
        let text = |pick: fn(&Deflection) -> f64| {
            angle.map_or_else(|| "--".to_owned(), |at| text(pick(&at).to_degrees()))
        };
        format!("{}/{}", text(|at| at.measured_rad), text(|at| at.commanded_rad))
    };
    let rounded = |deg: f64| format!("{:>2}", fixed(deg, 0));
    // Of a large deflection the tenth is irrelevant.
    let signed = |deg: f64| {
        let sign = if deg < 0.0 { "" } else { "+" };
        format!("{:>4}", sign.to_owned() + &fixed(deg, usize::from(deg.abs() < 9.95)))
    };
    let (fins, gimbal) = (vehicle.fins(), vehicle.gimbal());
    let each: Vec<String> =
        (0..4).map(|k| format!("{:>5}", pair(fins.map(|fins| fins.value[k]), rounded))).collect();
    let phase = vehicle.phase_now().map_or_else(|| "no phase".to_owned(), words::phase);
    let of = |plane: fn(&Gimbal) -> Deflection| {
        format!("{:>9}", pair(gimbal.map(|gimbal| plane(&gimbal.value)), signed))
    };
    let (pitch, yaw) = (of(|gimbal| gimbal.pitch), of(|gimbal| gimbal.yaw));
    let fins_stale = fins.is_some_and(|fins| fins.is_stale(now));
    let gimbal_stale = gimbal.is_some_and(|gimbal| gimbal.is_stale(now));
    Line::from(vec![
        theme.span(format!(" {phase:<12}"), TextRole::Title),
        theme.label(" fins deg/cmd"),
        theme.plain(format!("{}{}", mark(fins_stale), each.join(" "))),
        theme.label(" gimbal"),
        theme.plain(format!("{}P{pitch} Y{yaw}", mark(gimbal_stale))),
    ])
}

/// Draws fins and gimbal: the measured angle as a bar, the commanded one as a mark.
pub fn draw_surfaces(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let legend = legend([" ▄", " is "], ["│", " cmd "], theme);
    let area = widgets::framed("fins, gimbal", legend, theme, frame, area);
    let (fins, gimbal) = (model.vehicle.fins(), model.vehicle.gimbal());
    let limit_deg = model.vehicle.limits().map(|limits| f64::from(limits.gimbal_limit_rad).to_degrees());
    let limit_deg = limit_deg.filter(|limit| limit.is_finite() && *limit > 0.0).unwrap_or(20.0);
    let fin = |k: usize| (format!("fin {}", k + 1), fins.map(|of| of.map(|fins| fins[k])), [0.0, 90.0], 0);
    let plane = |name: &str, angles| (name.to_owned(), angles, [-limit_deg, limit_deg], 1);
    let rows = (0..4).map(fin).chain([
        plane("pitch", gimbal.map(|gimbal| gimbal.map(|gimbal| gimbal.pitch))),
        plane("yaw", gimbal.map(|gimbal| gimbal.map(|gimbal| gimbal.yaw))),
    ]);
    for ((name, angles, [low, high], digits), y) in rows.zip(area.top()..area.bottom()) {
        let at = Rect { y, height: 1, ..area };
        let (mark, role) =
            angles.as_ref().map_or((" ", TextRole::Label), |angles| age_mark(angles, now, TextRole::Plain));
        let degrees = |pick: fn(&Deflection) -> f64| angles.map(|angles| pick(&angles.value).to_degrees());
        let (commanded, measured) = (degrees(|d| d.commanded_rad), degrees(|d| d.measured_rad));
        let text = measured.map_or_else(|| "--".to_owned(), |deg| fixed(deg, digits));
        let words = [
            theme.label(format!(" {name:<6}")),
            theme.span(format!("{mark}{text:>5}"), strong(role)),
            theme.label(" deg"),
        ];
        draw_line(frame, at, Line::from_iter(words));
        let share = |deg: f64| (deg - low) / (high - low);
        let command_ink = theme.ground().fg(theme.ink(Ink::Predicted));
        let bar_at = Rect { x: at.x + 19, width: at.width.saturating_sub(20), ..at };
        let ink = theme.ground().fg(theme.ink(Ink::Measured));
        let mark = commanded.map(|deg| (share(deg), command_ink));
        bar([share(0.0), measured.map_or(share(0.0), share)], ink, mark, frame, bar_at);
    }
}

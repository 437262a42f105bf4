//! Height over time with what is to come.

use std::time::Duration;

use protocol::dialect::TdPhase;
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::widgets::canvas::Line;

use super::{Ink, TextRole, Theme, scales, seconds_since};
use crate::model::{Model, dead_reckoning::course, is_burning, quantity::Quantity};
use crate::view::footer::{LENGTHS_S, flight_began};
use crate::view::{fixed, widgets};

/// The least height and time that the picture shows.
const TOP_MIN_M: f64 = 10.0;
/// Rows and columns from one tick to the next, at least.
const TICK_ROWS: u16 = 3;
const TICK_COLUMNS: u16 = 7;

/// The heights flown until now, with their time since the lift-off.
fn flown(model: &Model, from: Duration, now: Duration) -> Vec<(f64, f64)> {
    let Some(height) = Quantity::named("height") else { return Vec::new() };
    let values = model.history.trace.values(height, from, now);
    values.map(|(at, height_m)| (seconds_since(at, from), height_m)).collect()
}

/// The lines between which a picture is told: a tick every so often.
fn ticks(span: f64, parts: u16) -> Vec<(f64, f64)> {
    let step = widgets::tick_step(span, usize::from(parts.max(2)));
    widgets::ticks(0.0, span, step).map(|at| (at, at)).collect()
}

/// Draws height over time: flown, predicted to the touchdown, where lighting lands, and the height below which no parachute opens.
pub fn draw_height(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    if area.width < 16 || area.height < 4 {
        return;
    }
    let vehicle = &model.vehicle;
    let from = flight_began(model).unwrap_or(now);
    let flown = flown(model, from, now);
    let present_s = seconds_since(now, from);
    let to_come: Vec<(f64, f64)> = course(vehicle, now)
        .into_iter()
        .map(|(ahead_s, [_, _, height_m])| (present_s + ahead_s, height_m))
        .collect();
    let known = |height: Option<f64>| height.filter(|height_m| height_m.is_finite() && *height_m > 0.0);
    let of = |pick| known(vehicle.of_descent(pick).map(|sample| sample.value));
    let falls = matches!(
        vehicle.phase_now(),
        Some(TdPhase::TD_PHASE_DEPLOY | TdPhase::TD_PHASE_AERO_DESCENT | TdPhase::TD_PHASE_LAND_ARMED)
    );
    let lights = falls && vehicle.may_light();
    let apogee_m = of(|d| d.apogee_m);
    let band = of(|d| d.band_low_m).zip(of(|d| d.band_high_m)).filter(|_| lights);
    let commit_m = of(|d| d.commit_height_m).filter(|_| falls);
    let reached = flown.iter().chain(&to_come).map(|(_, height_m)| *height_m).fold(TOP_MIN_M, f64::max);
    let top =
        [apogee_m, commit_m, band.map(|band| band.1)].into_iter().flatten().fold(reached, f64::max) * 1.08;
    let last_s = to_come.last().map_or(present_s, |(at, _)| *at).max(flown.last().map_or(0.0, |(at, _)| *at));
    let length_s = LENGTHS_S.into_iter().find(|length_s| last_s < *length_s).unwrap_or(last_s);
    let bounds = ([0.0, length_s], [-0.02 * top, top]);
    let across = ticks(length_s, area.width / TICK_COLUMNS);
    let plane = scales(bounds, (&across, &ticks(top, area.height / TICK_ROWS)), "T+ s", theme, frame, area);
    let height_m = vehicle.height_m().filter(|height| !height.is_stale(now) && vehicle.in_flight());
    let good = theme.style(TextRole::Good);
    plane.draw(theme, frame, |context| {
        let ahead = |height_m: f64| [(present_s, height_m), (length_s, height_m)];
        if let Some((low_m, high_m)) = band {
            for edge in [low_m, high_m] {
                plane.predicted(context, &ahead(edge), good.fg.unwrap_or_default());
            }
        }
        if let Some(y) = commit_m {
            context.draw(&Line { x1: present_s, y1: y, x2: length_s, y2: y, color: theme.ink(Ink::Limit) });
        }
        plane.predicted(context, &to_come, theme.ink(Ink::Predicted));
        plane.measured(context, &flown, theme.ink(Ink::Measured));
    });
    let ink = |ink| theme.ground().fg(theme.ink(ink));
    if let Some((low_m, high_m)) = band {
        let words = format!("band {}..{}", fixed(low_m, 0), fixed(high_m, 0));
        plane.write(frame, (length_s, f64::midpoint(low_m, high_m)), &words, good);
    }
    if let Some(commit_m) = commit_m {
        let above = (commit_m + 4.0 * plane.dot()).min(top);
        plane.write(frame, (length_s, above), &format!("commit {}", fixed(commit_m, 0)), ink(Ink::Limit));
    }
    marks(model, (from, &flown), apogee_m, theme, frame, &plane);
    if let Some((at, _)) = to_come.last().filter(|(_, height_m)| *height_m < 1.0) {
        plane.write(frame, (*at, 0.0), "×", ink(Ink::Predicted));
    }
    if let Some(height_m) = height_m {
        plane.write(frame, (present_s, height_m.value.max(0.0)), "●", theme.style(TextRole::Title));
    }
}

/// The highest point, expected or reached, and where the motor was lit.
fn marks(
    model: &Model,
    (from, flown): (Duration, &[(f64, f64)]),
    expected_m: Option<f64>,
    theme: Theme,
    frame: &mut Frame,
    plane: &super::Plane,
) {
    let highest = flown.iter().copied().reduce(|best, next| if next.1 > best.1 { next } else { best });
    let rises = matches!(model.vehicle.phase_now(), Some(TdPhase::TD_PHASE_BOOST | TdPhase::TD_PHASE_COAST));
    match highest {
        Some((at, _)) if rises => {
            if let Some(apogee_m) = expected_m {
                let words = format!("apogee {}", fixed(apogee_m, 0));
                let ink = theme.ground().fg(theme.ink(Ink::Predicted));
                plane.write(frame, (at.max(plane.x[0]), apogee_m), &words, ink);
            }
        }
        Some((at, height_m)) if at > 0.0 => {
            let below = (height_m - 6.0 * plane.dot()).max(0.0);
            let words = format!("{} m", fixed(height_m, 0));
            let begin = (at - 0.04 * plane.x[1]).max(plane.x[0]);
            plane.write(frame, (begin, below), &words, theme.style(TextRole::Label));
        }
        _ => {}
    }
    let lit = model.history.timeline.iter().find(|(phase, _)| is_burning(*phase));
    if let Some((_, at)) = lit {
        let at_s = seconds_since(*at, from);
        let height_m = flown.iter().find(|(time_s, _)| *time_s >= at_s).map(|(_, height_m)| *height_m);
        if let Some(height_m) = height_m {
            let style = theme.ground().fg(theme.ink(Ink::Flame));
            plane.write(frame, (at_s, height_m), "▲", style);
            plane.write(
                frame,
                (at_s + 0.04 * plane.x[1], height_m),
                &fixed(height_m, 0),
                theme.style(TextRole::Label),
            );
        }
    }
}

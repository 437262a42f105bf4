//! The ascent page: height gauge with the expected apogee, speed, tilt and booster, side views.

use std::time::Duration;

use protocol::dialect::{TD_DESCENT_DATA, TdBooster, TdPhase};
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::text::Line;

use super::flying::{self, of_descent};
use crate::model::motion::Motion;
use crate::model::vehicle::Sample;
use crate::model::{Model, words};
use crate::view::lost_position;
use crate::view::number::{age_mark, row, text_row};
use crate::view::theme::{TextRole, Theme};

pub fn draw(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let values = values(model, theme, now);
    flying::draw(model, ("Ascent", values), false, theme, now, frame, area);
}

/// For small screens: the values, with height and speed, which have no headline there.
pub fn lines(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let mut lines = values(model, theme, now);
    flying::insert_height(&mut lines, model, theme, now);
    lines
}

/// The values, the most important first.
fn values(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let mut lines = lost_position::rows(model, theme, now);
    let motion = model.vehicle.best_motion();
    let of = |pick| of_descent(model, pick);
    lines.push(motor(model, theme, now));
    lines.push(row(theme, "apogee at", of(|d| d.apogee_m), 0, "m", now));
    lines.push(row(theme, "apogee in", of(|d| d.time_to_apogee_s), 1, "s", now));
    let tilt = model.vehicle.attitude.map(|attitude| attitude.map(|a| a.tilt_rad.to_degrees()));
    lines.push(row(theme, "tilt", tilt, 1, "deg", now));
    lines.push(booster(model.vehicle.descent.as_ref(), theme, now));
    let horizontal = motion.map(|motion| motion.map(Motion::horizontal_m_s));
    let distance = motion.map(|motion| motion.map(Motion::distance_m));
    lines.push(row(theme, "horizontal", horizontal, 1, "m/s", now));
    lines.push(row(theme, "distance", distance, 1, "m", now));
    lines.push(row(theme, "down north", of(|d| d.touchdown_x_m), 0, "m", now));
    lines.push(row(theme, "down east", of(|d| d.touchdown_y_m), 0, "m", now));
    lines
}

/// What carries the vehicle up, in words.
fn motor(model: &Model, theme: Theme, now: Duration) -> Line<'static> {
    let Some(phase) = model.vehicle.phase() else {
        return Line::styled(" no data", theme.style(TextRole::Caution));
    };
    let (mark, role) = age_mark(&phase, now);
    let text = match phase.value {
        TdPhase::TD_PHASE_BOOST => "ascent motor: no cut-off",
        TdPhase::TD_PHASE_COAST => "coasting",
        _ => "not rising",
    };
    Line::styled(format!("{mark}{text}"), theme.style(role))
}

fn booster(descent: Option<&Sample<TD_DESCENT_DATA>>, theme: Theme, now: Duration) -> Line<'static> {
    let Some(descent) = descent else {
        return text_row(theme, "booster", " ", "no data", TextRole::Label, "");
    };
    let (mark, stale) = age_mark(descent, now);
    let text = words::lower_case(&descent.value.booster, "TD_BOOSTER_");
    let role = match descent.value.booster {
        TdBooster::TD_BOOSTER_SEPARATING => TextRole::Caution,
        TdBooster::TD_BOOSTER_SEPARATED => TextRole::Good,
        TdBooster::TD_BOOSTER_NONE | TdBooster::TD_BOOSTER_ATTACHED => TextRole::Plain,
    };
    text_row(theme, "booster", mark, &text, if stale == TextRole::Stale { stale } else { role }, "")
}

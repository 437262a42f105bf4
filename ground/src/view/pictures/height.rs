//! Height over time with what is to come.

use std::time::Duration;

use protocol::dialect::TdPhase;
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::widgets::canvas::Line;

use super::{Ink, TextRole, Theme, scales, seconds_since};
use crate::model::dead_reckoning::{predict_position, predicted_course};
use crate::model::{Model, flight_began, is_burning, quantity::Quantity};
use crate::view::fixed;
use crate::view::footer::{LENGTHS_S, recorded, shown_until};

/// The least height and time that the picture shows.
const TOP_MIN_M: f64 = 10.0;
/// Greatest heights that the picture of a burn shows, m, in steps.
const BURN_TOPS_M: [f64; 3] = [10.0, 20.0, 40.0];
/// Columns and rows from one tick to the next, at least.
const TICKS_APART: [u16; 2] = [7, 3];

/// Draws height over time: flown, predicted to the touchdown, the ignition band, the planned
/// ignition, and the height below which no parachute opens.
pub fn draw_height(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    if area.width < 16 || area.height < 4 {
        return;
    }
    let vehicle = &model.vehicle;
    let from = flight_began(model).unwrap_or(now);
    let until = shown_until(model, now);
    let present_s = seconds_since(until, from);
    let predicted_course = predicted_course(vehicle, now).into_iter();
    let to_come: Vec<_> = predicted_course.map(|(at, [.., up_m])| (seconds_since(at, from), up_m)).collect();
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
    let is_ignited = |(phase, _): &(TdPhase, Duration)| *phase == TdPhase::TD_PHASE_POWERED;
    let ignited = model.history.timeline.iter().any(is_ignited);
    let burn_at = vehicle.events.of(TdPhase::TD_PHASE_IGNITION).filter(|_| ignited);
    // The burn fills the picture, and its last metres most: they decide.
    let burns = vehicle.phase_now().is_some_and(is_burning) && until == now;
    let ignited_s = burn_at.map_or(present_s, |(burn_s, _)| burn_s.min(present_s));
    let height_m = vehicle.height_m().filter(|height| !height.is_stale(now) && vehicle.in_flight());
    let fits = |top_m: &f64| burns && height_m.is_some_and(|height| height.value < 0.9 * top_m);
    let zoom_m = BURN_TOPS_M.into_iter().find(fits).unwrap_or(f64::INFINITY);
    let heights = Quantity::named("height").map(|height| model.history.trace.values(height, from, until));
    let flown = heights.into_iter().flatten().map(|(at, height_m)| (seconds_since(at, from), height_m));
    let is_shown = |(at, m): &(f64, f64)| *at >= 0.0 && (!burns || (*at >= ignited_s - 1.0 && *m <= zoom_m));
    let flown: Vec<(f64, f64)> = flown.filter(is_shown).collect();
    let begins_s = flown.first().filter(|_| burns).map_or(0.0, |(at, _)| *at);
    let reached = flown.iter().chain(&to_come).map(|(_, height_m)| *height_m).fold(TOP_MIN_M, f64::max);
    let top = [apogee_m, commit_m, band.map(|of| of.1)].into_iter().flatten().fold(reached, f64::max) * 1.08;
    let last_s = to_come.last().map_or(present_s, |(at, _)| *at).max(flown.last().map_or(0.0, |(at, _)| *at));
    // Of a flight that is over as long as it was.
    let length_s = LENGTHS_S.into_iter().find(|most_s| until == now && last_s < *most_s).unwrap_or(last_s);
    let recorded_s = model.playing.as_ref().map(|playing| seconds_since(recorded(playing).1, from));
    let length_s = recorded_s.filter(|s| *s >= last_s).unwrap_or(length_s);
    let length_s = if burns { last_s.max(begins_s + 2.0) } else { length_s };
    let bounds = ([begins_s, length_s], [0.0, top]);
    let plane = scales(bounds, TICKS_APART, "T+ s", theme, frame, area);
    let highest = flown.iter().copied().reduce(|best, next| if next.1 > best.1 { next } else { best });
    // From the highest point on, so that neither they nor their names move.
    let since_s = highest.map_or(0.0, |(at, _)| at);
    let lights_m = of(|d| d.chosen_height_m).filter(|_| lights);
    // The vehicle's own time, as in the large number and on the time axis.
    let lights_at = vehicle.ignition_in_s(now).zip(lights_m).map(|(left, m)| (present_s + left.value, m));
    // The lines begin before it, with room for their names.
    let since_s = lights_at.map_or(since_s, |(at, _)| since_s.max(at - 0.2 * length_s));
    let good = theme.style(TextRole::Good);
    plane.draw(theme, frame, |context| {
        for edge in band.into_iter().flat_map(|(low_m, high_m)| [low_m, high_m]) {
            plane.predicted(context, &[(since_s, edge), (length_s, edge)], good.fg.unwrap_or_default());
        }
        if let Some(y) = commit_m {
            context.draw(&Line { x1: since_s, y1: y, x2: length_s, y2: y, color: theme.ink(Ink::Limit) });
        }
        plane.predicted(context, &to_come, theme.ink(Ink::Predicted));
        plane.measured(context, &flown, theme.ink(Ink::Measured));
    });
    let ink = |ink| theme.ground().fg(theme.ink(ink));
    let (label, predicted) = (theme.style(TextRole::Label), ink(Ink::Predicted));
    let lands_at = to_come.last().filter(|(_, height_m)| *height_m < 1.0).map(|(at, _)| (*at, 0.0));
    let here = height_m.map(|height_m| (present_s, height_m.value.max(0.0)));
    let lost_at = predict_position(vehicle, now).map(|at| (present_s, at.altitude_m));
    let marks = [
        (lost_at, "+", predicted),
        (burn_at, "▲", ink(Ink::Flame)),
        (lands_at, "×", predicted),
        (lights_at, "▲", predicted),
        (here, "●", theme.style(TextRole::Title)),
    ];
    for (at, mark, style) in marks.into_iter().filter_map(|(at, mark, style)| Some((at?, mark, style))) {
        plane.write(frame, at, mark, style);
    }
    let whole = |value: f64| fixed(value, 0);
    let words = |name: &str, (at_s, height_m): (f64, f64)| {
        let (height, time) = (format!("{} m", whole(height_m)), format!(", T+{}", fixed(at_s, 1)));
        vec![format!("{name}{height}{time}"), format!("{height}{time}"), height]
    };
    let rises = matches!(vehicle.phase_now(), Some(TdPhase::TD_PHASE_BOOST | TdPhase::TD_PHASE_COAST));
    let top = vehicle.events.of(TdPhase::TD_PHASE_DEPLOY).filter(|(at, _)| *at > 0.0);
    let labels = [
        lights_at.map(|at| ((since_s, at.1), words("ignition ", at), predicted)),
        band.filter(|_| lights_at.is_none()).map(|(low_m, high_m)| {
            let words = format!("band {}..{}", whole(low_m), whole(high_m));
            ((since_s, f64::midpoint(low_m, high_m)), vec![words], good)
        }),
        commit_m.map(|m| ((since_s, m), vec![format!("commit {}", whole(m))], ink(Ink::Limit))),
        apogee_m.filter(|_| rises).map(|m| ((since_s, m), vec![format!("apogee {}", whole(m))], predicted)),
        top.map(|at| (at, words("", at), label)),
        burn_at.map(|at| (at, words("ignition ", at), label)),
    ];
    for (at, words, style) in labels.into_iter().flatten() {
        plane.beside(frame, at, &words, style);
    }
}

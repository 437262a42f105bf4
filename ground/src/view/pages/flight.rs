//! The pages of ascent, descent and burn: the band, height over time with what is to come, the
//! place from above, the vehicle from two sides; on a larger screen values, fins and events below.

use std::time::Duration;

use protocol::dialect::{TD_CONTROLLER_DATA, TD_DESCENT_DATA, TdAbortEffect, TdBooster, TdChute, TdPhase};
use ratatui::Frame;
use ratatui::layout::Constraint::{Fill, Length, Percentage};
use ratatui::layout::Rect;
use ratatui::text::Line;

use crate::model::{Deflection, Model, Page, Sample, dead_reckoning::is_silent, quantity::Quantity, words};
use crate::view::band::{Room, draw_band};
use crate::view::pictures::attitude::Side;
use crate::view::pictures::map::comes_down;
use crate::view::shared::{FROM_ABOVE, events, height, map, vehicle};
use crate::view::widgets::{columns, framed, rows, table};
use crate::view::{
    TextRole, Theme, age_mark, bars, draw_lines, fixed, headline, panels, quantity_row, status_lines,
    text_row,
};

/// Columns of the vehicle from one side at 80 columns.
const SIDE_COLUMNS: u16 = 18;
/// The same for its predicted position.
const LOST_COLUMNS: u16 = 28;
/// Columns and rows of the six limits with their borders.
const LIMIT_COLUMNS: u16 = 36;
pub const LIMIT_ROWS: u16 = 8;
/// Rows of the panels under the pictures, with their borders.
const BELOW_ROWS: u16 = 11;

/// Draws the page of the ascent, of the descent or of the burn. Returns where the pictures are.
pub fn draw_flying(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) -> Rect {
    // The newest state in words, under the number.
    let descent = model.vehicle.descent();
    let below = match model.page() {
        Page::Ascent => state("booster", descent.clone().map(|report| report.map(booster)), theme, now),
        Page::Landing => {
            let report = model.vehicle.last::<TD_CONTROLLER_DATA>();
            // A plan is good or bad once its touchdown is reported.
            let planned = |(words, role)| match model.vehicle.prediction {
                None if role == TextRole::Good => ("first plan".to_owned(), TextRole::Plain),
                _ => (words, role),
            };
            let report = report.map(|report| report.map(|report| planned(panels::steered(report.level))));
            state("burn", report, theme, now)
        }
        _ => band_word(model, theme, now),
    };
    let burns = model.page() == Page::Landing;
    // Large words of danger stand in its place.
    let area = if headline::banner(model, now).is_some() {
        area
    } else {
        let (main, others) = headline::of_flight(model, now);
        draw_band((&main, below, &others), theme, frame, area)
    };
    if Room::of(frame.area()) == Room::Small {
        let side = Length(if is_silent(&model.vehicle, now) { LOST_COLUMNS } else { SIDE_COLUMNS });
        let shares = if burns { [Fill(1), Length(LIMIT_COLUMNS), side] } else { [Fill(5), Fill(3), side] };
        let [left, place, side] = columns(area, shares);
        if burns {
            let [limits, below] = rows(place, [Length(LIMIT_ROWS), Fill(1)]);
            bars::draw_limits(model, theme, now, frame, limits);
            table("flight", &values(model, theme, now, &VALUES[..3]), theme, frame, below);
        } else {
            map(FROM_ABOVE, model, theme, now, frame, place);
        }
        height(model, theme, now, frame, left);
        vehicle(model, &[Side::South], theme, now, frame, side);
        return area;
    }
    let [above, below] = rows(area, [Fill(1), Length(BELOW_ROWS)]);
    let [left, sides, right] = columns(above, [Percentage(40), Percentage(32), Fill(1)]);
    height(model, theme, now, frame, left);
    vehicle(model, &[Side::South, Side::East], theme, now, frame, sides);
    map(FROM_ABOVE, model, theme, now, frame, right);
    let [left, middle, right] = columns(below, [Percentage(40), Percentage(30), Fill(1)]);
    if burns {
        bars::draw_limits(model, theme, now, frame, left);
    } else if model.page() == Page::Descent
        && model.vehicle.may_light()
        && let Some((open, lines)) = gate(model, theme, now)
    {
        let inside = framed("ignition gate", open, theme, frame, left);
        draw_lines(frame, inside, &lines);
    } else {
        let mut lines = values(model, theme, now, &VALUES);
        lines.insert(0, state("chute", descent.map(|report| report.map(chute)), theme, now));
        table("flight", &lines, theme, frame, left);
    }
    bars::draw_surfaces(model, theme, now, frame, middle);
    events(model, theme, frame, right);
    area
}

/// The values beside the state of the parachute, the most important first.
static VALUES: [&str; 7] =
    ["tilt", "horizontal speed", "distance", "touchdown north", "touchdown east", "wind", "drag"];

/// A fin follows if it is nearer to its command than this, degrees: the 0.1 rad of the vehicle's
/// gate.
const FOLLOWS_DEG: f64 = 5.7;

/// The reported conditions of the ignition gate with their limits, and how many are met. The
/// vehicle checks more itself.
fn gate(model: &Model, theme: Theme, now: Duration) -> Option<(Line<'static>, Vec<Line<'static>>)> {
    let vehicle = &model.vehicle;
    let descent = vehicle.descent()?;
    let d = &descent.value;
    let height_m = vehicle.height_m()?.value;
    let (low_m, high_m) = (f64::from(d.band_low_m), f64::from(d.band_high_m));
    let off_m = comes_down(model, now).map_or(f64::NAN, |at| libm::hypot(at.east_m, at.north_m));
    let fence_m = vehicle.fence_m().unwrap_or(f64::NAN);
    let sinks_m_s = -vehicle.vertical_m_s()?.value;
    let follows = |fin: &&Deflection| fin.error_deg() < FOLLOWS_DEG;
    let fins = vehicle.fins().map_or(0, |fins| fins.value.iter().filter(follows).count());
    let whole = |value: f64| fixed(value, 0);
    let armed = vehicle.phase_now() == Some(TdPhase::TD_PHASE_LAND_ARMED);
    let (chute, _) = chute(d);
    let stowed = d.chute == TdChute::TD_CHUTE_STOWED;
    let motor = if armed { "armed" } else { "not armed" }.to_owned();
    let rows = [
        (
            "height",
            (low_m..=high_m).contains(&height_m),
            whole(height_m),
            format!("in {}..{} m", whole(low_m), whole(high_m)),
        ),
        ("off the pad", off_m <= fence_m, whole(off_m), format!("of {} m", whole(fence_m))),
        ("sinks", sinks_m_s > 0.0, whole(sinks_m_s), "m/s".to_owned()),
        ("fins follow", fins == 4, fins.to_string(), "of 4".to_owned()),
        ("parachute", stowed, chute, String::new()),
        ("motor", armed, motor, String::new()),
    ];
    let open = rows.iter().filter(|(_, holds, ..)| *holds).count();
    let role = |holds: bool| if holds { TextRole::Good } else { TextRole::Caution };
    let title = theme.line(format!(" {open} of {} met ", rows.len()), role(open == rows.len()));
    let lines = rows.into_iter().map(|(name, holds, text, unit)| {
        let label = format!("{:<5}{name}", if holds { "ok" } else { "wait" });
        text_row(theme, &label, age_mark(&descent, now, role(holds)), &text, &unit)
    });
    let others = values(model, theme, now, &["tilt", "turn rate"]);
    Some((title, lines.chain(others).collect()))
}

fn values(model: &Model, theme: Theme, now: Duration, names: &[&str]) -> Vec<Line<'static>> {
    let known = names.iter().filter_map(|name| Quantity::named(name));
    known.map(|quantity| quantity_row(quantity, model, theme, now)).collect()
}

/// A state of the newest report, in words.
fn state(label: &str, of: Option<Sample<(String, TextRole)>>, theme: Theme, now: Duration) -> Line<'static> {
    let Some(report) = of else { return text_row(theme, label, (" ", TextRole::Label), "no data", "") };
    let (text, role) = &report.value;
    text_row(theme, label, age_mark(&report, now, *role), text, "")
}

fn booster(descent: &TD_DESCENT_DATA) -> (String, TextRole) {
    let role = match descent.booster {
        TdBooster::TD_BOOSTER_SEPARATING => TextRole::Caution,
        TdBooster::TD_BOOSTER_SEPARATED => TextRole::Good,
        TdBooster::TD_BOOSTER_NONE | TdBooster::TD_BOOSTER_ATTACHED => TextRole::Plain,
    };
    (words::lower_case(&descent.booster, "TD_BOOSTER_"), role)
}

fn chute(descent: &TD_DESCENT_DATA) -> (String, TextRole) {
    let is_out = matches!(descent.chute, TdChute::TD_CHUTE_FIRED | TdChute::TD_CHUTE_OPEN);
    let role = if is_out { TextRole::Caution } else { TextRole::Plain };
    (words::lower_case(&descent.chute, "TD_CHUTE_"), role)
}

/// Compares the height with the ignition band and the commit height, in words.
fn band_word(model: &Model, theme: Theme, now: Duration) -> Line<'static> {
    if model.vehicle.in_flight() && status_lines::is_inhibited(&model.vehicle) {
        // Without a parachute the row of the state shows it.
        let under_chute = model.vehicle.phase_now() == Some(TdPhase::TD_PHASE_CHUTE);
        let words = if under_chute { " NO BURN: motor inhibited" } else { "" };
        return theme.line(words, TextRole::Alarm);
    }
    // Before the fall, and after it, no band is reported.
    let Some(descent) = model.vehicle.descent().filter(|_| model.vehicle.in_flight()) else {
        return theme.line(" band --", TextRole::Label);
    };
    let d = &descent.value;
    let height_m = model.vehicle.height_m().map_or(f64::NAN, |height| height.value);
    let (low_m, high_m) = (f64::from(d.band_low_m), f64::from(d.band_high_m));
    let is_known = [height_m, low_m, high_m].iter().all(|value| value.is_finite());
    let (words, role) = match height_m {
        _ if !is_known => ("band -- until it falls fast enough", TextRole::Label),
        _ if low_m > high_m => ("NO HEIGHT LANDS", TextRole::Alarm),
        _ if height_m < low_m => ("BELOW the band", TextRole::Alarm),
        _ if height_m > high_m => ("above the band", TextRole::Plain),
        _ => ("INSIDE the band", TextRole::Good),
    };
    let committed = height_m < f64::from(d.commit_height_m) && !parachute_may_fly(model, d.chute);
    let commit = if committed { ", committed" } else { "" };
    let (mark, role) = age_mark(&descent, now, role);
    theme.line(format!("{mark}{words}{commit}"), role)
}

/// Whether the parachute is out, or an abort would still throw it out. Then the vehicle is not
/// committed to a burn.
fn parachute_may_fly(model: &Model, chute: TdChute) -> bool {
    let out = matches!(chute, TdChute::TD_CHUTE_FIRED | TdChute::TD_CHUTE_OPEN);
    let ordered = model.vehicle.phase_now() == Some(TdPhase::TD_PHASE_CHUTE);
    let now = TdAbortEffect::TD_ABORT_EFFECT_CHUTE_NOW;
    out || ordered || model.vehicle.reports(|status| status.abort_effect == now)
}

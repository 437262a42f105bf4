//! The place from above, north up, fitted to what matters: the fence, where it will come down, the
//! pad, the track, the wind.

use std::time::Duration;

use protocol::dialect::TdPhase;
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::widgets::canvas::Circle;

use super::field::draw_lines;
use super::{DOTS_ACROSS, Ink, Plane, TextRole, Theme, circle};
use crate::model::{
    Degrees, Model, Page, Spot, dead_reckoning::predict_position, field, is_burning, is_on_pad,
    quantity::Quantity,
};
use crate::view::{fixed, shortest, widgets};

/// The least that the picture shows to every side, m; in the burn the scale of the last 30 m.
const REACH_MIN_M: f64 = 10.0;
const BURN_REACH_M: f64 = 15.0;
/// The steps of its reach, each 1.4 times the one before, up to 3,000 km; and of its middle, in
/// reaches.
const REACH_STEPS: usize = 36;
const MIDDLE_STEP: f64 = 0.5;
/// How much farther the picture reaches than what it shows, so that nothing stands on its edge.
const EDGE: f64 = 1.15;
/// The fence is included if it enlarges the picture by no more than this factor.
const FENCE_COST_MAX: f64 = 15.0;
/// The steps of the place and the radius of the circle of the uncertainty, in reaches.
const SPREAD_STEP: f64 = 1.0 / 6.0;
/// How far from the pad another vehicle is drawn if there is no fence, m.
const TRACKER_NEAR_M: f64 = 500.0;
/// A rail that leans less than this is taken as upright, degrees.
const RAIL_LEANS_DEG: f64 = 0.5;
/// How far back predictions of the touchdown count for its uncertainty.
const SCATTER_OVER: Duration = Duration::from_secs(5);

/// The predicted touchdown in flight, and how far it has moved within five seconds; `None` while it
/// is unknown or stale.
pub fn comes_down(model: &Model, now: Duration) -> Option<Spot> {
    if !model.vehicle.in_flight() {
        return None;
    }
    let fresh = |name| {
        let quantity = Quantity::named(name)?;
        let sample = quantity.read(model, now).filter(|sample| !sample.is_stale(now))?;
        Some((quantity, sample.value))
    };
    let ((north, north_m), (east, east_m)) = (fresh("touchdown north")?, fresh("touchdown east")?);
    let from = now.saturating_sub(SCATTER_OVER);
    let trace = &model.history.trace;
    let past = trace.values(north, from, now).zip(trace.values(east, from, now));
    let error_m = past
        .map(|((_, past_north), (_, past_east))| libm::hypot(past_north - north_m, past_east - east_m))
        .fold(0.0, f64::max);
    Some(Spot { north_m, east_m, error_m })
}

/// Fall speed from which the impact of a fall without the landing motor is drawn, m/s.
const FALL_MIN_M_S: f64 = 5.0;

/// Impact position, east and north of the pad, m, of a vehicle that falls on without its landing
/// motor at its present velocity.
fn impact_without_motor(model: &Model, now: Duration) -> Option<(f64, f64)> {
    use TdPhase as P;
    let vehicle = &model.vehicle;
    let falls = matches!(
        vehicle.phase_now()?,
        P::TD_PHASE_AERO_DESCENT | P::TD_PHASE_LAND_ARMED | P::TD_PHASE_IGNITION
    );
    let motion = vehicle.best_motion().filter(|motion| falls && !motion.is_stale(now))?.value;
    let height_m = vehicle.height_m()?.value;
    let falls_s = height_m / -motion.climb_m_s;
    (motion.climb_m_s < -FALL_MIN_M_S)
        .then_some((motion.y_m + motion.vy_m_s * falls_s, motion.x_m + motion.vx_m_s * falls_s))
}

/// The middle of the picture and how far it reaches, m: both in steps, so that the ground stands
/// still while the vehicle moves over it.
fn box_around(points: &[(f64, f64)], least_m: f64) -> ((f64, f64), f64) {
    let of = |pick: fn(&(f64, f64)) -> f64| {
        let low = points.iter().map(pick).fold(f64::INFINITY, f64::min);
        let high = points.iter().map(pick).fold(f64::NEG_INFINITY, f64::max);
        if low <= high { (f64::midpoint(low, high), (high - low) / 2.0) } else { (0.0, 0.0) }
    };
    let (x, y) = (of(|point| point.0), of(|point| point.1));
    let steps = std::iter::successors(Some(least_m), |reach_m| Some(reach_m * std::f64::consts::SQRT_2));
    let mut boxes = steps.take(REACH_STEPS).map(|reach_m| {
        let step_m = reach_m * MIDDLE_STEP;
        let snapped = |(middle, _): (f64, f64)| libm::round(middle / step_m) * step_m;
        ((snapped(x), snapped(y)), reach_m)
    });
    let holds = |middle: f64, reach_m: f64, (exact, half): (f64, f64)| {
        (middle - exact).abs() + EDGE * half <= reach_m
    };
    boxes
        .find(|((east, north), reach_m)| holds(*east, *reach_m, x) && holds(*north, *reach_m, y))
        .unwrap_or(((0.0, 0.0), least_m))
}

/// Where the way to a vehicle on the ground begins, and where it stands, east and north of the pad,
/// m. The page that leads there has one position and one way.
fn way_over_ground(model: &Model, now: Duration) -> ((f64, f64), Option<(f64, f64)>) {
    let vehicle = &model.vehicle;
    let is_down = matches!(vehicle.phase_now(), Some(TdPhase::TD_PHASE_TOUCHDOWN | TdPhase::TD_PHASE_SAFED));
    let flown = vehicle.flown.iter().last().filter(|_| is_down).map(|[north, east, _]| (*east, *north));
    let finds = model.page() == Page::Find && model.chosen_tracker().is_none();
    let sought = model.sought(now).filter(|place| finds && place.predicted.is_none());
    let at = flown.map(|at| sought.map_or(at, |place| (place.received.east_m, place.received.north_m)));
    let here = model.here().zip(vehicle.pad).filter(|_| finds).map(|(here, pad)| pad.to(here));
    (here.map_or((0.0, 0.0), |(north_m, east_m)| (east_m, north_m)), at)
}

/// Draws the picture; both axes have the same scale.
pub fn draw_map(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    if area.width < 12 || area.height < 4 {
        return;
    }
    let vehicle = &model.vehicle;
    let flown: Vec<(f64, f64)> = vehicle.flown.iter().map(|[north, east, _]| (*east, *north)).collect();
    let down = comes_down(model, now);
    let lost = predict_position(vehicle, now).map(|at| at.spot);
    let impact = impact_without_motor(model, now).filter(|_| down.is_some());
    let fence_m = vehicle.fence_m();
    let phase = vehicle.phase_now();
    let (begin, stands) = way_over_ground(model, now);
    let burns = phase.is_some_and(is_burning);
    let here = vehicle.best_motion().filter(|motion| motion.value.x_m.is_finite() && !motion.is_stale(now));
    let here = here.map(|motion| (motion.value.y_m, motion.value.x_m)).filter(|_| vehicle.in_flight());
    let around = |(x, y): (f64, f64), radius: f64| [(x - radius, y - radius), (x + radius, y + radius)];
    let on_pad = phase.is_some_and(is_on_pad);
    let others = others(model, on_pad);
    let mut points: Vec<(f64, f64)> =
        here.into_iter().chain(stands).chain(others.iter().map(|(at, ..)| *at)).collect();
    points.extend(lost.iter().flat_map(|at| around((at.east_m, at.north_m), at.error_m.min(500.0))));
    points.extend(down.iter().map(|at| (at.east_m, at.north_m)).chain(impact));
    if !burns || points.is_empty() {
        points.push((0.0, 0.0));
    }
    let (mut middle, mut reach_m) = box_around(&points, if burns { BURN_REACH_M } else { REACH_MIN_M });
    // The whole fence, unless it would make everything small; on the ground only the way to the
    // vehicle matters.
    let is_small = |fence_m: f64| fence_m < FENCE_COST_MAX * reach_m.max(30.0) && stands.is_none() && !burns;
    let holds = |fence_m: f64| points.iter().all(|(x, y)| libm::hypot(*x, *y) < 1.2 * fence_m);
    if let Some(fence_m) = fence_m.filter(|fence_m| is_small(*fence_m) && holds(*fence_m)) {
        (middle, reach_m) = ((0.0, 0.0), 1.08 * fence_m);
    }
    let plane = Plane::around(area, middle, reach_m);
    let per_dot = plane.dot();
    // In whole steps, so that it does not tremble.
    let step_m = SPREAD_STEP * reach_m;
    // What has not settled yet has none.
    let spread = down.filter(|at| at.error_m < reach_m).map(|at| {
        let [east_m, north_m] = [at.east_m, at.north_m].map(|place_m| (place_m / step_m).round() * step_m);
        circle((east_m, north_m), ((at.error_m / step_m).round() * step_m).max(step_m))
    });
    // A vehicle on its rail leans with it.
    let lean = vehicle.attitude.map(|attitude| attitude.value).filter(|_| on_pad);
    let rail = lean.filter(|attitude| attitude.tilt_rad.to_degrees() > RAIL_LEANS_DEG).map(|attitude| {
        let [north, east, _] = attitude.axes[0].map(|to| 0.4 * reach_m * to / libm::sin(attitude.tilt_rad));
        ((east, north), attitude.tilt_rad.to_degrees())
    });
    let lines = field::lines_m(model);
    let error = lost.map(|at| circle((at.east_m, at.north_m), at.error_m));
    plane.draw(theme, frame, |context| {
        if let Some(fence_m) = fence_m {
            let (x, y, color) = (0.0, 0.0, theme.ink(Ink::Limit));
            context.draw(&Circle { x, y, radius: fence_m, color });
        }
        draw_lines(context, &lines, theme);
        plane.measured(context, &flown, theme.ink(Ink::Measured));
        for dotted in [&spread, &error].into_iter().flatten() {
            plane.predicted(context, dotted, theme.ink(Ink::Predicted));
        }
        if let Some((at, _)) = rail {
            plane.measured(context, &[(0.0, 0.0), at], theme.ink(Ink::Body));
        }
        if let Some(at) = stands {
            plane.predicted(context, &[begin, at], theme.ink(Ink::Body));
        }
    });
    let ink = |ink| theme.ground().fg(theme.ink(ink));
    let beside = |x: f64| x + 2.0 * DOTS_ACROSS * per_dot;
    let strong = theme.style(TextRole::Title);
    plane.write(frame, (0.0, 0.0), "+", strong);
    if let Some(at) = impact {
        plane.write(frame, at, "x", ink(Ink::Limit));
        plane.beside(frame, at, &["x: no light".to_owned()], ink(Ink::Limit));
    }
    if let Some(at) = down {
        plane.write(frame, (at.east_m, at.north_m), "×", ink(Ink::Predicted));
    }
    if let Some(at) = lost {
        plane.write(frame, (at.east_m, at.north_m), "+", ink(Ink::Predicted));
        plane.beside(frame, (at.east_m, at.north_m), &["PREDICTED".to_owned()], ink(Ink::Predicted));
    } else if let Some(at) = here {
        plane.write(frame, at, "●", strong);
    }
    if let Some((x, y)) = stands {
        plane.write(frame, (x, y), "▲", theme.style(TextRole::Good));
        let words = format!("{} m", fixed(libm::hypot(x - begin.0, y - begin.1), 0));
        plane.write(frame, (beside(f64::midpoint(begin.0, x)), f64::midpoint(begin.1, y)), &words, strong);
    }
    words(model, (fence_m, per_dot), theme, frame, &plane);
    write_distances(model, (stands.or(impact), lost.or(down)), theme, frame, &plane);
    let label = |frame: &mut Frame, at, words: &str| {
        plane.beside(frame, at, &[words.to_owned()], theme.style(TextRole::Label));
    };
    label(frame, (0.0, 0.0), "pad");
    for (at, mark, words) in others {
        plane.write(frame, at, mark, strong);
        label(frame, at, &words);
    }
    if let Some((at, tilt_deg)) = rail {
        label(frame, at, &format!("rail {} deg", fixed(tilt_deg, 0)));
    }
}

/// The crew and the other vehicles: positions east and north of the pad, m, with marks and words.
fn others(model: &Model, on_pad: bool) -> Vec<((f64, f64), &'static str, String)> {
    let Some(pad) = model.vehicle.pad else { return Vec::new() };
    let finds = model.page() == Page::Find;
    let of_pad = |at: Degrees| {
        let (north_m, east_m) = pad.to(at);
        ((east_m, north_m), libm::hypot(east_m, north_m))
    };
    let crew = model.here().filter(|_| on_pad || finds).map(of_pad);
    let crew = crew.map(|(at, far_m)| {
        (at, "o", if on_pad { format!("crew {} m", fixed(far_m, 0)) } else { "here".to_owned() })
    });
    // One far away would make everything small, unless the crew looks for it.
    let near_m = model.vehicle.fence_m().unwrap_or(TRACKER_NEAR_M);
    let trackers = model.trackers.iter().filter_map(|(id, tracker)| {
        let (at, far_m) = of_pad(tracker.at.value);
        let is_drawn = far_m < near_m || (finds && model.pages.tracker == Some(*id));
        is_drawn.then(|| (at, "*", format!("system {id}")))
    });
    crew.into_iter().chain(trackers).collect()
}

/// Writes how far the field's lines are beside a position, or else beside a spot.
fn write_distances(
    model: &Model,
    (at, spot): (Option<(f64, f64)>, Option<Spot>),
    theme: Theme,
    frame: &mut Frame,
    plane: &Plane,
) {
    let Some(at) = at.or(spot.map(|spot| (spot.east_m, spot.north_m))) else { return };
    plane.beside(frame, at, &field::distances(model, at), theme.style(TextRole::Label));
}

/// What stands at the edges: north, the wind, the fence, the scale.
fn words(model: &Model, (fence_m, dot): (Option<f64>, f64), theme: Theme, frame: &mut Frame, plane: &Plane) {
    let label = theme.style(TextRole::Label);
    let ([left, right], [bottom, top]) = (plane.x, plane.y);
    plane.write(frame, (left, top), "N↑", label);
    let (wind, arrow) = (wind(model), "wind ");
    let wind = if plane.area.width < 24 { wind.trim_start_matches(arrow) } else { &wind };
    plane.write(frame, (right, top), wind, label);
    let column = DOTS_ACROSS * dot;
    let length_m = widgets::tick_step((right - left) / 5.0, 1);
    let cells = (length_m / column).round().max(2.0) as usize;
    let scale = format!("├{}┤ {} m", "─".repeat(cells.saturating_sub(2)), shortest(length_m));
    let fence = fence_m.map(|fence_m| (fence_m, format!("fence {} m", shortest(fence_m))));
    let limit = theme.ground().fg(theme.ink(Ink::Limit));
    // A fence that is in the picture is a scale.
    if let Some((_, words)) =
        fence.as_ref().filter(|(fence_m, _)| -*fence_m > left.max(bottom) && *fence_m < right.min(top))
    {
        return plane.write(frame, (left, bottom), words, limit);
    }
    plane.write(frame, (left, bottom), &scale, label);
    // Of a part of it the name has its room where nothing else stands.
    let nearest_m = libm::hypot(0.0_f64.clamp(left, right), 0.0_f64.clamp(bottom, top));
    let farthest_m = libm::hypot(left.abs().max(right.abs()), bottom.abs().max(top.abs()));
    if let Some((_, words)) = fence.filter(|(fence_m, _)| (nearest_m..farthest_m).contains(fence_m)) {
        plane.beside(frame, (right, bottom), &[words], limit);
    }
}

/// Where the wind blows to, as an arrow, and its speed.
fn wind(model: &Model) -> String {
    let Some([north, east]) = model.vehicle.wind_m_s().map(|wind| wind.value) else { return String::new() };
    let eighth = libm::round(libm::atan2(east, north).to_degrees() / 45.0).rem_euclid(8.0) as usize;
    let arrow = ["↑", "↗", "→", "↘", "↓", "↙", "←", "↖"][eighth];
    format!("wind {arrow} {} m/s", fixed(libm::hypot(north, east), 0))
}

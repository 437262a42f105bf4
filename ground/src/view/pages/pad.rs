//! The pad page: every arming check with its value, and the arming ladder (the steps from link to
//! countdown).

use std::time::Duration;

use protocol::dialect::{TD_CONTROLLER_DATA, TdCheck, TdInterlock, TdPhase};
use ratatui::Frame;
use ratatui::layout::Constraint::{Fill, Length, Percentage};
use ratatui::layout::Rect;
use ratatui::text::Line;

use crate::model::{
    Act, Deflection, LogStanding, Model, SENSORS, Vehicle, field, hold_words, is_on_pad, link_hints,
    why_not_here, why_untested, words,
};
use crate::view::band::{Item, Room, draw_band, word};
use crate::view::pictures::attitude::{Side, draw_attitude};
use crate::view::shared::{events, map};
use crate::view::widgets::{columns, framed, rows, table};
use crate::view::{STALE_MARK, TextRole, Theme, draw_lines, fixed, headline, lists, top_lines};

/// Columns of the checks.
const CHECK_COLUMNS: u16 = 49;
/// Columns of the steps on a small and on a larger screen.
const STEP_COLUMNS: [u16; 2] = [30, 38];
/// Rows of the panels under the pictures.
const BELOW_ROWS: u16 = 12;

/// Draws GO or the failing checks, the next step, the steps; and the vehicle and the map of the
/// pad, or the checks while one fails.
pub fn draw_pad(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let area =
        if headline::banner(model, now).is_some() { area } else { draw_go(model, theme, now, frame, area) };
    let ladder = ladder(model, theme, now);
    if Room::of(frame.area()) == Room::Small {
        let ready = top_lines::readiness(model, now).is_some_and(|(_, role)| role == TextRole::Good);
        let on_the_way = model.vehicle.is_armed() || ready;
        let is_amiss = !on_the_way || !model.alarms.list().is_empty() || model.beside(now).is_some();
        let [left, right] = columns(area, [Length(STEP_COLUMNS[0]), Fill(1)]);
        table("steps", &ladder, theme, frame, left);
        if model.checklist.is_some() && model.pages.checklist {
            draw_checklist(model, theme, now, frame, right);
        } else if is_amiss {
            let lines = checks(model, theme, now, false);
            let wanted = lines.len() as u16 + 2;
            // One row of events would cut the newest one.
            let wanted = if right.height < wanted + 4 { right.height } else { wanted };
            let [upper, below] = rows(right, [Length(wanted), Fill(1)]);
            table("checks", &lines, theme, frame, upper);
            if below.height > 2 {
                events(model, theme, frame, below);
            }
        } else {
            let [middle, right] = columns(right, [Length(18), Fill(1)]);
            draw_attitude(model, Side::South, theme, now, frame, middle);
            map("around the pad", model, theme, now, frame, right);
        }
        return;
    }
    // A large screen lists every check under the steps, where a smaller one has no room.
    let is_large = Room::of(frame.area()) == Room::Large;
    let [above, below] = rows(area, [Fill(1), Length(BELOW_ROWS)]);
    let steps = if is_large { CHECK_COLUMNS } else { STEP_COLUMNS[1] };
    let [left, south, east, right] = columns(above, [Length(steps), Percentage(17), Percentage(17), Fill(1)]);
    let listed = [Length(if is_large { ladder.len() as u16 + 2 } else { left.height }), Fill(1)];
    let [left, checks_at] = rows(left, listed);
    table("steps", &ladder, theme, frame, left);
    draw_attitude(model, Side::South, theme, now, frame, south);
    draw_attitude(model, Side::East, theme, now, frame, east);
    map("around the pad", model, theme, now, frame, right);
    let list = if model.checklist.is_some() { Percentage(40) } else { Length(1) };
    let beside = Length(if is_large { 1 } else { CHECK_COLUMNS + 4 });
    let [left, middle, right] = columns(below, [beside, list, Fill(1)]);
    let checks_at = if is_large { checks_at } else { left };
    table("checks", &checks(model, theme, now, is_large), theme, frame, checks_at);
    if model.checklist.is_some() {
        draw_checklist(model, theme, now, frame, middle);
    }
    events(model, theme, frame, right);
}

/// The band: GO or NO-GO, and the next step large.
fn draw_go(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) -> Rect {
    let counts = model.vehicle.counts_down();
    let (words, role) = summary(model, now);
    let next = [(Act::Arm, "ARM"), (Act::Start, "START")].into_iter().find(|(act, _)| act.works(model, now));
    let next = next.filter(|_| role == TextRole::Good && !counts).map(|(act, typed)| (act.key_name(), typed));
    let step = next.as_ref().map(|(key, typed)| {
        word("next: press, then type, Enter", &format!("{key} {typed}"), TextRole::Title)
    });
    let others: Vec<Item> = step.into_iter().chain(headline::pad_check(model)).collect();
    let (words, role) = match next {
        _ if counts && model.is_past_hold(now) => {
            ("seconds to the release; only the ABORT ends it now".to_owned(), TextRole::Plain)
        }
        _ if counts => {
            let key = Act::HoldCountdown.key_name();
            (format!("seconds to the release; {key} Enter holds"), TextRole::Plain)
        }
        Some((key, typed)) if model.settings.demonstration => {
            let words = "A demonstration, simulated here: press";
            (format!("{words} {key}, type {typed}, press Enter"), TextRole::Plain)
        }
        _ if role == TextRole::Good => {
            let all = model.vehicle.checks_made().iter().count();
            let pass = all - model.vehicle.failing().len();
            (format!("every arming check passes, {pass} of {all}"), role)
        }
        _ => (words, role),
    };
    let below = theme.line(format!(" {words}"), role);
    draw_band((&headline::pad(model, now), below, &others), theme, frame, area)
}

fn draw_checklist(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let (done, all) = model.steps_done(now).unwrap_or_default();
    let [sign, void] = [Act::SignStep, Act::VoidStep].map(Act::key_name);
    let title = format!("Checklist {done} of {all}: {sign} signs, {void} voids");
    let inside = framed(&title, Line::default(), theme, frame, area);
    let size = (usize::from(inside.width), usize::from(inside.height));
    draw_lines(frame, inside, &lists::checklist_rows(model, theme, now, size));
}

const OFF_PAD: &str = "off the pad nothing is checked for arming";

/// Each failing check in the words of the vehicle, or with the value found and why it fails; how
/// many pass; `all` of those, or those with a measured value.
pub fn checks(model: &Model, theme: Theme, now: Duration, all: bool) -> Vec<Line<'static>> {
    // Off the pad the vehicle does not check for arming and reports no failing check.
    let off_pad = model.vehicle.phase().is_some_and(|phase| !is_on_pad(phase.value));
    let Some(status) = model.vehicle.status.as_ref().filter(|_| !off_pad) else {
        let after = off_pad.then(|| vec![OFF_PAD.to_owned()]);
        let hints = link_hints(model, now).or(after).unwrap_or_default();
        let wrapped = |words: String| lists::wrap(&words, usize::from(CHECK_COLUMNS - 2));
        let lines = hints.into_iter().flat_map(wrapped);
        return lines.map(|words| Line::from(format!(" {words}"))).collect();
    };
    let mark = if status.is_stale(now) { STALE_MARK } else { " " };
    let found = |check: TdCheck| about(&model.vehicle, check).0;
    let row = |word: &'static str, (name, bit): (&str, TdCheck), reason: &'static str| {
        let (name, found) = (words::check(name), found(bit));
        let reason = if found.starts_with("--") && !reason.is_empty() { "not known" } else { reason };
        let role = if reason.is_empty() { TextRole::Plain } else { TextRole::Alarm };
        let value = theme.plain(format!("{mark}{name:<19.19}{found:>10} "));
        Line::from(vec![theme.span(word, role), value, theme.span(reason, TextRole::Caution)])
    };
    let fails = |bit: TdCheck| status.value.checks_failed.contains(bit);
    let made = model.vehicle.checks_made();
    let of_station = [Some(station_log(model, theme, now)), motor(model, theme), crowd_line(model, theme)];
    let (fail, pass): (Vec<_>, Vec<_>) = of_station.into_iter().flatten().partition(|(fails, _)| *fails);
    let several = model.vehicle_rows(now).into_iter();
    let several = several.map(|words| theme.line(format!(" {words}"), TextRole::Alarm));
    let mut lines: Vec<Line> = several.collect();
    lines.extend(fail.into_iter().map(|(_, line)| line));
    let failed = status.value.checks_failed;
    lines.extend(failed.iter_names().map(|check| match model.vehicle.reported_words(check.1) {
        // A value that is measured now is better than the vehicle's words for an earlier one.
        Some(words) if !found(check.1).contains(' ') => Line::from(vec![
            theme.span(" NO ", TextRole::Alarm),
            theme.span(format!("{mark}{words}"), TextRole::Caution),
        ]),
        _ => row(" NO ", check, about(&model.vehicle, check.1).1),
    }));
    let of = made.iter().count();
    let count = format!(" GO {mark}{} of {of} checks", of - failed.iter().count());
    lines.push(theme.line(count, TextRole::Good));
    let measured = |(_, bit): &(&str, TdCheck)| !fails(*bit) && (all || found(*bit).contains(' '));
    lines.extend(made.iter_names().filter(measured).map(|check| row("    ", check, "")));
    lines.extend(pass.into_iter().map(|(_, line)| line));
    lines
}

/// How far people are from the pad, once field, pad and fence are known: the check fails inside the
/// fence.
fn crowd_line(model: &Model, theme: Theme) -> Option<(bool, Line<'static>)> {
    let (crowd_m, fence_m) = field::crowd_and_fence_m(model)?;
    let word = if crowd_m < fence_m { " NO " } else { "    " };
    let found = format!("{crowd_m:.0} m, fence {fence_m:.0} m");
    Some(of_the_station(word, " crowd line  ", found, theme))
}

/// Whether burns of its lot confirm the landing motor, once the vehicle has reported its mission.
fn motor(model: &Model, theme: Theme) -> Option<(bool, Line<'static>)> {
    let burns = model.vehicle.mission()?.motor_burns;
    let (word, found) = match burns {
        0 if why_untested(model).is_some() => (" NO ", "UNCONFIRMED: no burn of its lot".to_owned()),
        0 if model.vehicle.boot.is_simulated() => ("    ", "certified, no burn of its lot".to_owned()),
        0 => (" !! ", "overruled: UNCONFIRMED, no burn of its lot".to_owned()),
        _ => ("    ", format!("confirmed, burns of its lot: {burns}")),
    };
    Some(of_the_station(word, " motor       ", found, theme))
}

/// A check that the station makes, and whether it fails.
fn of_the_station(
    word: &'static str,
    name: &'static str,
    found: String,
    theme: Theme,
) -> (bool, Line<'static>) {
    let (role, found_role) = match word {
        " NO " => (TextRole::Alarm, TextRole::Caution),
        " !! " => (TextRole::Caution, TextRole::Caution),
        _ => (TextRole::Plain, TextRole::Plain),
    };
    let spans = vec![theme.span(word, role), theme.plain(name), theme.span(found, found_role)];
    (role == TextRole::Alarm, Line::from(spans))
}

/// Whether the checks pass, in words.
fn summary(model: &Model, now: Duration) -> (String, TextRole) {
    let off_pad = model.vehicle.phase().is_some_and(|phase| !is_on_pad(phase.value));
    let held = hold_words(model);
    let unfit = model.vehicle.unfit_while_armed().map(|(_, words)| format!("ARMED, and NO-GO: {words}"));
    match model.vehicle.status.as_ref() {
        Some(_) if held.is_some() || unfit.is_some() => (held.or(unfit).unwrap_or_default(), TextRole::Alarm),
        _ if off_pad => (OFF_PAD.to_owned(), TextRole::Label),
        None if link_hints(model, now).is_some() => ("nothing received".to_owned(), TextRole::Caution),
        None => ("the vehicle has not reported its checks".to_owned(), TextRole::Caution),
        Some(status) if status.is_stale(now) || status.value.checks_failed.is_empty() => {
            top_lines::readiness(model, now).unwrap_or_default()
        }
        Some(status) => {
            let failing = status.value.checks_failed.iter().count();
            let all = model.vehicle.checks_made().iter().count();
            (format!("NO-GO: {failing} of {all} checks fail"), TextRole::Alarm)
        }
    }
}

/// The row of the station's own log.
fn station_log(model: &Model, theme: Theme, now: Duration) -> (bool, Line<'static>) {
    let space = model.log.space.map_or_else(|| "running".to_owned(), |space| space.words());
    let (word, found) = match model.station_log(now) {
        LogStanding::None => ("    ", "none (--log none)".to_owned()),
        LogStanding::Fine => ("    ", space),
        LogStanding::Warned(words) => (" !! ", words),
        LogStanding::Unfit(_, words) if model.why_no_log(now).is_some() => (" NO ", words),
        LogStanding::Unfit(_, words) => (" !! ", format!("overruled: {words}")),
    };
    of_the_station(word, " station log ", found, theme)
}

/// The value that telemetry shows for a check, empty if there is none; and why the check fails, if
/// it does.
fn about(vehicle: &Vehicle, check: TdCheck) -> (String, &'static str) {
    let locks = vehicle.interlocks();
    let yes_no = |bit: TdInterlock, yes: &'static str, no: &'static str| {
        locks.map_or("", |locks| if locks.contains(bit) { yes } else { no }).to_owned()
    };
    let number = |value: Option<f64>, decimals: usize, unit: &str| {
        value.map_or_else(String::new, |value| format!("{} {unit}", fixed(value, decimals)))
    };
    let attitude = vehicle.attitude.map(|attitude| attitude.value);
    let unseen = |reason| (String::new(), reason);
    match check {
        TdCheck::TD_CHECK_ABORT_LATCH => {
            (yes_no(TdInterlock::TD_INTERLOCK_ABORT_LATCHED, "latched", "free"), "keep away")
        }
        TdCheck::TD_CHECK_PIN => (yes_no(TdInterlock::TD_INTERLOCK_PIN_OUT, "out", "in"), "pull the pin"),
        TdCheck::TD_CHECK_SELF_TEST => unseen("not passed"),
        TdCheck::TD_CHECK_GNSS => unseen("no fix"),
        sensor if SENSORS.contains(sensor) => unseen("no data"),
        TdCheck::TD_CHECK_TILT => (number(vehicle.tilt_deg().map(|a| a.value), 1, "deg"), "not upright"),
        TdCheck::TD_CHECK_ROTATION => {
            (number(attitude.map(|a| a.turn_rate_rad_s().to_degrees()), 1, "deg/s"), "turning")
        }
        TdCheck::TD_CHECK_SPEED => (number(vehicle.motion.map(|m| m.value.speed_m_s()), 2, "m/s"), "moving"),
        TdCheck::TD_CHECK_ESTIMATOR => unseen("not settled"),
        TdCheck::TD_CHECK_FINS => {
            let off = vehicle.fins().map(|of| of.value.iter().map(Deflection::error_deg).fold(0.0, f64::max));
            (number(off, 1, "deg"), "no answer")
        }
        TdCheck::TD_CHECK_IGNITER => unseen("open circuit"),
        TdCheck::TD_CHECK_LOG => unseen("not running"),
        TdCheck::TD_CHECK_LOG_SPACE => {
            (number(vehicle.log_space_mib().map(|space| space.value), 0, "MiB"), "disk full")
        }
        TdCheck::TD_CHECK_CONTROLLER_WARM => {
            let controller = vehicle.last::<TD_CONTROLLER_DATA>().map(|controller| controller.value);
            let words = controller.map(|of| words::lower_case(&of.solver_status, "TD_SOLVER_STATUS_"));
            (words.unwrap_or_default().chars().take(10).collect(), "no rehearsal")
        }
        TdCheck::TD_CHECK_PREDICTED_TOUCHDOWN => {
            let ends = vehicle.prediction.map(|prediction| prediction.value.touchdown.violations());
            (ends.map_or_else(String::new, |outside| outside.unwrap_or("inside".into())), "outside")
        }
        TdCheck::TD_CHECK_UPLINK => unseen("not alive"),
        TdCheck::TD_CHECK_HEIGHT => unseen("too low"),
        TdCheck::TD_CHECK_BATTERY => (vehicle.volts().unwrap_or_default(), "too low"),
        _ => unseen(""),
    }
}

/// The steps from link to countdown, and which are done.
fn ladder(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let vehicle = &model.vehicle;
    let phase = vehicle.phase_now();
    let armed = vehicle.is_armed();
    let on_pad = phase.is_some_and(is_on_pad);
    let checked = on_pad
        && vehicle.reports(|status| status.checks_failed.is_empty())
        && field::crowd_inside_fence(model).is_none();
    let pin_out = vehicle.shows(TdInterlock::TD_INTERLOCK_PIN_OUT);
    let counting = vehicle.countdown_s().is_some();
    let two = model.people() == Some(2);
    let then = |act: Act, word: &str| {
        let key = act.key_name();
        if two { format!("{key}, {word}, Enter; CONFIRM") } else { format!("{key}, type {word}, Enter") }
    };
    let checks = model.steps_done(now).map_or_else(
        || "every check passes".to_owned(),
        |(done, all)| format!("checks; checklist {done}/{all} ({})", Act::Checklist.key_name()),
    );
    let rungs = [
        (model.link.state(now).carries(), "downlink alive".to_owned()),
        (model.link.uplink.is_proven(now), "uplink proven".to_owned()),
        (pin_out, "pin out (first inhibit)".to_owned()),
        (checked && model.why_checklist(now).is_none(), checks),
        (armed, then(Act::Arm, "ARM")),
        (armed && phase == Some(TdPhase::TD_PHASE_PAD_ARMED), "armed (HEARTBEAT)".to_owned()),
        (counting, then(Act::Start, "START")),
    ];
    let next = rungs.iter().position(|(stands, _)| !stands);
    let mut lines: Vec<Line> = rungs
        .into_iter()
        .enumerate()
        .map(|(place, (stands, words))| {
            let (mark, mark_role, role) = match () {
                () if stands => (" ✓ ", TextRole::Good, TextRole::Label),
                () if Some(place) == next => (" ▶ ", TextRole::Caution, TextRole::Title),
                () => (" · ", TextRole::Label, TextRole::Label),
            };
            Line::from(vec![theme.span(mark, mark_role), theme.span(words, role)])
        })
        .collect();
    // Without --mission only the crew compares it with the intended mission.
    lines.extend(vehicle.mission().map(|mission| {
        theme.line(format!("   {} {:.8}", mission.in_words(), mission.hash.to_string()), TextRole::Plain)
    }));
    if let Some(number) = model.commanded_by() {
        let here = number == model.seat_key();
        let words = format!(" {} commands{}", model.operator(number), if here { " (you)" } else { "" });
        lines.push(theme.line(words, TextRole::Plain));
    }
    let watches = model.settings.role.why_not_command();
    let only_stops = why_not_here(model).map(|_| "only HOLD and ABORT here");
    let why = watches.or(only_stops).unwrap_or_default();
    let wrapped = lists::wrap(why, usize::from(STEP_COLUMNS[0]) - 3).into_iter();
    lines.extend(
        wrapped
            .filter(|words| !words.is_empty())
            .map(|words| theme.line(format!(" {words}"), TextRole::Label)),
    );
    lines
}

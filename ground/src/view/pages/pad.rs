//! The pad page: every arming check with its value, and the arming ladder (the steps from link to countdown).

use std::time::Duration;

use protocol::dialect::{TD_CONTROLLER_DATA, TdCheck, TdInterlock, TdPhase};
use ratatui::Frame;
use ratatui::layout::Constraint::{Fill, Length};
use ratatui::layout::Rect;
use ratatui::text::Line;

use super::{is_roomy, panel, titled};
use crate::model::{
    Act, CommandKind, Deflection, Foreign, LogStanding, Model, Vehicle, is_on_pad, unheard_hints,
    why_not_here, words,
};
use crate::view::{
    STALE_MARK, TextRole, Theme, age_mark, draw_lines, fixed, headline, lists, panels, pictures,
    side_by_side, stacked, status_lines, top_lines,
};

/// Columns of the checks at 80 columns.
const CHECK_COLUMNS: u16 = 47;
/// The most rows of checks or steps, with their title.
const CHECK_ROWS: u16 = 16;
/// Rows of the vehicle's state on a larger screen, with a title.
const NOW_ROWS: u16 = 13;
/// Rows of GO or NO-GO at 80 columns, with a title.
const GO_ROWS: u16 = 5;
/// Columns of the ladder on a larger screen.
const LADDER_COLUMNS: u16 = 40;

/// Draws GO or NO-GO, the checks and the ladder, the events below.
pub fn draw_pad(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let foremost = headline::headline(model, now, headline::pad_headline);
    let (checks, ladder) = (checks(model, theme, now), ladder(model, theme, now));
    let lists_steps = model.checklist.is_some() && model.pages.checklist && !is_roomy(area);
    let go_rows = if foremost.is_empty() { 0 } else { GO_ROWS };
    let besides = if is_roomy(area) { 1 } else { 1 + go_rows };
    let rows = (checks.len() as u16 + 1).max(ladder.len() as u16 + besides);
    let upper_rows = if lists_steps { CHECK_ROWS } else { rows.min(CHECK_ROWS) };
    let (checks_area, ladder_area, events) = if is_roomy(area) {
        let area = headline::draw_headline(&foremost, theme, frame, area);
        let [upper, below] = stacked(area, [Length(upper_rows.max(NOW_ROWS)), Fill(1)]);
        let [left, middle, right] =
            side_by_side(upper, [Length(CHECK_COLUMNS + 4), Length(LADDER_COLUMNS), Fill(1)]);
        draw_now(model, theme, now, frame, right);
        let shares = if model.checklist.is_some() { [4, 4, 3] } else { [3, 0, 2] };
        let [events, list, picture] = side_by_side(below, shares.map(Fill));
        if model.checklist.is_some() {
            draw_checklist(model, theme, now, frame, list);
        }
        draw_rehearsal(model, theme, now, frame, picture);
        (left, middle, events)
    } else {
        let [upper, events] = stacked(area, [Length(upper_rows), Fill(1)]);
        let [left, right] = side_by_side(upper, [Length(CHECK_COLUMNS), Fill(1)]);
        let [go, below] = stacked(right, [Length(go_rows), Fill(1)]);
        if go_rows > 0 {
            let inside = titled("Now", theme, frame, go);
            headline::draw_headline(&foremost, theme, frame, inside);
        }
        (left, below, events)
    };
    if lists_steps {
        draw_checklist(model, theme, now, frame, checks_area);
    } else {
        panel(&summary(model, now).0, &checks, theme, frame, checks_area);
    }
    panel("Arming ladder", &ladder, theme, frame, ladder_area);
    let inside = titled("Events", theme, frame, events);
    let lines = lists::events(model, theme, usize::from(inside.width), usize::from(inside.height));
    draw_lines(frame, inside, &lines);
}

/// The state of the vehicle and of the link.
fn draw_now(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let inside = titled("Now", theme, frame, area);
    let mut lines = panels::flight_rows(model, theme, now);
    lines.extend(panels::gimbal_rows(model, theme, now).into_iter().take(2));
    lines.push(status_lines::link_line(model, theme, now, usize::from(inside.width)));
    draw_lines(frame, inside, &lines);
}

fn draw_checklist(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let inside = titled(&lists::checklist_title(model, now), theme, frame, area);
    let size = (usize::from(inside.width), usize::from(inside.height));
    draw_lines(frame, inside, &lists::checklist_rows(model, theme, now, size));
}

/// The landing that the vehicle has planned on the pad.
fn draw_rehearsal(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let inside = titled("Rehearsed landing: plan", theme, frame, area);
    let seen = (pictures::FlightPart::Burn, pictures::Viewpoint::East);
    pictures::draw_side_view(model, seen, theme, now, frame, inside);
}

/// Failing checks first, because a small screen must show them.
pub fn pad_lines(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    // In flight the next event is already shown above.
    let mut lines: Vec<Line> = match status_lines::next_event_line(model, theme, now) {
        Some(_) => Vec::new(),
        None => vec![top_lines::command(model, theme, now)],
    };
    let (words, role) = summary(model, now);
    lines.push(theme.line(format!(" {words}"), role));
    let mut checks = checks(model, theme, now);
    checks.sort_by_key(|line| line.spans.first().is_none_or(|span| !span.content.starts_with(" NO")));
    lines.extend(checks);
    if model.checklist.is_some() {
        lines.push(theme.line(format!(" {}", lists::checklist_title(model, now)), TextRole::Title));
        lines.extend(lists::checklist_rows(
            model,
            theme,
            now,
            (CHECK_COLUMNS.into(), usize::from(CHECK_ROWS)),
        ));
    }
    // Before the first command two lines may be equal.
    lines.dedup_by_key(|line| line.to_string());
    lines.extend(ladder(model, theme, now));
    lines
}

/// Each failing check with the value found and why it fails; how many pass; the measured values of those.
fn checks(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    // Off the pad the vehicle does not check for arming and reports no failing check.
    let off_pad = model.vehicle.phase().is_some_and(|phase| !is_on_pad(phase.value));
    let Some(status) = model.vehicle.status.as_ref().filter(|_| !off_pad) else {
        let hints = unheard_hints(model, now).unwrap_or_default();
        let wrapped = |words: String| lists::wrap(&words, usize::from(CHECK_COLUMNS - 2));
        let lines = hints.into_iter().flat_map(wrapped);
        return lines.map(|words| Line::from(format!(" {words}"))).collect();
    };
    let mark = if status.is_stale(now) { STALE_MARK } else { " " };
    let row = |word: &'static str, (name, bit): (&str, TdCheck), reason: &'static str| {
        let name = words::check(name);
        let found = found(&model.vehicle, bit);
        Line::from(vec![
            theme.span(word, if reason.is_empty() { TextRole::Plain } else { TextRole::Alarm }),
            theme.plain(format!("{mark}{name:<19.19}")),
            theme.plain(format!("{found:>10} ")),
            theme.span(reason, TextRole::Caution),
        ])
    };
    let fails = |bit: TdCheck| status.value.checks_failed.contains(bit);
    let all = TdCheck::all();
    let (station_log_fails, station_log) = station_log(model, theme, now);
    let several = model.vehicle_rows(now).into_iter();
    let several = several.map(|words| theme.line(format!(" {words}"), TextRole::Alarm));
    let mut lines: Vec<Line> = several.collect();
    if station_log_fails {
        lines.push(station_log.clone());
    }
    let failing = all.iter_names().filter(|(_, bit)| fails(*bit));
    lines.extend(failing.map(|check| row(" NO ", check, failure(check.1))));
    let (pass, of) = (all.iter().filter(|bit| !fails(*bit)).count(), all.iter().count());
    let count = format!(" GO {mark}{pass} of {of} checks");
    lines.push(theme.line(count, TextRole::Good));
    let measured = |(_, bit): &(&str, TdCheck)| !fails(*bit) && found(&model.vehicle, *bit).contains(' ');
    lines.extend(all.iter_names().filter(measured).map(|check| row("    ", check, "")));
    // Without --mission nothing but the crew compares it with what they mean to fly.
    lines.extend(
        model
            .vehicle
            .mission()
            .map(|mission| {
                let fits = usize::from(CHECK_COLUMNS).saturating_sub(24);
                theme.plain(format!(
                    "    {mark}{:<19}{}",
                    "mission",
                    status_lines::cut(&format!("{} {}", mission.in_words(), mission.hash), fits)
                ))
            })
            .map(Line::from),
    );
    if !station_log_fails {
        lines.push(station_log);
    }
    lines
}

/// Whether the checks pass, in words.
fn summary(model: &Model, now: Duration) -> (String, TextRole) {
    let off_pad = model.vehicle.phase().is_some_and(|phase| !is_on_pad(phase.value));
    match model.vehicle.status.as_ref() {
        _ if off_pad => ("off the pad nothing is checked for arming".to_owned(), TextRole::Label),
        None if unheard_hints(model, now).is_some() => ("nothing heard".to_owned(), TextRole::Caution),
        None => ("the vehicle has not reported its checks".to_owned(), TextRole::Caution),
        Some(status) if status.is_stale(now) || status.value.checks_failed.is_empty() => {
            top_lines::readiness(model, now).unwrap_or_default()
        }
        Some(status) => {
            let failing = status.value.checks_failed.iter_names().count();
            let all = TdCheck::all().iter_names().count();
            (format!("NO-GO: {failing} of {all} checks fail"), TextRole::Alarm)
        }
    }
}

/// Whether the station's own log fails as a check, and its row.
fn station_log(model: &Model, theme: Theme, now: Duration) -> (bool, Line<'static>) {
    let space = model.log.space.map_or_else(|| "running".to_owned(), |space| space.words());
    let (word, role, found) = match model.station_log(now) {
        LogStanding::None => ("    ", TextRole::Label, "none (--log none)".to_owned()),
        LogStanding::Fine => ("    ", TextRole::Plain, space),
        LogStanding::Warned(words) => (" !! ", TextRole::Caution, words),
        LogStanding::Unfit(_, words) if model.why_no_log(now).is_some() => (" NO ", TextRole::Alarm, words),
        LogStanding::Unfit(_, words) => (" !! ", TextRole::Caution, format!("overruled: {words}")),
    };
    let line = Line::from(vec![
        theme.span(word, role),
        theme.plain(" station log "),
        theme.span(found, if word == "    " { TextRole::Plain } else { TextRole::Caution }),
    ]);
    (word == " NO ", line)
}

/// The value that telemetry shows for a check; empty if there is none.
fn found(vehicle: &Vehicle, check: TdCheck) -> String {
    let locks = vehicle.interlocks();
    let yes_no = |bit: TdInterlock, yes: &'static str, no: &'static str| {
        locks.map_or("", |locks| if locks.contains(bit) { yes } else { no }).to_owned()
    };
    let number = |value: Option<f64>, decimals: usize, unit: &str| {
        value.map_or_else(String::new, |value| format!("{} {unit}", fixed(value, decimals)))
    };
    let attitude = vehicle.attitude.map(|attitude| attitude.value);
    match check {
        TdCheck::TD_CHECK_ABORT_LATCH => yes_no(TdInterlock::TD_INTERLOCK_ABORT_LATCHED, "latched", "free"),
        TdCheck::TD_CHECK_PIN => yes_no(TdInterlock::TD_INTERLOCK_PIN_OUT, "out", "in"),
        TdCheck::TD_CHECK_TILT => number(attitude.map(|a| a.tilt_rad.to_degrees()), 1, "deg"),
        TdCheck::TD_CHECK_ROTATION => number(attitude.map(|a| a.turn_rate_rad_s().to_degrees()), 1, "deg/s"),
        TdCheck::TD_CHECK_SPEED => number(vehicle.motion.map(|m| m.value.speed_m_s()), 2, "m/s"),
        TdCheck::TD_CHECK_FINS => {
            let error =
                vehicle.fins().map(|fins| fins.value.iter().map(Deflection::error_deg).fold(0.0, f64::max));
            number(error, 1, "deg")
        }
        TdCheck::TD_CHECK_CONTROLLER_WARM => {
            vehicle.last::<TD_CONTROLLER_DATA>().map_or_else(String::new, |c| {
                words::lower_case(&c.value.solver_status, "TD_SOLVER_STATUS_").chars().take(10).collect()
            })
        }
        TdCheck::TD_CHECK_PREDICTED_TOUCHDOWN => vehicle.prediction.map_or_else(String::new, |prediction| {
            prediction.value.touchdown.violations().unwrap_or_else(|| "inside".to_owned())
        }),
        TdCheck::TD_CHECK_BATTERY => number(vehicle.battery().map(|battery| battery.value.volts), 2, "V"),
        TdCheck::TD_CHECK_LOG_SPACE => number(vehicle.log_space_mib().map(|space| space.value), 0, "MiB"),
        _ => String::new(),
    }
}

/// Why a check fails.
fn failure(check: TdCheck) -> &'static str {
    match check {
        TdCheck::TD_CHECK_ABORT_LATCH => "power cycle",
        TdCheck::TD_CHECK_PIN => "pull the pin",
        TdCheck::TD_CHECK_SELF_TEST => "not passed",
        TdCheck::TD_CHECK_TILT => "not upright",
        TdCheck::TD_CHECK_ROTATION => "turning",
        TdCheck::TD_CHECK_SPEED => "moving",
        TdCheck::TD_CHECK_ESTIMATOR => "not settled",
        TdCheck::TD_CHECK_FINS => "no answer",
        TdCheck::TD_CHECK_IGNITER => "open circuit",
        TdCheck::TD_CHECK_LOG => "not running",
        TdCheck::TD_CHECK_LOG_SPACE => "disk full",
        TdCheck::TD_CHECK_CONTROLLER_WARM => "no rehearsal",
        TdCheck::TD_CHECK_PREDICTED_TOUCHDOWN => "outside",
        TdCheck::TD_CHECK_UPLINK => "not heard",
        TdCheck::TD_CHECK_BATTERY => "too low",
        _ => "",
    }
}

/// The rung of the checks, and of the checklist if there is one.
fn checks_rung(model: &Model, now: Duration) -> String {
    match model.steps_done(now) {
        None => "every check passes".to_owned(),
        Some((done, all)) => {
            format!("checks; checklist {done}/{all} ({})", model.settings.keys.name(Act::Checklist))
        }
    }
}

/// The steps from link to countdown, and which are done.
fn ladder(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let vehicle = &model.vehicle;
    let phase = vehicle.phase_now();
    let armed = vehicle.is_armed();
    let on_pad = phase.is_some_and(is_on_pad);
    let checked =
        on_pad && vehicle.status.as_ref().is_some_and(|status| status.value.checks_failed.is_empty());
    let pin_out = vehicle.interlocks().is_some_and(|locks| locks.contains(TdInterlock::TD_INTERLOCK_PIN_OUT));
    let counting = vehicle.countdown_s().is_some();
    let keys = &model.settings.keys;
    let two = model.people() == Some(2);
    let then = |act: Act, word: &str| {
        let key = keys.name(act);
        if two {
            format!("{key}, {word} Enter, then CONFIRM")
        } else {
            format!("{key}, then {word} Enter (10 s)")
        }
    };
    let rungs = [
        (model.link.state(now).carries(), "the vehicle is heard".to_owned()),
        (model.link.uplink.is_proven(now), "it hears us: uplink proven".to_owned()),
        (pin_out, "pin out (first inhibit)".to_owned()),
        (checked && model.why_checklist(now).is_none(), checks_rung(model, now)),
        (armed, then(Act::Arm, "ARM")),
        (armed && phase == Some(TdPhase::TD_PHASE_PAD_ARMED), "armed, says HEARTBEAT".to_owned()),
        (counting, then(Act::Start, "START")),
    ];
    let mut lines: Vec<Line> = rungs
        .into_iter()
        .map(|(stands, words)| {
            let (mark, role) = if stands { (" [x] ", TextRole::Good) } else { (" [ ] ", TextRole::Label) };
            Line::from(vec![theme.span(mark, role), theme.plain(words)])
        })
        .collect();
    if let Some(number) = model.commanded_by() {
        let here = number == model.own_number();
        let words = format!(" {} commands{}", model.operator(number), if here { " (you)" } else { "" });
        lines.push(theme.line(words, TextRole::Plain));
    }
    let watches = model.settings.role.why_not_command();
    let only_stops = why_not_here(model).map(|_| "HOLD and ABORT only from here");
    lines.push(match watches.or(only_stops) {
        Some(why) => theme.line(format!(" {why}"), TextRole::Label),
        None => Line::from(vec![
            theme.key(format!(" {}", keys.name(Act::Disarm))),
            theme.label(" disarm   "),
            theme.key(top_lines::ABORT_KEY),
            theme.label(" ABORT"),
        ]),
    });
    let arming = model.commands.of(CommandKind::Arm).filter(|_| !armed);
    lines.extend(arming.map(|track| top_lines::command_facts_short(track, theme, now)));
    lines
}

// What is shown instead of the Pad page while the vehicle is none of ours: its standard telemetry.

/// The telemetry, and below it the newest events: why something was refused is one of them.
pub fn foreign_lines(
    model: &Model,
    foreign: &Foreign,
    theme: Theme,
    now: Duration,
    (columns, rows): (usize, usize),
) -> Vec<Line<'static>> {
    let plain = |text: String| theme.line(text, TextRole::Plain);
    let mut lines = vec![
        theme.line(format!(" NOT A TOUCHDOWN VEHICLE: {}", foreign.name()), TextRole::Alarm),
        plain(format!(" mode {}, {}", foreign.mode(), if foreign.armed { "ARMED" } else { "disarmed" })),
        plain(" Nothing is armed or started there from here.".to_owned()),
        theme.line(format!(" An abort {}.", foreign.termination()), TextRole::Caution),
    ];
    lines.extend(foreign.told.iter().map(|(name, text)| {
        let (mark, role) = age_mark(text, now);
        let role = if role == TextRole::Stale { role } else { TextRole::Plain };
        Line::from(vec![
            theme.label(format!(" {name:<9}")),
            theme.span(format!("{mark}{}", text.value), role),
        ])
    }));
    let room = rows.saturating_sub(lines.len());
    lines.extend(lists::events(model, theme, columns, room));
    lines
}

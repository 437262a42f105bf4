//! The last rows of every page: an alarm, a message, or the flight along its time; and the keys
//! that work now.

use std::time::Duration;

use protocol::dialect::TdPhase;
use protocol::log::record::EventLevel;
use protocol::reported::event_of;
use ratatui::Frame;
use ratatui::layout::Constraint::{Fill, Length};
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};

use super::lists::crew_events;
use super::status_lines::{alarm_text, replay_line};
use super::{Ink, TextRole, Theme, draw_line, side_by_side, top_lines};
use crate::model::{
    Act, Event, KeepAway, Model, Page, Playback, dead_reckoning::is_silent, dead_reckoning::predicted_course,
    flight_began, is_burning, is_flight, is_on_pad,
};
use crate::view::pictures::seconds_since;

/// From this width on the flight has a second row, for the names of its events with their times.
const TWO_ROWS_COLUMNS: usize = 120;

/// The rows above the keys: an unacknowledged alarm; else a message, the flight along its time, or
/// the newest event. While an alarm rings, a message has a row of its own. Where the flight has two
/// rows, an alarm or a message takes the second.
pub fn message_rows(model: &Model, theme: Theme, now: Duration, columns: u16) -> Vec<Line<'static>> {
    let columns = usize::from(columns);
    let rings = model.alarms.unacknowledged() > 0 && model.playing.is_none();
    let alarm = alarm_text(model, theme, now, columns).filter(|_| rings);
    // In flight nothing moves for it.
    let hidden = alarm.is_some() && model.vehicle.in_flight();
    // A message that the alarm contains needs no second row.
    let alarmed = model.alarms.foremost().filter(|_| alarm.is_some()).map_or("", |alarm| &alarm.what.text);
    let is_new = |message: &Line| !alarmed.contains(message.to_string().trim());
    let message = top_lines::message(model, theme, now, columns).filter(|words| !hidden && is_new(words));
    let is_flown = model.playing.is_some() || flight_began(model).is_some();
    let mut over: Vec<_> = message.into_iter().chain(alarm).collect();
    let rows = if is_flown && columns >= TWO_ROWS_COLUMNS { 2 } else { 1 };
    if is_flown && over.len() < rows {
        over.splice(0..0, timeline(model, theme, now, columns, over.len() + 2 == rows));
    }
    if over.is_empty() {
        let line = |(event, text): (&Event, _)| {
            let role = if event.level == EventLevel::Info { TextRole::Label } else { TextRole::Plain };
            theme.line(format!(" {:.1} {}{text}", event.at.as_secs_f64(), event.mark().trim_start()), role)
        };
        over.push(crew_events(model).next().map(line).unwrap_or_default());
    }
    over
}

// The flight along its time: past and expected events, warnings and errors, and the shown moment.

/// Lengths of the line of a flight in progress, s, in steps, so that it is rarely redrawn.
pub const LENGTHS_S: [f64; 10] = [20.0, 30.0, 45.0, 60.0, 120.0, 300.0, 600.0, 1_800.0, 7_200.0, 36_000.0];
/// The steps of what is expected, in lengths of the line.
const EXPECTED_STEP: f64 = 1.0 / 40.0;
/// The marks of the shown moment, of a past and an expected event, of a warning or an error; of the
/// time that has passed, and that is to come.
const NOW: char = '◆';
const BEEN: char = '●';
const EXPECTED: char = '○';
const EVENT: char = '!';
const PASSED: char = '━';
const TO_COME: char = '┄';

/// The pictures of a flight stand still this long after the touchdown.
const STILL_AFTER: Duration = Duration::from_secs(2);

/// A flight is shown to this moment: to now, and on the ground not much longer than it lasted.
pub fn shown_until(model: &Model, now: Duration) -> Duration {
    let mut flown = model.history.timeline.iter().skip_while(|(phase, _)| is_on_pad(*phase));
    flown.find(|(phase, _)| !is_flight(*phase)).map_or(now, |(_, at)| now.min(*at + STILL_AFTER))
}

/// When the picture of a recorded flight begins and ends: the flight fills it, not the time on the
/// pad and the waiting after it.
pub fn recorded(playing: &Playback) -> (Duration, Duration) {
    let mut flown = playing.phases.iter().skip_while(|(phase, _)| is_on_pad(*phase));
    let from = flown.next().map_or(Duration::ZERO, |(_, at)| at.saturating_sub(STILL_AFTER));
    let down = flown.find(|(phase, _)| !is_flight(*phase));
    (from, down.map_or(playing.length, |(_, at)| playing.length.min(*at + STILL_AFTER)))
}

/// The events that the vehicle predicts, with their times.
pub fn expected(model: &Model, now: Duration) -> Vec<(&'static str, Duration)> {
    let vehicle = &model.vehicle;
    let Some(phase) = vehicle.phase_now().filter(|_| vehicle.in_flight()) else { return Vec::new() };
    let apogee = vehicle.of_descent(|d| d.time_to_apogee_s).filter(|left| left.value > 0.0);
    let ignition = vehicle.ignition_in_s(now).filter(|_| !is_burning(phase));
    let touchdown = vehicle.touchdown_in_s(now).filter(|_| is_burning(phase)).map(|left| left.value);
    let ground = || {
        let ends = predicted_course(vehicle, now).last().copied().filter(|(_, [.., up_m])| *up_m < 1.0)?;
        Some(seconds_since(ends.0, now))
    };
    let left = [
        ("apogee", apogee.map(|left| left.value - left.age(now).as_secs_f64())),
        ("ignition", ignition.map(|left| left.value)),
        ("touchdown", touchdown.or_else(ground)),
    ];
    // After a loss of the link, the expected touchdown may have passed.
    let upcoming = left.into_iter().filter_map(|(name, left_s)| {
        let left_s = left_s.filter(|left_s| *left_s >= 0.0 || is_silent(vehicle, now))?;
        Some((name, Duration::try_from_secs_f64(now.as_secs_f64() + left_s).ok()?))
    });
    upcoming.collect()
}

/// The flight along its time in a row, and from some width on the names in a second one.
fn timeline(model: &Model, theme: Theme, now: Duration, columns: usize, is_wide: bool) -> Vec<Line<'static>> {
    let now = if model.playing.is_some() { now } else { shown_until(model, now) };
    let columns = columns.saturating_sub(2).max(1);
    let to_come = expected(model, now);
    let (phases, from, length_s): (&[(TdPhase, Duration)], Duration, f64) =
        if let Some(playing) = &model.playing {
            let (from, until) = recorded(playing);
            (&playing.phases, from, until.saturating_sub(from).as_secs_f64().max(1.0))
        } else {
            let from = flight_began(model).unwrap_or(now);
            let last = to_come.iter().map(|(_, at)| *at).max().unwrap_or(now).max(now);
            let needed_s = last.saturating_sub(from).as_secs_f64();
            let length_s = LENGTHS_S.into_iter().find(|length_s| needed_s < *length_s).unwrap_or(needed_s);
            (&model.history.timeline, from, length_s)
        };
    let column = |at: Duration| {
        let share = at.saturating_sub(from).as_secs_f64() / length_s;
        ((share * columns as f64) as usize).min(columns - 1)
    };
    let here = column(now);
    let mut rows = vec![vec![(' ', Ink::Body); columns]; 1 + usize::from(is_wide)];
    for (place, cell) in rows[0].iter_mut().enumerate() {
        let passed = place <= here || model.playing.is_some();
        *cell = if passed { (PASSED, Ink::Measured) } else { (TO_COME, Ink::Predicted) };
    }
    for event in model.events.newest(usize::MAX) {
        if event.level != EventLevel::Info && event.at >= from {
            rows[0][column(event.at)] = (EVENT, Ink::Body);
        }
    }
    let been = phases.iter().enumerate().filter_map(|(place, (phase, at))| {
        let after = phases.get(place + 1).map(|(phase, _)| *phase);
        let has_lifted = after.map_or(model.vehicle.has_lifted(), |after| !is_on_pad(after));
        let commanded = *phase == TdPhase::TD_PHASE_BOOST && !has_lifted;
        // Apogee and fall are one event, and so are ignition and burn.
        let before = place.checked_sub(1).map(|before| phases[before].0);
        let again = matches!(before, Some(TdPhase::TD_PHASE_DEPLOY | TdPhase::TD_PHASE_IGNITION));
        let name = if commanded { "ignition commanded" } else { event_of(*phase).filter(|_| !again)? };
        Some((name, *at, *at, BEEN, Ink::Measured))
    });
    // In steps, so that it does not tremble; never in the past.
    let step_s = length_s * EXPECTED_STEP;
    let steady = |at: Duration| {
        let steps = libm::round(at.saturating_sub(from).as_secs_f64() / step_s);
        let at = from + Duration::from_secs_f64(steps * step_s);
        if is_silent(&model.vehicle, now) { at } else { at.max(now) }
    };
    let to_come = to_come.iter().map(|(name, at)| (*name, steady(*at), *at, EXPECTED, Ink::Predicted));
    let reset = model.rebooted.filter(|_| model.vehicle.reset_in_flight);
    let reset = reset.map(|(_, at)| ("RESET", at, at, EVENT, Ink::Body));
    let marks: Vec<_> = been.chain(reset).chain(to_come).filter(|(_, at, ..)| *at >= from).collect();
    let began = model.playing.as_ref().map_or(from, |playing| playing.began);
    for (_, at, _, mark, ink) in &marks {
        rows[0][column(*at)] = (*mark, *ink);
    }
    // A name is written under its mark, else beside it, in blank cells; without room it is left
    // out.
    for (name, at, exactly, _, ink) in &marks {
        let begin = column(*at);
        let time_s = seconds_since(*exactly, began);
        let name = if is_wide { format!("{name} {time_s:.1}") } else { (*name).to_owned() };
        let length = name.len();
        // Before its mark only where no other mark is.
        let beside = [(0, Some(begin + 1), 0), (0, begin.checked_sub(length), 1)];
        let under = [(1, Some(begin), 0), (1, (begin + 1).checked_sub(length), 0)];
        let places = under.into_iter().filter(|_| is_wide).chain(beside);
        let is_free = |row: &[(char, Ink)], at: usize, before: usize| {
            let letter = |place: usize| row.get(place).map_or(' ', |(letter, _)| *letter);
            let blank = |place| [' ', PASSED, TO_COME, EVENT].contains(&letter(place));
            let apart = [at.wrapping_sub(1), at + length].iter().all(|at| !letter(*at).is_alphanumeric());
            apart && at + length <= columns && (at.saturating_sub(before)..at + length).all(blank)
        };
        let free = |(row, at, before): (usize, Option<usize>, usize)| {
            at.filter(|at| is_free(&rows[row], *at, before)).map(|at| (row, at))
        };
        if let Some((row, at)) = places.into_iter().find_map(free) {
            for (cell, letter) in rows[row][at..].iter_mut().zip(name.chars()) {
                *cell = (letter, *ink);
            }
        }
    }
    // Never within a name or its time.
    if !rows[0][here].0.is_alphanumeric() && rows[0][here].0 != '.' {
        rows[0][here] = (NOW, Ink::Body);
    }
    let span = |run: &[(char, Ink)]| {
        let text: String = run.iter().map(|(letter, _)| *letter).collect();
        Span::styled(text, theme.ground().fg(theme.ink(run[0].1)))
    };
    let line = |cells: Vec<(char, Ink)>| {
        let runs = cells.chunk_by(|(_, one), (_, next)| one == next).map(span);
        Line::from(std::iter::once(Span::raw(" ")).chain(runs).collect::<Vec<_>>())
    };
    rows.into_iter().map(line).collect()
}

// The keys that count now, and the pages.

/// The keys come in this order.
const KEYS: [Act; 14] = [
    Act::Tap,
    Act::HoldCountdown,
    Act::Acknowledge,
    Act::Hold,
    Act::Arm,
    Act::Start,
    Act::Disarm,
    Act::TakeCommand,
    Act::Report,
    Act::SignStep,
    Act::VoidStep,
    Act::Check,
    Act::RangeTest,
    Act::Checklist,
];
/// At least this many columns are for the keys, if every page need not be named.
const KEY_COLUMNS: u16 = 34;

/// Draws the keys that do something now, and the pages with the shown one in brackets and whether
/// it is held.
pub fn draw_keys(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let pages = pages(model, theme, area.width.saturating_sub(KEY_COLUMNS));
    let [left, right] = side_by_side(area, [Fill(1), Length(pages.width() as u16)]);
    draw_line(frame, right, pages);
    if let Some(playing) = &model.playing {
        return draw_line(frame, left, replay_line(playing, theme));
    }
    let rings = model.alarms.unacknowledged() > 0;
    // In flight no command but the abort does anything, and the page matters.
    let holds = model.vehicle.in_flight() && model.pages.held.is_none();
    let away = KeepAway::of(&model.vehicle, now).is_some_and(|away| !away.is_for_the_pin());
    let matters = |act: &Act| match act {
        Act::Acknowledge => rings,
        Act::Hold => holds,
        Act::HoldCountdown => !model.is_past_hold(now),
        Act::Start => !away && !model.vehicle.counts_down(),
        Act::Arm | Act::Check => !away,
        _ => true,
    };
    let works = |act: &Act| matters(act) && act.works(model, now);
    let mut room = usize::from(left.width);
    let spans = KEYS
        .into_iter()
        .filter(works)
        .map(|act| [theme.key(format!(" {}", act.key_name())), theme.label(format!(" {} ", act.short()))]);
    let fits = |pair: &[Span; 2]| {
        let width = pair.iter().map(Span::width).sum();
        let fits = width <= room;
        room = room.saturating_sub(width);
        fits
    };
    draw_line(frame, left, Line::from(spans.take_while(fits).flatten().collect::<Vec<_>>()));
}

fn pages(model: &Model, theme: Theme, room: u16) -> Line<'static> {
    let shown = model.page();
    let (word, role) = match model.pages.held {
        Some(_) => (" HELD 0", TextRole::Caution),
        None => (" auto", TextRole::Good),
    };
    let more = theme.label(format!(" {}more", Act::Palette.key_name()));
    let of = |page: Page| {
        let key = Act::Show(page).key_name();
        if page == shown.keyed() {
            // Ascent and descent share a key.
            theme.key(format!(" [{key}{}]", shown.name()))
        } else {
            theme.label(format!(" {key}{}", page.name()))
        }
    };
    let needed = more.width() + word.len() + of(shown.keyed()).width();
    let mut left = usize::from(room).saturating_sub(needed);
    // Those that fit, in their order, and in any case the shown one.
    let fits = |page: &Page| {
        let width = of(*page).width();
        let fits = width <= left || *page == shown.keyed();
        if *page != shown.keyed() {
            left = if fits { left - width } else { 0 };
        }
        fits
    };
    let pages = Page::all().filter(fits).map(of);
    Line::from(pages.chain([more.clone(), theme.span(word, role)]).collect::<Vec<_>>())
}

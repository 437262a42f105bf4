//! The last rows of every page: an alarm, a message, or the flight along its time; and the keys that do something now.

use std::time::Duration;

use protocol::dialect::TdPhase;
use protocol::log::record::EventLevel;
use ratatui::Frame;
use ratatui::layout::Constraint::{Fill, Length};
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};

use super::status_lines::{alarm_text, replay_line};
use super::{Ink, TextRole, Theme, draw_line, side_by_side, top_lines};
use crate::model::{Act, Model, Page, dead_reckoning::course, is_burning, is_on_pad, words};

/// The rows above the keys: an alarm that nobody has seen; else a message, the flight along its time, or the newest event. While an
/// alarm rings, a message has a row of its own.
pub fn message_rows(model: &Model, theme: Theme, now: Duration, columns: u16) -> Vec<Line<'static>> {
    let columns = usize::from(columns);
    let message = top_lines::message(model, theme, now, columns);
    let rings = model.alarms.unacknowledged() > 0 && model.playing.is_none();
    if let Some(alarm) = alarm_text(model, theme, now, columns).filter(|_| rings) {
        // In flight nothing moves for it.
        let message = message.filter(|_| !model.vehicle.in_flight());
        return message.into_iter().chain([alarm]).collect();
    }
    let is_flown = model.playing.is_some() || flight_began(model).is_some();
    let flight = || is_flown.then(|| timeline(model, theme, now, columns));
    let row = message.or_else(flight).or_else(|| newest_event(model, theme));
    vec![row.unwrap_or_default()]
}

fn newest_event(model: &Model, theme: Theme) -> Option<Line<'static>> {
    model.events.newest(1).next().map(|event| {
        let role = if event.level == EventLevel::Info { TextRole::Label } else { TextRole::Plain };
        let head = format!(" {:.1} ", event.at.as_secs_f64());
        theme.line(format!("{head}{}{}", event.mark().trim_start(), event.text), role)
    })
}

// The flight along its time: what has been, what is expected, warnings and errors, and the shown moment.

/// How long the line of a flight in progress is, so that it is rarely drawn anew, s.
pub const LENGTHS_S: [f64; 10] = [20.0, 30.0, 45.0, 60.0, 120.0, 300.0, 600.0, 1_800.0, 7_200.0, 36_000.0];
/// The steps of what is expected, in lengths of the line.
const EXPECTED_STEP: f64 = 1.0 / 40.0;
/// The mark of the shown moment, of what has been, of what is expected, of a warning or an error; the time that has passed, and
/// that is to come.
const NOW: char = '◆';
const BEEN: char = '●';
const EXPECTED: char = '○';
const EVENT: char = '!';
const PASSED: char = '━';
const TO_COME: char = '┄';

/// When the flight began.
pub fn flight_began(model: &Model) -> Option<Duration> {
    model.history.timeline.iter().find(|(phase, _)| !is_on_pad(*phase)).map(|(_, at)| *at)
}

/// What the vehicle has told that will come, with its time.
pub fn expected(model: &Model, now: Duration) -> Vec<(&'static str, Duration)> {
    let vehicle = &model.vehicle;
    let Some(phase) = vehicle.phase_now().filter(|_| vehicle.in_flight()) else { return Vec::new() };
    let apogee = vehicle.of_descent(|d| d.time_to_apogee_s).filter(|left| left.value > 0.0);
    let ignition = vehicle.ignition_in_s(now).filter(|_| !is_burning(phase));
    let touchdown = vehicle.touchdown_in_s(now).filter(|_| is_burning(phase)).map(|left| left.value);
    let ground =
        || course(vehicle, now).last().filter(|(_, [.., up_m])| *up_m < 1.0).map(|(ahead_s, _)| *ahead_s);
    let left = [
        ("apogee", apogee.map(|left| left.value - left.age(now).as_secs_f64())),
        ("ignition", ignition.map(|left| left.value)),
        ("touchdown", touchdown.or_else(ground)),
    ];
    let known =
        left.into_iter().filter_map(|(name, left_s)| Some((name, left_s.filter(|left_s| *left_s >= 0.0)?)));
    known.map(|(name, left_s)| (name, now + Duration::from_secs_f64(left_s))).collect()
}

fn timeline(model: &Model, theme: Theme, now: Duration, columns: usize) -> Line<'static> {
    let columns = columns.saturating_sub(2).max(1);
    let to_come = expected(model, now);
    let (phases, from, length_s): (&[(TdPhase, Duration)], Duration, f64) =
        if let Some(playing) = &model.playing {
            (&playing.phases, Duration::ZERO, playing.length.as_secs_f64().max(1.0))
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
    let mut cells: Vec<(char, Ink)> = (0..columns)
        .map(|place| {
            let passed = place <= column(now) || model.playing.is_some();
            if passed { (PASSED, Ink::Measured) } else { (TO_COME, Ink::Predicted) }
        })
        .collect();
    for event in model.events.newest(usize::MAX) {
        if event.level != EventLevel::Info && event.at >= from {
            cells[column(event.at)] = (EVENT, Ink::Body);
        }
    }
    let been = phases.iter().enumerate().filter_map(|(place, (phase, at))| {
        let after = phases.get(place + 1).map(|(phase, _)| *phase);
        let has_lifted = after.map_or(model.vehicle.has_lifted, |after| !is_on_pad(after));
        let is_told = *phase == TdPhase::TD_PHASE_BOOST && !has_lifted;
        let name = if is_told { "commanded to light" } else { words::event(*phase)? };
        Some((name, *at, BEEN, Ink::Measured))
    });
    // In steps, so that it does not tremble; never in the past.
    let step_s = length_s * EXPECTED_STEP;
    let steady = |at: Duration| {
        let steps = libm::round(at.saturating_sub(from).as_secs_f64() / step_s);
        (from + Duration::from_secs_f64(steps * step_s)).max(now)
    };
    let to_come = to_come.iter().map(|(name, at)| (*name, steady(*at), EXPECTED, Ink::Predicted));
    let marks: Vec<_> = been.chain(to_come).filter(|(_, at, ..)| *at >= from).collect();
    for (place, (name, at, mark, ink)) in marks.iter().enumerate() {
        let begin = column(*at);
        let end = marks.get(place + 1).map_or(columns, |(_, next, ..)| column(*next));
        cells[begin] = (*mark, *ink);
        let before = place.checked_sub(1).map_or(0, |before| column(marks[before].1) + 1);
        let here = column(now).max(before) + 1;
        let at = match () {
            () if begin + 1 + name.len() < end => begin + 1,
            // At the end of the line its name stands before it.
            () if begin >= here + name.len() && place + 1 == marks.len() => begin - name.len(),
            () => continue,
        };
        for (cell, letter) in cells[at..].iter_mut().zip(name.chars()) {
            *cell = (letter, *ink);
        }
    }
    let here = column(now);
    if !cells[here].0.is_alphabetic() {
        cells[here] = (NOW, Ink::Body);
    }
    let span = |run: &[(char, Ink)]| {
        let text: String = run.iter().map(|(letter, _)| *letter).collect();
        Span::styled(text, theme.ground().fg(theme.ink(run[0].1)))
    };
    let runs = cells.chunk_by(|(_, one), (_, next)| one == next).map(span);
    Line::from(std::iter::once(Span::raw(" ")).chain(runs).collect::<Vec<_>>())
}

// The keys that count now, and the pages.

/// The keys come in this order.
const KEYS: [Act; 14] = [
    Act::Tap,
    Act::HoldCountdown,
    Act::Acknowledge,
    Act::Arm,
    Act::Start,
    Act::Disarm,
    Act::TakeCommand,
    Act::ReplayFlight,
    Act::Report,
    Act::SignStep,
    Act::VoidStep,
    Act::Check,
    Act::RangeTest,
    Act::Checklist,
];
/// At least this many columns are for the keys, if every page need not be named.
const KEY_COLUMNS: u16 = 34;

/// Draws the keys that do something now, and the pages with the shown one in brackets and whether it is held.
pub fn draw_keys(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let pages = pages(model, theme, area.width.saturating_sub(KEY_COLUMNS));
    let [left, right] = side_by_side(area, [Fill(1), Length(pages.width() as u16)]);
    draw_line(frame, right, pages);
    if let Some(playing) = &model.playing {
        return draw_line(frame, left, replay_line(playing, model.pages.entry.as_ref(), theme));
    }
    let keys = &model.settings.keys;
    let rings = model.alarms.unacknowledged() > 0;
    let works = |act: &Act| act.works(model, now) && (*act != Act::Acknowledge || rings);
    let mut room = usize::from(left.width);
    let spans = KEYS
        .into_iter()
        .filter(works)
        .map(|act| [theme.key(format!(" {}", keys.name(act))), theme.label(format!(" {} ", act.short()))]);
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
    let keys = &model.settings.keys;
    let (word, role) = match model.pages.held {
        Some(_) => (" HELD 0", TextRole::Caution),
        None => (" auto", TextRole::Good),
    };
    let more = theme.label(format!(" {}more", keys.name(Act::Palette)));
    let of = |page: Page| {
        let key = keys.name(Act::Show(page));
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
    let pages = Page::ALL.into_iter().filter(fits).map(of);
    Line::from(pages.chain([more.clone(), theme.span(word, role)]).collect::<Vec<_>>())
}

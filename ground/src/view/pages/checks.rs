//! The page of the checks on the pad (every value with its limits, the radio range test, battery
//! and storage), and the page that helps to find the vehicle.

use std::time::Duration;

use protocol::dialect::{TD_PAD_CHECK_DATA, TdPadCheckItem, TdPadCheckState, TdPadCheckVerdict};
use ratatui::Frame;
use ratatui::layout::Constraint::{Fill, Length};
use ratatui::layout::Rect;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Paragraph, Wrap, canvas};

use crate::model::field;
use crate::model::{
    Act, Degrees, KeepAway, LOSS_MOST, LastPlace, MARGIN_LEAST_DB, Model, OWN_POSITION_OLD, PadCheck,
    SURFACES, Sample, Spot, Standing, Way, dead_reckoning::may_have_left, shown, standing, words,
};
use crate::view::band::Room;
use crate::view::pictures::{Plane, qr};
use crate::view::shared::{FROM_ABOVE, map};
use crate::view::widgets::{columns, framed, rows};
use crate::view::{Ink, TextRole, Theme, draw_line, draw_lines, fixed, seconds};

/// Columns of one value beside others.
const VALUE_COLUMNS: usize = 39;

/// The state of the check, its values, the radio.
pub fn checks_lines(model: &Model, theme: Theme, now: Duration, columns: usize) -> Vec<Line<'static>> {
    let check = model.vehicle.pad_check.as_ref();
    let mut lines = vec![headline(model, check, theme, now)];
    lines.push(theme.line(
        format!(" {:<13}{:>24}{:>20}{:>20}", "surface", "range, least", "error, most", "lag, most"),
        TextRole::Label,
    ));
    lines.extend(SURFACES.map(|of| surface(check, of, theme)));
    let others: Vec<&TD_PAD_CHECK_DATA> =
        check.into_iter().flat_map(PadCheck::values).filter(|value| value.item as u32 >= 18).collect();
    let beside = (columns / VALUE_COLUMNS).max(1);
    // Down the first column first, as they were found.
    let rows = others.len().div_ceil(beside);
    for row in 0..rows {
        let cells = (0..beside).filter_map(|column| others.get(row + column * rows));
        lines.push(Line::from(cells.flat_map(|value| cell(value, theme)).collect::<Vec<_>>()));
    }
    lines.push(radio(model, theme, now));
    lines
}

/// The running check, or its outcome, and the keys.
fn headline(model: &Model, check: Option<&PadCheck>, theme: Theme, now: Duration) -> Line<'static> {
    use TdPadCheckState as S;
    let [all, still, seen] = [Act::Check, Act::CheckStill, Act::Seen].map(Act::key_name);
    let begin = format!("  {all} checks (MOVES), {still} without motion");
    let end = format!("  {all} ends it");
    if standing(model, now) == Standing::MayRun {
        return Line::from(vec![
            theme.span(" A CHECK MAY RUN: hands off", TextRole::Caution),
            theme.label(end),
        ]);
    }
    let Some(check) = check.filter(|check| check.report.state != S::TD_PAD_CHECK_STATE_NOT_RUN) else {
        return Line::from(vec![theme.plain(" no check yet"), theme.label(begin)]);
    };
    let (run, failing) = (check.report.run, check.failing().count());
    let (words, role, then) = match check.report.state {
        S::TD_PAD_CHECK_STATE_RUNNING => {
            (format!(" CHECK {run} RUNS {} %: hands off", check.report.progress), TextRole::Caution, end)
        }
        S::TD_PAD_CHECK_STATE_PASSED if check.awaits_eyes() => {
            let words = format!(" CHECK {run} PASSED but for what only people see");
            (words, TextRole::Caution, format!("  {seen} confirms it"))
        }
        S::TD_PAD_CHECK_STATE_PASSED => (format!(" CHECK {run} PASSED"), TextRole::Good, begin),
        S::TD_PAD_CHECK_STATE_FAILED => {
            (format!(" CHECK {run} FAILED: {failing} outside"), TextRole::Alarm, begin)
        }
        _ => (format!(" CHECK {run} STOPPED early"), TextRole::Caution, begin),
    };
    let report = seconds(now.saturating_sub(check.reported_at));
    let by = Some(check.report.asked_by).filter(|number| *number > 0);
    let by = by.map_or_else(String::new, |number| format!(", {}", model.operator(number)));
    Line::from(vec![theme.span(words, role), theme.label(format!(" ({report} ago{by})")), theme.label(then)])
}

/// Battery and storage, outside of a check too.
pub fn supply(model: &Model, theme: Theme) -> Line<'static> {
    let not_reported = || "not reported".to_owned();
    let battery = model.vehicle.battery().map_or_else(not_reported, |battery| {
        let left = battery.value.percent.map_or_else(String::new, |percent| format!(", {percent} %"));
        format!("{}{left}", model.vehicle.volts().unwrap_or_default())
    });
    let free = |space: Sample<f64>| format!("{} MiB free", fixed(space.value, 0));
    let space = model.vehicle.log_space_mib().map_or_else(not_reported, free);
    let [volts, mib] = [battery, space].map(|words| theme.plain(words));
    Line::from(vec![theme.label(" battery "), volts, theme.label("   vehicle's log "), mib, theme.label(" ")])
}

fn role_of(verdict: TdPadCheckVerdict) -> (&'static str, TextRole) {
    match verdict {
        TdPadCheckVerdict::TD_PAD_CHECK_VERDICT_OK => ("ok ", TextRole::Good),
        TdPadCheckVerdict::TD_PAD_CHECK_VERDICT_NOT_OK => ("NO ", TextRole::Alarm),
        TdPadCheckVerdict::TD_PAD_CHECK_VERDICT_NOT_JUDGED => ("   ", TextRole::Plain),
    }
}

/// One surface: range, error and lag, each with its limit; of one without feedback, its expected
/// motion.
fn surface(check: Option<&PadCheck>, (name, first, seen): (&str, u32, &str), theme: Theme) -> Line<'static> {
    let values: Vec<Option<&TD_PAD_CHECK_DATA>> = (first..first + 3)
        .map(|item| check.and_then(|check| check.values().find(|value| value.item as u32 == item)))
        .collect();
    let mut spans = vec![theme.plain(format!(" {name:<13}"))];
    let is_judged = values
        .iter()
        .flatten()
        .any(|value| value.verdict != TdPadCheckVerdict::TD_PAD_CHECK_VERDICT_NOT_JUDGED);
    if check.is_some() && !is_judged {
        spans.push(theme.plain(seen.to_owned()));
        return Line::from(spans);
    }
    for (value, columns) in values.into_iter().zip([24, 20, 20]) {
        let Some(value) = value else {
            spans.push(theme.label(format!("{:>columns$}", "--")));
            continue;
        };
        let (mark, role) = role_of(value.verdict);
        let (_, unit, number) = shown(value);
        let limit = if value.least.is_finite() { value.least } else { value.most };
        let (found, limit) = (number(value.value), number(limit));
        let text = format!("{mark}{found}, {limit} {unit}");
        spans.push(theme.span(format!("{text:>columns$}"), role));
    }
    Line::from(spans)
}

/// A value with its limits, in a column.
fn cell(value: &TD_PAD_CHECK_DATA, theme: Theme) -> Vec<Span<'static>> {
    let (mark, role) = role_of(value.verdict);
    let (name, unit, number) = shown(value);
    let is_switch = unit.is_empty() && value.item != TdPadCheckItem::TD_PAD_CHECK_ITEM_GNSS_FIXES;
    let yes_no = if value.value > 0.5 { "yes" } else { "no" };
    let found = if is_switch { yes_no.to_owned() } else { format!("{} {unit}", number(value.value)) };
    let limits = match (value.least.is_finite(), value.most.is_finite()) {
        (false, false) => String::new(),
        _ if is_switch => String::new(),
        (true, true) => format!("{}..{}", number(value.least), number(value.most)),
        (true, false) => format!("least {}", number(value.least)),
        (false, true) => format!("most {}", number(value.most)),
    };
    vec![
        theme.span(format!(" {mark}"), role),
        theme.plain(format!("{name:<13.13}")),
        theme.span(format!("{found:>10.10}"), role),
        theme.label(format!(" {limits:<11.11}")),
    ]
}

/// The radio range test in one line, because the smallest full screen has no more: each result with
/// its limit.
fn radio(model: &Model, theme: Theme, now: Duration) -> Line<'static> {
    let Some(test) = model.range_test.as_ref() else {
        let begins = format!("  {} begins one: 30 s, antennas as in flight", Act::RangeTest.key_name());
        return Line::from(vec![theme.plain(" radio: no range test yet"), theme.label(begins)]);
    };
    let found = test.found.unwrap_or_else(|| test.so_far(None));
    let (words, role) = match (test.is_running(), found.stopped, found.passed()) {
        (true, ..) => (format!("RUNS {:.0} s", test.left(now).as_secs_f64()), TextRole::Caution),
        (false, Some(_), _) => ("STOPPED".to_owned(), TextRole::Caution),
        (false, None, true) => ("PASSED".to_owned(), TextRole::Good),
        (false, None, false) => ("FAILED".to_owned(), TextRole::Alarm),
    };
    let judged = |is_met: bool, words: String| {
        let (mark, role) = if is_met { ("ok", TextRole::Good) } else { ("NO", TextRole::Alarm) };
        theme.span(format!(" {mark} {words}"), role)
    };
    let loss = |of: &str, loss: f64| judged(loss <= LOSS_MOST, format!("{of} {} %", fixed(100.0 * loss, 1)));
    let mut spans = vec![theme.span(format!(" RADIO {words}"), role)];
    spans.extend([loss("lost down", found.loss_down), loss("up", found.loss_up)]);
    spans.push(theme.label(format!(" most {:.0}", 100.0 * LOSS_MOST)));
    if let Some(margin_db) = found.margin_db {
        spans.push(judged(margin_db >= MARGIN_LEAST_DB, format!("margin {} dB", fixed(margin_db, 1))));
    }
    let least = || format!(" least {MARGIN_LEAST_DB:.0}");
    spans.push(theme.label(found.margin_db.map_or_else(|| " no margin".to_owned(), |_| least())));
    Line::from(spans)
}

// The page that helps to find the vehicle: its last and its predicted position, and the way there.

/// Columns of the arrow at 80 columns, and of the words.
const ARROW_COLUMNS: u16 = 14;
const WORD_COLUMNS: u16 = 33;
/// Rows of the words above the arrow.
const WORD_ROWS: u16 = 15;

/// Draws an arrow that points to the vehicle, its positions, the way over the ground, and the code
/// for a phone.
pub fn draw_find(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let (walk, middle, right) = if Room::of(frame.area()) == Room::Small {
        columns(area, [Length(ARROW_COLUMNS), Length(WORD_COLUMNS), Fill(1)]).into()
    } else {
        let [left, right] = columns(area, [Length(WORD_COLUMNS), Fill(1)]);
        let [words, walk] = rows(left, [Length(WORD_ROWS), Fill(1)]);
        (walk, words, right)
    };
    let inside = framed("place", Line::default(), theme, frame, middle);
    let place = model.sought(now);
    let words = Paragraph::new(find_lines(model, theme, now)).wrap(Wrap { trim: false });
    frame.render_widget(words, inside);
    let inside = framed("walk", theme.line(" N up ", TextRole::Label), theme, frame, walk);
    let stays_away = model.chosen_tracker().is_none()
        && KeepAway::of(&model.vehicle, now).is_some_and(|away| !away.is_for_the_pin());
    match place {
        Some(_) if stays_away => draw_line(frame, inside, theme.line(" NOT YET", TextRole::Alarm)),
        Some(place) => draw_arrow(place.way(&place.best(), model.here()), theme, frame, inside),
        None => draw_line(frame, inside, theme.line(" --", TextRole::Label)),
    }
    let flies = model.chosen_tracker().is_none()
        && model.vehicle.in_flight()
        && place.is_some_and(|place| place.predicted.is_none());
    let at = place.and_then(|place| place.degrees(&place.best())).filter(|_| !flies && !theme.ascii);
    let of = |rows| at.map_or_else(Vec::new, |at| qr::code(at, rows));
    // Beside large words a small screen has no rows for a border.
    let bordered = of(right.height.saturating_sub(2));
    let has_border = !bordered.is_empty();
    let code = if has_border { bordered } else { of(right.height) };
    // A phone shows the way better than a map of 30 columns.
    let code_columns = if code.is_empty() { 0 } else { qr::COLUMNS + 2 * u16::from(has_border) };
    let [over_ground, beside] = columns(right, [Fill(1), Length(code_columns)]);
    if over_ground.width > code_columns / 2 {
        map(FROM_ABOVE, model, theme, now, frame, over_ground);
    }
    let inside = if has_border { framed("phone", Line::default(), theme, frame, beside) } else { beside };
    draw_lines(frame, inside, &code);
}

/// An arrow has the same shape wherever it points.
fn draw_arrow(way: Way, theme: Theme, frame: &mut Frame, area: Rect) {
    let plane = Plane::around(area, (0.0, 0.0), 1.0);
    let reach = 1.0 - 2.0 * plane.dot();
    let (sin, cos) = libm::sincos(way.bearing_deg.to_radians());
    let at =
        |along: f64, aside: f64| (reach * (along * sin + aside * cos), reach * (along * cos - aside * sin));
    plane.draw(theme, frame, |context| {
        for step in -20..=20 {
            let aside = f64::from(step) / 33.0;
            for (from, to) in [(at(0.0, aside), at(1.0, 0.0)), (at(-1.0, aside / 5.0), at(0.0, aside / 5.0))]
            {
                context.draw(&canvas::Line::new(from.0, from.1, to.0, to.1, theme.ink(Ink::Measured)));
            }
        }
    });
}

/// The position to look for, and the way there.
pub fn find_lines(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let label = |words: &'static str| theme.line(words, TextRole::Label);
    let tracker = model.chosen_tracker();
    let title = tracker.map_or_else(|| " Last received".to_owned(), |(id, _)| format!(" SYSTEM {id}"));
    let Some(place) = model.sought(now) else {
        let mut lines = match tracker {
            Some((_, tracker)) => {
                let at = degrees(Some(tracker.at.value));
                std::iter::once(theme.line(title, TextRole::Title)).chain(at).collect()
            }
            None if may_have_left(&model.vehicle, now).is_some() => may_have_left_lines(model, theme),
            None if model.vehicle.left_pad_at.is_some() => {
                let words = " The vehicle has left the pad, and has not reported its position.";
                vec![theme.line(words, TextRole::Caution)]
            }
            None => vec![label(
                " The vehicle has not left the pad. In flight its last place is kept beside the log, for maps.",
            )],
        };
        lines.extend(beside_lines(model, theme, now));
        return lines;
    };
    let now_unix_s = model.settings.start_unix_s + now.as_secs();
    let mut lines = Vec::new();
    if let Some(predicted) = &place.predicted {
        lines.push(theme.line(" PREDICTED: look here first", TextRole::Caution));
        lines.extend(spot(model, &place, predicted, theme));
    }
    let from = if place.way(&place.received, model.here()).from_station { "here" } else { "the pad" };
    lines.push(theme.line(format!("{title}, from {from}"), TextRole::Title));
    lines.extend(spot(model, &place, &place.received, theme));
    let ago = now_unix_s.saturating_sub(place.received_unix_s);
    let is_down = tracker.is_none() && !model.vehicle.in_flight() && place.predicted.is_none();
    let height =
        if is_down { "on the ground".to_owned() } else { format!("{} m up", fixed(place.height_m, 1)) };
    lines.push(Line::from(format!("  {ago} s ago, {height}")));
    lines.extend(beside_lines(model, theme, now));
    if tracker.is_none() {
        lines.push(Line::from(format!("  boot {}", words::boot(place.boot))));
        lines.push(supply(model, theme));
    }
    if place.pad.is_none() {
        lines.push(label(" The vehicle has not reported its pad: no latitude, longitude or KML"));
    } else if model.here().is_none() {
        lines.push(label(" The way from here needs this place: `position` or `here` in the settings"));
    }
    lines
}

/// The age of the station's own position, and the other vehicles.
fn beside_lines(model: &Model, theme: Theme, now: Duration) -> Vec<Line<'static>> {
    let own = model.here.map(|here| {
        let role = if here.age(now) > OWN_POSITION_OLD { TextRole::Caution } else { TextRole::Plain };
        theme.line(format!("  own position {} s ago", here.age(now).as_secs()), role)
    });
    let trouble = model.here_trouble.as_ref();
    let trouble = trouble.map(|why| theme.line(format!("  own position: {why}"), TextRole::Caution));
    let mut lines: Vec<Line> = own.into_iter().chain(trouble).collect();
    for (id, tracker) in model.trackers.iter().filter(|(id, _)| model.pages.tracker != Some(**id)) {
        let age_s = tracker.at.age(now).as_secs();
        lines.push(theme.line(format!(" also system {id}, {age_s} s ago (Up, Down)"), TextRole::Title));
    }
    lines
}

/// The last telemetry was from the pad, in a countdown that must have ended.
fn may_have_left_lines(model: &Model, theme: Theme) -> Vec<Line<'static>> {
    let caution = |words: &'static str| theme.line(words, TextRole::Caution);
    let mut lines = vec![theme.line(" MAY BE IN THE AIR since T-0", TextRole::Alarm)];
    let Some(intended) = model.intended_touchdown() else {
        lines.push(caution(" It has not reported the fence of its mission: look around the pad."));
        return lines;
    };
    let (north, east) = (fixed(intended.north_m, 0), fixed(intended.east_m, 0));
    lines.push(Line::from(format!(" should land north {north} m, east {east} m of the pad, within")));
    lines.push(Line::from(format!(" {} m, the fence of its mission", fixed(intended.error_m, 0))));
    lines.extend(degrees(model.vehicle.pad.map(|pad| pad.moved(intended.north_m, intended.east_m))));
    lines.push(caution(" Under a parachute, or without its landing motor, it may come down farther away."));
    lines
}

fn degrees(at: Option<Degrees>) -> Option<Line<'static>> {
    at.map(|at| Line::from(format!("  {:.6}, {:.6}", at.latitude, at.longitude)))
}

/// The way to a spot, where it is from the pad, and how wrong that may be.
fn spot(model: &Model, place: &LastPlace, spot: &Spot, theme: Theme) -> Vec<Line<'static>> {
    let way = place.way(spot, model.here());
    let (way_m, north_m, east_m) = (fixed(way.distance_m, 0), fixed(spot.north_m, 1), fixed(spot.east_m, 1));
    let mut lines = vec![
        theme.line(format!("  {way_m} m, bearing {} deg", way.compass()), TextRole::Title),
        Line::from(format!("  north {north_m} m, east {east_m} m")),
    ];
    if spot.error_m.is_finite() {
        let words = format!("  ±{} m in 19 of 20 cases", fixed(spot.error_m, 0));
        lines.push(Line::from(theme.either_side(&words)));
    }
    let [distances, _] = field::distances(model, (spot.east_m, spot.north_m));
    lines.extend((!distances.is_empty()).then(|| Line::from(format!("  {distances}"))));
    lines.extend(degrees(place.degrees(spot)));
    lines
}

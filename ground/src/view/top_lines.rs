//! The top lines of every screen: identity, phase, armed, countdown, link, abort, and the latest
//! command.

use std::time::Duration;

use protocol::command::result_words;
use protocol::dialect::TdPhase;
use protocol::identity::VEHICLE;
use ratatui::Frame;
use ratatui::layout::Constraint::{Fill, Length};
use ratatui::layout::Rect;
use ratatui::style::Modifier;
use ratatui::text::{Line, Span};

use super::theme::Level;
use super::{
    STALE_MARK, TextRole, Theme, age_mark, draw_line, fixed, lists, shortest, side_by_side, status_lines,
};
use crate::model::{
    Acknowledgement, AlarmKind, Approach, CommandKind, Ending, Event, LinkState, MARGIN_LEAST_DB, Model,
    Page, Role, STALE_AFTER, Sample, Standing, TERMINATION, TrackedCommand, abort_too_late,
    dead_reckoning::may_have_left, foreign_name, hold_words, is_liftoff_by_itself, is_on_pad,
    quantity::Quantity, standing, why_no_go, words,
};

/// Columns of the state: armed, phase, clock, each in its place.
const STATE_COLUMNS: [u16; 3] = [9, 15, 9];
/// From this width on the state and the effect of an abort, with its key, share one row, otherwise
/// two.
pub const ONE_ROW_COLUMNS: u16 = 160;
const ABORT_COLUMNS: u16 = 87;
/// From this width on the rate and the loss of the link are shown beside its ages.
const RATES_COLUMNS: u16 = 110;
/// A screen that is less late than this is read as live.
const LATE_SHOWN: Duration = Duration::from_secs(1);

/// Draws the vehicle and the crew, the state of the link, and whether it is recorded.
pub fn draw_identity(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let shows_rates = area.width >= RATES_COLUMNS && model.link.trouble.is_none();
    let mut right = Vec::new();
    if model.screen_late >= LATE_SHOWN {
        let words = format!(" screen late {} s ", model.screen_late.as_secs());
        right.extend([theme.span(words, TextRole::Alarm), Span::raw(" ")]);
    }
    if shows_rates {
        let capacity = model.settings.link_capacity_bytes_s.map_or_else(String::new, |of| format!("/{of}"));
        let received = format!(" rx {:.0}{capacity} B/s", model.link.stats.figures(now).rx_bytes_s);
        let loss = model.link.loss(now);
        let lost = format!("  loss {}  ", status_lines::percent(loss));
        right.extend([theme.plain(received), theme.span(lost, status_lines::loss_role(loss))]);
    }
    let state = [link(model, theme, now).spans, vec![status_lines::recording(model, theme, now)]].concat();
    let left = identity(model, theme, now);
    let spans = || right.iter().chain(&state);
    let taken = left.width() + spans().map(Span::width).sum::<usize>();
    let fits = |words: &Span| taken + words.width() <= usize::from(area.width);
    right.extend(radio(model, theme, now).into_iter().find(fits));
    right.extend(state);
    let right = Line::from(right);
    let [left_area, right_area] = side_by_side(area, [Fill(1), Length(right.width() as u16)]);
    draw_line(frame, left_area, left);
    draw_line(frame, right_area, right);
}

/// A change of the margin within a minute that counts as a trend, dB.
const TREND_DB: f64 = 1.0;

/// Signal strength and margin of the radio with the margin's trend over the last minute, the
/// longest words first; empty without a report of the radio.
fn radio(model: &Model, theme: Theme, now: Duration) -> Vec<Span<'static>> {
    let read = |name| Quantity::named(name).and_then(|quantity| quantity.read(model, now));
    let (Some(rssi), Some(margin)) = (read("rssi"), read("radio margin")) else { return Vec::new() };
    let rise = Quantity::named("radio margin").and_then(|margin| model.history.trace.rise(margin, now));
    let arrow = match rise {
        None => "",
        Some(rise_db) if rise_db >= TREND_DB => "↑",
        Some(rise_db) if rise_db <= -TREND_DB => "↓",
        Some(_) => "→",
    };
    let role = if margin.value < MARGIN_LEAST_DB { TextRole::Caution } else { TextRole::Plain };
    let (rssi, margin) = (fixed(rssi.value, 0), fixed(margin.value, 0));
    let words =
        [format!("rssi {rssi} dBm margin {margin} dB{arrow}"), format!("{rssi} dBm +{margin} dB{arrow}")];
    words.map(|words| theme.span(format!(" {words}  "), role)).into()
}

/// The present danger of the vehicle, as far as it is reported.
pub fn level(model: &Model, now: Duration) -> Level {
    use TdPhase as P;
    let vehicle = &model.vehicle;
    match Approach::of(vehicle, now) {
        Some(Approach::Away(away)) if away.is_for_the_pin() => return Level::Armed,
        Some(Approach::Away(_)) => return Level::Danger,
        Some(Approach::May(_)) => return Level::Free,
        None => {}
    }
    let lost = Ending::of(vehicle, now) == Some(Ending::Lost) || may_have_left(vehicle, now).is_some();
    let several = model.beside(now).is_some();
    match vehicle.phase_now() {
        _ if lost || several || is_liftoff_by_itself(vehicle) => Level::Danger,
        Some(P::TD_PHASE_BOOST | P::TD_PHASE_IGNITION | P::TD_PHASE_POWERED) => Level::Danger,
        _ if vehicle.is_armed() || vehicle.in_flight() => Level::Armed,
        _ => Level::Calm,
    }
}

/// Draws the rows in the colour of the danger: the state and the next event, or an acknowledged
/// alarm; the effect of an abort, and its key.
pub fn draw_state(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    frame.buffer_mut().set_style(area, theme.level(level(model, now)));
    let first = Rect { height: area.height.min(1), ..area };
    let abort_columns = if area.height > 1 { 0 } else { ABORT_COLUMNS };
    let [state, middle, abort_area] =
        side_by_side(first, [Length(STATE_COLUMNS.iter().sum()), Fill(1), Length(abort_columns)]);
    let words = [armed(model, theme, now), phase(model, theme, now), countdown(model, theme, now)];
    let field = |(words, columns): (Span, u16)| format!("{:1$.1$}", words.content, usize::from(columns));
    draw_line(frame, state, Line::from(words.into_iter().zip(STATE_COLUMNS).map(field).collect::<String>()));
    if let Some(line) = in_the_middle(model, theme, now, usize::from(middle.width)) {
        draw_line(frame, middle, line);
    }
    let below = Rect { y: area.y + 1, height: 1, ..area };
    draw_abort(model, theme, now, frame, if area.height > 1 { below } else { abort_area });
}

/// How long the newest event is shown in the row of the state on the Pad page.
const EVENT_SHOWN: Duration = Duration::from_secs(10);
/// How long the answer to a key is shown there on every page: long enough to be read.
const ANSWER_SHOWN: Duration = Duration::from_secs(4);

/// The answer to a key, an acknowledged alarm, the next event, or the newest event.
fn in_the_middle(model: &Model, theme: Theme, now: Duration, columns: usize) -> Option<Line<'static>> {
    let seen = status_lines::alarm_text(model, theme, now, columns);
    let seen = seen.filter(|_| model.alarms.unacknowledged() == 0).map(|line| line.to_string());
    let next = || status_lines::next_event(model, now, true);
    // The Pad page shows readiness itself; there it is the newest event.
    let is_pad = model.page() == Page::Pad;
    let ready = || readiness(model, now).filter(|_| !is_pad).map(|(words, _)| format!(" {words}"));
    let event_words = || {
        let fresh = |(event, _): &(&Event, _)| now.saturating_sub(event.at) < EVENT_SHOWN;
        let (event, text) = lists::crew_events(model).next().filter(fresh)?;
        Some(format!(" {}{text}", event.mark().trim_start()))
    };
    // After an acknowledged abort the next event matters.
    let aborted = model.alarms.foremost().is_some_and(|alarm| alarm.what.kind == AlarmKind::Aborted);
    let after = if aborted { next() } else { None };
    let answer = model.answer.as_ref().filter(|(_, at)| now.saturating_sub(*at) < ANSWER_SHOWN);
    let answer = answer.map(|(text, _)| format!(" {text}"));
    let words = after.or(answer).or(seen).or_else(next).or_else(ready).or_else(event_words)?;
    Some(Line::from(status_lines::cut(&words, columns)))
}

/// The effect of an abort, or its progress, and its key at the right end. The text of a begun or
/// unsent abort contains its keys, and takes the complete row if needed.
fn draw_abort(model: &Model, theme: Theme, now: Duration, frame: &mut Frame, area: Rect) {
    let key = format!(" {} ", abort_key(model));
    let [words, key_area] = side_by_side(area, [Fill(1), Length(key.len() as u16)]);
    let line = abort(model, theme, now, usize::from(words.width));
    let has_keys = model.link.why_abort_not_sent(now).is_some() || model.abort_chord.is_begun(now);
    if has_keys && line.width() > usize::from(words.width) {
        return draw_line(frame, area, line);
    }
    // In the colours of the row: those of a page vanish on it.
    draw_line(frame, words, if has_keys { line } else { Line::from(line.to_string()) });
    draw_line(frame, key_area, Line::from(key));
}

/// The vehicle, and who commands it.
pub fn identity(model: &Model, theme: Theme, now: Duration) -> Line<'static> {
    let (space, vehicle) = (Span::raw(" "), vehicle(model, theme, now));
    Line::from(vec![mode(model, theme), space.clone(), vehicle, space, crew(model, theme, now)])
}

/// A vehicle counts as real unless it has always reported to be simulated.
fn mode(model: &Model, theme: Theme) -> Span<'static> {
    let simulated = model.vehicle.boot.is_simulated();
    let (word, role) = match model.settings.role {
        Role::Station if model.settings.demonstration => {
            let style = theme.style(TextRole::Caution).add_modifier(Modifier::REVERSED);
            return Span::styled(" DEMO, NOT REAL ", style);
        }
        Role::Watching if simulated => ("WATCH SIM", TextRole::Title),
        Role::Watching => ("WATCH LIVE", TextRole::Caution),
        Role::Replaying if simulated => ("REPLAY SIM", TextRole::Title),
        Role::Replaying => ("REPLAY", TextRole::Title),
        Role::Station | Role::Attached if simulated => ("SIM", TextRole::Title),
        Role::Station | Role::Attached => ("LIVE", TextRole::Caution),
    };
    theme.span(format!(" {word}"), role)
}

/// Why the vehicle under this id may not be ours, or may not be the intended one.
fn identity_warning(model: &Model, now: Duration) -> Option<String> {
    let id = model.settings.vehicle.system_id;
    let misfits = || "ANOTHER VERSION: its messages do not fit".to_owned();
    match model.vehicle.as_foreign() {
        _ if model.beside(now).is_some() => Some(format!("TWO VEHICLES under id {id}")),
        Some(foreign) => Some(format!("NOT A TOUCHDOWN VEHICLE: {}", foreign_name(foreign))),
        None => model.speaks_another_version(now).then(misfits),
    }
}

fn vehicle(model: &Model, theme: Theme, now: Duration) -> Span<'static> {
    if let Some(words) = identity_warning(model, now) {
        return theme.span(words, TextRole::Alarm);
    }
    let boot = model.vehicle.boot.number().map_or_else(|| "--".to_owned(), words::boot);
    let reported = model.vehicle.mission().map(|mission| mission.name);
    let system = model.settings.vehicle.system_id;
    let name =
        model.settings.vehicle_name.clone().or(reported).map_or_else(String::new, |name| format!("{name} "));
    let system = if system == VEHICLE.system_id { String::new() } else { format!("system {system} ") };
    theme.plain(format!("{system}{name}boot {boot}"))
}

/// Who commands: another station that armed the vehicle, otherwise those who can command here.
fn crew(model: &Model, theme: Theme, now: Duration) -> Span<'static> {
    if model.link.station_lost_for(now).is_some() {
        return theme.span(" NO STATION", TextRole::Alarm);
    }
    if let Some(people) = model.people() {
        let who = match model.seat_key() {
            0 if model.settings.role == Role::Attached && model.key_number() > 0 => {
                "HOLD/ABORT ONLY".to_owned()
            }
            0 => "OBSERVER".to_owned(),
            number => model.operator(number),
        };
        let mode = if people == 2 { "TWO-PERSON" } else { "one-person" };
        return theme.span(format!(" {who} {mode}"), TextRole::Title);
    }
    if let Some(other) = model.link.uplink.armed_by_other {
        // Another station under our own id is not this one.
        let whose = if other == model.settings.us { "by another " } else { "" };
        let text = format!("armed {whose}{}/{}", other.system_id, other.component_id);
        return theme.span(format!(" {text}"), TextRole::Caution);
    }
    let text = match model.settings.role {
        Role::Replaying => "no crew".to_owned(),
        Role::Station | Role::Attached if model.vehicle.as_foreign().is_some() => "ABORT only".to_owned(),
        // First, even with others at this station: the silence of this station holds the countdown.
        _ if model.link.uplink.armed_by_us && model.link.state(now).carries() => "armed here".to_owned(),
        _ if model.link.uplink.armed_by_us => "~armed here".to_owned(),
        _ if model.crew.seats().iter().any(|seat| *seat != model.settings.seat) => {
            format!("by {}", model.crew.names().join(","))
        }
        Role::Watching => "watches only".to_owned(),
        _ => "commands here".to_owned(),
    };
    theme.plain(format!(" {text}"))
}

// The top lines of every screen: phase, armed, countdown, link, abort, and the line of the latest
// command.

/// In flight, a command whose effect is not observed is shown instead of the next event for this
/// long, and on the pad an answered one instead of a NO-GO. Its alarm stays.
const OPEN_SHOWN: Duration = Duration::from_secs(10);
const ABORT_KEY: &str = "Ctrl-X Enter";
pub const ABORT_LABEL: &str = " abort now: ";

/// The key that aborts from this screen, or why none does.
pub fn abort_key(model: &Model) -> String {
    match model.settings.role {
        Role::Attached if model.link.station_lost => "NO STATION".to_owned(),
        Role::Station | Role::Attached => format!("ABORT {ABORT_KEY}"),
        Role::Watching => "WATCHING only".to_owned(),
        Role::Replaying => "REPLAY".to_owned(),
    }
}

/// The phase, with its age.
pub fn phase(model: &Model, theme: Theme, now: Duration) -> Span<'static> {
    match model.vehicle.phase() {
        None if let Some(foreign) = model.vehicle.as_foreign() => {
            theme.plain(format!(" mode {}", foreign.value.custom_mode))
        }
        None => theme.label(" no vehicle"),
        Some(_) if may_have_left(&model.vehicle, now).is_some() => {
            theme.span(" IN THE AIR?", TextRole::Alarm)
        }
        Some(phase) => {
            let (mark, role) = age_mark(&phase, now, TextRole::Title);
            theme.span(format!("{mark}{}", doing(model, phase.value)), role)
        }
    }
}

/// The phase by the name that logs and reports give it; beside it, a countdown, and an ascent motor
/// that is commanded and has not lifted the vehicle.
pub fn doing(model: &Model, phase: TdPhase) -> String {
    match phase {
        _ if is_on_pad(phase) && model.vehicle.counts_down() => "COUNTDOWN".to_owned(),
        TdPhase::TD_PHASE_BOOST if !model.vehicle.has_lifted() => "IGN COMMANDED".to_owned(),
        _ => words::phase(phase),
    }
}

/// Whether the vehicle is armed, from HEARTBEAT.
pub fn armed(model: &Model, theme: Theme, now: Duration) -> Span<'static> {
    let Some(armed) = model.vehicle.armed() else { return theme.label(" armed ?") };
    let (mark, role) = age_mark(&armed, now, TextRole::Good);
    let (word, role) = if armed.value { ("ARMED", TextRole::Alarm) } else { ("disarmed", role) };
    theme.span(format!("{mark}{word}"), role)
}

/// The present time to release, s: it runs on between two reports while a report is fresh, and
/// stops at the release and on the ground.
fn clock_s(model: &Model, reported: Sample<f64>, now: Duration) -> f64 {
    let left_s = reported.value - reported.age(now).min(STALE_AFTER).as_secs_f64();
    match reported.value > 0.0 {
        true => left_s.max(0.0),
        false if model.vehicle.in_flight() => left_s,
        false => reported.value,
    }
}

/// Time to release, or since it.
pub fn countdown(model: &Model, theme: Theme, now: Duration) -> Span<'static> {
    match model.vehicle.countdown_s() {
        None => theme.label(" T --"),
        Some(_) if let Some(since) = may_have_left(&model.vehicle, now) => {
            let words = format!("{STALE_MARK}T+{:.1}", since.as_secs_f64());
            theme.span(words, TextRole::Stale)
        }
        Some(time) => {
            let (mark, role) = age_mark(&time, now, TextRole::Title);
            let sign = if time.value > 0.0 { '-' } else { '+' };
            theme.span(format!("{mark}T{sign}{:.1}", clock_s(model, time, now).abs()), role)
        }
    }
}

/// Both directions of the link, each with the age of its last frame: a downlink does not prove the
/// uplink. Full seconds, because heartbeats come only once a second. On an attached screen, the
/// silence of its station.
pub fn link(model: &Model, theme: Theme, now: Duration) -> Line<'static> {
    if let Some(gone) = model.link.station_lost_for(now) {
        return theme.line(format!("STATION GONE {}s", gone.as_secs()), TextRole::Alarm);
    }
    if let Some(silence) = model.link.station_silence(now) {
        let words = format!("STATION SILENT {}s", silence.as_secs());
        return theme.line(words, TextRole::Alarm);
    }
    // Another autopilot dates few of its messages: the age of the last dated one is no measure of
    // the link.
    let foreign = model.vehicle.as_foreign().is_some();
    let down = if foreign { model.link.state(now) } else { model.link.down(now) };
    if down == LinkState::NeverReceived {
        return theme.line("down: no data", TextRole::Caution);
    }
    let direction = |name: &str, loud: &str, state| match state {
        LinkState::NeverReceived => theme.span(format!("{loud} NOT PROVEN"), TextRole::Alarm),
        LinkState::Alive(age) => theme.span(format!("{name} {}s", age.as_secs()), TextRole::Good),
        LinkState::Doubtful(age) => theme.span(format!("{name} late {}s", age.as_secs()), TextRole::Caution),
        LinkState::Lost(age) => theme.span(format!("{loud} LOST {}s", age.as_secs()), TextRole::Alarm),
    };
    let up = match model.link.uplink.state(now) {
        // There has been no report about the uplink since the downlink was lost.
        LinkState::Lost(age) | LinkState::Doubtful(age) if !down.carries() => {
            theme.span(format!("{STALE_MARK}up {}s", age.as_secs()), TextRole::Stale)
        }
        state => direction("up", "UP", state),
    };
    Line::from(vec![direction("down", "DOWN", down), Span::raw(" "), up, Span::raw(" ")])
}

/// The present effect of an abort, or the progress of the commanded abort, in as many columns.
pub fn abort(model: &Model, theme: Theme, now: Duration, columns: usize) -> Line<'static> {
    if let Some(why) = model.link.why_abort_not_sent(now) {
        return theme.line(format!(" ABORT NOT SENT: {why}"), TextRole::Alarm);
    }
    if model.link.abort_requested_at.is_some() {
        return theme.line(" ABORT requested, not yet accepted by the station", TextRole::Alarm);
    }
    let effect = abort_effect(model, now);
    if model.abort_chord.is_begun(now) {
        return theme.line(format!(" ENTER ABORTS (or Ctrl-X): {effect}"), TextRole::Alarm);
    }
    if let Some(track) = model.commands.of(CommandKind::Abort) {
        return command_facts(track, columns, theme, now);
    }
    let label = if model.settings.role == Role::Replaying { " abort then: " } else { ABORT_LABEL };
    let mut spans = vec![theme.label(label), theme.plain(effect)];
    spans.extend(hold_until(model, now).map(|words| theme.span(words, TextRole::Caution)));
    Line::from(spans)
}

/// In the countdown: until when a hold works.
fn hold_until(model: &Model, now: Duration) -> Option<String> {
    let may_fly = may_have_left(&model.vehicle, now).is_some();
    let last_s = model.last_hold_s(&model.vehicle).filter(|_| model.vehicle.counts_down() && !may_fly)?;
    if model.is_past_hold(now) {
        return Some("; TOO LATE to hold".to_owned());
    }
    // Rather too early than too late.
    Some(format!("; hold until T-{}", shortest((10.0 * last_s).ceil() / 10.0)))
}

/// The present effect of an abort, marked if the report is stale.
fn abort_effect(model: &Model, now: Duration) -> String {
    let status = match model.vehicle.status.as_ref() {
        _ if model.link.station_lost => return "NOT SENT: no station; the next one sends it".to_owned(),
        _ if model.link.station_silence(now).is_some() => {
            return "NOT SENT while the station hangs".to_owned();
        }
        _ if model.vehicle.as_foreign().is_some() => return TERMINATION.to_owned(),
        None => return "unknown".to_owned(),
        _ if may_have_left(&model.vehicle, now).is_some() => {
            return "MAY NOT ARRIVE; its effect is not reported".to_owned();
        }
        _ if model.settings.role != Role::Replaying
            && let Some(why) = abort_too_late(model, now) =>
        {
            return why.to_owned();
        }
        Some(status) => status,
    };
    let mark = if status.is_stale(now) { "~" } else { "" };
    // First, because a narrow screen cuts the end off.
    let [down, up] = [model.link.state(now), model.link.uplink.state(now)];
    let lost = [down, up].iter().any(|state| matches!(state, LinkState::Lost(_)));
    let reach = if lost { "MAY NOT ARRIVE; " } else { "" };
    format!("{reach}{mark}{}", words::abort_effect(&status.value))
}

/// The warning that gimbal and fins may move, on every page.
pub fn hands_off(model: &Model, theme: Theme, now: Duration) -> Option<Line<'static>> {
    let words = match standing(model, now) {
        Standing::Runs => {
            let done = model.vehicle.pad_check.as_ref().map_or(0, |check| check.report.progress);
            format!(" HANDS OFF: a check of the vehicle runs, {done} %")
        }
        Standing::MayRun => " HANDS OFF: a check of the vehicle may run".to_owned(),
        Standing::JustEnded | Standing::Rests => return None,
    };
    Some(theme.line(words, TextRole::Caution))
}

/// The three facts of a command, in as many columns: commanded, acknowledged, observed. First its
/// time is left out.
fn command_facts(track: &TrackedCommand, columns: usize, theme: Theme, now: Duration) -> Line<'static> {
    // Other names are longer.
    let room = "DISARM".len().saturating_sub(track.kind.row().name.len());
    let at_s = track.commanded_at.as_secs_f64();
    let commanded = format!("{:room$} commanded {at_s:.1} s x", "");
    let lines = [
        facts(track, [&commanded, "  acknowledged ", "  observed "], theme, now),
        facts(track, [" x", "  acknowledged ", "  observed "], theme, now),
    ];
    let fits = lines.into_iter().find(|line| line.width() <= columns);
    fits.unwrap_or_else(|| facts(track, [" x", " ack ", " obs "], theme, now))
}

fn facts(track: &TrackedCommand, names: [&str; 3], theme: Theme, now: Duration) -> Line<'static> {
    let (acknowledged, acknowledged_role) = match track.acknowledged {
        Acknowledgement::Waiting => ("waiting".to_owned(), TextRole::Caution),
        Acknowledgement::InProgress => ("in progress".to_owned(), TextRole::Caution),
        Acknowledgement::Proposed => ("requested, not confirmed".to_owned(), TextRole::Caution),
        Acknowledgement::GivenUp => ("NEVER".to_owned(), TextRole::Alarm),
        Acknowledgement::Answered(_) if track.accepted() => ("accepted".to_owned(), TextRole::Good),
        Acknowledgement::Answered(result) => (format!("REFUSED ({})", refusal(result)), TextRole::Alarm),
    };
    let (observed, observed_role) = match track.observed_at {
        Some(_) => ("yes", TextRole::Good),
        None if track.is_withdrawn => ("no longer so", TextRole::Plain),
        None if track.disagrees(now) => ("NOT OBSERVED", TextRole::Alarm),
        None => ("not yet", TextRole::Plain),
    };
    let [commanded, ack, obs] = names;
    Line::from(vec![
        theme.span(format!(" {}", track.kind.row().name), TextRole::Title),
        theme.plain(format!("{commanded}{}", track.attempts)),
        theme.label(ack.to_owned()),
        theme.span(acknowledged, acknowledged_role),
        theme.label(obs.to_owned()),
        theme.span(observed, observed_role),
    ])
}

/// The result in words that leave room for the rest of the line.
fn refusal(result: u8) -> &'static str {
    match result {
        1 => "not now",
        2..=6 => result_words(result),
        _ => "unknown",
    }
}

/// The message above the keys, in place of the flight: a check that moves the surfaces, a command,
/// or a hold.
pub fn message(model: &Model, theme: Theme, now: Duration, columns: usize) -> Option<Line<'static>> {
    let latest = model.commands.tracks.iter().rfind(|track| track.kind != CommandKind::Abort);
    let is_past = |at: Duration| now.saturating_sub(at) >= OPEN_SHOWN;
    let is_open = |track: &&TrackedCommand| {
        track.observed_at.is_none() && !track.is_withdrawn && !is_past(track.commanded_at)
    };
    let is_recent = |track: &&TrackedCommand| {
        let answered = matches!(track.acknowledged, Acknowledgement::Answered(_) | Acknowledgement::GivenUp);
        !answered || !is_past(track.acknowledged_at.unwrap_or(track.commanded_at))
    };
    let facts = |track| command_facts(track, columns, theme, now);
    let hold = || hold_words(model);
    hands_off(model, theme, now)
        .or_else(|| latest.filter(is_open).map(facts))
        .or_else(|| hold().map(|words| theme.line(words, TextRole::Alarm)))
        .or_else(|| latest.filter(is_recent).map(facts))
}

/// Whether the vehicle may be armed: GO only if every check passes and the uplink is proven. `None`
/// before the vehicle has reported its checks, and off the pad, where it makes none.
pub fn readiness(model: &Model, now: Duration) -> Option<(String, TextRole)> {
    let status = model.vehicle.status.as_ref().filter(|status| is_on_pad(status.value.phase))?;
    if status.is_stale(now) {
        return Some((format!("{STALE_MARK}checks: no longer received"), TextRole::Stale));
    }
    Some(match why_no_go(model, now) {
        Some(why) => (format!("NO-GO: {why}"), TextRole::Caution),
        None => ("GO: every arming check passes".to_owned(), TextRole::Good),
    })
}

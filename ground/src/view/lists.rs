//! Lists of lines: the newest events and the checklist.

use std::borrow::Cow;
use std::collections::VecDeque;
use std::time::Duration;

use protocol::log::record::EventLevel;
use ratatui::text::{Line, Span};
use textwrap::{Options, WordSeparator, WordSplitter};

use super::{TextRole, Theme, fixed};
use crate::model::{Event, Mark, Model, Step, StepState, flight_began, role_name, words};
use crate::view::pictures::seconds_since;

/// Columns before the text of an event: time, speaker and mark.
const TIME_COLUMNS: usize = 7;
const BEFORE_TEXT: usize = 18;
const NARROW_COLUMNS: usize = 50;
/// Narrower than this, a text is cut rather than wrapped.
const WRAP_COLUMNS_MIN: usize = 20;

/// The newest events, oldest first, in this many lines of this width. Long texts wrap, because the
/// end of a refusal is its reason. The newest is complete: if it alone has more lines, its
/// beginning is drawn.
pub fn events(model: &Model, theme: Theme, columns: usize, rows: usize) -> Vec<Line<'static>> {
    // In a narrow panel the speaker is left out.
    let is_narrow = columns < NARROW_COLUMNS;
    let before = if is_narrow { TIME_COLUMNS + 3 } else { BEFORE_TEXT };
    let text_columns = columns.saturating_sub(before);
    let lift_off = flight_began(model);
    let mut lines: Vec<Vec<Line>> = crew_events(model)
        .take(rows)
        .map(|(event, text)| {
            let role = match event.level {
                EventLevel::Info => TextRole::Plain,
                EventLevel::Warning => TextRole::Caution,
                EventLevel::Error | EventLevel::Fatal => TextRole::Alarm,
            };
            let time = format!("{:>TIME_COLUMNS$} ", clock_time(event.at, lift_off));
            let head = if is_narrow { time } else { format!("{time}{:<7} ", event.speaker) };
            let columns = if text_columns < WRAP_COLUMNS_MIN { usize::MAX } else { text_columns };
            let mut pieces = wrap(&text, columns).into_iter();
            let first = format!("{}{}", event.mark(), pieces.next().unwrap_or_default());
            let first = Line::from(vec![theme.label(head), theme.span(first, role)]);
            let rest = pieces
                .map(move |piece| Line::from(vec![Span::raw(" ".repeat(before)), theme.span(piece, role)]));
            std::iter::once(first).chain(rest).collect()
        })
        .collect();
    let newest = lines.first().map_or(0, Vec::len);
    lines.reverse();
    let mut lines = lines.concat();
    lines.drain(..lines.len().saturating_sub(rows.max(newest)));
    lines
}

/// The events of interest to the crew, the newest first, each in the words of the crew. A command
/// is one line that changes, and what station and vehicle report alike is one event.
pub fn crew_events(model: &Model) -> impl Iterator<Item = (&Event, Cow<'_, str>)> {
    let newest = model.events.newest(usize::MAX).rev();
    let mut newer: VecDeque<(Duration, Cow<str>)> = VecDeque::new();
    newest.filter_map(move |event| {
        let text = words::of_event(&event.text)?;
        while newer.front().is_some_and(|(at, _)| at.saturating_sub(event.at) > ONE_EVENT_WITHIN) {
            newer.pop_front();
        }
        let of = command_of(&text).map_or(text.clone(), |command| command.to_owned().into());
        let is_shown = event.level == EventLevel::Info && newer.iter().any(|(_, shown)| *shown == of);
        newer.push_back((event.at, of));
        (!is_shown).then_some((event, text))
    })
}

/// Within this time the same words are the same event, and a command has its answer.
const ONE_EVENT_WITHIN: Duration = Duration::from_secs(2);

/// The name of the command of which an event reports a step.
fn command_of(text: &str) -> Option<&str> {
    let (name, rest) = text.split_once(' ')?;
    let is_step = ["commanded", "acknowledged: ", "observed: "].iter().any(|step| rest.starts_with(step));
    (is_step && name.chars().all(|letter| letter.is_ascii_uppercase())).then_some(name)
}

/// The time of an event: from the lift-off once there was one, otherwise since the start of the
/// run. The longest lose their tenth.
pub fn clock_time(at: Duration, lift_off: Option<Duration>) -> String {
    let Some(lift_off) = lift_off else { return format!("{:.1}", at.as_secs_f64()) };
    let since_s = seconds_since(at, lift_off);
    let decimals = usize::from(since_s.abs() < 999.0);
    format!("T{since_s:+.decimals$}")
}

/// Breaks a text at spaces; a word longer than a line is broken at the end of the line.
pub fn wrap(text: &str, columns: usize) -> Vec<String> {
    let options = Options::new(columns).word_separator(WordSeparator::AsciiSpace);
    let lines = textwrap::wrap(text, options.word_splitter(WordSplitter::NoHyphenation));
    lines.into_iter().map(Cow::into_owned).collect()
}

// The checklist as rows: the state of each step, its signer, and the value found.

/// Columns of the mark and the number.
const FRONT_COLUMNS: usize = 9;

/// How long the reason why a step was not signed stands below the steps.
const REFUSAL_SHOWN: Duration = Duration::from_secs(15);

/// The steps around the chosen one, on at most this many rows; below them who signs the chosen one,
/// or who did.
pub fn checklist_rows(
    model: &Model,
    theme: Theme,
    now: Duration,
    (columns, rows): (usize, usize),
) -> Vec<Line<'static>> {
    let (Some(list), Some(chosen)) = (&model.checklist, model.chosen_step(now)) else { return Vec::new() };
    let steps: Vec<Vec<Line>> = list
        .steps
        .iter()
        .enumerate()
        .map(|(place, step)| step_rows(model, (place, step), place == chosen, theme, now, columns))
        .collect();
    let room = rows.saturating_sub(1);
    // Before the chosen step at most half of the rows, unless the end of the list leaves more.
    let mut first = chosen;
    let taken = |from: usize, to: usize| steps[from..to].iter().map(Vec::len).sum::<usize>();
    while first > 0
        && taken(first - 1, chosen + 1) <= room
        && (taken(first - 1, chosen) <= room / 2 || taken(first - 1, steps.len()) <= room)
    {
        first -= 1;
    }
    let mut lines: Vec<Line> = Vec::new();
    for step in steps.into_iter().skip(first) {
        if lines.len() + step.len() > room {
            break;
        }
        lines.extend(step);
    }
    let refused = model.sign_refused.as_ref().filter(|(_, at)| now.saturating_sub(*at) < REFUSAL_SHOWN);
    lines.push(match refused {
        Some((why, _)) => theme.line(format!(" {why}"), TextRole::Caution),
        None => theme.line(format!(" {}", below(&list.steps[chosen])), TextRole::Label),
    });
    lines
}

/// A step; long words continue on further lines.
fn step_rows(
    model: &Model,
    (place, step): (usize, &Step),
    is_chosen: bool,
    theme: Theme,
    now: Duration,
    columns: usize,
) -> Vec<Line<'static>> {
    let (word, role) = match model.step_state(step, now) {
        StepState::Done => ("OK  ", TextRole::Good),
        StepState::Open => ("open", TextRole::Caution),
        StepState::Voided => ("VOID", TextRole::Alarm),
        StepState::Outside => ("NO  ", TextRole::Alarm),
        StepState::Unknown => ("?   ", TextRole::Alarm),
    };
    let value = step.value.as_ref().map_or_else(String::new, |limits| {
        let found = model.fresh(limits, now);
        let found = found.map_or_else(|| "--".to_owned(), |found| fixed(found, limits.quantity.decimals));
        format!(" {found} {}", limits.quantity.unit)
    });
    let room = columns.saturating_sub(FRONT_COLUMNS + value.chars().count()).max(1);
    let mut parts = wrap(&step.words, room).into_iter();
    let first = parts.next().unwrap_or_default();
    let mark = if is_chosen { ">" } else { " " };
    let words_style = theme.style(if is_chosen { TextRole::Title } else { TextRole::Plain });
    let front = Line::from(vec![
        theme.span(format!("{mark}{word} "), role),
        Span::styled(format!("{:>2} {first:<room$}", place + 1), words_style),
        theme.plain(value),
    ]);
    let more = parts.map(|part| Line::styled(format!("{:FRONT_COLUMNS$}{part}", ""), words_style));
    std::iter::once(front).chain(more).collect()
}

/// Who signs the step, or who did.
fn below(step: &Step) -> String {
    let limits = step
        .value
        .as_ref()
        .map_or_else(String::new, |limits| format!(": {} {}", limits.quantity.name, limits.words()));
    let who = step.role.map_or_else(|| "anybody".to_owned(), role_name);
    let signer = |by: &str| if by.is_empty() { "somebody".to_owned() } else { by.to_owned() };
    match &step.mark {
        Mark::Open => format!("{who} signs{limits}"),
        Mark::Signed(signed) => format!("signed by {}, {}", signer(&signed.by), clock(signed.unix_s)),
        Mark::Voided(signature) => {
            format!("voided by {}, {}; {who} signs", signer(&signature.by), clock(signature.unix_s))
        }
    }
}

/// Hours and minutes of the day, UTC.
fn clock(unix_s: u64) -> String {
    format!("{:02}:{:02} UTC", unix_s / 3_600 % 24, unix_s / 60 % 60)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    use crate::model::{Settings, Speaker};
    use crate::view::theme::Palette;

    #[test]
    fn the_beginning_of_the_newest_event_is_visible() {
        let mut model = Model::new(Settings::on_screen("udpin:127.0.0.1:14550"));
        let at = Duration::from_secs(7);
        model.events.push(at, Speaker::Vehicle, EventLevel::Info, "SAFED".to_owned());
        let text = "arming refused: pin: found in the vehicle".to_owned();
        model.events.push(at, Speaker::Vehicle, EventLevel::Warning, text);
        let theme = Theme { palette: Palette::None, ascii: false };
        let shown = |rows| -> Vec<String> {
            events(&model, theme, TIME_COLUMNS + 3 + 20, rows).iter().map(Line::to_string).collect()
        };
        // In a panel this narrow the speaker is left out.
        let gap = " ".repeat(TIME_COLUMNS + 3);
        let whole = ["    7.0 ! arming refused: pin:", &format!("{gap}found in the vehicle")];
        assert_eq!(shown(1), whole, "its end is cut where it is drawn");
        assert_eq!(shown(2), whole);
        assert_eq!(shown(3), ["    7.0   SAFED", whole[0], whole[1]]);
    }

    #[test]
    fn an_event_has_the_time_since_the_lift_off() {
        let [start, lift_off, late] = [0.0, 30.25, 1_530.2].map(Duration::from_secs_f64);
        assert_eq!(clock_time(lift_off, None), "30.2");
        let times = [start, lift_off, late].map(|at| clock_time(at, Some(lift_off)));
        assert_eq!(times, ["T-30.2", "T+0.0", "T+1500"]);
    }

    #[test]
    fn texts_wrap_at_spaces_without_losing_a_character() {
        assert_eq!(wrap("one two", 20), ["one two"]);
        assert_eq!(wrap("arming refused: pin: found in", 20), ["arming refused: pin:", "found in"]);
        assert_eq!(wrap(&"x".repeat(45), 20).concat().len(), 45);
        assert_eq!(wrap("", 20), [""]);
    }
}

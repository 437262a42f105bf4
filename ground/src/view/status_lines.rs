//! The lines around a page: the next event, the log, the alarm, the position of a replay.

use std::time::Duration;

use protocol::dialect::{TdBooster, TdChute, TdInterlock, TdMotor, TdPhase};
use ratatui::text::{Line, Span};
use unicode_truncate::UnicodeTruncateStr as _;

use super::{STALE_MARK, TextRole, Theme, fixed, shortest};
use crate::model::{Alarm, GRAVITY_M_S2, Model, Page, Playback, Role, Vehicle, latch_cause};

/// Whether the time to the next event is shown large, so that the line can leave it out.
fn is_large(page: Page, phase: TdPhase) -> bool {
    let timed = matches!(
        phase,
        TdPhase::TD_PHASE_COAST
            | TdPhase::TD_PHASE_AERO_DESCENT
            | TdPhase::TD_PHASE_LAND_ARMED
            | TdPhase::TD_PHASE_POWERED
    );
    timed && matches!(page, Page::Ascent | Page::Descent | Page::Landing)
}

/// The next event of a flight; `None` on the pad, where the crew decides. Without its time if that
/// is large `beside` it.
pub fn next_event(model: &Model, now: Duration, beside: bool) -> Option<String> {
    let phase = model.vehicle.phase()?;
    let (event, left, rest) = event(&model.vehicle, phase.value, now)?;
    let left = if beside && is_large(model.page(), phase.value) { String::new() } else { left };
    let mark = if phase.is_stale(now) { STALE_MARK } else { " " };
    Some(format!(" next{mark}{event}{left}{rest}"))
}

/// A vehicle that is slower than this is not falling, m/s.
const FALLS_M_S: f64 = 0.5;

/// In how long it is at apogee, by its climb.
fn apogee_in(vehicle: &Vehicle, now: Duration) -> String {
    let climb = vehicle.best_motion().map(|motion| (motion.value.climb_m_s, motion.age(now)));
    within(climb.map(|(climb, age)| climb / GRAVITY_M_S2 - age.as_secs_f64()))
}

/// The event, its time, and a remark.
fn event(vehicle: &Vehicle, phase: TdPhase, now: Duration) -> Option<(String, String, String)> {
    let words = |event: &str, rest: &str| Some((event.to_owned(), String::new(), rest.to_owned()));
    match phase {
        TdPhase::TD_PHASE_BOOST if !vehicle.has_lifted() => words("lift-off", ", ignition commanded"),
        // The time stands in the row of the abort, on every page.
        TdPhase::TD_PHASE_COAST if is_inhibited(vehicle) => {
            words("parachute", &format!("{}, at apogee", apogee_in(vehicle, now)))
        }
        TdPhase::TD_PHASE_BOOST if is_inhibited(vehicle) => words("parachute", ", at apogee"),
        TdPhase::TD_PHASE_DEPLOY if is_inhibited(vehicle) => words("parachute", ""),
        TdPhase::TD_PHASE_BOOST => words("burnout", ", then it coasts to apogee"),
        TdPhase::TD_PHASE_COAST => {
            let attached =
                vehicle.descent().is_some_and(|d| d.value.booster == TdBooster::TD_BOOSTER_ATTACHED);
            let (before, after) = if attached { ("separation, ", "") } else { ("", ", then the fins open") };
            Some((format!("{before}apogee"), apogee_in(vehicle, now), after.to_owned()))
        }
        TdPhase::TD_PHASE_DEPLOY => words("fins open", ", then the steered descent"),
        TdPhase::TD_PHASE_AERO_DESCENT | TdPhase::TD_PHASE_LAND_ARMED => Some(ignition(vehicle, phase, now)),
        TdPhase::TD_PHASE_IGNITION if vehicle.shows(TdInterlock::TD_INTERLOCK_NO_LIGHT) => {
            words("the ground", ", NO LIGHT")
        }
        TdPhase::TD_PHASE_IGNITION => words("thrust", " within 0.5 s, or NO LIGHT"),
        TdPhase::TD_PHASE_POWERED => {
            let left_s = vehicle.touchdown_in_s(now).map(|left| left.value);
            Some(("touchdown".to_owned(), within(left_s), String::new()))
        }
        TdPhase::TD_PHASE_TOUCHDOWN => words("over", " when motor is cool or pin is in"),
        TdPhase::TD_PHASE_CHUTE => Some(under_chute(vehicle, now)),
        // On the pad the crew decides; afterwards the flight is over.
        _ => None,
    }
}

/// Whether the vehicle reports its landing motor as inhibited.
pub fn is_inhibited(vehicle: &Vehicle) -> bool {
    vehicle.interlocks().is_some() && !vehicle.may_light()
}

fn ignition(vehicle: &Vehicle, phase: TdPhase, now: Duration) -> (String, String, String) {
    if is_inhibited(vehicle) {
        let why = latch_cause(vehicle).map_or_else(String::new, |cause| format!(", {cause}"));
        return ("the ground".to_owned(), String::new(), format!(", NO BURN{why}"));
    }
    let descent = vehicle.descent();
    let left_s = vehicle.ignition_in_s(now).map(|left| left.value);
    let chosen_m = descent.map(|d| f64::from(d.value.chosen_height_m)).filter(|m| m.is_finite());
    let at = chosen_m.map_or_else(String::new, |height_m| format!(" at {} m", fixed(height_m, 0)));
    let armed = if phase == TdPhase::TD_PHASE_LAND_ARMED { ", motor armed" } else { ", motor not armed" };
    ("IGNITION".to_owned(), within(left_s), format!("{at}{armed}"))
}

/// Until the canopy carries the vehicle the time is unknown: it falls fast, and soon slower.
fn under_chute(vehicle: &Vehicle, now: Duration) -> (String, String, String) {
    let live = vehicle.reports(|status| status.motor == TdMotor::TD_MOTOR_LIVE);
    let motor = if live { ", LIVE MOTOR" } else { "" };
    let Some(descent) = vehicle.descent().filter(|d| d.value.chute == TdChute::TD_CHUTE_OPEN) else {
        return ("chute opens".to_owned(), String::new(), format!(", still fast{motor}"));
    };
    let sinks_m_s = -f64::from(descent.value.vertical_speed_m_s);
    let falls_s = f64::from(descent.value.height_m) / sinks_m_s - descent.age(now).as_secs_f64();
    let left_s = Some(falls_s).filter(|_| sinks_m_s > FALLS_M_S);
    ("ground".to_owned(), within(left_s), motor.to_owned())
}

/// As in ` in 3.4 s`; empty if the time is unknown or over.
fn within(left_s: Option<f64>) -> String {
    left_s
        .filter(|left_s| left_s.is_finite() && *left_s >= 0.0)
        .map_or_else(String::new, |left_s| format!(" in {} s", fixed(left_s, 1)))
}

/// A loss of more than a twentieth is marked.
pub fn loss_role(loss: Option<f64>) -> TextRole {
    if loss > Some(0.05) { TextRole::Caution } else { TextRole::Plain }
}

/// A loss in percent; unknown while nothing arrives.
pub fn percent(share: Option<f64>) -> String {
    share.map_or_else(|| "unknown".to_owned(), |share| format!("{:.1} %", share * 100.0))
}

/// Whether the log records, and for how long.
pub fn recording(model: &Model, theme: Theme, now: Duration) -> Span<'static> {
    if model.settings.role == Role::Replaying {
        return theme.label(" recorded ");
    }
    if model.settings.log_path.is_none() {
        return theme.span(" NOT RECORDED ", TextRole::Caution);
    }
    if model.log.failed {
        return theme.span(" LOG FAILED ", TextRole::Alarm);
    }
    let seconds = now.as_secs();
    let words = format!(" ● REC {:02}:{:02} ", seconds / 60, seconds % 60);
    theme.span(words, if model.log.dropped > 0 { TextRole::Caution } else { TextRole::Plain })
}

// The alarm line above the page names, with the foremost alarm or the newest event.

/// The key that acknowledges the shown alarm.
const KEY: &str = " Space: seen ";
/// On a narrower line the key is left out.
const KEY_FROM_COLUMNS: usize = 40;
/// The shortest useful part of a text.
const TEXT_COLUMNS_MIN: usize = 11;

/// The position of a replay, and its keys.
pub fn replay_line(playing: &Playback, theme: Theme) -> Line<'static> {
    let (at, of) = (playing.position.as_secs_f64(), playing.length.as_secs_f64());
    let (state, speed) = (if playing.paused { "PAUSED" } else { "plays" }, shortest(playing.speed));
    let words = format!(" REPLAY {state} {at:.1} of {of:.1} s x{speed}  Space Left Right [ ] + -");
    theme.line(words, TextRole::Title)
}

/// The foremost alarm, its age and the number of further alarms. Only the text of the alarm is
/// shortened; the key that acknowledges a new alarm is never cut.
pub fn alarm_text(model: &Model, theme: Theme, now: Duration, columns: usize) -> Option<Line<'static>> {
    let alarm = model.alarms.foremost()?;
    let more = match model.alarms.list().len() {
        1 => String::new(),
        count => format!(" (+{})", count - 1),
    };
    let key = if alarm.acknowledged || columns < KEY_FROM_COLUMNS { "" } else { KEY };
    let (word, age, role) = alarm_state(alarm, now);
    let taken = 1 + word.len() + 1 + 2 + age.len() + more.len() + key.len();
    // On the narrowest screens the text is more important than its age.
    let room = columns.saturating_sub(taken).max(TEXT_COLUMNS_MIN);
    let text = cut(&alarm.what.text, room);
    let line = format!(" {word} {text}, {age}{more}");
    let blank = columns.saturating_sub(key.len() + Span::raw(&*line).width());
    let mut spans = vec![theme.span(format!("{line}{:blank$}", ""), role)];
    if !key.is_empty() {
        spans.push(theme.key(key));
    }
    Some(Line::from(spans))
}

/// Whether an alarm holds and a person has seen it; for how long it has held, or how long ago it
/// ended, in whole seconds.
pub fn alarm_state(alarm: &Alarm, now: Duration) -> (&'static str, String, TextRole) {
    let since_s = |at: Duration| now.saturating_sub(at).as_secs();
    let (word, role) = match alarm.ended_at {
        None if alarm.acknowledged => ("alarm seen:", TextRole::Caution),
        None => ("ALARM", TextRole::Alarm),
        Some(_) if alarm.past => ("past alarm:", TextRole::Caution),
        Some(_) => ("ended alarm:", TextRole::Caution),
    };
    let age = match alarm.ended_at {
        None => format!("{} s ago", since_s(alarm.raised_at)),
        Some(at) => format!("ended {} s ago", since_s(at)),
    };
    (word, age, role)
}

/// Shortens a text to this many columns; a shortened text ends in `..`. Whole words are kept,
/// unless that would lose more than a third of what fits.
pub fn cut(text: &str, columns: usize) -> String {
    if Span::raw(text).width() <= columns {
        return text.to_owned();
    }
    let room = columns.saturating_sub(2);
    let (fits, _) = text.unicode_truncate(room);
    let ends_a_word = text[fits.len()..].starts_with(' ');
    let words = fits.rsplit_once(' ').map(|(words, _)| words).filter(|_| !ends_a_word);
    let complete_words = words.filter(|words| 3 * Span::raw(*words).width() >= 2 * room).unwrap_or(fits);
    format!("{}..", complete_words.trim_end())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_is_cut_at_a_word_boundary() {
        let text = "LINK LOST: the vehicle is not there";
        assert_eq!(cut(text, 35), text);
        assert_eq!(cut(text, 34), "LINK LOST: the vehicle is not..");
        assert_eq!(cut(text, 31), "LINK LOST: the vehicle is not..");
        assert_eq!(cut(text, 30), "LINK LOST: the vehicle is..");
        assert_eq!(cut("ABORT LATCHED on the vehicle", 12), "ABORT LATC..");
        assert_eq!(cut("no-whole-word-fits", 12), "no-whole-w..");
        assert_eq!(cut("a no-whole-word-fits", 12), "a no-whole..");
    }
}

//! The lines that are always there: phase, armed, countdown, link, abort.

use std::time::Duration;

use protocol::dialect::TD_FLIGHT_STATUS_DATA;
use ratatui::text::{Line, Span};

use super::next;
use super::number::{STALE_MARK, age_mark, seconds};
use super::theme::{Role, Theme};
use crate::model::command::{Acknowledged, CommandKind, Track};
use crate::model::link::LinkState;
use crate::model::vehicle::Sample;
use crate::model::{self, Model, too_late, words};

/// In flight, a command whose effect is not seen stands before what happens next for this long. Its alarm stays.
const OPEN_SHOWN: Duration = Duration::from_secs(10);
/// The abort key, in words.
pub const ABORT_KEY: &str = "Ctrl-X Enter";

/// What aborts from this screen, or why nothing does.
pub fn abort_key(model: &Model) -> String {
    match model.settings.role {
        model::Role::Station | model::Role::Attached => format!("ABORT {ABORT_KEY}"),
        model::Role::Watching => "WATCHING only".to_owned(),
        model::Role::Replaying => "REPLAY".to_owned(),
    }
}

/// The phase, with its age.
pub fn phase(model: &Model, theme: Theme, now: Duration) -> Span<'static> {
    match model.vehicle.phase() {
        None => Span::styled(" no vehicle", theme.style(Role::Label)),
        Some(phase) => {
            let (mark, stale) = age_mark(&phase, now);
            let role = if stale == Role::Stale { stale } else { Role::Title };
            Span::styled(format!("{mark}{}", words::phase(phase.value)), theme.style(role))
        }
    }
}

/// Armed, as HEARTBEAT says.
pub fn armed(model: &Model, theme: Theme, now: Duration) -> Span<'static> {
    match model.vehicle.armed() {
        None => Span::styled(" armed ?", theme.style(Role::Label)),
        Some(armed) => {
            let (mark, stale) = age_mark(&armed, now);
            match (armed.value, stale) {
                (true, _) => Span::styled(format!("{mark}ARMED"), theme.style(Role::Alarm)),
                (false, Role::Stale) => Span::styled(format!("{mark}disarmed"), theme.style(Role::Stale)),
                (false, _) => Span::styled(format!("{mark}disarmed"), theme.style(Role::Good)),
            }
        }
    }
}

/// Time to release, or since ignition.
pub fn countdown(model: &Model, theme: Theme, now: Duration) -> Span<'static> {
    match model.vehicle.countdown_s() {
        None => Span::styled(" T --", theme.style(Role::Label)),
        Some(time) => {
            let (mark, role) = age_mark(&time, now);
            let sign = if time.value > 0.0 { '-' } else { '+' };
            let role = if role == Role::Stale { role } else { Role::Title };
            Span::styled(format!("{mark}T{sign}{:.1}", time.value.abs()), theme.style(role))
        }
    }
}

/// The link, in a word and its age.
pub fn link(model: &Model, theme: Theme, now: Duration) -> Span<'static> {
    match model.link.state(now) {
        LinkState::NeverHeard => Span::styled("link: not heard", theme.style(Role::Caution)),
        // An age that only counts from heartbeat to heartbeat says nothing, ten times a second.
        LinkState::Alive(_) => Span::styled("link ok", theme.style(Role::Good)),
        LinkState::Doubtful(age) => {
            Span::styled(format!("LINK? {}", seconds(age)), theme.style(Role::Caution))
        }
        LinkState::Lost(age) => Span::styled(format!("LINK LOST {}", seconds(age)), theme.style(Role::Alarm)),
    }
}

/// What an abort would do now, or what became of the one that was asked for.
pub fn abort(model: &Model, theme: Theme, now: Duration) -> Line<'static> {
    let effect = abort_effect(model, now);
    if model.abort_chord.is_begun(now) {
        return Line::styled(format!(" ENTER ABORTS (or Ctrl-X): {effect}"), theme.style(Role::Alarm));
    }
    if let Some(track) = model.commands.of(CommandKind::Abort) {
        return facts(track, theme, now);
    }
    Line::from(vec![
        Span::styled(" abort now: ", theme.style(Role::Label)),
        Span::styled(effect, theme.style(Role::Plain)),
    ])
}

/// What an abort would do now, marked when that was said too long ago.
fn abort_effect(model: &Model, now: Duration) -> String {
    let Some(status) = model.vehicle.status.as_ref() else { return "unknown".to_owned() };
    if let Some(why) = too_late::why(model, now) {
        return why.to_owned();
    }
    let mark = if status.is_stale(now) { "~" } else { "" };
    let reach = if let LinkState::Lost(_) = model.link.state(now) { "; MAY NOT ARRIVE" } else { "" };
    format!("{mark}{}{reach}", words::abort_effect(&status.value))
}

/// After an abort on the pad: nobody goes there yet.
pub fn pad_wait(model: &Model, theme: Theme) -> Option<Line<'static>> {
    let wait_s =
        model.vehicle.status.as_ref().map(|status| status.value.pad_wait_s).filter(|wait| *wait > 0)?;
    Some(Line::styled(format!(" STAY OFF THE PAD for {wait_s} s"), theme.style(Role::Alarm)))
}

/// The three facts for narrow screens.
pub fn facts_short(track: &Track, theme: Theme, now: Duration) -> Line<'static> {
    let (acknowledged, acknowledged_role) = match track.acknowledged {
        Acknowledged::Waiting | Acknowledged::InProgress => ("-", Role::Caution),
        Acknowledged::Nothing => ("NEVER", Role::Alarm),
        Acknowledged::Answered(_) if track.accepted() => ("ok", Role::Good),
        Acknowledged::Answered(_) => ("REFUSED", Role::Alarm),
    };
    let (observed, observed_role) = match track.observed_at {
        Some(_) => ("ok", Role::Good),
        None if track.disagrees(now) => ("NO", Role::Alarm),
        None => ("-", Role::Plain),
    };
    Line::from(vec![
        Span::styled(format!("{} x{}", track.kind.name(), track.attempts), theme.style(Role::Title)),
        Span::styled(" ack ", theme.style(Role::Label)),
        Span::styled(acknowledged, theme.style(acknowledged_role)),
        Span::styled(" obs ", theme.style(Role::Label)),
        Span::styled(observed, theme.style(observed_role)),
    ])
}

/// Commanded, acknowledged, observed: three facts of one command.
pub fn facts(track: &Track, theme: Theme, now: Duration) -> Line<'static> {
    let label = |text: &str| Span::styled(text.to_owned(), theme.style(Role::Label));
    let (acknowledged, acknowledged_role) = match track.acknowledged {
        Acknowledged::Waiting => ("waiting".to_owned(), Role::Caution),
        Acknowledged::InProgress => ("in progress".to_owned(), Role::Caution),
        Acknowledged::Nothing => ("NEVER".to_owned(), Role::Alarm),
        Acknowledged::Answered(_) if track.accepted() => ("accepted".to_owned(), Role::Good),
        Acknowledged::Answered(result) => (format!("REFUSED ({})", refusal(result)), Role::Alarm),
    };
    let (observed, observed_role) = match track.observed_at {
        Some(_) => ("yes".to_owned(), Role::Good),
        None if track.disagrees(now) => ("NOT OBSERVED".to_owned(), Role::Alarm),
        None => ("not yet".to_owned(), Role::Plain),
    };
    Line::from(vec![
        Span::styled(format!(" {:<6} ", track.kind.name()), theme.style(Role::Title)),
        label("commanded "),
        Span::styled(
            format!("{:.1} s x{}", track.commanded_at.as_secs_f64(), track.attempts),
            theme.style(Role::Plain),
        ),
        label("  acknowledged "),
        Span::styled(acknowledged, theme.style(acknowledged_role)),
        label("  observed "),
        Span::styled(observed, theme.style(observed_role)),
    ])
}

fn refusal(result: u8) -> &'static str {
    match result {
        1 => "not now",
        2 => "denied",
        3 => "unsupported",
        4 => "failed",
        6 => "cancelled",
        _ => "unknown",
    }
}

/// The wait after an abort; else the latest command besides an abort while something is still open about it; else what
/// happens next; on the pad the latest command, and before the first, whether the vehicle may be armed.
pub fn command(model: &Model, theme: Theme, now: Duration) -> Line<'static> {
    if let Some(wait) = pad_wait(model, theme) {
        return wait;
    }
    let next = next::line(model, theme, now);
    if let Some(next) = next.filter(|_| open_command(model, now).is_none()) {
        return next;
    }
    let latest = model.commands.tracks.iter().rfind(|track| track.kind != CommandKind::Abort);
    if let Some(track) = latest {
        return facts(track, theme, now);
    }
    model.vehicle.status.as_ref().map_or_else(Line::default, |status| {
        readiness(status, theme, now).unwrap_or_else(|| {
            let failing = words::failed_checks(status.value.checks_failed).join(", ");
            Line::styled(format!(" NO-GO: {failing}"), theme.style(Role::Caution))
        })
    })
}

/// The latest command besides an abort, while its effect is waited for.
pub fn open_command(model: &Model, now: Duration) -> Option<&Track> {
    let latest = model.commands.tracks.iter().rfind(|track| track.kind != CommandKind::Abort);
    latest.filter(|track| track.observed_at.is_none() && now.saturating_sub(track.commanded_at) < OPEN_SHOWN)
}

/// How the arming checks stand, where none is known to fail.
pub fn readiness(
    status: &Sample<TD_FLIGHT_STATUS_DATA>,
    theme: Theme,
    now: Duration,
) -> Option<Line<'static>> {
    if status.is_stale(now) {
        let words = format!(" {STALE_MARK}checks: not heard any more");
        return Some(Line::styled(words, theme.style(Role::Stale)));
    }
    let passed = status.value.checks_failed.is_empty();
    passed.then(|| Line::styled(" GO: every arming check passes", theme.style(Role::Good)))
}

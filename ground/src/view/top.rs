//! The lines that are always there: phase, armed, countdown, link, abort.

use std::time::Duration;

use ratatui::text::{Line, Span};

use super::next;
use super::number::{STALE_MARK, age_mark};
use super::theme::{Role, Theme};
use crate::model::command::{Acknowledged, CommandKind, Track};
use crate::model::link::LinkState;
use crate::model::motor::{Danger, KeepAway, hold_words};
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

/// Both directions of the link, each with the age of the last frame that arrived on it: that the vehicle is heard does
/// not say that it hears. Whole seconds, because tenths that only count from heartbeat to heartbeat say nothing.
pub fn link(model: &Model, theme: Theme, now: Duration) -> Line<'static> {
    let down = model.link.state(now);
    if down == LinkState::NeverHeard {
        return Line::styled("down: not heard", theme.style(Role::Caution));
    }
    let direction = |name: &str, loud: &str, state| match state {
        LinkState::NeverHeard => Span::styled(format!("{loud} NOT PROVEN"), theme.style(Role::Alarm)),
        LinkState::Alive(age) => Span::styled(format!("{name} {}s", age.as_secs()), theme.style(Role::Good)),
        LinkState::Doubtful(age) => {
            Span::styled(format!("{name} late {}s", age.as_secs()), theme.style(Role::Caution))
        }
        LinkState::Lost(age) => {
            Span::styled(format!("{loud} LOST {}s", age.as_secs()), theme.style(Role::Alarm))
        }
    };
    let up = match model.link.uplink.state(now) {
        // Nobody has told of it since.
        LinkState::Lost(age) | LinkState::Doubtful(age) if !down.carries() => {
            Span::styled(format!("{STALE_MARK}up {}s", age.as_secs()), theme.style(Role::Stale))
        }
        state => direction("up", "UP", state),
    };
    Line::from(vec![direction("down", "DOWN", down), Span::raw(" "), up])
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

/// That nobody may come near the vehicle, and for how long.
pub fn keep_away(model: &Model, theme: Theme, now: Duration) -> Option<Line<'static>> {
    let away = KeepAway::of(&model.vehicle)?;
    let stale = model.vehicle.status.as_ref().is_some_and(|status| status.is_stale(now));
    let mark = if stale { STALE_MARK } else { " " };
    let role = if away.danger == Danger::Hot { Role::Caution } else { Role::Alarm };
    Some(Line::styled(format!("{mark}{}", away.words()), theme.style(role)))
}

/// That the countdown was held, why, and what follows.
fn hold(model: &Model, theme: Theme) -> Option<Line<'static>> {
    let words = hold_words(&model.vehicle, model.link.uplink.commands)?;
    Some(Line::styled(words, theme.style(Role::Alarm)))
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

/// That nobody may come near; else the latest command besides an abort while something is still open about it; else a hold;
/// else what happens next; on the pad the latest command, and before the first, whether the vehicle may be armed.
pub fn command(model: &Model, theme: Theme, now: Duration) -> Line<'static> {
    if let Some(mut line) = keep_away(model, theme, now) {
        // Under a parachute both matter: that it comes down and where it is then.
        let falls = model.vehicle.in_flight().then(|| next::line(model, theme, now)).flatten();
        line.spans.extend(falls.into_iter().flat_map(|next| next.spans));
        return line;
    }
    if open_command(model, now).is_none()
        && let Some(hold) = hold(model, theme)
    {
        return hold;
    }
    let next = next::line(model, theme, now);
    if let Some(next) = next.filter(|_| open_command(model, now).is_none()) {
        return next;
    }
    let latest = model.commands.tracks.iter().rfind(|track| track.kind != CommandKind::Abort);
    if let Some(track) = latest {
        return facts(track, theme, now);
    }
    readiness(model, theme, now).unwrap_or_default()
}

/// The latest command besides an abort, while its effect is waited for.
pub fn open_command(model: &Model, now: Duration) -> Option<&Track> {
    let latest = model.commands.tracks.iter().rfind(|track| track.kind != CommandKind::Abort);
    latest.filter(|track| track.observed_at.is_none() && now.saturating_sub(track.commanded_at) < OPEN_SHOWN)
}

/// Whether the vehicle may be armed: GO only if every check of it passes and it is proven that it hears this station. `None`
/// before it has said how its checks stand.
pub fn readiness(model: &Model, theme: Theme, now: Duration) -> Option<Line<'static>> {
    let status = model.vehicle.status.as_ref()?;
    if status.is_stale(now) {
        let words = format!(" {STALE_MARK}checks: not heard any more");
        return Some(Line::styled(words, theme.style(Role::Stale)));
    }
    let failing = words::failed_checks(status.value.checks_failed);
    if !failing.is_empty() {
        return Some(Line::styled(format!(" NO-GO: {}", failing.join(", ")), theme.style(Role::Caution)));
    }
    if !model.link.uplink.is_proven(now) {
        let words = " NO-GO: uplink not proven, every other check passes";
        return Some(Line::styled(words, theme.style(Role::Caution)));
    }
    Some(Line::styled(" GO: every arming check passes", theme.style(Role::Good)))
}

//! Decides whether a command is sent, and tracks it: sent, answered or given up, observed. The
//! automatic mode and the unattended countdown give their commands here too.

use std::time::Duration;

use protocol::command::{CommandAnswer, CommandEvent, Resend, StationHold, Ticket, result_words};
use protocol::dialect::{COMMAND_LONG_DATA, MavMessage, MavResult, TdAct, TdHold, TdPhase};
use protocol::log::record::EventLevel;
use protocol::mission::MissionHash;

use crate::model::{
    Acknowledgement, Action, AutoStep, CommandKind, CommandRow, Commands, LogFault, LogStanding, Model, Seat,
    Settings, Speaker, TrackedCommand, why_not_arm, why_not_check, why_not_confirm, why_not_seat,
    why_not_seen, why_not_start, why_not_take, why_nothing_moves, why_untested,
};

/// Of the many attempts of an abort, only the first and every n-th become an event.
const ABORT_REPORTED_EVERY: u32 = 100;

/// The crew continues without the station's log. That is recorded wherever something still records:
/// in the vehicle's log by the station's book, and on every screen.
pub(super) fn without_log(model: &mut Model, by: &Seat, now: Duration) {
    let LogStanding::Unfit(fault, words) = model.station_log(now) else {
        return model.info(now, "the station's log is fit: nothing to overrule");
    };
    if let Some(why) = why_not_seat(model, by) {
        return model.warn(now, format!("not without a log: {why}"));
    }
    model.without_log = Some(fault);
    let what = "arm and start go on although the station log";
    let text = format!("WITHOUT A LOG: {what} {words}{}", by.in_brackets());
    model.log_act(now, "without log", by, EventLevel::Warning, text);
}

/// The crew arms a motor that no burn of its lot has confirmed. The operator is recorded as for
/// [`without_log`]; it counts until the vehicle's next power-up.
pub(super) fn untested(model: &mut Model, by: &Seat, now: Duration) {
    let Some(why) = why_untested(model) else {
        return model.info(now, "burns confirm the motor, or it was overruled: nothing to overrule");
    };
    if let Some(why) = why_not_seat(model, by) {
        return model.warn(now, format!("not with an untested motor: {why}"));
    }
    model.untested = model.vehicle.boot.number();
    let text = format!("UNTESTED MOTOR: arming goes on although {why}{}", by.in_brackets());
    model.log_act(now, "untested motor", by, EventLevel::Warning, text);
}

/// Sends a command, unless the vehicle has changed in the meantime or the same command is already
/// being sent.
pub(super) fn command(model: &mut Model, kind: CommandKind, by: &Seat, now: Duration) {
    let theirs = why_not_seat(model, by).filter(|_| kind.needs_the_owner());
    let why_not = match kind {
        _ if theirs.is_some() => theirs,
        CommandKind::Arm => already_sent(model, kind, now).or_else(|| why_not_arm(model, now)),
        CommandKind::Start => already_sent(model, kind, now).or_else(|| why_not_start(model, now)),
        CommandKind::ConfirmArm | CommandKind::ConfirmStart => {
            let none = || "no operator of another role requests it".to_owned();
            let start = kind == CommandKind::ConfirmStart;
            let open = model.open_proposal(now).filter(|open| (open.act == TdAct::TD_ACT_START) == start);
            open.map_or_else(|| Some(none()), |open| why_not_confirm(model, &open, now))
        }
        CommandKind::TakeCommand => why_not_take(model, now),
        CommandKind::Tap => {
            let ours = model.tapping(now).is_some_and(|(by, _)| by == model.key_number());
            let none = || (!ours).then(|| "no tap of this operator is due".to_owned());
            why_nothing_moves(model, now).or_else(none)
        }
        CommandKind::Seen => why_not_seen(model, now),
        CommandKind::Check | CommandKind::CheckStill => {
            already_sent(model, kind, now).or_else(|| why_not_check(model, now))
        }
        // It would cut the motors of another vehicle.
        CommandKind::Disarm if model.vehicle.as_foreign().is_some() => why_nothing_moves(model, now),
        CommandKind::Disarm | CommandKind::Hold | CommandKind::Abort | CommandKind::EndCheck => None,
    };
    match why_not {
        // The next one comes within 1 s, and the vehicle shows the time that is left.
        None if kind == CommandKind::Tap => {
            send_once(model, kind, 0.0);
            model.record_operator(now, "commanded", by, &format!("TAP{}", by.in_brackets()));
        }
        None => submit(model, kind, by.clone(), now),
        Some(why) => {
            let text = format!("cannot {}: {why}{}", kind.row().name.to_lowercase(), by.in_brackets());
            model.log_act(now, "not sent", by, EventLevel::Warning, text);
        }
    }
}

/// Why not to send a command that another screen has just sent.
fn already_sent(model: &Model, kind: CommandKind, now: Duration) -> Option<String> {
    let track = model.commands.of(kind).filter(|track| track.is_on_its_way(now))?;
    Some(format!("{} is already on its way{}", kind.row().name, track.by.in_brackets()))
}

/// Sends a command to the vehicle and starts to track it.
pub(super) fn submit(model: &mut Model, kind: CommandKind, by: Seat, now: Duration) {
    let commands = &mut model.commands;
    let aborting = commands.is_aborting();
    if kind == CommandKind::Abort || (kind == CommandKind::Disarm && !aborting) {
        // An abort or a disarm ends the resending of every other command: a start that arrives
        // later would undo it. The effects of the others will not be observed, and that is no
        // error.
        commands.sender.withdraw_all(now);
        for track in &mut commands.tracks {
            track.not_observed_reported = true;
            if matches!(track.acknowledged, Acknowledgement::Waiting | Acknowledgement::InProgress) {
                track.acknowledged = Acknowledgement::GivenUp;
            }
        }
        // The automatic mode ends when a person acts.
        model.auto_step = AutoStep::Done;
    }
    if kind == CommandKind::Abort && model.beside(now).is_some() {
        let id = model.settings.vehicle.system_id;
        model.warn(now, format!("the ABORT goes to every vehicle received under id {id}"));
    }
    let commands = &mut model.commands;
    // An abort that is commanded again while it is being sent is sent at once, and its attempts
    // keep counting.
    let earlier = commands.of(kind).filter(|_| kind == CommandKind::Abort && aborting).cloned();
    let ticket = send(model, kind, now);
    let commands = &mut model.commands;
    commands.tracks.retain(|track| track.kind != kind);
    commands.tracks.push(TrackedCommand {
        kind,
        by,
        commanded_at: earlier.as_ref().map_or(now, |track| track.commanded_at),
        attempts: earlier.map_or(0, |track| track.attempts),
        acknowledged: Acknowledgement::Waiting,
        acknowledged_at: None,
        observed_at: None,
        is_withdrawn: false,
        ticket,
        not_observed_reported: false,
    });
    model.outcome.refusal = None;
    poll(model, now);
}

fn send(model: &mut Model, kind: CommandKind, now: Duration) -> Ticket {
    let CommandRow { mav: (command, param1), moves, resend, .. } = kind.row();
    // A confirmation names its proposal; without a number it would be a new proposal.
    let confirms = matches!(kind, CommandKind::ConfirmArm | CommandKind::ConfirmStart);
    let number = model.open_proposal(now).filter(|_| confirms).map_or(0.0, |open| f32::from(open.number));
    // An arm names its mission: the vehicle refuses it if it flies another one.
    let arms = matches!(kind, CommandKind::Arm | CommandKind::ConfirmArm);
    let mission = model.settings.mission.filter(|_| arms).map_or([0.0; 3], MissionHash::to_params);
    let [param4, param5, param6] = mission;
    let boot = if moves { model.vehicle.boot.parameter() } else { 0.0 };
    let params = [param1, 0.0, number, param4, param5, param6, boot];
    model.commands.sender.submit(model.settings.vehicle, command, params, resend, now)
}

/// Sends the commands that are due and handles what happened to them.
pub(super) fn poll(model: &mut Model, now: Duration) {
    let messages = model.commands.sender.poll(now);
    model.outbox.extend(messages.into_iter().map(Action::send));
    for event in model.commands.sender.take_events() {
        on_event(model, event, now);
    }
}

pub(super) fn on_answer(model: &mut Model, answer: CommandAnswer, now: Duration) {
    let awaited = model.commands.sender.on_answer(&answer, now);
    let given_up =
        track_of(model, answer.command).map(|of| of.acknowledged) == Some(Acknowledgement::GivenUp);
    if !awaited && given_up {
        // The answer to a command that was given up is still recorded.
        let CommandAnswer { command, result, .. } = answer;
        on_event(model, CommandEvent::Answered { command, result, open: answer.is_open() }, now);
        return;
    }
    poll(model, now);
}

/// The latest command with this MAVLink number; arming and disarming share one.
fn track_of(model: &mut Model, command: u16) -> Option<&mut TrackedCommand> {
    model.commands.tracks.iter_mut().rfind(|track| track.kind.row().mav.0 as u16 == command)
}

fn on_event(model: &mut Model, event: CommandEvent, now: Duration) {
    // With several links the event names the one that carried the answer.
    let over = model.link.received_over().map_or_else(String::new, |link| format!(", over {link}"));
    let track = match event {
        CommandEvent::Sent { command, .. }
        | CommandEvent::InProgress { command, .. }
        | CommandEvent::Answered { command, .. }
        | CommandEvent::TimedOut { command, .. } => track_of(model, command),
        CommandEvent::AnsweredLate { ticket, .. } => {
            model.commands.tracks.iter_mut().find(|track| track.ticket == ticket)
        }
    };
    let Some(track) = track else { return };
    let kind = track.kind;
    let name = kind.row().name;
    let (by, seat) = (track.by.in_brackets(), track.by.clone());
    let mut answered = None;
    let (operator_kind, level, text) = match event {
        CommandEvent::Sent { .. } => {
            track.attempts += 1;
            let attempt = track.attempts;
            if kind.row().resend.is_persistent() && attempt > 1 {
                // An event for each attempt would hide everything else.
                if attempt % ABORT_REPORTED_EVERY != 0 {
                    return;
                }
            } else {
                track.acknowledged = Acknowledgement::Waiting;
            }
            ("commanded", EventLevel::Info, format!("{name} commanded, attempt {attempt}{by}"))
        }
        CommandEvent::InProgress { .. } => {
            track.acknowledged = Acknowledgement::InProgress;
            ("acknowledged", EventLevel::Info, format!("{name} acknowledged: in progress"))
        }
        CommandEvent::Answered { result, open, .. } | CommandEvent::AnsweredLate { result, open, .. } => {
            let is_proposed = open && result == MavResult::MAV_RESULT_TEMPORARILY_REJECTED as u8;
            track.acknowledged =
                if is_proposed { Acknowledgement::Proposed } else { Acknowledgement::Answered(result) };
            track.acknowledged_at = Some(now);
            answered = (!open).then_some(result);
            let words = result_words(result);
            let late = if matches!(event, CommandEvent::AnsweredLate { .. }) { " (late)" } else { "" };
            if is_proposed {
                let text = format!("{name} requested{late}: another role must confirm{over}");
                ("requested", EventLevel::Info, text)
            } else if track.accepted() {
                ("acknowledged", EventLevel::Info, format!("{name} acknowledged{late}: {words}{over}"))
            } else {
                ("refused", EventLevel::Error, format!("{name} REFUSED{late}: {words}{over}"))
            }
        }
        CommandEvent::TimedOut { attempts, .. } => {
            track.acknowledged = Acknowledgement::GivenUp;
            ("unanswered", EventLevel::Error, format!("{name} not acknowledged after {attempts} attempts"))
        }
    };
    let by = if matches!(event, CommandEvent::Sent { .. }) { "" } else { by.as_str() };
    model.record_operator(now, operator_kind, &seat, &format!("{text}{by}"));
    model.list_event(now, Speaker::Ground, level, text);
    if let Some(result) = answered {
        on_final_answer(model, kind, result, now);
    }
}

/// After a temporary refusal, the vehicle's report about its checks is accepted only after this.
const RETRY_AFTER: Duration = Duration::from_secs(1);

fn on_final_answer(model: &mut Model, kind: CommandKind, result: u8, now: Duration) {
    let refused = result != MavResult::MAV_RESULT_ACCEPTED as u8;
    let for_now = result == MavResult::MAV_RESULT_TEMPORARILY_REJECTED as u8;
    match kind {
        CommandKind::Arm if for_now && model.settings.auto && model.auto_step == AutoStep::WaitForArmed => {
            // As a new command, and never by resending the old frame.
            model.auto_step = AutoStep::WaitForReady { not_before: now + RETRY_AFTER };
            model.info(now, "automatic mode: temporarily refused; arms again when the checks pass");
        }
        CommandKind::Arm | CommandKind::Start if refused => {
            model.outcome.refusal = Some((format!("{} {}", kind.row().name, result_words(result)), now));
        }
        // A temporary refusal does not end an abort.
        CommandKind::Abort if for_now => {
            if let Some(track) = model.commands.tracks.iter_mut().find(|track| track.kind == kind) {
                track.acknowledged = Acknowledgement::Waiting;
                track.acknowledged_at = None;
            }
        }
        CommandKind::Abort => stop_if_confirmed(model, now),
        _ => {}
    }
}

/// An abort is resent until it has been accepted and the vehicle's own state shows the latch, or
/// until it has been refused permanently.
fn stop_if_confirmed(model: &mut Model, now: Duration) {
    let confirmed = model.commands.of(CommandKind::Abort).filter(|track| track.is_confirmed());
    // Of two vehicles under one id either may have answered.
    let confirmed = confirmed.filter(|_| model.beside(now).is_none());
    if let Some(ticket) = confirmed.map(|track| track.ticket) {
        model.commands.sender.withdraw_one(ticket, now);
    }
}

/// The vehicle has rebooted. Its earlier acknowledgements are void; only an abort that is still
/// being sent is sent again. Returns the names of the void commands.
pub(super) fn restart_after_reboot(model: &mut Model, now: Duration) -> Vec<&'static str> {
    let aborting = model.commands.is_aborting();
    let by = model.commands.of(CommandKind::Abort).map(|track| track.by.clone()).unwrap_or_default();
    model.commands.sender.withdraw_all(now);
    let void = model.commands.tracks.iter().map(|track| track.kind.row().name).collect();
    model.commands.tracks.clear();
    if aborting {
        submit(model, CommandKind::Abort, by, now);
    }
    void
}

/// Compares the vehicle's own state with the commands.
pub(super) fn observe(model: &mut Model, now: Duration) {
    let mut changes = Vec::new();
    let flies = model.vehicle.in_flight();
    let Commands { sender, tracks } = &mut model.commands;
    for track in tracks {
        let CommandRow { name, seen, resend, moves, .. } = track.kind.row();
        // A command repeated until its answer ends when it can no longer help. An observed effect
        // is no answer: an arming may still be on its way.
        let repeats = resend == Resend::UntilAnswered && track.acknowledged == Acknowledgement::Waiting;
        if repeats && flies {
            sender.withdraw_one(track.ticket, now);
            track.acknowledged = Acknowledgement::GivenUp;
            let text = format!("{name} TOO LATE: the vehicle flies, and has not acknowledged it");
            changes.push((EventLevel::Error, track.by.clone(), text));
            continue;
        }
        // Then the effect is that of another station's command.
        let denied = Acknowledgement::Answered(MavResult::MAV_RESULT_DENIED as u8);
        if moves && track.acknowledged == denied {
            track.observed_at = None;
            continue;
        }
        let answered = seen.is_none() && track.accepted();
        let shown = answered || track.kind.is_observed(&model.vehicle, track.commanded_at);
        let (level, text) = if let Some(since) = track.observed_at {
            let Some(why) = track.kind.no_longer(&model.vehicle, since) else { continue };
            (track.observed_at, track.is_withdrawn) = (None, true);
            (EventLevel::Warning, format!("{name} no longer so: {why}"))
        } else if shown && !track.is_withdrawn {
            track.observed_at = Some(now);
            (EventLevel::Info, format!("{name} observed: {}", seen.unwrap_or("accepted")))
        } else if track.disagrees(now) && !track.not_observed_reported {
            track.not_observed_reported = true;
            let what = "not observed: the vehicle does not show it";
            (EventLevel::Error, format!("{name} acknowledged, {what}"))
        } else {
            continue;
        };
        changes.push((level, track.by.clone(), text));
    }
    for (level, by, text) in changes {
        model.log_act(now, "observed", &by, level, text);
    }
    // A refusal counts only when it arrives: it may be another vehicle's.
    if model.commands.of(CommandKind::Abort).is_some_and(|track| track.observed_at.is_some()) {
        stop_if_confirmed(model, now);
    }
}

// The automatic mode, for runs without a crew: arms and starts a simulated vehicle.

/// How long the vehicle may take to become ready, from its first heartbeat.
const READY_WITHIN: Duration = Duration::from_secs(10);
/// The same while another station uses our ids: one that ran before under the same ids is in the
/// way for up to 15 s.
const FREE_WITHIN: Duration = Duration::from_secs(20);
pub(super) fn step_auto(model: &mut Model, now: Duration) {
    if !model.settings.auto || !model.link.down(now).carries() {
        return;
    }
    let is_live = model.vehicle.boot.is_identified() && !model.vehicle.boot.is_simulated();
    if model.auto_step != AutoStep::Done && is_live {
        let why = "the vehicle is live: it does not report that it is simulated";
        model.error(now, format!("automatic mode refused: {why}"));
        model.auto_step = AutoStep::Done;
        model.outcome.refusal = Some((format!("the automatic mode: {why}"), now));
        return;
    }
    let armed = model.vehicle.is_armed();
    let phase = model.vehicle.phase_now();
    match model.auto_step {
        AutoStep::WaitForReady { not_before } => match phase {
            Some(TdPhase::TD_PHASE_PAD_ARMED) if armed && model.vehicle.boot.is_simulated() => {
                start_auto(model, now);
            }
            // The flight has already begun, so there is nothing to start.
            Some(phase) if phase as u32 > TdPhase::TD_PHASE_PAD_ARMED as u32 => {
                model.auto_step = AutoStep::Done;
            }
            _ => arm_if_ready(model, not_before, now),
        },
        AutoStep::WaitForArmed => {
            let ready = model.vehicle.boot.is_simulated() && model.vehicle.unfit().is_none();
            if armed && ready && phase == Some(TdPhase::TD_PHASE_PAD_ARMED) {
                start_auto(model, now);
            }
        }
        AutoStep::Started => match phase {
            Some(TdPhase::TD_PHASE_PAD_ARMED) => start_anew_if_silent(model, now),
            Some(TdPhase::TD_PHASE_PAD_IDLE) | None => {}
            Some(_) => model.auto_step = AutoStep::Done,
        },
        AutoStep::Done => {}
    }
}

/// A computer that was busy or asleep for a second holds a countdown. Its link carries again, so
/// the run goes on.
fn start_anew_if_silent(model: &mut Model, now: Duration) {
    let silent = |hold| matches!(hold, TdHold::TD_HOLD_UPLINK_SILENT | TdHold::TD_HOLD_STATION_DEAF);
    let held = model.vehicle.status.as_ref().is_some_and(|status| silent(status.value.hold));
    let start = model.commands.of(CommandKind::Start);
    let is_over = start.is_some_and(|track| track.is_withdrawn || track.disagrees(now));
    if held && is_over && model.vehicle.is_armed() && model.link.uplink.is_proven(now) {
        start_auto(model, now);
    }
}

fn arm_if_ready(model: &mut Model, not_before: Duration, now: Duration) {
    let why_not = why_not_ready(model, not_before, now);
    let waited = model.link.first_heartbeat_at.map_or(Duration::ZERO, |at| now.saturating_sub(at));
    let within = if model.link.shares_our_id(now) { FREE_WITHIN } else { READY_WITHIN };
    match why_not {
        None => {
            model.info(now, "automatic mode: the checks pass; arming");
            model.auto_step = AutoStep::WaitForArmed;
            submit(model, CommandKind::Arm, Seat::automatic(), now);
        }
        Some(why) if waited >= within => {
            let seconds = within.as_secs();
            model.warn(now, format!("automatic mode: gave up {seconds} s after first contact: {why}"));
            model.auto_step = AutoStep::Done;
            model.outcome.refusal = Some((format!("ARM not sent: {why}"), now));
        }
        Some(_) => {}
    }
}

fn why_not_ready(model: &Model, not_before: Duration, now: Duration) -> Option<String> {
    let Some(status) = model.vehicle.status.as_ref() else {
        return Some("the vehicle has not reported its checks".to_owned());
    };
    let simulated = model.vehicle.boot.is_simulated();
    (!simulated)
        .then(|| "the vehicle has not reported that it is simulated".to_owned())
        .or_else(|| status.is_stale(now).then(|| "the vehicle no longer reports its checks".to_owned()))
        .or_else(|| model.vehicle.why_no_go().map(|failing| format!("failing checks: {failing}")))
        .or_else(|| why_not_arm(model, now))
        .or_else(|| {
            let again = "temporarily refused, although no check fails";
            (status.received_at < not_before).then(|| again.to_owned())
        })
}

fn start_auto(model: &mut Model, now: Duration) {
    if let Some(why) = why_nothing_moves(model, now) {
        model.auto_step = AutoStep::Done;
        model.outcome.refusal = Some((format!("START not sent: {why}"), now));
        return model.warn(now, format!("automatic mode: not started: {why}"));
    }
    model.info(now, "automatic mode: starting");
    model.auto_step = AutoStep::Started;
    if model.vehicle.countdown_s().is_none() {
        submit(model, CommandKind::Start, Seat::automatic(), now);
    }
}

// Holds a countdown that this station's crew started when no commanding screen is left, or the
// station's log fails.

/// How often the hold is sent; the countdown itself shows whether it worked.
const HOLD_EVERY: Duration = Duration::from_millis(100);
/// Half of the tick period: ticks are not exact to the millisecond.
const HALF_A_TICK: Duration = Duration::from_millis(50);

/// Whether nobody can see and command the countdown. A simulated vehicle of this program endangers
/// nobody.
fn is_unattended(model: &Model, now: Duration) -> bool {
    let Settings { auto, demonstration, .. } = model.settings;
    !auto && !demonstration && model.crew.is_absent(now)
}

/// Why this station is unfit to command a countdown.
fn why_unfit(model: &Model, now: Duration) -> Option<StationHold> {
    match model.unfit_log(now) {
        _ if is_unattended(model, now) => Some(StationHold::NoScreen),
        _ if model.beside(now).is_some() && !model.boots.is_chosen(now) => Some(StationHold::TwoVehicles),
        None | Some((LogFault::Full, _)) => None,
        Some(_) => Some(StationHold::LogFails),
    }
}

pub(super) fn hold_if_unfit(model: &mut Model, now: Duration) {
    let unfit = why_unfit(model, now);
    if unfit.is_none() && counts_down(model) {
        model.crew.held_because = None;
    }
    let Some(why) = unfit.filter(|_| counts_down(model) && model.link.uplink.armed_by_us) else {
        if model.crew.hold_due.take().is_some() && !std::mem::take(&mut model.crew.too_late_reported) {
            let why = if unfit.is_some() { "the countdown has ended" } else { "its reason has ended" };
            model.info(now, format!("the hold is no longer sent: {why}"));
        }
        return;
    };
    let too_late = model.is_past_hold(now);
    if model.crew.hold_due.is_none() || (too_late && !model.crew.too_late_reported) {
        model.crew.too_late_reported = too_late;
        let what = if too_late { "TOO LATE for a hold, only an abort ends it" } else { "HOLD" };
        let text = format!("{} in the countdown: {what}", why.words());
        model.log_act(now, "hold", &Seat::default(), EventLevel::Warning, text);
        let unseen = model.crew.silence(&model.settings.seat).filter(|_| why == StationHold::NoScreen);
        model.crew.held_because = Some(unseen.unwrap_or_else(|| why.words().to_owned()));
    }
    let due = model.crew.hold_due.unwrap_or(now);
    if too_late {
        model.crew.hold_due = Some(due);
    } else if now + HALF_A_TICK >= due {
        send_once(model, CommandKind::Hold, why.parameter());
        model.crew.hold_due = Some(now + HOLD_EVERY);
    }
}

fn counts_down(model: &Model) -> bool {
    let on_pad = model.vehicle.phase_now() == Some(TdPhase::TD_PHASE_PAD_ARMED);
    on_pad && model.vehicle.countdown_s().is_some()
}

/// Sends a command once, without tracking it.
pub(super) fn send_once(model: &mut Model, kind: CommandKind, param2: f32) {
    let CommandRow { mav: (command, param1), moves, .. } = kind.row();
    model.outbox.push(Action::send(MavMessage::COMMAND_LONG(COMMAND_LONG_DATA {
        command,
        param1,
        param2,
        target_system: model.settings.vehicle.system_id,
        target_component: model.settings.vehicle.component_id,
        param7: if moves { model.vehicle.boot.parameter() } else { 0.0 },
        ..COMMAND_LONG_DATA::default()
    })));
}

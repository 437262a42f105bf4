//! The conditions of each alarm with its text, and the callouts.

use std::time::Duration;

use protocol::dialect::{
    ESTIMATOR_STATUS_DATA, EstimatorStatusFlags, MavSysStatusSensor, TD_CONTROLLER_DATA, TdCheck,
    TdControlLevel, TdInterlock, TdPhase,
};
use protocol::identity::Address;

use crate::model::{
    Acknowledgement, Action, AlarmKind, Amount, Approach, CommandKind, Condition, Danger, Ending, KeepAway,
    LinkState, LogStanding, Model, OWN_POSITION_OLD, PadCheck, Page, RED_AFTER, Sample,
    dead_reckoning::may_have_left, field, foreign_name, hold_words, is_on_pad, latch_words, refused_frames,
    sender_words, why_no_go, words,
};

/// An abort without an answer raises an alarm after this time.
const UNANSWERED_FOR: Duration = Duration::from_secs(1);
/// How long the stabiliser may fly after ignition, until the first plan is used, without an alarm.
const FIRST_PLAN_WITHIN: Duration = Duration::from_millis(300);
/// Six minutes of the simulated vehicle, and where the voltage of lithium-polymer cells begins to
/// fall steeply.
const BATTERY_LOW_PERCENT: u8 = 10;
/// How long a command that nothing was sent for holds as an alarm condition.
const NOTHING_SENT_SHOWN: Duration = Duration::from_secs(10);
/// How long a reboot holds as an alarm condition.
const REBOOT_SHOWN: Duration = Duration::from_secs(10);

/// An alarm: its kind, its urgency, whether it belongs to one boot of the vehicle and ends with it,
/// and its text while its condition holds.
struct AlarmRow {
    kind: AlarmKind,
    urgency: u8,
    ends_with_boot: bool,
    holds: fn(&Model, Duration) -> Option<String>,
}

// Urgency, which decides which alarm hides another: an abort that does not work, then the identity
// of station and vehicle, then the vehicle, then everything else.
const ABORT: u8 = 3;
const WHO: u8 = 2;
const VEHICLE: u8 = 1;
const OTHER: u8 = 0;

const fn of_run(kind: AlarmKind, urgency: u8, holds: fn(&Model, Duration) -> Option<String>) -> AlarmRow {
    AlarmRow { kind, urgency, ends_with_boot: false, holds }
}

const fn of_boot(kind: AlarmKind, urgency: u8, holds: fn(&Model, Duration) -> Option<String>) -> AlarmRow {
    AlarmRow { kind, urgency, ends_with_boot: true, holds }
}

/// The alarms of the station, its link and its log. A silent station is no evidence about the link.
const OF_STATION: [AlarmRow; 15] = [
    of_run(AlarmKind::NothingSent, ABORT, |model, now| {
        model.nothing_sent_at.filter(|at| now.saturating_sub(*at) < NOTHING_SENT_SHOWN)?;
        Some(format!("NOTHING WAS SENT: {}", model.settings.role.why_not_command()?))
    }),
    of_run(AlarmKind::StationSilent, WHO, |model, now| {
        let gone = "STATION GONE: this screen shows the past and commands nothing (q leaves)";
        let silent = "STATION SILENT: it does not answer this screen, which shows the past";
        let silence = model.link.station_silence(now).map(|_| silent.to_owned());
        if model.link.station_lost { Some(gone.to_owned()) } else { silence }
    }),
    of_boot(AlarmKind::Unanswered(CommandKind::Abort), ABORT, |model, now| {
        model.link.why_abort_not_sent(now).map(|why| format!("ABORT NOT SENT: {why}"))
    }),
    of_run(AlarmKind::TwoVehicles, WHO, |model, now| {
        let (id, other) = (model.settings.vehicle.system_id, model.beside(now)?);
        let chosen = model.boots.is_chosen(now);
        let what =
            if chosen { "the shown one was chosen" } else { "nothing is armed or started: switch one off" };
        Some(format!("TWO VEHICLES under id {id}: also {other}; {what}"))
    }),
    of_run(AlarmKind::Foreign, WHO, |model, now| {
        let version =
            "ANOTHER VERSION: the vehicle's messages do not fit this station's; use one version on both";
        let named = |beat| format!("NOT A TOUCHDOWN VEHICLE: {}", foreign_name(beat));
        let foreign = model.vehicle.as_foreign().map(named);
        let foreign = foreign.or_else(|| model.speaks_another_version(now).then(|| version.to_owned()));
        foreign.filter(|_| model.beside(now).is_none())
    }),
    of_run(AlarmKind::SameId, WHO, |model, now| {
        let Address { system_id, component_id } = model.settings.us;
        let what = "nothing is armed or started; give it another (--sysid)";
        let shares = model.link.shares_our_id(now);
        shares.then(|| format!("another station uses our id {system_id}/{component_id}: {what}"))
    }),
    of_boot(AlarmKind::OtherStation(CommandKind::Arm), WHO, |model, _| {
        other_station(model).map(|which| format!("ARMED BY {which}, not by us"))
    }),
    of_boot(AlarmKind::OtherStation(CommandKind::Start), WHO, |model, _| {
        let which = other_station(model).filter(|_| model.vehicle.counts_down())?;
        Some(format!("STARTED BY {which}: hold or abort"))
    }),
    of_run(AlarmKind::LinkLost, VEHICLE, |model, now| {
        let is_lost = matches!(model.link.state(model.link.valid_until(now)), LinkState::Lost(_));
        is_lost.then(|| "LINK LOST: no telemetry".to_owned())
    }),
    of_run(AlarmKind::UplinkLost, VEHICLE, |model, now| {
        let why = || model.link.uplink.why_unproven();
        let is_lost = is_uplink_lost(model, model.link.valid_until(now));
        is_lost.then(|| format!("UPLINK LOST: the vehicle does not receive this station; {}", why()))
    }),
    of_boot(AlarmKind::MayBeFlying, WHO, |model, now| {
        may_have_left(&model.vehicle, model.link.valid_until(now))?;
        let left_s = model.vehicle.countdown_s().map_or(0.0, |left| left.value);
        Some(format!("MAY BE IN THE AIR: no telemetry since T-{left_s:.1} s"))
    }),
    of_run(AlarmKind::Signatures, VEHICLE, |model, now| refused_frames(model, model.link.valid_until(now))),
    of_run(AlarmKind::LinkDown, VEHICLE, |model, _| {
        model.link.trouble.as_ref().map(|why| format!("LINK DOWN: {why}"))
    }),
    of_boot(AlarmKind::AbortBefore, ABORT, |model, _| {
        model.abort_before.as_ref().map(|at| format!("ABORT requested at {at} NOT CONFIRMED: abort again?"))
    }),
    of_run(AlarmKind::Log, OTHER, |model, now| match model.station_log(model.link.valid_until(now)) {
        LogStanding::Unfit(_, words) | LogStanding::Warned(words) => Some(format!("STATION LOG {words}")),
        LogStanding::None | LogStanding::Fine => None,
    }),
];

/// The alarms of the vehicle.
const OF_VEHICLE: [AlarmRow; 15] = [
    of_boot(AlarmKind::CrowdLine, VEHICLE, |model, _| field::crowd_inside_fence(model)),
    of_run(AlarmKind::Rebooted, VEHICLE, |model, now| {
        let shown = |at: Duration| now.saturating_sub(at) < REBOOT_SHOWN || model.vehicle.reset_in_flight;
        let (did, _) = model.rebooted.filter(|(_, at)| shown(*at))?;
        Some(format!("the vehicle has REBOOTED{did}"))
    }),
    of_boot(AlarmKind::LiveMotor, VEHICLE, |model, now| {
        let away = KeepAway::of(&model.vehicle, now)?;
        matches!(away.danger, Danger::Live | Danger::LiveWaited).then(|| away.sentence())
    }),
    of_boot(AlarmKind::Held, VEHICLE, |model, _| hold_words(model)),
    of_boot(AlarmKind::Unfit, VEHICLE, |model, _| {
        model.vehicle.unfit_while_armed().map(|(_, words)| format!("ARMED, and NO-GO: {words}"))
    }),
    of_boot(AlarmKind::Battery, OTHER, |model, _| battery(model)),
    of_boot(AlarmKind::VehicleLog, OTHER, |model, _| vehicle_log(model)),
    of_boot(AlarmKind::Position, OTHER, |model, _| position(model)),
    // The arming checks cover less than a check on the pad.
    of_boot(AlarmKind::CheckFailed, OTHER, |model, _| {
        let on_pad = [TdPhase::TD_PHASE_PAD_IDLE, TdPhase::TD_PHASE_PAD_ARMED].map(Some);
        let check = model.vehicle.pad_check.as_ref().filter(|_| on_pad.contains(&model.vehicle.phase_now()));
        check.and_then(PadCheck::failure)
    }),
    of_boot(AlarmKind::Aborted, VEHICLE, |model, _| latch_words(model)),
    of_boot(AlarmKind::NoLight, VEHICLE, |model, _| {
        let no_light = model.vehicle.shows(TdInterlock::TD_INTERLOCK_NO_LIGHT);
        no_light.then(|| "NO LIGHT: the motor did not ignite".to_owned())
    }),
    of_boot(AlarmKind::NotLanded, OTHER, |model, now| {
        let ending = Ending::of(&model.vehicle, now).filter(|ending| *ending != Ending::Stands)?;
        Some(ending.sentence(&model.vehicle))
    }),
    of_boot(AlarmKind::DeadlineMissed, OTHER, |model, now| {
        let missed = controller(model, now)?.deadline_margin_us < 0;
        missed.then(|| "controller DEADLINE MISSED".to_owned())
    }),
    of_boot(AlarmKind::Degraded, OTHER, |model, now| {
        let upright = controller(model, now)?.level == TdControlLevel::TD_CONTROL_LEVEL_STABILISER;
        let burn_at = model.history.timeline.last().map_or(Duration::ZERO, |(_, at)| *at);
        let is_late = now.saturating_sub(burn_at) >= FIRST_PLAN_WITHIN;
        (upright && is_late).then(|| "DEGRADED: the stabiliser flies".to_owned())
    }),
    of_boot(AlarmKind::PlanOutside, OTHER, |model, _| {
        let prediction = model.vehicle.prediction.filter(|_| burns(model))?;
        prediction.value.touchdown.violations().map(|names| format!("plan ends OUTSIDE {names}"))
    }),
];

/// Compares the present conditions with the alarms, rings the bell and reports new alarms.
pub(super) fn watch(model: &mut Model, now: Duration) {
    let held = |row: &AlarmRow| {
        let AlarmRow { kind, urgency, ends_with_boot, holds } = *row;
        holds(model, now).map(|text| Condition { kind, urgency, ends_with_boot, text })
    };
    let mut conditions: Vec<Condition> = OF_STATION.iter().filter_map(held).collect();
    command_conditions(model, now, &mut conditions);
    conditions.extend(OF_VEHICLE.iter().filter_map(held));
    let raised = model.alarms.watch(now, conditions);
    if model.alarms.rings(now, !raised.is_empty()) {
        model.outbox.push(Action::Bell);
    }
    for alarm in raised {
        // Also an event for runs without a screen; other alarms have an event of their own.
        if alarm.what.urgency == WHO || alarm.what.kind == AlarmKind::UplinkLost {
            model.error(now, alarm.what.text.clone());
        }
        model.outbox.push(Action::Alarm(alarm.what.text));
    }
}

/// The station that armed the vehicle, if it may not be of this crew. Operators are identified by
/// their keys.
fn other_station(model: &Model) -> Option<String> {
    let Address { system_id, component_id } = model.link.uplink.unproven(model.link.signing.is_some())?;
    let is_anonymous = model.vehicle.is_armed() && model.people().is_none();
    is_anonymous.then(|| sender_words(model, &format!("{system_id}/{component_id}")))
}

/// Whether telemetry arrives and shows that the vehicle does not receive this station.
fn is_uplink_lost(model: &Model, now: Duration) -> bool {
    // A report from before a silence is out of date: the vehicle has this long to send another.
    let received_for = model.link.alive_since.map_or(Duration::ZERO, |at| now.saturating_sub(at));
    let silent = !model.link.uplink.state(now).carries() && received_for > RED_AFTER;
    // While nothing is received, an alarm that holds stays.
    let may_judge = match model.link.state(now) {
        LinkState::Alive(_) => true,
        LinkState::Doubtful(_) => {
            let mut alarms = model.alarms.list().iter();
            alarms.any(|alarm| alarm.what.kind == AlarmKind::UplinkLost && alarm.is_active())
        }
        LinkState::NeverReceived | LinkState::Lost(_) => false,
    };
    // Another autopilot owes us no report.
    silent && may_judge && model.vehicle.as_foreign().is_none()
}

fn command_conditions(model: &Model, now: Duration, found: &mut Vec<Condition>) {
    for track in &model.commands.tracks {
        let name = track.kind.row().name;
        let persists = track.kind.row().resend.is_persistent();
        let urgency = match track.kind {
            CommandKind::Abort => ABORT,
            _ if persists => VEHICLE,
            _ => OTHER,
        };
        let mut hold = |kind, text| found.push(Condition { kind, urgency, ends_with_boot: true, text });
        if track.disagrees(now) {
            hold(AlarmKind::Disagreement(track.kind), format!("{name} acknowledged, NOT OBSERVED"));
        }
        let gave_up = track.acknowledged == Acknowledgement::GivenUp;
        let waits = match track.kind {
            CommandKind::Abort => gave_up || track.acknowledged == Acknowledgement::Waiting,
            _ => track.acknowledged == Acknowledgement::Waiting && track.observed_at.is_none(),
        };
        let waited = now.saturating_sub(track.commanded_at);
        if persists && waits && waited >= UNANSWERED_FOR {
            hold(AlarmKind::Unanswered(track.kind), format!("{name} NOT ACKNOWLEDGED yet; repeated"));
        } else if gave_up && !track.not_observed_reported {
            hold(AlarmKind::Unanswered(track.kind), format!("{name} was never acknowledged"));
        }
        if matches!(track.acknowledged, Acknowledgement::Answered(_)) && !track.accepted() {
            hold(AlarmKind::Refused(track.kind), format!("{name} REFUSED by the vehicle"));
        }
    }
}

/// Whether the landing motor burns, and the flight has no verdict yet.
fn burns(model: &Model) -> bool {
    model.vehicle.phase_now() == Some(TdPhase::TD_PHASE_POWERED) && model.vehicle.verdict().is_none()
}

/// The controller's state under thrust.
fn controller(model: &Model, now: Duration) -> Option<TD_CONTROLLER_DATA> {
    let controller = model.vehicle.last().filter(|controller| burns(model) && !controller.is_stale(now));
    controller.map(|controller| controller.value)
}

/// A battery below the vehicle's limit, reported on its pad; or nearly empty, anywhere.
fn battery(model: &Model) -> Option<String> {
    let battery = model.vehicle.battery()?.value;
    let refuses = fails(model, TdCheck::TD_CHECK_BATTERY);
    let empty = battery.percent.is_some_and(|percent| percent <= BATTERY_LOW_PERCENT);
    // A charge above half is an estimate that the voltage contradicts.
    let left = battery.percent.filter(|percent| *percent <= 50);
    let left = left.map_or_else(String::new, |percent| format!(", {percent} % left"));
    let volts = model.vehicle.volts()?;
    (refuses || empty).then(|| format!("BATTERY LOW: {volts}{left}"))
}

/// A position without satellites drifts. On the pad it is a failing check. On the way up it is
/// normal: no receiver holds its fix in a boost, and some need seconds to find it again.
fn position(model: &Model) -> Option<String> {
    model.vehicle.left_pad_at?;
    if matches!(model.vehicle.phase_now(), Some(TdPhase::TD_PHASE_BOOST | TdPhase::TD_PHASE_COAST)) {
        return None;
    }
    let is_unknown = |Sample { value, .. }: Sample<ESTIMATOR_STATUS_DATA>| {
        !value.flags.contains(EstimatorStatusFlags::ESTIMATOR_POS_HORIZ_ABS)
    };
    let lost = if model.vehicle.is_unhealthy(MavSysStatusSensor::MAV_SYS_STATUS_SENSOR_GPS) {
        "GNSS"
    } else {
        model.vehicle.last().is_some_and(is_unknown).then_some("POSITION")?
    };
    Some(format!("{lost} LOST: the position may be off by {:.0} m", model.position_error_m()))
}

/// Before the self-test is over a log may still be about to begin.
fn vehicle_log(model: &Model) -> Option<String> {
    let phase = model.vehicle.phase_now().filter(|phase| *phase != TdPhase::TD_PHASE_SAFE)?;
    if !is_on_pad(phase) {
        let words = "VEHICLE LOG has stopped: this flight is not recorded completely";
        return model.vehicle.log_has_stopped().then(|| words.to_owned());
    }
    if fails(model, TdCheck::TD_CHECK_LOG) {
        return Some("VEHICLE LOG not running".to_owned());
    }
    let space =
        model.vehicle.log_space_mib().map_or_else(String::new, |space| format!(": {:.0} MiB", space.value));
    fails(model, TdCheck::TD_CHECK_LOG_SPACE).then(|| format!("VEHICLE LOG has too little space{space}"))
}

/// Whether the vehicle reports that it fails this check; it reports so on its pad only.
fn fails(model: &Model, check: TdCheck) -> bool {
    model.vehicle.reports(|status| status.checks_failed.contains(check))
}

// Callouts: a line of text to the crew's voice command, or bells without one.

/// Heights are called out in these steps, m: above the limit, and below it.
const HIGH_STEP_M: f64 = 50.0;
const LOW_STEP_M: f64 = 10.0;
const LOW_BELOW_M: f64 = 50.0;
/// How often the way to a vehicle is called out.
const WAY_EVERY: Duration = Duration::from_secs(10);
/// Bells of a callout without a voice: for an event, for an event to watch, for something wrong.
const EVENT: u8 = 1;
const WATCH: u8 = 2;
const WRONG: u8 = 3;

/// The amount from which it is called out, its words, and its bells. It is repeated when the words
/// before a colon change.
type Callout = (Amount, String, u8);
type Present = fn(&Model, Duration) -> Option<Callout>;

/// A state is called out when it changes, and persists while it is unknown; anything else is called
/// out as soon as it holds.
const STATE: bool = true;
const ONCE: bool = false;

/// The callouts but for phases and heights.
const CALLOUTS: [(bool, Present); 5] = [
    (ONCE, |model, _| {
        let lifts = model.vehicle.has_lifted() && model.vehicle.phase_now() == Some(TdPhase::TD_PHASE_BOOST);
        lifts.then(|| (Amount::Few, "liftoff".to_owned(), WATCH))
    }),
    // On the pad, once the vehicle has reported its checks.
    (STATE, |model, now| {
        let status = model.vehicle.status.as_ref().filter(|status| !status.is_stale(now));
        status.filter(|status| is_on_pad(status.value.phase))?;
        let no_go = |why| (Amount::Few, format!("no go: {why}"), WRONG);
        Some(why_no_go(model, now).map_or_else(|| (Amount::Normal, "go".to_owned(), 0), no_go))
    }),
    // The alarm of the lost link rings by itself.
    (STATE, |model, now| match model.link.state(model.link.valid_until(now)) {
        LinkState::Lost(_) => Some((Amount::Few, "link lost".to_owned(), 0)),
        _ => Some((Amount::Normal, "link restored".to_owned(), 0)),
    }),
    (ONCE, |model, now| {
        let ending = Ending::of(&model.vehicle, now)?;
        let bells = if ending == Ending::Stands { EVENT } else { WRONG };
        Some((Amount::Few, ending.word().to_lowercase(), bells))
    }),
    (ONCE, |model, now| {
        let approach = Approach::of(&model.vehicle, now)?;
        Some((Amount::Few, approach.headline().to_lowercase(), EVENT))
    }),
];

/// Compares the present state with the last callouts.
pub(super) fn call_out(model: &mut Model, now: Duration) {
    call_phase(model);
    call_height(model, now);
    call_way(model, now);
    for (place, (is_state, present)) in CALLOUTS.into_iter().enumerate() {
        let present = present(model, now);
        let about = present.as_ref().and_then(|(_, words, _)| words.split(':').next()).map(str::to_owned);
        let called = &mut model.called.rows[place];
        if *called == about || (is_state && about.is_none()) {
            continue;
        }
        let before = std::mem::replace(called, about);
        if let Some((amount, words, bells)) = present.filter(|_| !is_state || before.is_some()) {
            call(model, amount, words, bells);
        }
    }
}

fn call(model: &mut Model, amount: Amount, text: impl Into<String>, bells: u8) {
    let talk = model.settings.talk;
    // A screen that attaches late receives the history, and does not call it out.
    if amount > talk.amount || model.alarms.in_history {
        return;
    }
    if talk.has_voice {
        model.outbox.push(Action::CallOut(text.into()));
    } else if amount == Amount::Few {
        model.called.bells_left = model.called.bells_left.max(bells);
    }
}

fn call_phase(model: &mut Model) {
    let Some(phase) = model.vehicle.phase_now() else { return };
    let Some(before) = model.called.phase.replace(phase).filter(|before| *before != phase) else { return };
    let climbed = matches!(before, TdPhase::TD_PHASE_BOOST | TdPhase::TD_PHASE_COAST);
    match phase {
        TdPhase::TD_PHASE_BOOST => call(model, Amount::Normal, "ignition commanded", 0),
        TdPhase::TD_PHASE_CHUTE => call(model, Amount::Few, "parachute", WRONG),
        TdPhase::TD_PHASE_IGNITION => call(model, Amount::Few, "ignition", WATCH),
        TdPhase::TD_PHASE_TOUCHDOWN => call(model, Amount::Few, "touchdown", WATCH),
        TdPhase::TD_PHASE_DEPLOY | TdPhase::TD_PHASE_AERO_DESCENT if climbed => {
            call(model, Amount::Few, "apogee", EVENT);
        }
        other => call(model, Amount::Normal, words::phase(other).to_lowercase().replace('_', " "), 0),
    }
    if is_on_pad(phase) {
        model.called.height_m = None;
    }
}

/// Calls out the way to what page Find shows, while it shows it.
fn call_way(model: &mut Model, now: Duration) {
    let waits = model.called.way_at.is_some_and(|at| now.saturating_sub(at) < WAY_EVERY);
    let Some(here) = model.here.filter(|_| model.page() == Page::Find && !waits) else { return };
    let Some(place) = model.sought(now).filter(|_| !model.vehicle.in_flight()) else { return };
    let way = place.way(&place.best(), Some(here.value));
    let words = if here.age(now) > OWN_POSITION_OLD {
        format!("own position {} seconds old", here.age(now).as_secs())
    } else {
        format!("bearing {}, {:.0} metres", way.compass(), way.distance_m)
    };
    model.called.way_at = Some(now);
    call(model, Amount::Normal, words, 0);
}

/// Calls out the last step of the height that was passed.
fn call_height(model: &mut Model, now: Duration) {
    let fresh = model.vehicle.height_m().filter(|height| !height.is_stale(now) && height.value.is_finite());
    let Some(height) = fresh.filter(|_| model.vehicle.in_flight()) else { return };
    let height_m = height.value;
    let Some(before_m) = model.called.height_m.replace(height_m) else { return };
    let low = height_m.min(before_m) < LOW_BELOW_M;
    let (step_m, amount) = if low { (LOW_STEP_M, Amount::All) } else { (HIGH_STEP_M, Amount::Normal) };
    let steps_below = |height_m: f64| libm::floor(height_m / step_m) as i64;
    if steps_below(before_m) == steps_below(height_m) {
        return;
    }
    let passed_m =
        if height_m > before_m { libm::floor(height_m / step_m) } else { libm::ceil(height_m / step_m) };
    let passed_m = passed_m * step_m;
    // 50 m is a step of both.
    let amount = if passed_m % HIGH_STEP_M == 0.0 { Amount::Normal } else { amount };
    let wait = model.settings.talk.height_every;
    let waits = model.called.height_at.is_some_and(|at| now.saturating_sub(at) < wait);
    if passed_m > 0.0 && !waits && amount <= model.settings.talk.amount {
        model.called.height_at = Some(now);
        call(model, amount, format!("{passed_m:.0} metres"), 0);
    }
}

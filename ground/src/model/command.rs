//! Commands and their three separate facts: commanded, acknowledged, observed. And whether the
//! ground may give them.

use std::time::Duration;

use protocol::command::{CommandSender, Resend, Ticket};
use protocol::dialect::{MavCmd, MavResult, TdAct, TdInterlock, TdPhase};
use protocol::identity::Address;
use serde::{Deserialize, Serialize};
use strum::VariantArray;

use super::{
    EXPIRES_AFTER, FlownMission, LinkState, Model, PadCheck, Prompt, Proposal, RED_AFTER, Seat, Settings,
    Vehicle, field, foreign_name, is_on_pad, words,
};

/// The effect of an accepted command should show in the vehicle's state within this time: a little
/// over two heartbeats.
pub const OBSERVE_WITHIN: Duration = Duration::from_millis(2_500);

/// A command that the crew can give.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, VariantArray)]
pub enum CommandKind {
    Arm,
    Disarm,
    Start,
    Abort,
    /// Confirm another operator's request.
    ConfirmArm,
    ConfirmStart,
    /// Hold the countdown.
    Hold,
    /// Whoever confirmed the start is still there.
    Tap,
    /// Take command from a station that is silent.
    TakeCommand,
    /// Check the vehicle on its pad; gimbal and fins move.
    Check,
    /// The same without motion.
    CheckStill,
    /// End the running check.
    EndCheck,
    /// One person has seen every surface of the last check move as its page says.
    Seen,
}

/// A command as a row of their table.
pub struct CommandRow {
    /// The name on screens and in the log.
    pub name: &'static str,
    /// The MAVLink command and its first parameter.
    pub mav: (MavCmd, f32),
    /// Whether it can move or ignite anything: then it names the boot it is addressed to, and is
    /// sent only to the shown vehicle.
    pub(crate) moves: bool,
    /// How often the command is resent.
    pub(crate) resend: Resend,
    /// Evidence of the effect in the vehicle's state, for the event "observed"; `None` if the
    /// answer is the only evidence.
    pub(crate) seen: Option<&'static str>,
}

impl CommandKind {
    pub const ALL: &'static [Self] = Self::VARIANTS;

    /// What a command is, but for when it may be given. A repetition has the number of the command,
    /// and the vehicle executes it once: a late one arms nothing that was disarmed since. A tap is
    /// valid for a moment only. A check is not repeated either: it would move a surface that a
    /// person has just touched.
    pub fn row(self) -> CommandRow {
        use MavCmd::{
            MAV_CMD_COMPONENT_ARM_DISARM as ARM, MAV_CMD_DO_FLIGHTTERMINATION as TERMINATE,
            MAV_CMD_DO_PAUSE_CONTINUE as PAUSE, MAV_CMD_MISSION_START as START,
            MAV_CMD_TD_PAD_CHECK as CHECK, MAV_CMD_TD_TAKE_COMMAND as TAKE, MAV_CMD_TD_TAP as TAP,
        };
        use Resend::{Never, Times, UntilAnswered, UntilWithdrawn};
        let row = |name, mav, moves, resend, seen| CommandRow { name, mav, moves, resend, seen };
        match self {
            Self::Arm => row("ARM", (ARM, 1.0), true, Times(4), Some("HEARTBEAT armed")),
            Self::Disarm => row("DISARM", (ARM, 0.0), false, UntilAnswered, Some("HEARTBEAT disarmed")),
            Self::Start => row("START", (START, 0.0), true, Times(4), Some("countdown runs")),
            Self::Abort => row("ABORT", (TERMINATE, 1.0), false, UntilWithdrawn, Some("abort latched")),
            Self::ConfirmArm => row("CONFIRM ARM", (ARM, 1.0), true, Times(4), Some("HEARTBEAT armed")),
            Self::ConfirmStart => row("CONFIRM START", (START, 0.0), true, Times(4), Some("countdown runs")),
            Self::Hold => row("HOLD", (PAUSE, 0.0), false, UntilAnswered, Some("no countdown")),
            Self::Tap => row("TAP", (TAP, 0.0), true, Never, None),
            Self::TakeCommand => row("TAKE COMMAND", (TAKE, 0.0), true, Times(3), None),
            Self::Check => row("CHECK", (CHECK, 1.0), true, Never, None),
            Self::CheckStill => row("CHECK WITHOUT MOTION", (CHECK, 2.0), true, Never, None),
            Self::EndCheck => row("END OF CHECK", (CHECK, 0.0), false, Times(3), None),
            Self::Seen => row("SEEN", (CHECK, 3.0), true, Never, None),
        }
    }

    /// Whether only the owner of the station's key may give it; anyone may stop something.
    pub fn needs_the_owner(self) -> bool {
        !matches!(self, Self::Hold | Self::Abort | Self::EndCheck)
    }

    /// Whether the vehicle's own state, received after `since`, shows the command's effect.
    pub fn is_observed(self, vehicle: &Vehicle, since: Duration) -> bool {
        let heartbeat = vehicle.heartbeat.filter(|heartbeat| heartbeat.received_at >= since);
        let status = vehicle.status.as_ref().filter(|status| status.received_at >= since);
        match self {
            Self::Arm | Self::ConfirmArm => heartbeat.is_some_and(|heartbeat| heartbeat.value.armed),
            Self::Disarm => heartbeat.is_some_and(|heartbeat| !heartbeat.value.armed),
            Self::Start | Self::ConfirmStart => status.is_some_and(|status| {
                let counting = status.value.countdown_ms != i32::MAX;
                counting || status.value.phase as u32 > TdPhase::TD_PHASE_PAD_ARMED as u32
            }),
            Self::Hold => status.is_some_and(|status| status.value.countdown_ms == i32::MAX),
            // Only the latch counts: the stabiliser may also fly, and show DEGRADED, without an
            // abort.
            Self::Abort => {
                let latched = TdInterlock::TD_INTERLOCK_ABORT_LATCHED;
                heartbeat.is_some_and(|heartbeat| heartbeat.value.terminated)
                    || status.is_some_and(|status| status.value.interlocks.contains(latched))
            }
            // The answer is the only evidence.
            _ => false,
        }
    }

    /// Whether the vehicle's own state, on its pad, shows that an effect that was observed is no
    /// longer so, in words.
    pub fn no_longer(self, vehicle: &Vehicle, since: Duration) -> Option<&'static str> {
        let heartbeat = vehicle.heartbeat.filter(|heartbeat| heartbeat.received_at > since)?.value;
        let status = vehicle.status.as_ref().filter(|status| status.received_at > since)?;
        let on_pad = is_on_pad(status.value.phase);
        match self {
            Self::Arm | Self::ConfirmArm if on_pad && !heartbeat.armed => Some("HEARTBEAT disarmed"),
            Self::Start | Self::ConfirmStart if on_pad && status.value.countdown_ms == i32::MAX => {
                Some("no countdown runs")
            }
            _ => None,
        }
    }
}

/// Whether the interlocks show an abort, on the pad, in the air or under thrust.
pub fn is_aborted(interlocks: TdInterlock) -> bool {
    interlocks.contains(TdInterlock::TD_INTERLOCK_ABORT_LATCHED)
}

/// The vehicle's answer to a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Acknowledgement {
    Waiting,
    /// The vehicle is executing the command.
    InProgress,
    /// Accepted by the vehicle as a request that a second person has to confirm.
    Proposed,
    /// Answered with this `MAV_RESULT`.
    Answered(u8),
    /// No answer came, and none is expected any more.
    GivenUp,
}

/// One command with its three facts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TrackedCommand {
    pub kind: CommandKind,
    /// Who gave the command, and from which screen.
    pub by: Seat,
    /// When it was commanded.
    pub commanded_at: Duration,
    /// How many times it was sent.
    pub attempts: u32,
    /// The vehicle's answer to a command.
    pub acknowledged: Acknowledgement,
    pub acknowledged_at: Option<Duration>,
    /// When the vehicle's own state first showed the effect.
    pub observed_at: Option<Duration>,
    /// The vehicle's own state shows the effect no longer.
    pub is_withdrawn: bool,
    pub(crate) ticket: Ticket,
    pub(crate) not_observed_reported: bool,
}

impl TrackedCommand {
    pub fn accepted(&self) -> bool {
        self.acknowledged == Acknowledgement::Answered(MavResult::MAV_RESULT_ACCEPTED as u8)
    }

    /// Whether it was refused finally, or accepted and observed.
    pub(crate) fn is_confirmed(&self) -> bool {
        let answered = matches!(self.acknowledged, Acknowledgement::Answered(_));
        answered && (self.observed_at.is_some() || !self.accepted())
    }

    /// Commanded, and neither refused nor given up nor observed.
    pub fn is_on_its_way(&self, now: Duration) -> bool {
        let open = matches!(self.acknowledged, Acknowledgement::Waiting | Acknowledgement::InProgress);
        self.observed_at.is_none()
            && !self.is_withdrawn
            && (open || (self.accepted() && !self.disagrees(now)))
    }

    /// Accepted, but the vehicle's state does not show the effect in time.
    pub fn disagrees(&self, now: Duration) -> bool {
        self.accepted()
            && self.observed_at.is_none()
            && !self.is_withdrawn
            && self.acknowledged_at.is_some_and(|at| now.saturating_sub(at) >= OBSERVE_WITHIN)
    }
}

/// The latest command of each kind.
#[derive(Debug, Default)]
pub struct Commands {
    pub(crate) sender: CommandSender,
    /// In the order in which they were given.
    pub tracks: Vec<TrackedCommand>,
}

impl Commands {
    /// The latest command of a kind.
    pub fn of(&self, kind: CommandKind) -> Option<&TrackedCommand> {
        self.tracks.iter().find(|track| track.kind == kind)
    }

    /// Whether an abort is still being sent.
    pub fn is_aborting(&self) -> bool {
        self.sender.is_pending(CommandKind::Abort.row().mav.0)
    }
}

// Whether the ground may command to arm and to start.

/// Why no command that moves anything is sent now: it is not certain which vehicle would receive
/// it, or which station the vehicle obeys.
pub fn why_nothing_moves(model: &Model, now: Duration) -> Option<String> {
    let Settings { us, vehicle: of, .. } = &model.settings;
    let vehicle = &model.vehicle;
    let Address { system_id, component_id } = us;
    Some(match vehicle.foreign.as_ref() {
        _ if model.beside(now).is_some() && !model.boots.is_chosen(now) => {
            format!("TWO VEHICLES under id {}: switch one off", of.system_id)
        }
        Some(foreign) if foreign.age(now) < EXPIRES_AFTER => {
            format!("not a Touchdown vehicle: {}", foreign_name(foreign))
        }
        _ if vehicle.status.is_none() => {
            "the vehicle is not identified: it has sent no flight status".to_owned()
        }
        _ if model.link.shares_our_id(now) => {
            format!("another station uses our id {system_id}/{component_id}: give one another --sysid")
        }
        _ => return None,
    })
}

/// Why no command reaches the intended vehicle: it is silent, its telemetry arrives late, or no
/// command may be sent.
pub fn why_not_reached(model: &Model, now: Duration) -> Option<String> {
    if !model.link.state(now).carries() {
        return Some("no telemetry from the vehicle".to_owned());
    }
    let LinkState::Lost(age) = model.link.down(now) else { return why_nothing_moves(model, now) };
    let (age_s, most_s) = (age.as_secs_f64(), RED_AFTER.as_secs());
    Some(format!("the newest telemetry is {age_s:.1} s old, at most {most_s} s is accepted"))
}

/// Why this seat does not act with the station's key. Anyone may hold and abort.
pub fn why_not_seat(model: &Model, by: &Seat) -> Option<String> {
    let owner = model.settings.key_owner.as_ref()?;
    let is_theirs = by.operator == owner.name || *by == Seat::automatic();
    let name = &owner.name;
    (!is_theirs).then(|| {
        format!("this station signs as {name}: only a screen of {name} does that (anyone may hold or abort)")
    })
}

/// Why the person at this screen commands nothing but a hold and an abort; `None` if they may more.
pub fn why_not_here(model: &Model) -> Option<String> {
    let by_role = model.settings.role.why_not_command().map(str::to_owned);
    by_role.or_else(|| why_not_seat(model, &model.settings.seat)).or_else(|| why_no_key(model))
}

/// Why the ground does not command to arm. Failing checks are left for the vehicle to refuse, with
/// its text.
pub fn why_not_arm(model: &Model, now: Duration) -> Option<String> {
    let uplink = &model.link.uplink;
    why_not_reached(model, now)
        .or_else(|| {
            let by = uplink.armed_by_other.map(|by| format!(", by {}/{}", by.system_id, by.component_id));
            model.vehicle.is_armed().then(|| format!("armed already{}", by.unwrap_or_default()))
        })
        .or_else(|| model.vehicle.wait_before(now).map(|away| format!("do not approach{}", away.reason())))
        .or_else(|| {
            (!uplink.is_proven(now)).then(|| format!("the uplink is not proven: {}", uplink.why_unproven()))
        })
        .or_else(|| why_no_key(model))
        .or_else(|| why_other_mission(model))
        .or_else(|| field::crowd_inside_fence(model))
        .or_else(|| model.why_checklist(now))
        .or_else(|| why_not_in(model, is_on_pad))
        // Last: the crew can overrule these two, each by its word.
        .or_else(|| why_untested(model))
        .or_else(|| model.why_no_log(now))
}

/// Why the vehicle is not ready to be armed, including its checks: the NO-GO of the screens and the
/// voice.
pub fn why_no_go(model: &Model, now: Duration) -> Option<String> {
    let uplink = || "uplink not proven, every other check passes".to_owned();
    why_not_reached(model, now)
        .or_else(|| model.vehicle.why_no_go())
        .or_else(|| (!model.link.uplink.is_proven(now)).then(uplink))
        .or_else(|| why_other_mission(model))
        .or_else(|| field::crowd_inside_fence(model))
        .or_else(|| model.why_checklist(now))
        .or_else(|| why_untested(model))
        .or_else(|| model.why_no_log(now))
}

/// Why a real vehicle's motor is unconfirmed: the vehicle reports no burn of its lot that confirms
/// the certified curve. `None` if one does, on a simulated vehicle, and once the crew overrules it.
pub fn why_untested(model: &Model) -> Option<String> {
    let boot = model.vehicle.boot.number();
    if model.vehicle.boot.is_simulated() || (boot.is_some() && model.untested == boot) {
        return None;
    }
    match model.vehicle.mission() {
        Some(flown) if flown.motor_burns > 0 => None,
        Some(_) => Some("motor UNCONFIRMED: no burn of its lot".to_owned()),
        None => Some("motor not known: no mission reported yet".to_owned()),
    }
}

/// The dialog by which the crew overrules this reason, if it may.
pub fn overruled_by(model: &Model, why: &str, now: Duration) -> Option<Prompt> {
    let is = |reason: Option<String>| reason.as_deref() == Some(why);
    if is(why_untested(model)) {
        return Some(Prompt::Untested);
    }
    is(model.why_no_log(now)).then_some(Prompt::WithoutLog)
}

/// Why the ground does not command to start the countdown.
pub fn why_not_start(model: &Model, now: Duration) -> Option<String> {
    why_not_reached(model, now)
        .or_else(|| (!model.vehicle.is_armed()).then(|| "not armed".to_owned()))
        .or_else(|| why_no_key(model))
        .or_else(|| why_not_in(model, |phase| phase == TdPhase::TD_PHASE_PAD_ARMED))
        .or_else(|| model.vehicle.unfit().map(|(_, words)| format!("NO-GO: {words}")))
        .or_else(|| model.why_no_log(now))
}

/// Why the phase is none of these.
fn why_not_in(model: &Model, fits: fn(TdPhase) -> bool) -> Option<String> {
    match model.vehicle.phase_now() {
        None => Some("the phase is unknown".to_owned()),
        Some(phase) => (!fits(phase)).then(|| format!("phase {}", words::phase(phase))),
    }
}

/// Why the ground does not confirm this proposal.
pub fn why_not_confirm(model: &Model, proposal: &Proposal, now: Duration) -> Option<String> {
    match model.proposal(now) {
        Some(waits) if waits.number == proposal.number && waits.act == proposal.act => {}
        _ => return Some("the request has lapsed".to_owned()),
    }
    match proposal.act {
        TdAct::TD_ACT_START => why_not_start(model, now),
        _ => why_not_arm(model, now),
    }
}

/// Why the ground requests no check of the vehicle, and tests no radio.
pub fn why_not_check(model: &Model, now: Duration) -> Option<String> {
    why_not_reached(model, now)
        .or_else(|| model.vehicle.is_armed().then(|| "armed: disarm first".to_owned()))
        .or_else(|| why_no_key(model))
        .or_else(|| why_not_in(model, is_on_pad))
}

/// Why no person can confirm here that every surface moved as it should.
pub fn why_not_seen(model: &Model, now: Duration) -> Option<String> {
    let seen = model.vehicle.pad_check.as_ref().is_some_and(PadCheck::awaits_eyes);
    why_not_check(model, now)
        .or_else(|| (!seen).then(|| "no check of servos without feedback has passed".into()))
}

/// Why the ground does not take command.
pub fn why_not_take(model: &Model, now: Duration) -> Option<String> {
    why_not_reached(model, now)
        .or_else(|| (!model.vehicle.is_armed()).then(|| "not armed".to_owned()))
        .or_else(|| model.link.uplink.armed_by_us.then(|| "this station commands already".to_owned()))
        .or_else(|| why_no_key(model))
}

/// Why a vehicle with operators would refuse every request of this station.
fn why_no_key(model: &Model) -> Option<String> {
    let observes = model.people().is_some() && model.settings.key_owner.is_none();
    observes.then(|| "no operator's key here (--crew, --operator): this station looks on".to_owned())
}

/// Why the vehicle is not the one that this station is prepared for.
pub fn why_other_mission(model: &Model) -> Option<String> {
    let ours = model.settings.mission?;
    Some(match model.vehicle.mission() {
        None => format!("the vehicle has not reported whether it flies {ours} (--mission)"),
        Some(FlownMission { hash: theirs, name, .. }) if theirs != ours => {
            format!("the vehicle flies {name} {theirs}, --mission is {ours}")
        }
        Some(FlownMission { start: reported, .. }) => {
            let start = model.settings.start.as_deref().filter(|start| reported != Some(*start))?;
            let begins = reported.unwrap_or("not reported");
            format!("the flight begins at: {begins}, --start is {start}")
        }
    })
}

// The state of the automatic mode.

/// The steps of the automatic mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum AutoStep {
    /// Waits until the checks pass; after a temporary refusal, also until this time.
    WaitForReady { not_before: Duration },
    /// The command to arm was sent.
    WaitForArmed,
    /// The countdown runs. After a hold for a lost link it is started again.
    Started,
    /// Nothing remains to be commanded.
    Done,
}

impl Default for AutoStep {
    fn default() -> Self {
        Self::WaitForReady { not_before: Duration::ZERO }
    }
}

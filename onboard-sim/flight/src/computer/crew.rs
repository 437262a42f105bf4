//! Crew requests by radio: the decision on each, and its answer.

use arrayvec::ArrayVec;
use serde::Serialize;

use super::messages::Severity;
use super::table::PhaseTable;
use super::{Commander, Computer, SensedInput};
use crate::rules::arming;
use crate::rules::arming::{Check, Uplink};
use crate::rules::operator::Operator;
use crate::rules::phase::{
    Event, HoldCause, Mode, Phase, Refusal, StartPoint, UPLINK_PROVEN_S, UPLINK_SILENT_S, transition,
};
use crate::rules::two_person::{
    Act, CONFIRM_WITHIN_S, NoAgreement, Proposal, Reply, Station, TAP_WITHIN_S, TwoPerson,
};
use crate::text::{Text, text};

numbered_enum! {
/// A crew command, by its number in the log. Its name is used in messages such as `abort refused`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CrewCommand {
    Arm = "arm",
    /// Disarm; cancels a countdown.
    Disarm = "disarm",
    /// Start the countdown.
    Start = "start",
    /// Hold the countdown.
    Hold = "hold",
    /// Abort, irreversibly.
    Abort = "abort",
    /// Dead-man confirmation in the countdown by the operator who confirmed the start.
    Tap = "tap",
    /// Take command from a silent station.
    TakeCommand = "take-over",
    /// Check the vehicle on its pad: surfaces, sensors, switches, battery and storage.
    Check = "check",
    /// The same check without motion.
    CheckStill = "check",
    /// End the running check.
    EndCheck = "end of the check",
    /// A person has seen every surface of the last check move as shown on the crew's page.
    Seen = "seen motion",
}
}

/// Number of people who must agree to arm and start. Without operators, any received station
/// commands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum People {
    /// Any operator alone.
    One,
    /// Two of different roles.
    Two {
        /// Number of the first proposal since power-up, different at each boot: a confirmation from
        /// an earlier boot matches no proposal.
        first: u16,
    },
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Request {
    pub command: CrewCommand,
    /// Uplink of the requesting station; [`Uplink::NotNeeded`] for the vehicle's programme.
    pub uplink: Uplink,
    /// `None` for the vehicle's programme.
    pub station: Option<Station>,
    /// Operator whose key signed the request; `None` for the shared key, or no key.
    pub by: Option<Operator>,
    /// Number of the proposal that it confirms.
    pub confirms: Option<u16>,
}

impl Request {
    /// A request of the vehicle's programme.
    pub fn of_the_programme(command: CrewCommand) -> Self {
        Self { command, uplink: Uplink::NotNeeded, station: None, by: None, confirms: None }
    }
}

/// Outcome of a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// Done, or the vehicle is already in that state.
    Accepted,
    /// Refused for now: the cause can be fixed.
    NotNow,
    /// Refused in this phase or state.
    Denied,
    /// Valid, but impossible.
    Failed,
    /// Pending: a second person must confirm it.
    ToConfirm,
}

/// Answer to a request, with the reason if it was not accepted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Answer {
    pub ending: Ending,
    pub reason: Option<Text>,
}

/// Requests that a frame answers. More are decided, and not answered.
pub const ANSWERED: usize = 16;
/// Requests of a frame, in order.
pub type Requests = ArrayVec<Request, ANSWERED>;
/// The answers to them.
pub type Answers = ArrayVec<Answer, ANSWERED>;

impl Answer {
    pub(super) const ACCEPTED: Self = Self { ending: Ending::Accepted, reason: None };
}

/// Whether the vehicle is already in the requested state. A repeated request is accepted, because a
/// refusal would alarm the crew.
pub(super) fn is_so_already(mode: &Mode, command: CrewCommand) -> bool {
    let locks = mode.interlocks;
    match command {
        CrewCommand::Arm => locks.armed && mode.phase == Phase::PadArmed,
        CrewCommand::Disarm => {
            !locks.armed && matches!(mode.phase, Phase::PadIdle | Phase::Touchdown | Phase::Safed)
        }
        CrewCommand::Start => locks.armed && mode.countdown_end_s.is_some(),
        CrewCommand::Hold => mode.hold.is_some(),
        // A second abort may have more effect than the first: the phase table decides.
        _ => false,
    }
}

/// The event for a command; `None` if the phase table does not handle it. `countdown_s` and `start`
/// describe the countdown, `abort` is the event of an abort at this moment, and `lifted_off` is set
/// once the vehicle has left its rail.
pub(super) fn event_of(
    command: CrewCommand,
    checks: &[Check],
    (countdown_s, start): (f64, StartPoint),
    abort: Event,
    lifted_off: bool,
) -> Option<Event> {
    use CrewCommand as C;
    Some(match command {
        C::Arm => Event::ArmRequested { checks_passed: arming::all_passed(checks) },
        C::Disarm => Event::DisarmRequested { lifted_off },
        C::Start => Event::StartRequested { countdown_s, checks_passed: arming::all_passed(checks) },
        C::Hold => Event::Hold { cause: HoldCause::Commanded, start },
        C::Abort => abort,
        C::Tap | C::TakeCommand | C::Check | C::CheckStill | C::EndCheck | C::Seen => return None,
    })
}

/// The answer to a request whose event the phase table has refused; reports the reason to the crew.
fn refused(table: &mut PhaseTable, command: CrewCommand, refusal: Refusal, checks: &[Check]) -> Answer {
    // The first answer may have been lost: a latched abort is accepted again, also under the
    // parachute and on the ground.
    let latched = command == CrewCommand::Abort && table.mode().interlocks.abort_latched;
    if latched || refusal == Refusal::AlreadyAborted {
        return Answer::ACCEPTED;
    }
    let reason = match refusal {
        Refusal::ChecksFailed => arming::first_refusal(checks).unwrap_or_else(|| text!("{refusal}")),
        other => text!("{other}"),
    };
    let ending = match (command, refusal) {
        (CrewCommand::Abort, _) => Ending::Failed,
        (_, Refusal::ChecksFailed | Refusal::PinIn) => Ending::NotNow,
        _ => Ending::Denied,
    };
    table.report(Severity::Warning, text!("{} refused: {reason}", command.name()));
    Answer { ending, reason: Some(reason) }
}

// Decides the crew's requests, and holds the countdown when the commanding station is silent or a
// dead-man confirmation is overdue.

/// Silence of the commanding station after which an armed vehicle on its pad disarms itself, s: a
/// crew that restarts its station needs some ten seconds, and no person should stand beside an
/// armed vehicle without a commander.
const ALONE_S: f64 = 60.0;

/// Time after a disarm in which only the station that disarmed may arm, s: two operators may have
/// typed at once, and whoever disarmed may have sent somebody to the vehicle.
const DISARMED_S: f64 = 3.0;

/// State of the crew in the computer's memory.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct CrewMemory {
    pub two_person: TwoPerson,
    /// The operator who held the last countdown, or whose silence held it.
    pub held_by: Option<Operator>,
    /// When the last disarm was received, s, and from which station.
    disarmed: Option<(f64, Station)>,
}

/// A proposal and the operator who confirmed it.
type Agreed = (Proposal, Operator);

impl Computer {
    /// Decides a request.
    #[expect(clippy::result_large_err, reason = "a frame allocates nothing")]
    pub(super) fn answer(&mut self, request: &Request) -> Answer {
        let mode = *self.table.mode();
        let time_s = self.table.time_s;
        let Request { command, uplink, station, by, .. } = *request;
        if let Some(reason) = self.why_not_of(request) {
            return self.deny(command, &reason);
        }
        // Any other command ends a running check first.
        let check_ended = !matches!(command, CrewCommand::Check | CrewCommand::CheckStill)
            && self.end_check(command.name());
        if check_ended && matches!(command, CrewCommand::Arm | CrewCommand::Start) {
            let reason = "a check of the vehicle ran, and has ended now; ask again";
            return Answer { ending: Ending::NotNow, ..self.deny(command, reason) };
        }
        if let Some(reason) = self.why_not_here(request) {
            return self.deny(command, &reason);
        }
        if let (CrewCommand::Disarm, Some(station)) = (command, station) {
            self.crew.disarmed = Some((time_s, station));
        }
        if is_so_already(&mode, command) {
            return Answer::ACCEPTED;
        }
        if command == CrewCommand::Abort && !mode.interlocks.abort_latched {
            let who = match (by, station) {
                (Some(by), _) => Some(text!("{by}")),
                (None, Some(station)) if self.input.people.is_some() => {
                    Some(text!("station {station}, with the key that all share,"))
                }
                (None, Some(station)) => Some(text!("station {station}")),
                (None, None) => None,
            };
            if let Some(who) = who {
                self.table.report(Severity::Warning, text!("{who} aborts"));
            }
        }
        let checks = self.failing_checks(uplink);
        let start = self.start_point();
        let lifted_off = self.pilot.ascent.has_lifted_off();
        let abort = self.abort_event();
        let Some(event) = event_of(command, &checks, (self.countdown_s, start), abort, lifted_off) else {
            return match command {
                CrewCommand::Tap => self.tap(by),
                CrewCommand::TakeCommand => self.take_command(request),
                CrewCommand::Check | CrewCommand::CheckStill => self.begin_check(command, by),
                CrewCommand::Seen => self.see_check(command, by),
                _ => Answer::ACCEPTED,
            };
        };
        let may_hold = mode.may_hold_for(HoldCause::Commanded, start, time_s);
        if let (CrewCommand::Hold, true, Some(station)) = (command, may_hold, station) {
            let who = by.map_or_else(Text::new, |by| text!("{by}, "));
            self.table.report(Severity::Notice, text!("{who}station {station} requests a hold"));
        }
        // A request that the phase table would refuse needs no second person's confirmation.
        let refusal = transition(&mode, event, time_s).refusal;
        let agreed = match refusal.map_or_else(|| self.agree(request), |_| Ok(None)) {
            Ok(agreed) => agreed,
            Err(answer) => return answer,
        };
        match self.apply(event) {
            Ok(_) => {
                self.note_done(command, by, agreed);
                Answer::ACCEPTED
            }
            Err(refusal) => refused(&mut self.table, command, refusal, &checks),
        }
    }

    /// Why this sender may not give this command; `None` if it may.
    fn why_not_of(&self, request: &Request) -> Option<Text> {
        let people = self.input.people?;
        let Request { command, station, by, .. } = *request;
        if station.is_none() {
            let shared = act_of(command).is_some() && people != People::One;
            return shared.then(|| text!("two people arm and start, not the vehicle by itself"));
        }
        // Any holder of a key may stop the launch; the links drop all others.
        if matches!(command, CrewCommand::Abort | CrewCommand::Hold) {
            return None;
        }
        match by {
            None => Some(text!("only an operator with a key of their own commands")),
            Some(by) if !by.role.may_command() => Some(text!("{by} only looks on")),
            Some(_) => None,
        }
    }

    /// Why this station may not arm or start now; `None` if it may. With one person, the station
    /// that armed must start, because its silence holds the countdown. With two, one gives dead-man
    /// confirmations, and they may start from any two stations.
    fn why_not_here(&self, request: &Request) -> Option<Text> {
        let station = request.station?;
        match request.command {
            CrewCommand::Arm => {
                let (disarmed_s, by) = self.crew.disarmed?;
                (by != station && self.table.time_s - disarmed_s < DISARMED_S)
                    .then(|| text!("{by} has just disarmed it: agree, then arm again"))
            }
            CrewCommand::Start if !matches!(self.input.people, Some(People::Two { .. })) => {
                let armed_by = self.input.commander.filter(|_| self.table.mode().interlocks.armed)?;
                (armed_by.station != station).then(|| {
                    let who = named(armed_by.station, armed_by.by);
                    text!("{who} armed it: start there, or take command when it is silent")
                })
            }
            _ => None,
        }
    }

    /// Proposes or confirms, if two people must agree. A new proposal and a wrong confirmation
    /// return an error.
    #[expect(clippy::result_large_err, reason = "a frame allocates nothing")]
    fn agree(&mut self, request: &Request) -> Result<Option<Agreed>, Answer> {
        let Request { command, station, by, confirms, .. } = *request;
        let (first, act) = match (self.input.people, act_of(command)) {
            (Some(People::Two { first }), Some(act)) => (first, act),
            (None | Some(People::One), _) | (Some(People::Two { .. }), None) => return Ok(None),
        };
        let (Some(by), Some(station)) = (by, station) else {
            let reason = "two people with a key each, at a station, must agree";
            return Err(self.deny(command, reason));
        };
        let time_s = self.table.time_s;
        let waited = self.crew.two_person.waiting(time_s);
        match self.crew.two_person.request(act, confirms, (by, station), first, time_s) {
            Reply::Agreed { proposal, confirmed_by } => Ok(Some((proposal, confirmed_by))),
            Reply::Proposed(proposal) => {
                let reason = proposal_text(&proposal, time_s);
                if waited != Some(proposal) {
                    self.table.report(Severity::Notice, reason);
                }
                Err(Answer { ending: Ending::ToConfirm, reason: Some(reason) })
            }
            Reply::Refused(refusal) => Err(self.deny(command, &why_no_agreement(refusal, act, time_s))),
        }
    }

    /// Records the effect of an accepted request on the crew state.
    fn note_done(&mut self, command: CrewCommand, by: Option<Operator>, agreed: Option<Agreed>) {
        let time_s = self.table.time_s;
        let commander = self.input.commander.and_then(|commander| commander.by);
        let commands = |by: Operator| commander.is_some_and(|commander| commander.number == by.number);
        let two_person = &mut self.crew.two_person;
        match (command, agreed) {
            (CrewCommand::Arm, Some((proposal, _))) => two_person.armed = Some(proposal),
            // The commanding station is already supervised by its heartbeats: the other operator
            // gives the dead-man confirmations.
            (CrewCommand::Start, Some((proposal, confirmed_by))) if commands(confirmed_by) => {
                two_person.begin_taps(proposal.by, time_s);
            }
            (CrewCommand::Start, Some((_, confirmed_by))) => two_person.begin_taps(confirmed_by, time_s),
            (CrewCommand::Disarm | CrewCommand::Hold | CrewCommand::Abort, _) => {
                two_person.withdraw();
                two_person.end_taps();
            }
            _ => {}
        }
        match command {
            CrewCommand::Hold => self.crew.held_by = by,
            CrewCommand::Start => self.crew.held_by = None,
            _ => {}
        }
        if let Some((Proposal { act, by, .. }, confirmed_by)) = agreed {
            let words = text!("{}: requested by {by}, confirmed by {confirmed_by}", act.name());
            self.table.report(Severity::Notice, words);
        }
    }

    pub(super) fn deny(&mut self, command: CrewCommand, reason: &str) -> Answer {
        self.table.report(Severity::Warning, text!("{} refused: {reason}", command.name()));
        Answer { ending: Ending::Denied, reason: Some(text!("{reason}")) }
    }

    fn tap(&mut self, by: Option<Operator>) -> Answer {
        let time_s = self.table.time_s;
        if by.is_some_and(|by| self.crew.two_person.tap(by, time_s)) {
            return Answer::ACCEPTED;
        }
        let reason = match self.crew.two_person.tapping {
            Some(tapping) => text!("{} taps", tapping.by),
            None => text!("no countdown that two people have started"),
        };
        self.deny(CrewCommand::Tap, &reason)
    }

    /// A station takes command from a silent one.
    fn take_command(&mut self, request: &Request) -> Answer {
        let Some(station) = request.station else {
            return self.deny(CrewCommand::TakeCommand, "no station");
        };
        let armed = self.table.mode().interlocks.armed;
        let Some(Commander { station: before, age_s, by: before_by, .. }) =
            self.input.commander.filter(|_| armed)
        else {
            return self.deny(CrewCommand::TakeCommand, "no station has armed the vehicle");
        };
        if before == station {
            return Answer::ACCEPTED;
        }
        let (old, new) = (named(before, before_by), named(station, request.by));
        if age_s <= UPLINK_PROVEN_S {
            return self.deny(CrewCommand::TakeCommand, &text!("{old} was received {age_s:.1} s ago"));
        }
        // One person cannot both command and give the dead-man confirmations.
        if let (Some(tapping), Some(by)) = (self.crew.two_person.tapping, request.by)
            && tapping.by.number == by.number
        {
            return self.deny(CrewCommand::TakeCommand, &text!("{by} taps: hold the countdown first"));
        }
        // A role hands over to the same role; range safety may always take over.
        if let (Some(before_by), Some(by)) = (before_by, request.by)
            && by.role != before_by.role
            && by.role != crate::rules::operator::Role::RangeSafety
        {
            let wanted = before_by.role.name();
            let reason = text!("only {wanted} or RANGE SAFETY takes over from {old}");
            return self.deny(CrewCommand::TakeCommand, &reason);
        }
        let silence =
            if age_s.is_finite() { text!("silent for {age_s:.0} s") } else { text!("never received") };
        self.table.report(Severity::Critical, text!("{new} takes command from {old}, {silence}"));
        Answer::ACCEPTED
    }

    /// Holds the countdown if the station that armed the vehicle is silent, or receives nothing
    /// from the vehicle.
    pub(super) fn check_the_commander(&mut self, input: &SensedInput) {
        let Some(Commander { station, age_s, by, deaf }) = input.commander else { return };
        // NaN is no sign of life.
        let is_heard = age_s <= UPLINK_SILENT_S;
        let held = if is_heard {
            deaf && self.hold(HoldCause::StationDeaf, || text!("{station} receives nothing of this vehicle"))
        } else {
            let why = || text!("nothing received from {station} for {UPLINK_SILENT_S} s");
            self.hold(HoldCause::UplinkSilent, why)
        };
        if held {
            self.crew.held_by = by;
        }
        let mode = self.table.mode();
        // A hold disarms by its own limit.
        let waits = mode.phase == Phase::PadArmed && mode.countdown_end_s.is_none() && mode.hold.is_none();
        // NaN is no sign of life.
        let is_attended = age_s <= ALONE_S;
        if waits && !is_attended {
            let words = text!("nothing received from {station} for {ALONE_S} s: DISARMED");
            self.table.report(Severity::Critical, words);
            let _ = self.table.apply(Event::DisarmRequested { lifted_off: false });
        }
    }

    /// Holds a running countdown and reports the reason, unless this cause comes too late to hold
    /// it.
    pub(super) fn hold(&mut self, cause: HoldCause, why: impl FnOnce() -> Text) -> bool {
        let start = self.start_point();
        if !self.table.mode().may_hold_for(cause, start, self.table.time_s) {
            return false;
        }
        self.table.report(Severity::Critical, why());
        self.crew.held_by = None;
        self.table.apply(Event::Hold { cause, start }).is_ok()
    }

    /// Holds the countdown if the dead-man confirmation is overdue. After the release it is not
    /// required.
    pub(super) fn check_dead_man_timeout(&mut self) {
        if self.table.mode().countdown_end_s.is_none() {
            self.crew.two_person.end_taps();
            return;
        }
        let Some(by) = self.crew.two_person.lapsed(self.table.time_s) else { return };
        if self.hold(HoldCause::TapOverdue, || text!("no tap of {by} for {TAP_WITHIN_S} s")) {
            self.crew.held_by = Some(by);
            self.crew.two_person.end_taps();
        }
    }
}

/// Formats a station with its operator, if any, and its ids.
fn named(station: Station, by: Option<Operator>) -> Text {
    by.map_or_else(|| text!("{station}"), |by| text!("{by} ({station})"))
}

/// The act that needs two people; `None` if one is enough.
fn act_of(command: CrewCommand) -> Option<Act> {
    match command {
        CrewCommand::Arm => Some(Act::Arm),
        CrewCommand::Start => Some(Act::Start),
        _ => None,
    }
}

fn proposal_text(proposal: &Proposal, time_s: f64) -> Text {
    let mut others = proposal.by.role.others();
    let [one, other] = [others.next(), others.next()].map(|role| role.map_or("", |role| role.name()));
    let left_s = proposal.left_s(time_s).clamp(0.0, CONFIRM_WITHIN_S);
    let Proposal { act, by, .. } = proposal;
    text!("{by} requests to {}: {one} or {other} must confirm within {left_s:.0} s", act.name())
}

fn why_no_agreement(refusal: NoAgreement, act: Act, time_s: f64) -> Text {
    match refusal {
        NoAgreement::Observer => text!("observers command nothing"),
        NoAgreement::Pending(proposal) => proposal_text(&proposal, time_s),
        NoAgreement::NothingToConfirm => {
            text!("no pending proposal to {} has that number", act.name())
        }
        NoAgreement::SamePerson(proposal) => {
            text!("{} requested it: another role must confirm", proposal.by)
        }
        NoAgreement::SameRole(proposal) => {
            text!("{} requested it: another role than {} must confirm", proposal.by, proposal.by.role.name())
        }
    }
}

//! What the crew may ask for by radio, what the flight computer decides, and how it answers.

use alloc::format;
use alloc::string::{String, ToString as _};
use serde::Serialize;

use super::news::Severity;
use super::table::PhaseTable;
use super::{Commander, Computer, KeptInput};
use crate::rules::arming;
use crate::rules::arming::{Check, Uplink};
use crate::rules::operator::Operator;
use crate::rules::phase::{
    Event, HoldCause, Mode, Phase, Refusal, StartPoint, UPLINK_PROVEN_S, UPLINK_SILENT_S, transition,
};
use crate::rules::two_person::{
    Act, Ask, CONFIRM_WITHIN_S, NoAgreement, Reply, Station, TAP_WITHIN_S, TwoPerson,
};

numbered_enum! {
/// A request, by its number in the log, and its name as in `abort refused`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Asked {
    Arm = "arm",
    /// Disarm; cancels a countdown.
    Disarm = "disarm",
    /// Start the countdown.
    Start = "start",
    /// Hold the countdown.
    Hold = "hold",
    /// Abort, irreversibly.
    Abort = "abort",
    /// A tap in the countdown: whoever confirmed the start is still there.
    Tap = "tap",
    /// Take the command from a station that is silent.
    TakeCommand = "take-over",
    /// Check the vehicle on its pad: surfaces, sensors, switches, battery and storage.
    Check = "check",
    /// The same, but nothing moves.
    CheckStill = "check",
    /// End the running check.
    EndCheck = "end of the check",
    /// One person has seen every surface of the last check move as the crew's page says.
    Seen = "seen motion",
}
}

/// How many people an arming and a start take. Without one of these there are no operators, and
/// whoever is heard commands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum People {
    /// Every operator alone.
    One,
    /// Two of different roles.
    Two {
        /// Number of the first ask since power-up, another one at each boot: a confirmation from
        /// before it names none.
        first_ask: u16,
    },
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Request {
    pub asked: Asked,
    /// How well the requesting station is heard. [`Uplink::NotNeeded`] for the vehicle's own
    /// programme.
    pub uplink: Uplink,
    /// `None` for the vehicle's own programme.
    pub station: Option<Station>,
    /// Whose key has signed it; `None` for the key that all stations share, or none.
    pub by: Option<Operator>,
    /// The number of the ask that it confirms.
    pub confirms: Option<u16>,
}

impl Request {
    /// A request of the vehicle's own programme.
    pub fn of_the_programme(asked: Asked) -> Self {
        Self { asked, uplink: Uplink::NotNeeded, station: None, by: None, confirms: None }
    }
}

/// How a request ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// Done, or already in that state.
    Accepted,
    /// Not now: the cause can be fixed.
    NotNow,
    /// Not in this phase or state.
    Denied,
    /// Understood, but impossible.
    Failed,
    /// Noted: a second person has to confirm it.
    Asked,
}

/// The answer to a request, with the reason if it was not accepted.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Answer {
    pub ending: Ending,
    pub reason: Option<String>,
}

impl Answer {
    pub(super) const ACCEPTED: Self = Self { ending: Ending::Accepted, reason: None };
}

/// Whether the vehicle is already in the requested state. A repeated request is accepted: a refusal
/// would alarm the crew.
pub(super) fn is_so_already(mode: &Mode, asked: Asked) -> bool {
    let locks = mode.interlocks;
    match asked {
        Asked::Arm => locks.armed && mode.phase == Phase::PadArmed,
        Asked::Disarm => {
            !locks.armed && matches!(mode.phase, Phase::PadIdle | Phase::Touchdown | Phase::Safed)
        }
        Asked::Start => locks.armed && mode.countdown_end_s.is_some(),
        Asked::Hold => mode.hold.is_some(),
        // A second abort may do more than the first: the phase table decides.
        _ => false,
    }
}

/// The event for a request; `None` for one that is no matter of the phase table. A countdown is of
/// this length, before a flight that starts there, and `abort` is the event that an abort would be
/// now; `lifted_off`: the vehicle has left its rail.
pub(super) fn event_of(
    asked: Asked,
    checks: &[Check],
    (countdown_s, start): (f64, StartPoint),
    abort: Event,
    lifted_off: bool,
) -> Option<Event> {
    Some(match asked {
        Asked::Arm => Event::ArmRequested { checks_passed: arming::all_passed(checks) },
        Asked::Disarm => Event::DisarmRequested { lifted_off },
        Asked::Start => Event::StartRequested { countdown_s, checks_passed: arming::all_passed(checks) },
        Asked::Hold => Event::Hold { cause: HoldCause::Commanded, start },
        Asked::Abort => abort,
        Asked::Tap
        | Asked::TakeCommand
        | Asked::Check
        | Asked::CheckStill
        | Asked::EndCheck
        | Asked::Seen => return None,
    })
}

/// The answer to a request whose event the table has refused; the crew is told the reason.
pub(super) fn refused(table: &mut PhaseTable, asked: Asked, refusal: Refusal, checks: &[Check]) -> Answer {
    // The first answer may have been lost: a latched abort is accepted again, also under the
    // parachute and on the ground.
    let latched = asked == Asked::Abort && table.mode().interlocks.abort_latched;
    if latched || refusal == Refusal::AlreadyAborted {
        return Answer::ACCEPTED;
    }
    let reason = match refusal {
        Refusal::ChecksFailed => arming::first_refusal(checks).unwrap_or_else(|| refusal.to_string()),
        other => other.to_string(),
    };
    let ending = match (asked, refusal) {
        (Asked::Abort, _) => Ending::Failed,
        (_, Refusal::ChecksFailed | Refusal::PinIn) => Ending::NotNow,
        _ => Ending::Denied,
    };
    table.say(Severity::Warning, format!("{} refused: {reason}", asked.name()));
    Answer { ending, reason: Some(reason) }
}

// Decides the crew's requests, and holds the countdown when the commanding station falls silent or
// a tap is overdue.

/// What the computer remembers of its crew.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct CrewMemory {
    pub two_person: TwoPerson,
    /// Who has held the last countdown, or whose silence has.
    pub held_by: Option<Operator>,
}

/// An ask, and who has confirmed it.
type Agreed = (Ask, Operator);

impl Computer {
    /// Decides a request.
    pub(super) fn answer(&mut self, request: &Request) -> Answer {
        let mode = *self.table.mode();
        let time_s = self.table.time_s();
        let Request { asked, uplink, station, by, .. } = *request;
        if let Some(reason) = self.why_not_of(request) {
            return self.deny(asked, reason);
        }
        // Whatever else the crew wants, the check is over first.
        let check_ended = !matches!(asked, Asked::Check | Asked::CheckStill) && self.end_check(asked.name());
        if check_ended && matches!(asked, Asked::Arm | Asked::Start) {
            let reason = "a check of the vehicle ran, and has ended now; ask again";
            return Answer { ending: Ending::NotNow, ..self.deny(asked, reason.into()) };
        }
        if asked == Asked::Start
            && let Some(reason) = self.why_not_start(request)
        {
            return self.deny(asked, reason);
        }
        if is_so_already(&mode, asked) {
            return Answer::ACCEPTED;
        }
        if asked == Asked::Abort && !mode.interlocks.abort_latched {
            let who = match (by, station) {
                (Some(by), _) => Some(format!("{by}")),
                (None, Some(station)) if self.input.people.is_some() => {
                    Some(format!("station {station}, with the key that all share,"))
                }
                _ => None,
            };
            if let Some(who) = who {
                self.table.say(Severity::Warning, format!("{who} aborts"));
            }
        }
        let checks = self.arming_checks_by(uplink);
        let start = self.start_point();
        let lifted_off = self.pilot.ascent.has_lifted_off();
        let abort = self.abort_event();
        let Some(event) = event_of(asked, &checks, (self.countdown_s, start), abort, lifted_off) else {
            return match asked {
                Asked::Tap => self.tap(by),
                Asked::TakeCommand => self.take_command(request),
                Asked::Check | Asked::CheckStill => self.begin_check(asked, by),
                Asked::Seen => self.see_check(asked, by),
                _ => Answer::ACCEPTED,
            };
        };
        let may_hold = mode.may_hold_for(HoldCause::Commanded, start, time_s);
        if let (Asked::Hold, true, Some(station)) = (asked, may_hold, station) {
            let who = by.map_or_else(String::new, |by| format!("{by}, "));
            self.table.say(Severity::Notice, format!("{who}station {station} asks for a hold"));
        }
        // What the phase table would refuse is not worth a second person's confirmation.
        let refusal = transition(&mode, event, time_s).refusal;
        let agreed = match refusal.map_or_else(|| self.agree(request), |_| Ok(None)) {
            Ok(agreed) => agreed,
            Err(answer) => return answer,
        };
        match self.happen(event) {
            Ok(_) => {
                self.note_done(asked, by, agreed);
                Answer::ACCEPTED
            }
            Err(refusal) => refused(&mut self.table, asked, refusal, &checks),
        }
    }

    /// Why this sender may ask for nothing of the kind.
    fn why_not_of(&self, request: &Request) -> Option<String> {
        let people = self.input.people?;
        let Request { asked, station, by, .. } = *request;
        if station.is_none() {
            let shared = act_of(asked).is_some() && people != People::One;
            return shared.then(|| "two people arm and start, not the vehicle by itself".into());
        }
        // Whoever holds any key of this crew may stop the launch: the links let nobody else
        // through.
        if matches!(asked, Asked::Abort | Asked::Hold) {
            return None;
        }
        match by {
            None => Some("only an operator with a key of their own commands".into()),
            Some(by) if !by.role.may_command() => Some(format!("{by} only looks on")),
            Some(_) => None,
        }
    }

    /// Why nobody starts from there now. Who starts is who armed: the station whose silence holds
    /// the countdown. Of two people one taps, too, and they may start from any two of their
    /// stations.
    fn why_not_start(&self, request: &Request) -> Option<String> {
        let station = request.station.filter(|_| !matches!(self.input.people, Some(People::Two { .. })));
        let armed_by = self.input.commander.filter(|_| self.table.mode().interlocks.armed);
        if let (Some(station), Some(Commander { station: armed_by, by, .. })) = (station, armed_by)
            && armed_by != station
        {
            let who = named(armed_by, by);
            return Some(format!("{who} armed it: start there, or take command when it is silent"));
        }
        None
    }

    /// Asks or confirms, if this takes two people; the answer to an ask, and to a wrong
    /// confirmation, is an error.
    fn agree(&mut self, request: &Request) -> Result<Option<Agreed>, Answer> {
        let Request { asked, station, by, confirms, .. } = *request;
        let (first_ask, act) = match (self.input.people, act_of(asked)) {
            (Some(People::Two { first_ask }), Some(act)) => (first_ask, act),
            (None | Some(People::One), _) | (Some(People::Two { .. }), None) => return Ok(None),
        };
        let (Some(by), Some(station)) = (by, station) else {
            let reason = "two people with a key each, at a station, must agree".into();
            return Err(self.deny(asked, reason));
        };
        let time_s = self.table.time_s();
        let waited = self.crew.two_person.waiting(time_s);
        match self.crew.two_person.request(act, confirms, (by, station), first_ask, time_s) {
            Reply::Agreed { ask, confirmed_by } => Ok(Some((ask, confirmed_by))),
            Reply::Asked(ask) => {
                let reason = ask_in_words(&ask, time_s);
                if waited != Some(ask) {
                    self.table.say(Severity::Notice, reason.clone());
                }
                Err(Answer { ending: Ending::Asked, reason: Some(reason) })
            }
            Reply::Refused(refusal) => Err(self.deny(asked, why_no_agreement(refusal, act, time_s))),
        }
    }

    /// Notes what an accepted request means for the crew.
    fn note_done(&mut self, asked: Asked, by: Option<Operator>, agreed: Option<Agreed>) {
        let time_s = self.table.time_s();
        let commander = self.input.commander.and_then(|commander| commander.by);
        let commands = |by: Operator| commander.is_some_and(|commander| commander.number == by.number);
        let two_person = &mut self.crew.two_person;
        match (asked, agreed) {
            (Asked::Arm, Some((ask, _))) => two_person.armed(ask),
            // Whose station commands is watched by its silence already: the other one of the two
            // taps.
            (Asked::Start, Some((ask, confirmed_by))) if commands(confirmed_by) => {
                two_person.begin_taps(ask.by, time_s);
            }
            (Asked::Start, Some((_, confirmed_by))) => two_person.begin_taps(confirmed_by, time_s),
            (Asked::Disarm | Asked::Hold | Asked::Abort, _) => {
                two_person.withdraw();
                two_person.end_taps();
            }
            _ => {}
        }
        if asked == Asked::Hold {
            self.crew.held_by = by;
        }
        if let Some((ask, confirmed_by)) = agreed {
            let words = format!("{}: asked by {}, confirmed by {confirmed_by}", ask.act.name(), ask.by);
            self.table.say(Severity::Notice, words);
        }
    }

    pub(super) fn deny(&mut self, asked: Asked, reason: String) -> Answer {
        self.table.say(Severity::Warning, format!("{} refused: {reason}", asked.name()));
        Answer { ending: Ending::Denied, reason: Some(reason) }
    }

    fn tap(&mut self, by: Option<Operator>) -> Answer {
        let time_s = self.table.time_s();
        if by.is_some_and(|by| self.crew.two_person.tap(by, time_s)) {
            return Answer::ACCEPTED;
        }
        let reason = match self.crew.two_person.tapping() {
            Some(tapping) => format!("{} taps", tapping.by),
            None => "no countdown that two people have started".into(),
        };
        self.deny(Asked::Tap, reason)
    }

    /// A station takes the command from one that is silent.
    fn take_command(&mut self, request: &Request) -> Answer {
        let Some(station) = request.station else {
            return self.deny(Asked::TakeCommand, "no station".into());
        };
        let armed = self.table.mode().interlocks.armed;
        let Some(Commander { station: before, age_s, by: before_by, .. }) =
            self.input.commander.filter(|_| armed)
        else {
            return self.deny(Asked::TakeCommand, "no station has armed the vehicle".into());
        };
        if before == station {
            return Answer::ACCEPTED;
        }
        let (old, new) = (named(before, before_by), named(station, request.by));
        if age_s <= UPLINK_PROVEN_S {
            return self.deny(Asked::TakeCommand, format!("{old} is heard, {age_s:.1} s ago"));
        }
        // Nobody commands and taps: that takes two.
        if let (Some(tapping), Some(by)) = (self.crew.two_person.tapping(), request.by)
            && tapping.by.number == by.number
        {
            return self.deny(Asked::TakeCommand, format!("{by} taps: hold the countdown first"));
        }
        // A role hands over to its like; range safety may always take over.
        if let (Some(before_by), Some(by)) = (before_by, request.by)
            && by.role != before_by.role
            && by.role != crate::rules::operator::Role::RangeSafety
        {
            let wanted = before_by.role.name();
            return self
                .deny(Asked::TakeCommand, format!("only {wanted} or RANGE SAFETY takes over from {old}"));
        }
        let silence = if age_s.is_finite() { format!("silent for {age_s:.0} s") } else { "not heard".into() };
        self.table.say(Severity::Critical, format!("{new} takes command from {old}, {silence}"));
        Answer::ACCEPTED
    }

    /// Holds the countdown if the station that armed the vehicle has fallen silent, or hears
    /// nothing of the vehicle.
    pub(super) fn watch_the_commander(&mut self, input: &KeptInput) {
        let Some(Commander { station, age_s, by, deaf }) = input.commander else { return };
        // An age that is not a number is no sign of life.
        let is_heard = age_s <= UPLINK_SILENT_S;
        let held = if is_heard {
            deaf && self.hold(HoldCause::StationDeaf, || format!("{station} hears nothing of this vehicle"))
        } else {
            let why = || format!("nothing heard of {station} for {UPLINK_SILENT_S} s");
            self.hold(HoldCause::UplinkSilent, why)
        };
        if held {
            self.crew.held_by = by;
        }
    }

    /// Holds a running countdown, and says why; not when this cause comes too late for it.
    pub(super) fn hold(&mut self, cause: HoldCause, why: impl FnOnce() -> String) -> bool {
        let start = self.start_point();
        if !self.table.mode().may_hold_for(cause, start, self.table.time_s()) {
            return false;
        }
        self.table.say(Severity::Critical, why());
        self.table.happen(Event::Hold { cause, start }).is_ok()
    }

    /// Holds the countdown if the tap of whoever confirmed the start is overdue. After the release
    /// taps mean nothing.
    pub(super) fn watch_the_taps(&mut self) {
        if self.table.mode().countdown_end_s.is_none() {
            self.crew.two_person.end_taps();
            return;
        }
        let Some(by) = self.crew.two_person.lapsed(self.table.time_s()) else { return };
        if self.hold(HoldCause::TapOverdue, || format!("no tap of {by} for {TAP_WITHIN_S} s")) {
            self.crew.held_by = Some(by);
            self.crew.two_person.end_taps();
        }
    }
}

/// A station by its operator, if it has one, and its ids.
fn named(station: Station, by: Option<Operator>) -> String {
    by.map_or_else(|| format!("{station}"), |by| format!("{by} ({station})"))
}

/// What takes two people.
fn act_of(asked: Asked) -> Option<Act> {
    match asked {
        Asked::Arm => Some(Act::Arm),
        Asked::Start => Some(Act::Start),
        Asked::Disarm
        | Asked::Hold
        | Asked::Abort
        | Asked::Tap
        | Asked::TakeCommand
        | Asked::Check
        | Asked::CheckStill
        | Asked::EndCheck
        | Asked::Seen => None,
    }
}

fn ask_in_words(ask: &Ask, time_s: f64) -> String {
    let mut others = ask.by.role.others();
    let [one, other] = [others.next(), others.next()].map(|role| role.map_or("", |role| role.name()));
    let left_s = ask.left_s(time_s).clamp(0.0, CONFIRM_WITHIN_S);
    format!("{} asks to {}: {one} or {other} must confirm within {left_s:.0} s", ask.by, ask.act.name())
}

fn why_no_agreement(refusal: NoAgreement, act: Act, time_s: f64) -> String {
    match refusal {
        NoAgreement::Observer => "observers command nothing".to_string(),
        NoAgreement::AnotherAsks(ask) => ask_in_words(&ask, time_s),
        NoAgreement::NothingToConfirm => {
            format!("nobody asks to {}, or not by that number any more", act.name())
        }
        NoAgreement::OwnAsk(ask) => format!("{} asked: another role must confirm", ask.by),
        NoAgreement::SameRole(ask) => {
            format!("{} asked: another role than {} must confirm", ask.by, ask.by.role.name())
        }
    }
}

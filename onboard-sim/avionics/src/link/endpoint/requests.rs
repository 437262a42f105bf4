//! Keeps the stations' requests until the vehicle has decided. A command is acknowledged by the
//! frame that carried it out. Refusals are explained, but not without end.

use alloc::borrow::ToOwned as _;
use alloc::collections::BTreeMap;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

use flight::computer::Commander;
use flight::computer::crew::{Answer, CrewCommand, Ending, People, Request, Requests};
use flight::computer::messages::Severity;
use flight::rules::arming::Uplink;
use flight::rules::operator::Operator;
use flight::rules::phase::Phase;
use flight::rules::two_person::Station;
use protocol::command::{CommandAnswer, CommandRequest};
use protocol::dialect::MavResult;
use protocol::hub::Origin;
use protocol::identity::Address;

use super::VehicleEndpoint;
use super::addressing::can_move;
use crate::link::commands;
use crate::link::stations::Path;
use crate::link::vehicle::VehicleState;

/// Most commands that may wait for one frame (some milliseconds); more are refused for now. So many
/// aborts of no operator may wait beside them; one would do.
const MAX_WAITING: usize = 64;
/// Largest number that one frame decides; the vehicle's programme may add some.
const MAX_DECIDED: usize = 8;
/// How many answers are remembered, in case their commands are repeated.
const MAX_ANSWERED: usize = 16;

/// Uplink state for a frame of the vehicle, with the crew's requests.
#[derive(Debug, Clone, PartialEq)]
pub struct UplinkState {
    /// Uplink of the best station.
    pub uplink: Uplink,
    /// The station that armed the vehicle, if one did.
    pub commander: Option<Commander>,
    /// In order.
    pub requests: Requests,
}

/// A command that the vehicle decides in its next frame.
#[derive(Debug, Clone)]
pub(super) struct Waiting {
    path: Path,
    command: CommandRequest,
    request: Request,
}

/// A command with a number that was answered.
#[derive(Debug, Clone)]
pub(super) struct Answered {
    key: CommandKey,
    answer: (MavResult, Option<u16>),
}

/// Sender, command, number and operator: a repetition has the same.
type CommandKey = (Address, u16, u32, Option<Operator>);

fn key_of(command: &CommandRequest, by: Option<Operator>) -> Option<CommandKey> {
    Some((command.source, command.command, command.number()?, by))
}

impl VehicleEndpoint {
    /// Configures a vehicle that starts by itself: no station is required, and the silence of a
    /// station does not hold it.
    #[must_use]
    pub fn starting_by_itself(self) -> Self {
        Self { starts_by_itself: true, ..self }
    }

    /// Gives a command to the vehicle's next frame.
    pub(super) fn put(
        &mut self,
        path: Path,
        (command, by, station): (&CommandRequest, Option<Operator>, Station),
        crew_command: CrewCommand,
        vehicle: &VehicleState<'_>,
    ) {
        let link = path.link;
        // No operator has requested a hold that the station decided by itself.
        let reason = command.station_hold().filter(|_| crew_command == CrewCommand::Hold);
        let by = by.filter(|_| reason.is_none());
        if let Some(reason) = reason.filter(|_| vehicle.mode().countdown_end_s.is_some()) {
            let words = format!("station {station} holds by itself: {}", reason.words());
            self.send_text(Severity::Warning, &words);
        }
        // A command that moves something is executed once, however late a repetition arrives; one
        // that stops is executed every time.
        if let Some(key) = key_of(command, by).filter(|_| can_move(crew_command)) {
            if self.waiting.iter().any(|waiting| key_of(&waiting.command, waiting.request.by) == Some(key)) {
                return;
            }
            if let Some(answer) = self.answered.iter().find(|done| done.key == key).map(|done| done.answer) {
                return self.acknowledge(link, command, answer);
            }
        }
        // Other commands never displace an abort, and an abort without an operator never displaces
        // an operator's.
        let is_abort = |waiting: &&Waiting| waiting.request.command == CrewCommand::Abort;
        let aborts = self.waiting.iter().filter(is_abort).count();
        let is_full = match crew_command {
            CrewCommand::Abort => by.is_none() && aborts >= MAX_WAITING,
            _ => self.waiting.len() - aborts >= MAX_WAITING,
        };
        if is_full {
            return self.acknowledge(link, command, (MavResult::MAV_RESULT_TEMPORARILY_REJECTED, None));
        }
        let uplink = if self.starts_by_itself {
            Uplink::NotNeeded
        } else {
            self.stations.uplink(station, vehicle.time_s)
        };
        let confirms = commands::confirmed_proposal(command);
        let request = Request { command: crew_command, uplink, station: Some(station), by, confirms };
        // A station that repeats an abort before the decision is answered once. Another sender's
        // abort makes it a repetition: an observer may name the same address.
        let repeats =
            |waiting: &Waiting| waiting.command.source == command.source && waiting.request.by == by;
        if crew_command == CrewCommand::Abort
            && self.waiting.iter().any(|waiting| repeats(waiting) && waiting.request.command == crew_command)
        {
            return;
        }
        // One frame decides the first few: aborts come first.
        let place = if crew_command == CrewCommand::Abort { aborts } else { self.waiting.len() };
        self.waiting.insert(place, Waiting { path, command: *command, request });
    }

    /// Uplink state for the vehicle's next frame, with the crew's requests.
    pub fn uplink_state(&self, time_s: f64) -> UplinkState {
        let requests = self.waiting.iter().take(MAX_DECIDED).map(|waiting| waiting.request).collect();
        if self.starts_by_itself {
            return UplinkState { uplink: Uplink::NotNeeded, commander: None, requests };
        }
        let commander = self.stations.commander().map(|(station, by)| Commander {
            station,
            age_s: self.stations.age_s(station, time_s).unwrap_or(f64::INFINITY),
            by,
            deaf: self.stations.is_deaf(station),
        });
        UplinkState { uplink: self.stations.best_uplink(time_s), commander, requests }
    }

    /// Takes the vehicle's answers to the requests of the last [uplink state](Self::uplink_state);
    /// `vehicle` is its state after the decision. A dead flight computer gives no answers, and its
    /// requests are dropped.
    pub fn on_answers(&mut self, answers: &[Answer], vehicle: &VehicleState<'_>) {
        let later = self.waiting.split_off(self.waiting.len().min(MAX_DECIDED));
        let decided = core::mem::replace(&mut self.waiting, later);
        for (Waiting { path, command, request }, answer) in decided.into_iter().zip(answers) {
            let link = path.link;
            self.note_commander(&request, answer, vehicle);
            // Operators are identified by their keys.
            if vehicle.input().people.is_none() {
                self.name_sender(path, &request, answer);
            }
            // A COMMAND_CANCEL has no parameters.
            let is_cancelled = request.command == CrewCommand::EndCheck && command.params[0].is_nan();
            let result = match commands::mav_result(answer.ending) {
                MavResult::MAV_RESULT_ACCEPTED if is_cancelled => MavResult::MAV_RESULT_CANCELLED,
                result => result,
            };
            if request.command == CrewCommand::Abort {
                self.lane(link).answer_abort(CommandAnswer::to(&command, result));
            } else {
                let proposal = vehicle.computer.crew().two_person.waiting(vehicle.time_s);
                let proposal = proposal.filter(|_| answer.ending == Ending::ToConfirm);
                let answer = (result, proposal.map(|proposal| proposal.number));
                if let Some(key) = key_of(&command, request.by).filter(|_| can_move(request.command)) {
                    self.answered.truncate(MAX_ANSWERED - 1);
                    self.answered.push_front(Answered { key, answer });
                }
                self.acknowledge(link, &command, answer);
            }
        }
        // It has disarmed itself: the next station that arms it is in command.
        if vehicle.phase() == Phase::PadIdle {
            self.stations.set_commander(None);
        }
    }

    /// Reports from where a station arms, starts, takes command or aborts beside another station,
    /// which may not be of its crew.
    fn name_sender(&mut self, path: Path, request: &Request, answer: &Answer) {
        use CrewCommand as C;
        let Some(station) = request.station.filter(|station| self.stations.has_others(*station)) else {
            return;
        };
        let acts = matches!(request.command, C::Arm | C::Start | C::TakeCommand | C::Abort);
        if acts && answer.ending == Ending::Accepted {
            let from = match path.origin {
                Some(Origin::Datagram(from)) => format!("at {from}"),
                Some(Origin::Stream(_)) | None => format!("over link {}", path.link + 1),
            };
            self.send_text(Severity::Warning, &format!("{station} {from}: {}", request.command.name()));
        }
    }

    /// The first station that armed it is in command; of two people, the proposer's. A station that
    /// takes over is next.
    fn note_commander(&mut self, request: &Request, answer: &Answer, vehicle: &VehicleState<'_>) {
        let Some(station) = request.station.filter(|_| answer.ending == Ending::Accepted) else { return };
        let here = (station, request.by);
        match request.command {
            CrewCommand::Arm if vehicle.phase() == Phase::PadArmed && self.stations.armed_by().is_none() => {
                let proposal = vehicle.computer.crew().two_person.armed;
                let two = matches!(vehicle.input().people, Some(People::Two { .. }));
                let proposer = proposal.filter(|_| two).map(|one| (one.station, Some(one.by)));
                self.stations.set_commander(Some(proposer.unwrap_or(here)));
            }
            // Disarmed and armed again before the next frame: the next one is in command.
            CrewCommand::Disarm => self.stations.set_commander(None),
            CrewCommand::TakeCommand => self.stations.set_commander(Some(here)),
            _ => {}
        }
    }
}

// Limits how often refusals are explained: the reason is sent once and then counted, so that a
// flood of refused requests fills neither the radio nor the crew's screen.

/// Number of refused commands of one station that are answered at once. No client in use sends more
/// before it waits.
const AT_ONCE: f64 = 8.0;
/// After those, answers per second to one station's refused commands: each repetition waits 0.5 s.
const PER_S: f64 = 2.0;
/// Cost of an unsupported command, in answers: clients try many in a row, and wait for each. It has
/// no text. Twenty at ten a second are all answered, and five a second permanently.
const COST_OF_UNSUPPORTED: f64 = 0.4;
/// Number of stations tracked separately. A flood of forged addresses shares the last entry.
const MAX_STATIONS: usize = 16;

/// How often each station's refused commands are answered.
#[derive(Debug, Default)]
pub(super) struct Refusals {
    stations: BTreeMap<Address, Left>,
}

/// Answers left.
#[derive(Debug, Clone, Copy)]
struct Left {
    answers: f64,
    at_s: f64,
}

impl Refusals {
    /// Whether to answer one more refused command of a station.
    pub(super) fn may_answer(&mut self, station: Address, is_supported: bool, now_s: f64) -> bool {
        let cost = if is_supported { 1.0 } else { COST_OF_UNSUPPORTED };
        let known = self.stations.contains_key(&station) || self.stations.len() < MAX_STATIONS - 1;
        let place = if known { station } else { Address { system_id: 0, component_id: 0 } };
        let left = self.stations.entry(place).or_insert(Left { answers: AT_ONCE, at_s: now_s });
        left.answers = (left.answers + PER_S * (now_s - left.at_s).max(0.0)).min(AT_ONCE);
        left.at_s = now_s;
        let may = left.answers >= cost;
        if may {
            left.answers -= cost;
        }
        may
    }
}

/// Shortest time before the same warning is sent again, s, with the number of times it was held
/// back.
const REPEATED_AFTER_S: f64 = 5.0;
/// Most different warnings in that time; only the number of further ones is sent.
const MAX_DIFFERENT: usize = 8;

/// Recently sent warnings.
#[derive(Debug, Default)]
pub(super) struct Warnings {
    recent: Vec<RecentWarning>,
    others: u32,
    others_since_s: f64,
}

#[derive(Debug)]
struct RecentWarning {
    words: String,
    at_s: f64,
    more: u32,
}

impl Warnings {
    /// Whether to send a warning now. Texts that differ only in their digits are the same warning,
    /// because a newly measured value is no news.
    pub(super) fn is_new(&mut self, words: &str, now_s: f64) -> bool {
        if let Some(recent) = self.recent.iter_mut().find(|one| same_but_for_figures(&one.words, words)) {
            recent.more += 1;
            words.clone_into(&mut recent.words);
            return false;
        }
        if self.recent.len() >= MAX_DIFFERENT {
            if self.others == 0 {
                self.others_since_s = now_s;
            }
            self.others += 1;
            return false;
        }
        self.recent.push(RecentWarning { words: words.to_owned(), at_s: now_s, more: 0 });
        true
    }

    /// Texts with the counts that are due.
    pub(super) fn counted(&mut self, now_s: f64) -> Vec<String> {
        let mut words = Vec::new();
        self.recent.retain_mut(|recent| {
            if now_s - recent.at_s < REPEATED_AFTER_S {
                return true;
            }
            let more = core::mem::take(&mut recent.more);
            if more > 0 {
                recent.at_s = now_s;
                words.push(format!("{} ({more} more)", recent.words));
            }
            more > 0
        });
        if self.others > 0 && now_s - self.others_since_s >= REPEATED_AFTER_S {
            words.push(format!("{} other warnings", core::mem::take(&mut self.others)));
        }
        words
    }
}

fn same_but_for_figures(one: &str, other: &str) -> bool {
    let without = |words| {
        str::chars(words).filter(|character| !(character.is_ascii_digit() || ".-".contains(*character)))
    };
    without(one).eq(without(other))
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::identity::GROUND;

    #[test]
    fn a_station_that_repeats_is_answered_at_once_first_and_then_twice_a_second() {
        let mut refusals = Refusals::default();
        let answered = |refusals: &mut Refusals, from_s: f64| {
            (0..200).filter(|n| refusals.may_answer(GROUND, true, from_s + 0.05 * f64::from(*n))).count()
        };
        // 10 s at 20 Hz.
        assert!((26..=28).contains(&answered(&mut refusals, 0.0)));
        assert!((18..=20).contains(&answered(&mut refusals, 10.0)));
        // Another station is not delayed by this one.
        assert!(refusals.may_answer(Address { system_id: 254, component_id: 190 }, true, 20.0));
    }

    #[test]
    fn forged_addresses_share_one_place() {
        let mut refusals = Refusals::default();
        let stations = (1..=255).map(|system_id| Address { system_id, component_id: 1 });
        let answered = stations.clone().filter(|station| refusals.may_answer(*station, true, 0.0)).count();
        assert_eq!(answered, MAX_STATIONS - 1 + AT_ONCE as usize);
        assert_eq!(refusals.stations.len(), MAX_STATIONS);
    }

    #[test]
    fn a_warning_is_sent_once_and_then_counted() {
        let mut warnings = Warnings::default();
        assert!(warnings.is_new("arm refused: tilt: found 5.21 deg, required at most 5 deg", 0.0));
        for n in 1..=40 {
            assert!(
                !warnings
                    .is_new("arm refused: tilt: found 5.4 deg, required at most 5 deg", 0.1 * f64::from(n))
            );
        }
        assert!(warnings.counted(4.9).is_empty());
        let words = warnings.counted(5.0);
        assert_eq!(words, ["arm refused: tilt: found 5.4 deg, required at most 5 deg (40 more)"]);
        assert!(!warnings.is_new("arm refused: tilt: found 5.4 deg, required at most 5 deg", 6.0));
        assert!(warnings.is_new("arm refused: pin: found in, required out", 6.0), "another reason");
        assert_eq!(warnings.counted(11.0).len(), 1);
        assert!(warnings.counted(17.0).is_empty());
        assert!(
            warnings.is_new("arm refused: pin: found in, required out", 17.0),
            "after a pause it is news again"
        );
    }

    #[test]
    fn only_the_number_of_many_different_warnings_is_sent() {
        let mut warnings = Warnings::default();
        let mut words = (0..26u8).map(|n| format!("no {}", char::from(b'a' + n)));
        assert_eq!(words.by_ref().filter(|words| warnings.is_new(words, 0.0)).count(), MAX_DIFFERENT);
        assert_eq!(warnings.counted(5.0), ["18 other warnings"]);
    }
}

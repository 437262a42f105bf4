//! Arming and start by two people of different roles: one proposes, another confirms.
//!
//! A separate state machine: it takes who proposes or confirms what and when, and answers. It arms
//! and starts nothing itself; the phase table still decides the effect of an agreed request.
//!
//! A proposal has a number, and a confirmation names it. Two people who propose at the same moment
//! have therefore not confirmed each other, and a confirmation of an earlier proposal, or a late
//! repetition, confirms nothing. From the agreed start to the release the confirming operator taps
//! a key (or the proposing one, if the other is in command: the countdown, too, takes two). Without
//! a tap for [`TAP_WITHIN_S`] the countdown is held. A terminal does not report the release of a
//! key, so the taps replace the hand on a dead-man's switch, which amateur launch sites require of
//! a second person.
//!
//! Path of a proposal: a station sends the command, signed with its operator's key.
//! `protocol::signing` checks the frame with the key named by its link id, and the vehicle's
//! endpoint takes the operator from there. It refuses commands for another boot, for all vehicles,
//! and from ids used by two stations. `computer::crew` proposes here; the number is returned in the
//! answer and in TD_CREW, and the other operator's command names it. The number of people required
//! is in every frame's input, so a replay decides the same.

use core::fmt;
use serde::Serialize;

use super::operator::Operator;
use super::phase::UPLINK_SILENT_S;

/// Time limit of a confirmation, s.
pub const CONFIRM_WITHIN_S: f64 = 10.0;

/// Longest interval between two taps, s. It equals the silence of a station that holds the
/// countdown, so that the same limit applies to every loss. At two taps a second one tap may be
/// lost.
pub const TAP_WITHIN_S: f64 = UPLINK_SILENT_S;

/// Extra time for the first tap, s: the operator who has just confirmed the start must see the
/// countdown first.
const FIRST_TAP_LATER_S: f64 = 1.0;

/// Number of the n-th proposal from 0, never 0: a command without a number confirms nothing.
fn proposal_number(first: u16, nth: u16) -> u16 {
    let place = (u32::from(first) + u32::from(nth)) % u32::from(u16::MAX);
    place as u16 + 1
}

/// An act that takes two people.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[repr(u8)]
pub enum Act {
    Arm = 1,
    Start = 2,
}

impl Act {
    pub fn name(self) -> &'static str {
        match self {
            Self::Arm => "arm",
            Self::Start => "start",
        }
    }
}

/// A ground station, as the vehicle distinguishes it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Station {
    /// MAVLink system.
    pub system: u8,
    /// MAVLink component.
    pub component: u8,
    /// Distinguishes stations under the same ids: every station has another number.
    pub number: u32,
}

impl fmt::Display for Station {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{}/{}", self.system, self.component)
    }
}

/// A proposal waiting for its confirmation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Proposal {
    pub act: Act,
    /// Named by a confirmation: 1 to 65,535, different for each proposal.
    pub number: u16,
    pub by: Operator,
    pub station: Station,
    pub at_s: f64,
}

impl Proposal {
    /// Time left to confirm it, s; not positive once it has expired.
    pub fn left_s(&self, time_s: f64) -> f64 {
        self.at_s + CONFIRM_WITHIN_S - time_s
    }

    /// Also false for NaN.
    fn waits(&self, time_s: f64) -> bool {
        self.left_s(time_s) >= 0.0 && time_s >= self.at_s
    }
}

/// The operator whose taps keep the countdown running.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Tapping {
    pub by: Operator,
    /// The last tap, s.
    pub at_s: f64,
}

impl Tapping {
    /// Time left for the next tap, s; negative once it is overdue.
    pub fn left_s(&self, time_s: f64) -> f64 {
        self.at_s + TAP_WITHIN_S - time_s
    }
}

/// Why a request is not an agreement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NoAgreement {
    /// Observers may not command.
    Observer,
    /// Another person's proposal is already waiting for confirmation.
    Pending(Proposal),
    /// No proposal is waiting, or one with another number or act.
    NothingToConfirm,
    /// The proposing operator may not confirm.
    SamePerson(Proposal),
    /// The same role may not confirm.
    SameRole(Proposal),
}

/// The answer to a request.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reply {
    /// Recorded: an operator of another role must confirm.
    Proposed(Proposal),
    /// Two people of different roles have agreed.
    Agreed {
        proposal: Proposal,
        confirmed_by: Operator,
    },
    Refused(NoAgreement),
}

/// State of the proposal and of the taps.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct TwoPerson {
    /// Number of proposals so far.
    proposals: u16,
    proposal: Option<Proposal>,
    /// The agreed proposal that armed the vehicle: its operator is in command.
    pub armed: Option<Proposal>,
    /// The operator whose taps keep the countdown running.
    pub tapping: Option<Tapping>,
}

impl TwoPerson {
    /// Proposes an act, or confirms the proposal of this number. `first` is the number of the first
    /// proposal.
    pub fn request(
        &mut self,
        act: Act,
        confirms: Option<u16>,
        (by, station): (Operator, Station),
        first: u16,
        time_s: f64,
    ) -> Reply {
        if !by.role.may_command() {
            return Reply::Refused(NoAgreement::Observer);
        }
        let waiting = self.waiting(time_s);
        let Some(number) = confirms else {
            return match waiting {
                Some(other) if other.by.number != by.number => Reply::Refused(NoAgreement::Pending(other)),
                // A repeated proposal does not extend the time limit.
                Some(proposal) if proposal.act == act => Reply::Proposed(proposal),
                _ => {
                    let number = proposal_number(first, self.proposals);
                    let proposal = Proposal { act, number, by, station, at_s: time_s };
                    self.proposals = self.proposals.wrapping_add(1);
                    self.proposal = Some(proposal);
                    Reply::Proposed(proposal)
                }
            };
        };
        let Some(proposal) = waiting.filter(|one| one.act == act && one.number == number) else {
            return Reply::Refused(NoAgreement::NothingToConfirm);
        };
        if proposal.by.number == by.number {
            return Reply::Refused(NoAgreement::SamePerson(proposal));
        }
        if proposal.by.role == by.role {
            return Reply::Refused(NoAgreement::SameRole(proposal));
        }
        self.proposal = None;
        Reply::Agreed { proposal, confirmed_by: by }
    }

    /// The proposal waiting for its confirmation.
    pub fn waiting(&self, time_s: f64) -> Option<Proposal> {
        self.proposal.filter(|proposal| proposal.waits(time_s))
    }

    /// Withdraws the proposal after an abort, a disarm or a hold.
    pub fn withdraw(&mut self) {
        self.proposal = None;
    }

    /// Begins the countdown's taps by this operator, who is not in command.
    pub fn begin_taps(&mut self, by: Operator, time_s: f64) {
        self.tapping = Some(Tapping { by, at_s: time_s + FIRST_TAP_LATER_S });
    }

    /// Takes a tap; returns whether it counts.
    pub fn tap(&mut self, by: Operator, time_s: f64) -> bool {
        let Some(tapping) = self.tapping.as_mut().filter(|tapping| tapping.by.number == by.number) else {
            return false;
        };
        tapping.at_s = tapping.at_s.max(time_s);
        true
    }

    /// Ends the taps: the countdown has ended or is held.
    pub fn end_taps(&mut self) {
        self.tapping = None;
    }

    /// The operator whose taps are overdue.
    pub fn lapsed(&self, time_s: f64) -> Option<Operator> {
        // NaN counts as overdue.
        let in_time = |tapping: &Tapping| tapping.left_s(time_s) >= 0.0;
        self.tapping.filter(|tapping| !in_time(tapping)).map(|tapping| tapping.by)
    }
}

#[cfg(test)]
mod tests {
    //! The state machine against an independent account, over a million random sequences.

    use rand::{Rng as _, SeedableRng as _};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::rules::operator::{Name, Role};

    const STATION: Station = Station { system: 255, component: 190, number: 1 };

    fn operator(number: u8, role: Role) -> Operator {
        Operator { number, role, name: Name::new("") }
    }

    /// Two of one role, one each of two others, and an observer.
    fn people() -> [Operator; 5] {
        [
            operator(1, Role::RangeSafety),
            operator(2, Role::Flight),
            operator(3, Role::Flight),
            operator(4, Role::Pad),
            operator(5, Role::Observer),
        ]
    }

    fn propose(two: &mut TwoPerson, act: Act, by: Operator, time_s: f64) -> Reply {
        two.request(act, None, (by, STATION), 99, time_s)
    }

    fn confirms(two: &mut TwoPerson, act: Act, number: u16, by: Operator, time_s: f64) -> Reply {
        two.request(act, Some(number), (by, STATION), 99, time_s)
    }

    #[test]
    fn a_proposal_is_confirmed_by_another_role_within_ten_seconds() {
        let [range, flight, other_flight, pad, observer] = people();
        let mut two = TwoPerson::default();
        let Reply::Proposed(proposal) = propose(&mut two, Act::Arm, flight, 1.0) else {
            panic!("not proposed")
        };
        assert_eq!((proposal.number, proposal.by, proposal.act), (100, flight, Act::Arm));
        // A repeated proposal neither confirms itself nor extends the time limit.
        assert_eq!(propose(&mut two, Act::Arm, flight, 5.0), Reply::Proposed(proposal));
        let no = |refusal| Reply::Refused(refusal);
        assert_eq!(confirms(&mut two, Act::Arm, 100, flight, 2.0), no(NoAgreement::SamePerson(proposal)));
        assert_eq!(confirms(&mut two, Act::Arm, 100, other_flight, 2.0), no(NoAgreement::SameRole(proposal)));
        assert_eq!(confirms(&mut two, Act::Arm, 100, observer, 2.0), no(NoAgreement::Observer));
        assert_eq!(confirms(&mut two, Act::Arm, 101, range, 2.0), no(NoAgreement::NothingToConfirm));
        assert_eq!(confirms(&mut two, Act::Start, 100, range, 2.0), no(NoAgreement::NothingToConfirm));
        assert_eq!(propose(&mut two, Act::Arm, range, 2.0), no(NoAgreement::Pending(proposal)));
        assert_eq!(
            confirms(&mut two, Act::Arm, 100, pad, 11.0),
            Reply::Agreed { proposal, confirmed_by: pad }
        );
        assert_eq!(
            confirms(&mut two, Act::Arm, 100, pad, 11.0),
            no(NoAgreement::NothingToConfirm),
            "used up"
        );
    }

    #[test]
    fn a_proposal_expires_and_the_next_one_has_another_number() {
        let [range, flight, ..] = people();
        let mut two = TwoPerson::default();
        propose(&mut two, Act::Arm, flight, 1.0);
        let late = confirms(&mut two, Act::Arm, 100, range, 11.001);
        assert_eq!(late, Reply::Refused(NoAgreement::NothingToConfirm));
        let Reply::Proposed(proposal) = propose(&mut two, Act::Arm, range, 12.0) else {
            panic!("not proposed")
        };
        assert_eq!(proposal.number, 101);
        let old = confirms(&mut two, Act::Arm, 100, flight, 12.0);
        assert_eq!(old, Reply::Refused(NoAgreement::NothingToConfirm));
        two.withdraw();
        let withdrawn = confirms(&mut two, Act::Arm, 101, flight, 12.0);
        assert_eq!(withdrawn, Reply::Refused(NoAgreement::NothingToConfirm));
    }

    #[test]
    fn only_the_confirmer_s_taps_count_and_they_lapse() {
        let [range, flight, ..] = people();
        let mut two = TwoPerson::default();
        assert!(!two.tap(range, 0.0), "no countdown");
        two.begin_taps(range, 10.0);
        assert_eq!(two.lapsed(12.0), None);
        assert_eq!(two.lapsed(12.001), Some(range));
        assert!(!two.tap(flight, 11.0));
        assert!(two.tap(range, 11.5));
        assert_eq!(two.lapsed(12.5), None);
        assert!(two.tap(range, 11.0), "a tap from the past shortens nothing");
        assert_eq!(two.lapsed(12.5), None);
        assert_eq!(two.lapsed(12.501), Some(range));
        assert_eq!(two.lapsed(f64::NAN), Some(range));
        two.end_taps();
        assert_eq!(two.lapsed(100.0), None);
    }

    /// Independent record of all requests with their times, to look up the proposals afterwards.
    struct Account {
        proposed: Vec<(Act, u16, Operator, f64)>,
        used: Vec<u16>,
    }

    impl Account {
        /// Whether the record has an unused proposal of this number by another role in the last ten
        /// seconds.
        fn backs(&self, act: Act, number: u16, by: Operator, time_s: f64) -> bool {
            !self.used.contains(&number)
                && self.proposed.iter().any(|(proposed, of, proposer, at_s)| {
                    (*proposed, *of) == (act, number)
                        && proposer.role != by.role
                        && proposer.number != by.number
                        && proposer.role.may_command()
                        && by.role.may_command()
                        && (*at_s..=at_s + CONFIRM_WITHIN_S).contains(&time_s)
                })
        }
    }

    /// The requirement: a million random sequences of proposals, confirmations (right, wrong,
    /// replayed), withdrawals and pauses agree to nothing that two different roles had not proposed
    /// and confirmed. Sequences with one person only never agree.
    #[test]
    fn a_million_random_sequences_arm_nothing_without_two_keys() {
        let mut random = ChaCha8Rng::seed_from_u64(2);
        let people = people();
        let (mut agreed, mut agreed_alone, mut steps) = (0_u64, 0_u64, 0_u64);
        for sequence in 0..1_000_000_u64 {
            let mut two = TwoPerson::default();
            let first = random.next_u32() as u16;
            let mut account = Account { proposed: Vec::new(), used: Vec::new() };
            // Every fourth sequence has a single key: one person, with every message of theirs also
            // replayed.
            let alone = (sequence % 4 == 0).then(|| people[(random.next_u32() % 5) as usize]);
            let mut time_s = 0.0;
            for _ in 0..8 {
                steps += 1;
                let dice = random.next_u32();
                time_s += [0.0, 0.005, 0.5, 3.0, 9.995, 10.0, 10.005, 60.0][(dice & 7) as usize];
                let by = alone.unwrap_or(people[(dice >> 3 & 0xFF) as usize % 5]);
                let act = if (dice >> 11).is_multiple_of(4) { Act::Start } else { Act::Arm };
                let confirms = match dice >> 13 & 7 {
                    0..=2 => None,
                    // The latest number, an earlier one, the next one, any.
                    3..=5 => Some(proposal_number(first, account.proposed.len().max(1) as u16 - 1)),
                    6 => Some(proposal_number(first, (dice >> 16 & 3) as u16)),
                    _ => Some((dice >> 16) as u16),
                };
                if dice >> 29 == 0 {
                    two.withdraw();
                    account.used.extend(account.proposed.iter().map(|(_, number, ..)| *number));
                }
                match two.request(act, confirms, (by, STATION), first, time_s) {
                    Reply::Proposed(proposal) => {
                        assert_eq!(confirms, None);
                        if !account.proposed.iter().any(|(_, number, ..)| *number == proposal.number) {
                            account.proposed.push((act, proposal.number, by, time_s));
                        }
                    }
                    Reply::Agreed { proposal, confirmed_by } => {
                        assert!(confirms.is_some_and(|number| account.backs(act, number, by, time_s)));
                        assert_eq!((confirmed_by, confirms), (by, Some(proposal.number)));
                        account.used.push(proposal.number);
                        agreed += 1;
                        agreed_alone += u64::from(alone.is_some());
                    }
                    Reply::Refused(_) => {}
                }
            }
        }
        assert_eq!(agreed_alone, 0);
        assert!(
            steps == 8_000_000 && agreed > 50_000,
            "only {agreed} agreements: the sequences test too little"
        );
    }
}

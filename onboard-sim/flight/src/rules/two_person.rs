//! Arming and start by two people of different roles: one asks, another confirms.
//!
//! A state machine of its own: it takes who asks for what and when, and answers. Nothing is armed
//! or started here; the phase table still decides what an agreed request does.
//!
//! An ask has a number, and a confirmation names it: two people who ask at the same moment have not
//! confirmed each other, and a confirmation that was meant for an earlier ask, or is sent again
//! later, confirms nothing. From the agreed start to the release the one who confirmed it taps a
//! key (or the one who asked, if the other is in command: it takes two in the countdown, too);
//! without a tap for [`TAP_WITHIN_S`] the countdown is held. A terminal reports no release of a
//! key, so the taps stand for the hand on a dead-man's switch, which amateur launch sites ask of a
//! second person.
//!
//! The way of an ask: a station sends the command, signed with its operator's own key.
//! `protocol::signing` checks the frame with the key that its link id names, and the vehicle's
//! endpoint takes the operator from there; it refuses what names another boot, what is for
//! everybody, and what comes from ids under which two stations are heard. `computer::crew` asks
//! here; the number goes back in the answer and in TD_CREW, and the other operator's command names
//! it. How many people it takes is in every frame's input, so a replay decides the same.

use core::fmt;
use serde::Serialize;

use super::operator::Operator;
use super::phase::UPLINK_SILENT_S;

/// How long an ask waits for its confirmation, s.
pub const CONFIRM_WITHIN_S: f64 = 10.0;

/// The longest time between two taps, s. As long as the silence of a station that holds the
/// countdown, so that one sum holds for all that can be lost. Whoever taps twice a second may have
/// one tap lost.
pub const TAP_WITHIN_S: f64 = UPLINK_SILENT_S;

/// The first tap may come so much later, s: whoever has just confirmed the start has to see the
/// countdown first.
const FIRST_TAP_LATER_S: f64 = 1.0;

/// The number of the n-th ask from 0, never 0: a command without a number confirms nothing.
fn ask_number(first: u16, nth: u16) -> u16 {
    let place = (u32::from(first) + u32::from(nth)) % u32::from(u16::MAX);
    place as u16 + 1
}

/// What takes two people.
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

/// A ground station, as the vehicle tells it apart from others.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Station {
    /// MAVLink system.
    pub system: u8,
    /// MAVLink component.
    pub component: u8,
    /// Which of those that were heard under these ids: every station has another number.
    pub number: u32,
}

impl fmt::Display for Station {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{}/{}", self.system, self.component)
    }
}

/// An ask that waits for its confirmation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Ask {
    pub act: Act,
    /// A confirmation names it: 1 to 65,535, another one for each ask.
    pub number: u16,
    pub by: Operator,
    pub station: Station,
    pub at_s: f64,
}

impl Ask {
    /// Time left to confirm it, s; not positive once it has lapsed.
    pub fn left_s(&self, time_s: f64) -> f64 {
        self.at_s + CONFIRM_WITHIN_S - time_s
    }

    /// Also false for a time that is not a number.
    fn waits(&self, time_s: f64) -> bool {
        self.left_s(time_s) >= 0.0 && time_s >= self.at_s
    }
}

/// Whose taps keep the countdown running.
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
    /// Observers command nothing.
    Observer,
    /// Another person's ask already waits: it is to be confirmed.
    AnotherAsks(Ask),
    /// Nothing waits for a confirmation, or another number or act does.
    NothingToConfirm,
    /// Nobody confirms their own ask.
    OwnAsk(Ask),
    /// The same role may not confirm.
    SameRole(Ask),
}

/// The answer to a request.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reply {
    /// Noted: now somebody of another role has to confirm.
    Asked(Ask),
    /// Two people of different roles have agreed.
    Agreed {
        ask: Ask,
        confirmed_by: Operator,
    },
    Refused(NoAgreement),
}

/// What is asked, and whose taps are waited for.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct TwoPerson {
    /// How many asks there were.
    asks: u16,
    ask: Option<Ask>,
    /// The agreed ask that armed the vehicle.
    armed: Option<Ask>,
    tapping: Option<Tapping>,
}

impl TwoPerson {
    /// Asks for an act, or confirms the ask of this number. `first` is where the numbers of the
    /// asks begin.
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
                Some(ask) if ask.by.number != by.number => Reply::Refused(NoAgreement::AnotherAsks(ask)),
                // A repeated ask does not wait longer.
                Some(ask) if ask.act == act => Reply::Asked(ask),
                _ => self.ask(act, (by, station), first, time_s),
            };
        };
        let Some(ask) = waiting.filter(|ask| ask.act == act && ask.number == number) else {
            return Reply::Refused(NoAgreement::NothingToConfirm);
        };
        if ask.by.number == by.number {
            return Reply::Refused(NoAgreement::OwnAsk(ask));
        }
        if ask.by.role == by.role {
            return Reply::Refused(NoAgreement::SameRole(ask));
        }
        self.ask = None;
        Reply::Agreed { ask, confirmed_by: by }
    }

    fn ask(&mut self, act: Act, (by, station): (Operator, Station), first: u16, time_s: f64) -> Reply {
        let number = ask_number(first, self.asks);
        let ask = Ask { act, number, by, station, at_s: time_s };
        self.asks = self.asks.wrapping_add(1);
        self.ask = Some(ask);
        Reply::Asked(ask)
    }

    /// The ask that waits for its confirmation.
    pub fn waiting(&self, time_s: f64) -> Option<Ask> {
        self.ask.filter(|ask| ask.waits(time_s))
    }

    /// Takes back what is asked: an abort, a disarm or a hold came.
    pub fn withdraw(&mut self) {
        self.ask = None;
    }

    /// Notes that the agreed ask has armed the vehicle.
    pub fn armed(&mut self, ask: Ask) {
        self.armed = Some(ask);
    }

    /// The ask that armed the vehicle: the one who asked is in command.
    pub fn armed_by(&self) -> Option<Ask> {
        self.armed
    }

    /// The countdown has begun: from now on this operator taps, who is not in command.
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

    /// The countdown has ended or is held: no taps are waited for.
    pub fn end_taps(&mut self) {
        self.tapping = None;
    }

    /// Whose taps keep the countdown running.
    pub fn tapping(&self) -> Option<Tapping> {
        self.tapping
    }

    /// The operator whose taps are overdue.
    pub fn lapsed(&self, time_s: f64) -> Option<Operator> {
        // A time that is not a number has lapsed, too.
        let in_time = |tapping: &Tapping| tapping.left_s(time_s) >= 0.0;
        self.tapping.filter(|tapping| !in_time(tapping)).map(|tapping| tapping.by)
    }
}

#[cfg(test)]
mod tests {
    //! The ladder against a plain second account of it, over a million random sequences.

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

    fn asks(two: &mut TwoPerson, act: Act, by: Operator, time_s: f64) -> Reply {
        two.request(act, None, (by, STATION), 99, time_s)
    }

    fn confirms(two: &mut TwoPerson, act: Act, number: u16, by: Operator, time_s: f64) -> Reply {
        two.request(act, Some(number), (by, STATION), 99, time_s)
    }

    #[test]
    fn one_asks_and_another_role_confirms_within_ten_seconds() {
        let [range, flight, other_flight, pad, observer] = people();
        let mut two = TwoPerson::default();
        let Reply::Asked(ask) = asks(&mut two, Act::Arm, flight, 1.0) else { panic!("not asked") };
        assert_eq!((ask.number, ask.by, ask.act), (100, flight, Act::Arm));
        // A repeated ask neither confirms itself nor waits longer.
        assert_eq!(asks(&mut two, Act::Arm, flight, 5.0), Reply::Asked(ask));
        let no = |refusal| Reply::Refused(refusal);
        assert_eq!(confirms(&mut two, Act::Arm, 100, flight, 2.0), no(NoAgreement::OwnAsk(ask)));
        assert_eq!(confirms(&mut two, Act::Arm, 100, other_flight, 2.0), no(NoAgreement::SameRole(ask)));
        assert_eq!(confirms(&mut two, Act::Arm, 100, observer, 2.0), no(NoAgreement::Observer));
        assert_eq!(confirms(&mut two, Act::Arm, 101, range, 2.0), no(NoAgreement::NothingToConfirm));
        assert_eq!(confirms(&mut two, Act::Start, 100, range, 2.0), no(NoAgreement::NothingToConfirm));
        assert_eq!(asks(&mut two, Act::Arm, range, 2.0), no(NoAgreement::AnotherAsks(ask)));
        assert_eq!(confirms(&mut two, Act::Arm, 100, pad, 11.0), Reply::Agreed { ask, confirmed_by: pad });
        assert_eq!(
            confirms(&mut two, Act::Arm, 100, pad, 11.0),
            no(NoAgreement::NothingToConfirm),
            "used up"
        );
    }

    #[test]
    fn an_ask_lapses_and_the_next_one_has_another_number() {
        let [range, flight, ..] = people();
        let mut two = TwoPerson::default();
        asks(&mut two, Act::Arm, flight, 1.0);
        let late = confirms(&mut two, Act::Arm, 100, range, 11.001);
        assert_eq!(late, Reply::Refused(NoAgreement::NothingToConfirm));
        let Reply::Asked(ask) = asks(&mut two, Act::Arm, range, 12.0) else { panic!("not asked") };
        assert_eq!(ask.number, 101);
        let old = confirms(&mut two, Act::Arm, 100, flight, 12.0);
        assert_eq!(old, Reply::Refused(NoAgreement::NothingToConfirm));
        two.withdraw();
        let gone = confirms(&mut two, Act::Arm, 101, flight, 12.0);
        assert_eq!(gone, Reply::Refused(NoAgreement::NothingToConfirm));
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

    /// What an outsider remembers of all requests: every one with its time, to look up afterwards
    /// who had really asked.
    struct Account {
        asked: Vec<(Act, u16, Operator, f64)>,
        used: Vec<u16>,
    }

    impl Account {
        /// Whether the log of requests holds an unused ask of this number by another role in the
        /// last ten seconds.
        fn backs(&self, act: Act, number: u16, by: Operator, time_s: f64) -> bool {
            !self.used.contains(&number)
                && self.asked.iter().any(|(asked, of, asker, at_s)| {
                    (*asked, *of) == (act, number)
                        && asker.role != by.role
                        && asker.number != by.number
                        && asker.role.may_command()
                        && by.role.may_command()
                        && (*at_s..=at_s + CONFIRM_WITHIN_S).contains(&time_s)
                })
        }
    }

    /// The bar: a million random sequences of asks, confirmations (right, wrong, replayed),
    /// withdrawals and pauses agree to nothing that two different roles had not asked and
    /// confirmed. Sequences with one person only never agree.
    #[test]
    fn a_million_random_sequences_arm_nothing_without_two_keys() {
        let mut random = ChaCha8Rng::seed_from_u64(2);
        let people = people();
        let (mut agreed, mut agreed_alone, mut steps) = (0_u64, 0_u64, 0_u64);
        for sequence in 0..1_000_000_u64 {
            let mut two = TwoPerson::default();
            let first = random.next_u32() as u16;
            let mut account = Account { asked: Vec::new(), used: Vec::new() };
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
                    3..=5 => Some(ask_number(first, account.asked.len().max(1) as u16 - 1)),
                    6 => Some(ask_number(first, (dice >> 16 & 3) as u16)),
                    _ => Some((dice >> 16) as u16),
                };
                if dice >> 29 == 0 {
                    two.withdraw();
                    account.used.extend(account.asked.iter().map(|(_, number, ..)| *number));
                }
                match two.request(act, confirms, (by, STATION), first, time_s) {
                    Reply::Asked(ask) => {
                        assert_eq!(confirms, None);
                        if !account.asked.iter().any(|(_, number, ..)| *number == ask.number) {
                            account.asked.push((act, ask.number, by, time_s));
                        }
                    }
                    Reply::Agreed { ask, confirmed_by } => {
                        assert!(confirms.is_some_and(|number| account.backs(act, number, by, time_s)));
                        assert_eq!((confirmed_by, confirms), (by, Some(ask.number)));
                        account.used.push(ask.number);
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

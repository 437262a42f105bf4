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
    assert_eq!(confirms(&mut two, Act::Arm, 100, flight, 2.0), no(Refusal::OwnAsk(ask)));
    assert_eq!(confirms(&mut two, Act::Arm, 100, other_flight, 2.0), no(Refusal::SameRole(ask)));
    assert_eq!(confirms(&mut two, Act::Arm, 100, observer, 2.0), no(Refusal::Observer));
    assert_eq!(confirms(&mut two, Act::Arm, 101, range, 2.0), no(Refusal::NothingToConfirm));
    assert_eq!(confirms(&mut two, Act::Start, 100, range, 2.0), no(Refusal::NothingToConfirm));
    assert_eq!(asks(&mut two, Act::Arm, range, 2.0), no(Refusal::AnotherAsks(ask)));
    assert_eq!(confirms(&mut two, Act::Arm, 100, pad, 11.0), Reply::Agreed { ask, confirmed_by: pad });
    assert_eq!(confirms(&mut two, Act::Arm, 100, pad, 11.0), no(Refusal::NothingToConfirm), "used up");
}

#[test]
fn an_ask_lapses_and_the_next_one_has_another_number() {
    let [range, flight, ..] = people();
    let mut two = TwoPerson::default();
    asks(&mut two, Act::Arm, flight, 1.0);
    let late = confirms(&mut two, Act::Arm, 100, range, 11.001);
    assert_eq!(late, Reply::Refused(Refusal::NothingToConfirm));
    let Reply::Asked(ask) = asks(&mut two, Act::Arm, range, 12.0) else { panic!("not asked") };
    assert_eq!(ask.number, 101);
    let old = confirms(&mut two, Act::Arm, 100, flight, 12.0);
    assert_eq!(old, Reply::Refused(Refusal::NothingToConfirm));
    two.withdraw();
    let gone = confirms(&mut two, Act::Arm, 101, flight, 12.0);
    assert_eq!(gone, Reply::Refused(Refusal::NothingToConfirm));
}

#[test]
fn only_the_confirmer_s_taps_count_and_they_lapse_after_two_seconds() {
    let [range, flight, ..] = people();
    let mut two = TwoPerson::default();
    assert!(!two.tap(range, 0.0), "no countdown");
    two.begin_taps(range, 10.0);
    assert_eq!(two.lapsed(12.0), None);
    assert_eq!(two.lapsed(12.001), Some(range));
    assert!(!two.tap(flight, 11.0));
    assert!(two.tap(range, 11.5));
    assert_eq!(two.lapsed(13.5), None);
    assert!(two.tap(range, 11.0), "a tap from the past shortens nothing");
    assert_eq!(two.lapsed(13.5), None);
    assert_eq!(two.lapsed(f64::NAN), Some(range));
    two.end_taps();
    assert_eq!(two.lapsed(100.0), None);
}

/// What an outsider remembers of all requests: every one with its time, to look up afterwards who had really asked.
struct Account {
    asked: Vec<(Act, u16, Operator, f64)>,
    used: Vec<u16>,
}

impl Account {
    /// Whether the log of requests holds an unused ask of this number by another role in the last ten seconds.
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

/// The bar: a million random sequences of asks, confirmations (right, wrong, replayed), withdrawals and pauses agree to
/// nothing that two different roles had not asked and confirmed. Sequences with one person only never agree.
#[test]
fn a_million_random_sequences_arm_nothing_without_two_keys() {
    let mut random = ChaCha8Rng::seed_from_u64(2);
    let people = people();
    let (mut agreed, mut agreed_alone, mut steps) = (0_u64, 0_u64, 0_u64);
    for sequence in 0..1_000_000_u64 {
        let mut two = TwoPerson::default();
        let first = random.next_u32() as u16;
        let mut account = Account { asked: Vec::new(), used: Vec::new() };
        // Every fourth sequence has a single key: one person, with every message of theirs also replayed.
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
    assert!(steps == 8_000_000 && agreed > 50_000, "only {agreed} agreements: the sequences test too little");
}

//! Who commands, what is asked and what is waited for, for telemetry.

use alloc::vec::Vec;

use flight::computer::crew::People;
use flight::rules::operator::Operator;
use flight::rules::two_person::{Act, Station};

use super::Known;

/// What the crew is told of itself.
#[derive(Debug, Clone, PartialEq)]
pub struct CrewFacts {
    pub people: People,
    pub operators: Vec<Operator>,
    /// What waits for a confirmation: the act, its number, who asks, and the time left, s.
    pub ask: Option<(Act, u16, Operator, f64)>,
    /// Who has to tap, and the time left, s.
    pub tap: Option<(Operator, f64)>,
    /// The station that armed the vehicle or has taken command, and its operator.
    pub commander: Option<(Station, Option<Operator>)>,
    /// Who held the last countdown, or whose silence did.
    pub held_by: Option<Operator>,
}

impl Known<'_> {
    pub(super) fn crew_facts(&self) -> Option<CrewFacts> {
        let (memory, time_s) = (self.computer.crew(), self.time_s);
        let ask = memory.two_person.waiting(time_s);
        let tap = memory.two_person.tapping();
        Some(CrewFacts {
            people: self.people?,
            operators: self.operators.to_vec(),
            ask: ask.map(|ask| (ask.act, ask.number, ask.by, ask.left_s(time_s))),
            tap: tap.map(|tapping| (tapping.by, tapping.left_s(time_s))),
            commander: self.commander.map(|commander| (commander.station, commander.by)),
            held_by: memory.held_by,
        })
    }
}

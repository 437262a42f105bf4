//! Who commands, what is asked, and which mission flies.

use flight::computer::crew::People;
use flight::rules::operator::{Operator, Role};
use flight::rules::two_person::Act;
use mavlink_core::MessageData as _;
use mavlink_core::types::CharArray;
use protocol::dialect::{MavMessage, TD_CREW_DATA, TD_MISSION_DATA, TD_OPERATOR_DATA, TdAct, TdRole};

use super::{boot_ms, characters};
use crate::snapshot::{CrewFacts, Snapshot};

pub(super) fn message(message_id: u32, snapshot: &Snapshot) -> Option<MavMessage> {
    match message_id {
        TD_CREW_DATA::ID => snapshot.crew.as_ref().map(|crew| state(crew, snapshot.time_s)),
        TD_OPERATOR_DATA::ID => snapshot.crew.as_ref().and_then(|crew| operator(crew, snapshot.time_s)),
        // It matters before the flight only, and there it costs no position.
        TD_MISSION_DATA::ID => snapshot.phase.on_pad().then(|| mission(snapshot)),
        _ => None,
    }
}

fn mission(snapshot: &Snapshot) -> MavMessage {
    let name = characters(&snapshot.mission.name);
    MavMessage::TD_MISSION(TD_MISSION_DATA { hash: snapshot.mission.hash.0, name })
}

fn state(crew: &CrewFacts, time_s: f64) -> MavMessage {
    let ms = |left_s: f64| (1000.0 * left_s).clamp(0.0, f64::from(u16::MAX)) as u16;
    let number = |operator: Option<Operator>| operator.map_or(0, |operator| operator.number);
    let commander = crew.commander.map(|(station, _)| station);
    MavMessage::TD_CREW(TD_CREW_DATA {
        time_boot_ms: boot_ms(time_s),
        ask_number: crew.ask.map_or(0, |(_, number, ..)| number),
        ask_left_ms: crew.ask.map_or(0, |(.., left_s)| ms(left_s)),
        tap_left_ms: crew.tap.map_or(0, |(_, left_s)| ms(left_s)),
        people: match crew.people {
            People::One => 1,
            People::Two { .. } => 2,
        },
        act: match crew.ask.map(|(act, ..)| act) {
            None => TdAct::TD_ACT_NONE,
            Some(Act::Arm) => TdAct::TD_ACT_ARM,
            Some(Act::Start) => TdAct::TD_ACT_START,
        },
        asked_by: number(crew.ask.map(|(_, _, by, _)| by)),
        tapped_by: number(crew.tap.map(|(by, _)| by)),
        commanded_by: number(crew.commander.and_then(|(_, by)| by)),
        commanding_system: commander.map_or(0, |station| station.system),
        commanding_component: commander.map_or(0, |station| station.component),
        held_by: number(crew.held_by),
    })
}

/// Operators per second.
const TURNS_PER_S: f64 = 0.5;

/// Each operator in turn.
fn operator(crew: &CrewFacts, time_s: f64) -> Option<MavMessage> {
    let count = crew.operators.len().max(1);
    let operator = crew.operators.get((TURNS_PER_S * time_s) as usize % count)?;
    let role = match operator.role {
        Role::Observer => TdRole::TD_ROLE_OBSERVER,
        Role::RangeSafety => TdRole::TD_ROLE_RANGE_SAFETY,
        Role::Flight => TdRole::TD_ROLE_FLIGHT,
        Role::Pad => TdRole::TD_ROLE_PAD,
    };
    Some(MavMessage::TD_OPERATOR(TD_OPERATOR_DATA {
        number: operator.number,
        role,
        name: CharArray::new(*operator.name.bytes()),
    }))
}

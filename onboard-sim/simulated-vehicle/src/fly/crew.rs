//! The people who may command, from a crew file into the vehicle's own types.

use flight::computer::crew::People;
use flight::rules::operator::{Name, Operator, Role};
use protocol::crew_file::{CrewFile, Mode};
use protocol::dialect::TdRole;

/// The operators with keys, in the order of the file.
pub(super) fn operators_of(crew: &CrewFile) -> Vec<Operator> {
    let operator = |member: &protocol::crew_file::Member| {
        let (number, _) = member.key.as_ref()?;
        let role = match member.role {
            TdRole::TD_ROLE_OBSERVER => Role::Observer,
            TdRole::TD_ROLE_RANGE_SAFETY => Role::RangeSafety,
            TdRole::TD_ROLE_FLIGHT => Role::Flight,
            TdRole::TD_ROLE_PAD => Role::Pad,
        };
        Some(Operator { number: *number, role, name: Name::new(&member.name) })
    };
    crew.members.iter().filter_map(operator).collect()
}

/// How many people an arming and a start take. The numbers of the asks begin elsewhere at each boot.
pub(super) fn people_of(crew: &CrewFile, boot_number: u32) -> People {
    match crew.mode {
        Mode::OnePerson => People::One,
        Mode::TwoPerson => People::Two { first_ask: boot_number as u16 },
    }
}

//! The airframes of the built-in missions.

use crate::vehicle::airframe::Airframe;

use super::mission;

/// The airframe of the built-in mission of that name, if there is one.
pub fn builtin(name: &str) -> Option<Airframe> {
    Some(mission::builtin(name)?.ok()?.airframe)
}

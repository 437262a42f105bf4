//! The vehicle's parameters: what a ground may read by name, and the little that it may set.
//!
//! The rate of each message, in hertz, may be set while the vehicle stands disarmed on the pad. The landing cost's
//! weights may be read: they come from the profile, which the log holds, so that a replay computes with the same
//! ones. Limits that keep anybody safe are no parameters. The list never changes in flight.

use flight::profile::Profile;
use protocol::dialect::{MavMessage, MavParamError};
use protocol::parameter::{ParamId, ParamKey, is_real32, value_message};

use crate::streams::{STANDARD, Streams};

/// A weight of the landing cost, by its parameter's name.
struct Weight {
    name: &'static str,
    of: fn(&Profile) -> f64,
}

/// The weights of the landing cost (the profile's `nmpc.weights`).
const WEIGHTS: [Weight; 7] = [
    Weight { name: "NMPC_W_X", of: |profile| profile.nmpc.weights.x },
    Weight { name: "NMPC_W_Z", of: |profile| profile.nmpc.weights.z },
    Weight { name: "NMPC_W_THETA", of: |profile| profile.nmpc.weights.theta },
    Weight { name: "NMPC_W_U", of: |profile| profile.nmpc.weights.u },
    Weight { name: "NMPC_W_W", of: |profile| profile.nmpc.weights.w },
    Weight { name: "NMPC_W_Q", of: |profile| profile.nmpc.weights.q },
    Weight { name: "NMPC_W_DELTA", of: |profile| profile.nmpc.weights.delta },
];

/// How many parameters there are; their places are 0 to this, less one. Rates first, then weights.
pub const COUNT: u16 = (STANDARD.len() + WEIGHTS.len()) as u16;

/// Why a parameter keeps its value.
#[derive(Debug, Clone, PartialEq)]
pub struct Refusal {
    /// For PARAM_ERROR, where there is no value to answer with.
    pub error: MavParamError,
    /// In words for the crew.
    pub reason: String,
}

/// The place of a parameter in the list, if it is there.
pub fn place_of(key: ParamKey) -> Option<u16> {
    match key {
        ParamKey::Index(index) => u16::try_from(index).ok().filter(|index| *index < COUNT),
        ParamKey::Name(id) => (0..COUNT).find(|place| id.is(name(*place))),
    }
}

fn name(place: u16) -> &'static str {
    let place = usize::from(place);
    match STANDARD.get(place) {
        Some(stream) => stream.parameter,
        None => WEIGHTS[place - STANDARD.len()].name,
    }
}

/// PARAM_VALUE of the parameter at a place below [`COUNT`].
pub fn value(place: u16, streams: &Streams, profile: &Profile) -> MavMessage {
    let found = match STANDARD.get(usize::from(place)) {
        Some(stream) => streams.rate_hz(stream.message_id),
        None => (WEIGHTS[usize::from(place) - STANDARD.len()].of)(profile),
    };
    value_message(name(place), found as f32, place, COUNT)
}

/// Sets a parameter; `may_change` says whether the vehicle stands disarmed on the pad. Returns the parameter's place,
/// whose value is to be told in any case, with the refusal, if it was not changed as asked.
///
/// # Errors
/// There is no such parameter.
pub fn set(
    id: ParamId,
    value: f32,
    value_type: u8,
    may_change: bool,
    streams: &mut Streams,
    now_s: f64,
) -> Result<(u16, Option<Refusal>), Refusal> {
    let Some(place) = place_of(ParamKey::Name(id)) else {
        let reason = format!("parameter {}: there is none of this name", id.printable());
        return Err(Refusal { error: MavParamError::MAV_PARAM_ERROR_DOES_NOT_EXIST, reason });
    };
    let name = name(place);
    let refuse = |error, why: &str| Some(Refusal { error, reason: format!("{name} not set: {why}") });
    let refusal = match STANDARD.get(usize::from(place)) {
        _ if !is_real32(value_type) => refuse(
            MavParamError::MAV_PARAM_ERROR_TYPE_MISMATCH,
            "its type is REAL32 (MAV_PARAM_TYPE 9), as every parameter's here",
        ),
        None => refuse(
            MavParamError::MAV_PARAM_ERROR_READ_ONLY,
            "it comes from the profile (nmpc.weights); fly another profile",
        ),
        Some(_) if !may_change => {
            refuse(MavParamError::MAV_PARAM_ERROR_PERMISSION_DENIED, "only while disarmed on the pad")
        }
        Some(stream) => {
            // 0 Hz is off; the rest is the interval's business, with its budget.
            let interval_us = if value == 0.0 { -1.0 } else { 1e6 / value };
            match streams.set_interval(stream.message_id, interval_us, now_s) {
                (_, None) => None,
                (_, Some(why)) => refuse(MavParamError::MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE, &why),
            }
        }
    };
    Ok((place, refusal))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_fit_their_field_and_are_told_apart() {
        for place in 0..COUNT {
            assert!((1..=ParamId::MAX_LEN).contains(&name(place).len()), "{}", name(place));
            assert_eq!(place_of(ParamKey::Name(ParamId::new(name(place)))), Some(place));
            assert_eq!(place_of(ParamKey::Index(place.cast_signed())), Some(place));
        }
        assert!((0..COUNT).any(|place| name(place).len() == ParamId::MAX_LEN), "one has no terminator");
        for outside in [-2, COUNT.cast_signed(), i16::MAX, i16::MIN] {
            assert_eq!(place_of(ParamKey::Index(outside)), None);
        }
    }

    #[test]
    fn no_limit_is_a_parameter() {
        for place in 0..COUNT {
            assert!(name(place).starts_with("RATE_") || name(place).starts_with("NMPC_W_"));
        }
    }
}

//! The vehicle's parameters: values that a ground station may read by name, and the few that it may
//! set.
//!
//! The station in command may set the rate of each message, in hertz, at any time, as with
//! MAV_CMD_SET_MESSAGE_INTERVAL: on the requesting link, within its budget. The weights of the
//! landing cost are read-only: they come from the mission, which the log holds, so that a replay
//! uses the same ones. Safety limits are not parameters. The list of names never changes.

use alloc::format;
use alloc::string::String;
use flight::vehicle::mission::PlanWeights;
use protocol::dialect::{MavMessage, MavParamError};
use protocol::parameter::{ParamId, ParamKey, is_real32, value_message};

use crate::link::streams::{STANDARD, Streams};

/// A weight of the landing cost, by its parameter's name.
struct Weight {
    name: &'static str,
    of: fn(&PlanWeights) -> f64,
}

/// The weights of the landing cost (a mission's `powered.weights`).
const WEIGHTS: [Weight; 5] = [
    Weight { name: "NMPC_W_X", of: |weights| weights.x },
    Weight { name: "NMPC_W_THETA", of: |weights| weights.theta },
    Weight { name: "NMPC_W_Q", of: |weights| weights.q },
    Weight { name: "NMPC_W_DELTA", of: |weights| weights.delta },
    Weight { name: "NMPC_W_FINS", of: |weights| weights.fins },
];

/// Number of parameters; their indices are 0 to this number minus one. Rates first, then weights.
pub const COUNT: u16 = (STANDARD.len() + WEIGHTS.len()) as u16;

/// Why a parameter is unchanged.
#[derive(Debug, Clone, PartialEq)]
pub struct Refusal {
    /// For PARAM_ERROR, if there is no value to answer with.
    pub error: MavParamError,
    /// As text for the crew.
    pub reason: String,
}

/// The index of a parameter in the list, if it exists.
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

/// PARAM_VALUE of the parameter at an index below [`COUNT`].
pub fn value(place: u16, streams: &Streams, weights: &PlanWeights) -> MavMessage {
    let found = match STANDARD.get(usize::from(place)) {
        Some(stream) => streams.rate_hz(stream.message_id),
        None => (WEIGHTS[usize::from(place) - STANDARD.len()].of)(weights),
    };
    value_message(name(place), found as f32, place, COUNT)
}

/// Sets a parameter; `forbidden` is the reason why this station may set none now. Returns the index
/// of the parameter, whose value is to be sent in any case, and the refusal if it was not changed
/// as requested.
///
/// # Errors
/// No parameter of that name.
pub fn set(
    id: ParamId,
    value: f32,
    value_type: u8,
    forbidden: Option<String>,
    streams: &mut Streams,
    now_s: f64,
) -> Result<(u16, Option<Refusal>), Refusal> {
    let Some(place) = place_of(ParamKey::Name(id)) else {
        let reason = format!("parameter {}: no parameter has this name", id.printable());
        return Err(Refusal { error: MavParamError::MAV_PARAM_ERROR_DOES_NOT_EXIST, reason });
    };
    let name = name(place);
    let refuse = |error, why: &str| Some(Refusal { error, reason: format!("{name} not set: {why}") });
    let refusal = match (STANDARD.get(usize::from(place)), forbidden) {
        _ if !is_real32(value_type) => refuse(
            MavParamError::MAV_PARAM_ERROR_TYPE_MISMATCH,
            "its type is REAL32 (MAV_PARAM_TYPE 9), as every parameter's here",
        ),
        (None, _) => refuse(
            MavParamError::MAV_PARAM_ERROR_READ_ONLY,
            "it comes from the mission (weights of the landing cost); fly another mission",
        ),
        (Some(_), Some(why)) => refuse(MavParamError::MAV_PARAM_ERROR_PERMISSION_DENIED, &why),
        (Some(_), None) if !(value.is_finite() && value >= 0.0) => {
            refuse(MavParamError::MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE, "it must be 0 (off) or a rate in Hz")
        }
        (Some(stream), None) => {
            // 0 Hz is off; the check against the budget is done with the interval.
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
    fn names_fit_their_field_and_are_unique() {
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

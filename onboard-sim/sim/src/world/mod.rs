//! Simulates the physical truth: a rigid rocket in wind, its actuators, its sensors and the ground.
//!
//! It is pure, like `flight`: time is a count of steps, random numbers come from a seed, and the
//! same arguments give the same bits on any machine. The flight code sees only what `sensors`
//! measures. Frames are those of [`flight::vehicle::rigid`].
//!
//! * [`plant`]: all parts together, one millisecond at a time.
//! * `body`, `aero`, `motor`, `servo`, [`ground`]: the parts, one model each; the parachute is in
//!   `aero`.
//! * `battery`: its voltage under the vehicle's load.
//! * [`hanging`]: the vehicle below a drone; on its booster it is a part of [`plant`].
//! * [`wind`]: the mean wind over height, and gusts.
//! * [`sensors`]: the measurements that the flight computer gets.
//! * [`balance`]: the centre of pressure of a tail-first fall, which decides whether it is stable.
//! * `normal`: the random numbers of sensors and gusts.
//! * [`truth`]: deviations of the true vehicle and weather of one flight from the nominal data, and
//!   their faults.

mod aero;
pub mod balance;
mod battery;
mod body;
pub mod ground;
pub mod hanging;
mod motor;
pub(crate) mod normal;
pub mod plant;
pub mod sensors;
mod servo;
pub mod truth;
pub mod wind;

use serde::Serialize;
use toml::Value;

pub use battery::Battery;
pub use ground::{FirstContact, Rest, RestOutcome, Strain};
pub use hanging::Hanging;
pub use motor::TrueBurn;
pub use plant::{Actuators, World};
pub use truth::{AscentTruth, Fault, Truth};
pub use wind::Wind;

/// Length of one step, s.
pub const STEP_S: f64 = 1e-3;

/// Every number of a structure by its key, `section.key` in a section.
pub(crate) fn numbers(of: &impl Serialize) -> Vec<(String, f64)> {
    fn collect(key: &str, value: &Value, found: &mut Vec<(String, f64)>) {
        match value {
            Value::Float(number) => found.push((key.to_owned(), *number)),
            Value::Integer(number) => found.push((key.to_owned(), *number as f64)),
            Value::Array(values) => values.iter().for_each(|value| collect(key, value, found)),
            Value::Table(fields) => {
                let within =
                    |field: &str| if key.is_empty() { field.into() } else { format!("{key}.{field}") };
                fields.iter().for_each(|(field, value)| collect(&within(field), value, found));
            }
            _ => {}
        }
    }
    let mut found = Vec::new();
    // Structures of numbers always have such a value; a test would find none missing.
    if let Ok(value) = Value::try_from(of) {
        collect("", &value, &mut found);
    }
    found
}

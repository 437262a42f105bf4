//! Another motor in an airframe, and the page that a team takes to the field.
//!
//! * [`source`]: reads motors from files, folders and the list of an npm package.
//! * [`frame`]: the airframe without its motor, and a mission with another one.
//! * [`card`]: the sheet for the field, one side of it for the [`range_safety`] officer.

pub mod card;
pub mod frame;
pub mod range_safety;
mod sheet;
pub mod source;

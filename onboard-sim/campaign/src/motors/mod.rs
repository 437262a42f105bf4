//! Which motor an airframe lands on, at which mass and from which height; and the page that a team takes to the field.
//!
//! * [`source`]: reads motors from files, folders and the list of an npm package.
//! * [`frame`]: the airframe without its motor and with another one, and the text of such a mission.
//! * [`window`]: what may differ from the data so that the vehicle still lands, and the height at which a flight must begin.
//! * [`choice`]: the best mass and height for a motor, or why it does not land.
//! * [`ranking`]: many motors in order, the best ones flown; [`table`] shows them.
//! * [`card`]: the sheet for the field, one side of it for the [`range_safety`] officer.

pub mod card;
pub mod choice;
pub mod frame;
pub mod range_safety;
pub mod ranking;
mod sheet;
pub mod source;
pub mod table;
pub mod window;

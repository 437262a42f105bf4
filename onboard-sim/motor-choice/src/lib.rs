//! Which motor an airframe lands on, at which mass and from which height; and the page that a team takes to the field.
//!
//! * [`source`]: reads motors from files, folders and lists; [`thrustcurve_db`] is the list of an npm package.
//! * [`frame`]: the airframe without its motor, and with another one.
//! * [`height`]: the height at which a flight must begin.
//! * [`window`]: what may differ from the data so that the vehicle still lands.
//! * [`choice`]: the best mass and height for a motor, or why it does not land.
//! * [`mission_text`]: the mission with another motor, mass and height, as a text.
//! * [`flown`]: what quick flights of it come to.
//! * [`ranking`]: many motors in order; [`table`] and [`picture`] show them.
//! * [`card`]: the page for the field.

pub mod card;
pub mod choice;
pub mod flown;
pub mod frame;
pub mod height;
mod markup;
pub mod mission_text;
pub mod picture;
pub mod ranking;
mod search;
pub mod source;
pub mod table;
pub mod thrustcurve_db;
pub mod window;

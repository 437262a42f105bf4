//! Reads mission and motor files into the plain types of this crate.
//!
//! Each module reads one kind of file and has the built-in files by name. Its errors name the wrong
//! key or line and the accepted values.
//!
//! * [`mission`]: missions, from TOML.
//! * [`motors`]: the built-in motors, by name.
//! * [`thrust_curve`]: motor files, RASP (`.eng`) and RockSim (`.rse`), and tables of a test stand.
//! * [`openrocket`]: a vehicle as OpenRocket simulates it. [`table`]: tables whose columns say
//!   their units.
//! * [`winds`]: winds over height, as a table or a sounding.
//! * [`file_error`]: why a mission cannot be used.

pub mod file_error;
pub mod mission;
pub mod motors;
pub mod openrocket;
pub mod table;
pub mod thrust_curve;
pub mod winds;

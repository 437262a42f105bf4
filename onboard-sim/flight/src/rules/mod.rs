//! The rules for what the vehicle may do.
//!
//! * [`phase`] has the flight phases and the one table that moves between them.
//! * [`arming`] has the checks before arming, [`gate`] the checks before ignition; [`check`] has the type of one check.
//! * [`operator`] has the people who may command; [`two_person`] lets two of them arm and start together.
//! * [`verdict`] has the touchdown limits, and whether a landing kept them.

pub mod arming;
pub mod check;
pub mod gate;
pub mod operator;
pub mod phase;
pub mod two_person;
pub mod verdict;

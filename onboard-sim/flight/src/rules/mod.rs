//! This room holds the rules for what the vehicle may do.
//!
//! * [`phase`] has the flight phases and the one table that moves between them.
//! * [`arming`] has the checks before arming, [`gate`] those before ignition; [`check`] is one of them.
//! * [`verdict`] has the touchdown limits, and whether a landing kept them.

pub mod arming;
pub mod check;
pub mod gate;
pub mod phase;
pub mod verdict;

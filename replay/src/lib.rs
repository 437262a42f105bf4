//! Flight logs after the flight: what is in them, and whether the controller decides again, bit for bit, what it
//! decided then.
//!
//! * [`log`]: a log opened and streamed, with memory that does not grow with its frames.
//! * [`info`]: what is in a log, how complete it is and what can be done with it.
//! * [`verify`]: every tick re-executed from its recorded input and compared by bits.
//! * [`mod@print`]: both as text for people and as JSON for programs.
//!
//! Everything but [`log`] and [`mod@print`] works on values: records in, reports out.
#![warn(missing_docs)]

pub mod info;
pub mod log;
pub mod print;
pub mod verify;

//! Answers questions about flight logs after the flight: what is in a log, whether the controller of this build makes
//! the recorded decisions again, what it would have done with other settings, and how flights differ.
//!
//! In reading order:
//!
//! * [`cli`]: the command line. A command is one file: its arguments, its answer as data, and its printing.
//! * [`log`]: opens a log and streams its records in bounded memory, or holds a whole flight.
//! * [`info`]: describes what is in a log, how complete it is and what can be done with it.
//! * [`controller`]: builds the flight computer that a log's frames came from.
//! * [`verify`]: runs every tick again on its recorded input and compares the results bit for bit; explains one tick,
//!   holds a season of flights against a baseline, and proves the books of ground stations.
//! * [`settings`]: other settings for a recorded flight, named as in its mission.
//! * [`evaluate`](mod@evaluate): runs the controller alone with other settings on recorded inputs (open loop).
//! * [`refly`](mod@refly): flies the flight again in simulation from a chosen moment (closed loop), with one setting
//!   or many; finds the smallest change of a setting that changes the verdict.
//! * [`fit`](mod@fit): what a flight tells of its vehicle, its motor and its day, with intervals; what all flights so far
//!   tell of the next day.
//! * [`table`]: reads a log as tables; [`compare`](mod@compare): compares flights signal by signal.
//! * [`report`](mod@report): writes a flight as one HTML page.
//! * [`export`]: converts logs to and from other formats; [`recover`](mod@recover): repairs a damaged log.
//! * [`output`]: writes files completely or not at all, and overwrites nothing without permission.
//! * [`print`](mod@print): what answers have in common: text without control characters, JSON, JUnit XML.

pub mod cli;
pub mod compare;
pub mod controller;
mod digest;
pub mod evaluate;
pub mod export;
pub mod fit;
pub mod info;
pub mod log;
pub mod output;
pub mod print;
pub mod recover;
pub mod refly;
pub mod report;
pub mod settings;
mod several;
pub mod table;
pub mod verify;

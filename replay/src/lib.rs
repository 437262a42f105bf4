//! Flight logs after the flight: what is in them, whether the controller decides again what it decided then, what it
//! would have done with other settings, and how flights compare.
//!
//! * [`log`]: a log opened and streamed, with memory that does not grow with its frames; and a whole flight in memory.
//! * [`info`]: what is in a log, how complete it is and what can be done with it.
//! * [`verify`]: every tick re-executed from its recorded input and compared by bits.
//! * [`settings`]: other settings for a recorded flight, by the names of its profile.
//! * [`controller`]: the controller that a log's ticks came from.
//! * [`mod@evaluate`]: the controller alone under other settings, on recorded inputs (open loop).
//! * [`mod@refly`]: the flight flown again in simulation from a chosen moment (closed loop).
//! * [`mod@sweep`]: many settings over many flights, ranked; and the smallest change that turns a verdict.
//! * [`mod@tick`]: one tick solved again alone.
//! * [`mod@compare`]: flights side by side, signal by signal; [`table`]: a log as tables.
//! * [`output`]: files that appear whole and overwrite nothing unasked.
//! * [`export`], [`import`] and [`mod@recover`]: into other formats and from them, and whole again out of a damaged log.
//! * [`mod@report`]: a flight as one page of HTML.
//! * [`mod@print`]: all of it as text for people, JSON for programs and JUnit XML for build servers.
//!
//! Everything but [`log`] and [`mod@print`] works on values: records in, reports out.
#![warn(missing_docs)]

pub mod compare;
pub mod controller;
pub mod evaluate;
pub mod export;
pub mod import;
pub mod info;
pub mod log;
pub mod output;
pub mod print;
pub mod recover;
pub mod refly;
pub mod report;
pub mod settings;
pub mod sweep;
pub mod table;
pub mod tick;
pub mod verify;

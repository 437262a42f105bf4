//! Answers questions about flight logs after the flight: what is in a log, whether the controller of this build makes
//! the recorded decisions again, what it would have done with other settings, and how flights differ.
//!
//! In reading order:
//!
//! * [`log`]: opens a log and streams its records in bounded memory, or holds a whole flight.
//! * [`info`]: describes what is in a log, how complete it is and what can be done with it.
//! * [`controller`]: builds the flight computer that a log's frames came from.
//! * [`verify`]: runs every tick again on its recorded input and compares the results bit for bit.
//! * [`settings`]: other settings for a recorded flight, named as in its mission.
//! * [`evaluate`](mod@evaluate): runs the controller alone with other settings on recorded inputs (open loop).
//! * [`refly`](mod@refly): flies the flight again in simulation from a chosen moment (closed loop).
//! * [`sweep`](mod@sweep): flies many flights with many settings and ranks them; finds the smallest change of a setting
//!   that changes the verdict.
//! * [`gate`]: holds a directory of flights against a baseline.
//! * [`fit`](mod@fit): what a flight tells of its vehicle, its motor and its day, with intervals.
//! * [`learn`](mod@learn): what all flights so far tell of a lot, an airframe and a site, and GO or NO-GO.
//! * [`tick`](mod@tick): solves one recorded tick again.
//! * [`table`]: reads a log as tables; [`compare`](mod@compare): compares flights signal by signal.
//! * [`report`](mod@report): writes a flight as one HTML page.
//! * [`frames`]: a flight as the frames that a board reads.
//! * [`export`], [`import`]: convert logs to and from other formats; [`recover`](mod@recover): repairs a damaged log.
//! * [`audit`]: proves the books of ground stations.
//! * [`output`]: writes files completely or not at all, and overwrites nothing without permission.
//! * [`print`](mod@print): prints reports as text for people, JSON for programs and JUnit XML for build servers.

pub mod audit;
pub mod compare;
pub mod controller;
pub mod evaluate;
pub mod export;
pub mod fit;
pub mod frames;
pub mod gate;
pub mod import;
pub mod info;
pub mod learn;
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

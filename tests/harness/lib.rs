//! What the end-to-end tests share: the built programs, running processes, terminals, serial lines,
//! a UDP proxy that impairs a link, and a ground station that a test controls.
//!
//! A helper that waits has a time limit, waits for an event, and panics (fails the test) if the
//! event does not come.
#![expect(clippy::missing_panics_doc, reason = "a helper that panics fails its test, which is its purpose")]

mod appears;
mod bare_ground;
mod flight;
mod keys;
mod log_file;
mod log_states;
mod ports;
mod process;
mod programs;
mod random;
mod serial_line;
mod terminal;
mod time;
mod udp_proxy;
mod window;

pub use appears::{wait_for_content, wait_for_removal, wait_for_text};
pub use bare_ground::{ABORT, ACCEPTED, ARM, BareGround, START, command_frame, heartbeat_frame};
pub use flight::{
    auto_ground, expect_identical_replay, expect_landing, landed_vehicle, last_time_s, vehicle,
};
pub use keys::{keygen, signing_with_key_in};
pub use log_file::{frames_of, raw_frames_of};
pub use log_states::{LogState, log_states};
pub use nix::sys::signal::Signal;
pub use ports::{Bound, unshared_address};
pub use process::{Ended, Running, resident_bytes, status_of};
pub use programs::{Program, program};
pub use random::Random;
pub use serial_line::SerialLine;
pub use terminal::Terminal;
pub use time::{now, signing_clock};
pub use udp_proxy::{Impairment, UdpProxy};
pub use window::Window;

use std::time::Duration;

/// The time limit of every wait. Nothing here takes this long, even on a busy machine.
pub const PATIENCE: Duration = Duration::from_secs(90);

//! What the end-to-end tests share: the built programs, running processes, terminals, serial lines, bad air, a bare ground station.
//!
//! Waiting is always for something that happens, with a limit; nothing here sleeps and hopes.

mod air;
mod bare_ground;
mod log_file;
mod ports;
mod process;
mod programs;
mod serial_line;
mod terminal;
mod window;

pub use air::{Air, Weather};
pub use bare_ground::{BareGround, command_frame, heartbeat_frame};
pub use log_file::{raw_frames_of, rewrite_log, ticks_of};
pub use nix::sys::signal::Signal;
pub use ports::Bound;
pub use process::{Ended, Running};
pub use programs::{Program, program};
pub use serial_line::SerialLine;
pub use terminal::Terminal;
pub use window::Window;

use std::time::Duration;

/// Longer than anything here takes on a busy machine; reaching it fails the test.
pub const PATIENCE: Duration = Duration::from_secs(90);

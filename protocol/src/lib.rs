//! What the vehicle, the ground station and replay share: the MAVLink dialect, framing, commands,
//! parameters, status text, link statistics and the records of the flight log.
//!
//! The core has no sockets, no clocks and no threads: bytes go in, frames come out, and `now` is an
//! argument (a [`std::time::Duration`] since an epoch of the caller's choice). Two rooms touch the
//! world and say so: [`log::recorder`] owns a thread that writes a file, and `transport` (a feature)
//! moves bytes over UDP, TCP and serial lines.
#![warn(missing_docs)]

pub mod command;
pub mod dialect;
pub mod duplicate;
pub mod frame;
pub mod ftp;
pub mod hostile;
pub mod hub;
pub mod identity;
#[cfg(feature = "transport")]
pub mod key_file;
pub mod link;
pub mod log;
pub mod parameter;
pub mod signing;
pub mod text;
#[cfg(feature = "transport")]
pub mod transport;

//! What the vehicle, the ground station and replay share: the MAVLink dialect, framing, commands,
//! parameters, status text, link statistics and the records of the flight log.
//!
//! The core has no sockets, no clocks and no threads: bytes go in, frames come out, and `now` is an
//! argument (a [`std::time::Duration`] since an epoch of the caller's choice). Two rooms touch the
//! world and say so: [`log::recorder`] owns a thread that writes a file, and `transport` (a feature)
//! moves bytes over UDP, TCP and serial lines.
//!
//! # On a flight computer
//!
//! Bytes from a UART, a socket or a test go into a [`hub::Hub`]; frames that were not heard before and are to be
//! believed come out. What is to be sent goes through an [`frame::Encoder`], one for each component, and the hub again,
//! which signs it for each link. Nothing waits, nothing reads a clock:
//!
//! ```
//! use std::time::Duration;
//!
//! use protocol::command::{CommandAnswer, CommandRequest};
//! use protocol::dialect::{COMMAND_LONG_DATA, MavCmd, MavMessage, MavResult};
//! use protocol::frame::Encoder;
//! use protocol::hub::{Hub, News, Received};
//! use protocol::identity::{GROUND, VEHICLE};
//!
//! let mut hub = Hub::new(1, None);
//! let mut encoder = Encoder::new(VEHICLE);
//! let mut uart_out = Vec::new();
//!
//! # let asked = MavMessage::COMMAND_LONG(COMMAND_LONG_DATA {
//! #     command: MavCmd::MAV_CMD_NAV_TAKEOFF, target_system: 1, ..COMMAND_LONG_DATA::default()
//! # });
//! # let uart_in = Encoder::new(GROUND).encode(&asked).as_bytes().to_vec();
//! let since_boot = Duration::from_millis(20);
//! for news in hub.take(0, Received::Stream(0, uart_in), since_boot, 0) {
//!     let News::Frame(frame) = news else { continue };
//!     let Some(request) = CommandRequest::from_frame(&frame) else { continue };
//!     if VEHICLE.accepts(request.target) {
//!         let answer = CommandAnswer::to(&request, MavResult::MAV_RESULT_UNSUPPORTED);
//!         if let Some(frame) = answer.encode(&mut encoder) {
//!             uart_out.extend(hub.bytes_for(0, &frame, 0));
//!         }
//!     }
//! }
//! assert_eq!(uart_out[7], 77, "a COMMAND_ACK");
//! ```
//!
//! With a key, [`signing::Signing`] wants two things of its owner: the time of day, as well as it is known, and that
//! [`hub::Hub::signing_memory`] outlives a power cycle.
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

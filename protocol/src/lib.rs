//! The code that vehicle, ground station and replay share: MAVLink messages and their frames,
//! commands, signing, links and the flight log.
//!
//! The core has no sockets, no clocks and no threads: bytes go in, frames come out, and `now` is an
//! argument (a [`std::time::Duration`] since an epoch that the caller chooses). Only
//! [`log::recorder`] (a thread that writes a file) and the modules of the feature `transport` do
//! I/O.
//!
//! In reading order:
//!
//! * [`identity`]: the MAVLink addresses of vehicle and ground;
//! * [`dialect`]: the message types, generated from XML;
//! * [`frame`]: bytes to checked frames, and messages to frames;
//! * [`text`], [`parameter`], [`command`], [`ftp`]: the MAVLink services, each over frames;
//! * [`signing`]: signatures and their check;
//! * [`duplicate`] and [`link_stats`]: copies of a frame, and the rates and the loss of a link;
//! * [`hub`]: several links to one peer, made of the modules above;
//! * `transport` (a feature): UDP, TCP and serial links;
//! * `links` (the same feature): the open links of a program, together;
//! * `key_file` and `crew_file` (the same feature): the file of a signing key, and of the people
//!   who have keys;
//! * [`mission`]: identification of a mission by its hash;
//! * [`motion`]: position and attitude of a vehicle, from its messages; `reported`: all of it as a
//!   record of the log;
//! * `background` (feature `transport`): files that are written beside a run loop;
//! * [`book`]: the record of crew actions, with a signed hash over all entries;
//! * `field` (a feature): the lines of a launch field, from a file;
//! * [`records`]: the records of the flight log, generated;
//! * [`log`]: the flight log;
//! * `program` (a feature): exit codes, completions and manual pages of the programs.
//!
//! # On a flight computer
//!
//! Bytes from a UART, a socket or a test go into a [`hub::Hub`]; valid frames that were not
//! received before come out. A message is sent through a [`frame::Encoder`], one for each
//! component, and then through the hub, which signs it for each link. Nothing here waits or reads a
//! clock:
//!
//! ```
//! use std::time::Duration;
//!
//! use protocol::command::{CommandAnswer, CommandRequest};
//! use protocol::dialect::{COMMAND_LONG_DATA, MavCmd, MavMessage, MavResult};
//! use protocol::frame::Encoder;
//! use protocol::hub::{Hub, LinkEvent, Received};
//! use protocol::identity::{GROUND, VEHICLE};
//!
//! let mut hub = Hub::new(1, None);
//! let mut encoder = Encoder::new(VEHICLE);
//! let mut uart_out = Vec::new();
//!
//! # let request = MavMessage::COMMAND_LONG(COMMAND_LONG_DATA {
//! #     command: MavCmd::MAV_CMD_NAV_TAKEOFF, target_system: 1, ..COMMAND_LONG_DATA::default()
//! # });
//! # let uart_in = Encoder::new(GROUND).encode(&request).as_bytes().to_vec();
//! let since_boot = Duration::from_millis(20);
//! for news in hub.take(0, Received::Stream(0, uart_in), since_boot, 0) {
//!     let LinkEvent::Frame(frame) = news else { continue };
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
//! With a key, the caller must pass the time of day, as far as it is available, and must store
//! [`hub::Hub::signing_memory`] so that it survives a power cycle.
//!
//! Without the feature `std` the crate needs a heap and no operating system. It then has no log, no
//! book and no files, and its dialect has the messages that a vehicle sends and receives.
#![cfg_attr(not(any(feature = "std", test)), no_std)]

extern crate alloc;
// The generated dialect names it so.
extern crate mavlink as mavlink_core;

#[cfg(feature = "transport")]
pub mod background;
#[cfg(feature = "std")]
pub mod book;
pub mod command;
#[cfg(feature = "transport")]
pub mod crew_file;
pub mod dialect;
pub mod duplicate;
#[cfg(feature = "field")]
pub mod field;
pub mod frame;
pub mod ftp;
pub mod hub;
pub mod identity;
#[cfg(feature = "transport")]
pub mod key_file;
pub mod link_stats;
#[cfg(feature = "transport")]
pub mod links;
#[cfg(feature = "std")]
pub mod log;
pub mod mission;
pub mod motion;
pub mod parameter;
#[cfg(feature = "program")]
pub mod program;
pub mod records;
#[cfg(feature = "std")]
pub mod reported;
pub mod signing;
pub mod text;
#[cfg(feature = "transport")]
pub mod transport;

//! Hardware in the loop: a simulated world and a flight computer as two processes, over MAVLink.
//!
//! The crate `hil` decides; here are its messages and its links. In reading order:
//!
//! * [`messages`]: readings, starts and answers as MAVLink messages.
//! * [`assembly`]: messages put together again to whole frames and whole answers, whatever was lost between them.
//! * [`link`]: one link, messages in and out.
//! * [`computer`]: the flight computer's process.
//! * [`world`]: the world's process: one flight in lockstep or in real time.
//! * [`report`]: what a flight was like on the wire.
//!
//! A frame is TD_HIL_VEHICLE, then HIL_GPS and DISTANCE_SENSOR if they have something new, then HIL_SENSOR. Its answer is
//! TD_HIL_COMPUTER and HIL_ACTUATOR_CONTROLS. Over UDP each of them is one datagram. The computer sends a HEARTBEAT once a second.

pub mod assembly;
pub mod computer;
pub mod link;
pub mod messages;
pub mod report;
pub mod world;

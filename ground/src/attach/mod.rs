//! Attached screens: the messages between a station and screens in other processes, over a Unix socket.
//!
//! The station sends every message that it takes into its model to every screen, with its time. The screen takes the
//! same messages into its own model and so shows the same. A screen sends back what the crew asks for; the station
//! decides and acts. Killing a screen therefore loses nothing, and the station keeps repeating an abort.

pub mod codec;
pub mod message;
pub mod socket;

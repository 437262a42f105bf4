//! Screens apart from the station: what crosses the Unix socket between them.
//!
//! The station hands every message that it takes into its model to every screen, with its time; the screen
//! takes the same messages into a model of its own and so shows the same. A screen sends back what the crew
//! asks for; the station decides and acts. Killing a screen therefore loses nothing, and an abort that was
//! asked for goes on being repeated by the station.

pub mod codec;
pub mod place;

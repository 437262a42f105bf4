//! Studies of the guidance: what the command line does besides flying. A flight with its links and its log is the crate
//! `simulated-vehicle`, many flights are the crate `campaign`.
//!
//! * [`figure`]: curves and maps as SVG.
//! * [`landability`]: maps of where a landing exists.
//! * [`paper`]: the landing paper's experiments, its numbers beside ours.

pub mod figure;
pub mod landability;
pub mod paper;

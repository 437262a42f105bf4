//! The landing paper's experiments, its numbers beside ours ([`paper`]). A flight with its links and its log is the crate
//! `simulated-vehicle`, many flights are the crate `campaign`.

pub mod paper;

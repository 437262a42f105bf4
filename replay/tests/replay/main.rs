//! Tests with logs of a landing, whole, changed, cut and broken, through the library and through
//! the command.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

mod aborted;
mod another_build;
mod apogee;
mod book;
mod causes;
mod clocks;
mod command_line;
mod commands;
mod complete_flights;
mod damage;
mod damage_reported;
mod day;
mod divergence;
mod every_mission;
mod fit;
mod flown;
mod foreign;
mod from_apogee;
mod from_power_up;
mod ground_log;
mod help;
mod import;
mod in_order;
mod lacking;
mod layouts;
mod limits;
mod log_states;
mod lost_frames;
mod lost_samples;
mod missions;
mod obstacles;
mod one_verdict;
#[cfg(unix)]
mod other_faults;
mod overwriting;
mod pages;
mod plain_answers;
mod questions;
mod recovery;
mod reflown_logs;
mod sets;
mod settings;
mod simulated;
mod solve_times;
mod station;
mod strict;
mod tables;
mod tampered;
#[path = "../../../onboard-sim/flight/tests/missions/mod.rs"]
mod test_missions;
mod what_if;

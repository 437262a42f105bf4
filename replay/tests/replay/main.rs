//! Tests with logs of a landing, whole, changed, cut and broken, through the library and through the command.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

mod aborted;
mod another_build;
mod apogee;
mod asked;
mod command_line;
mod commands;
mod damage;
mod damage_told;
mod divergence;
mod earlier_releases;
mod flown;
mod foreign;
mod from_apogee;
mod from_estimate;
mod from_power_up;
mod limits;
mod lost_frames;
mod lost_samples;
mod obstacles;
mod overwriting;
mod pages;
mod pilot;
mod plain_answers;
mod planned_paths;
mod recovery;
mod reflown_logs;
mod resumed_sweep;
mod simulated;
mod solve_times;
mod tables;
mod tampered;
mod what_if;
mod whole_flights;
mod whole_numbers;

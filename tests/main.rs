//! The tests with real processes. `cargo test --test e2e abort` runs one file of them.

mod abort;
mod addressing;
mod architecture;
mod crew;
mod demo;
mod download;
mod every_mission;
mod first_flight;
mod ground_log;
mod hold;
mod hostile;
mod launch_day;
mod links;
mod log_states;
mod logs;
mod outside_clients;
mod pad_check;
mod pages;
mod pages_run;
mod pin;
mod rocket;
mod signed;
mod terminal;
mod two_processes;
mod two_stations;
mod who_commands;

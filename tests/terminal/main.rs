//! The ground station on a real terminal, keys and all, with the real simulator beyond air that loses, delays and lies.
//!
//! Everything a test knows, it knows from the terminal's window and from what crossed the air.
#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

mod attack;
mod endings;
mod finding;
mod hand;
mod reboot;
mod resize;
mod stage;
mod station;
mod weather;

//! The ground station on a real terminal with typed keys, and the real simulator behind a proxy
//! that loses, delays and forges datagrams.
//!
//! A test reads only the terminal's window and the datagrams that passed the proxy.
#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

mod attached_screens;
mod bad_link;
mod endings;
mod escape_sequences;
mod every_key;
mod hung_screens;
mod pasted_keys;
mod reboot;
mod removed_logs;
mod resize;
mod rig;
mod stalled_disk;
mod standstill;
mod stations;
mod tmux;

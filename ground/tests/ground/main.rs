//! The ground station from outside: its keys, its radio, its screens, the program itself.

mod alarms;
mod auto;
mod bad_air;
mod bench;
mod bytes;
mod crew;
mod daemon;
mod disarm;
mod flown;
mod hand;
mod in_space;
mod ladder;
mod links;
mod phases;
mod program;
mod radio;
mod replay;
mod screens;
mod terminal;
mod uplink;
mod whose;

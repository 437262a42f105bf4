//! Tests of the ground station from outside: keys, radio, screens, and the program itself.

mod alarms;
mod auto;
mod bytes;
mod crew;
mod daemon;
mod disarm;
mod finding;
mod flights;
mod identity;
mod in_space;
mod keys;
mod ladder;
mod links;
mod looking_back;
mod lossy_link;
mod phases;
mod pictures;
mod program;
mod radio;
mod replay;
mod rig;
mod screens;
mod terminal;
mod two_person;
mod uplink;
mod voice;

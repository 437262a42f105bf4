//! The ground station from outside: its keys, its radio, its screens, the program itself.

mod bench;
mod hand;
mod ladder;
mod program;
mod radio;
mod screens;

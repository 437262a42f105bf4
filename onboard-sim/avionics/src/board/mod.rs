//! The flight computer as a program for a board.
//!
//! * [`port`]: the interface that a board implements, and the loop that flies it.
//! * [`stream`]: a flight as bytes for a board, and the board's answers.
//! * [`radio`]: the crew on the board's radio, between the frames.
//! * [`recorded`]: flies the frames that arrive, and answers each.

pub mod port;
pub mod radio;
pub mod recorded;
pub mod stream;

//! The simulated truth: a rigid rocket in wind, its actuators, its sensors and the ground.
//!
//! Pure like `flight`: time is a count of steps, chance is a seed, and the same arguments give the same bits on any
//! machine. The flight code sees of it only what `sensors` measures. Frames are those of [`flight::rigid`].
#![warn(missing_docs)]

pub mod sensors;

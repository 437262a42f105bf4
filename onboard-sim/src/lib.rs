//! Simulates thousands of flights on several threads and summarises how they end.
//!
//! * [`store`]: a campaign's directory, and everything that its results depend on.
//! * [`tally`]: flies one flight of a campaign and collects the values of its [`row`].
//! * [`run`]: the same work on many things, on several threads; flies the missing flights.
//! * [`progress`]: how far something long is.
//! * [`files`]: texts that are built in or files, and files written atomically.
//! * [`statistics`], [`summary`]: percentiles and texts from the rows.
//! * [`hazard`]: impact areas for each case of a flight.
//! * [`check`]: prediction for an unbuilt vehicle whether it will land, and what to change.
//! * [`drawing`]: a vehicle to scale, and the parts that overlap.
//! * [`field`]: the lines of the field on these pages.
//! * [`frame`]: another motor in an airframe.
//! * [`card`]: the landing card.
//! * [`playback`]: recorded sensors played to the flight computer.
//!
//! A flight depends only on its recipe and its number. So a campaign can be stopped, continued and
//! run on any number of threads with the same results.

pub mod card;
pub mod check;
pub mod drawing;
pub mod field;
pub mod files;
pub mod frame;
pub mod hazard;
pub mod playback;
pub mod progress;
pub mod row;
pub mod run;
pub mod statistics;
pub mod store;
pub mod summary;
pub mod tally;

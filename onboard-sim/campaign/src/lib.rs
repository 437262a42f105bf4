//! Simulates thousands of flights on several threads and summarises how they end.
//!
//! * [`attainable`]: whether a clairvoyant could have landed a flight.
//! * [`hazard`]: where a flight comes down in each way that it can end.
//! * [`order`]: everything that a campaign's results depend on.
//! * [`tally`]: flies one flight of a campaign and collects the values of its row.
//! * [`row`]: one flight as a row of a table.
//! * [`run`]: flies the missing flights on several threads.
//! * [`store`]: the directory of a campaign.
//! * [`table`]: rows as CSV and Parquet.
//! * [`statistics`], [`summary`], [`picture`]: percentiles, texts and pictures from the rows.
//! * [`results`]: writes tables, summary and pictures into the directory.
//! * [`scenario`]: faults, and the expected outcome of a flight with them.
//! * [`work`]: the same work on many things, on several threads.
//! * [`timing`]: the ignition height of the simpler guidance laws, found by simulated flights.
//!
//! A flight depends only on its recipe and its number. So a campaign can be divided into shards, stopped, continued and
//! run on any number of threads with the same results.

pub mod attainable;
pub mod hazard;
pub mod order;
pub mod picture;
pub mod results;
pub mod row;
pub mod run;
pub mod scenario;
pub mod statistics;
pub mod store;
pub mod summary;
pub mod table;
pub mod tally;
pub mod timing;
pub mod work;

//! Reads a log as tables: one table for each topic, one row for each record, one column for each number.
//!
//! The columns come from the schema in the log, so a new kind of record, or a newer version of one, becomes a table
//! without any code here. Column names are the paths of the fields, as in `output.gimbal_command_rad`, with their
//! units. Raw MAVLink frames become one table for each message of each sender, as in `mavlink_1_1_heartbeat`.
//! A short list (four fins) has one column for each element, a long one (a plan's nodes) has none. The limits of
//! a verdict are rows of a separate table.

mod columns;
mod dialect;
mod mavlink;
mod rows;

pub use columns::{Column, Kind, Meaning, TableShape};
pub use rows::{Cell, Row, TableReader};

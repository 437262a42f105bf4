//! A log as tables: one a topic, one row a record, one column a number.
//!
//! The columns come from the schema that the log itself carries, so a new kind of record, or one of a newer version, is a
//! table without a line here. Column names are the fields' paths, as in `output.gimbal_command_rad`, and carry their units
//! as the fields do. A short list (four fins) has a column an element, a long one (a plan's nodes) has none; the limits of
//! a verdict are rows of a table of their own.

mod columns;
mod rows;

pub use columns::{Column, Kind, TableShape};
pub use rows::{Cell, Row, TableReader};

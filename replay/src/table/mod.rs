//! A log as tables: one a topic, one row a record, one column a number.
//!
//! The columns come from the log's own schema, so a new kind of record is a new table without a line here. Column
//! names are the fields' paths, as in `output.gimbal_command_rad`, and carry their units as the fields do. Lists whose
//! length the schema leaves open (a plan's nodes) have no columns, but for the four fins; the limits of a verdict are
//! rows of a table of their own.

mod columns;
mod rows;

pub use columns::{Column, Kind, TableShape};
pub use rows::{Cell, Row, TableReader};

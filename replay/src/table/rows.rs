//! A log's records as rows, streamed.

use std::collections::BTreeMap;
use std::io::Read;

use prost_reflect::{DynamicMessage, Value};
use protocol::log::record::{TOPIC_EVENTS, TOPIC_VERDICT};
use protocol::log::v1;

use super::columns::{Kind, Place, TableShape, table_name};
use crate::log::{Entry, FlightLog, LogError, StampedEntry, described};

/// A value of a row.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// A number.
    Float(f64),
    /// A whole number or a flag; digests of 64 bits wrap around to negative numbers.
    Integer(i64),
    /// Text.
    Text(String),
    /// Never received, or not in the record.
    Absent,
}

impl Cell {
    /// The value as a number, if it is one.
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Float(number) => Some(*number),
            Self::Integer(number) => Some(*number as f64),
            Self::Text(_) | Self::Absent => None,
        }
    }
}

/// One row.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Place of its table in [`TableReader::shapes`].
    pub table: usize,
    /// One value a column.
    pub cells: Vec<Cell>,
}

/// Reads a log's rows in file order.
#[derive(Default)]
pub struct TableReader {
    shapes: Vec<TableShape>,
    /// By channel: its table, and where in its records the values stand.
    channels: BTreeMap<u16, Option<(usize, Vec<Place>)>>,
    limits: Option<usize>,
    events: Option<usize>,
}

impl TableReader {
    /// A reader that has seen nothing yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Every table seen so far.
    pub fn shapes(&self) -> &[TableShape] {
        &self.shapes
    }

    /// Hands out every row of a log.
    ///
    /// # Errors
    /// The log cannot be read, or `take` refused a row.
    pub fn read<R: Read, E: From<LogError>>(
        &mut self,
        log: &mut FlightLog<R>,
        mut take: impl FnMut(&TableShape, Row) -> Result<(), E>,
    ) -> Result<(), E> {
        while let Some(stamped) = log.next_entry()? {
            for row in self.rows_of(log, &stamped) {
                if let Some(shape) = self.shapes.get(row.table) {
                    take(shape, row)?;
                }
            }
        }
        Ok(())
    }

    fn rows_of<R: Read>(&mut self, log: &FlightLog<R>, stamped: &StampedEntry) -> Vec<Row> {
        let time = Cell::Integer(stamped.log_time_ns.cast_signed());
        match &stamped.entry {
            Entry::Event(event) => {
                let columns = [("level", Kind::Integer), ("name", Kind::Text), ("message", Kind::Text)];
                let table = place_of(&mut self.shapes, &mut self.events, &table_name(TOPIC_EVENTS), &columns);
                let cells = vec![
                    time,
                    Cell::Integer(i64::from(event.level)),
                    Cell::Text(event.name.clone()),
                    Cell::Text(event.message.clone()),
                ];
                vec![Row { table, cells }]
            }
            Entry::Unreadable { .. } | Entry::RawFrame | Entry::Other => Vec::new(),
            Entry::Verdict(verdict) => {
                let mut rows = self.limits_of(verdict, &time);
                rows.extend(self.record(log, stamped, time));
                rows
            }
            _ => self.record(log, stamped, time).into_iter().collect(),
        }
    }

    /// A record of the log's own package.
    fn record<R: Read>(&mut self, log: &FlightLog<R>, stamped: &StampedEntry, time: Cell) -> Option<Row> {
        let channel = log.channel(stamped.channel_id)?;
        let descriptor = described(&channel.schema_name)?;
        let shapes = &mut self.shapes;
        let known = self.channels.entry(stamped.channel_id).or_insert_with(|| {
            let (shape, places) = TableShape::of_record(&table_name(&channel.topic), &descriptor);
            // Two channels of one topic share a table.
            let table = shapes.iter().position(|known| *known == shape).unwrap_or_else(|| {
                shapes.push(shape);
                shapes.len() - 1
            });
            Some((table, places))
        });
        let (table, places) = known.as_ref()?;
        let message = DynamicMessage::decode(descriptor, stamped.data.as_slice()).ok()?;
        let values = places.iter().map(|place| value_at(&message, place));
        Some(Row { table: *table, cells: std::iter::once(time).chain(values).collect() })
    }

    fn limits_of(&mut self, verdict: &v1::LandingVerdict, time: &Cell) -> Vec<Row> {
        let columns = [
            ("limit", Kind::Text),
            ("unit", Kind::Text),
            ("value", Kind::Float),
            ("minimum", Kind::Float),
            ("maximum", Kind::Float),
            ("passed", Kind::Integer),
        ];
        let name = format!("{}_limits", table_name(TOPIC_VERDICT));
        let table = place_of(&mut self.shapes, &mut self.limits, &name, &columns);
        let row = |limit: &v1::LimitResult| {
            let cells = vec![
                time.clone(),
                Cell::Text(limit.name.clone()),
                Cell::Text(limit.unit.clone()),
                Cell::Float(limit.value),
                Cell::Float(limit.minimum),
                Cell::Float(limit.maximum),
                Cell::Integer(i64::from(limit.passed)),
            ];
            Row { table, cells }
        };
        verdict.limits.iter().map(row).collect()
    }
}

/// The place of a table that has no description in the schema.
fn place_of(
    shapes: &mut Vec<TableShape>,
    place: &mut Option<usize>,
    name: &str,
    columns: &[(&str, Kind)],
) -> usize {
    *place.get_or_insert_with(|| {
        shapes.push(TableShape::new(name, columns));
        shapes.len() - 1
    })
}

fn value_at(message: &DynamicMessage, place: &Place) -> Cell {
    let Some((field, inner)) = place.fields.split_first() else {
        return Cell::Absent;
    };
    if field.supports_presence() && !message.has_field(field) {
        return Cell::Absent;
    }
    let value = message.get_field(field);
    match value.as_ref() {
        Value::Message(message) => {
            value_at(message, &Place { fields: inner.to_vec(), element: place.element })
        }
        Value::List(items) => place.element.and_then(|at| items.get(at)).map_or(Cell::Absent, cell_of),
        value => cell_of(value),
    }
}

fn cell_of(value: &Value) -> Cell {
    match value {
        Value::F64(number) => Cell::Float(*number),
        Value::F32(number) => Cell::Float(f64::from(*number)),
        Value::I32(number) => Cell::Integer(i64::from(*number)),
        Value::I64(number) => Cell::Integer(*number),
        Value::U32(number) => Cell::Integer(i64::from(*number)),
        Value::U64(number) => Cell::Integer(number.cast_signed()),
        Value::Bool(flag) => Cell::Integer(i64::from(*flag)),
        Value::String(text) => Cell::Text(text.clone()),
        _ => Cell::Absent,
    }
}

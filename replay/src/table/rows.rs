//! Streams the records of a log as rows.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry::{Occupied, Vacant};
use std::io::Read;

use prost_reflect::{DescriptorPool, DynamicMessage, FieldDescriptor, MessageDescriptor, Value};
use protocol::identity::Address;
use protocol::log::reader::LogChannel;
use protocol::log::record::{TOPIC_EVENTS, TOPIC_RAW_RX, TOPIC_VERDICT};
use protocol::log::v1;

use super::columns::{Kind, Place, TableShape, table_name};
use super::mavlink;
use crate::log::{Entry, FlightLog, LogError, StampedEntry, frame_of};

/// A value of a row.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// A number.
    Float(f64),
    /// A whole number or a flag; digests of 64 bits wrap around to negative numbers.
    Integer(i64),
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

#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Index of its table in [`TableReader::shapes`].
    pub table: usize,
    /// One value for each column.
    pub cells: Vec<Cell>,
}

/// Reads a log's rows in file order.
#[derive(Default)]
pub struct TableReader {
    shapes: Vec<TableShape>,
    /// By channel; `None` for records that are not ours.
    channels: BTreeMap<u16, Option<Known>>,
    /// The tables of MAVLink messages.
    messages: BTreeMap<(Address, u32), usize>,
    limits: Option<usize>,
    events: Option<usize>,
}

/// The known structure of a channel's records.
struct Known {
    table: usize,
    descriptor: MessageDescriptor,
    places: Vec<Place>,
}

impl TableReader {
    /// A reader before its first record.
    pub fn new() -> Self {
        Self::default()
    }

    /// Every table seen so far.
    pub fn shapes(&self) -> &[TableShape] {
        &self.shapes
    }

    /// Passes every row of a log to `take`.
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
            Entry::RawFrame => self.message(log, stamped, time).into_iter().collect(),
            Entry::Verdict(verdict) => {
                let mut rows = self.limits_of(verdict, &time);
                rows.extend(self.record(log, stamped, time));
                rows
            }
            _ => self.record(log, stamped, time).into_iter().collect(),
        }
    }

    /// The message in a raw frame; `None` if the dialect does not have it.
    fn message<R: Read>(&mut self, log: &FlightLog<R>, stamped: &StampedEntry, time: Cell) -> Option<Row> {
        let channel = log.channel(stamped.channel_id)?;
        let frame = frame_of(&stamped.data)?;
        let key = (frame.source(), frame.message_id());
        let table = if let Some(table) = self.messages.get(&key) {
            *table
        } else {
            self.shapes.push(mavlink::shape_of(&frame)?);
            let table = self.shapes.len() - 1;
            self.messages.insert(key, table);
            table
        };
        let fact = |key: &str| channel.metadata.get(key).map_or("", String::as_str);
        let direction = if channel.topic == TOPIC_RAW_RX { "rx" } else { "tx" };
        let cells = mavlink::cells_of(&frame, [fact("endpoint"), direction, fact("link")]);
        Some(Row { table, cells: std::iter::once(time).chain(cells).collect() })
    }

    /// A record of one of our packages, with the schema in the log.
    fn record<R: Read>(&mut self, log: &FlightLog<R>, stamped: &StampedEntry, time: Cell) -> Option<Row> {
        let channel = log.channel(stamped.channel_id)?;
        let shapes = &mut self.shapes;
        let known = match self.channels.entry(stamped.channel_id) {
            Occupied(entry) => entry.into_mut(),
            Vacant(entry) => {
                let known = described(channel).and_then(|descriptor| {
                    let first = DynamicMessage::decode(descriptor.clone(), stamped.data.as_slice()).ok()?;
                    let (shape, places) = TableShape::of_record(&table_name(&channel.topic), &first);
                    // Two channels with one topic share a table.
                    let table = shapes.iter().position(|known| *known == shape).unwrap_or_else(|| {
                        shapes.push(shape);
                        shapes.len() - 1
                    });
                    Some(Known { table, descriptor, places })
                });
                entry.insert(known)
            }
        };
        let Known { table, descriptor, places } = known.as_ref()?;
        let message = DynamicMessage::decode(descriptor.clone(), stamped.data.as_slice()).ok()?;
        let values = places.iter().map(|place| value_at(&message, &place.fields, place.element));
        Some(Row { table: *table, cells: std::iter::once(time).chain(values).collect() })
    }

    fn limits_of(&mut self, verdict: &v1::LandingVerdict, time: &Cell) -> Vec<Row> {
        let columns = [
            ("standard", Kind::Text),
            ("limit", Kind::Text),
            ("unit", Kind::Text),
            ("value", Kind::Float),
            ("minimum", Kind::Float),
            ("maximum", Kind::Float),
            ("passed", Kind::Integer),
        ];
        let name = format!("{}_limits", table_name(TOPIC_VERDICT));
        let table = place_of(&mut self.shapes, &mut self.limits, &name, &columns);
        let of_legs = if verdict.table_2.is_empty() { "table 2" } else { "legs" };
        let row = |(standard, limit): (&str, &v1::LimitResult)| {
            let cells = vec![
                time.clone(),
                Cell::Text(standard.to_owned()),
                Cell::Text(limit.name.clone()),
                Cell::Text(limit.unit.clone()),
                Cell::Float(limit.value),
                Cell::Float(limit.minimum),
                Cell::Float(limit.maximum),
                Cell::Integer(i64::from(limit.passed)),
            ];
            Row { table, cells }
        };
        let decide = verdict.limits.iter().map(|limit| (of_legs, limit));
        decide.chain(verdict.table_2.iter().map(|limit| ("table 2", limit))).map(row).collect()
    }
}

/// The index of a table that has no schema.
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

fn value_at(message: &DynamicMessage, fields: &[FieldDescriptor], element: Option<usize>) -> Cell {
    let Some((field, inner)) = fields.split_first() else {
        return Cell::Absent;
    };
    if field.supports_presence() && !message.has_field(field) {
        return Cell::Absent;
    }
    let value = message.get_field(field);
    match value.as_ref() {
        Value::Message(message) => value_at(message, inner, element),
        Value::List(items) => element.and_then(|at| items.get(at)).map_or(Cell::Absent, cell_of),
        value => cell_of(value),
    }
}

/// Describes a channel's records from the schema in the log; `None` for records that are not ours.
fn described(channel: &LogChannel) -> Option<MessageDescriptor> {
    if channel.message_encoding != "protobuf" || !channel.schema_name.starts_with("touchdown.") {
        return None;
    }
    let pool = DescriptorPool::decode(channel.schema.as_ref()).ok()?;
    pool.get_message_by_name(&channel.schema_name)
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

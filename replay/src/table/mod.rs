//! Reads a log as tables: one table for each topic, one row for each record, one column for each
//! number.
//!
//! The columns come from the schema in the log, so a new kind of record, or a newer version of one,
//! becomes a table without any code here. Column names are the paths of the fields, as in
//! `output.gimbal_command_rad`, with their units. Raw MAVLink frames become one table for each
//! message of each sender, as in `mavlink_1_1_heartbeat`. A short list (four fins) has one column
//! for each element, a long one (a plan's nodes) has none. The limits of a verdict are rows of a
//! separate table.

mod dialect;
mod layout;

use std::collections::BTreeMap;
use std::io::Read;

use flight::rules::verdict::Landing;
use prost_reflect::{
    DescriptorPool, DynamicMessage, Kind as FieldKind, MessageDescriptor, ReflectMessage as _, Value,
};
use protocol::identity::Address;
use protocol::log::reader::LogChannel;
use protocol::log::record::{
    TOPIC_COMPUTER_FRAME, TOPIC_COMPUTER_START, TOPIC_EVENTS, TOPIC_RAW_RX, TOPIC_RAW_TX, TOPIC_VERDICT,
};
use protocol::log::v1;

use self::dialect::{cells_of_frame, shape_of_frame};
use self::layout::{Layout, Scalar, Slot};
use crate::log::{Entry, FlightLog, LogError, RECORD_MAX_BYTES, StampedEntry, frame_of};

/// A list up to this length has one column for each element; a longer one, has none.
const LIST_MAX: usize = 8;

/// Unit suffixes of field names, the longest first.
const UNITS: [&str; 13] = [
    "_rad_s2", "_rad_s", "_m_s2", "_m_s", "_kg_m2", "_bytes", "_rad", "_deg", "_kg", "_ms", "_m", "_n", "_s",
];

/// The topics whose records are decoded for a table; the others are read by the schema in the log.
pub(crate) const DECODED: [&str; 6] =
    [TOPIC_COMPUTER_START, TOPIC_COMPUTER_FRAME, TOPIC_EVENTS, TOPIC_RAW_RX, TOPIC_RAW_TX, TOPIC_VERDICT];

/// Column of the flight computer's frames that is not in the record: time since the release, s.
pub(crate) const FLIGHT_TIME_S: &str = "flight_time_s";

/// The type of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Numbers.
    Float,
    /// Whole numbers, and flags as 0 and 1.
    Integer,
    Text,
}

/// One column of a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Column {
    /// Its name, with its unit.
    pub name: String,
    pub kind: Kind,
}

impl Column {
    fn of(name: &str, kind: Kind) -> Self {
        Self { name: name.to_owned(), kind }
    }
}

/// The name and the columns of a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TableShape {
    /// Its name: the topic in lower case with underscores, as in `controller_frame`.
    pub name: String,
    /// Its columns; the first is `log_time_ns`, Unix time.
    pub columns: Vec<Column>,
}

impl TableShape {
    pub(super) fn new(name: &str, columns: &[(&str, Kind)]) -> Self {
        let time = Column::of("log_time_ns", Kind::Integer);
        let others = columns.iter().map(|(name, kind)| Column::of(name, *kind));
        Self { name: name.to_owned(), columns: std::iter::once(time).chain(others).collect() }
    }

    /// The index of a column.
    pub(crate) fn place_of(&self, name: &str) -> Option<usize> {
        self.columns.iter().position(|column| column.name == name)
    }

    /// The table of a kind of record, and the columns of its fields, which begin behind the time.
    /// Lists are assumed to be as long as in this first record.
    fn of_record(name: &str, first: &DynamicMessage) -> (Self, Layout) {
        let mut shape = Self::new(name, &[]);
        let layout = layout(&first.descriptor(), Some(first), &mut Vec::new(), &mut shape.columns);
        (shape, layout)
    }
}

/// The name of a topic's table.
pub(super) fn table_name(topic: &str) -> String {
    let word = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '_' };
    topic.trim_matches('/').chars().map(word).collect()
}

/// The columns of a message's fields, which are added to the others; `above` are the names of the
/// fields that contain it.
fn layout(
    descriptor: &MessageDescriptor,
    record: Option<&DynamicMessage>,
    above: &mut Vec<String>,
    columns: &mut Vec<Column>,
) -> Layout {
    let mut layout = Layout::default();
    // A schema may contain itself; this is the deepest nesting that is followed.
    if above.len() > LIST_MAX {
        return layout;
    }
    for field in descriptor.fields() {
        above.push(field.name().to_owned());
        let name = above.join(".");
        let value = record.map(|record| record.get_field(&field).into_owned());
        let (first, kind) = (columns.len(), field.kind());
        let slot = match (kind, Scalar::of(&field.kind()), value) {
            (FieldKind::Message(inner), _, value) if !field.is_list() && !field.is_map() => {
                let below = value.as_ref().and_then(|value| value.as_message());
                Some(Slot::Message(self::layout(&inner, below, above, columns)))
            }
            (_, Some(scalar), Some(Value::List(items))) if field.is_list() && items.len() <= LIST_MAX => {
                let count = items.len();
                let named = |element| Column { name: element_name(&name, element), kind: scalar.column };
                columns.extend((0..count).map(named));
                Some(Slot::Values { scalar, first, count })
            }
            (_, Some(scalar), _) if !field.is_list() => {
                columns.push(Column { name, kind: scalar.column });
                Some(Slot::Values { scalar, first, count: 1 })
            }
            _ => None,
        };
        layout.0.extend(slot.map(|slot| (field.number(), slot)));
        above.pop();
    }
    layout
}

/// The second element of `fins_rad` is `fins_2_rad`: the unit stays at the end.
fn element_name(name: &str, element: usize) -> String {
    let unit = UNITS.into_iter().find(|suffix| name.ends_with(suffix)).unwrap_or_default();
    format!("{}_{}{unit}", name.strip_suffix(unit).unwrap_or(name), element + 1)
}

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
    /// Every table seen so far.
    pub shapes: Vec<TableShape>,
    /// By channel; `None` for records that are not ours.
    channels: BTreeMap<u16, Option<OpenTable>>,
    /// The tables of MAVLink messages.
    messages: BTreeMap<(Address, u32), usize>,
    /// MAVLink messages have no rows.
    leaves_messages_out: bool,
}

/// The known structure of a channel's records.
struct OpenTable {
    table: usize,
    columns: usize,
    layout: Layout,
}

impl TableReader {
    /// Reads the tables of records alone.
    pub(crate) fn without_messages() -> Self {
        Self { leaves_messages_out: true, ..Self::default() }
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
                let table = place_of(&mut self.shapes, TableShape::new(&table_name(TOPIC_EVENTS), &columns));
                let cells = vec![
                    time,
                    Cell::Integer(i64::from(event.level)),
                    Cell::Text(event.name.clone()),
                    Cell::Text(event.message.clone()),
                ];
                vec![Row { table, cells }]
            }
            Entry::RawFrame if self.leaves_messages_out => Vec::new(),
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
        let table = match self.messages.get(&key) {
            Some(table) => *table,
            None => *self.messages.entry(key).or_insert(place_of(&mut self.shapes, shape_of_frame(&frame)?)),
        };
        let fact = |key: &str| channel.metadata.get(key).map_or("", String::as_str);
        let direction = if channel.topic == TOPIC_RAW_RX { "rx" } else { "tx" };
        let cells = cells_of_frame(&frame, [fact("endpoint"), direction, fact("link")]);
        Some(Row { table, cells: std::iter::once(time).chain(cells).collect() })
    }

    /// A record of one of our packages, with the schema in the log.
    fn record<R: Read>(&mut self, log: &FlightLog<R>, stamped: &StampedEntry, time: Cell) -> Option<Row> {
        let channel = log.channel(stamped.channel_id).filter(|_| stamped.data.len() <= RECORD_MAX_BYTES)?;
        let opened = || {
            let first = DynamicMessage::decode(described(channel)?, stamped.data.as_slice()).ok()?;
            let (mut shape, layout) = TableShape::of_record(&table_name(&channel.topic), &first);
            if channel.topic == TOPIC_COMPUTER_FRAME {
                shape.columns.push(Column::of(FLIGHT_TIME_S, Kind::Float));
            }
            let columns = shape.columns.len();
            Some(OpenTable { table: place_of(&mut self.shapes, shape), columns, layout })
        };
        let known = self.channels.entry(stamped.channel_id).or_insert_with(opened);
        let OpenTable { table, columns, layout } = known.as_ref()?;
        let mut cells = vec![Cell::Absent; *columns];
        layout.read(&stamped.data, &mut cells).ok()?;
        cells[0] = time;
        if let Entry::ComputerFrame(frame) = &stamped.entry
            && let Some(last) = cells.last_mut()
        {
            *last = frame.flight_time_s().map_or(Cell::Absent, Cell::Float);
        }
        Some(Row { table: *table, cells })
    }

    fn limits_of(&mut self, verdict: &v1::LandingVerdict, time: &Cell) -> Vec<Row> {
        let name = format!("{}_limits", table_name(TOPIC_VERDICT));
        let columns = [("standard", Kind::Text), ("limit", Kind::Text), ("unit", Kind::Text)]
            .into_iter()
            .chain(["value", "minimum", "maximum"].map(|name| (name, Kind::Float)))
            .chain([("passed", Kind::Integer)]);
        let table = place_of(&mut self.shapes, TableShape::new(&name, &columns.collect::<Vec<_>>()));
        let row = |(standard, limit): (&str, &v1::LimitResult)| {
            let words = [standard, &limit.name, &limit.unit].map(|word| Cell::Text(word.to_owned()));
            let numbers = [limit.value, limit.minimum, limit.maximum].map(Cell::Float);
            let passed = Cell::Integer(i64::from(limit.passed));
            let cells = std::iter::once(time.clone()).chain(words).chain(numbers).chain([passed]).collect();
            Row { table, cells }
        };
        let [_, _, envelope, table_2] = Landing::COLUMNS;
        let all = [("borne", &verdict.borne), (envelope, &verdict.envelope), (table_2, &verdict.table_2)];
        all.into_iter()
            .flat_map(|(standard, limits)| limits.iter().map(move |one| (standard, one)))
            .map(row)
            .collect()
    }
}

/// The index of a table; two channels with one topic share one.
fn place_of(shapes: &mut Vec<TableShape>, shape: TableShape) -> usize {
    shapes.iter().position(|known| *known == shape).unwrap_or_else(|| {
        shapes.push(shape);
        shapes.len() - 1
    })
}

/// Describes a channel's records from the schema in the log; `None` for records that are not ours.
fn described(channel: &LogChannel) -> Option<MessageDescriptor> {
    if channel.message_encoding != "protobuf" || !channel.schema_name.starts_with("touchdown.") {
        return None;
    }
    let pool = DescriptorPool::decode(channel.schema.as_ref()).ok()?;
    pool.get_message_by_name(&channel.schema_name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_elements_number_stands_before_its_unit() {
        for (name, second) in [
            ("output.fins_rad", "output.fins_2_rad"),
            ("gimbal_rad_s", "gimbal_2_rad_s"),
            ("position_m", "position_2_m"),
            ("counts", "counts_2"),
        ] {
            assert_eq!(element_name(name, 1), second);
        }
    }
}

//! Writes tables into files.

use std::collections::BTreeMap;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use ::parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use ::parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use ::parquet::errors::ParquetError;
use ::parquet::file::metadata::KeyValue;
use ::parquet::file::properties::WriterProperties;
use ::parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use ::parquet::schema::types::Type;
use serde::Serialize;

use super::ExportError;
use crate::log::FlightLog;
use crate::output::{Destination, NewFile, WriteError};
use crate::table::{Cell, Column, Kind, Meaning, Row, TableReader, TableShape};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TableFormat {
    /// Comma-separated values (RFC 4180), numbers in the shortest form that reads back as the same.
    Csv,
    /// Apache Parquet, with Snappy compression.
    Parquet,
}

/// A file that was written.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ExportedFile {
    pub path: PathBuf,
    pub rows: u64,
    pub columns: usize,
}

enum Table {
    Csv(PathBuf, Box<csv::Writer<NewFile>>),
    Parquet(Box<ParquetTable>),
}

/// Writes every table of a log into a directory, which is created if needed. Memory does not grow with the log. The
/// files get their names when all of them are complete.
///
/// # Errors
/// The log cannot be read, a file cannot be written, or a file exists and may not be replaced.
pub fn export_tables<'a, R: Read>(
    log: &mut FlightLog<R>,
    format: TableFormat,
    directory: impl Into<Destination<'a>>,
) -> Result<Vec<ExportedFile>, ExportError> {
    let directory = directory.into();
    let input = PathBuf::from(log.name());
    let mut open: BTreeMap<usize, (ExportedFile, Table)> = BTreeMap::new();
    let mut reader = TableReader::new();
    reader.read::<R, ExportError>(log, |shape, row| {
        let (file, table) = match open.entry(row.table) {
            std::collections::btree_map::Entry::Occupied(entry) => entry.into_mut(),
            std::collections::btree_map::Entry::Vacant(entry) => {
                entry.insert(create(format, directory, &input, shape)?)
            }
        };
        file.rows += 1;
        Ok(table.write(&row)?)
    })?;
    let finished = open.into_values().map(|(file, table)| Ok((file, table.finish()?)));
    let mut whole: Vec<(ExportedFile, NewFile)> = finished.collect::<Result<_, ExportError>>()?;
    if !whole.is_empty() {
        let path = directory.path.join(DICTIONARY);
        let destination = Destination { path: &path, force: directory.force };
        let file = NewFile::create(destination, &input)?;
        let (written, rows) = dictionary(file, reader.shapes()).map_err(WriteError::at(&path))?;
        whole.push((ExportedFile { path, rows, columns: DICTIONARY_COLUMNS.len() }, written));
    }
    let mut files = Vec::new();
    for (file, written) in whole {
        written.commit()?;
        files.push(file);
    }
    Ok(files)
}

fn create(
    format: TableFormat,
    Destination { path: directory, force }: Destination,
    input: &Path,
    shape: &TableShape,
) -> Result<(ExportedFile, Table), ExportError> {
    let suffix = match format {
        TableFormat::Csv => "csv",
        TableFormat::Parquet => "parquet",
    };
    // The directory is created with the first table, so that a file that is not a flight log leaves nothing behind.
    std::fs::create_dir_all(directory).map_err(WriteError::at(directory))?;
    let path = directory.join(format!("{}.{suffix}", shape.name));
    let file = NewFile::create(Destination { path: &path, force }, input)?;
    let table = match format {
        TableFormat::Csv => {
            let mut csv = csv::Writer::from_writer(file);
            let head = csv.write_record(shape.columns.iter().map(|column| &column.name));
            head.map_err(io::Error::from).map_err(WriteError::at(&path))?;
            Table::Csv(path.clone(), Box::new(csv))
        }
        TableFormat::Parquet => Table::Parquet(Box::new(ParquetTable::create(file, shape)?)),
    };
    Ok((ExportedFile { path, rows: 0, columns: shape.columns.len() }, table))
}

impl Table {
    fn write(&mut self, row: &Row) -> Result<(), WriteError> {
        match self {
            Self::Csv(path, csv) => {
                let written = csv.write_record(row.cells.iter().map(text_of));
                written.map_err(io::Error::from).map_err(WriteError::at(path))
            }
            Self::Parquet(table) => table.write(row),
        }
    }

    /// The complete file, still under its temporary name.
    fn finish(self) -> Result<NewFile, WriteError> {
        match self {
            Self::Csv(path, csv) => {
                csv.into_inner().map_err(csv::IntoInnerError::into_error).map_err(WriteError::at(&path))
            }
            Self::Parquet(table) => table.finish(),
        }
    }
}

fn text_of(cell: &Cell) -> String {
    match cell {
        Cell::Float(number) => format!("{number:?}"),
        Cell::Integer(number) => number.to_string(),
        Cell::Text(text) => text.clone(),
        Cell::Absent => String::new(),
    }
}

/// The name of its file.
const DICTIONARY: &str = "dictionary.csv";
const DICTIONARY_COLUMNS: [&str; 6] = ["table", "column", "type", "unit", "meaning", "values"];

/// Writes the dictionary of some tables. Returns the complete file, still under its temporary name, and its rows.
fn dictionary(file: NewFile, shapes: &[TableShape]) -> io::Result<(NewFile, u64)> {
    let mut csv = csv::Writer::from_writer(file);
    csv.write_record(DICTIONARY_COLUMNS)?;
    let mut rows = 0;
    for (shape, Column { name, kind, meaning }) in
        shapes.iter().flat_map(|shape| shape.columns.iter().map(move |column| (shape, column)))
    {
        let kind = match kind {
            Kind::Float => "number",
            Kind::Integer => "whole number",
            Kind::Text => "text",
        };
        csv.write_record([&shape.name, name, kind, &meaning.unit, &meaning.words, &values(meaning)])?;
        rows += 1;
    }
    Ok((csv.into_inner().map_err(csv::IntoInnerError::into_error)?, rows))
}

/// The words for the numbers of a column, as in `9 TD_PHASE_POWERED; 10 TD_PHASE_TOUCHDOWN`.
fn values(meaning: &Meaning) -> String {
    let values = meaning.values().iter().map(|(number, word)| format!("{number} {word}"));
    values.collect::<Vec<_>>().join("; ")
}

/// Number of rows in a group; a group is held in memory until it is written.
const GROUP_ROWS: usize = 16_384;

struct ParquetTable {
    path: PathBuf,
    columns: Vec<Column>,
    writer: SerializedFileWriter<NewFile>,
    held: Vec<Vec<Cell>>,
}

impl ParquetTable {
    fn create(file: NewFile, shape: &TableShape) -> Result<Self, WriteError> {
        let path = file.path().to_owned();
        let failed = |error: ParquetError| WriteError::at(&path)(io::Error::other(error));
        let schema = schema_of(shape).map_err(failed)?;
        let properties = WriterProperties::builder()
            .set_compression(Compression::SNAPPY)
            .set_key_value_metadata(Some(metadata_of(shape)))
            .build();
        let writer =
            SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties)).map_err(failed)?;
        Ok(Self { path, columns: shape.columns.clone(), writer, held: Vec::new() })
    }

    fn write(&mut self, row: &Row) -> Result<(), WriteError> {
        self.held.push(row.cells.clone());
        if self.held.len() >= GROUP_ROWS { self.write_group() } else { Ok(()) }
    }

    /// The complete file, still under its temporary name.
    fn finish(mut self) -> Result<NewFile, WriteError> {
        self.write_group()?;
        self.writer.into_inner().map_err(io::Error::other).map_err(WriteError::at(&self.path))
    }

    fn write_group(&mut self) -> Result<(), WriteError> {
        let rows = std::mem::take(&mut self.held);
        if rows.is_empty() {
            return Ok(());
        }
        let written = group(&mut self.writer, &self.columns, &rows);
        written.map_err(io::Error::other).map_err(WriteError::at(&self.path))
    }
}

fn group(
    writer: &mut SerializedFileWriter<NewFile>,
    columns: &[Column],
    rows: &[Vec<Cell>],
) -> Result<(), ParquetError> {
    let mut group = writer.next_row_group()?;
    for (place, column) in columns.iter().enumerate() {
        let cells = || rows.iter().map(move |cells| cells.get(place).unwrap_or(&Cell::Absent));
        let Some(mut writer) = group.next_column()? else {
            return Err(ParquetError::General(format!("no column for {}", column.name)));
        };
        write_column(&mut writer, column.kind, cells)?;
        writer.close()?;
    }
    group.close().map(|_| ())
}

/// Parquet definition levels: 1 for a cell with a value, 0 for an empty cell.
fn write_column<'a, I: Iterator<Item = &'a Cell>>(
    writer: &mut SerializedColumnWriter<'_>,
    kind: Kind,
    cells: impl Fn() -> I,
) -> Result<(), ParquetError> {
    match kind {
        Kind::Float => put::<DoubleType>(writer, cells().map(Cell::number)),
        Kind::Integer => put::<Int64Type>(
            writer,
            cells().map(|cell| match cell {
                Cell::Integer(number) => Some(*number),
                _ => None,
            }),
        ),
        Kind::Text => put::<ByteArrayType>(
            writer,
            cells().map(|cell| match cell {
                Cell::Text(text) => Some(ByteArray::from(text.as_str())),
                _ => None,
            }),
        ),
    }
}

fn put<T: DataType>(
    writer: &mut SerializedColumnWriter<'_>,
    cells: impl Iterator<Item = Option<T::T>>,
) -> Result<(), ParquetError> {
    let cells: Vec<Option<T::T>> = cells.collect();
    let levels: Vec<i16> = cells.iter().map(|cell| i16::from(cell.is_some())).collect();
    let values: Vec<T::T> = cells.into_iter().flatten().collect();
    writer.typed::<T>().write_batch(&values, Some(&levels), None).map(|_| ())
}

/// The unit, the meaning and the words of each column: `COLUMN.unit`, `COLUMN.meaning`, `COLUMN.values`.
fn metadata_of(shape: &TableShape) -> Vec<KeyValue> {
    let mut metadata = Vec::new();
    for Column { name, meaning, .. } in &shape.columns {
        let facts =
            [("unit", meaning.unit.clone()), ("meaning", meaning.words.clone()), ("values", values(meaning))];
        let said = facts.into_iter().filter(|(_, text)| !text.is_empty());
        metadata.extend(said.map(|(fact, text)| KeyValue::new(format!("{name}.{fact}"), text)));
    }
    metadata
}

fn schema_of(shape: &TableShape) -> Result<Type, ParquetError> {
    let field = |column: &Column| {
        let (physical, logical) = match column.kind {
            Kind::Float => (Physical::DOUBLE, None),
            Kind::Integer => (Physical::INT64, None),
            Kind::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
        };
        Type::primitive_type_builder(&column.name, physical)
            .with_repetition(Repetition::OPTIONAL)
            .with_logical_type(logical)
            .build()
            .map(Arc::new)
    };
    let fields = shape.columns.iter().map(field).collect::<Result<Vec<_>, _>>()?;
    Type::group_type_builder(&shape.name).with_fields(fields).build()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_back() {
        for number in [0.1, -0.0, 1e300, f64::MIN_POSITIVE, 3.0] {
            assert_eq!(text_of(&Cell::Float(number)).parse::<f64>().unwrap().to_bits(), number.to_bits());
        }
        assert_eq!(
            (text_of(&Cell::Float(f64::NAN)), text_of(&Cell::Absent)),
            ("NaN".to_owned(), String::new())
        );
    }
}

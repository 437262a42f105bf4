//! Writes tables into files.

use std::collections::BTreeMap;
use std::io::{self, BufWriter, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use ::parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use ::parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
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
    Csv(CsvTable),
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
    let whole: Vec<(ExportedFile, NewFile)> = finished.collect::<Result<_, ExportError>>()?;
    let mut whole = whole;
    if !whole.is_empty() {
        let path = directory.path.join(DICTIONARY);
        let destination = Destination { path: &path, overwrite: directory.overwrite };
        let file = NewFile::create(destination, &input)?;
        let shapes: Vec<&TableShape> = reader.shapes().iter().collect();
        let (written, rows) = write_dictionary(file, &shapes)?;
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
    Destination { path: directory, overwrite }: Destination,
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
    let file = NewFile::create(Destination { path: &path, overwrite }, input)?;
    let table = match format {
        TableFormat::Csv => Table::Csv(CsvTable::create(file, shape)?),
        TableFormat::Parquet => Table::Parquet(Box::new(ParquetTable::create(file, shape)?)),
    };
    Ok((ExportedFile { path, rows: 0, columns: shape.columns.len() }, table))
}

impl Table {
    fn write(&mut self, row: &Row) -> Result<(), WriteError> {
        match self {
            Self::Csv(table) => table.write(row),
            Self::Parquet(table) => table.write(row),
        }
    }

    fn finish(self) -> Result<NewFile, WriteError> {
        match self {
            Self::Csv(table) => table.finish(),
            Self::Parquet(table) => table.finish(),
        }
    }
}

struct CsvTable {
    path: PathBuf,
    output: BufWriter<NewFile>,
}

impl CsvTable {
    fn create(file: NewFile, shape: &TableShape) -> Result<Self, WriteError> {
        let path = file.path().to_owned();
        let mut output = BufWriter::new(file);
        let names: Vec<String> = shape.columns.iter().map(|column| quoted(&column.name)).collect();
        writeln!(output, "{}", names.join(",")).map_err(WriteError::at(&path))?;
        Ok(Self { path, output })
    }

    fn write(&mut self, row: &Row) -> Result<(), WriteError> {
        let cells: Vec<String> = row.cells.iter().map(text_of).collect();
        writeln!(self.output, "{}", cells.join(",")).map_err(WriteError::at(&self.path))
    }

    /// The complete file, still under its temporary name.
    fn finish(self) -> Result<NewFile, WriteError> {
        let file = self.output.into_inner().map_err(io::IntoInnerError::into_error);
        file.map_err(WriteError::at(&self.path))
    }
}

fn text_of(cell: &Cell) -> String {
    match cell {
        Cell::Float(number) => format!("{number:?}"),
        Cell::Integer(number) => number.to_string(),
        Cell::Text(text) => quoted(text),
        Cell::Absent => String::new(),
    }
}

fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

/// The name of its file.
const DICTIONARY: &str = "dictionary.csv";
const DICTIONARY_COLUMNS: [&str; 6] = ["table", "column", "type", "unit", "meaning", "values"];

/// Writes the dictionary of some tables. Returns the complete file, still under its temporary name, and its rows.
fn write_dictionary(file: NewFile, shapes: &[&TableShape]) -> Result<(NewFile, u64), WriteError> {
    let heads = DICTIONARY_COLUMNS.map(|name| Column {
        name: name.to_owned(),
        kind: Kind::Text,
        meaning: Meaning::default(),
    });
    let mut table =
        CsvTable::create(file, &TableShape { name: "dictionary".to_owned(), columns: heads.into() })?;
    let mut rows = 0;
    for shape in shapes {
        for Column { name, kind, meaning } in &shape.columns {
            let kind = match kind {
                Kind::Float => "number",
                Kind::Integer => "whole number",
                Kind::Text => "text",
            };
            let cells = [&shape.name, name, kind, &meaning.unit, &meaning.words, &values(meaning)];
            let cells = cells.map(|text: &str| Cell::Text(text.to_owned()));
            table.write(&Row { table: 0, cells: cells.into() })?;
            rows += 1;
        }
    }
    Ok((table.finish()?, rows))
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
        Kind::Float => {
            let values: Vec<f64> = cells().filter_map(Cell::number).collect();
            let levels: Vec<i16> = cells().map(|cell| i16::from(cell.number().is_some())).collect();
            writer.typed::<DoubleType>().write_batch(&values, Some(&levels), None)?;
        }
        Kind::Integer => {
            let whole = |cell: &Cell| match cell {
                Cell::Integer(number) => Some(*number),
                _ => None,
            };
            let values: Vec<i64> = cells().filter_map(whole).collect();
            let levels: Vec<i16> = cells().map(|cell| i16::from(whole(cell).is_some())).collect();
            writer.typed::<Int64Type>().write_batch(&values, Some(&levels), None)?;
        }
        Kind::Text => {
            let text = |cell: &Cell| match cell {
                Cell::Text(text) => Some(ByteArray::from(text.as_str())),
                _ => None,
            };
            let values: Vec<ByteArray> = cells().filter_map(text).collect();
            let levels: Vec<i16> = cells().map(|cell| i16::from(text(cell).is_some())).collect();
            writer.typed::<ByteArrayType>().write_batch(&values, Some(&levels), None)?;
        }
    }
    Ok(())
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
    fn numbers_read_back_and_text_is_quoted_only_where_necessary() {
        for number in [0.1, -0.0, 1e300, f64::MIN_POSITIVE, 3.0] {
            assert_eq!(text_of(&Cell::Float(number)).parse::<f64>().unwrap().to_bits(), number.to_bits());
        }
        assert_eq!(text_of(&Cell::Float(f64::NAN)), "NaN");
        assert_eq!(text_of(&Cell::Absent), "");
        assert_eq!(quoted("plain"), "plain");
        assert_eq!(quoted("a \"b\", c"), "\"a \"\"b\"\", c\"");
    }
}

//! Writes a table as Apache Parquet, column by column, without Arrow.

use std::path::PathBuf;
use std::sync::Arc;

use ::parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use ::parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use ::parquet::errors::ParquetError;
use ::parquet::file::metadata::KeyValue;
use ::parquet::file::properties::WriterProperties;
use ::parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use ::parquet::schema::types::Type;

use super::ExportError;
use super::dictionary::values;
use crate::output::NewFile;
use crate::table::{Cell, Column, Kind, Row, TableShape};

/// Number of rows in a group; a group is held in memory until it is written.
const GROUP_ROWS: usize = 16_384;

pub(super) struct ParquetTable {
    path: PathBuf,
    columns: Vec<Column>,
    writer: SerializedFileWriter<NewFile>,
    held: Vec<Vec<Cell>>,
}

impl ParquetTable {
    pub(super) fn create(file: NewFile, shape: &TableShape) -> Result<Self, ExportError> {
        let path = file.path().to_owned();
        let failed = |source| ExportError::Parquet { path: path.clone(), source };
        let schema = schema_of(shape).map_err(failed)?;
        let properties = WriterProperties::builder()
            .set_compression(Compression::SNAPPY)
            .set_key_value_metadata(Some(metadata_of(shape)))
            .build();
        let writer =
            SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties)).map_err(failed)?;
        Ok(Self { path, columns: shape.columns.clone(), writer, held: Vec::new() })
    }

    pub(super) fn write(&mut self, row: &Row) -> Result<(), ExportError> {
        self.held.push(row.cells.clone());
        if self.held.len() >= GROUP_ROWS { self.write_group() } else { Ok(()) }
    }

    /// The complete file, still under its temporary name.
    pub(super) fn finish(mut self) -> Result<NewFile, ExportError> {
        self.write_group()?;
        let path = self.path;
        self.writer.into_inner().map_err(|source| ExportError::Parquet { path, source })
    }

    fn write_group(&mut self) -> Result<(), ExportError> {
        let rows = std::mem::take(&mut self.held);
        if rows.is_empty() {
            return Ok(());
        }
        group(&mut self.writer, &self.columns, &rows)
            .map_err(|source| ExportError::Parquet { path: self.path.clone(), source })
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

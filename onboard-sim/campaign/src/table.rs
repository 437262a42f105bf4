//! Rows as CSV and as Parquet.
//!
//! A number in CSV has enough digits to read the same bits back. Parquet is written without compression and in one row
//! group: a thousand flights need half a megabyte.

use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::types::Type;

use crate::row::{COLUMNS, Column, Kind, Row, Value};

/// Rows as CSV, with a header line.
///
/// # Errors
/// The error of the CSV writer; it does not happen for rows of a campaign.
pub fn to_csv(rows: &[Row]) -> Result<Vec<u8>, csv::Error> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        writer.serialize(row)?;
    }
    writer.into_inner().map_err(|error| error.into_error().into())
}

/// Rows from CSV.
///
/// # Errors
/// A line or a cell does not fit the columns of a campaign.
pub fn from_csv(bytes: &[u8]) -> Result<Vec<Row>, csv::Error> {
    csv::Reader::from_reader(bytes).deserialize().collect()
}

/// Rows as Parquet.
///
/// # Errors
/// The error of the Parquet writer.
pub fn to_parquet(rows: &[Row]) -> Result<Vec<u8>, ParquetError> {
    let fields = COLUMNS.iter().map(field).collect::<Result<_, _>>()?;
    let schema = Type::group_type_builder("flight").with_fields(fields).build()?;
    let properties = WriterProperties::builder().set_created_by("touchdown campaign".to_owned()).build();
    let mut writer = SerializedFileWriter::new(Vec::new(), Arc::new(schema), Arc::new(properties))?;
    let mut group = writer.next_row_group()?;
    for column in COLUMNS {
        // There are as many writers as columns in the schema.
        let Some(mut cells) = group.next_column()? else { break };
        write_column(column, rows, &mut cells)?;
        cells.close()?;
    }
    group.close()?;
    writer.into_inner()
}

fn field(column: &Column) -> Result<Arc<Type>, ParquetError> {
    let (physical, logical, repetition) = match column.kind {
        Kind::Count => (Physical::INT64, None, Repetition::REQUIRED),
        Kind::Real => (Physical::DOUBLE, None, Repetition::REQUIRED),
        Kind::Maybe => (Physical::DOUBLE, None, Repetition::OPTIONAL),
        Kind::Flag => (Physical::BOOLEAN, None, Repetition::REQUIRED),
        Kind::Word => (Physical::BYTE_ARRAY, Some(LogicalType::String), Repetition::REQUIRED),
    };
    let field = Type::primitive_type_builder(column.name, physical)
        .with_logical_type(logical)
        .with_repetition(repetition)
        .build()?;
    Ok(Arc::new(field))
}

fn write_column(
    column: &Column,
    rows: &[Row],
    cells: &mut SerializedColumnWriter<'_>,
) -> Result<(), ParquetError> {
    let values = rows.iter().map(|row| (column.value)(row));
    match column.kind {
        Kind::Count => {
            let counts: Vec<i64> = values
                .filter_map(
                    |value| if let Value::Count(count) = value { i64::try_from(count).ok() } else { None },
                )
                .collect();
            cells.typed::<Int64Type>().write_batch(&counts, None, None)?;
        }
        Kind::Real => {
            let reals: Vec<f64> = values.filter_map(|value| value.number()).collect();
            cells.typed::<DoubleType>().write_batch(&reals, None, None)?;
        }
        Kind::Maybe => {
            let levels: Vec<i16> = values.clone().map(|value| i16::from(value.number().is_some())).collect();
            let reals: Vec<f64> = values.filter_map(|value| value.number()).collect();
            cells.typed::<DoubleType>().write_batch(&reals, Some(&levels), None)?;
        }
        Kind::Flag => {
            let flags: Vec<bool> = values.map(|value| value == Value::Flag(true)).collect();
            cells.typed::<BoolType>().write_batch(&flags, None, None)?;
        }
        Kind::Word => {
            let words: Vec<ByteArray> = values
                .filter_map(
                    |value| if let Value::Word(word) = value { Some(ByteArray::from(word)) } else { None },
                )
                .collect();
            cells.typed::<ByteArrayType>().write_batch(&words, None, None)?;
        }
    }
    Ok(())
}

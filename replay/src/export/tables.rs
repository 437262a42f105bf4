//! Tables into files.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::ExportError;
use super::csv::CsvTable;
use super::parquet::ParquetTable;
use crate::log::FlightLog;
use crate::table::{Row, TableReader, TableShape};

/// A format for tables.
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
    /// Its path.
    pub path: PathBuf,
    /// Its rows.
    pub rows: u64,
    /// Its columns.
    pub columns: usize,
}

enum Table {
    Csv(CsvTable),
    Parquet(Box<ParquetTable>),
}

/// Writes every table of a log into `directory`, which is made if it is not there. Memory does not grow with the log.
///
/// # Errors
/// The log cannot be read or a file cannot be written. Files of the same names are replaced.
pub fn export_tables<R: Read>(
    log: &mut FlightLog<R>,
    format: TableFormat,
    directory: &Path,
) -> Result<Vec<ExportedFile>, ExportError> {
    let mut open: BTreeMap<usize, (ExportedFile, Table)> = BTreeMap::new();
    let mut reader = TableReader::new();
    reader.read::<R, ExportError>(log, |shape, row| {
        let (file, table) = match open.entry(row.table) {
            std::collections::btree_map::Entry::Occupied(entry) => entry.into_mut(),
            std::collections::btree_map::Entry::Vacant(entry) => {
                entry.insert(create(format, directory, shape)?)
            }
        };
        file.rows += 1;
        table.write(&row)
    })?;
    let mut files = Vec::new();
    for (file, table) in open.into_values() {
        table.finish()?;
        files.push(file);
    }
    Ok(files)
}

fn create(
    format: TableFormat,
    directory: &Path,
    shape: &TableShape,
) -> Result<(ExportedFile, Table), ExportError> {
    let suffix = match format {
        TableFormat::Csv => "csv",
        TableFormat::Parquet => "parquet",
    };
    // Not before there is a table to write: what is no flight log leaves nothing behind.
    std::fs::create_dir_all(directory)
        .map_err(|source| ExportError::Write { path: directory.to_owned(), source })?;
    let path = directory.join(format!("{}.{suffix}", shape.name));
    let table = match format {
        TableFormat::Csv => Table::Csv(CsvTable::create(&path, shape)?),
        TableFormat::Parquet => Table::Parquet(Box::new(ParquetTable::create(&path, shape)?)),
    };
    Ok((ExportedFile { path, rows: 0, columns: shape.columns.len() }, table))
}

impl Table {
    fn write(&mut self, row: &Row) -> Result<(), ExportError> {
        match self {
            Self::Csv(table) => table.write(row),
            Self::Parquet(table) => table.write(row),
        }
    }

    fn finish(self) -> Result<(), ExportError> {
        match self {
            Self::Csv(table) => table.finish(),
            Self::Parquet(table) => table.finish(),
        }
    }
}

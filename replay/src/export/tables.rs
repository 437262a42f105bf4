//! Writes tables into files.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::csv::CsvTable;
use super::parquet::ParquetTable;
use super::{ExportError, dictionary};
use crate::log::FlightLog;
use crate::output::{Destination, NewFile};
use crate::table::{Row, TableReader, TableShape};

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
        table.write(&row)
    })?;
    let finished = open.into_values().map(|(file, table)| Ok((file, table.finish()?)));
    let whole: Vec<(ExportedFile, NewFile)> = finished.collect::<Result<_, ExportError>>()?;
    let mut whole = whole;
    if !whole.is_empty() {
        let path = directory.path.join(dictionary::FILE);
        let failed = |source| ExportError::Write { path: path.clone(), source };
        let destination = Destination { path: &path, overwrite: directory.overwrite };
        let file = NewFile::create(destination, &input).map_err(failed)?;
        let shapes: Vec<&TableShape> = reader.shapes().iter().collect();
        let (written, rows) = dictionary::write(file, &shapes)?;
        whole.push((ExportedFile { path, rows, columns: dictionary::COLUMNS.len() }, written));
    }
    let mut files = Vec::new();
    for (file, written) in whole {
        written.commit().map_err(|source| ExportError::Write { path: file.path.clone(), source })?;
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
    std::fs::create_dir_all(directory)
        .map_err(|source| ExportError::Write { path: directory.to_owned(), source })?;
    let path = directory.join(format!("{}.{suffix}", shape.name));
    let file = NewFile::create(Destination { path: &path, overwrite }, input)
        .map_err(|source| ExportError::Write { path: path.clone(), source })?;
    let table = match format {
        TableFormat::Csv => Table::Csv(CsvTable::create(file, shape)?),
        TableFormat::Parquet => Table::Parquet(Box::new(ParquetTable::create(file, shape)?)),
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

    fn finish(self) -> Result<NewFile, ExportError> {
        match self {
            Self::Csv(table) => table.finish(),
            Self::Parquet(table) => table.finish(),
        }
    }
}

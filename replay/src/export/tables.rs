//! Writes tables into files: comma-separated values (RFC 4180), numbers in the shortest form that reads back as the same.

use std::collections::BTreeMap;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use anyhow::Result;
use serde::Serialize;

use crate::log::FlightLog;
use crate::output::{NewFile, WriteError, new_folder};
use crate::table::{Cell, Column, Kind, Meaning, TableReader, TableShape};

/// A file that was written.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ExportedFile {
    pub path: PathBuf,
    pub rows: u64,
    pub columns: usize,
}

/// Writes every table of a log into a new folder. Memory does not grow with the log. The files get their names when all of them are
/// complete.
///
/// # Errors
/// The log cannot be read, or a file cannot be written.
pub fn export_tables<R: Read>(log: &mut FlightLog<R>, directory: &Path) -> Result<Vec<ExportedFile>> {
    // It is made with the first table, so that a file that is not a flight log leaves nothing behind.
    let mut folder = None;
    let mut open: BTreeMap<usize, (ExportedFile, csv::Writer<NewFile>)> = BTreeMap::new();
    let mut reader = TableReader::new();
    reader.read::<R, anyhow::Error>(log, |shape, row| {
        let (file, csv) = match open.entry(row.table) {
            std::collections::btree_map::Entry::Occupied(entry) => entry.into_mut(),
            std::collections::btree_map::Entry::Vacant(entry) => {
                let (folder, _held) = match &folder {
                    Some(made) => made,
                    None => folder.insert(new_folder(directory)?),
                };
                entry.insert(create(folder, shape)?)
            }
        };
        file.rows += 1;
        let written = csv.write_record(row.cells.iter().map(text_of));
        Ok(written.map_err(io::Error::from).map_err(WriteError::at(&file.path))?)
    })?;
    let finished = open.into_values().map(|(file, csv)| {
        let written = csv.into_inner().map_err(csv::IntoInnerError::into_error);
        let written = written.map_err(WriteError::at(&file.path))?;
        Ok((file, written))
    });
    let mut whole: Vec<(ExportedFile, NewFile)> = finished.collect::<Result<_>>()?;
    if let Some((folder, _held)) = &folder {
        let path = folder.join(DICTIONARY);
        let file = NewFile::replace(&path)?;
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

fn create(folder: &Path, shape: &TableShape) -> Result<(ExportedFile, csv::Writer<NewFile>)> {
    let path = folder.join(format!("{}.csv", shape.name));
    let mut csv = csv::Writer::from_writer(NewFile::replace(&path)?);
    let head = csv.write_record(shape.columns.iter().map(|column| &column.name));
    head.map_err(io::Error::from).map_err(WriteError::at(&path))?;
    Ok((ExportedFile { path, rows: 0, columns: shape.columns.len() }, csv))
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

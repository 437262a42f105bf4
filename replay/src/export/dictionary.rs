//! The data dictionary: every column of every table with its type, unit, meaning and the words for its numbers.

use super::ExportError;
use super::csv::CsvTable;
use crate::output::NewFile;
use crate::table::{Cell, Column, Kind, Meaning, Row, TableShape};

/// The name of its file.
pub(super) const FILE: &str = "dictionary.csv";
pub(super) const COLUMNS: [&str; 6] = ["table", "column", "type", "unit", "meaning", "values"];

/// Writes the dictionary of some tables. Returns the complete file, still under its temporary name, and its rows.
pub(super) fn write(file: NewFile, shapes: &[&TableShape]) -> Result<(NewFile, u64), ExportError> {
    let heads =
        COLUMNS.map(|name| Column { name: name.to_owned(), kind: Kind::Text, meaning: Meaning::default() });
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
pub(super) fn values(meaning: &Meaning) -> String {
    let values = meaning.values().iter().map(|(number, word)| format!("{number} {word}"));
    values.collect::<Vec<_>>().join("; ")
}

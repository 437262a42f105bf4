//! Writes a table as comma-separated values.

use std::io::{BufWriter, Write};
use std::path::PathBuf;

use super::ExportError;
use crate::output::NewFile;
use crate::table::{Cell, Row, TableShape};

pub(super) struct CsvTable {
    path: PathBuf,
    output: BufWriter<NewFile>,
}

impl CsvTable {
    pub(super) fn create(file: NewFile, shape: &TableShape) -> Result<Self, ExportError> {
        let path = file.path().to_owned();
        let write = |source| ExportError::Write { path: path.clone(), source };
        let mut output = BufWriter::new(file);
        let names: Vec<String> = shape.columns.iter().map(|column| quoted(&column.name)).collect();
        writeln!(output, "{}", names.join(",")).map_err(write)?;
        Ok(Self { path, output })
    }

    pub(super) fn write(&mut self, row: &Row) -> Result<(), ExportError> {
        let cells: Vec<String> = row.cells.iter().map(text_of).collect();
        writeln!(self.output, "{}", cells.join(",")).map_err(|source| self.failed(source))
    }

    /// The complete file, still under its temporary name.
    pub(super) fn finish(self) -> Result<NewFile, ExportError> {
        let Self { path, output } = self;
        output.into_inner().map_err(|error| ExportError::Write { path, source: error.into_error() })
    }

    fn failed(&self, source: std::io::Error) -> ExportError {
        ExportError::Write { path: self.path.clone(), source }
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

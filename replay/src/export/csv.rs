//! A table as comma-separated values.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use super::ExportError;
use crate::table::{Cell, Row, TableShape};

pub(super) struct CsvTable {
    path: PathBuf,
    output: BufWriter<File>,
}

impl CsvTable {
    pub(super) fn create(path: &Path, shape: &TableShape) -> Result<Self, ExportError> {
        let write = |source| ExportError::Write { path: path.to_owned(), source };
        let mut output = BufWriter::new(File::create(path).map_err(write)?);
        let names: Vec<String> = shape.columns.iter().map(|column| quoted(&column.name)).collect();
        writeln!(output, "{}", names.join(",")).map_err(write)?;
        Ok(Self { path: path.to_owned(), output })
    }

    pub(super) fn write(&mut self, row: &Row) -> Result<(), ExportError> {
        let cells: Vec<String> = row.cells.iter().map(text_of).collect();
        writeln!(self.output, "{}", cells.join(",")).map_err(|source| self.failed(source))
    }

    pub(super) fn finish(mut self) -> Result<(), ExportError> {
        self.output.flush().map_err(|source| self.failed(source))
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
    fn numbers_read_back_and_text_is_quoted_only_where_it_must_be() {
        for number in [0.1, -0.0, 1e300, f64::MIN_POSITIVE, 3.0] {
            assert_eq!(text_of(&Cell::Float(number)).parse::<f64>().unwrap().to_bits(), number.to_bits());
        }
        assert_eq!(text_of(&Cell::Float(f64::NAN)), "NaN");
        assert_eq!(text_of(&Cell::Absent), "");
        assert_eq!(quoted("plain"), "plain");
        assert_eq!(quoted("a \"b\", c"), "\"a \"\"b\"\", c\"");
    }
}

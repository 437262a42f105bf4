//! Writes the content of a log as tables for other programs: comma-separated values (RFC 4180), one
//! file a table ([`table`](crate::table)), numbers in the shortest form that reads back as the
//! same.
//!
//! A separate program exports to Rerun, because Rerun costs more to compile than all the rest.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::io::{self, Read, Write as _};
use std::path::{Path, PathBuf};

use anyhow::Result;
use protocol::program::Exit;
use serde::Serialize;

use crate::cli::{Answer, answer, ending, give, warn_of_loss};
use crate::log::FlightLog;
use crate::output::{NewFile, WriteError, new_folder};
use crate::report::FlownPath;
use crate::table::{Cell, DECODED, TableReader, TableShape};

/// A file that was written.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ExportedFile {
    pub path: PathBuf,
    pub rows: u64,
    pub columns: usize,
}

/// Writes every table of a log into a new folder. Memory does not grow with the log. The files get
/// their names when all of them are complete.
///
/// # Errors
/// The log cannot be read, or a file cannot be written.
pub fn export_tables<R: Read>(log: &mut FlightLog<R>, directory: &Path) -> Result<Vec<ExportedFile>> {
    // It is made with the first table, so that a file that is not a flight log leaves nothing
    // behind.
    let mut folder = None;
    let mut text = Vec::new();
    let mut open: BTreeMap<usize, (ExportedFile, csv::Writer<NewFile>)> = BTreeMap::new();
    TableReader::default().read::<R, anyhow::Error>(log, |shape, row| {
        let (file, csv) = match open.entry(row.table) {
            Entry::Occupied(entry) => entry.into_mut(),
            Entry::Vacant(entry) => {
                let (folder, _held) = match &folder {
                    Some(made) => made,
                    None => folder.insert(new_folder(directory)?),
                };
                entry.insert(create(folder, shape)?)
            }
        };
        file.rows += 1;
        let failed = |error: csv::Error| WriteError::at(&file.path)(error.into());
        for cell in row.cells {
            text.clear();
            write_cell(&cell, &mut text)?;
            csv.write_field(&text).map_err(failed)?;
        }
        Ok(csv.write_record(None::<&[u8]>).map_err(failed)?)
    })?;
    let finished = open.into_values().map(|(file, csv)| {
        let written = csv.into_inner().map_err(csv::IntoInnerError::into_error);
        let written = written.map_err(WriteError::at(&file.path))?;
        Ok((file, written))
    });
    let whole: Vec<(ExportedFile, NewFile)> = finished.collect::<Result<_>>()?;
    let named = whole.into_iter().map(|(file, written)| written.commit().map(|_| file));
    Ok(named.collect::<Result<_, WriteError>>()?)
}

fn create(folder: &Path, shape: &TableShape) -> Result<(ExportedFile, csv::Writer<NewFile>)> {
    let path = folder.join(format!("{}.csv", shape.name));
    let mut csv = csv::Writer::from_writer(NewFile::replace(&path)?);
    let head = csv.write_record(shape.columns.iter().map(|column| &column.name));
    head.map_err(io::Error::from).map_err(WriteError::at(&path))?;
    Ok((ExportedFile { path, rows: 0, columns: shape.columns.len() }, csv))
}

fn write_cell(cell: &Cell, text: &mut Vec<u8>) -> io::Result<()> {
    match cell {
        Cell::Float(number) => write!(text, "{number:?}"),
        Cell::Integer(number) => write!(text, "{number}"),
        Cell::Text(words) => text.write_all(words.as_bytes()),
        Cell::Absent => Ok(()),
    }
}

/// A directory, or a file of a format that is written.
fn destination(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match ending(&path).as_str() {
        "" | "kml" | "gpx" => Ok(path),
        _ if path.is_dir() => Ok(path),
        other => Err(format!(".{other} cannot be written: a directory, .kml or .gpx is accepted")),
    }
}

#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The log, an MCAP file.
    file: PathBuf,
    /// The directory to write, one file for each table; or a file for maps, .kml or .gpx: the flown
    /// path, the touchdown planned at ignition, and the fence.
    #[arg(long, short, alias = "output", value_name = "PATH", value_parser = destination)]
    out: PathBuf,
    /// Answer about tables in JSON.
    #[arg(long)]
    json: bool,
}

impl Args {
    pub(crate) fn run(self) -> Result<Exit> {
        let ending = ending(&self.out);
        if ["kml", "gpx"].contains(&ending.as_str()) {
            let flown = FlownPath::open(&self.file)?;
            let text = if ending == "kml" { flown.kml() } else { flown.gpx() };
            let path = NewFile::create(&self.out)?.fill(|file| file.write_all(text.as_bytes()))?;
            answer(|output| writeln!(output, "{}: {}", path.display(), flown.contents()))?;
            return Ok(Exit::Yes);
        }
        let mut log = FlightLog::open(&self.file)?.decoding(&DECODED);
        let files = export_tables(&mut log, &self.out)?;
        let outcome = give(&files, self.json)?;
        warn_of_loss(log.name(), log.damage().map(ToString::to_string).as_deref(), None);
        Ok(outcome)
    }
}

impl Answer for ExportedFile {
    fn sentences(&self) -> Vec<String> {
        vec![format!("{}: {} rows of {} columns", self.path.display(), self.rows, self.columns)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text_of(cell: &Cell) -> String {
        let mut text = Vec::new();
        write_cell(cell, &mut text).unwrap();
        String::from_utf8(text).unwrap()
    }

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

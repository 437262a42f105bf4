//! Writes the report of the flight: runs `replay report` on the station's log.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::mpsc::{Receiver, sync_channel};

/// Reports of one log.
const REPORTS_MAX: u32 = 100;

/// A report that is being written: where it is, or why it is not.
pub(super) type Writing = Receiver<Result<String, String>>;

/// Starts to write the report beside the log, under a name that is free.
///
/// # Errors
/// There is no free name, or no thread can be started.
pub(super) fn begin(log: &Path) -> Result<Writing, String> {
    let page = free_name(log).ok_or("there are a hundred reports of this log already")?;
    let (tell, told) = sync_channel(1);
    let log = log.to_owned();
    std::thread::Builder::new()
        .name("report".to_owned())
        .spawn(move || {
            // The station may have ended.
            let _ = tell.send(write(&log, &page));
        })
        .map_err(|error| error.to_string())?;
    Ok(told)
}

/// `flight.html`, then `flight-2.html`: nothing is overwritten.
fn free_name(log: &Path) -> Option<PathBuf> {
    let stem = log.file_stem()?.to_string_lossy().into_owned();
    (1..=REPORTS_MAX)
        .map(|number| if number == 1 { format!("{stem}.html") } else { format!("{stem}-{number}.html") })
        .map(|name| log.with_file_name(name))
        .find(|page| page.symlink_metadata().is_err())
}

fn write(log: &Path, page: &Path) -> Result<String, String> {
    // The program beside this one, otherwise the one that the shell would find.
    let beside = std::env::current_exe().ok().map(|own| own.with_file_name("replay"));
    let program = beside.filter(|program| program.exists()).unwrap_or_else(|| PathBuf::from("replay"));
    let ran = Command::new(&program)
        .args(["report".as_ref(), log.as_os_str(), "--output".as_ref(), page.as_os_str()])
        .stdin(Stdio::null())
        .output()
        .map_err(|error| format!("{}: {error}", program.display()))?;
    if ran.status.success() {
        return Ok(page.display().to_string());
    }
    let words = protocol::text::printable(&ran.stderr);
    Err(words.lines().last().unwrap_or("replay report failed").to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_report_gets_a_free_name_and_a_wrong_log_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("flight.mcap");
        assert_eq!(free_name(&log), Some(folder.path().join("flight.html")));
        std::fs::write(folder.path().join("flight.html"), "").unwrap();
        assert_eq!(free_name(&log), Some(folder.path().join("flight-2.html")));
        let told = begin(&log).unwrap().recv().unwrap();
        assert!(told.is_err(), "there is no such log: {told:?}");
        assert_eq!(std::fs::read_to_string(folder.path().join("flight.html")).unwrap(), "");
    }
}

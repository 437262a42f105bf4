//! An abort on the pad outlives the vehicle's power switch: a small file exists as long as people
//! must wait.
//!
//! The file has no time. No clock of the vehicle runs while it is off, and the wall clock may be
//! set, so the wait runs again in full.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use protocol::background::Background;

use crate::wire::vehicle::Vehicle;

pub(super) struct SavedAbort {
    file: Option<PathBuf>,
    /// Whether the file exists, or will once the disk continues.
    exists: bool,
    /// Writes in a thread: a disk that stalls must not stop the vehicle.
    writer: Option<Background<(), io::Result<()>>>,
}

impl SavedAbort {
    /// Opens the file, and returns whether people still had to wait when the vehicle was switched
    /// off.
    pub(super) fn open(file: Option<PathBuf>) -> (Self, bool) {
        let exists = file.as_ref().is_some_and(|file| file.exists());
        (Self { file, exists, writer: None }, exists)
    }

    /// Has the abort of this vehicle stored, or removed when people may have approached. Returns
    /// why an earlier change failed.
    pub(super) fn save(&mut self, vehicle: &Vehicle) -> Option<String> {
        let waits = vehicle.mode().abort_to_save_s(vehicle.time_s()).is_some();
        let file = self.file.as_ref()?;
        let failed = |why| format!("the wait after an abort is not saved: {}: {why}", file.display());
        if waits != self.exists {
            self.exists = waits;
            let path = file.clone();
            let write = move || if waits { create(&path) } else { fs::remove_file(&path) };
            match &self.writer {
                Some(writer) => _ = writer.queue((), write),
                None => match Background::start("saved abort") {
                    Ok(writer) => _ = self.writer.insert(writer).queue((), write),
                    Err(why) => return Some(failed(why)),
                },
            }
        }
        self.writer.as_ref()?.outcome()?.err().map(failed)
    }
}

fn create(file: &Path) -> io::Result<()> {
    File::create(file)?.sync_all()
}

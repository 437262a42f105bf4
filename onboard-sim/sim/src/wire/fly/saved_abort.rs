//! An abort on the pad outlives the vehicle's power switch: a small file exists as long as people
//! must wait.
//!
//! The file has no time. No clock of the vehicle runs while it is off, and the wall clock may be
//! set, so the wait runs again in full.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

use crate::wire::vehicle::Vehicle;

/// Changes that wait for the disk: an abort, and its end a minute later.
const WAITING_MAX: usize = 4;

pub(super) struct SavedAbort {
    file: Option<PathBuf>,
    /// Whether the file exists, or will once the disk continues.
    exists: bool,
    /// The thread that writes: a disk that stalls must not stop the vehicle.
    changes: Option<(SyncSender<bool>, Receiver<String>)>,
}

impl SavedAbort {
    /// Opens the file, and returns whether people still had to wait when the vehicle was switched
    /// off.
    pub(super) fn open(file: Option<PathBuf>) -> (Self, bool) {
        let exists = file.as_ref().is_some_and(|file| file.exists());
        (Self { file, exists, changes: None }, exists)
    }

    /// Has the abort of this vehicle stored, or removed when people may have approached. Returns
    /// why an earlier change failed.
    pub(super) fn save(&mut self, vehicle: &Vehicle) -> Option<String> {
        let waits = vehicle.mode().abort_to_save_s(vehicle.time_s()).is_some();
        let file = self.file.as_ref()?;
        if waits != self.exists {
            let (changes, _) = self.changes.get_or_insert_with(|| write_in_a_thread(file));
            // If there is no room, the next frame tries again.
            self.exists = if changes.try_send(waits).is_ok() { waits } else { self.exists };
        }
        let failed = |why| format!("the wait after an abort is not saved: {}: {why}", file.display());
        self.changes.as_ref()?.1.try_recv().ok().map(failed)
    }
}

impl Drop for SavedAbort {
    /// Waits for the last change.
    fn drop(&mut self) {
        if let Some((changes, failures)) = self.changes.take() {
            drop(changes);
            failures.iter().for_each(drop);
        }
    }
}

fn write_in_a_thread(file: &Path) -> (SyncSender<bool>, Receiver<String>) {
    let (change, changes) = sync_channel(WAITING_MAX);
    let (failed, failures) = sync_channel(WAITING_MAX);
    let file = file.to_owned();
    let write = move || {
        for waits in changes {
            let written = if waits { create(&file) } else { fs::remove_file(&file) };
            // The receiver may no longer exist.
            let _ = written.map_err(|why| failed.try_send(why.to_string()));
        }
    };
    // Without the thread both channels are closed: nothing can be stored.
    let _ = std::thread::Builder::new().name("saved abort".to_owned()).spawn(write);
    (change, failures)
}

fn create(file: &Path) -> std::io::Result<()> {
    File::create(file)?.sync_all()
}

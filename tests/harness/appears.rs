//! Waits for a file that a program writes or removes.

use std::path::Path;
use std::time::Duration;

use crate::PATIENCE;
use crate::time::{left, now};

/// The system does not notify us when a file is made, so we poll at this interval.
const POLL_INTERVAL: Duration = Duration::from_millis(5);

/// Waits until there is something in a file.
pub fn wait_for_content(path: &Path) {
    let deadline = now() + PATIENCE;
    while !std::fs::metadata(path).is_ok_and(|file| file.len() > 0) {
        assert!(!left(deadline).is_zero(), "{} stays empty", path.display());
        std::thread::sleep(POLL_INTERVAL);
    }
}

/// Waits until a text file contains these words.
pub fn wait_for_text(path: &Path, words: &str) {
    let deadline = now() + PATIENCE;
    while !std::fs::read_to_string(path).is_ok_and(|text| text.contains(words)) {
        assert!(!left(deadline).is_zero(), "{} does not contain {words}", path.display());
        std::thread::sleep(POLL_INTERVAL);
    }
}

/// Waits until a file is removed.
pub fn wait_for_removal(path: &Path) {
    let deadline = now() + PATIENCE;
    while path.exists() {
        assert!(!left(deadline).is_zero(), "{} is not removed", path.display());
        std::thread::sleep(POLL_INTERVAL);
    }
}

//! The command that tells of an alarm to whoever is not at the screen.

use std::process::{Command, Stdio};

/// Runs it by `sh -c`, with the alarm's words in `TOUCHDOWN_ALARM`, and does not wait for it.
///
/// # Errors
/// The system starts neither the command nor the thread that waits for it.
pub fn run(command: &str, alarm: &str) -> std::io::Result<()> {
    let mut child = Command::new("sh")
        .args(["-c", command])
        .env("TOUCHDOWN_ALARM", alarm)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()?;
    std::thread::Builder::new()
        .name("alarm command".to_owned())
        // Whether it succeeded is its own affair; it must only not stay a zombie.
        .spawn(move || drop(child.wait()))
        .map(drop)
}

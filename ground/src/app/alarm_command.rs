//! Runs the command that reports an alarm to people who are not at the screen.

use std::process::{Command, Stdio};

/// Runs the command with `sh -c` and the text of the alarm in `TOUCHDOWN_ALARM`, without waiting for it.
///
/// # Errors
/// The command, or the thread that waits for it, cannot be started.
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
        // Waiting only prevents a zombie process; the result is ignored.
        .spawn(move || drop(child.wait()))
        .map(drop)
}

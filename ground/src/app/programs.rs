//! Programs that a station starts: the crew's voice, the alarm command, `replay report`.

use std::io;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};

/// Number of callouts that wait for the command; further ones are dropped, because late words
/// mislead.
const WAITING_MAX: usize = 4;

/// Passes lines to the command from a separate thread, so that a hanging command delays nothing.
#[derive(Debug)]
pub struct Voice(SyncSender<String>);

impl Voice {
    /// Starts the command: its name and arguments, with spaces between them.
    ///
    /// # Errors
    /// The command or its thread cannot be started.
    pub fn start(command: &str) -> io::Result<Self> {
        let mut words = command.split_whitespace();
        let name = words.next().ok_or_else(|| io::Error::other("the voice command is empty"))?;
        let child = Command::new(name)
            .args(words)
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()?;
        let (lines, waiting) = sync_channel(WAITING_MAX);
        // Its end is not awaited, because the thread may hang with the command.
        in_a_thread("voice", move || speak(child, &waiting))?;
        Ok(Self(lines))
    }

    /// Calls a line out, unless the command is too far behind. It never waits. Returns false once
    /// the command has ended.
    pub fn call_out(&self, line: &str) -> bool {
        !matches!(self.0.try_send(format!("{line}\n")), Err(TrySendError::Disconnected(_)))
    }
}

fn speak(mut child: Child, lines: &Receiver<String>) {
    if let Some(mut input) = child.stdin.take() {
        for line in lines {
            if input.write_all(line.as_bytes()).and_then(|()| input.flush()).is_err() {
                break;
            }
        }
    }
    // Without more input the command ends; waiting only prevents a zombie process.
    let _ = child.wait();
}

// Runs the command that reports an alarm to people away from the screen.

/// Runs the command with `sh -c` and the text of the alarm in `TOUCHDOWN_ALARM`, in a thread: the
/// disk may be slow to start it. The receiver gets the error if it cannot be started.
///
/// # Errors
/// No thread can be started.
pub(super) fn run_alarm_command(command: &str, alarm: &str) -> io::Result<Receiver<Option<io::Error>>> {
    let mut shell = Command::new("sh");
    shell.args(["-c", command]).env("TOUCHDOWN_ALARM", alarm);
    shell.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    // Waiting only prevents a zombie process; its result is ignored.
    in_a_thread("alarm command", move || shell.spawn().map(|mut child| child.wait()).err())
}

// Writes the report of the flight: runs `replay report` on the station's log.

/// Runs slow work in a separate thread; the receiver gets its result.
///
/// # Errors
/// No thread can be started.
pub(super) fn in_a_thread<T: Send + 'static>(
    name: &str,
    work: impl FnOnce() -> T + Send + 'static,
) -> io::Result<Receiver<T>> {
    let (sender, receiver) = sync_channel(1);
    // The receiver may have been dropped.
    let work = move || drop(sender.send(work()));
    std::thread::Builder::new().name(name.to_owned()).spawn(work).map(|_| receiver)
}

/// Writes the report beside the log; `replay` gives it a name that is free. Returns its path.
///
/// # Errors
/// `replay` cannot be started, or its last line.
pub(super) fn write_report(log: &Path) -> Result<String, String> {
    // The program beside this one, otherwise the one that the shell would find.
    let beside = std::env::current_exe().ok().map(|program| program.with_file_name("replay"));
    let program = beside.filter(|program| program.exists()).unwrap_or_else(|| PathBuf::from("replay"));
    let ran = Command::new(&program)
        .args(["report".as_ref(), log.as_os_str()])
        .stdin(Stdio::null())
        .output()
        .map_err(|error| format!("{}: {error}", program.display()))?;
    if ran.status.success() {
        return Ok(protocol::text::printable(ran.stdout.trim_ascii()));
    }
    let words = protocol::text::printable(&ran.stderr);
    Err(words.lines().last().unwrap_or("replay report failed").to_owned())
}

#[cfg(test)]
mod voice_tests {
    use super::*;

    #[test]
    fn every_line_reaches_the_command_as_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let spoken = folder.path().join("spoken");
        let voice = Voice::start(&format!("tee {}", spoken.display())).unwrap();
        for line in ["liftoff", "$(reboot); `x` | y"] {
            assert!(voice.call_out(line));
        }
        drop(voice);
        let written = || std::fs::read_to_string(&spoken).unwrap_or_default();
        // The command writes when it is scheduled: this bound is some ten seconds.
        for _ in 0..1_000_000 {
            if written().lines().count() == 2 {
                break;
            }
            std::thread::yield_now();
        }
        assert_eq!(written(), "liftoff\n$(reboot); `x` | y\n");
    }

    /// More than a pipe holds; a call that waited would never return.
    #[test]
    fn a_command_that_never_reads_delays_nothing() {
        let voice = Voice::start("sleep 3").unwrap();
        for _ in 0..100_000 {
            voice.call_out("150 metres");
        }
    }

    #[test]
    fn an_unknown_command_is_an_error_and_an_ended_one_is_noticed() {
        assert!(Voice::start("no-such-command-anywhere").is_err());
        assert!(Voice::start(" ").is_err());
        let voice = Voice::start("true").unwrap();
        while voice.call_out("anybody there?") {
            std::thread::yield_now();
        }
        assert!(!voice.call_out("test"));
    }
}

#[cfg(test)]
mod report_tests {
    use super::*;

    #[test]
    fn a_report_replaces_no_file_and_a_wrong_log_is_reported() {
        let folder = tempfile::tempdir().unwrap();
        let log = folder.path().join("flight.mcap");
        std::fs::write(folder.path().join("flight.html"), "").unwrap();
        let receiver = write_report(&log);
        assert!(receiver.is_err(), "there is no such log: {receiver:?}");
        assert_eq!(std::fs::read_to_string(folder.path().join("flight.html")).unwrap(), "");
    }
}

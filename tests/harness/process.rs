//! A running program whose output is read as it comes and which dies with its test.

use std::io::{BufRead as _, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, sync_channel};
use std::time::{Duration, Instant};

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

use crate::PATIENCE;

/// A running program.
pub struct Running {
    child: Child,
    lines: Receiver<String>,
    seen: Vec<String>,
}

/// A program that ended.
#[derive(Debug)]
pub struct Ended {
    /// Exit code; `None` if a signal ended it.
    pub code: Option<i32>,
    /// Everything it wrote, standard output and error as they came.
    pub output: String,
}

impl Running {
    /// Starts a program. Its standard input is closed and its output is no terminal.
    ///
    /// # Panics
    /// It cannot be started.
    pub fn start(command: &mut Command) -> Self {
        let mut child = command
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap_or_else(|error| panic!("{command:?}: {error}"));
        let (sender, lines) = sync_channel(100_000);
        let readers: [Box<dyn std::io::Read + Send>; 2] =
            [Box::new(child.stdout.take().expect("piped")), Box::new(child.stderr.take().expect("piped"))];
        for reader in readers {
            let sender = sender.clone();
            std::thread::Builder::new()
                .name("output".to_owned())
                .spawn(move || {
                    for line in BufReader::new(reader).lines().map_while(Result::ok) {
                        if sender.send(line).is_err() {
                            return;
                        }
                    }
                })
                .expect("a thread");
        }
        Self { child, lines, seen: Vec::new() }
    }

    /// Waits for a line that contains `words`, and returns it.
    ///
    /// # Panics
    /// It does not come.
    pub fn wait_for_line(&mut self, words: &str) -> String {
        let deadline = now() + PATIENCE;
        loop {
            match self.lines.recv_timeout(deadline.saturating_duration_since(now())) {
                Ok(line) => {
                    self.seen.push(line.clone());
                    if line.contains(words) {
                        return line;
                    }
                }
                Err(error) => panic!("no line with `{words}` ({error}) in:\n{}", self.seen.join("\n")),
            }
        }
    }

    /// Waits for the end.
    ///
    /// # Panics
    /// It does not end.
    pub fn wait(mut self) -> Ended {
        let deadline = now() + PATIENCE;
        // The output ends when the program does.
        loop {
            match self.lines.recv_timeout(deadline.saturating_duration_since(now())) {
                Ok(line) => self.seen.push(line),
                Err(std::sync::mpsc::RecvTimeoutError::Disconnected) => break,
                Err(std::sync::mpsc::RecvTimeoutError::Timeout) => {
                    panic!("still running after {PATIENCE:?}:\n{}", self.seen.join("\n"))
                }
            }
        }
        let status = self.child.wait().expect("it ended");
        Ended { code: status.code(), output: self.seen.join("\n") }
    }

    /// Sends a signal.
    ///
    /// # Panics
    /// It cannot be sent.
    pub fn signal(&self, signal: Signal) {
        let pid = i32::try_from(self.child.id()).expect("a process id");
        kill(Pid::from_raw(pid), signal).expect("the process runs");
    }

    /// Runs a program to its end.
    pub fn to_end(command: &mut Command) -> Ended {
        Self::start(command).wait()
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // It has usually ended; a test that fails must not leave it behind.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[expect(clippy::disallowed_methods, reason = "waiting for real processes has a real limit")]
pub(crate) fn now() -> Instant {
    Instant::now()
}

/// Time left until a deadline.
pub(crate) fn left(deadline: Instant) -> Duration {
    deadline.saturating_duration_since(now())
}

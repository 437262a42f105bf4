//! A running program. Its output is read as it comes, and the program is killed when its test ends.

use std::io::{BufRead as _, BufReader};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, sync_channel};
use std::time::Duration;

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

use crate::PATIENCE;
use crate::ports::{Bound, bound_port};
use crate::time::{left, now};

pub struct Running {
    child: Child,
    lines: Receiver<String>,
    seen: Vec<String>,
}

#[derive(Debug)]
pub struct Ended {
    /// Exit code; `None` if a signal ended it.
    pub code: Option<i32>,
    /// Everything it wrote to standard output and standard error, in the order of arrival.
    pub output: String,
}

impl Running {
    /// Starts a program with no standard input and with its output in a pipe.
    pub fn start(command: &mut Command) -> Self {
        Self::spawn(command.stdin(Stdio::null()))
    }

    /// Starts a program with its standard input and its output in pipes.
    pub fn start_with_input(command: &mut Command) -> (ChildStdin, Self) {
        let mut running = Self::spawn(command.stdin(Stdio::piped()));
        (running.child.stdin.take().expect("piped"), running)
    }

    fn spawn(command: &mut Command) -> Self {
        let mut child = command
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
    pub fn wait_for_line(&mut self, words: &str) -> String {
        let deadline = now() + PATIENCE;
        loop {
            match self.lines.recv_timeout(left(deadline)) {
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

    /// Waits for the program's end.
    pub fn wait(mut self) -> Ended {
        let deadline = now() + PATIENCE;
        // The output ends when the program ends.
        loop {
            match self.lines.recv_timeout(left(deadline)) {
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

    /// The id of the process.
    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    /// The processor time that the program has used so far.
    pub fn processor_time(&self) -> Duration {
        processor_time_of(self.child.id())
    }

    /// The program's resident memory, bytes.
    pub fn memory_bytes(&self) -> u64 {
        resident_bytes(self.child.id()).expect("it runs")
    }

    /// Waits until the program has bound a loopback port, and returns the port.
    pub fn bound_port(&mut self, bound: Bound) -> u16 {
        bound_port(&mut self.child, bound)
    }

    /// The link by which another program speaks to the UDP port that the program has bound.
    pub fn udp_link(&mut self) -> String {
        format!("udpout:127.0.0.1:{}", self.bound_port(Bound::Udp))
    }

    /// Sends a signal.
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
        // It has usually ended; a test that fails must not leave it running.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The processor time that a process has used so far.
pub(crate) fn processor_time_of(process: u32) -> Duration {
    let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).expect("it runs");
    // The fields after the name, which may contain spaces. User and system time are the 14th and
    // 15th.
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
    let clock_ticks: u64 = fields[11..13].iter().map(|field| field.parse::<u64>().unwrap_or(0)).sum();
    // Linux counts 100 clock ticks a second.
    Duration::from_millis(10 * clock_ticks)
}

/// Resident memory of a process, bytes; `None` if it is gone.
pub fn resident_bytes(process: u32) -> Option<u64> {
    Some(1024 * status_of(process, "VmRSS:")?)
}

/// A number of `/proc/PID/status`; `None` if the process is gone.
pub fn status_of(process: u32, name: &str) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix(name))?;
    line.split_whitespace().next()?.parse().ok()
}

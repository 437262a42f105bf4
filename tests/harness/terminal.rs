//! A program on a real terminal: a pseudo-terminal whose far end types, reads and answers like a terminal's window.

use std::fs::File;
use std::io::{Read as _, Write as _};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use nix::fcntl::{FcntlArg, FdFlag, fcntl};
use nix::pty::{Winsize, openpty};

use crate::process::processor_time_of;

/// Asks whether the terminal tells a held key's repeats from presses (kitty's keyboard protocol).
const QUESTION: &[u8] = b"\x1b[?u";
/// "No flag is set, but I know what you mean."
const ANSWER: &[u8] = b"\x1b[?0u";
/// What every terminal answers when asked what it is; it ends the wait for an answer to the question.
const DEVICE_ATTRIBUTES: &[u8] = b"\x1b[?62c";

/// A running program and the terminal that it runs on.
pub struct Terminal {
    child: Child,
    keyboard: File,
    written: Arc<AtomicU64>,
}

impl Terminal {
    /// Starts a program on a terminal of this size, which tells key repeats from presses or does not. `setsid`
    /// (util-linux) makes it the program's controlling terminal.
    ///
    /// # Panics
    /// The system has no pseudo-terminals, or the program cannot be started.
    pub fn start(command: &Command, (columns, rows): (u16, u16), tells_repeats: bool) -> Self {
        let size = Winsize { ws_row: rows, ws_col: columns, ws_xpixel: 0, ws_ypixel: 0 };
        let pair = openpty(Some(&size), None).expect("a pseudo-terminal");
        fcntl(&pair.master, FcntlArg::F_SETFD(FdFlag::FD_CLOEXEC)).expect("a descriptor");
        let end = || Stdio::from(pair.slave.try_clone().expect("a descriptor"));
        let mut on_terminal = Command::new("setsid");
        on_terminal.arg("--ctty").arg(command.get_program()).args(command.get_args());
        if let Some(folder) = command.get_current_dir() {
            on_terminal.current_dir(folder);
        }
        let environment = command.get_envs().filter_map(|(name, value)| Some((name, value?)));
        let child = on_terminal
            .env("TERM", "xterm-256color")
            .envs(environment)
            .stdin(end())
            .stdout(end())
            .stderr(end())
            .spawn()
            .unwrap_or_else(|error| panic!("{command:?}: {error}"));
        let written = Arc::new(AtomicU64::new(0));
        let keyboard = File::from(pair.master);
        let (window, count) = (keyboard.try_clone().expect("a descriptor"), Arc::clone(&written));
        std::thread::Builder::new()
            .name("terminal window".to_owned())
            .spawn(move || read_window(window, &count, tells_repeats))
            .expect("a thread");
        Self { child, keyboard, written }
    }

    /// Types these bytes.
    ///
    /// # Panics
    /// The terminal is gone.
    pub fn type_bytes(&mut self, bytes: &[u8]) {
        self.keyboard.write_all(bytes).expect("a terminal that takes keys");
    }

    /// Bytes that the program has written to its terminal.
    pub fn written(&self) -> u64 {
        self.written.load(Ordering::Relaxed)
    }

    /// Processor time that the program has used.
    ///
    /// # Panics
    /// The system does not say.
    pub fn processor_time(&self) -> Duration {
        processor_time_of(self.child.id())
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Reads what the program writes, until its end; answers what a terminal answers.
fn read_window(mut window: File, count: &AtomicU64, tells_repeats: bool) {
    let mut buffer = [0; 16 * 1024];
    // The question comes in one piece with the first frame at most.
    while let Ok(length @ 1..) = window.read(&mut buffer) {
        count.fetch_add(length as u64, Ordering::Relaxed);
        if buffer[..length].windows(QUESTION.len()).any(|bytes| bytes == QUESTION) {
            let known = if tells_repeats { ANSWER } else { &[] };
            if window.write_all(&[known, DEVICE_ATTRIBUTES].concat()).is_err() {
                return;
            }
        }
    }
}

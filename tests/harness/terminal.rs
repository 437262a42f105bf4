//! A program on a real terminal: a pseudo-terminal whose far end types, shows and answers like a terminal's window.

use std::fs::File;
use std::io::{Read as _, Write as _};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use nix::sys::signal::{Signal, kill};
use nix::sys::termios::{Termios, tcgetattr};
use nix::unistd::Pid;
use rustix::pty::{OpenptFlags, ioctl_tiocgptpeer, openpt, unlockpt};
use rustix::termios::{Winsize, tcsetwinsize};

use crate::PATIENCE;
use crate::ports::{Bound, bound_port};
use crate::process::{left, now, processor_time_of};
use crate::window::Window;

/// Asks whether the terminal tells a held key's repeats from presses (kitty's keyboard protocol).
const QUESTION: &[u8] = b"\x1b[?u";
/// "No flag is set, but I know what you mean."
const ANSWER: &[u8] = b"\x1b[?0u";
/// What every terminal answers when asked what it is; it ends the wait for an answer to the question.
const DEVICE_ATTRIBUTES: &[u8] = b"\x1b[?62c";

/// A crew that sees nothing come of its keys types them again.
const TYPED_AGAIN_AFTER: Duration = Duration::from_secs(3);
/// Between two keys of an unhurried hand.
const BETWEEN_KEYS: Duration = Duration::from_millis(150);

/// A running program and the terminal that it runs on.
pub struct Terminal {
    child: Child,
    keyboard: File,
    window: Arc<Shown>,
    /// The terminal's modes before the program had it.
    modes: Termios,
}

/// The window, and the news that it has changed.
struct Shown {
    window: Mutex<Window>,
    changed: Condvar,
    /// Held while nothing is read.
    reading: Mutex<()>,
}

impl Shown {
    /// A test that has failed while it looked has failed already.
    fn look(&self) -> MutexGuard<'_, Window> {
        self.window.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Terminal {
    /// Starts a program on a terminal of this size (columns, rows), which tells key repeats from presses or does not.
    /// `setsid` (util-linux) makes it the program's controlling terminal.
    ///
    /// # Panics
    /// The system has no pseudo-terminals, or the program cannot be started.
    pub fn start(command: &Command, (columns, rows): (u16, u16), tells_repeats: bool) -> Self {
        // Closed in every program but this one: a copy in another test's program would hold the terminal open.
        let flags = OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC;
        let keyboard = openpt(flags).expect("a pseudo-terminal");
        unlockpt(&keyboard).expect("a pseudo-terminal");
        let screen = ioctl_tiocgptpeer(&keyboard, flags).expect("the program's end of it");
        tcsetwinsize(&keyboard, window_size((columns, rows))).expect("a terminal with a size");
        let modes = tcgetattr(&screen).expect("a terminal's modes");
        let end = || Stdio::from(screen.try_clone().expect("a descriptor"));
        let mut on_terminal = Command::new("setsid");
        on_terminal.arg("--ctty").arg(command.get_program()).args(command.get_args());
        if let Some(folder) = command.get_current_dir() {
            on_terminal.current_dir(folder);
        }
        on_terminal.env("TERM", "xterm-256color").env("LANG", "C.UTF-8");
        for name in ["NO_COLOR", "LC_ALL", "LC_CTYPE"] {
            on_terminal.env_remove(name);
        }
        for (name, value) in command.get_envs() {
            match value {
                Some(value) => on_terminal.env(name, value),
                None => on_terminal.env_remove(name),
            };
        }
        let child = on_terminal
            .stdin(end())
            .stdout(end())
            .stderr(end())
            .spawn()
            .unwrap_or_else(|error| panic!("{command:?}: {error}"));
        let window = Arc::new(Shown {
            window: Mutex::new(Window::new((columns, rows))),
            changed: Condvar::new(),
            reading: Mutex::new(()),
        });
        let keyboard = File::from(keyboard);
        let (pipe, shown) = (keyboard.try_clone().expect("a descriptor"), Arc::clone(&window));
        std::thread::Builder::new()
            .name("terminal window".to_owned())
            .spawn(move || fill_window(pipe, &shown, tells_repeats))
            .expect("a thread");
        Self { child, keyboard, window, modes }
    }

    /// Types these bytes.
    ///
    /// # Panics
    /// The terminal is gone.
    pub fn type_bytes(&mut self, bytes: &[u8]) {
        self.keyboard.write_all(bytes).expect("a terminal that takes keys");
    }

    /// Types these keys as a hand does, one after the other.
    ///
    /// # Panics
    /// The terminal is gone.
    pub fn type_by_hand(&mut self, keys: &[u8]) {
        for (k, key) in keys.iter().enumerate() {
            if k > 0 {
                pause(BETWEEN_KEYS);
            }
            self.type_bytes(&[*key]);
        }
    }

    /// Types this by hand until these words are shown; returns how often. On a busy machine two keys may arrive together,
    /// which no hand types.
    ///
    /// # Panics
    /// Nothing comes of it.
    pub fn type_until(&mut self, keys: &[u8], words: &str) -> usize {
        for typed in 1..=20 {
            self.type_by_hand(keys);
            if self.wait_within(TYPED_AGAIN_AFTER, |window| window.shows(words).then_some(())).is_some() {
                return typed;
            }
        }
        panic!("no `{words}` on:\n{}", self.look().rows().join("\n"));
    }

    /// Holds a key down for so many repeats, on a keyboard that repeats it after half a second and every 33 ms then.
    ///
    /// # Panics
    /// The terminal is gone.
    pub fn hold(&mut self, key: u8, repeats: usize) {
        self.type_bytes(&[key]);
        pause(Duration::from_millis(500));
        for _ in 0..repeats {
            self.type_bytes(&[key]);
            pause(Duration::from_millis(33));
        }
    }

    /// Pastes a text: between marks if the program has asked for them, as terminals do.
    ///
    /// # Panics
    /// The terminal is gone.
    pub fn paste(&mut self, text: &str) {
        let typed = text.replace('\n', "\r");
        if self.look().wants_pastes_marked() {
            self.type_bytes(format!("\x1b[200~{typed}\x1b[201~").as_bytes());
        } else {
            self.type_bytes(typed.as_bytes());
        }
    }

    /// What its window shows now. The program's output waits while the answer is held.
    pub fn look(&self) -> impl std::ops::Deref<Target = Window> + '_ {
        self.window.look()
    }

    /// Waits until the window shows what is wanted; returns what `wanted` found.
    ///
    /// # Panics
    /// It never does.
    pub fn wait_until<T>(&self, what: &str, wanted: impl FnMut(&Window) -> Option<T>) -> T {
        self.wait_within(PATIENCE, wanted).unwrap_or_else(|| {
            panic!("waited in vain for {what} on:\n{}", self.look().rows().join("\n"));
        })
    }

    /// The same for a shorter time; `None` if it does not come.
    pub fn wait_within<T>(&self, limit: Duration, mut wanted: impl FnMut(&Window) -> Option<T>) -> Option<T> {
        let deadline = now() + limit;
        let mut window = self.window.look();
        loop {
            if let Some(found) = wanted(&window) {
                return Some(found);
            }
            let wait = left(deadline);
            if wait.is_zero() {
                return None;
            }
            let waited = self.window.changed.wait_timeout(window, wait);
            window = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Waits for these words in some row; returns the row.
    ///
    /// # Panics
    /// They do not come.
    pub fn wait_for(&self, words: &str) -> String {
        self.wait_until(words, |window| window.row_with(words))
    }

    /// Another size (columns, rows), as when a person pulls at the window.
    ///
    /// # Panics
    /// The terminal is gone.
    pub fn resize(&self, (columns, rows): (u16, u16)) {
        // Nothing is written between the window's new size and the program's news of it.
        let mut window = self.window.look();
        window.resize((columns, rows));
        tcsetwinsize(&self.keyboard, window_size((columns, rows))).expect("a terminal with a size");
    }

    /// Whether the terminal is as it was: its modes, its screen, its cursor, its keyboard.
    ///
    /// # Panics
    /// The terminal is gone.
    pub fn is_restored(&self) -> bool {
        let modes = tcgetattr(&self.keyboard).expect("a terminal's modes");
        let window = self.look();
        let count = |what: &[u8]| window.bytes().windows(what.len()).filter(|bytes| *bytes == what).count();
        // Key flags pushed and popped (kitty's keyboard protocol).
        modes == self.modes
            && !window.is_taken()
            && !window.wants_pastes_marked()
            && count(b"\x1b[>") == count(b"\x1b[<1u")
    }

    /// Takes nothing of what the program writes while the answer is held: a stopped scroll, a session that hangs.
    pub fn stall(&self) -> impl Sized + '_ {
        self.window.reading.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The process on it that was started first.
    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    /// Sends the program a signal.
    ///
    /// # Panics
    /// It cannot be sent.
    pub fn signal(&self, signal: Signal) {
        let pid = i32::try_from(self.child.id()).expect("a process id");
        kill(Pid::from_raw(pid), signal).expect("the process runs");
    }

    /// Waits for the program's end; returns its exit code, `None` if a signal ended it.
    ///
    /// # Panics
    /// It does not end.
    pub fn wait_for_end(&mut self) -> Option<i32> {
        // The terminal closes when its last program ends.
        self.wait_until("the end of the program", |window| window.is_closed().then_some(()));
        self.child.wait().expect("it ended").code()
    }

    /// Bytes that the program has written to its terminal.
    pub fn written(&self) -> u64 {
        self.look().bytes().len() as u64
    }

    /// The loopback port that the program has bound, given port 0; waits until it has.
    ///
    /// # Panics
    /// It does not bind one.
    pub fn bound_port(&mut self, bound: Bound) -> u16 {
        bound_port(&mut self.child, bound)
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

/// Time passes at the keyboard.
fn pause(time: Duration) {
    let end = now() + time;
    while !left(end).is_zero() {
        std::thread::park_timeout(left(end));
    }
}

fn window_size((columns, rows): (u16, u16)) -> Winsize {
    Winsize { ws_row: rows, ws_col: columns, ws_xpixel: 0, ws_ypixel: 0 }
}

/// Shows what the program writes, until its end; answers what a terminal answers.
fn fill_window(mut pipe: File, shown: &Shown, tells_repeats: bool) {
    let mut buffer = [0; 16 * 1024];
    // The question comes in one piece with the first frame at most.
    while let Ok(length @ 1..) = pipe.read(&mut buffer) {
        drop(shown.reading.lock());
        shown.look().take(&buffer[..length]);
        shown.changed.notify_all();
        if buffer[..length].windows(QUESTION.len()).any(|bytes| bytes == QUESTION) {
            let known = if tells_repeats { ANSWER } else { &[] };
            if pipe.write_all(&[known, DEVICE_ATTRIBUTES].concat()).is_err() {
                break;
            }
        }
    }
    shown.look().close();
    shown.changed.notify_all();
}

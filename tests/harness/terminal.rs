//! A program on a real terminal: a pseudo-terminal whose other end types keys, keeps the screen and
//! answers requests, as a terminal's window does.

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
use crate::process::processor_time_of;
use crate::time::{left, now};
use crate::window::Window;

/// The program asks with this whether the terminal distinguishes a held key's repeats from presses
/// (kitty's keyboard protocol).
const REPEATS_QUERY: &[u8] = b"\x1b[?u";
/// The answer of a terminal that knows the protocol and has no flag set.
const REPEATS_ANSWER: &[u8] = b"\x1b[?0u";
/// Every terminal answers a query of its type with this; it ends the wait for the answer above.
const DEVICE_ATTRIBUTES: &[u8] = b"\x1b[?62c";

/// The program asks with this whether the terminal still takes what is written, and any terminal
/// answers.
const STATUS_QUERY: &[u8] = b"\x1b[5n";
const STATUS_ANSWER: &[u8] = b"\x1b[0n";

/// A crew that sees no effect of its keys types them again after this time.
const RETYPE_AFTER: Duration = Duration::from_secs(3);
/// The program asks this when the keys of a word came faster than a hand types.
const HURRIED_QUESTION: &str = "DID YOU TYPE THIS?";
/// A person reads the question before answering it.
const READING_TIME: Duration = Duration::from_millis(800);
/// How long a bad connection holds keys back.
const STALL: Duration = Duration::from_millis(500);
/// The pause between two keys that a person types.
const KEY_INTERVAL: Duration = Duration::from_millis(150);

pub struct Terminal {
    child: Child,
    keyboard: File,
    shown: Arc<Shown>,
    /// The terminal's modes before the program started.
    modes: Termios,
}

/// The window and a notification of its changes.
struct Shown {
    window: Mutex<Window>,
    changed: Condvar,
    /// Locked while a test stops the reading.
    reading: Mutex<()>,
}

impl Shown {
    /// A test that panicked with the lock has failed already.
    fn lock(&self) -> MutexGuard<'_, Window> {
        self.window.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Terminal {
    /// Starts a program on a terminal of this size (columns, rows). `reports_repeats` is whether
    /// the terminal distinguishes key repeats from presses. `setsid` (util-linux) makes it the
    /// program's controlling terminal.
    pub fn start(command: &Command, (columns, rows): (u16, u16), reports_repeats: bool) -> Self {
        // Other programs do not inherit it: a copy in another test's program would keep the
        // terminal open.
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
        let shown = Arc::new(Shown {
            window: Mutex::new(Window::new((columns, rows))),
            changed: Condvar::new(),
            reading: Mutex::new(()),
        });
        let keyboard = File::from(keyboard);
        let (pipe, filled) = (keyboard.try_clone().expect("a descriptor"), Arc::clone(&shown));
        std::thread::Builder::new()
            .name("terminal window".to_owned())
            .spawn(move || fill_window(pipe, &filled, reports_repeats))
            .expect("a thread");
        Self { child, keyboard, shown, modes }
    }

    pub fn type_bytes(&mut self, bytes: &[u8]) {
        self.keyboard.write_all(bytes).expect("a terminal that takes keys");
    }

    /// Waits until the facts about a command contain these words, and returns the facts:
    /// ` ABORT  commanded 12.3 s x4  acknowledged waiting  observed yes`.
    pub fn wait_for_fact(&self, name: &str, words: &str) -> String {
        self.wait_until(&format!("{name}: {words}"), |window| {
            window.facts_about(name).filter(|facts| facts.contains(words))
        })
    }

    /// Types these keys with a pause between them, as a person does.
    pub fn type_by_hand(&mut self, keys: &[u8]) {
        for (k, key) in keys.iter().enumerate() {
            if k > 0 {
                pause(KEY_INTERVAL);
            }
            self.type_bytes(&[*key]);
        }
    }

    /// Types these keys with this pause before each.
    pub fn type_slowly(&mut self, keys: &[u8], interval: Duration) {
        for key in keys {
            pause(interval);
            self.type_bytes(&[*key]);
        }
    }

    /// Types these keys repeatedly until the words are shown; returns how often. On a busy machine
    /// keys may arrive together, and the program prompts whether a person typed them: this confirms
    /// it.
    pub fn type_until(&mut self, keys: &[u8], words: &str) -> usize {
        for typed in 1..=20 {
            self.type_by_hand(keys);
            self.confirm_if_prompted(words);
            if self.wait_within(RETYPE_AFTER, |window| window.shows(words).then_some(())).is_some() {
                return typed;
            }
        }
        panic!("no `{words}` on:\n{}", self.window().rows().join("\n"));
    }

    /// Arms and starts until the flight begins, and waits for that up to `countdown` each time. A
    /// busy machine may leave a link silent for a second, which holds the countdown: then it is
    /// started again, and armed, if it was not started for long. `ending` is shown once it is over.
    pub fn arm_and_start(&mut self, countdown: Duration, ending: &str) {
        if !self.window().shows(" ARMED ") {
            self.type_until(b"AARM\r", " ARMED ");
        }
        self.type_until(b"SSTART\r", "START  commanded");
        while self.wait_within(countdown, |window| window.shows(" T+").then_some(())).is_none() {
            if self.window().shows(" disarmed PAD_IDLE") {
                self.type_until(b"AARM\r", " ARMED ");
            }
            self.type_by_hand(b"SSTART\r");
            // The words of the first start are still there: only the question whether a person
            // typed is waited for.
            self.confirm_if_prompted(ending);
        }
    }

    /// Waits until these words are shown, or the question whether a person typed the keys, and
    /// confirms the prompt. Returns whether there was one.
    pub fn confirm_if_prompted(&mut self, words: &str) -> bool {
        let prompted = self.wait_within(RETYPE_AFTER, |window| {
            let prompted = window.shows(HURRIED_QUESTION);
            (prompted || window.shows(words)).then_some(prompted)
        });
        if prompted == Some(true) {
            pause(READING_TIME);
            self.type_bytes(b"\x19");
        }
        prompted == Some(true)
    }

    /// Types these keys by hand over a connection that delivers them in pieces of these lengths,
    /// each after a stall of half a second.
    pub fn type_in_bunches(&mut self, keys: &[u8], lengths: &[usize]) {
        let mut rest = keys;
        for length in lengths {
            let (bunch, later) = rest.split_at(*length);
            pause(STALL);
            self.type_bytes(bunch);
            rest = later;
        }
        assert!(rest.is_empty(), "the lengths are those of all keys");
    }

    /// Holds a key down for this many repeats. The keyboard repeats it after half a second and then
    /// every 33 ms.
    pub fn hold(&mut self, key: u8, repeats: usize) {
        self.type_bytes(&[key]);
        pause(Duration::from_millis(500));
        for _ in 0..repeats {
            self.type_bytes(&[key]);
            pause(Duration::from_millis(33));
        }
    }

    /// Pastes a text, in brackets if the program has requested them, as terminals do.
    pub fn paste(&mut self, text: &str) {
        let typed = text.replace('\n', "\r");
        if self.window().has_bracketed_paste() {
            self.type_bytes(format!("\x1b[200~{typed}\x1b[201~").as_bytes());
        } else {
            self.type_bytes(typed.as_bytes());
        }
    }

    /// The window. The program's output waits while the returned lock is held.
    pub fn window(&self) -> impl std::ops::Deref<Target = Window> + '_ {
        self.shown.lock()
    }

    /// Waits until `wanted` returns something for the window.
    pub fn wait_until<T>(&self, what: &str, wanted: impl FnMut(&Window) -> Option<T>) -> T {
        self.wait_within(PATIENCE, wanted).unwrap_or_else(|| {
            panic!("no {what} within the time limit on:\n{}", self.window().rows().join("\n"));
        })
    }

    /// The same with another time limit; `None` if the time is over.
    pub fn wait_within<T>(&self, limit: Duration, mut wanted: impl FnMut(&Window) -> Option<T>) -> Option<T> {
        let deadline = now() + limit;
        let mut window = self.shown.lock();
        loop {
            if let Some(found) = wanted(&window) {
                return Some(found);
            }
            let wait = left(deadline);
            if wait.is_zero() {
                return None;
            }
            let waited = self.shown.changed.wait_timeout(window, wait);
            window = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Waits until a row contains these words; returns the row.
    pub fn wait_for(&self, words: &str) -> String {
        self.wait_until(words, |window| window.row_with(words))
    }

    /// Changes the size of the window (columns, rows).
    pub fn resize(&self, (columns, rows): (u16, u16)) {
        // The lock makes sure that no output is processed between the change of the window and the
        // program's notification.
        let mut window = self.shown.lock();
        window.resize((columns, rows));
        tcsetwinsize(&self.keyboard, window_size((columns, rows))).expect("a terminal with a size");
    }

    /// Whether modes, screen, cursor and keyboard of the terminal are as before the program
    /// started.
    pub fn is_restored(&self) -> bool {
        let modes = tcgetattr(&self.keyboard).expect("a terminal's modes");
        let window = self.window();
        let count = |what: &[u8]| window.bytes().windows(what.len()).filter(|bytes| *bytes == what).count();
        // The program must pop as many key flags as it pushed (kitty's keyboard protocol).
        modes == self.modes
            && !window.is_held()
            && !window.has_bracketed_paste()
            && count(b"\x1b[>") == count(b"\x1b[<1u")
    }

    /// Reads no output while the returned lock is held, as after Ctrl-S or in a hanging session.
    pub fn stop_reading(&self) -> impl Sized + '_ {
        self.shown.reading.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The id of the process that was started first.
    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    pub fn signal(&self, signal: Signal) {
        let pid = i32::try_from(self.child.id()).expect("a process id");
        kill(Pid::from_raw(pid), signal).expect("the process runs");
    }

    /// Waits for the program's end; returns its exit code, `None` if a signal ended it.
    pub fn wait_for_end(&mut self) -> Option<i32> {
        // The terminal closes when the last program on it ends.
        self.wait_until("the end of the program", |window| window.is_closed().then_some(()));
        self.child.wait().expect("it ended").code()
    }

    /// How many bytes the program has written to its terminal.
    pub fn written(&self) -> u64 {
        self.window().bytes().len() as u64
    }

    /// Waits until the program has bound a loopback port, and returns the port.
    pub fn bound_port(&mut self, bound: Bound) -> u16 {
        bound_port(&mut self.child, bound)
    }

    /// The processor time that the program has used.
    pub fn processor_time(&self) -> Duration {
        processor_time_of(self.child.id())
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Waits as long as a person at the keyboard would.
fn pause(time: Duration) {
    let end = now() + time;
    while !left(end).is_zero() {
        std::thread::park_timeout(left(end));
    }
}

fn window_size((columns, rows): (u16, u16)) -> Winsize {
    Winsize { ws_row: rows, ws_col: columns, ws_xpixel: 0, ws_ypixel: 0 }
}

/// Processes the program's output until its end, and answers as a terminal does.
fn fill_window(mut pipe: File, shown: &Shown, reports_repeats: bool) {
    let mut buffer = [0; 16 * 1024];
    // A question arrives in one piece, at most together with a frame.
    while let Ok(length @ 1..) = pipe.read(&mut buffer) {
        drop(shown.reading.lock());
        shown.lock().take(&buffer[..length]);
        shown.changed.notify_all();
        let queries =
            |query: &[u8]| buffer[..length].windows(query.len()).filter(|bytes| *bytes == query).count();
        let mut answers = STATUS_ANSWER.repeat(queries(STATUS_QUERY));
        if queries(REPEATS_QUERY) > 0 {
            answers.extend(if reports_repeats { REPEATS_ANSWER } else { &[] });
            answers.extend(DEVICE_ATTRIBUTES);
        }
        if pipe.write_all(&answers).is_err() {
            break;
        }
    }
    shown.lock().close();
    shown.changed.notify_all();
}

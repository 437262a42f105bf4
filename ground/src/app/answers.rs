//! Queries whether the terminal still shows what is written to it, and removes its answers from the
//! typed input. Written bytes may wait for ever: in a terminal that hangs, or for a dead
//! connection. Only an answer to a query over the same line shows that a person may be reading.
//! crossterm silently drops such an answer. So this module reads the terminal in a thread, and
//! passes everything else to crossterm over a pseudo-terminal in place of standard input.
//!
//! tmux answers by itself, also while it shows the past of the pane (copy mode), which takes the
//! keys, or another window. So a second thread queries tmux whether it shows this pane.

use std::ffi::OsStr;
use std::fs::File;
use std::io;
use std::io::{Read as _, Write as _};
use std::os::fd::{AsFd as _, OwnedFd};
use std::os::unix::fs::OpenOptionsExt as _;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, isatty, tcgetattr, tcsetattr};

use super::clock::since_boot;
use crate::model::Silence;

/// Device status report (ECMA-48, 8.3.35), which every terminal answers.
pub(super) const QUESTION: &[u8] = b"\x1b[5n";
const ANSWER: &[u8] = b"\x1b[0n";
/// Asks whether the terminal can distinguish a held key's repeats from presses (kitty's keyboard
/// protocol, "Detection of support for this protocol"). crossterm drops the answer.
pub(super) const FLAGS_QUESTION: &[u8] = b"\x1b[?u";
/// How long the rest of an answer may take; a lone Escape waits for as long.
const REST_WITHIN: Timespec = Timespec { tv_sec: 0, tv_nsec: 50_000_000 };
/// How long the last answer may take when the screen ends: later it would be typed into the shell.
const LAST_WITHIN: Duration = Duration::from_millis(500);
const LOOK_AGAIN_AFTER: Duration = Duration::from_millis(2);

/// Interval of the queries to tmux: with the silence after which a screen does not count, less than
/// a second.
const QUERY_TMUX_EVERY: Duration = Duration::from_millis(100);
/// Modes of the pane, clients of its session, whether its window is shown, whether another pane
/// hides it.
const TMUX_FORMAT: &str =
    "#{pane_in_mode} #{session_attached} #{window_active} #{&&:#{window_zoomed_flag},#{!=:#{pane_active},1}}";

/// When the last answer arrived that was not taken yet, and the number of open queries. There is
/// only one terminal.
static ANSWERED: Mutex<Option<Duration>> = Mutex::new(None);
static OPEN_QUESTIONS: AtomicI32 = AtomicI32::new(0);
/// The terminal has answered [`FLAGS_QUESTION`].
static REPORTS_FLAGS: AtomicBool = AtomicBool::new(false);
/// Why tmux does not show the screen.
static HIDDEN: Mutex<Option<Silence>> = Mutex::new(None);

/// The original standard input, and our end of the pseudo-terminal that replaces it.
static REPLACED: Mutex<Option<(OwnedFd, File)>> = Mutex::new(None);

/// Counts a query to the terminal.
pub(super) fn note_question() {
    OPEN_QUESTIONS.fetch_add(1, Ordering::Relaxed);
}

/// How long ago the terminal answered, if it has since the last call.
pub(super) fn answered_ago() -> Option<Duration> {
    let at = ANSWERED.lock().unwrap_or_else(PoisonError::into_inner).take()?;
    Some(since_boot().saturating_sub(at))
}

/// Whether the terminal has answered [`FLAGS_QUESTION`].
pub(super) fn reports_flags() -> bool {
    REPORTS_FLAGS.load(Ordering::Relaxed)
}

/// Why tmux does not show this screen, or takes its keys.
pub(super) fn hidden() -> Option<Silence> {
    *HIDDEN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Begins to stand between the terminal, which is in raw mode already, and crossterm, which has
/// read nothing yet.
///
/// # Errors
/// The system gives no pseudo-terminal.
pub(super) fn begin() -> io::Result<()> {
    let stdin = io::stdin().as_fd().try_clone_to_owned()?;
    let typed = if isatty(&stdin) { File::from(stdin.try_clone()?) } else { File::open("/dev/tty")? };
    let ours = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY)?;
    rustix::io::fcntl_setfd(&ours, rustix::io::FdFlags::CLOEXEC)?;
    grantpt(&ours)?;
    unlockpt(&ours)?;
    let no_controlling_terminal = i32::try_from(OpenptFlags::NOCTTY.bits()).unwrap_or(0);
    let mut open = File::options();
    open.read(true).write(true).custom_flags(no_controlling_terminal);
    let crossterms = open.open(ptsname(&ours, Vec::new())?.to_string_lossy().as_ref())?;
    let mut modes = tcgetattr(&crossterms)?;
    modes.make_raw();
    tcsetattr(&crossterms, OptionalActions::Now, &modes)?;
    rustix::stdio::dup2_stdin(&crossterms)?;
    let ours = File::from(ours);
    *replaced() = Some((stdin, ours.try_clone()?));
    if let (Some(_), Some(pane)) = (std::env::var_os("TMUX"), std::env::var_os("TMUX_PANE")) {
        let query = move || query_tmux(&pane);
        std::thread::Builder::new().name("tmux".to_owned()).spawn(query)?;
    }
    let pass = move || pass_on(&typed, &ours);
    std::thread::Builder::new().name("keyboard".to_owned()).spawn(pass).map(drop)
}

/// Gives standard input back. The last answers are waited for, or they would be typed into the
/// shell.
pub(super) fn end() {
    for _ in 0..LAST_WITHIN.as_millis() / LOOK_AGAIN_AFTER.as_millis() {
        if OPEN_QUESTIONS.load(Ordering::Relaxed) <= 0 {
            break;
        }
        std::thread::sleep(LOOK_AGAIN_AFTER);
    }
    // The pseudo-terminal's other end is closed by this: crossterm sees no end of it, at which it
    // would loop.
    if let Some((stdin, _ours)) = replaced().take() {
        // Fails only if there is no standard input, and then it has no reader.
        let _ = rustix::stdio::dup2_stdin(&stdin);
    }
}

fn replaced() -> std::sync::MutexGuard<'static, Option<(OwnedFd, File)>> {
    REPLACED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Passes on what is typed, without the answers, until the screen or the terminal ends.
fn pass_on(mut typed: &File, mut ours: &File) {
    let mut buffer = [0; 1024];
    let mut sieve = Sieve::default();
    while replaced().is_some() {
        let rest = match poll(&mut [PollFd::new(typed, PollFlags::IN)], Some(&REST_WITHIN)) {
            Ok(0) => sieve.give_up(),
            _ => match typed.read(&mut buffer) {
                Ok(count @ 1..) => sieve.pass(&buffer[..count]),
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                _ => return,
            },
        };
        if ours.write_all(&rest).is_err() {
            return;
        }
    }
}

/// Queries tmux until the screen ends. Without an answer the screen counts as shown.
fn query_tmux(pane: &OsStr) {
    while replaced().is_some() {
        let mut tmux = Command::new("tmux");
        tmux.args(["display-message", "-p", "-t"]).arg(pane).arg(TMUX_FORMAT).stdin(Stdio::null());
        let hidden = tmux.output().ok().and_then(|output| hidden_by_tmux(&output.stdout));
        *HIDDEN.lock().unwrap_or_else(PoisonError::into_inner) = hidden;
        std::thread::sleep(QUERY_TMUX_EVERY);
    }
}

/// Why the pane is not shown or takes no keys, by an answer in [`TMUX_FORMAT`].
fn hidden_by_tmux(answer: &[u8]) -> Option<Silence> {
    let words = str::from_utf8(answer).unwrap_or_default().split_whitespace();
    let numbers: Vec<u32> = words.filter_map(|word| word.parse().ok()).collect();
    match numbers[..] {
        [_, 0, _, _] => Some(Silence::TmuxWithoutClient),
        [(1..), _, _, _] => Some(Silence::TmuxCopyMode),
        [_, _, 0, _] | [_, _, _, (1..)] => Some(Silence::TmuxElsewhere),
        _ => None,
    }
}

/// Takes the answers out of a stream of bytes.
#[derive(Debug, Default)]
struct Sieve {
    /// How many bytes of an answer were the last ones.
    begun: usize,
    /// The same of the answer to [`FLAGS_QUESTION`], which begins as that and then has a number.
    flags: usize,
}

impl Sieve {
    /// The bytes without answers, and without the beginning of one at their end.
    fn pass(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut rest = Vec::with_capacity(bytes.len());
        for byte in bytes {
            self.flags = match (self.flags, byte) {
                (_, 0x1b) => 1,
                (1, b'[') => 2,
                (2, b'?') | (3, b'0'..=b'9') => 3,
                (3, b'u') => {
                    REPORTS_FLAGS.store(true, Ordering::Relaxed);
                    0
                }
                _ => 0,
            };
            if ANSWER[self.begun] != *byte {
                rest.extend(self.give_up());
            }
            if ANSWER[self.begun] == *byte {
                self.begun += 1;
            } else {
                rest.push(*byte);
            }
            if self.begun == ANSWER.len() {
                self.begun = 0;
                *ANSWERED.lock().unwrap_or_else(PoisonError::into_inner) = Some(since_boot());
                OPEN_QUESTIONS.fetch_sub(1, Ordering::Relaxed);
            }
        }
        rest
    }

    /// What seemed to be the beginning of an answer.
    fn give_up(&mut self) -> Vec<u8> {
        ANSWER[..std::mem::take(&mut self.begun)].to_vec()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pane_is_hidden_in_copy_mode_without_a_client_in_another_window_and_behind_a_zoomed_pane() {
        for shown in [&b"0 1 1 0\n"[..], b"0 2 1 0\n", b"", b"no server running", b"0 1\n"] {
            assert_eq!(hidden_by_tmux(shown), None, "{shown:?}");
        }
        for (hidden, why) in [
            (&b"1 1 1 0\n"[..], Silence::TmuxCopyMode),
            (b"2 1 1 0\n", Silence::TmuxCopyMode),
            (b"0 0 1 0\n", Silence::TmuxWithoutClient),
            (b"0 1 0 0\n", Silence::TmuxElsewhere),
            (b"0 1 1 1\n", Silence::TmuxElsewhere),
        ] {
            assert_eq!(hidden_by_tmux(hidden), Some(why), "{hidden:?}");
        }
    }

    /// However the bytes arrive, every key comes through and no answer does.
    #[test]
    fn answers_are_taken_out_of_what_is_typed() {
        let typed = b"a\x1b[0n\x1b\x1b[A\x1b[0nq\x1b[0~\x1b\x1b[0n\x1b[0\x1b[0n";
        for length in 1..=typed.len() {
            let mut sieve = Sieve::default();
            let mut keys: Vec<u8> = typed.chunks(length).flat_map(|part| sieve.pass(part)).collect();
            keys.extend(sieve.give_up());
            assert_eq!(keys, b"a\x1b\x1b[Aq\x1b[0~\x1b\x1b[0", "{length}");
        }
        assert!(answered_ago().is_some() && answered_ago().is_none());
    }

    /// crossterm drops it; a key that looks like its beginning is none.
    #[test]
    fn the_answer_about_key_repeats_is_noticed_in_any_pieces() {
        let mut sieve = Sieve::default();
        for (typed, is_noticed) in [(&b"\x1b[?1cu\x1b[u"[..], false), (b"\x1b[?0u", true)] {
            let passed: Vec<u8> = typed.chunks(2).flat_map(|piece| sieve.pass(piece)).collect();
            assert_eq!((&passed[..], reports_flags()), (typed, is_noticed));
        }
    }
}

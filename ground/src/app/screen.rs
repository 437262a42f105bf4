//! The full screen: the terminal's state, its keys, and when it is drawn.

use std::io;
use std::mem::ManuallyDrop;
use std::os::fd::OwnedFd;
use std::pin::Pin;
use std::sync::atomic::{AtomicBool, Ordering};
use std::task::{Context, Poll};
use std::time::Duration;

use anyhow::Context as _;
use crossterm::cursor::Show;
use crossterm::event::{
    DisableBracketedPaste, EnableBracketedPaste, Event, EventStream, KeyboardEnhancementFlags,
    PopKeyboardEnhancementFlags, PushKeyboardEnhancementFlags,
};
use crossterm::terminal::{
    EnterAlternateScreen, LeaveAlternateScreen, disable_raw_mode, enable_raw_mode,
    supports_keyboard_enhancement,
};
use crossterm::{execute, queue};
use futures_util::Stream as _;
use ratatui::Terminal;
use ratatui::backend::CrosstermBackend;
use rustix::termios::QueueSelector;

use super::pace::Pace;
use super::paper::{self, Page, Paper};
use crate::config::{Characters, Colour, Config};
use crate::key::Key;
use crate::model::Model;
use crate::update::Msg;
use crate::view::theme::Theme;
use crate::view::view;

/// Keys told at once, at most: a paste must not hold up link and clock. What is beyond comes together again.
const TOGETHER_MAX: usize = 1_024;
/// A paste is over when nothing has come for this long; a slow line may bring its pieces some way apart.
const QUIET_FOR: Duration = Duration::from_millis(50);
/// Nobody waits longer for a paste to end.
const QUIET_WITHIN: Duration = Duration::from_secs(2);

/// Why a screen ends without a signal.
pub const GONE: &str = "the terminal is gone";

/// Given back once, by whichever way the screen ends: leaving the alternate screen a second time puts the cursor back to
/// where it was, and whatever is printed next over a panic's message.
static TAKEN: AtomicBool = AtomicBool::new(false);
/// What was pushed must be popped.
static KEYBOARD_ENHANCED: AtomicBool = AtomicBool::new(false);

/// The terminal in full-screen mode; restored when it goes out of scope or a panic passes.
pub struct Screen {
    /// Never dropped: its own clean-up prints when the terminal is gone, and printing to a terminal that is
    /// gone panics. [`restore`] does what it would do.
    terminal: ManuallyDrop<Terminal<CrosstermBackend<Page>>>,
    paper: Paper,
    events: EventStream,
    theme: Theme,
    bell: bool,
    pace: Pace,
    /// The next frame is written whole.
    whole: bool,
    /// Came behind keys that are told first.
    waiting: Option<Msg>,
    input_ended: bool,
}

impl Screen {
    /// Takes the terminal.
    ///
    /// # Errors
    /// It is none, or refuses.
    pub fn open(config: &Config) -> anyhow::Result<Self> {
        restore_before_panic_message();
        let (terminal, paper) =
            take_terminal().inspect_err(|_| restore()).context("preparing the terminal")?;
        Ok(Self {
            terminal: ManuallyDrop::new(terminal),
            paper,
            events: EventStream::new(),
            theme: theme(config),
            bell: config.bell.unwrap_or(true),
            pace: Pace::default(),
            whole: false,
            waiting: None,
            input_ended: false,
        })
    }

    /// Something to see has changed, and a person waits for it.
    pub fn mark_changed(&mut self) {
        self.pace.mark_changed();
    }

    /// A message was taken into the model: how soon it must be seen.
    pub fn mark_message(&mut self, msg: &Msg, model: &Model) {
        self.pace.mark_message(msg, model);
    }

    /// When the next frame is due.
    pub fn redraw_at(&self) -> Duration {
        self.pace.redraw_at()
    }

    /// Draws if a frame is due. Ages count to `model_now`, the same moment by the model's clock.
    ///
    /// # Errors
    /// The terminal cannot be written.
    pub fn show(&mut self, model: &Model, now: Duration, model_now: Duration) -> io::Result<()> {
        self.pace.look(model);
        if now < self.redraw_at() {
            return Ok(());
        }
        if self.paper.is_busy()? {
            self.pace.put_off(now);
            return Ok(());
        }
        if std::mem::take(&mut self.whole) {
            // Not `Terminal::clear`: it asks the terminal where its cursor is and waits two seconds, link and all, for
            // an answer that our own reader of keys takes away.
            let size = self.terminal.size()?;
            self.terminal.resize(size.into())?;
        }
        let drawn = self.terminal.draw(|frame| view(model, self.theme, model_now, frame))?;
        let cells = drawn.area.area();
        self.pace.drew(model, cells, self.paper.waiting(), now);
        self.paper.send();
        Ok(())
    }

    /// Forgets what the terminal shows, so that the next frame is written whole.
    pub fn clear(&mut self) {
        self.whole = true;
        self.mark_changed();
    }

    /// Whether the terminal tells a held key's repeats from presses.
    pub fn tells_repeats(&self) -> bool {
        KEYBOARD_ENHANCED.load(Ordering::Relaxed)
    }

    /// Rings the terminal's bell.
    pub fn bell(&mut self) {
        if self.bell {
            // A page takes everything.
            let _ = io::Write::write_all(self.terminal.backend_mut(), b"\x07");
            self.paper.send();
        }
    }

    /// The next thing done at the terminal: a key, or all the keys that came together.
    pub async fn input(&mut self) -> Msg {
        std::future::poll_fn(|context| self.poll_input(context)).await
    }

    fn poll_input(&mut self, context: &mut Context<'_>) -> Poll<Msg> {
        if let Some(msg) = self.waiting.take() {
            return Poll::Ready(msg);
        }
        let mut keys = Vec::new();
        let other = loop {
            if self.input_ended || keys.len() >= TOGETHER_MAX {
                break None;
            }
            match Pin::new(&mut self.events).poll_next(context) {
                Poll::Pending => break None,
                Poll::Ready(Some(Ok(Event::Key(event)))) => keys.extend(Key::from_event(&event)),
                Poll::Ready(Some(Ok(Event::Paste(_)))) => break Some(Msg::Pasted),
                // Also when it is back at its old size before anything was drawn: the terminal has cut what it showed.
                Poll::Ready(Some(Ok(Event::Resize(..)))) => self.clear(),
                Poll::Ready(Some(Ok(_))) => {}
                Poll::Ready(Some(Err(_)) | None) => {
                    self.input_ended = true;
                    break Some(Msg::Terminate(GONE));
                }
            }
        };
        // Keys first, as they came; what else came is told by the next call.
        let first = match &keys[..] {
            [] => return other.map_or(Poll::Pending, Poll::Ready),
            [key] => Msg::Key(*key),
            _ => Msg::Keys(keys),
        };
        self.waiting = other;
        Poll::Ready(first)
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        restore();
    }
}

/// What the settings say; else the environment.
fn theme(config: &Config) -> Theme {
    let found = Theme::of_environment(|name| std::env::var(name).ok());
    let colour = match config.colour {
        Colour::Auto => found.colour,
        Colour::Always => true,
        Colour::Never => false,
    };
    let ascii = match config.characters {
        Characters::Auto => found.ascii,
        Characters::Unicode => false,
        Characters::Ascii => true,
    };
    Theme { colour, ascii }
}

fn take_terminal() -> io::Result<(Terminal<CrosstermBackend<Page>>, Paper)> {
    TAKEN.store(true, Ordering::Relaxed);
    enable_raw_mode()?;
    execute!(io::stdout(), EnterAlternateScreen, EnableBracketedPaste)?;
    tell_repeats()?;
    let (paper, page) = Paper::new()?;
    Ok((Terminal::new(CrosstermBackend::new(page))?, paper))
}

/// Asks the terminal to tell a held key's repeats from presses, where it can. Where it cannot say whether
/// it can, it cannot.
fn tell_repeats() -> io::Result<()> {
    if supports_keyboard_enhancement().unwrap_or(false) {
        // Event types are told in escape codes only; without the other flag Ctrl-X would stay one byte.
        let flags = KeyboardEnhancementFlags::DISAMBIGUATE_ESCAPE_CODES
            | KeyboardEnhancementFlags::REPORT_EVENT_TYPES;
        KEYBOARD_ENHANCED.store(true, Ordering::Relaxed);
        execute!(io::stdout(), PushKeyboardEnhancementFlags(flags))?;
    }
    Ok(())
}

/// Gives the terminal back. It may be gone (a dropped session): then there is nothing to restore, and
/// nobody to tell; printing about it would panic and cost the log its end.
fn restore() {
    if !TAKEN.swap(false, Ordering::Relaxed) {
        return;
    }
    // Still in raw mode: line by line, as a shell reads, the rest of a paste would not be there to be taken away.
    drain_input();
    let _ = disable_raw_mode();
    // Half a frame before it would swallow what is said here; a terminal that takes nothing is not talked to.
    if !paper::wait_for_end() {
        return;
    }
    let mut out = io::stdout();
    // Before the alternate screen is left: each screen has its own.
    if KEYBOARD_ENHANCED.swap(false, Ordering::Relaxed) {
        let _ = queue!(out, PopKeyboardEnhancementFlags);
    }
    let _ = queue!(out, DisableBracketedPaste, LeaveAlternateScreen, Show);
    let _ = io::Write::flush(&mut out);
}

/// Throws away what was typed and not taken: the rest of a paste must not run on into the shell.
fn drain_input() {
    let stdin = io::stdin();
    if !rustix::termios::isatty(&stdin) {
        return;
    }
    // A terminal that is gone has nothing more to say.
    let _ = rustix::termios::tcflush(&stdin, QueueSelector::IFlush);
    for _ in 0..QUIET_WITHIN.as_millis() / QUIET_FOR.as_millis() {
        std::thread::sleep(QUIET_FOR);
        if !matches!(rustix::io::ioctl_fionread(&stdin), Ok(1..)) {
            return;
        }
        let _ = rustix::termios::tcflush(&stdin, QueueSelector::IFlush);
    }
}

/// Puts a pipe that nothing comes out of where a terminal was that is gone; it stays one while the answer is held.
///
/// The thread that reads the terminal's events cannot be told to stop there: a terminal that is gone answers every
/// read at once with nothing, and it would read for ever, on half a core.
pub fn quiet_input() -> Option<OwnedFd> {
    let (silent, held) = rustix::pipe::pipe().ok()?;
    rustix::stdio::dup2_stdin(&silent).ok()?;
    Some(held)
}

/// A panic's message belongs on the restored terminal, not on a screen that vanishes with it.
fn restore_before_panic_message() {
    let print_message = std::panic::take_hook();
    let drawing = std::thread::current().id();
    std::panic::set_hook(Box::new(move |panic| {
        // A panic of the simulator or the recorder does not end the screen.
        if std::thread::current().id() == drawing {
            restore();
        }
        print_message(panic);
    }));
}

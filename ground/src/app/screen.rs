//! The full screen: prepares and restores the terminal, reads its keys, and writes the frames.

use std::collections::VecDeque;
use std::io;
use std::io::Write;
use std::mem::ManuallyDrop;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll};
use std::time::Duration;

use anyhow::Context as _;
use crossterm::cursor::Show;
use crossterm::event::{
    self, DisableBracketedPaste, EnableBracketedPaste, Event, KeyboardEnhancementFlags,
    PopKeyboardEnhancementFlags, PushKeyboardEnhancementFlags,
};
use crossterm::terminal::{
    Clear, ClearType, EnterAlternateScreen, LeaveAlternateScreen, disable_raw_mode, enable_raw_mode,
};
use crossterm::{execute, queue};
use ratatui::Terminal;
use ratatui::backend::CrosstermBackend;
use rustix::termios::QueueSelector;
use tokio::sync::mpsc;

use super::answers;
use super::pace::Pace;
use super::programs::{Voice, in_a_thread};
use super::terminal::DiffBackend;
use crate::cli::Characters;
use crate::config::Config;
use crate::key::Key;
use crate::model::{Model, Silence};
use crate::update::Msg;
use crate::view::Theme;
use crate::view::theme::Depth;

/// The most keys passed on at once, so that a paste does not delay link and clock.
const TOGETHER_MAX: usize = 1_024;
/// A paste has ended when nothing has arrived for this long; on a slow line its parts arrive apart.
const QUIET_FOR: Duration = Duration::from_millis(50);
/// Interval at which the thread that reads the events checks whether the screen has ended.
const LOOK_AGAIN_AFTER: Duration = Duration::from_millis(100);
/// The longest wait for the end of a paste.
const QUIET_WITHIN: Duration = Duration::from_secs(2);

/// The smallest screen that counts, columns and rows: it has room for an alarm and the keys.
const LEAST: (u16, u16) = (20, 5);

/// Interval of the queries to the terminal.
const QUERY_EVERY: Duration = Duration::from_millis(250);

/// The reason when a screen ends without a signal.
pub const TERMINAL_LOST: &str = "the terminal is gone";

/// Whether the terminal is in full-screen mode. It is restored only once: leaving the alternate
/// screen twice would move the cursor, and the next output would overwrite a panic message.
static TAKEN: AtomicBool = AtomicBool::new(false);
/// Whether the keyboard flags were pushed and must be popped.
static KEYBOARD_ENHANCED: AtomicBool = AtomicBool::new(false);

/// The terminal in full-screen mode; restored when it goes out of scope, also during a panic.
pub struct Screen {
    /// Never dropped: its clean-up would print to a terminal that may be lost, and panic.
    /// [`restore`] does the clean-up.
    terminal: ManuallyDrop<Terminal<DiffBackend<FrameBuffer>>>,
    writer: TerminalWriter,
    events: mpsc::Receiver<VecDeque<Event>>,
    /// Events that arrived together and were not passed on yet.
    arrived: VecDeque<Event>,
    pub theme: Theme,
    bell: bool,
    voice: Option<Voice>,
    pub pace: Pace,
    /// Whether the next frame is written completely.
    redraws_all: bool,
    input_ended: bool,
    query_at: Duration,
    /// The terminal has answered, and [`Self::answers`] has not reported it yet.
    has_answered: bool,
}

impl Screen {
    /// Puts the terminal into full-screen mode.
    ///
    /// # Errors
    /// Standard output is no terminal, or it cannot be prepared.
    pub fn open(config: &Config) -> anyhow::Result<Self> {
        let voice = config.voice.as_deref().map(Voice::start).transpose();
        let voice =
            voice.with_context(|| format!("voice: {}", config.voice.as_deref().unwrap_or_default()))?;
        restore_before_panic_message();
        let taken = take_terminal().and_then(|taken| Ok((taken, read_events()?)));
        let taken = taken.inspect_err(|_| restore()).context("preparing the terminal");
        let ((terminal, writer), events) = taken?;
        Ok(Self {
            terminal: ManuallyDrop::new(terminal),
            writer,
            events,
            arrived: VecDeque::new(),
            theme: theme(config),
            bell: config.bell.unwrap_or(true),
            voice,
            pace: Pace::new(is_answered_by_another()),
            redraws_all: false,
            input_ended: false,
            query_at: Duration::ZERO,
            has_answered: false,
        })
    }

    /// Draws if a frame is due. `model_now` is the same moment on the model's clock.
    ///
    /// # Errors
    /// The terminal cannot be written.
    pub fn show(&mut self, model: &Model, now: Duration, model_now: Duration) -> io::Result<()> {
        self.take_answer(now);
        self.pace.check_urgent(model);
        if now < self.pace.redraw_at() {
            return Ok(());
        }
        if self.writer.is_busy()? || self.pace.waits_for_terminal(now) {
            self.pace.postpone(now);
            return Ok(());
        }
        if std::mem::take(&mut self.redraws_all) {
            // `Terminal::clear` is not used: it queries the cursor position and blocks for two
            // seconds, because our key reader takes the answer.
            let size = self.terminal.size()?;
            self.terminal.resize(size.into())?;
        }
        let drawn = self.pace.draw(&mut self.terminal, model, self.theme, (now, model_now))?;
        let cells = drawn.area.area();
        self.pace.drew(model, cells, self.writer.waiting(), now);
        self.query(now);
        Ok(())
    }

    /// Drops the stored screen content, so that the next frame is written completely.
    pub fn clear(&mut self) {
        self.redraws_all = true;
        self.pace.mark_changed();
    }

    /// Calls a text out. Returns whether the voice command has ended.
    pub fn call_out(&mut self, text: &str) -> bool {
        self.voice.take_if(|voice| !voice.call_out(text)).is_some()
    }

    /// Whether the terminal distinguishes a held key's repeats from presses. It is asked to as soon
    /// as it has answered that it can: some terminals answer nothing, and none is waited for.
    pub fn reports_repeats(&mut self) -> bool {
        if answers::reports_flags() && !KEYBOARD_ENHANCED.swap(true, Ordering::Relaxed) {
            // Event types need escape codes; without the first flag Ctrl-X would stay one byte.
            let flags = KeyboardEnhancementFlags::DISAMBIGUATE_ESCAPE_CODES
                | KeyboardEnhancementFlags::REPORT_EVENT_TYPES;
            // Writing to a buffer in memory cannot fail.
            let _ = queue!(self.terminal.backend_mut().terminal, PushKeyboardEnhancementFlags(flags));
            self.writer.send();
        }
        KEYBOARD_ENHANCED.load(Ordering::Relaxed)
    }

    /// Whether the terminal has answered since the last call, and shows this screen; else why a
    /// person cannot see it. Queries it again if that is due, and if it has accepted the last
    /// frame.
    ///
    /// # Errors
    /// The screen does not count.
    pub fn answers(&mut self, now: Duration) -> Result<(), Silence> {
        if now >= self.query_at && matches!(self.writer.is_busy(), Ok(false)) {
            self.query(now);
        }
        self.take_answer(now);
        let fits = self.terminal.size().is_ok_and(|size| size.width >= LEAST.0 && size.height >= LEAST.1);
        match answers::hidden() {
            _ if !std::mem::take(&mut self.has_answered) => Err(Silence::NoAnswer),
            Some(why) => Err(why),
            None if fits => Ok(()),
            None => Err(Silence::TooSmall),
        }
    }

    fn take_answer(&mut self, now: Duration) {
        if let Some(ago) = answers::answered_ago() {
            self.pace.answered(now.saturating_sub(ago));
            self.has_answered = true;
        }
        self.pace.check_answer(now);
    }

    /// Sends the drawn frame, and behind it a query whether the terminal has accepted it.
    fn query(&mut self, now: Duration) {
        if self.pace.begins_query(now) {
            self.query_at = now + QUERY_EVERY;
            // Writing to a buffer in memory cannot fail.
            let _ = io::Write::write_all(&mut self.terminal.backend_mut().terminal, answers::QUESTION);
            answers::note_question();
        }
        self.writer.send();
    }

    /// Rings the terminal's bell.
    pub fn bell(&mut self) {
        if self.bell {
            // Writing to a buffer in memory cannot fail.
            let _ = io::Write::write_all(&mut self.terminal.backend_mut().terminal, b"\x07");
            self.writer.send();
        }
    }

    /// The next input: a key, or all keys that arrived together.
    pub async fn input(&mut self) -> Msg {
        std::future::poll_fn(|context| self.poll_input(context)).await
    }

    fn poll_input(&mut self, context: &mut Context<'_>) -> Poll<Msg> {
        let mut keys = Vec::new();
        while keys.len() < TOGETHER_MAX {
            if self.arrived.is_empty() && !self.input_ended {
                match self.events.poll_recv(context) {
                    Poll::Ready(Some(events)) => self.arrived = events,
                    // Keys first, in their order; any other input is returned by the next call.
                    Poll::Ready(None) if keys.is_empty() => {
                        self.input_ended = true;
                        return Poll::Ready(Msg::Terminate(TERMINAL_LOST));
                    }
                    Poll::Ready(None) | Poll::Pending => {}
                }
            }
            let may_pass = |event: &mut Event| keys.is_empty() || !matches!(event, Event::Paste(_));
            match self.arrived.pop_front_if(may_pass) {
                None => break,
                Some(Event::Key(event)) => keys.extend(Key::from_event(&event)),
                Some(Event::Paste(_)) => return Poll::Ready(Msg::Pasted),
                // Also needed if the size returns to the old one before the next frame: the
                // terminal has cut its content.
                Some(Event::Resize(..)) => self.clear(),
                Some(Event::FocusGained | Event::FocusLost | Event::Mouse(_)) => {}
            }
        }
        if keys.is_empty() { Poll::Pending } else { Poll::Ready(Msg::Keys(keys)) }
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        restore();
    }
}

/// Reads the terminal's events in a thread until the screen or the terminal ends. Events that
/// arrived together are passed on together. crossterm's own stream would try its reader's lock at
/// each turn of the main loop, while a waiting thread holds it: each try yields the processor
/// several times, which takes long on a busy machine.
fn read_events() -> io::Result<mpsc::Receiver<VecDeque<Event>>> {
    let (sender, events) = mpsc::channel(1);
    in_a_thread("events", move || -> io::Result<()> {
        while !sender.is_closed() {
            let mut arrived = VecDeque::new();
            let mut patience = LOOK_AGAIN_AFTER;
            while arrived.len() < TOGETHER_MAX && event::poll(patience)? {
                arrived.push_back(event::read()?);
                patience = Duration::ZERO;
            }
            if !arrived.is_empty() && sender.blocking_send(arrived).is_err() {
                break;
            }
        }
        Ok(())
    })?;
    Ok(events)
}

/// The theme from the settings, otherwise from the environment.
fn theme(config: &Config) -> Theme {
    let found = Theme::of_environment(|name| std::env::var(name).ok());
    let palette = config.theme.unwrap_or(found.palette);
    let ascii = match config.characters {
        Characters::Auto => found.ascii,
        Characters::Unicode => false,
        Characters::Ascii => true,
    };
    Theme { palette, ascii }
}

fn take_terminal() -> io::Result<(Terminal<DiffBackend<FrameBuffer>>, TerminalWriter)> {
    TAKEN.store(true, Ordering::Relaxed);
    enable_raw_mode()?;
    answers::begin()?;
    // Some terminals have no alternate screen, and still show the earlier content.
    execute!(io::stdout(), EnterAlternateScreen, Clear(ClearType::All), EnableBracketedPaste)?;
    io::Write::write_all(&mut io::stdout(), answers::FLAGS_QUESTION)?;
    io::Write::flush(&mut io::stdout())?;
    let (writer, buffer) = TerminalWriter::new()?;
    let mut backend = DiffBackend::new(CrosstermBackend::new(buffer));
    // GNU Screen sets it.
    backend.erases = std::env::var_os("STY").is_none();
    backend.depth = Depth::of_environment(|name| std::env::var(name).ok());
    Ok((Terminal::new(backend)?, writer))
}

/// Whether a multiplexer at this end of an SSH session answers instead of the terminal: its answer
/// shows nothing about the line behind it.
fn is_answered_by_another() -> bool {
    let is_set = |name: &&str| std::env::var_os(name).is_some();
    ["TMUX", "STY"].iter().any(is_set) && is_set(&"SSH_CONNECTION")
}

/// Restores the terminal. It may be gone (a dropped session); then errors are ignored, because
/// printing them would panic and leave the log unfinished.
fn restore() {
    if !TAKEN.swap(false, Ordering::Relaxed) {
        return;
    }
    answers::end();
    // Before raw mode ends: in line mode the rest of a paste could not be read and discarded.
    drain_input();
    let _ = disable_raw_mode();
    // After half a frame the escape codes would not work; a blocked terminal is left alone.
    if !wait_for_end() {
        return;
    }
    let mut out = io::stdout();
    // Before the alternate screen is left, because each screen has its own keyboard flags.
    if KEYBOARD_ENHANCED.swap(false, Ordering::Relaxed) {
        let _ = queue!(out, PopKeyboardEnhancementFlags);
    }
    let _ = queue!(out, DisableBracketedPaste, LeaveAlternateScreen, Show);
    let _ = io::Write::flush(&mut out);
}

/// Discards unread input, so that the rest of a paste does not reach the shell.
fn drain_input() {
    let stdin = io::stdin();
    if !rustix::termios::isatty(&stdin) {
        return;
    }
    // Fails only if the terminal is gone.
    let _ = rustix::termios::tcflush(&stdin, QueueSelector::IFlush);
    for _ in 0..QUIET_WITHIN.as_millis() / QUIET_FOR.as_millis() {
        std::thread::sleep(QUIET_FOR);
        if !matches!(rustix::io::ioctl_fionread(&stdin), Ok(1..)) {
            return;
        }
        let _ = rustix::termios::tcflush(&stdin, QueueSelector::IFlush);
    }
}

/// Prints a panic message on the restored terminal, because the alternate screen disappears.
fn restore_before_panic_message() {
    let print_message = std::panic::take_hook();
    let drawing = std::thread::current().id();
    std::panic::set_hook(Box::new(move |panic| {
        // A panic in the simulator or recorder thread does not end the screen.
        if std::thread::current().id() == drawing {
            restore();
        }
        print_message(panic);
    }));
}

// Writes frames to the terminal in a separate thread, so that a blocked terminal (stopped output, a
// hanging session) does not stop link, log and abort.

/// Whether a frame is being written. There is only one terminal.
static WRITING: AtomicBool = AtomicBool::new(false);
/// How long to wait for the end of a frame before the terminal is restored, and in which steps.
const END_WITHIN: Duration = Duration::from_millis(500);
const END_STEP: Duration = Duration::from_millis(2);

/// The bytes to write next; frames are drawn into it.
#[derive(Debug, Clone, Default)]
pub(super) struct FrameBuffer(Arc<Mutex<Vec<u8>>>);

impl FrameBuffer {
    fn with<T>(&self, act: impl FnOnce(&mut Vec<u8>) -> T) -> T {
        act(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Write for FrameBuffer {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.with(|page| page.extend_from_slice(bytes));
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Writes frames to the terminal, one at a time.
pub(super) struct TerminalWriter {
    page: FrameBuffer,
    frames: SyncSender<Vec<u8>>,
    lost: Arc<AtomicBool>,
}

impl TerminalWriter {
    /// Starts the thread and returns the buffer to draw into.
    ///
    /// # Errors
    /// The thread cannot be started.
    pub(super) fn new() -> io::Result<(Self, FrameBuffer)> {
        let (frames, waiting) = sync_channel(1);
        let (page, lost) = (FrameBuffer::default(), Arc::new(AtomicBool::new(false)));
        let failed = Arc::clone(&lost);
        // The thread is never joined: it may hang with the terminal, and holds only a frame.
        in_a_thread("terminal", move || write_frames(&waiting, &failed))?;
        Ok((Self { page: page.clone(), frames, lost }, page))
    }

    /// Whether the previous frame is still being written.
    ///
    /// # Errors
    /// The terminal is gone.
    pub(super) fn is_busy(&self) -> io::Result<bool> {
        if self.lost.load(Ordering::Acquire) {
            return Err(io::Error::from(io::ErrorKind::BrokenPipe));
        }
        Ok(WRITING.load(Ordering::Acquire))
    }

    /// How many bytes are in the buffer.
    pub(super) fn waiting(&self) -> usize {
        self.page.with(|page| page.len())
    }

    /// Hands the buffer to the thread, unless the previous frame is still being written.
    pub(super) fn send(&self) {
        let bytes = self.page.with(std::mem::take);
        if bytes.is_empty() {
            return;
        }
        if WRITING.swap(true, Ordering::AcqRel) {
            // Only a bell can come between two frames; it is sent with the next.
            return self.page.with(|page| *page = bytes);
        }
        if self.frames.try_send(bytes).is_err() {
            WRITING.store(false, Ordering::Release);
        }
    }
}

/// Waits a moment for the frame that is being written. Returns whether it is finished.
pub(super) fn wait_for_end() -> bool {
    for _ in 0..END_WITHIN.as_millis() / END_STEP.as_millis() {
        if !WRITING.load(Ordering::Acquire) {
            return true;
        }
        std::thread::sleep(END_STEP);
    }
    false
}

fn write_frames(frames: &Receiver<Vec<u8>>, lost: &AtomicBool) {
    let mut out = io::stdout();
    for frame in frames {
        let written = out.write_all(&frame).and_then(|()| out.flush());
        lost.fetch_or(written.is_err(), Ordering::AcqRel);
        WRITING.store(false, Ordering::Release);
    }
}

//! Frames on their way to the terminal, by a thread of their own: a terminal that takes nothing for a while (a stopped
//! scroll, a session that hangs) must not stop link, log and abort.

use std::io::{self, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// A frame is being written. There is one terminal.
static WRITING: AtomicBool = AtomicBool::new(false);
/// How long a frame's end is waited for before the terminal is given back, in steps.
const END_WITHIN: Duration = Duration::from_millis(500);
const STEP: Duration = Duration::from_millis(2);

/// What is written next; a frame is drawn on it.
#[derive(Debug, Clone, Default)]
pub(super) struct Page(Arc<Mutex<Vec<u8>>>);

impl Page {
    fn with<T>(&self, act: impl FnOnce(&mut Vec<u8>) -> T) -> T {
        act(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Write for Page {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.with(|page| page.extend_from_slice(bytes));
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Writes pages to the terminal, one at a time.
pub(super) struct Paper {
    page: Page,
    frames: SyncSender<Vec<u8>>,
    gone: Arc<AtomicBool>,
}

impl Paper {
    /// Starts the thread; returns the page to draw on.
    ///
    /// # Errors
    /// The system refuses a thread.
    pub(super) fn new() -> io::Result<(Self, Page)> {
        let (frames, waiting) = sync_channel(1);
        let (page, gone) = (Page::default(), Arc::new(AtomicBool::new(false)));
        let failed = Arc::clone(&gone);
        // Not waited for: it may hang with the terminal, and holds nothing but a frame.
        std::thread::Builder::new().name("terminal".to_owned()).spawn(move || write(&waiting, &failed))?;
        Ok((Self { page: page.clone(), frames, gone }, page))
    }

    /// Whether the terminal still takes the frame before: then the next is not drawn yet.
    ///
    /// # Errors
    /// It takes nothing any more.
    pub(super) fn is_busy(&self) -> io::Result<bool> {
        if self.gone.load(Ordering::Acquire) {
            return Err(io::Error::from(io::ErrorKind::BrokenPipe));
        }
        Ok(WRITING.load(Ordering::Acquire))
    }

    /// How many bytes stand on the page.
    pub(super) fn waiting(&self) -> usize {
        self.page.with(|page| page.len())
    }

    /// Hands over what stands on the page; later, while the frame before is still on its way.
    pub(super) fn send(&self) {
        let bytes = self.page.with(std::mem::take);
        if bytes.is_empty() {
            return;
        }
        if WRITING.swap(true, Ordering::AcqRel) {
            // Only a bell can come between frames; it waits for the next.
            return self.page.with(|page| *page = bytes);
        }
        if self.frames.try_send(bytes).is_err() {
            WRITING.store(false, Ordering::Release);
        }
    }
}

/// Waits a moment for the frame that is on its way. Returns whether the terminal takes more.
pub(super) fn wait_for_end() -> bool {
    for _ in 0..END_WITHIN.as_millis() / STEP.as_millis() {
        if !WRITING.load(Ordering::Acquire) {
            return true;
        }
        std::thread::sleep(STEP);
    }
    false
}

fn write(frames: &Receiver<Vec<u8>>, gone: &AtomicBool) {
    let mut out = io::stdout();
    for frame in frames {
        let written = out.write_all(&frame).and_then(|()| out.flush());
        gone.fetch_or(written.is_err(), Ordering::AcqRel);
        WRITING.store(false, Ordering::Release);
    }
}

//! Writes frames to the terminal in a thread of its own, so that a blocked terminal (stopped output, a hanging
//! session) does not stop link, log and abort.

use std::io::{self, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Whether a frame is being written. There is only one terminal.
static WRITING: AtomicBool = AtomicBool::new(false);
/// How long to wait for the end of a frame before the terminal is restored, and in which steps.
const END_WITHIN: Duration = Duration::from_millis(500);
const STEP: Duration = Duration::from_millis(2);

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
    gone: Arc<AtomicBool>,
}

impl TerminalWriter {
    /// Starts the thread and returns the buffer to draw into.
    ///
    /// # Errors
    /// The thread cannot be started.
    pub(super) fn new() -> io::Result<(Self, FrameBuffer)> {
        let (frames, waiting) = sync_channel(1);
        let (page, gone) = (FrameBuffer::default(), Arc::new(AtomicBool::new(false)));
        let failed = Arc::clone(&gone);
        // The thread is never joined: it may hang with the terminal, and holds only a frame.
        std::thread::Builder::new().name("terminal".to_owned()).spawn(move || write(&waiting, &failed))?;
        Ok((Self { page: page.clone(), frames, gone }, page))
    }

    /// Whether the previous frame is still being written.
    ///
    /// # Errors
    /// The terminal is gone.
    pub(super) fn is_busy(&self) -> io::Result<bool> {
        if self.gone.load(Ordering::Acquire) {
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

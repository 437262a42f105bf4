//! The frames as interrupts of a main context that uses the heap without a pause: whether a frame
//! ever hangs, and how late it starts. With the file `storm` in the emulator's folder.
//!
//! A frame uses the heap, too. If the main context holds it when the frame is due, the frame starts
//! at a later tick, and the main context goes on: it holds the heap for one operation at most.

use alloc::boxed::Box;
use alloc::vec::Vec;
use core::cell::Cell;
use core::sync::atomic::{AtomicBool, Ordering};

use avionics::board::recorded::{Board, VehicleKind};
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use critical_section::Mutex;
use semihosting::fs::File;
use semihosting::io::{self, Read as _, Write as _};
use semihosting::println;

use crate::m7::{HEAP, INSTRUCTIONS_PER_COUNT};

/// Counts of the timer between two ticks, 10 us of the emulated time, and ticks in a frame: a tenth
/// of a real frame's, because the main context does nothing but allocate.
const TICK_COUNTS: u32 = 250;
const FRAME_TICKS: u32 = 50;
/// Frames between reports of the progress.
const REPORTED_FRAMES: u64 = 250;
/// Blocks that the main context holds, and the longest, bytes.
const BLOCKS: usize = 64;
const LONGEST_BYTES: usize = 4096;

static FRAMES: Mutex<Cell<Option<Box<Frames>>>> = Mutex::new(Cell::new(None));
static OVER: AtomicBool = AtomicBool::new(false);

/// The flight that the interrupt flies.
struct Frames {
    board: Board,
    frames: File,
    answers: File,
    bytes: [u8; 4096],
    pending: usize,
    at: usize,
    ticks: u32,
    late: u64,
    latest_ticks: u32,
}

/// Called by the timer.
pub(crate) fn tick() {
    let Some(mut flying) = critical_section::with(|cs| FRAMES.borrow(cs).take()) else { return };
    flying.ticks += 1;
    if flying.ticks >= FRAME_TICKS && HEAP.try_lock().is_some() {
        let late_ticks = flying.ticks - FRAME_TICKS;
        flying.late += u64::from(late_ticks > 0);
        flying.latest_ticks = flying.latest_ticks.max(late_ticks);
        flying.ticks = 0;
        let goes_on = matches!(flying.fly(), Ok(true));
        if goes_on && flying.board.frames().is_multiple_of(REPORTED_FRAMES) {
            println!("{} frames so far", flying.board.frames());
        }
        if !goes_on {
            let Frames { board, late, latest_ticks, .. } = &*flying;
            let instructions = u64::from(latest_ticks * TICK_COUNTS) * INSTRUCTIONS_PER_COUNT;
            println!(
                "{} frames as interrupts; {late} found the heap in use, the latest started {instructions} \
                 instructions late",
                board.frames()
            );
            OVER.store(true, Ordering::Relaxed);
            // Freeing it is the main context's work no longer: the program ends.
            core::mem::forget(flying);
            return;
        }
    }
    critical_section::with(|cs| FRAMES.borrow(cs).set(Some(flying)));
}

impl Frames {
    /// Flies the next frame; returns `false` behind the last one.
    fn fly(&mut self) -> io::Result<bool> {
        let before = self.board.frames();
        while self.board.frames() == before {
            if self.at == self.pending {
                (self.pending, self.at) = (self.frames.read(&mut self.bytes)?, 0);
                if self.pending == 0 {
                    return Ok(false);
                }
            }
            let end = self.bytes[self.at..self.pending].iter().position(|byte| *byte == 0);
            let end = end.map_or(self.pending, |end| self.at + end + 1);
            let mut written = Ok(());
            let answers = &mut self.answers;
            let mut answer = |bytes: &[u8]| written = answers.write_all(bytes);
            let flown = self.board.take(&self.bytes[self.at..end], &mut (), &mut (), &mut answer);
            self.at = end;
            written?;
            if flown.is_err() {
                return Ok(false);
            }
        }
        Ok(true)
    }
}

/// Flies the recorded frames, and allocates all the time.
pub(crate) fn run(timer: &mut SYST) -> io::Result<()> {
    let flying = Frames {
        board: Board::new(VehicleKind::Real),
        frames: File::open(c"frames")?,
        answers: File::create(c"answers")?,
        bytes: [0; 4096],
        pending: 0,
        at: 0,
        ticks: 0,
        late: 0,
        latest_ticks: 0,
    };
    critical_section::with(|cs| FRAMES.borrow(cs).set(Some(Box::new(flying))));
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(TICK_COUNTS - 1);
    timer.clear_current();
    timer.enable_counter();
    timer.enable_interrupt();
    let (mut blocks, mut random, mut allocations) = ([const { Vec::new() }; BLOCKS], 1_u32, 0_u64);
    while !OVER.load(Ordering::Relaxed) {
        // Numerical Recipes' generator: its upper bits are random enough.
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let block: &mut Vec<u8> = &mut blocks[(random >> 26) as usize % BLOCKS];
        *block = Vec::with_capacity(1 + (random >> 8) as usize % LONGEST_BYTES);
        allocations += 1;
    }
    println!("{allocations} allocations of the main context");
    Ok(())
}

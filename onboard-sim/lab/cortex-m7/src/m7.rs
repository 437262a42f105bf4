//! The only program of a Cortex-M7. Its link is semihosting: the files `frames`, `answers` and
//! `costs` in the folder of the emulator or debugger. Its radio is the files `uplink` and
//! `downlink` there, if a flight has a crew. The files `saved-0` and `saved-1` are its memory that
//! survives a reset: where a recorded flight's computer was dead, this program resets its processor
//! and continues from them.

use core::ffi::CStr;
use core::fmt::Write as _;
use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicU32, Ordering};

use avionics::board::radio::Radio;
use avionics::board::recorded::{Board, FlyError, VehicleKind, Watch};
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{SCB, SYST};
use cortex_m_rt::{entry, exception};
use flight::computer::saved::Saved;
use linked_list_allocator::LockedHeap;
use semihosting::fs::File;
use semihosting::io::{self, Read as _, Seek as _, SeekFrom, Write as _};
use semihosting::{eprintln, println, process};

/// Size of the heap, bytes: the memory that the memory map leaves beside the static data.
const HEAP_BYTES: usize = 792 * 1024;

#[global_allocator]
pub(crate) static HEAP: LockedHeap = LockedHeap::empty();

/// Number of wraps of the counter through zero.
static WRAPS: AtomicU32 = AtomicU32::new(0);

/// Number of values of the 24-bit counter.
const COUNTS: u32 = 1 << 24;

/// Instructions for one count: `qemu -icount shift=0` takes 1 ns for an instruction, and the
/// counter of its board counts at 25 MHz. On hardware the numbers are clock cycles of that counter,
/// and nothing else.
pub(crate) const INSTRUCTIONS_PER_COUNT: u64 = 40;

#[exception]
fn SysTick() {
    WRAPS.fetch_add(1, Ordering::Relaxed);
    crate::storm::tick();
}

#[entry]
fn main() -> ! {
    static mut MEMORY: [MaybeUninit<u8>; HEAP_BYTES] = [const { MaybeUninit::uninit() }; HEAP_BYTES];
    HEAP.lock().init_from_slice(MEMORY);
    if let Some(peripherals) = cortex_m::Peripherals::take() {
        let mut counter = peripherals.SYST;
        if File::open(c"storm").is_ok() {
            process::exit(i32::from(crate::storm::run(&mut counter).is_err()));
        }
        counter.set_clock_source(SystClkSource::Core);
        counter.set_reload(COUNTS - 1);
        counter.clear_current();
        counter.enable_counter();
        counter.enable_interrupt();
    }
    process::exit(match fly_the_files() {
        Ok(()) => 0,
        Err(error) => {
            eprintln!("board: {error}");
            1
        }
    })
}

fn fly_the_files() -> io::Result<()> {
    let saved = newest();
    let written = |name: &'static CStr| match &saved {
        Some(_) => {
            let mut file = File::options().write(true).append(true).create(true).open(name)?;
            // QEMU does not append by itself. A pipe has no end and needs no seek.
            let _ = file.seek(SeekFrom::End(0));
            Ok(file)
        }
        None => File::create(name),
    };
    let (mut frames, mut answers) = (File::open(c"frames")?, written(c"answers")?);
    let file = written(c"costs")?;
    let mut costs =
        Costs { file, begun: 0, set_up_bytes: 0, most_bytes: 0, saved, save: Cost::default(), failed: None };
    // The world behind its files is simulated.
    let mut board = Board::new(VehicleKind::Simulated);
    let flown = fly(&mut board, (&mut frames, &mut answers), &mut costs)?;
    if let Some(error) = costs.failed {
        return Err(error);
    }
    let stack_bytes = cortex_m_stack::stack_size();
    println!(
        "heap {} bytes of {HEAP_BYTES} after set-up, at most {} between frames; stack at most {} bytes of {stack_bytes}",
        costs.set_up_bytes,
        costs.most_bytes,
        stack_bytes - cortex_m_stack::stack_painted(),
    );
    println!(
        "saved record at most {} bytes, made with at most {} instructions",
        costs.save.bytes, costs.save.instructions
    );
    match flown {
        Ok(()) => println!("{} frames", board.frames()),
        Err(error) => {
            eprintln!("board: {error}");
            process::exit(1)
        }
    }
    Ok(())
}

/// Flies the frames of the world until they end.
fn fly(
    board: &mut Board,
    (frames, answers): (&mut File, &mut File),
    costs: &mut Costs,
) -> io::Result<Result<(), FlyError>> {
    let (mut radio, mut arrived, mut written) = (Serial::default(), [0; 512], Ok(()));
    loop {
        let read = frames.read(&mut arrived)?;
        if read == 0 {
            return Ok(Ok(()));
        }
        let mut answer = |bytes: &[u8]| {
            if written.is_ok() {
                written = answers.write_all(bytes);
            }
        };
        let flown = board.take(&arrived[..read], &mut radio, costs, &mut answer);
        core::mem::replace(&mut written, Ok(()))?;
        if flown.is_err() {
            return Ok(flown);
        }
    }
}

/// The radio: the files `uplink` and `downlink`, opened with the first byte requested; `Some(None)`
/// without a radio. Reading must not wait: regular files return what they have, and so does a
/// pseudo-terminal under two names (`stty min 0 time 0`).
#[derive(Default)]
struct Serial {
    files: Option<Option<(File, File)>>,
}

impl Serial {
    fn files(&mut self) -> Option<&mut (File, File)> {
        let open = || Some((File::open(c"uplink").ok()?, File::create(c"downlink").ok()?));
        self.files.get_or_insert_with(open).as_mut()
    }
}

impl Radio for Serial {
    fn read(&mut self, into: &mut [u8]) -> usize {
        self.files().and_then(|(uplink, _)| uplink.read(into).ok()).unwrap_or(0)
    }

    fn write(&mut self, bytes: &[u8]) {
        if let Some((_, downlink)) = self.files() {
            // Bytes without room are dropped.
            let _ = downlink.write_all(bytes);
        }
    }
}

/// Writes a line for each frame and for each plan: the frame's number, 1 for a plan that the frame
/// requested, the instructions, and the bytes on the heap after it.
struct Costs {
    file: File,
    begun: u64,
    set_up_bytes: usize,
    most_bytes: usize,
    /// The record from before the reset.
    saved: Option<Saved>,
    /// Cost of making a record for the next reset, without writing it.
    save: Cost,
    failed: Option<io::Error>,
}

/// Largest number of instructions and of bytes.
#[derive(Default)]
struct Cost {
    instructions: u64,
    bytes: usize,
}

/// The two records, written in turn, so that a reset during a write leaves the other intact.
const SLOTS: [&CStr; 2] = [c"saved-0", c"saved-1"];

/// The newer intact record, if this is not the first start.
fn newest() -> Option<Saved> {
    let read = |slot: &CStr| {
        let mut bytes = [0; Saved::MOST_BYTES];
        let read = File::open(slot).ok()?.read(&mut bytes).ok()?;
        Saved::read(&bytes[..read]).ok()
    };
    SLOTS.into_iter().filter_map(read).max_by_key(Saved::frame)
}

impl Watch for Costs {
    fn is_set_up(&mut self) {
        self.set_up_bytes = HEAP.lock().used();
    }

    fn begins(&mut self) {
        self.begun = counted();
    }

    fn ended(&mut self, frame: u64, posed: bool) {
        let instructions = counted().saturating_sub(self.begun) * INSTRUCTIONS_PER_COUNT;
        let bytes = HEAP.lock().used();
        self.most_bytes = self.most_bytes.max(bytes);
        let mut line = Line { text: [0; 80], length: 0 };
        // The longest line has 64 characters.
        let _ = writeln!(line, "{frame} {} {instructions} {bytes}", u8::from(posed));
        if let Err(error) = self.file.write_all(&line.text[..line.length]) {
            self.failed.get_or_insert(error);
        }
    }

    fn saved(&mut self) -> Option<Saved> {
        let saved = self.saved.take()?;
        println!("goes on after frame {}", saved.frame());
        Some(saved)
    }

    fn save(&mut self, saved: &Saved) {
        let mut room = [0; Saved::MOST_BYTES];
        let begun = counted();
        let written = saved.write(&mut room);
        let instructions = counted().saturating_sub(begun) * INSTRUCTIONS_PER_COUNT;
        let Ok(bytes) = written else {
            self.failed.get_or_insert(io::ErrorKind::OutOfMemory.into());
            return;
        };
        self.save.instructions = self.save.instructions.max(instructions);
        self.save.bytes = self.save.bytes.max(bytes.len());
        let slot = SLOTS[(saved.frame() % 2) as usize];
        if let Err(error) = File::create(slot).and_then(|mut file| file.write_all(bytes)) {
            self.failed.get_or_insert(error);
        }
    }

    fn reset(&mut self, before: u64) {
        println!("reset: the computer was dead before frame {before}");
        SCB::sys_reset();
    }
}

/// Counts since the start of the counter. Only with `-icount` is the interrupt of a wrap never
/// late.
fn counted() -> u64 {
    loop {
        let wraps = WRAPS.load(Ordering::Relaxed);
        let down = SYST::get_current();
        if wraps == WRAPS.load(Ordering::Relaxed) {
            return u64::from(wraps) * u64::from(COUNTS) + u64::from(COUNTS - 1 - down);
        }
    }
}

/// A line of text without a heap.
struct Line {
    text: [u8; 80],
    length: usize,
}

impl core::fmt::Write for Line {
    fn write_str(&mut self, text: &str) -> core::fmt::Result {
        let end = self.length + text.len();
        self.text.get_mut(self.length..end).ok_or(core::fmt::Error)?.copy_from_slice(text.as_bytes());
        self.length = end;
        Ok(())
    }
}

//! The image of a Teensy 4.1: entry, heap, timer, both contexts.
//!
//! Its buses and pins are stand-ins that report nothing: a club puts those of `teensy4-bsp` in
//! their places. So it shows that everything is linked and fits, and does not fly.

use alloc::boxed::Box;
use core::cell::Cell;
use core::hint::black_box;
use core::mem::MaybeUninit;

use avionics::link::endpoint::UplinkState;
use cortex_m::peripheral::syst::SystClkSource;
use critical_section::Mutex;
use embedded_hal::delay::DelayNs;
use embedded_hal::digital::{self, InputPin, OutputPin};
use embedded_hal::i2c::{self, I2c};
use embedded_hal::pwm::{self, SetDutyCycle};
use embedded_hal::spi::{self, SpiDevice};
use embedded_io::{Read, ReadReady};
use embedded_sdmmc::SdCard;
use flight::computer::LogState;
use flight::computer::crew::Requests;
use flight::computer::messages::CrewMessage;
use flight::computer::pilot::planner::Planner;
use flight::rules::arming::Uplink;
use imxrt_rt::{entry, exception};
use linked_list_allocator::LockedHeap;
use panic_halt as _;
use teensy::card::{Appender, CardLog, Ring};
use teensy::{Build, Chip, Parts, Surface, TeensyBoard, Wiring, start, tick};
use teensy4_fcb as _;

extern crate alloc;

/// What the banks of `build.rs` leave beside the static data and the ring.
const HEAP_BYTES: usize = 700 * 1024;

#[global_allocator]
static HEAP: LockedHeap = LockedHeap::empty();

/// Clock of the processor, Hz, and interrupts in a frame: a frame that finds the heap locked by the
/// main context starts at the next one, 10 us later.
const CLOCK_HZ: u32 = 600_000_000;
const TICKS: u32 = 500;

type Flight = (avionics::board::port::Frames, TeensyBoard<StandIns>);

/// The flight, until the timer takes it, and a problem and its solution on their ways.
static FLIGHT: Mutex<Cell<Option<Box<Flight>>>> = Mutex::new(Cell::new(None));
static SUBMITTED: Mutex<Cell<Option<Box<Planner>>>> = Mutex::new(Cell::new(None));
static SOLVED: Mutex<Cell<Option<Box<Planner>>>> = Mutex::new(Cell::new(None));
/// State of the log for the next frame.
static LOG: Mutex<Cell<LogState>> = Mutex::new(Cell::new(LogState { running: false, space_bytes: 0 }));

/// Calls a frame every 5 ms. The main context may hold the heap when it is interrupted: then the
/// frame waits, and the main context goes on. A frame itself is not interrupted by anything that
/// uses the heap.
#[exception]
fn SysTick() {
    static mut FLYING: Option<Box<Flight>> = None;
    static mut TICK: u32 = 0;
    *TICK += 1;
    if *TICK < TICKS || HEAP.try_lock().is_none() {
        return;
    }
    *TICK = 0;
    if FLYING.is_none() {
        *FLYING = critical_section::with(|cs| FLIGHT.borrow(cs).take());
    }
    if let Some(flight) = FLYING {
        let (frames, board) = &mut **flight;
        tick(frames, board);
    }
}

#[entry]
fn main() -> ! {
    static mut MEMORY: [MaybeUninit<u8>; HEAP_BYTES] = [const { MaybeUninit::uninit() }; HEAP_BYTES];
    static mut RING: Ring = Ring::new();
    HEAP.lock().init_from_slice(MEMORY);
    let (producer, mut consumer) = RING.split();
    let mut log = CardLog::new(SdCard::new(StandIn, StandIn));
    let Some((_, mission)) = teensy::mission("mk3") else {
        loop {
            cortex_m::asm::wfi();
        }
    };
    let chip = StandInChip(Appender::new(producer));
    let parts = Parts {
        imu: StandIn,
        barometer: StandIn,
        gnss: StandIn,
        lidar: StandIn,
        servos: [const { StandIn }; 6],
        outputs: [const { StandIn }; 5],
        foot: StandIn,
        igniters: [const { StandIn }; 2],
        booster: StandIn,
        pin: StandIn,
        chip,
    };
    let build = Build {
        body_from_imu: [(0, 1.0), (1, 1.0), (2, 1.0)],
        surfaces: [Surface { zero_us: 1500.0, us_per_rad: 600.0 }; 6],
        fix_age_s: 0.12,
    };
    if let Ok(flight) = start(parts, build, teensy::at_power_up(&mission), &mut StandIn) {
        critical_section::with(|cs| FLIGHT.borrow(cs).set(Some(Box::new(flight))));
    }
    if let Some(peripherals) = cortex_m::Peripherals::take() {
        let mut timer = peripherals.SYST;
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(CLOCK_HZ / 200 / TICKS - 1);
        timer.clear_current();
        timer.enable_counter();
        timer.enable_interrupt();
    }
    loop {
        if let Some(mut planner) = critical_section::with(|cs| SUBMITTED.borrow(cs).take()) {
            planner.solve();
            critical_section::with(|cs| SOLVED.borrow(cs).set(Some(planner)));
        }
        log.poll(&mut consumer);
        critical_section::with(|cs| LOG.borrow(cs).set(log.state()));
    }
}

/// A bus, pin or clock that reports nothing. The compiler must not know that.
struct StandIn;

/// A stand-in has no device behind it.
#[derive(Debug, Clone, Copy)]
struct Nothing;

fn nothing() -> Result<(), Nothing> {
    if black_box(false) { Ok(()) } else { Err(Nothing) }
}

impl core::fmt::Display for Nothing {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("no device")
    }
}

impl core::error::Error for Nothing {}

impl spi::Error for Nothing {
    fn kind(&self) -> spi::ErrorKind {
        spi::ErrorKind::Other
    }
}

impl i2c::Error for Nothing {
    fn kind(&self) -> i2c::ErrorKind {
        i2c::ErrorKind::Other
    }
}

impl pwm::Error for Nothing {
    fn kind(&self) -> pwm::ErrorKind {
        pwm::ErrorKind::Other
    }
}

impl digital::Error for Nothing {
    fn kind(&self) -> digital::ErrorKind {
        digital::ErrorKind::Other
    }
}

impl embedded_io::Error for Nothing {
    fn kind(&self) -> embedded_io::ErrorKind {
        embedded_io::ErrorKind::Other
    }
}

impl spi::ErrorType for StandIn {
    type Error = Nothing;
}

impl SpiDevice for StandIn {
    fn transaction(&mut self, operations: &mut [spi::Operation<'_, u8>]) -> Result<(), Nothing> {
        black_box(operations);
        nothing()
    }
}

impl i2c::ErrorType for StandIn {
    type Error = Nothing;
}

impl I2c for StandIn {
    fn transaction(&mut self, address: u8, operations: &mut [i2c::Operation<'_>]) -> Result<(), Nothing> {
        black_box((address, operations));
        nothing()
    }
}

impl embedded_io::ErrorType for StandIn {
    type Error = Nothing;
}

impl Read for StandIn {
    fn read(&mut self, into: &mut [u8]) -> Result<usize, Nothing> {
        black_box(&into);
        nothing().map(|()| into.len())
    }
}

impl embedded_io::Write for StandIn {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Nothing> {
        black_box(bytes);
        nothing().map(|()| bytes.len())
    }

    fn flush(&mut self) -> Result<(), Nothing> {
        nothing()
    }
}

impl ReadReady for StandIn {
    fn read_ready(&mut self) -> Result<bool, Nothing> {
        Ok(black_box(false))
    }
}

impl pwm::ErrorType for StandIn {
    type Error = Nothing;
}

impl SetDutyCycle for StandIn {
    fn max_duty_cycle(&self) -> u16 {
        u16::MAX
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Nothing> {
        black_box(duty);
        nothing()
    }
}

impl digital::ErrorType for StandIn {
    type Error = Nothing;
}

impl OutputPin for StandIn {
    fn set_low(&mut self) -> Result<(), Nothing> {
        nothing()
    }

    fn set_high(&mut self) -> Result<(), Nothing> {
        nothing()
    }
}

impl InputPin for StandIn {
    fn is_high(&mut self) -> Result<bool, Nothing> {
        nothing().map(|()| true)
    }

    fn is_low(&mut self) -> Result<bool, Nothing> {
        nothing().map(|()| true)
    }
}

impl DelayNs for StandIn {
    fn delay_ns(&mut self, _: u32) {}
}

/// The chip's services; a memory that outlasts a reset, a clock and a radio are stand-ins, too.
struct StandInChip(Appender<'static>);

impl Chip for StandInChip {
    fn submit(&mut self, planner: Box<Planner>) {
        critical_section::with(|cs| SUBMITTED.borrow(cs).set(Some(planner)));
    }

    fn solved(&mut self) -> Option<Box<Planner>> {
        critical_section::with(|cs| SOLVED.borrow(cs).take())
    }

    fn uplink_state(&mut self) -> UplinkState {
        UplinkState { uplink: Uplink::NeverReceived, commander: None, requests: Requests::new() }
    }

    fn send(&mut self, messages: &[CrewMessage]) {
        black_box(messages);
    }

    fn append(&mut self, frame: u64, record: &[u8]) {
        self.0.append(frame, record);
    }

    fn log(&self) -> LogState {
        critical_section::with(|cs| LOG.borrow(cs).get())
    }

    fn batteries_v(&mut self) -> [Option<f64>; 2] {
        black_box([None; 2])
    }

    fn clock_s(&mut self) -> f64 {
        black_box(0.0)
    }

    fn save(&mut self, slot: usize, record: &[u8]) {
        black_box((slot, record));
    }

    fn load(&mut self, slot: usize, into: &mut [u8]) -> usize {
        black_box((slot, &into));
        black_box(0)
    }
}

struct StandIns;

impl Wiring for StandIns {
    type Imu = StandIn;
    type Barometer = StandIn;
    type Gnss = StandIn;
    type Lidar = StandIn;
    type Servo = StandIn;
    type Output = StandIn;
    type Switch = StandIn;
    type Chip = StandInChip;
}

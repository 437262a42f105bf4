//! The image of a Teensy 4.1: entry, heap, timer, both contexts.
//!
//! SPI, I2C, switches and outputs are those of `teensy4-bsp` on the pins of `README.md`. UARTs,
//! servos and the services of the chip are stand-ins that report nothing: `README.md` says what a
//! club writes in their places. So it shows that everything is linked and fits, and does not fly.

use alloc::boxed::Box;
use core::cell::Cell;
use core::hint::black_box;
use core::mem::MaybeUninit;

use avionics::link::endpoint::UplinkState;
use cortex_m::peripheral::syst::SystClkSource;
use critical_section::Mutex;
use embedded_hal::delay::DelayNs;
use embedded_hal::pwm::{self, SetDutyCycle};
use embedded_hal_bus::spi::ExclusiveDevice;
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
use teensy4_bsp::board::{self, Lpi2cClockSpeed, Lpspi, LpspiPins};
use teensy4_bsp::hal::gpio::{Input, Output};
use teensy4_bsp::hal::iomuxc::{Config, PullKeeper, configure};
use teensy4_bsp::hal::lpi2c::Lpi2c;
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

/// Clocks of the inertial unit's bus, and of the card's: a card starts at 400 kHz at most.
const IMU_HZ: u32 = 8_000_000;
const CARD_START_HZ: u32 = 400_000;
const CARD_HZ: u32 = 20_000_000;

/// A bus with one device, whose chip select is an ordinary pin.
type Spi = ExclusiveDevice<Lpspi, Output, Waits>;
type Flight = (avionics::board::port::Frames, TeensyBoard<Wired>);

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
    let wired = wired(StandInChip(Appender::new(producer)));
    let (Some((_, mission)), Some((parts, card))) = (teensy::mission("mk3"), wired) else {
        loop {
            cortex_m::asm::wfi();
        }
    };
    let mut log = CardLog::new(card);
    let build = Build {
        body_from_imu: [(0, 1.0), (1, 1.0), (2, 1.0)],
        surfaces: [Surface { zero_us: 1500.0, us_per_rad: 600.0 }; 6],
        fix_age_s: 0.12,
    };
    if let Ok(flight) = start(parts, build, teensy::at_power_up(&mission), &mut Waits) {
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

/// Waits for a time, by the processor's clock.
struct Waits;

impl DelayNs for Waits {
    fn delay_ns(&mut self, ns: u32) {
        cortex_m::asm::delay(ns.div_ceil(1000).saturating_mul(CLOCK_HZ / 1_000_000));
    }
}

/// The parts on their pins, and the card; `None` if a pin is not where this expects it.
fn wired(chip: StandInChip) -> Option<(Parts<Wired>, SdCard<Spi, Waits>)> {
    let board::Resources {
        mut pins, mut gpio1, mut gpio2, mut gpio3, mut gpio4, lpspi3, lpspi4, lpi2c1, ..
    } = board::t41(board::instances());
    // A switch to ground is high while it is open; an igniter without current is low.
    let (up, down) = (Some(PullKeeper::Pullup22k), Some(PullKeeper::Pulldown100k));
    configure(&mut pins.p31, Config::zero().set_pull_keeper(up));
    configure(&mut pins.p32, Config::zero().set_pull_keeper(up));
    configure(&mut pins.p33, Config::zero().set_pull_keeper(up));
    configure(&mut pins.p29, Config::zero().set_pull_keeper(down));
    configure(&mut pins.p30, Config::zero().set_pull_keeper(down));
    let outputs = [
        gpio1.output(pins.p20).ok()?,
        gpio1.output(pins.p21).ok()?,
        gpio1.output(pins.p22).ok()?,
        gpio1.output(pins.p23).ok()?,
        gpio3.output(pins.p28).ok()?,
    ];
    let imu = board::lpspi(lpspi4, LpspiPins { sdo: pins.p11, sdi: pins.p12, sck: pins.p13 }, IMU_HZ);
    let card = board::lpspi(lpspi3, LpspiPins { sdo: pins.p26, sdi: pins.p1, sck: pins.p27 }, CARD_START_HZ);
    let card = SdCard::new(ExclusiveDevice::new(card, gpio1.output(pins.p0).ok()?, Waits).ok()?, Waits);
    // Starts it, if there is one.
    let _ = card.num_bytes();
    card.spi(|device| device.bus_mut().disabled(|spi| spi.set_clock_hz(board::LPSPI_FREQUENCY, CARD_HZ)));
    let parts = Parts {
        imu: ExclusiveDevice::new(imu, gpio2.output(pins.p10).ok()?, Waits).ok()?,
        barometer: board::lpi2c(lpi2c1, pins.p19, pins.p18, Lpi2cClockSpeed::KHz400),
        gnss: StandIn,
        lidar: StandIn,
        servos: [const { StandIn }; 6],
        outputs,
        foot: gpio3.input(pins.p31).ok()?,
        igniters: [gpio4.input(pins.p29).ok()?, gpio3.input(pins.p30).ok()?],
        booster: gpio2.input(pins.p32).ok()?,
        pin: gpio4.input(pins.p33).ok()?,
        chip,
    };
    Some((parts, card))
}

/// A bus or clock that reports nothing. The compiler must not know that.
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

impl pwm::Error for Nothing {
    fn kind(&self) -> pwm::ErrorKind {
        pwm::ErrorKind::Other
    }
}

impl embedded_io::Error for Nothing {
    fn kind(&self) -> embedded_io::ErrorKind {
        embedded_io::ErrorKind::Other
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

struct Wired;

impl Wiring for Wired {
    type Imu = Spi;
    type Barometer = Lpi2c;
    type Gnss = StandIn;
    type Lidar = StandIn;
    type Servo = StandIn;
    type Output = Output;
    type Switch = Input;
    type Chip = StandInChip;
}

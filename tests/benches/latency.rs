//! Measures how old a value is when it reaches the ground's model.
//!
//! `cargo bench -p e2e --bench latency`. The vehicle's own run loop flies a landing in real time;
//! the ground's own links and model receive it. The benchmark notes the time of each controller
//! tick. The time since boot in a message then gives the time of its state, counted from the tick
//! before it. Vehicle and ground are in one process and use one clock.

use std::collections::BTreeMap;
use std::io::Write as _;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use e2e::{SerialLine, now};
use ground::app::clock::{Clock, LogTime};
use ground::app::wire::Wire;
use ground::model::{Model, Settings};
use ground::update::{Action, Msg, update};
use protocol::dialect::MavMessage;
use protocol::identity::{GROUND, VEHICLE};
use protocol::transport::LinkAddress;
use sim::wire::fly::{FlyOptions, OnTheWire, Speed, fly_observed, load_flight};
use sim::wire::vehicle::VehicleEvent;
use tokio::sync::watch;

type Failure = Box<dyn std::error::Error + Send + Sync>;
/// The controller's period in flight, ms.
const TICK_MS: u32 = 100;

/// The time of each tick, by milliseconds since boot.
type Ticks = Arc<Mutex<BTreeMap<u32, Instant>>>;

/// Flies in a thread of its own, as a vehicle would in a process of its own.
fn start_vehicle(
    link: LinkAddress,
    ticks: &Ticks,
) -> Result<std::thread::JoinHandle<Result<(), Failure>>, Failure> {
    let ticks = Arc::clone(ticks);
    let options = FlyOptions {
        system_id: 1,
        flight: load_flight("mk2")?,
        links: vec![link],
        key_file: None,
        crew: None,
        recorder: None,
        on_the_wire: OnTheWire::drawn(),
        speed: Speed::Factor(1.0),
        auto_start: true,
        exit_when_safed: true,
        board: None,
        pin_out: None,
        abort_file: None,
        log_clock: None,
    };
    let fly = move || -> Result<(), Failure> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        let (_stop, stopped) = watch::channel(false);
        let observe = move |time_s: f64, event: &VehicleEvent| {
            if matches!(event, VehicleEvent::Planned { .. }) {
                let boot_ms = (1_000.0 * time_s).round() as u32;
                ticks.lock().unwrap_or_else(PoisonError::into_inner).insert(boot_ms, now());
            }
        };
        runtime.block_on(Box::pin(fly_observed(options, stopped, observe)))?;
        Ok(())
    };
    Ok(std::thread::Builder::new().name("vehicle".to_owned()).spawn(fly)?)
}

/// The milliseconds since boot in the two messages that carry the state.
fn boot_ms_of(message: &MavMessage) -> Option<u32> {
    match message {
        MavMessage::ATTITUDE_QUATERNION(data) => Some(data.time_boot_ms),
        MavMessage::LOCAL_POSITION_NED(data) => Some(data.time_boot_ms),
        _ => None,
    }
}

/// Receives with the ground's own links and model until the vehicle's flight has ended; returns the
/// latencies.
async fn receive(listening: LinkAddress, vehicle: Option<LinkAddress>) -> Result<Vec<Duration>, Failure> {
    let clock = Clock::start();
    let mut wire =
        Wire::open((GROUND, VEHICLE), vec![listening], None, clock, None, LogTime::Run(clock)).await?;
    let ticks = Ticks::default();
    // Over UDP the vehicle sends to the port that the system chose.
    let bound = wire.endpoints().next().map(ToString::to_string).unwrap_or_default();
    let vehicle = vehicle.map_or_else(|| bound.replace("udpin", "udpout").parse(), Ok)?;
    let vehicle = start_vehicle(vehicle, &ticks)?;
    let mut model = Model::new(Settings::on_screen(""));
    let mut latencies = Vec::new();
    let mut beat = tokio::time::interval(Duration::from_millis(100));
    while !vehicle.is_finished() {
        let msgs = tokio::select! {
            received = wire.receive() => wire.take(received),
            _ = beat.tick() => vec![Msg::Tick],
        };
        for msg in msgs {
            let boot_ms = match &msg {
                Msg::Frame(frame) => frame.decode().ok().as_ref().and_then(boot_ms_of),
                _ => None,
            };
            for action in update(&mut model, msg, clock.now()) {
                if let Action::Send(message) = action {
                    wire.send(&message, 0);
                }
            }
            let known_at = now();
            if let Some(was_at) = boot_ms.and_then(|boot_ms| state_was_at(&ticks, boot_ms)) {
                latencies.push(known_at.saturating_duration_since(was_at));
            }
        }
    }
    vehicle.join().map_err(|_panic| "the vehicle's thread has panicked")??;
    Ok(latencies)
}

/// The time at which the vehicle had the state of this time since boot, counted from the controller
/// tick before it.
fn state_was_at(ticks: &Ticks, boot_ms: u32) -> Option<Instant> {
    let ticks = ticks.lock().unwrap_or_else(PoisonError::into_inner);
    let (tick_ms, tick_at) = ticks.range(..=boot_ms).next_back()?;
    let since_ms = boot_ms - tick_ms;
    (since_ms < TICK_MS).then(|| *tick_at + Duration::from_millis(u64::from(since_ms)))
}

fn report(name: &str, mut latencies: Vec<Duration>) -> std::io::Result<()> {
    latencies.sort();
    let at = |percent: usize| {
        latencies.get((latencies.len().max(1) - 1) * percent / 100).copied().unwrap_or_default()
    };
    writeln!(
        std::io::stdout(),
        "{name:<14} {} values: median {:?}, 99 % within {:?}, worst {:?}",
        latencies.len(),
        at(50),
        at(99),
        at(100)
    )
}

fn main() -> Result<(), Failure> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let udp = runtime.block_on(receive("udpin:127.0.0.1:0".parse()?, None))?;
    report("udp", udp)?;
    for baud in [57_600, 115_200] {
        let line = SerialLine::new(baud);
        let (near, far) = (line.near_link().parse()?, line.far_link().parse()?);
        let serial = runtime.block_on(receive(far, Some(near)))?;
        report(&format!("serial {baud}"), serial)?;
    }
    Ok(())
}

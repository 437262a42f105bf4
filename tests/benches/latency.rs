//! From the plant's state to the screen's model: how old a value is when the ground knows it.
//!
//! `cargo bench -p e2e --bench latency`. A landing is flown in real time by the vehicle's own run loop; the ground's
//! own links and model receive it. At each controller tick the time is noted, and the state that a message carries is
//! dated from the tick before it by the message's time since boot. Both clocks are this process's one.

use std::collections::BTreeMap;
use std::io::Write as _;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use e2e::SerialLine;
use ground::app::clock::{Clock, LogTime};
use ground::app::wire::Wire;
use ground::model::{Model, Settings};
use ground::update::{Action, Msg, update};
use onboard_sim::fly::{FlyOptions, OnTheWire, Speed, fly_observed, load_profile};
use onboard_sim::vehicle::{DeadlinePolicy, VehicleEvent};
use protocol::dialect::MavMessage;
use protocol::transport::Endpoint;
use tokio::sync::watch;

type Failure = Box<dyn std::error::Error + Send + Sync>;
/// In flight the controller ticks this often, ms.
const TICK_MS: u32 = 100;

/// When each tick was, by milliseconds since boot.
type Ticks = Arc<Mutex<BTreeMap<u32, Instant>>>;

#[expect(clippy::disallowed_methods, reason = "a benchmark measures time")]
fn now() -> Instant {
    Instant::now()
}

/// Flies in a thread of its own, as a vehicle would.
fn start_vehicle(
    link: Endpoint,
    ticks: &Ticks,
) -> Result<std::thread::JoinHandle<Result<(), Failure>>, Failure> {
    let ticks = Arc::clone(ticks);
    let options = FlyOptions {
        system_id: 1,
        profile: load_profile("paper-calibrated")?,
        links: vec![link],
        key_file: None,
        recorder: None,
        on_the_wire: OnTheWire::drawn(),
        seed: 1,
        speed: Speed::Factor(1.0),
        auto_start: true,
        exit_when_safed: true,
        deadline_policy: DeadlinePolicy::Observe,
        log_clock: None,
    };
    let fly = move || -> Result<(), Failure> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        let (_stop, stopped) = watch::channel(false);
        let observe = move |time_s: f64, event: &VehicleEvent| {
            if matches!(event, VehicleEvent::Tick(_)) {
                let boot_ms = (1_000.0 * time_s).round() as u32;
                ticks.lock().unwrap_or_else(PoisonError::into_inner).insert(boot_ms, now());
            }
        };
        runtime.block_on(Box::pin(fly_observed(options, stopped, observe)))?;
        Ok(())
    };
    Ok(std::thread::Builder::new().name("vehicle".to_owned()).spawn(fly)?)
}

/// Milliseconds since boot of the two messages that carry the state.
fn boot_ms_of(message: &MavMessage) -> Option<u32> {
    match message {
        MavMessage::ATTITUDE_QUATERNION(data) => Some(data.time_boot_ms),
        MavMessage::LOCAL_POSITION_NED(data) => Some(data.time_boot_ms),
        _ => None,
    }
}

/// Receives with the ground's own links and model until the vehicle is silent for a while; returns the latencies.
async fn receive(listening: Endpoint, vehicle: Option<Endpoint>) -> Result<Vec<Duration>, Failure> {
    let clock = Clock::start();
    let mut wire =
        Wire::open(protocol::identity::GROUND, vec![listening], None, clock, None, LogTime::Run(clock))
            .await?;
    let ticks = Ticks::default();
    // Over UDP the vehicle speaks to the port that the system chose.
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
                    wire.send(&message);
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

/// When the state of this time since boot was: counted from the controller tick before it, in real time.
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
        let [near, far] = [&line.near, &line.far].map(|device| format!("serial:{}:{baud}", device.display()));
        let serial = runtime.block_on(receive(far.parse()?, Some(near.parse()?)))?;
        report(&format!("serial {baud}"), serial)?;
    }
    Ok(())
}

//! The embedded simulator for the demonstration: a vehicle in this process that sends and receives
//! over a real socket.
//!
//! It runs in its own thread with its own runtime, so that the screen cannot delay the vehicle.
//! Only the log is shared; telemetry and commands go over the link.

use std::io;
use std::thread::JoinHandle;
use std::time::Duration;

use protocol::log::recorder::Recorder;
use protocol::transport::LinkAddress;
use sim::wire::fly;
use sim::wire::fly::{FlyOptions, OnTheWire};
pub use sim::wire::fly::{LogClock, Speed};
use sim::wire::vehicle::RocketFlight;
use tokio::sync::{oneshot, watch};

use crate::cli::StationArgs;

/// How long to wait for the end of the simulator.
const STOP_WITHIN: Duration = Duration::from_secs(3);

const DEMO_SEED: u64 = 1;
/// Long enough to see what holds a countdown and to hold it: from 2 s before the release on nothing
/// does.
const QUICK_COUNTDOWN_S: f64 = 5.0;

/// What is simulated.
#[derive(Debug, Clone)]
pub struct DemoOptions {
    pub flight: RocketFlight,
    pub speed: Speed,
    pub system_id: u8,
}

impl DemoOptions {
    /// Reads the mission. One that has a launch begins on its pad, unless a start is given.
    ///
    /// # Errors
    /// There is no mission of that name, or it is invalid.
    pub fn load(args: &StationArgs) -> anyhow::Result<Self> {
        let mut flight = fly::load_flight(args.mission())?.starting_at(args.start)?;
        flight.recipe.seed = args.seed.unwrap_or(DEMO_SEED);
        // Without a named mission, the countdown that it sets is not waited for.
        if args.flags.mission.is_none() {
            flight.recipe = flight.recipe.counting_down(QUICK_COUNTDOWN_S)?;
        }
        let system_id = args.flags.link.vehicle().system_id;
        Ok(Self { flight, speed: args.speed.unwrap_or(Speed::Factor(1.0)), system_id })
    }
}

/// A running simulator.
pub struct Demo {
    stop: watch::Sender<bool>,
    pin_out: watch::Sender<bool>,
    ended: Option<oneshot::Receiver<Option<String>>>,
    thread: JoinHandle<()>,
}

impl Demo {
    /// Starts a vehicle that speaks to where the station listens, and sets `log_clock` to its time.
    ///
    /// # Errors
    /// The station does not listen on UDP, or the thread or its runtime cannot be started.
    pub fn start(
        options: &DemoOptions,
        station: Option<&LinkAddress>,
        recorder: Option<Recorder>,
        log_clock: LogClock,
    ) -> io::Result<Self> {
        let Some(LinkAddress::UdpIn(station)) = station else {
            return Err(io::Error::other("the demonstration listens on UDP alone"));
        };
        let (pin_out, pin) = watch::channel(true);
        let fly_options = FlyOptions {
            flight: options.flight.clone(),
            system_id: options.system_id,
            links: vec![LinkAddress::UdpOut(station.clone())],
            key_file: None,
            crew: None,
            recorder,
            on_the_wire: OnTheWire::drawn(),
            speed: options.speed,
            auto_start: false,
            exit_when_safed: false,
            board: None,
            pin_out: Some(pin),
            abort_file: None,
            log_clock: Some(log_clock),
        };
        let (stop, stopped) = watch::channel(false);
        let (tell, ended) = oneshot::channel();
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        let thread = std::thread::Builder::new().name("simulator".to_owned()).spawn(move || {
            let failure = runtime.block_on(fly::fly(fly_options, stopped)).err();
            // Fails only if the ground station itself has ended.
            let _ = tell.send(failure.map(|error| error.to_string()));
        })?;
        Ok(Self { stop, pin_out, ended: Some(ended), thread })
    }

    /// Moves the pin, as a person at the vehicle does.
    pub fn move_pin(&self, out: bool) {
        // Fails only if it has already ended.
        let _ = self.pin_out.send(out);
    }

    /// Waits until the simulator ends by itself and returns why, if it failed. After that it waits
    /// for ever.
    pub async fn ended(&mut self) -> Option<String> {
        match &mut self.ended {
            None => std::future::pending().await,
            Some(ended) => {
                let answer = ended.await;
                self.ended = None;
                // The sender is gone: the thread has panicked.
                answer.unwrap_or_else(|_gone| Some("it stopped unexpectedly".to_owned()))
            }
        }
    }

    /// Stops the simulator and waits for its last records.
    pub async fn stop(mut self) {
        // Fails only if it has already ended.
        let _ = self.stop.send(true);
        let ended = match self.ended.take() {
            None => true,
            Some(ended) => tokio::time::timeout(STOP_WITHIN, ended).await.is_ok(),
        };
        if ended {
            // `ended` has already reported a panic.
            let _ = self.thread.join();
        }
    }
}

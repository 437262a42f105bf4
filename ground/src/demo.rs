//! The embedded simulator: a vehicle in this process that speaks over a real socket.
//!
//! It runs in its own thread with its own runtime, so that the screen can never stall the vehicle. Only
//! the log is shared through memory; telemetry and commands go over the link.

use std::io;
use std::thread::JoinHandle;
use std::time::Duration;

use onboard_sim::fly::{self, FlyOptions, LoadedFlight, OnTheWire};
use onboard_sim::vehicle::DeadlinePolicy;
use protocol::log::recorder::Recorder;
use protocol::log::writer::LogHeader;
use protocol::transport::Endpoint;
use tokio::sync::{oneshot, watch};

pub use onboard_sim::fly::{LogClock, Speed};

/// How long the simulator's end is waited for.
const STOP_WITHIN: Duration = Duration::from_secs(3);

/// What is simulated.
#[derive(Debug, Clone)]
pub struct DemoOptions {
    /// What flies.
    pub profile: LoadedFlight,
    /// Seed of its dispersions.
    pub seed: u64,
    /// Speed of simulated time.
    pub speed: Speed,
    /// Its MAVLink system id.
    pub system_id: u8,
}

impl DemoOptions {
    /// Reads the profile or mission, once for the flight and its log.
    ///
    /// # Errors
    /// There is no such profile, or it is wrong.
    pub fn load(name_or_path: &str, seed: u64, speed: Speed, system_id: u8) -> anyhow::Result<Self> {
        Ok(Self { profile: fly::load_profile(name_or_path)?, seed, speed, system_id })
    }

    /// The header of the log that holds both sides.
    pub fn log_header(&self, start_unix_ns: u64) -> LogHeader {
        fly::log_header("ground", &self.profile, self.seed, start_unix_ns)
    }
}

/// A running simulator.
pub struct Demo {
    stop: watch::Sender<bool>,
    ended: Option<oneshot::Receiver<Option<String>>>,
    thread: JoinHandle<()>,
}

impl Demo {
    /// Starts a vehicle that speaks to `link` and sets `log_clock` to its time.
    ///
    /// # Errors
    /// The thread or its runtime cannot be made.
    pub fn start(
        options: &DemoOptions,
        link: Endpoint,
        recorder: Option<Recorder>,
        log_clock: LogClock,
    ) -> io::Result<Self> {
        let fly_options = FlyOptions {
            profile: options.profile.clone(),
            system_id: options.system_id,
            links: vec![link],
            key_file: None,
            recorder,
            on_the_wire: OnTheWire::drawn(),
            seed: options.seed,
            speed: options.speed,
            auto_start: false,
            exit_when_safed: false,
            deadline_policy: DeadlinePolicy::Observe,
            log_clock: Some(log_clock),
        };
        let (stop, stopped) = watch::channel(false);
        let (tell, ended) = oneshot::channel();
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        let thread = std::thread::Builder::new().name("simulator".to_owned()).spawn(move || {
            let failure = runtime.block_on(fly::fly(fly_options, stopped)).err();
            // Nobody listens any more only when the ground itself has ended.
            let _ = tell.send(failure.map(|error| error.to_string()));
        })?;
        Ok(Self { stop, ended: Some(ended), thread })
    }

    /// Waits until the simulator ends by itself; says why, if it failed. Waits forever once that was said.
    pub async fn ended(&mut self) -> Option<String> {
        match &mut self.ended {
            None => std::future::pending().await,
            Some(ended) => {
                let answer = ended.await;
                self.ended = None;
                // Gone without a word: its thread has panicked.
                answer.unwrap_or_else(|_gone| Some("it stopped unexpectedly".to_owned()))
            }
        }
    }

    /// Stops it and waits for its last records.
    pub async fn stop(mut self) {
        // Fails only if it has ended already.
        let _ = self.stop.send(true);
        let ended = match self.ended.take() {
            None => true,
            Some(ended) => tokio::time::timeout(STOP_WITHIN, ended).await.is_ok(),
        };
        if ended {
            // Whether it panicked was said by `ended`.
            let _ = self.thread.join();
        }
    }
}

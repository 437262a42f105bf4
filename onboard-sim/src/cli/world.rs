//! `onboard-sim world`: simulated flights whose flight computer is another process.

use std::io::Write as _;
use std::process::ExitCode;
use std::time::Duration;

use clap::Args;
use flight::vehicle::mission::StartPoint;
use hil::lockstep::Patience;
use hil::start::Pace;
use protocol::identity::Address;
use protocol::transport::LinkAddress;
use sim::dispersion::{self, Dispersion};
use sim::recipe::Recipe;
use simulated_vehicle::fly::OnTheWire;
use simulated_vehicle::hil::link::HilLink;
use simulated_vehicle::hil::report::FlightReport;
use simulated_vehicle::hil::world::{HilError, Manner, fly};

use super::fly::{WIND_MAX_M_S, with_wind};
use super::{mission_text, text_of};

/// A simulator's address (MAV_COMP_ID_ALL is not one): any but the vehicle's.
const WORLD: Address = Address { system_id: 254, component_id: 1 };

/// A frame that is not answered is sent again after this time: a plan takes some milliseconds, and up to a second in an
/// emulator.
const SEND_AGAIN_AFTER: Duration = Duration::from_millis(200);

#[derive(Args)]
pub(crate) struct WorldArguments {
    /// Link to the flight computer: udpout:HOST:PORT, udpin:ADDRESS:PORT, tcpout:HOST:PORT, tcpin:ADDRESS:PORT or
    /// serial:DEVICE:BAUD. Real time takes 480 kbaud.
    #[arg(long, value_name = "LINK")]
    link: LinkAddress,
    /// Built-in mission or TOML file. The flight computer must have the same text.
    #[arg(long, default_value = "mk2", value_name = "NAME|FILE")]
    profile: String,
    /// Where the flights begin: pad, apogee or drone, if the mission has that start [default: the mission's].
    #[arg(long, value_name = "START")]
    start: Option<StartPoint>,
    /// Built-in set of dispersions (thrust-only, field, harsh, real, real-harsh) or TOML file. The set must have sensors.
    #[arg(long, default_value = "field", value_name = "NAME|FILE")]
    dispersion: String,
    /// Mean wind 10 m above the ground, m/s, instead of the set's.
    #[arg(long, value_name = "M_S")]
    wind: Option<f64>,
    /// Seed of everything random.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Number of the first flight.
    #[arg(long, default_value_t = 0, value_name = "NUMBER")]
    first: u64,
    /// Number of flights.
    #[arg(long, default_value_t = 1, value_name = "N")]
    flights: u64,
    /// Send a frame every 5 ms and wait for no answer, instead of waiting for each.
    #[arg(long)]
    real_time: bool,
    /// Fly each flight in this process, too, and compare memory and commands of both computers in each frame.
    #[arg(long, conflicts_with = "real_time")]
    compare: bool,
    /// Give up after this time without an answer, s.
    #[arg(long, value_name = "S", default_value_t = 10)]
    give_up: u64,
}

pub(crate) fn run(arguments: WorldArguments) -> anyhow::Result<ExitCode> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    runtime.block_on(fly_all(arguments))
}

fn recipe(arguments: &WorldArguments) -> anyhow::Result<Recipe> {
    let mission_toml = mission_text(&arguments.profile, arguments.start)?;
    let mut toml = text_of(&arguments.dispersion, dispersion::BUILTIN, "set of dispersions")?;
    if let Some(wind_m_s) = arguments.wind {
        anyhow::ensure!(
            (0.0..=WIND_MAX_M_S).contains(&wind_m_s),
            "--wind {wind_m_s}: must be 0 to {WIND_MAX_M_S} m/s"
        );
        toml = with_wind(&toml, wind_m_s);
    }
    let toml = Dispersion::toml_with_wire_resolution(&toml, &arguments.dispersion)?;
    let mission = (arguments.profile.as_str(), mission_toml.as_str());
    let recipe = Recipe::from_texts(mission, (&arguments.dispersion, &toml))?;
    Ok(Recipe { seed: arguments.seed, ..recipe })
}

async fn fly_all(arguments: WorldArguments) -> anyhow::Result<ExitCode> {
    let recipe = recipe(&arguments)?;
    let mut link = HilLink::open(arguments.link.clone(), WORLD).await?;
    let manner = Manner {
        pace: if arguments.real_time { Pace::RealTime } else { Pace::Lockstep },
        patience: Patience {
            send_again_after: SEND_AGAIN_AFTER,
            give_up_after: Duration::from_secs(arguments.give_up),
        },
        compare: arguments.compare,
    };
    let mut out = std::io::stdout();
    writeln!(out, "world at {}", link.address())?;
    let mut total = Total::default();
    let first_id = OnTheWire::drawn().boot_number.get();
    for number in arguments.first..arguments.first.saturating_add(arguments.flights) {
        let flight_id = first_id.wrapping_add((number - arguments.first) as u32);
        let report = match Box::pin(fly(&mut link, &recipe, number, flight_id, &manner)).await {
            Err(error @ (HilError::NoComputer { .. } | HilError::Silent { .. } | HilError::LinkEnded)) => {
                writeln!(out, "flight {number}: LINK LOST: {error}")?;
                return Ok(ExitCode::from(5));
            }
            flown => flown?,
        };
        writeln!(out, "{report}")?;
        total.add(&report);
    }
    total.say(&mut out, arguments.compare)?;
    Ok(if total.identical == total.flights { ExitCode::SUCCESS } else { ExitCode::from(3) })
}

#[derive(Default)]
struct Total {
    flights: u64,
    legs: u64,
    strict: u64,
    identical: u64,
    frames: u64,
    identical_frames: u64,
}

impl Total {
    fn add(&mut self, report: &FlightReport) {
        self.flights += 1;
        self.legs += u64::from(report.outcome.legs);
        self.strict += u64::from(report.outcome.strict);
        self.identical += u64::from(report.is_identical());
        self.frames += report.frames;
        self.identical_frames += report.identical.unwrap_or(0);
    }

    fn say(&self, out: &mut impl std::io::Write, compared: bool) -> std::io::Result<()> {
        let Self { flights, legs, strict, identical, frames, identical_frames } = self;
        writeln!(out, "{legs} of {flights} landed on their legs, {strict} inside Table 2")?;
        if compared {
            writeln!(
                out,
                "{identical_frames} of {frames} frames and {identical} of {flights} flights identical"
            )?;
        }
        Ok(())
    }
}

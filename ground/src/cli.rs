//! The command line: every command, flag and help text.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::str::FromStr;
use std::time::Duration;

use clap::builder::NonEmptyStringValueParser;
use clap::{Args, Parser, Subcommand};
use protocol::dialect::TdPhase;
use protocol::identity::{Address, GROUND, VEHICLE};
use protocol::program::{EXIT_CODES, Manual, Shown, in_range};
use protocol::transport::{LinkAddress, LinkAddressError};
use serde::Deserialize;
use sim::wire::fly::{Speed, StartPoint};

use crate::model::words;

const EXAMPLES: &str = "\
Examples:
  ground
  ground --connect serial:/dev/ttyUSB0:57600 --key touchdown.key
  ground --replay last";

/// Terminal ground station for a rocket that lands on its own thrust.
///
/// Without --connect it always flies a demonstration: a simulated vehicle in this process, from its
/// pad to touchdown, with real MAVLink over a loopback UDP socket. On a terminal it shows the full
/// screen (? lists the keys). Without a terminal it prints one line per event and the landing
/// verdict; the exit code reports how the flight ended. Colours, voice and bell stand in the
/// settings (`ground config example`).
#[derive(Debug, Clone, Parser)]
#[command(name = "ground", version, after_help = format!("{EXAMPLES}\n\n{EXIT_CODES}"), args_conflicts_with_subcommands = true)]
pub struct Cli {
    /// What to run instead of a station with its screen.
    #[command(subcommand)]
    pub command: Option<Command>,

    #[command(flatten)]
    pub station: StationArgs,

    /// Show a recorded flight (MCAP or .tlog) on the same screens instead; `last` is the newest
    /// touchdown-*.mcap in the current directory that has a vehicle.
    #[arg(long, value_name = "FILE|last", conflicts_with_all = ["connect", "log", "auto", "mission", "start", "seed", "speed"], help_heading = "Replay")]
    pub replay: Option<PathBuf>,

    /// Replay: where to start: seconds since the first frame, or a phase such as `POWERED`.
    #[arg(long, value_name = "SECONDS|PHASE", requires = "replay", help_heading = "Replay")]
    pub from: Option<ReplayFrom>,

    /// Print lines instead of the full screen, even on a terminal.
    #[arg(long, help_heading = "Without a screen")]
    pub headless: bool,

    /// Print how the flight ended and where the log is, as one JSON object, and nothing else;
    /// without a screen.
    #[arg(long, conflicts_with = "replay", help_heading = "Without a screen")]
    pub json: bool,

    /// Without a screen: give up if the flight has not ended after this time.
    ///
    /// Default: 120 s if the flight is started automatically, otherwise never.
    #[arg(long, value_name = "SECONDS", value_parser = seconds, allow_negative_numbers = true, help_heading = "Without a screen")]
    pub timeout_s: Option<Duration>,

    #[command(flatten)]
    pub shown: Shown,
}

/// The settings file.
#[derive(Debug, Clone, Args)]
pub struct ConfigArgs {
    /// Settings file (TOML); `ground config example` prints one.
    ///
    /// Default: touchdown/ground.toml in $XDG_CONFIG_HOME or ~/.config, if there is one.
    #[arg(long, value_name = "FILE", help_heading = "Station")]
    pub config: Option<PathBuf>,
}

/// Who acts.
#[derive(Debug, Clone, Default, PartialEq, Eq, Args)]
pub struct OperatorArgs {
    /// Who sits at this screen, for the log. Default: the user.
    #[arg(long, value_name = "NAME", value_parser = NonEmptyStringValueParser::new(), help_heading = "Link and vehicle")]
    pub operator: Option<String>,
}

/// The socket of a station.
#[derive(Debug, Clone, Default, PartialEq, Eq, Args)]
pub struct SocketArgs {
    /// Socket between a station and its screens. Default: one socket per station; `ground status`
    /// lists them.
    #[arg(long, value_name = "PATH", help_heading = "Station")]
    pub socket: Option<PathBuf>,
}

/// The links to the vehicle, and whose frames they carry.
#[derive(Debug, Clone, Default, PartialEq, Eq, Args)]
#[command(next_help_heading = "Link and vehicle")]
pub struct LinkArgs {
    /// Link to a vehicle: udpin:ADDRESS:PORT, udpout:HOST:PORT, tcpin:ADDRESS:PORT,
    /// tcpout:HOST:PORT or serial:DEVICE:BAUD; may be given more than once for several links to the
    /// same vehicle.
    #[arg(long, value_name = "LINK")]
    pub connect: Vec<LinkAddress>,

    /// This station's own MAVLink system id; every station on a link needs a different one.
    /// Default: 255.
    #[arg(long, value_name = "ID", value_parser = in_range(1..=u8::MAX))]
    pub sysid: Option<u8>,

    /// MAVLink system id of the vehicle to show and command; other systems are ignored. Default: 1;
    /// for a replay the first vehicle in the log.
    #[arg(long, value_name = "ID", value_parser = in_range(1..=u8::MAX))]
    pub vehicle_sysid: Option<u8>,

    /// Sign every frame with this key, and accept only frames signed with it. `onboard-sim keygen`
    /// creates a key.
    #[arg(long, value_name = "FILE")]
    pub key: Option<PathBuf>,

    /// People who may command (TOML), as the vehicle has them; --operator says who sits here, --key
    /// is the key that all share. Without the name of somebody who has a key this station only
    /// looks on.
    #[arg(long, value_name = "FILE")]
    pub crew: Option<PathBuf>,

    #[command(flatten)]
    pub operator: OperatorArgs,
}

/// The host and port of a listener.
fn listener(given: &str) -> Result<String, String> {
    match given.parse() {
        Ok(LinkAddress::UdpOut(host)) => Ok(host),
        _ => Err("give udpout:HOST:PORT".to_owned()),
    }
}

/// The flags of a station that are keys of its settings file, too.
#[derive(Debug, Clone, Default, PartialEq, Eq, Parser)]
pub struct Flags {
    #[command(flatten)]
    pub link: LinkArgs,

    #[command(flatten)]
    pub socket: SocketArgs,

    /// The mission, built-in name or file. The demonstration flies it; default: mk3. A vehicle over
    /// --connect has to fly it: arming is refused if it flies another one.
    #[arg(long, value_name = "NAME|FILE", alias = "profile", help_heading = "Station")]
    pub mission: Option<String>,

    /// Checklist (TOML): arming is refused until every step is signed. `checklist-example.toml` is
    /// one.
    #[arg(long, value_name = "FILE", help_heading = "Station")]
    pub checklist: Option<PathBuf>,

    /// This station's own position, for the way to a lost vehicle: gpsd://HOST:PORT, or a receiver
    /// that sends NMEA 0183 over serial:DEVICE:BAUD, tcpout:HOST:PORT or udpin:ADDRESS:PORT.
    #[arg(long, value_name = "SOURCE", help_heading = "Station")]
    pub position: Option<PositionSource>,

    /// Log to write (MCAP), or `none`. An existing file is kept: the log then gets the next free
    /// name, and says so.
    ///
    /// Default: touchdown-YYYYMMDD-HHMMSS.mcap (UTC) in the current directory.
    #[arg(long, value_name = "FILE|none", help_heading = "Station")]
    pub log: Option<LogChoice>,

    /// Serve the decoded records of the log live to Foxglove or Lichtblick, over a WebSocket at
    /// this address; port 0 is any free one. Whoever can connect can read, and nobody can command.
    #[arg(long, value_name = "ADDRESS:PORT", help_heading = "Station")]
    pub foxglove: Option<SocketAddr>,

    /// Forward every received frame to udpout:HOST:PORT, for a map, an antenna tracker or an
    /// overlay; may be given more than once. One way: what comes back is never read.
    #[arg(long, value_name = "LINK", value_parser = listener, help_heading = "Station")]
    pub forward: Vec<String>,
}

/// What holds the links, with or without a screen.
#[derive(Debug, Clone, Args)]
pub struct StationArgs {
    #[command(flatten)]
    pub flags: Flags,

    #[command(flatten)]
    pub config: ConfigArgs,

    /// Where the demonstration begins: pad, apogee or drone, if the mission has that start.
    /// Default: the pad, if it has one. With --connect and --mission: where that flight should
    /// begin; arming is refused if it begins elsewhere.
    #[arg(long, value_name = "START", help_heading = "Demonstration")]
    pub start: Option<StartPoint>,

    /// Demonstration: seed of its dispersions. Default: 1.
    #[arg(long, value_name = "NUMBER", conflicts_with = "connect", value_parser = in_range(0..=u64::MAX), help_heading = "Demonstration")]
    pub seed: Option<u64>,

    /// Demonstration: speed of simulated time, a factor or `max`. Default: 1.
    #[arg(long, value_name = "FACTOR|max", conflicts_with = "connect", help_heading = "Demonstration")]
    pub speed: Option<Speed>,

    /// Arm and start automatically; only with a simulated vehicle. The demonstration without a
    /// screen always does.
    #[arg(long, help_heading = "Demonstration")]
    pub auto: bool,
}

/// The commands of `ground` besides a station with its screen.
#[derive(Debug, Clone, Subcommand)]
pub enum Command {
    /// A station without a screen: holds the link, records, and serves screens until `ground stop`
    /// or SIGTERM ends it.
    ///
    /// It keeps running when its screens close and when the session that started it ends.
    #[command(after_help = "Example: ground daemon --connect serial:/dev/ttyUSB0:57600 --log flight.mcap")]
    Daemon {
        #[command(flatten)]
        station: Box<StationArgs>,
    },
    /// A screen for a station in another process on this machine. Quitting does not affect the
    /// station.
    #[command(after_help = "Examples:\n  ground attach\n  ground attach --watch")]
    Attach(AttachArgs),
    /// Fetch the log that the vehicle has written itself, over --connect, when it is disarmed on
    /// the ground.
    ///
    /// The log is checked; a file that exists is kept, and it gets the next free name. What has
    /// arrived is kept: the same command goes on with it. A station that holds a serial line has to
    /// end first.
    #[command(
        after_help = "Example: ground download --connect serial:/dev/ttyUSB0:57600 --key touchdown.key --out logs"
    )]
    Download(DownloadArgs),
    /// List your stations: socket, process, link, vehicle, phase, log and screens.
    #[command(after_help = "Examples:\n  ground status\n  ground status --json")]
    Status {
        /// As JSON.
        #[arg(long)]
        json: bool,
    },
    /// End a station. This is refused while its vehicle is armed or in flight.
    #[command(after_help = "Examples:\n  ground stop\n  ground stop --force")]
    Stop {
        /// End it even while the vehicle is armed or in flight; the vehicle is not affected.
        #[arg(long)]
        force: bool,
        #[command(flatten)]
        socket: SocketArgs,
    },
    /// Check the settings file or print an example.
    #[command(after_help = "Example: ground config check")]
    Config {
        /// Check the file, or print an example.
        #[command(subcommand)]
        command: ConfigCommand,
    },
    #[command(flatten)]
    Manual(Manual),
}

/// A screen for a station in another process.
#[derive(Debug, Clone, Args)]
pub struct AttachArgs {
    /// Show only; command nothing.
    #[arg(long)]
    pub watch: bool,
    #[command(flatten)]
    pub socket: SocketArgs,
    #[command(flatten)]
    pub operator: OperatorArgs,
    #[command(flatten)]
    pub config: ConfigArgs,
}

/// The vehicle's own log, over a link of its own.
#[derive(Debug, Clone, Args)]
pub struct DownloadArgs {
    /// File on the vehicle. Default: its newest log.
    #[arg(value_name = "NAME")]
    pub name: Option<String>,
    /// Folder to write into.
    #[arg(long, alias = "to", value_name = "FOLDER", default_value = ".")]
    pub out: PathBuf,
    #[command(flatten)]
    pub link: LinkArgs,
    #[command(flatten)]
    pub config: ConfigArgs,
}

/// What can be done with the settings.
#[derive(Debug, Clone, PartialEq, Eq, Subcommand)]
pub enum ConfigCommand {
    /// Check the settings.
    #[command(after_help = "Examples:\n  ground config check\n  ground config check field.toml")]
    Check {
        /// The file. Default: the usual one.
        #[arg(value_name = "FILE")]
        file: Option<PathBuf>,
    },
    /// Print a file with every key, its meaning and its default.
    #[command(after_help = "Example: ground config example")]
    Example,
}

impl LinkArgs {
    /// Our own MAVLink address.
    pub fn us(&self) -> Address {
        self.sysid.map_or(GROUND, |id| GROUND.of_system(id))
    }

    /// The vehicle's MAVLink address.
    pub fn vehicle(&self) -> Address {
        self.vehicle_sysid.map_or(VEHICLE, |id| VEHICLE.of_system(id))
    }
}

impl StationArgs {
    /// What the demonstration flies: a built-in name or a file.
    pub fn mission(&self) -> &str {
        self.flags.mission.as_deref().unwrap_or(sim::wire::fly::DEFAULT_MISSION)
    }

    /// Whether the flags describe a demonstration, so that links in the settings do not apply.
    pub fn describes_demonstration(&self) -> bool {
        (self.start.is_some() && self.flags.mission.is_none()) || self.seed.is_some() || self.speed.is_some()
    }

    /// Whether the automatic mode starts the flight.
    pub fn starts_by_itself(&self, interactive: bool) -> bool {
        self.auto || (self.flags.link.connect.is_empty() && !interactive)
    }
}

// The values that flags take, and how their text is parsed.

/// The source of the station's own position.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PositionSource {
    pub link: LinkAddress,
    /// It is queried for its reports, as gpsd expects.
    pub is_gpsd: bool,
}

impl FromStr for PositionSource {
    type Err = String;

    fn from_str(given: &str) -> Result<Self, String> {
        let gpsd = given.strip_prefix("gpsd://").map(|host| format!("tcpout:{host}"));
        let link = gpsd.as_deref().unwrap_or(given).parse();
        let accepted = "gpsd://HOST:PORT, serial:DEVICE:BAUD, tcpout:HOST:PORT or udpin:ADDRESS:PORT";
        let wrong = |_: LinkAddressError| format!("`{given}` is no source of positions; give {accepted}");
        Ok(Self { link: link.map_err(wrong)?, is_gpsd: gpsd.is_some() })
    }
}

/// Where the log goes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LogChoice {
    /// No log.
    None,
    /// This file.
    File(PathBuf),
}

impl FromStr for LogChoice {
    type Err = String;

    fn from_str(given: &str) -> Result<Self, String> {
        match given {
            "" => Err("the name of the log is empty; give a file or `none`".to_owned()),
            "none" => Ok(Self::None),
            path => Ok(Self::File(PathBuf::from(path))),
        }
    }
}

/// Where a replay begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ReplayFrom {
    /// Time since the first frame.
    Time(Duration),
    /// The start of this phase.
    Phase(TdPhase),
}

impl FromStr for ReplayFrom {
    type Err = String;

    fn from_str(given: &str) -> Result<Self, String> {
        if let Some(phase) = words::phase_from_name(given) {
            return Ok(Self::Phase(phase));
        }
        match given.parse::<f64>() {
            Ok(seconds) if (0.0..=1e6).contains(&seconds) => Ok(Self::Time(Duration::from_secs_f64(seconds))),
            _ => Err(format!(
                "`{given}` is neither a number of seconds from 0 to 1000000 nor a phase such as POWERED"
            )),
        }
    }
}

/// A time from its seconds.
///
/// # Errors
/// It is no number, or too short or too long.
pub fn seconds(given: &str) -> Result<Duration, String> {
    match given.parse::<f64>() {
        Ok(seconds) if (0.1..=86_400.0).contains(&seconds) => Ok(Duration::from_secs_f64(seconds)),
        _ => Err(format!("`{given}` is not a number of seconds from 0.1 to 86400")),
    }
}

/// What the terminal can show.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Characters {
    /// Decide by the environment
    #[default]
    Auto,
    /// Unicode characters
    Unicode,
    /// Only ASCII characters
    Ascii,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory as _;
    use clap::error::ErrorKind;

    #[test]
    fn the_definition_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn help_names_every_option_and_exit_code() {
        let help = Cli::command().render_long_help().to_string();
        for word in [
            "--connect",
            "--key",
            "--crew",
            "--mission",
            "--checklist",
            "--sysid",
            "--vehicle-sysid",
            "--log",
            "--start",
            "--seed",
            "--speed",
            "--auto",
            "--headless",
            "--json",
            "--timeout-s",
        ] {
            assert!(help.contains(word), "{word}");
        }
        assert!(help.contains(EXIT_CODES));
    }

    #[test]
    fn wrong_values_are_refused_with_what_would_do() {
        let refuse = |arguments: &[&str]| Cli::try_parse_from([&["ground"], arguments].concat()).unwrap_err();
        for (wrong, what_would_do) in [
            (["--connect", "tcp:host:1"], "udpin:ADDRESS:PORT"),
            (["--forward", "tcpout:host:1"], "udpout:HOST:PORT"),
            (["--timeout-s", "-1"], "from 0.1 to 86400"),
            (["--sysid", "0"], "from 1 to 255"),
            (["--speed", "0"], "0.01"),
        ] {
            let refused = refuse(&wrong);
            assert_eq!(refused.kind(), ErrorKind::ValueValidation, "{wrong:?}");
            assert!(refused.to_string().contains(what_would_do), "{refused}");
        }
        let both = ["--connect", "udpin:0.0.0.0:14550", "--seed", "2"];
        assert_eq!(refuse(&both).kind(), ErrorKind::ArgumentConflict);
    }

    #[test]
    fn a_demonstration_without_a_screen_starts_by_itself() {
        let demo = Cli::try_parse_from(["ground"]).unwrap().station;
        assert_eq!(demo.mission(), "mk3");
        assert!(demo.starts_by_itself(false) && !demo.starts_by_itself(true));
        let live = Cli::try_parse_from(["ground", "--connect", "udpin:0.0.0.0:14550"]).unwrap().station;
        assert!(!live.starts_by_itself(false));
    }

    #[test]
    fn a_command_has_the_flags_that_it_uses() {
        let flags = |name: &str| -> Vec<String> {
            let command = Cli::command().find_subcommand(name).unwrap().clone();
            command.get_arguments().filter_map(|argument| argument.get_long().map(str::to_owned)).collect()
        };
        assert_eq!(flags("stop"), ["force", "socket"]);
        assert_eq!(flags("status"), ["json"]);
        let link = ["out", "connect", "sysid", "vehicle-sysid", "key", "crew", "operator", "config"];
        assert_eq!(flags("download"), link);
        assert!(Cli::try_parse_from(["ground", "--timeout-s", "3", "attach"]).is_err());
    }
}

//! `onboard-sim computer`: a flight computer whose world is another process.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use anyhow::Context as _;
use clap::Args;
use flight::vehicle::mission::StartPoint;
use hil::computer::Counts;
use hil::start::Pace;
use protocol::identity::VEHICLE;
use protocol::transport::LinkAddress;
use simulated_vehicle::hil::computer::{ComputerEnd, Event};
use simulated_vehicle::hil::link::{Brought, HilLink};

use super::fly::interrupted;
use super::mission_text;

#[derive(Args)]
pub(crate) struct ComputerArguments {
    /// Link to the world: udpin:ADDRESS:PORT, udpout:HOST:PORT, tcpin:ADDRESS:PORT, tcpout:HOST:PORT or
    /// serial:DEVICE:BAUD.
    #[arg(long, value_name = "LINK")]
    link: LinkAddress,
    /// Built-in mission or TOML file. The world must have the same text.
    #[arg(long, default_value = "mk2", value_name = "NAME|FILE")]
    profile: String,
    /// Where the flights begin: pad, apogee or drone, if the mission has that start [default: the mission's].
    #[arg(long, value_name = "START")]
    start: Option<StartPoint>,
    /// Keep what a computer needs after a reset in FILE-0 and FILE-1, written in turn after every frame, and go on from
    /// them: a computer that is started again in flight flies on.
    #[arg(long, value_name = "FILE")]
    saved: Option<PathBuf>,
}

/// The two files that are written in turn, so that a reset while one is written leaves the other.
struct Slots([PathBuf; 2]);

impl Slots {
    fn of(file: &Path) -> Self {
        Self(["-0", "-1"].map(|end| {
            let mut name = file.as_os_str().to_owned();
            name.push(end);
            name.into()
        }))
    }

    /// What is there; at the first start nothing.
    fn read(&self) -> anyhow::Result<Vec<Vec<u8>>> {
        let mut found = Vec::new();
        for slot in &self.0 {
            match std::fs::read(slot) {
                Ok(bytes) => found.push(bytes),
                Err(error) if error.kind() == std::io::ErrorKind::NotFound => {}
                Err(error) => return Err(error).with_context(|| slot.display().to_string()),
            }
        }
        Ok(found)
    }

    fn write(&self, frame: u64, record: &[u8]) -> anyhow::Result<()> {
        let slot = &self.0[(frame % 2) as usize];
        std::fs::write(slot, record).with_context(|| slot.display().to_string())
    }
}

pub(crate) fn run(arguments: ComputerArguments) -> anyhow::Result<ExitCode> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    runtime.block_on(answer(arguments))
}

async fn answer(arguments: ComputerArguments) -> anyhow::Result<ExitCode> {
    let mission_toml = mission_text(&arguments.profile, arguments.start)?;
    let mission = vehicles::mission::from_toml(&mission_toml, &arguments.profile)?;
    let slots = arguments.saved.as_deref().map(Slots::of);
    let kept = slots.as_ref().map_or(Ok(Vec::new()), Slots::read)?;
    let (mut end, resumed_after) =
        ComputerEnd::new(&mission, &mission_toml).resumed(kept.iter().map(Vec::as_slice));
    if let Some(frame) = resumed_after {
        say(&format!("goes on behind frame {frame}"));
    }
    let mut link = HilLink::open(arguments.link, VEHICLE).await?;
    writeln!(std::io::stdout(), "computer at {}", link.address())?;
    let mut stopped = std::pin::pin!(interrupted());
    let mut heartbeat = tokio::time::interval(Duration::from_secs(1));
    heartbeat.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Skip);
    loop {
        let brought = tokio::select! {
            () = &mut stopped => break,
            _ = heartbeat.tick() => {
                link.send(&[end.heartbeat()]);
                continue;
            }
            brought = link.receive() => brought,
        };
        let messages = match brought {
            None => break,
            Some(Brought::Up(peer)) => {
                say(&format!("link up: {peer}"));
                continue;
            }
            Some(Brought::Down(why)) => {
                say(&format!("link down: {why}"));
                continue;
            }
            Some(Brought::Messages(messages)) => messages,
        };
        for message in messages {
            let mut out = Vec::new();
            for event in end.take(&message, &mut out) {
                say(&words(&event));
            }
            if !out.is_empty() {
                // First: a command that was sent is never newer than what is known of it after a reset.
                if let (Some(slots), Some((frame, record))) = (&slots, end.kept()) {
                    slots.write(frame, &record)?;
                }
                link.send(&out);
            }
        }
    }
    if let Some((flight_id, counts)) = end.counts() {
        say(&format!(
            "flight {flight_id:08x}: {}; frames with a lost part: {}",
            frames(counts),
            end.broken()
        ));
    }
    Ok(ExitCode::SUCCESS)
}

/// A closed pipe must not end a flight.
fn say(words: &str) {
    let _ = writeln!(std::io::stdout(), "{words}");
}

fn words(event: &Event) -> String {
    match event {
        Event::Began { flight_id, pace: Pace::Lockstep } => {
            format!("flight {flight_id:08x} begins in lockstep")
        }
        Event::Began { flight_id, pace: Pace::RealTime } => {
            format!("flight {flight_id:08x} begins in real time")
        }
        Event::Ended { flight_id, counts } => format!("flight {flight_id:08x}: {}", frames(counts)),
        Event::OtherMission { theirs, ours } => {
            format!("not answered: the world flies the mission {theirs}, this computer {ours}")
        }
    }
}

fn frames(counts: &Counts) -> String {
    let Counts { flown, held, repeated, late, ahead, foreign } = counts;
    format!(
        "{flown} frames flown, {held} lost ones with the last inertial sample; doubled {repeated}, late {late}, too early \
         {ahead}, of other flights {foreign}"
    )
}

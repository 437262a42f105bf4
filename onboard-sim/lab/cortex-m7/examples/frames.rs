//! Writes a recorded flight as the stream that a board reads (the file `frames` of a folder), and
//! its recorded decisions as the answers to be expected (`recorded`).
//!
//! `cargo run --release -p board --example frames -- LOG FOLDER` in `onboard-sim/lab`

use std::path::PathBuf;

use anyhow::{bail, ensure};
use avionics::board::stream::{Answer, Begin, Frame, put};
use onboard_sim::files::write_folder;
use protocol::log::computer_v1::{ComputerFrame, ComputerStart};
use replay::controller::SETTINGS_IN_FLIGHT;
use replay::log::{Entry, FlightLog};

fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args_os().skip(1).map(PathBuf::from);
    let (Some(log), Some(folder)) = (arguments.next(), arguments.next()) else {
        bail!("which LOG and FOLDER?")
    };
    let mut log = FlightLog::open(&log)?;
    let (mut begin, mut frames, mut recorded, mut written) = (None, Vec::new(), Vec::new(), 0);
    while let Some(stamped) = log.next_entry()? {
        match stamped.entry {
            // The computer of a flight from power-up needs no other start.
            Entry::ComputerStart(start) if start.released && written > 0 => {}
            Entry::ComputerStart(start) => {
                ensure!(begin.is_none() && written == 0, "{} has more than one flight", log.name());
                begin = Some(beginning(&log, *start)?);
            }
            Entry::ComputerFrame(frame) => {
                ensure!(begin.is_some() || written > 0, "{}: the start of its flight is missing", log.name());
                let ComputerFrame { input, output, state_digest } = frame.record;
                let frame = input.frame;
                put(&Frame { input, begin: begin.take() }, &mut frames);
                put(&Answer { frame, output, state_digest, radio: None }, &mut recorded);
                written += 1;
            }
            Entry::Unreadable { .. } => bail!("{} has a record that this build cannot read", log.name()),
            _ => {}
        }
    }
    ensure!(log.damage().is_none(), "{} is damaged", log.name());
    ensure!(written > 0, "{} has no frames of a flight computer from its start on", log.name());
    Ok(write_folder(&folder, &[("frames", frames), ("recorded", recorded)])?)
}

/// What the computer of a log is built from, besides its record of the start.
fn beginning<R: std::io::Read>(log: &FlightLog<R>, start: ComputerStart) -> anyhow::Result<Begin> {
    let head = log.head();
    ensure!(!head.run.contains_key(SETTINGS_IN_FLIGHT), "{}: settings were changed in flight", log.name());
    let Some(Ok(toml)) = &head.profile_toml else { bail!("{} has no mission", log.name()) };
    Ok(Begin { toml: toml.clone(), start, on_the_air: None, flight: 0 })
}

//! The flight computer as a process, and a comparison of the answers of several machines.
#![expect(clippy::print_stdout, reason = "what it found")]

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, BufReader, Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::mpsc::{Receiver, TrySendError, sync_channel};
use std::thread;

use anyhow::{Context as _, Result, ensure};
use avionics::board::radio::Radio;
use avionics::board::recorded::{Board, VehicleKind};
use avionics::board::stream::{Answer, Reader};
use clap::{Parser, Subcommand};

/// The flight computer as a program for a board.
#[derive(Parser)]
#[command(name = "board", after_help = "Example: board fly < frames > answers")]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Fly a recorded flight: frames from standard input, answers to standard output
    #[command(after_help = "Example: board fly < frames > answers")]
    Fly {
        /// Serial device of the radio, if the flight has a crew
        #[arg(long, value_name = "DEVICE")]
        radio: Option<PathBuf>,
    },
    /// Compare what machines answered in recorded flights with what was recorded, frame by frame
    ///
    /// Each folder is a flight: the file `recorded`, and a file for each machine, with its name.
    /// Exit codes: 0 all frames identical, 1 error, 2 usage, 3 a frame differs.
    #[command(after_help = "Example: board compare --machine x86-64 --machine aarch64 flights/0 flights/1")]
    Compare {
        /// A machine; may be repeated
        #[arg(long, value_name = "NAME", required = true)]
        machine: Vec<String>,
        #[arg(required = true)]
        folders: Vec<PathBuf>,
    },
    /// Say what frames and plans cost, from the files `costs` of flights on a Cortex-M7
    #[command(after_help = "Example: board costs flights/0 flights/1")]
    Costs {
        #[arg(required = true)]
        folders: Vec<PathBuf>,
    },
}

pub(super) fn main() -> ExitCode {
    let done = match Cli::parse().command {
        Command::Fly { radio } => fly_standard_input(radio.as_deref()).map(|()| ExitCode::SUCCESS),
        Command::Compare { machine, folders } => compare(&machine, &folders),
        Command::Costs { folders } => costs(&folders).map(|()| ExitCode::SUCCESS),
    };
    done.unwrap_or_else(|error| {
        eprintln!("board: {error:#}");
        ExitCode::FAILURE
    })
}

/// Largest number of bytes that may wait for the next frame: a second of a fast radio.
const MOST_WAITING_BYTES: usize = 8 * 1024;

/// A serial device, read by a thread.
struct Serial {
    arrived: Receiver<u8>,
    device: File,
}

impl Serial {
    fn open(path: &Path) -> io::Result<Self> {
        let device = File::options().read(true).write(true).open(path)?;
        let (sender, arrived) = sync_channel(MOST_WAITING_BYTES);
        let reading = device.try_clone()?;
        thread::Builder::new().name("radio".into()).spawn(move || {
            for byte in BufReader::new(reading).bytes() {
                let Ok(byte) = byte else { return };
                // Bytes without room are dropped.
                if let Err(TrySendError::Disconnected(_)) = sender.try_send(byte) {
                    return;
                }
            }
        })?;
        Ok(Self { arrived, device })
    }
}

impl Radio for Serial {
    fn read(&mut self, into: &mut [u8]) -> usize {
        into.iter_mut().zip(self.arrived.try_iter()).map(|(place, byte)| *place = byte).count()
    }

    fn write(&mut self, bytes: &[u8]) {
        // Bytes that cannot be sent are dropped.
        let _ = self.device.write_all(bytes);
    }
}

fn fly_standard_input(radio: Option<&Path>) -> Result<()> {
    let mut radio = match radio {
        None => None,
        Some(path) => Some(Serial::open(path).with_context(|| path.display().to_string())?),
    };
    let (mut from_world, mut to_world) = (io::stdin().lock(), io::stdout().lock());
    let (mut board, mut arrived, mut answers) = (Board::new(VehicleKind::Simulated), [0; 4096], Vec::new());
    loop {
        let read = from_world.read(&mut arrived)?;
        if read == 0 {
            break;
        }
        let mut answer = |bytes: &[u8]| answers.extend_from_slice(bytes);
        let flown = match &mut radio {
            None => board.take(&arrived[..read], &mut (), &mut (), &mut answer),
            Some(radio) => board.take(&arrived[..read], radio, &mut (), &mut answer),
        };
        // The simulated world waits for the answers. If its flight has ended, it may have exited
        // before an answer that it requested again.
        match to_world.write_all(&answers).and_then(|()| to_world.flush()) {
            Err(error) if error.kind() == io::ErrorKind::BrokenPipe => break,
            written => written?,
        }
        answers.clear();
        flown?;
    }
    let (broken, cut) = (board.reader().broken(), board.reader().missing_its_end());
    ensure!(board.frames() > 0, "no frame has arrived");
    ensure!(cut == 0, "the stream ends inside a record, after {cut} bytes of it");
    eprintln!("{} frames; {broken} records were broken on their way", board.frames());
    Ok(())
}

fn answers_of(path: &Path) -> Result<Vec<Answer>> {
    let mut reader = Reader::default();
    reader.push(&fs::read(path).with_context(|| path.display().to_string())?);
    let answers: Vec<Answer> = std::iter::from_fn(|| reader.next_record()).collect();
    let complete = reader.broken() == 0 && reader.missing_its_end() == 0;
    ensure!(complete, "{}: a record is broken or cut off", path.display());
    Ok(answers)
}

fn compare(machines: &[String], folders: &[PathBuf]) -> Result<ExitCode> {
    let (mut frames, mut identical) = (0, 0);
    for folder in folders {
        let expected = answers_of(&folder.join("recorded"))?;
        ensure!(!expected.is_empty(), "{}: no frames", folder.display());
        let mut same_here = vec![true; expected.len()];
        for machine in machines {
            let path = folder.join(machine);
            let found = answers_of(&path)?;
            if found.len() != expected.len() {
                println!("{}: {} frames instead of {}", path.display(), found.len(), expected.len());
            }
            let differs =
                |place: &usize| !found.get(*place).is_some_and(|answer| answer.is_same_as(&expected[*place]));
            let different: Vec<usize> = (0..expected.len()).filter(differs).collect();
            if let Some(first) = different.first() {
                println!("{}: {} frames differ, first number {first}", path.display(), different.len());
                println!("  recorded {:?}", expected[*first]);
                println!("  here     {:?}", found.get(*first));
            }
            for place in different {
                same_here[place] = false;
            }
        }
        frames += expected.len();
        identical += same_here.iter().filter(|same| **same).count();
    }
    let (flights, machines) = (folders.len(), machines.len());
    println!("{identical} of {frames} frames identical on {machines} machines, in {flights} flights");
    Ok(if identical == frames { ExitCode::SUCCESS } else { ExitCode::from(3) })
}

fn costs(folders: &[PathBuf]) -> Result<()> {
    let mut classes: BTreeMap<&str, Vec<u64>> = BTreeMap::new();
    for folder in folders {
        let path = folder.join("costs");
        let text = fs::read_to_string(&path).with_context(|| path.display().to_string())?;
        for (number, line) in text.lines().enumerate() {
            let wrong = || format!("{}, line {}: '{line}'", path.display(), number + 1);
            let words: Vec<&str> = line.split(' ').collect();
            let [_, posed, instructions, _] = words[..] else { anyhow::bail!("{}", wrong()) };
            let class = if posed == "0" { "frames" } else { "plans and predictions" };
            classes.entry(class).or_default().push(instructions.parse().with_context(wrong)?);
        }
    }
    for (class, mut costs) in classes {
        costs.sort_unstable();
        let share = |percent: usize| costs[(costs.len() - 1) * percent / 100];
        println!(
            "{:>7} {class}: median {}, p99 {}, most {} instructions",
            costs.len(),
            share(50),
            share(99),
            share(100),
        );
    }
    Ok(())
}

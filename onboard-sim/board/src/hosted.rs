//! The flight computer as a process, and the comparison of what several machines answered.
#![expect(clippy::print_stdout, reason = "what it found")]

use std::fs::{self, File};
use std::io::{self, BufReader, BufWriter, Write as _};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context as _, Result, ensure};
use board::recorded::fly;
use board::stream::{Answer, Link, receive};
use clap::{Parser, Subcommand};

/// The flight computer as a program for a board.
#[derive(Parser)]
#[command(name = "board")]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Fly a recorded flight: frames from standard input, answers to standard output
    Fly,
    /// Compare the answers of several machines with the recorded ones, frame by frame
    ///
    /// Exit codes: 0 identical, 1 error, 2 usage, 3 a frame differs.
    Compare {
        /// The answers as recorded
        recorded: PathBuf,
        /// The answers of each machine
        #[arg(required = true)]
        machines: Vec<PathBuf>,
    },
    /// Say what frames and plans cost, from the files `costs` of a Cortex-M7
    Costs {
        #[arg(required = true)]
        files: Vec<PathBuf>,
    },
}

pub(super) fn main() -> ExitCode {
    let done = match Cli::parse().command {
        Command::Fly => fly_standard_input().map(|()| ExitCode::SUCCESS),
        Command::Compare { recorded, machines } => compare(&recorded, &machines),
        Command::Costs { files } => costs(&files).map(|()| ExitCode::SUCCESS),
    };
    done.unwrap_or_else(|error| {
        eprintln!("board: {error:#}");
        ExitCode::FAILURE
    })
}

/// Two streams of bytes as a link.
struct Pipes<R, W>(R, W);

impl<R: io::Read, W: io::Write> Link for Pipes<R, W> {
    type Error = io::Error;

    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        self.0.read(into)
    }

    fn write_all(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.1.write_all(bytes)
    }
}

fn fly_standard_input() -> Result<()> {
    let mut link = Pipes(BufReader::new(io::stdin().lock()), BufWriter::new(io::stdout().lock()));
    let frames = fly(&mut link, &mut ())?;
    link.1.flush()?;
    eprintln!("{frames} frames");
    Ok(())
}

fn answers_of(path: &Path) -> Result<Vec<Answer>> {
    let file = File::open(path).with_context(|| path.display().to_string())?;
    let mut link = Pipes(BufReader::new(file), io::sink());
    let (mut answers, mut buffer) = (Vec::new(), Vec::new());
    while let Some(answer) = receive(&mut link, &mut buffer).with_context(|| path.display().to_string())? {
        answers.push(answer);
    }
    Ok(answers)
}

fn compare(recorded: &Path, machines: &[PathBuf]) -> Result<ExitCode> {
    let expected = answers_of(recorded)?;
    ensure!(!expected.is_empty(), "{}: no frames", recorded.display());
    let mut identical = vec![true; expected.len()];
    for machine in machines {
        let found = answers_of(machine)?;
        if found.len() != expected.len() {
            println!("{}: {} frames instead of {}", machine.display(), found.len(), expected.len());
        }
        let mut first = None;
        for (place, same) in identical.iter_mut().enumerate() {
            // As bytes: a NaN never equals itself, and 0.0 equals -0.0.
            let bytes = |answer: &Answer| prost::Message::encode_to_vec(answer);
            if found.get(place).map(bytes) != Some(bytes(&expected[place])) {
                *same = false;
                first.get_or_insert(place);
            }
        }
        if let Some(place) = first {
            println!("{}: first difference in record {place}", machine.display());
            println!("  recorded {:?}", expected[place]);
            println!("  here     {:?}", found.get(place));
        }
    }
    let same = identical.iter().filter(|same| **same).count();
    println!("{same} of {} frames identical on {} machines", expected.len(), machines.len());
    Ok(if same == expected.len() { ExitCode::SUCCESS } else { ExitCode::from(3) })
}

fn costs(files: &[PathBuf]) -> Result<()> {
    let (mut frames, mut plans) = (Vec::new(), Vec::new());
    for path in files {
        let text = fs::read_to_string(path).with_context(|| path.display().to_string())?;
        for (number, line) in text.lines().enumerate() {
            let wrong = || format!("{}, line {}: '{line}'", path.display(), number + 1);
            let words: Vec<&str> = line.split(' ').collect();
            let [_, planned, instructions, _] = words[..] else { anyhow::bail!("{}", wrong()) };
            let instructions: u64 = instructions.parse().with_context(wrong)?;
            if planned == "1" { &mut plans } else { &mut frames }.push(instructions);
        }
    }
    for (name, mut costs) in [("frames without a plan", frames), ("frames with a plan", plans)] {
        costs.sort_unstable();
        let Some(most) = costs.last() else { continue };
        let share = |percent: usize| costs[(costs.len() - 1) * percent / 100];
        println!(
            "{:>7} {name}: median {} instructions, p99 {}, most {most}",
            costs.len(),
            share(50),
            share(99),
        );
    }
    Ok(())
}

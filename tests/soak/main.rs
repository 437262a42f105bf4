//! A simulated day and two real hours of a launch site: a station with three screens and a flight
//! every few minutes, and beside it a pad without a flight. Links come and go, a disk fills, a
//! clock steps, programs stop and continue. Memory, descriptors, threads and logs must stay flat,
//! and nothing may be lost that was promised.
//!
//! `cargo bench -p e2e --bench soak -- 24 120 /tmp/soak` (simulated hours, real minutes, and a
//! folder that does not exist yet).

mod day;
mod field;
mod footprint;
mod pad;

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use e2e::{Program, keygen, now, program};
use field::Field;
use footprint::Watched;
use pad::Pad;

pub(crate) type Failure = Box<dyn std::error::Error + Send + Sync>;

pub(crate) const KEY: &str = "flight.key";
pub(crate) const SAMPLE_EVERY: Duration = Duration::from_secs(20);

fn main() -> Result<(), Failure> {
    // `cargo bench` adds a flag of its own.
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    let [hours, minutes, folder] = arguments.as_slice() else {
        return Err("give simulated hours, real minutes and a new folder: 24 120 /tmp/soak".into());
    };
    let hours: u32 = hours.parse().map_err(|_wrong| format!("`{hours}`: must be whole hours"))?;
    let minutes: u64 = minutes.parse().map_err(|_wrong| format!("`{minutes}`: must be whole minutes"))?;
    let folder = PathBuf::from(folder);
    std::fs::create_dir(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;

    let mut wrong = day::day(hours)?;
    let end = now() + Duration::from_mins(minutes);
    let mut pad = Pad::open(&folder)?;
    let mut field = Field::open(&folder)?;
    let watched: Vec<Watched> = field.watched().into_iter().chain(pad.watched()).collect();
    let watched = Arc::new(Mutex::new(watched));
    let over = Arc::new(AtomicBool::new(false));
    let sampler = {
        let (watched, over) = (Arc::clone(&watched), Arc::clone(&over));
        std::thread::Builder::new().name("sampler".to_owned()).spawn(move || sample(&watched, &over))?
    };
    while now() < end {
        field.fly()?;
        pad.suffer()?;
    }
    over.store(true, Ordering::Relaxed);
    let samples = sampler.join().map_err(|_panic| "the sampler has panicked")?;
    wrong.extend(field.close()?);
    wrong.extend(pad.close()?);

    print_line("| process | memory, MiB | descriptors | threads | log grew by, MB |\n|---|---|---|---|---|")?;
    for process in watched.lock().unwrap_or_else(PoisonError::into_inner).iter() {
        let (row, problems) = process.judge(samples);
        print_line(&row)?;
        wrong.extend(problems);
    }
    print_line(&format!("{samples} samples; medians of each third of the run"))?;
    if wrong.is_empty() {
        return print_line(&format!(
            "{hours} simulated hours, {minutes} minutes: flat, and nothing lost that was promised"
        ));
    }
    Err(wrong.join("\n").into())
}

/// Looks at every process until the run is over; returns how often.
fn sample(watched: &Mutex<Vec<Watched>>, over: &AtomicBool) -> usize {
    let mut samples = 0;
    let mut due = now();
    while !over.load(Ordering::Relaxed) {
        if now() >= due {
            due += SAMPLE_EVERY;
            samples += 1;
            watched.lock().unwrap_or_else(PoisonError::into_inner).iter_mut().for_each(Watched::sample);
        }
        rest(Duration::from_millis(200));
    }
    samples
}

/// Makes a key for vehicle and station in this folder.
pub(crate) fn make_key(folder: &Path) -> Result<(), Failure> {
    let made = keygen(folder, KEY);
    if made.code == Some(0) { Ok(()) } else { Err(made.output.into()) }
}

/// `ground` at home in this folder, with settings and sockets of its own.
pub(crate) fn ground(folder: &Path) -> Command {
    let mut command = program(Program::Ground);
    at_home(&mut command, folder);
    command
}

pub(crate) fn at_home(command: &mut Command, folder: &Path) {
    command.env("XDG_RUNTIME_DIR", folder).env("XDG_CONFIG_HOME", folder).current_dir(folder);
}

pub(crate) fn rest(time: Duration) {
    std::thread::sleep(time);
}

pub(crate) fn print_line(line: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    writeln!(out, "{line}")?;
    Ok(out.flush()?)
}

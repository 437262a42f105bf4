//! `onboard-sim landability`: where a landing exists.

use std::io::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use onboard_sim::fly::load_planar;
use onboard_sim::landability::{self, Axis};

use super::output::{refuse_loss, write_file};

#[derive(Args)]
pub(crate) struct LandabilityArguments {
    /// Built-in profile or TOML file.
    #[arg(long, default_value = "paper-calibrated", value_name = "NAME|FILE")]
    profile: String,
    /// Columns: QUANTITY=FROM:TO:COUNT. Quantities: thrust-to-weight, height (m), speed (m/s), tilt (deg), rate
    /// (deg/s), lateral-speed (m/s), thrust-scale.
    #[arg(long, default_value = "thrust-to-weight=0.9:1.5:41", value_name = "AXIS")]
    x: Axis,
    /// Rows, in the same form.
    #[arg(long, default_value = "height=5:35:31", value_name = "AXIS")]
    y: Axis,
    /// Write the cells as CSV.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Write the map as a picture.
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Replace existing files.
    #[arg(long)]
    force: bool,
    /// Cells computed at the same time; the map does not depend on it.
    #[arg(long, value_name = "N")]
    jobs: Option<usize>,
}

pub(crate) fn run(arguments: &LandabilityArguments) -> anyhow::Result<ExitCode> {
    let profile = load_planar(&arguments.profile)?.profile;
    let (x, y) = (arguments.x, arguments.y);
    anyhow::ensure!(x.quantity != y.quantity, "both axes vary {}; choose two quantities", x.quantity.name());
    for path in [&arguments.csv, &arguments.svg].into_iter().flatten() {
        refuse_loss(path, arguments.force)?;
    }
    let jobs =
        arguments.jobs.or_else(|| std::thread::available_parallelism().ok().map(usize::from)).unwrap_or(1);
    let count = x.count * y.count;
    let shown = (count / 20).max(1);
    let map = landability::map(&profile, x, y, jobs, &|done| {
        if done.is_multiple_of(shown) || done == count {
            // Messages go to standard error, which may be closed.
            let _ = write!(
                std::io::stderr(),
                "\r{done} of {count} cells{}",
                if done == count { "\n" } else { "" }
            );
        }
    });
    map.write_table(&mut std::io::stdout().lock())?;
    if let Some(path) = &arguments.csv {
        write_file(path, arguments.force, |out| map.write_csv(out))?;
    }
    if let Some(path) = &arguments.svg {
        let svg = landability::svg(&map, &profile.name)?;
        write_file(path, arguments.force, |out| out.write_all(svg.as_bytes()))?;
    }
    Ok(ExitCode::SUCCESS)
}

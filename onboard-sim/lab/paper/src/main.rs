//! `paper`: the landing paper's experiments beside ours.

mod study;

use std::io::Write as _;
use std::path::PathBuf;

use clap::Parser;
use onboard_sim::files::{new_folder, write_folder};

use crate::study::fall::{CG_STATION_M, HEAVY_TAIL_STATION_M, Stability};
use crate::study::figures::{figures, stability_figures};

/// Repeat the landing paper's experiments: its Tables 3 to 6 beside ours, and its equations as
/// printed.
#[derive(Parser)]
#[command(name = "paper", after_help = "Example: paper --out figures")]
struct Arguments {
    /// Instead of the tables, map from which tilts the paper's vehicle settles in a passive fall,
    /// over the opening of its fins, with the static margin that explains it.
    #[arg(long)]
    stability: bool,
    /// Write the figures of what is printed as SVG into this folder, a new one: Figures 5 to 9, or
    /// the map.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

fn main() -> anyhow::Result<()> {
    let Arguments { stability, out: folder } = Arguments::parse();
    let mut out = std::io::stdout().lock();
    let figures = if stability {
        let stability = Stability::new(CG_STATION_M)?;
        study::write_stability(&mut out, &stability, &Stability::new(HEAVY_TAIL_STATION_M)?)?;
        stability_figures(&stability)?
    } else {
        let experiments = study::experiments();
        study::write_tables(&mut out, &experiments, &study::as_printed())?;
        figures(&experiments.rows)?
    };
    let Some(folder) = folder else { return Ok(()) };
    let (folder, _held) = new_folder(&folder)?;
    write_folder(&folder, &figures)?;
    writeln!(std::io::stderr(), "{}", folder.display())?;
    Ok(())
}

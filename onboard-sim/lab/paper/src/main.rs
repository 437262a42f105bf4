//! `paper`: the landing paper's experiments beside ours.

mod study;

use std::io::Write as _;
use std::path::PathBuf;

use clap::Parser;
use onboard_sim::files::{new_folder, write_folder};

use crate::study::fall::{CG_STATION_M, HEAVY_TAIL_STATION_M, Stability};
use crate::study::figures::{figures, stability_figures};
use crate::study::fins::write_fins;

/// Repeat the landing paper's experiments: its Tables 3 to 6 beside ours, and its equations as
/// printed.
#[derive(Parser)]
#[command(name = "paper", after_help = "Example: paper --out figures")]
struct Arguments {
    /// Instead of the tables, map from which tilts the paper's vehicle settles in a passive fall,
    /// over the opening of its fins, with the static margin that explains it.
    #[arg(long)]
    stability: bool,
    /// Instead of the tables, the verdict on each printed final state, as docs/paper.md has it.
    #[arg(long, conflicts_with = "stability")]
    verdicts: bool,
    /// Instead of the tables, the fins' forces in simulated falls: by Eq. 9-14, as in the world,
    /// and the one along Y_f that the paper drops.
    #[arg(long, conflicts_with_all = ["stability", "verdicts", "out"])]
    fins: bool,
    /// Write the figures of what is printed as SVG into this folder, a new one: Figures 5 to 9, or
    /// the map.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

fn main() -> anyhow::Result<()> {
    let Arguments { stability, verdicts, fins, out: folder } = Arguments::parse();
    let mut out = std::io::stdout().lock();
    if fins {
        return Ok(write_fins(&mut out)?);
    }
    let figures = if stability {
        let stability = Stability::new(CG_STATION_M)?;
        study::write_stability(&mut out, &stability, &Stability::new(HEAVY_TAIL_STATION_M)?)?;
        stability_figures(&stability)?
    } else {
        let experiments = study::experiments();
        if verdicts {
            study::write_verdicts(&mut out, &experiments.rows)?;
        } else {
            study::write_tables(&mut out, &experiments, &study::as_printed())?;
        }
        figures(&experiments.rows)?
    };
    let Some(folder) = folder else { return Ok(()) };
    let (folder, _held) = new_folder(&folder)?;
    write_folder(&folder, &figures)?;
    writeln!(std::io::stderr(), "{}", folder.display())?;
    Ok(())
}

//! `onboard-sim paper`: the landing paper's experiments beside ours.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, Subcommand};

use super::{MapArguments, write_folder};
use crate::paper;
use crate::paper::fall::{CG_STATION_M, HEAVY_TAIL_STATION_M, Stability};
use crate::paper::figures::{figures, stability_figures};

#[derive(Args)]
#[command(args_conflicts_with_subcommands = true)]
pub(crate) struct PaperArguments {
    #[command(subcommand)]
    command: Option<PaperCommand>,
    /// As JSON.
    #[arg(long, conflicts_with = "stability")]
    json: bool,
    /// Instead of the tables, map from which tilts the paper's vehicle settles in a passive fall, over the opening of its
    /// fins, with the static margin that explains it.
    #[arg(long)]
    stability: bool,
    /// Write the figures of what is printed as SVG into this folder: Figures 5 to 9, or the map.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace existing files.
    #[arg(long)]
    force: bool,
}

#[derive(Subcommand)]
enum PaperCommand {
    /// Map where a plan exists that ends inside the paper's Table 2, over two quantities: one solve for each cell.
    #[command(after_help = "Example: onboard-sim paper map --x tilt=-30:30:61 --svg tilt.svg")]
    Map(MapArguments),
}

pub(crate) fn run(arguments: &PaperArguments) -> anyhow::Result<ExitCode> {
    if let Some(PaperCommand::Map(map)) = &arguments.command {
        let title = "the landing paper's vehicle with 33.3 N: does a plan end inside the touchdown limits?";
        let default = ["thrust-to-weight=0.9:1.5:41", "height=5:35:31"];
        return map.run(default, [title, "one solve for each cell"], paper::map);
    }
    let mut out = std::io::stdout().lock();
    if arguments.stability {
        let stability = Stability::new(CG_STATION_M)?;
        let heavy_tail = Stability::new(HEAVY_TAIL_STATION_M)?;
        paper::write_stability(&mut out, &stability, &heavy_tail)?;
        return written(arguments, || stability_figures(&stability));
    }
    let experiments = paper::experiments();
    let printed = paper::as_printed();
    if arguments.json {
        writeln!(out, "{:#}", paper::to_json(&experiments, &printed))?;
    } else {
        paper::write_tables(&mut out, &experiments, &printed)?;
    }
    written(arguments, || figures(&experiments.rows))
}

fn written(
    arguments: &PaperArguments,
    draw: impl FnOnce() -> Result<Vec<(&'static str, String)>, paper::PaperError>,
) -> anyhow::Result<ExitCode> {
    let Some(folder) = &arguments.out else { return Ok(ExitCode::SUCCESS) };
    let files = draw()?;
    write_folder(folder, &files, arguments.force)?;
    tell(folder, &files)?;
    Ok(ExitCode::SUCCESS)
}

/// On standard error, because standard output may be JSON.
fn tell(folder: &Path, files: &[(&str, String)]) -> std::io::Result<()> {
    let names: Vec<&str> = files.iter().map(|(name, _)| *name).collect();
    writeln!(std::io::stderr(), "{} in {}", names.join(", "), folder.display())
}

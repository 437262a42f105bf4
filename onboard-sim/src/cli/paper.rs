//! `onboard-sim paper`: the landing paper's experiments beside ours.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use onboard_sim::paper;
use onboard_sim::paper::figures::{figures, stability_figures};
use onboard_sim::paper::passive::{CG_STATION_M, HEAVY_TAIL_STATION_M};
use onboard_sim::paper::stability::Stability;

use super::landability::{MapArguments, jobs};
use super::output::write_folder;

#[derive(Args)]
pub(crate) struct PaperArguments {
    /// As JSON.
    #[arg(long, conflicts_with_all = ["stability", "landability"])]
    json: bool,
    /// Instead of the tables, map from which tilts the paper's vehicle settles in a passive fall, over the opening of its
    /// fins, with the static margin that explains it.
    #[arg(long)]
    stability: bool,
    /// Instead of the tables, map where a plan exists that ends inside Table 2, over two quantities.
    #[arg(long, conflicts_with_all = ["stability", "figures"])]
    landability: bool,
    #[command(flatten)]
    map: MapArguments,
    /// Write the figures of what is printed as SVG into this folder: Figures 5 to 9, or the map.
    #[arg(long, value_name = "DIR")]
    figures: Option<PathBuf>,
    /// Replace existing files.
    #[arg(long)]
    force: bool,
}

pub(crate) fn run(arguments: &PaperArguments) -> anyhow::Result<ExitCode> {
    if arguments.landability {
        let title = "the landing paper's vehicle with 33.3 N: does a plan end inside the touchdown limits?";
        let default = ["thrust-to-weight=0.9:1.5:41", "height=5:35:31"];
        return arguments.map.run(
            default,
            arguments.force,
            [title, "one solve for each cell"],
            |axes, progress| paper::map(axes, jobs(None), progress),
        );
    }
    let mut out = std::io::stdout().lock();
    if arguments.stability {
        let jobs = jobs(None);
        let stability = Stability::new(CG_STATION_M, jobs)?;
        let heavy_tail = Stability::new(HEAVY_TAIL_STATION_M, jobs)?;
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
    let Some(folder) = &arguments.figures else { return Ok(ExitCode::SUCCESS) };
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

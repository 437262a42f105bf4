//! Prints the map of `paper --stability` for people.

use std::io::{self, Write};

use super::passive::HEIGHT_M;
use super::stability::{ANGLES_DEG, Fate, OPENINGS_DEG, ROLLS_DEG, Stability, TILTS_DEG};

/// Writes the map, the highest opening first, and the static margins; and what becomes of the same vehicle with a heavy
/// tail.
///
/// # Errors
/// The output cannot be written.
pub fn write_stability(
    out: &mut impl Write,
    stability: &Stability,
    heavy_tail: &Stability,
) -> io::Result<()> {
    writeln!(
        out,
        "The paper's vehicle (centre of gravity {} m above the nozzle) falling passively from rest at {HEIGHT_M} m,",
        stability.cg_station_m
    )?;
    writeln!(
        out,
        "tilted at the start in {} directions about its axis: # settles in all, o in some, . flips in all",
        ROLLS_DEG.len()
    )?;
    writeln!(out, "fins deg")?;
    for (opening, opening_deg) in OPENINGS_DEG.iter().enumerate().rev() {
        let signs = (0..TILTS_DEG.len()).map(|tilt| stability.fate(opening, tilt).sign());
        let signs: String = signs.flat_map(|sign| [' ', ' ', sign]).collect();
        writeln!(out, "{opening_deg:>8} |{signs}")?;
    }
    let ticks = TILTS_DEG.map(|tilt_deg| format!("{tilt_deg:>3}")).concat();
    writeln!(out, "{:>8}  {ticks}  tilt at the start, deg", "")?;
    let cells = stability.fates.len();
    writeln!(
        out,
        "{} of {cells} cells settle, {} depend on the direction, {} flip",
        stability.count(Fate::Settles),
        stability.count(Fate::DependsOnRoll),
        stability.count(Fate::Flips)
    )?;
    writeln!(out)?;
    writeln!(
        out,
        "Static margin: centre of pressure above the centre of gravity, mm (above 0: stable); worst and best plane"
    )?;
    let angles = ANGLES_DEG.map(|angle_deg| format!("{:>14}", format!("{angle_deg} deg"))).concat();
    writeln!(out, "fins deg {angles}  to the wind")?;
    for (opening_deg, margins_m) in OPENINGS_DEG.iter().zip(&stability.margins_m).rev() {
        let margins = margins_m.iter().map(|[least_m, most_m]| {
            format!("{:>14}", format!("{:+.0} {:+.0}", 1e3 * least_m, 1e3 * most_m))
        });
        writeln!(out, "{opening_deg:>8} {}", margins.collect::<Vec<_>>().concat())?;
    }
    writeln!(
        out,
        "The fins' force across the axis grows with the sine of the angle, the body's, which acts at its middle, 0.17 m"
    )?;
    writeln!(out, "below the centre of gravity, with its square: beyond some angle the body wins.")?;
    writeln!(out)?;
    writeln!(
        out,
        "With the centre of gravity {} m above the nozzle, a quarter of the length from the tail instead of the nose, every",
        heavy_tail.cg_station_m
    )?;
    writeln!(
        out,
        "margin is {:.0} mm larger: {} of {cells} cells settle.",
        1e3 * (stability.cg_station_m - heavy_tail.cg_station_m),
        heavy_tail.count(Fate::Settles)
    )
}

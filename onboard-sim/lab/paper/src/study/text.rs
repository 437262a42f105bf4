//! Prints the tables and the map of `paper --stability`, for people.

use std::io::{self, Write};

use paper::plane::dynamics::PlanarState;

use super::fall::{ANGLES_DEG, Fate, HEIGHT_M, OPENINGS_DEG, ROLLS_DEG, Stability, TILTS_DEG};
use super::objective::chord;
use super::{AsPrinted, Experiments, Finish, Objective, Row, Table};

/// Writes Tables 3 to 6 and the results of the printed equations.
///
/// # Errors
/// The output cannot be written.
pub(crate) fn write_tables(
    out: &mut impl Write,
    experiments: &Experiments,
    printed: &AsPrinted,
) -> io::Result<()> {
    let rows = &experiments.rows;
    writeln!(
        out,
        "Final states: the landing paper's, and ours with its cost, conditions and start\n\
         (consistent equations, T = 33.3 N). Verdict by the paper's Table 2."
    )?;
    let heads = "                                   x m        z m pitch deg    u m/s    w m/s  q deg/s         J  Table 2";
    for table in Table::ALL {
        writeln!(out, "\n{}\n{heads}", table.title())?;
        for row in rows.iter().filter(|row| row.case.table == table) {
            write_row(out, row)?;
        }
    }
    let landed = |pick: fn(&Row) -> bool| rows.iter().filter(|row| pick(row)).count();
    writeln!(
        out,
        "\ninside Table 2: open loop {} of {n}, closed loop {} of {n}; the paper {} of the {} rows it prints",
        landed(|row| row.open_loop.landed()),
        landed(|row| row.closed_loop.landed()),
        landed(|row| row.paper_landed == Some(true)),
        landed(|row| row.paper_landed.is_some()),
        n = rows.len(),
    )?;
    writeln!(out, "\nLargest deviation of the start, alone and to either side, with a plan inside Table 2")?;
    for (name, printed, ours, step) in experiments.ranges {
        writeln!(out, "  {name:<12} {ours:>7} (in steps of {step}); the paper tries {printed}")?;
    }
    write_objective(out, &experiments.objective)?;
    write_printed(out, printed)
}

/// Writes a line of Markdown for each row: the printed final state, ours, and the verdict.
///
/// # Errors
/// The output cannot be written.
pub(crate) fn write_verdicts(out: &mut impl Write, rows: &[Row]) -> io::Result<()> {
    let values = |state: &PlanarState| {
        // Without the sign of a zero.
        let text = |value: f64, digits: usize| {
            let text = format!("{value:.digits$}");
            if text.trim_matches(['-', '0', '.']).is_empty() { text.replace('-', "") } else { text }
        };
        [
            text(state.x_m, 2),
            text(state.theta_rad.to_degrees(), 2),
            text(state.u_m_s, 3),
            text(state.w_m_s, 3),
            text(state.q_rad_s.to_degrees(), 2),
        ]
        .join(", ")
    };
    writeln!(
        out,
        "| | the paper: x m, pitch deg, u m/s, w m/s, q deg/s | ours | verdict |\n|---|---|---|---|"
    )?;
    for row in rows {
        let (table, _) = row.case.table.title().split_once(':').unwrap_or_default();
        let printed = row.case.paper.map_or_else(String::new, |paper| values(&paper.state()));
        let ours = values(&row.open_loop.state);
        writeln!(out, "| {table}, {} | {printed} | {ours} | {} |", row.case.name(), row.verdict().name())?;
    }
    Ok(())
}

/// The paper's J beside every definition tried.
fn write_objective(out: &mut impl Write, objective: &Objective) -> io::Result<()> {
    let value =
        |value: &Option<f64>| value.map_or_else(|| format!("{:>12}", "-"), |value| format!("{value:>12.3}"));
    let line = |out: &mut dyn Write, name: &str, values: &[Option<f64>]| {
        let ratio = |place: usize| {
            let (first, other) = (values.first().copied().flatten(), values.get(place).copied().flatten());
            first.zip(other).map_or(f64::NAN, |(first, other)| other / first)
        };
        let row: String = values.iter().map(value).collect();
        writeln!(out, "{name:<56} {row}   1 : {:.2} : {:.2}", ratio(1), ratio(2))
    };
    let weights = objective.weights.iter().map(|p| format!("{:>12}", format!("P = {p}")));
    let weights = weights.collect::<Vec<_>>().concat();
    writeln!(out, "\n{:<56} {weights}   ratios 0.5 : 1 : 2", "J of Table 3")?;
    line(out, "the paper", &objective.paper)?;
    line(out, "Eq. 28 at the paper's own final states", &objective.at_paper_finals)?;
    writeln!(out, "ours, by")?;
    for definition in &objective.definitions {
        let values: Vec<Option<f64>> = definition.values.iter().copied().map(Some).collect();
        line(out, &format!("  {}", definition.name), &values)?;
    }
    let [Some(half), Some(one), Some(two), ..] = objective.paper[..] else { return Ok(()) };
    writeln!(
        out,
        "No definition gives the paper's column. Three optima cannot, whatever A and B >= 0 are in J = A + P B:\n  \
         the landing of P = 1 costs at most {:.2} with P = 2, so a landing of {two} is no optimum;\n  \
         the least J is concave in P, so between {half} and {two} it is at least {:.2} at P = 1, not {one}.\n  \
         Both hold if the last row is the P = 5 of the paper's Fig. 6, not the P = 2 of its Table 3.",
        2.0 * one,
        chord(1.0, [(0.5, half), (2.0, two)])
    )
}

fn write_row(out: &mut impl Write, row: &Row) -> io::Result<()> {
    let name = row.case.name();
    match row.case.paper {
        Some(paper) => {
            let verdict = if row.paper_landed == Some(true) { "inside" } else { "OUTSIDE" };
            write_state(out, &name, "paper", &paper.state(), None, verdict)?;
        }
        None => writeln!(out, "{name:<16} {:<11} not printed", "paper")?,
    }
    write_finish(out, "open loop", &row.open_loop)?;
    write_finish(out, "closed loop", &row.closed_loop)
}

fn write_finish(out: &mut impl Write, which: &str, finish: &Finish) -> io::Result<()> {
    let verdict = match (finish.landed(), finish.converged) {
        (true, true) => "inside".to_owned(),
        (true, false) => "inside, not converged".to_owned(),
        (false, _) => format!("OUTSIDE: {}", finish.broken.join(", ")),
    };
    write_state(out, "", which, &finish.state, Some(finish.cost), &verdict)
}

fn write_state(
    out: &mut impl Write,
    name: &str,
    which: &str,
    state: &PlanarState,
    cost: Option<f64>,
    verdict: &str,
) -> io::Result<()> {
    let cost = cost.map_or_else(String::new, |cost| format!("{cost:.2}"));
    writeln!(
        out,
        "{name:<16} {which:<11} {:>9.3} {:>10.1e} {:>9.2} {:>8.3} {:>8.4} {:>8.3} {cost:>9}  {verdict}",
        state.x_m,
        state.z_m,
        state.theta_rad.to_degrees(),
        state.u_m_s,
        state.w_m_s,
        state.q_rad_s.to_degrees(),
    )
}

fn write_printed(out: &mut impl Write, printed: &AsPrinted) -> io::Result<()> {
    let AsPrinted { thrust_n, best_touchdown_speed_m_s, limit_m_s, promised_lowest_m, .. } = printed;
    let [by_printed, by_corrected] = printed.energy_error_j_kg;
    let converged = if printed.promise_converged { "" } else { " (not converged)" };
    writeln!(
        out,
        "\nAs printed\n  \
         {thrust_n} N: NOT LANDABLE. Upright under full thrust all the way, which no other input can beat, the\n  \
         vehicle still touches down at {best_touchdown_speed_m_s:.2} m/s; a landing allows {limit_m_s} m/s.\n  \
         Eq. 18-22 do not conserve energy: one second of coasting at 30 deg of tilt changes it by {by_printed:+.2} J/kg\n  \
         (the corrected equations: {by_corrected:+.1e} J/kg).\n  \
         A solver that uses them predicts with {thrust_n} N to be at z = {:.3} m after the burn, moving at {:+.2} m/s,\n  \
         {:.0} deg from upright, having come back up from {promised_lowest_m:.2} m{converged}.",
        printed.promised.z_m.abs(),
        printed.promised_vertical_m_s,
        (printed.promised.theta_rad.to_degrees() - 90.0).abs(),
    )?;
    match printed.happens {
        Some(contact) => {
            let (_, vertical_m_s) = contact.ground_velocity_m_s();
            writeln!(
                out,
                "  The vehicle that flies this plan hits the ground at {vertical_m_s:+.2} m/s, {:.0} deg from upright.",
                (contact.theta_rad.to_degrees() - 90.0).abs()
            )
        }
        None => writeln!(out, "  The vehicle that flies this plan is still in the air 5 s after the burn."),
    }
}

/// Writes the map, the highest opening first, and the static margins; and what becomes of the same
/// vehicle with a heavy tail.
///
/// # Errors
/// The output cannot be written.
pub(crate) fn write_stability(
    out: &mut impl Write,
    stability: &Stability,
    heavy_tail: &Stability,
) -> io::Result<()> {
    writeln!(
        out,
        "The paper's vehicle (centre of gravity {} m above the nozzle) falling passively from rest at {HEIGHT_M} m,\n\
         tilted at the start in {} directions about its axis: # settles in all, o in some, . flips in all\nfins deg",
        stability.cg_station_m,
        ROLLS_DEG.len()
    )?;
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
        "{} of {cells} cells settle, {} depend on the direction, {} flip\n\n\
         Static margin: centre of pressure above the centre of gravity, mm (above 0: stable); worst and best plane",
        stability.count(Fate::Settles),
        stability.count(Fate::DependsOnRoll),
        stability.count(Fate::Flips)
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
        "The fins' force across the axis grows with the sine of the angle, the body's, which acts at its middle, 0.17 m\n\
         below the centre of gravity, with its square: beyond some angle the body wins.\n\n\
         With the centre of gravity {} m above the nozzle, a quarter of the length from the tail instead of the nose, every\n\
         margin is {:.0} mm larger: {} of {cells} cells settle.",
        heavy_tail.cg_station_m,
        1e3 * (stability.cg_station_m - heavy_tail.cg_station_m),
        heavy_tail.count(Fate::Settles)
    )
}

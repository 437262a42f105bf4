//! Prints the tables for people.

use std::io::{self, Write};

use flight::vehicle::dynamics::PlanarState;

use super::{AsPrinted, Finish, Row, Table};

/// Writes Tables 3 to 6 and the results of the printed equations.
///
/// # Errors
/// The output cannot be written.
pub fn write_tables(out: &mut impl Write, rows: &[Row], printed: &AsPrinted) -> io::Result<()> {
    writeln!(out, "Final states: the landing paper's, and ours with its cost, conditions and start")?;
    writeln!(out, "(consistent equations, T = 33.3 N). Verdict by the paper's Table 2.")?;
    for table in Table::ALL {
        writeln!(out)?;
        writeln!(out, "{}", table.title())?;
        writeln!(
            out,
            "{:<16} {:<11} {:>9} {:>10} {:>9} {:>8} {:>8} {:>8} {:>9}  Table 2",
            "", "", "x m", "z m", "pitch deg", "u m/s", "w m/s", "q deg/s", "J"
        )?;
        for row in rows.iter().filter(|row| row.case.table == table) {
            write_row(out, row)?;
        }
    }
    let landed = |pick: fn(&Row) -> bool| rows.iter().filter(|row| pick(row)).count();
    writeln!(out)?;
    writeln!(
        out,
        "inside Table 2: open loop {} of {n}, closed loop {} of {n}; the paper {} of the {} rows it prints",
        landed(|row| row.open_loop.verdict.landed()),
        landed(|row| row.closed_loop.verdict.landed()),
        landed(|row| row.paper_landed == Some(true)),
        landed(|row| row.paper_landed.is_some()),
        n = rows.len(),
    )?;
    write_printed(out, printed)
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
    let verdict = match (finish.verdict.landed(), finish.converged) {
        (true, true) => "inside".to_owned(),
        (true, false) => "inside, not converged".to_owned(),
        (false, _) => format!("OUTSIDE: {}", finish.verdict.summary()),
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
    writeln!(out)?;
    writeln!(out, "As printed")?;
    writeln!(
        out,
        "  {} N: NOT LANDABLE. Upright under full thrust all the way, which no other input can beat, the",
        printed.thrust_n
    )?;
    writeln!(
        out,
        "  vehicle still touches down at {:.2} m/s; a landing allows {} m/s.",
        printed.best_touchdown_speed_m_s, printed.limit_m_s
    )?;
    let [by_printed, by_corrected] = printed.energy_error_j_kg;
    writeln!(
        out,
        "  Eq. 18-22 do not conserve energy: one second of coasting at 30 deg of tilt changes it by {by_printed:+.2} J/kg"
    )?;
    writeln!(out, "  (the corrected equations: {by_corrected:+.1e} J/kg).")?;
    let converged = if printed.promise_converged { "" } else { " (not converged)" };
    writeln!(
        out,
        "  A solver that uses them predicts with {} N to be at z = {:.3} m after the burn, moving at {:+.2} m/s,",
        printed.thrust_n,
        printed.promised.z_m.abs(),
        printed.promised_vertical_m_s
    )?;
    writeln!(
        out,
        "  {:.0} deg from upright, having come back up from {:.2} m{converged}.",
        (printed.promised.theta_rad.to_degrees() - 90.0).abs(),
        printed.promised_lowest_m
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

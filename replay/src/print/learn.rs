//! Prints what was learnt for the next flight.

use std::io::{self, Write};

use sim::dispersion::{DEFAULT, may_be_kinder};

use super::{counted, shown};
use crate::learn::Learnt;

/// Writes what was learnt as text.
///
/// # Errors
/// The output failed.
pub fn print_learn(learnt: &Learnt, output: &mut impl Write) -> io::Result<()> {
    let Learnt { mission, motor, set, sources, .. } = learnt;
    let logs = counted(sources.len() as u64, "fit");
    writeln!(output, "{} with {} after {logs}, prior {}", shown(mission), shown(motor), shown(set))?;
    writeln!(
        output,
        "lot                  burns      mean   95 % interval       next burn +-   before any burn +-"
    )?;
    for lot in &learnt.lots {
        let interval = format!("{:.4} to {:.4}", lot.low, lot.high);
        let text = format!(
            "  {:<18} {:>5}  {:>8.4}   {interval:<18}  {:>12.4}   {:>17.4} {}",
            lot.name, lot.burns, lot.mean, lot.next_sigma, lot.prior_sigma, lot.unit
        );
        writeln!(output, "{}", text.trim_end())?;
    }
    for pooled in &learnt.airframe {
        let mean = &pooled.mean;
        let text = format!(
            "airframe  {:<16} {:.4}, {:.4} to {:.4} {}",
            shown(&mean.name),
            mean.value,
            mean.low,
            mean.high,
            mean.unit
        );
        writeln!(output, "{}", text.trim_end())?;
    }
    let [low, high] = learnt.wind_m_s;
    writeln!(output, "site      wind {low:.1} to {high:.1} m/s")?;
    let found = &learnt.prediction;
    writeln!(
        output,
        "rate      {:.1} %, 95 % interval {:.1} to {:.1} %, from {} in {}",
        100.0 * found.rate,
        100.0 * found.low,
        100.0 * found.high,
        counted(learnt.flights as u64, "simulated flight"),
        shown(set)
    )?;
    writeln!(
        output,
        "risk      {:.1} % that the rate is below {:.0} %; {:.0} % is taken",
        100.0 * found.risk,
        100.0 * learnt.limit,
        100.0 * learnt.risk
    )?;
    match (learnt.go, may_be_kinder(set)) {
        (false, _) => writeln!(output, "NO-GO"),
        (true, false) => writeln!(output, "GO"),
        (true, true) => writeln!(output, "GO in {} only, which may be kinder than {DEFAULT}", shown(set)),
    }
}

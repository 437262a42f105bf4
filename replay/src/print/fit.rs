//! Prints what flights tell.

use std::io::{self, Write};

use serde::Serialize;

use super::{counted, shown};
use crate::fit::{Fit, Parameter, Pooled};

/// Fits of flights and burns, each alone and all together.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FitReport {
    pub fits: Vec<Fit>,
    /// Parameters of at least two of them.
    pub together: Vec<Pooled>,
}

/// Writes fits as text.
///
/// # Errors
/// The output failed.
pub fn print_fit(report: &FitReport, output: &mut impl Write) -> io::Result<()> {
    for (place, fit) in report.fits.iter().enumerate() {
        if place > 0 {
            writeln!(output)?;
        }
        print_one(fit, output)?;
    }
    if report.together.is_empty() {
        return Ok(());
    }
    writeln!(
        output,
        "\ntogether, {}: mean with its 95 % interval, and scatter from one to the next",
        of(report)
    )?;
    for Pooled { mean, flights, scatter } in &report.together {
        let scatter = digits(*scatter, mean.sigma);
        writeln!(output, "  {}   scatter {scatter} in {flights}", line(mean))?;
    }
    Ok(())
}

fn of(report: &FitReport) -> String {
    counted(report.fits.len() as u64, "log")
}

fn print_one(fit: &Fit, output: &mut impl Write) -> io::Result<()> {
    let mission = if fit.mission.is_empty() { "a test stand" } else { &fit.mission };
    writeln!(
        output,
        "{}: {} with {}, 95 % intervals",
        shown(&fit.source),
        shown(mission),
        shown(&fit.motor)
    )?;
    for parameter in &fit.found {
        writeln!(output, "  {}", line(parameter))?;
    }
    if !fit.not_found.is_empty() {
        writeln!(output, "not found")?;
    }
    for lack in &fit.not_found {
        writeln!(output, "  {}: {}", shown(&lack.name), shown(&lack.reason))?;
    }
    Ok(())
}

fn line(parameter: &Parameter) -> String {
    let Parameter { name, unit, value, sigma, low, high } = parameter;
    let number = |value: f64| digits(value, *sigma);
    let text = format!(
        "{:<28} {:>10}   {:>10} to {:<10} {}",
        shown(name),
        number(*value),
        number(*low),
        number(*high),
        shown(unit)
    );
    text.trim_end().to_owned()
}

/// A number to two digits of its standard deviation.
fn digits(value: f64, sigma: f64) -> String {
    let places = if sigma > 0.0 && sigma.is_finite() {
        (1.0 - libm::floor(libm::log10(sigma))).clamp(0.0, 7.0) as usize
    } else {
        4
    };
    format!("{value:.places$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_has_two_digits_of_its_deviation() {
        assert_eq!(digits(0.998_765, 0.001_8), "0.9988");
        assert_eq!(digits(254.71, 9.8), "254.7");
        assert_eq!(digits(1234.4, 120.0), "1234");
        assert_eq!(digits(1.0, 0.0), "1.0000");
    }
}

//! Tables of numbers with units in their column names, as programs export and test stands record
//! them.
//!
//! The first line with the required column names is the header, also behind a comment sign: `# Time
//! (s),Mass (g)`, `time_ms;thrust_lbf`. Its separator is a semicolon, a tab or a comma. Other
//! columns, blank lines and comments are ignored.

use alloc::borrow::ToOwned as _;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

/// A nautical mile per hour, m/s.
const KNOT_M_S: f64 = 1852.0 / 3600.0;
/// Units by quantity, each with its factor to the SI unit, which is first.
#[rustfmt::skip]
const UNITS: [&[(&str, f64)]; 7] = [
    &[("s", 1.0), ("ms", 1e-3), ("min", 60.0)],
    &[("m", 1.0), ("cm", 1e-2), ("mm", 1e-3), ("in", 0.0254), ("ft", 0.3048)],
    &[("kg", 1.0), ("g", 1e-3), ("oz", 0.028_349_523_125), ("lb", 0.453_592_37)],
    &[("m2", 1.0), ("cm2", 1e-4), ("mm2", 1e-6), ("in2", 6.4516e-4), ("ft2", 0.092_903_04)],
    &[("kgm2", 1.0), ("kgcm2", 1e-4), ("ozin2", 1.828_997_85e-5), ("lbin2", 2.926_396_56e-4), ("lbft2", 0.042_140_110_1),
        ("lbffts2", 1.355_817_95)],
    &[("m/s", 1.0), ("km/h", 1.0 / 3.6), ("kn", KNOT_M_S), ("kt", KNOT_M_S), ("kts", KNOT_M_S), ("knot", KNOT_M_S),
        ("knots", KNOT_M_S), ("mph", 0.447_04)],
    &[("n", 1.0), ("kn", 1e3), ("lbf", 4.448_221_62), ("kgf", 9.806_65), ("gf", 9.806_65e-3)],
];

/// Why a table cannot be used: a header, a unit or a value is wrong.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("line {line}: {column} is '{found}'; {required}")]
pub struct TableError {
    /// Line, from 1.
    line: usize,
    column: &'static str,
    found: String,
    required: String,
}

impl TableError {
    pub(super) fn bad(line: usize, column: &'static str, found: &str, required: &str) -> Self {
        Self { line, column, found: found.chars().take(40).collect(), required: required.to_owned() }
    }
}

/// By how much a number in a unit is multiplied to be in that unit of the SI: "kg m2" from
/// "lb·ft²". Anything has no unit.
///
/// # Errors
/// The units that are accepted.
pub fn factor(si: &str, unit: &str) -> Result<f64, String> {
    let plain = |text: &str| {
        let plain = text.chars().map(|letter| if letter == '²' { '2' } else { letter.to_ascii_lowercase() });
        plain.filter(char::is_ascii_alphanumeric).collect::<String>()
    };
    let (si, unit) = (plain(si), plain(unit));
    if si == unit || si.is_empty() {
        return Ok(1.0);
    }
    let available = UNITS.iter().find(|kind| plain(kind[0].0) == si).copied().unwrap_or_default();
    available.iter().find(|(name, _)| plain(name) == unit).map(|(_, factor)| *factor).ok_or_else(|| {
        let names = available.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
        format!("{} is accepted", if names.is_empty() { si } else { format!("a unit of {names}") })
    })
}

/// A line, and the numbers in it.
pub type Row<const N: usize> = (usize, [Option<f64>; N]);

/// The rows of a table with their line numbers: for every required column (its name in lower case,
/// its SI unit) the number in that unit, if present. The first `needed` columns must be present.
///
/// # Errors
/// A needed column is missing, or a unit is unknown; in a row: a needed number is missing.
pub fn rows<'a, const N: usize>(
    text: &'a str,
    wanted: &'a [(&'static str, &str); N],
    needed: usize,
) -> Result<impl Iterator<Item = Result<Row<N>, TableError>> + 'a, TableError> {
    let mut lines = text.lines().zip(1..);
    let header = lines.find_map(|(line, number)| {
        let separator = [';', '\t', ','].into_iter().find(|separator| line.contains(*separator))?;
        let names: Vec<_> = line.split(separator).map(named).collect();
        let places = wanted.map(|(name, _)| names.iter().position(|(found, _)| found == name));
        places[..needed].iter().all(Option::is_some).then_some((separator, names, places, number))
    });
    let (separator, names, places, number) = header.ok_or_else(|| {
        let wanted = wanted[..needed].iter().map(|(name, _)| *name).collect::<Vec<_>>().join(" and ");
        let required =
            format!("a line that names {wanted}, each with its unit, as time_s or Time (s), separated by , ; or tab, is needed");
        TableError::bad(1, "the header", text.lines().next().unwrap_or_default(), &required)
    })?;
    let mut factors = [1.0; N];
    for ((place, (column, si)), into) in places.iter().zip(wanted).zip(&mut factors) {
        let unit = place.map_or(*si, |place| names[place].1);
        *into = factor(si, unit).map_err(|accepted| TableError::bad(number, column, unit, &accepted))?;
    }
    let is_data = |line: &str| !line.trim().is_empty() && !line.trim_start().starts_with(['#', '%', '/']);
    Ok(lines.filter(move |(line, _)| is_data(line)).map(move |(line, number)| {
        let fields: Vec<_> = line.split(separator).collect();
        if fields.iter().rposition(|field| !field.trim().is_empty()) >= Some(names.len()) {
            let required =
                format!("{} columns as in the header; with decimal commas ; separates", names.len());
            return Err(TableError::bad(number, "the row", line, &required));
        }
        let mut row = [None; N];
        for (k, (column, _)) in wanted.iter().enumerate() {
            let field = places[k].and_then(|place| fields.get(place)).map_or("", |field| field.trim());
            // Where a comma does not separate, it is a decimal point.
            let value = field.trim_matches('"').replace(',', ".").parse::<f64>();
            let value = value.ok().filter(|value| value.is_finite());
            if k < needed && value.is_none() {
                return Err(TableError::bad(number, column, field, "a finite number is accepted"));
            }
            row[k] = value.map(|value| value * factors[k]);
        }
        Ok((number, row))
    }))
}

/// A column's name in small letters, and its unit.
fn named(field: &str) -> (String, &str) {
    let field = field.trim_matches(|letter: char| !letter.is_alphanumeric() && !matches!(letter, ')' | ']'));
    let (name, unit) = match field.strip_suffix([')', ']']) {
        Some(inside) => inside.rsplit_once(['(', '[']),
        None => match field.strip_suffix("_m_s") {
            Some(name) => Some((name, "m/s")),
            None => field.rsplit_once('_'),
        },
    }
    .unwrap_or((field, ""));
    (name.trim().to_lowercase(), unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    const WANTED: [(&str, &str); 3] = [("time", "s"), ("thrust", "n"), ("mass", "kg")];

    fn read(text: &str) -> Result<Vec<Row<3>>, TableError> {
        rows(text, &WANTED, 2)?.collect()
    }

    #[test]
    fn val_hand_units_separators_and_decimal_commas() {
        for text in [
            "time_ms,thrust_lbf\n500,2\n",
            "\u{feff}# Thrust (lbf);Time (s)\n\n# a comment\n2,0;0,5\n",
            "remark\nother\t\"Time [ms]\"\tTHRUST [lbf]\nx\t500\t2.0\n",
        ] {
            let found = read(text).unwrap();
            let [Some(time_s), Some(thrust_n), None] = found[0].1 else { panic!("{found:?}") };
            assert!((time_s - 0.5).abs() < 1e-12 && (thrust_n - 8.896_443).abs() < 1e-5, "{text}");
        }
    }

    /// Of inch, foot and pound as they are defined.
    #[test]
    fn val_hand_inertias() {
        for (unit, expected) in [
            ("lb·ft²", 0.453_592_37 * 0.3048 * 0.3048),
            ("lb·in²", 0.453_592_37 * 0.0254 * 0.0254),
            ("oz·in²", 0.453_592_37 / 16.0 * 0.0254 * 0.0254),
            ("lbf·ft·s²", 0.453_592_37 * 9.806_65 * 0.3048),
            ("kg*cm^2", 1e-4),
        ] {
            let found = factor("kg m2", unit).unwrap();
            assert!((found / expected - 1.0).abs() < 1e-8, "{unit}: {found}");
        }
        assert!(
            factor("deg", "deg").is_ok() && factor("deg", "rad").is_err() && factor("", "calibers").is_ok()
        );
    }

    #[test]
    fn what_is_wrong_is_named() {
        for (text, wrong) in [
            (
                "t,f\n1,2\n",
                "line 1: the header is 't,f'; a line that names time and thrust, each with its unit, as time_s or Time (s), separated by , ; or tab, is needed",
            ),
            ("time_s,thrust_kg\n", "line 1: thrust is 'kg'; a unit of n, kn, lbf, kgf, gf is accepted"),
            ("time,thrust\n", "line 1: time is ''; a unit of s, ms, min is accepted"),
            ("time_s,thrust_n\n0,1\n1,x\n", "line 3: thrust is 'x'; a finite number is accepted"),
            ("time_s,thrust_n\n0,1\n1\n", "line 3: thrust is ''; a finite number is accepted"),
            (
                "time_s,thrust_n\n0,0,1,5\n",
                "line 2: the row is '0,0,1,5'; 2 columns as in the header; with decimal commas ; separates",
            ),
        ] {
            assert_eq!(read(text).unwrap_err().to_string(), wrong);
        }
    }
}

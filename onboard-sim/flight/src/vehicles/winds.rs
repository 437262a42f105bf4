//! Winds over height from a file: a table, or a sounding as the University of Wyoming publishes it
//! (weather.uwyo.edu, "Text: List").

use alloc::format;
use alloc::vec::Vec;

use super::table::{self, TableError};

/// Height at which surface winds are measured, m (WMO No. 8, Guide to Instruments, chapter 5).
const SURFACE_M: f64 = 10.0;

/// Height above the ground, m; speed, m/s; direction that the wind comes from, degrees clockwise
/// from north.
pub type Level = [f64; 3];

/// Reads the levels of a file, in its order. Heights of a sounding count from the ground of its
/// station.
///
/// # Errors
/// Neither a table with height, speed and direction nor a sounding, or a unit is missing.
pub fn read(text: &str) -> Result<Vec<Level>, TableError> {
    if let Some((number, header)) =
        text.lines().zip(1..).map(|(line, number)| (number, line)).find(|(_, line)| is_sounding(line))
    {
        return sounding(text, number, header);
    }
    let wanted = [("height", "m"), ("speed", "m/s"), ("from", "deg")];
    let rows = table::rows(text, &wanted, wanted.len())?;
    let level =
        |row: Result<table::Row<3>, TableError>| row.map(|(_, row)| row.map(Option::unwrap_or_default));
    rows.map(level).collect()
}

fn is_sounding(line: &str) -> bool {
    ["HGHT", "DRCT"].iter().all(|name| line.split_whitespace().any(|word| word == *name))
}

/// Content of a line below the name of a column.
fn cell<'a>(header: &str, line: &'a str, name: &str) -> Option<&'a str> {
    let (before, _) = header.split_once(name)?;
    let end = before.len() + name.len();
    let cell = line.get(before.trim_end().len()..end.min(line.len()))?.trim();
    Some(cell).filter(|cell| !cell.is_empty())
}

/// The levels of a sounding with a height and a wind. Its columns end where their names end; the
/// line below the names has the units.
fn sounding(text: &str, number: usize, header: &str) -> Result<Vec<Level>, TableError> {
    let units = text.lines().nth(number).unwrap_or_default();
    let speed = if header.contains("SKNT") { "SKNT" } else { "SPED" };
    let unit = cell(header, units, speed).unwrap_or_default();
    let to_m_s = table::factor("m/s", unit)
        .map_err(|accepted| TableError::bad(number + 1, "the unit of the speed", unit, &accepted))?;
    let mut levels: Vec<Level> = Vec::new();
    let mut ground_m = None;
    for (line, number) in text.lines().zip(1..).skip(number + 1) {
        if line.starts_with('<') {
            break;
        }
        let line = if line.starts_with("---") { "" } else { line };
        let numbers = ["HGHT", speed, "DRCT"].map(|name| cell(header, line, name));
        let [Some(height), Some(speed), Some(from)] = numbers else { continue };
        let parsed = |column, found: &str| {
            let value = found.parse::<f64>().ok().filter(|value| value.is_finite());
            value.ok_or_else(|| TableError::bad(number, column, found, "a finite number is accepted"))
        };
        let altitude_m = parsed("HGHT", height)?;
        let height_m = (altitude_m - *ground_m.get_or_insert(altitude_m)).max(SURFACE_M);
        // Standard and significant levels may coincide.
        if levels.last().is_none_or(|[below_m, ..]| *below_m < height_m) {
            levels.push([height_m, parsed("the speed", speed)? * to_m_s, parsed("DRCT", from)?]);
        }
    }
    if levels.is_empty() {
        let required = format!("a line with HGHT, DRCT and {speed} below it is needed");
        return Err(TableError::bad(number, "the sounding", header.trim(), &required));
    }
    Ok(levels)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Made up, in the form of the service.
    const SOUNDING: &str = "<H2>00000 MADE UP Observations at 12Z 30 Nov 2026</H2>\n<PRE>\n\
-----------------------------------------------------------------------------\n   \
PRES   HGHT   TEMP   DWPT   RELH   MIXR   DRCT   SKNT   THTA   THTE   THTV\n    \
hPa     m      C      C      %    g/kg    deg   knot     K      K      K \n\
-----------------------------------------------------------------------------\n \
1000.0     93                                                               \n  \
952.0    489   16.0    9.0     63   7.60    230      6  293.2  315.2  294.6\n  \
952.0    489   16.0    9.0     63   7.60    230      6  293.2  315.2  294.6\n  \
925.0    733   14.2    7.1     62   6.86    245     12  293.8  313.8  295.0\n  \
900.0    967   12.0    6.0\n  \
850.0   1457    9.6   -0.4     50   4.35    360     20  296.2  309.3  297.0\n\
</PRE><H3>Station information and sounding indices</H3>\n";

    /// A knot is 1852 m/h. The surface wind is that at 10 m; levels without a wind are skipped.
    #[test]
    fn val_hand_a_sounding_counts_heights_from_its_station() {
        let knot = 1852.0 / 3600.0;
        let expected = [[10.0, 6.0 * knot, 230.0], [244.0, 12.0 * knot, 245.0], [968.0, 20.0 * knot, 360.0]];
        for (found, expected) in read(SOUNDING).unwrap().iter().zip(&expected) {
            assert!(found.iter().zip(expected).all(|(one, other)| (one - other).abs() < 1e-9), "{found:?}");
        }
        assert_eq!(read(SOUNDING).unwrap().len(), expected.len());
        let metric = SOUNDING.replace("SKNT", "SPED").replace("knot", " m/s");
        assert!((read(&metric).unwrap()[1][1] - 12.0).abs() < 1e-12);
    }

    #[test]
    fn a_table_has_its_units_in_its_header() {
        let levels = read("height_m,speed_m_s,from_deg\n2,3.5,270\n10,4.5,275\n").unwrap();
        assert_eq!(levels, [[2.0, 3.5, 270.0], [10.0, 4.5, 275.0]]);
        let levels = read("Height (ft);Speed (kn);From (deg)\n1000;10;90\n").unwrap();
        assert!((levels[0][0] - 304.8).abs() < 1e-9 && (levels[0][1] - 5.144_444).abs() < 1e-6);
    }

    #[test]
    fn an_ambiguous_unit_is_refused_with_the_accepted_ones() {
        let accepted = "a unit of m/s, km/h, kn, kt, kts, knot, knots, mph is accepted";
        for (text, words) in [
            ("height_m,speed,from_deg\n2,3,270\n", format!("line 1: speed is ''; {accepted}")),
            ("height_m,speed_m,from_deg\n2,3,270\n", format!("line 1: speed is 'm'; {accepted}")),
            ("height_m,speed_m_s,from_rad\n2,3,1\n", "line 1: from is 'rad'; deg is accepted".to_owned()),
            (
                "height_m,speed_m_s,from_deg\n2,3,north\n",
                "line 2: from is 'north'; a finite number is accepted".to_owned(),
            ),
            (
                "height,wind\n",
                "line 1: the header is 'height,wind'; a line that names height and speed and from, each with its unit, as \
                 time_s or Time (s), separated by , ; or tab, is needed"
                    .to_owned(),
            ),
        ] {
            assert_eq!(read(text).unwrap_err().to_string(), words);
        }
        let unnamed = SOUNDING.replace("knot", "    ");
        assert_eq!(
            read(&unnamed).unwrap_err().to_string(),
            format!("line 5: the unit of the speed is ''; {accepted}")
        );
        let cut = &SOUNDING[..SOUNDING.find("952.0").unwrap()];
        assert!(read(cut).unwrap_err().to_string().starts_with("line 4: the sounding is 'PRES"));
    }

    #[test]
    fn arbitrary_text_is_refused_without_a_panic() {
        for end in 0..SOUNDING.len() {
            let _ = read(&SOUNDING[..end]);
            let _ = read(&SOUNDING[..end].replace('0', "°"));
        }
    }
}

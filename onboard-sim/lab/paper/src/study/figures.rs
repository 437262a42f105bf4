//! Figures 5 to 9 of the paper from our own runs, in its axes.
//!
//! Solid: the plan from the start, the paper's "optimal descent". Dashed: the closed loop. The
//! crosses are the final positions that the paper prints.

use core::f64::consts::FRAC_PI_2;

use super::fall::{ANGLES_DEG, Fate, Moment, OPENINGS_DEG, Stability, TILTS_DEG, Vehicle};
use super::figure::{Line, Panel, lines_svg};
use super::{PaperError, Row, Sample, Table};

/// Pitch and yaw at the start of Fig. 5, degrees.
const FIG_5_START_DEG: [f64; 2] = [2.0, 1.0];
const CROSSES: &str = "the paper's final position";

/// Figures 5 to 9: file names and SVG.
///
/// # Errors
/// The fall of Fig. 5 cannot be set up, or a figure not be drawn.
pub(crate) fn figures(rows: &[Row]) -> Result<Vec<(&'static str, String)>, PaperError> {
    let of_table = |table, file, title: &str| -> Result<_, PaperError> {
        let rows: Vec<&Row> = rows.iter().filter(|row| row.case.table == table).collect();
        Ok((file, lines_svg(title, &[path_panel(&rows)], 1, Some(CROSSES))?))
    };
    Ok(vec![
        ("fig5.svg", fig_5()?),
        ("fig6.svg", fig_6(rows)?),
        of_table(Table::Pitch, "fig7.svg", "Fig. 7: initial pitch")?,
        of_table(Table::LateralVelocity, "fig8.svg", "Fig. 8: initial lateral velocity w")?,
        of_table(Table::PitchRate, "fig9.svg", "Fig. 9: initial pitch rate q")?,
    ])
}

/// The map of `paper --stability` and the margins: file names and SVG.
///
/// # Errors
/// A figure cannot be drawn.
pub(crate) fn stability_figures(stability: &Stability) -> Result<Vec<(&'static str, String)>, PaperError> {
    Ok(vec![("stability.svg", fates(stability)?), ("static-margin.svg", margins(stability)?)])
}

fn fig_5() -> Result<String, PaperError> {
    let start = FIG_5_START_DEG.map(f64::to_radians);
    let fall = Vehicle::new()?.fall(FRAC_PI_2, start, |_| false)?;
    let line = |name: &str, colour, points| Line { name: name.to_owned(), colour, dashed: false, points };
    let over_time = |of: fn(&Moment) -> f64| fall.iter().map(|now| (now.time_s, of(now))).collect::<Vec<_>>();
    let along =
        |of: fn(&Moment) -> f64| fall.iter().map(|now| (of(now), now.position_m.z)).collect::<Vec<_>>();
    let mut panels = [
        panel(
            ["horizontal position, mm", "height, m"],
            vec![
                line("x", 0, along(|now| 1e3 * now.position_m.x)),
                line("y", 1, along(|now| 1e3 * now.position_m.y)),
            ],
        ),
        panel(
            ["time, s", "earth-relative vertical velocity, m/s"],
            vec![line("vertical", 2, over_time(|now| now.velocity_m_s.z))],
        ),
        panel(
            ["time, s", "earth-relative horizontal velocity, mm/s"],
            vec![
                line("x", 0, over_time(|now| 1e3 * now.velocity_m_s.x)),
                line("y", 1, over_time(|now| 1e3 * now.velocity_m_s.y)),
            ],
        ),
        panel(
            ["time, s", "angle, deg"],
            vec![
                line("tail to the velocity", 3, over_time(|now| now.angle_to_wind_rad.to_degrees())),
                line("nose to the vertical", 4, over_time(|now| now.tilt_rad.to_degrees())),
            ],
        ),
    ];
    // The two angles coincide but for the drift.
    panels[3].lines[1].dashed = true;
    let title = "Fig. 5: passive fall, fins fully open, 2 deg of pitch and 1 deg of yaw at the start";
    Ok(lines_svg(title, &panels, 2, None)?)
}

fn fig_6(rows: &[Row]) -> Result<String, PaperError> {
    // The weights in the paper's caption; its Table 3 has 2 instead of 5.
    let drawn =
        |row: &&Row| row.case.table == Table::InputWeights && (row.case.input_weight - 2.0).abs() > 0.1;
    let rows: Vec<&Row> = rows.iter().filter(drawn).collect();
    let nominal: Vec<&Row> = rows.iter().filter(|row| row.case.is_nominal()).copied().collect();
    let over_time = |label: &str, of: fn(&Sample) -> f64| {
        panel(["time, s", label], lines(&nominal, 1, |sample| (sample.time_s, of(sample))))
    };
    let panels = [
        path_panel(&rows),
        over_time("x, m", |sample| sample.state.x_m),
        over_time("z, m", |sample| sample.state.z_m),
        over_time("pitch, deg", |sample| sample.state.theta_rad.to_degrees()),
        over_time("u, m/s", |sample| sample.state.u_m_s),
        over_time("w, m/s", |sample| sample.state.w_m_s),
        over_time("q, deg/s", |sample| sample.state.q_rad_s.to_degrees()),
        over_time("gimbal, deg", |sample| sample.gimbal_rad.to_degrees()),
    ];
    let title = "Fig. 6: descents for three input weights P, which coincide (first panel); states and input for P = 1 (others)";
    Ok(lines_svg(title, &panels, 4, Some(CROSSES))?)
}

/// The pitch plane.
fn path_panel(rows: &[&Row]) -> Panel {
    let crosses = rows
        .iter()
        .enumerate()
        .filter_map(|(place, row)| row.case.paper.map(|paper| (paper.x_m, paper.z_m, place)));
    Panel {
        crosses: crosses.collect(),
        ..panel(["x, m", "z, m"], lines(rows, 0, |sample| (sample.state.x_m, sample.state.z_m)))
    }
}

/// Plan and closed loop of each row.
fn lines(rows: &[&Row], first_colour: usize, point: impl Fn(&Sample) -> (f64, f64)) -> Vec<Line> {
    let of = |(place, row): (usize, &&Row)| {
        let name = row.case.name();
        [(&row.open_loop, "plan", false), (&row.closed_loop, "closed loop", true)].map(
            |(finish, which, dashed)| Line {
                name: format!("{name}, {which}"),
                colour: first_colour + place,
                dashed,
                points: finish.path.iter().map(&point).collect(),
            },
        )
    };
    rows.iter().enumerate().flat_map(of).collect()
}

fn panel([x_label, y_label]: [&str; 2], lines: Vec<Line>) -> Panel {
    Panel { x_label: x_label.to_owned(), y_label: y_label.to_owned(), lines, ..Panel::default() }
}

fn fates(stability: &Stability) -> Result<String, PaperError> {
    let starts =
        || OPENINGS_DEG.iter().flat_map(|opening_deg| TILTS_DEG.map(|tilt_deg| (tilt_deg, *opening_deg)));
    let falls = |wanted: Fate| {
        let falls = starts().zip(&stability.fates).filter(|(_, fate)| **fate == wanted);
        (wanted.name().to_owned(), falls.map(|(start, _)| start).collect())
    };
    let map = Panel {
        kinds: Fate::ALL.map(falls).to_vec(),
        ..panel(["tilt at the start, deg", "opening of the fins, deg"], Vec::new())
    };
    Ok(lines_svg("The paper's vehicle in a passive fall (centre of gravity at 0.52 m)", &[map], 1, None)?)
}

fn margins(stability: &Stability) -> Result<String, PaperError> {
    /// Openings that are drawn.
    const DRAWN_DEG: [f64; 4] = [0.0, 30.0, 60.0, 90.0];
    let drawn = |opening: &(usize, &f64)| DRAWN_DEG.iter().any(|deg| (deg - opening.1).abs() < 1e-9);
    let mut lines = Vec::new();
    for (colour, (place, opening_deg)) in OPENINGS_DEG.iter().enumerate().filter(drawn).enumerate() {
        for (which, dashed) in [(0, false), (1, true)] {
            let margins_m = stability.margins_m[place].iter().map(|margin_m| margin_m[which]);
            let plane = ["worst plane", "best plane"][which];
            lines.push(Line {
                name: format!("fins {opening_deg:.0} deg, {plane}"),
                colour,
                dashed,
                points: ANGLES_DEG.iter().copied().zip(margins_m).collect(),
            });
        }
    }
    let panel = panel(["angle to the wind, deg", "static margin, m (stable above 0)"], lines);
    Ok(lines_svg("Centre of pressure above the centre of gravity at 0.52 m", &[panel], 1, None)?)
}

#[cfg(test)]
mod tests {
    use super::super::experiments;
    use super::*;

    #[test]
    fn the_figures_have_the_papers_numbers_axes_and_cases() {
        let figures = figures(&experiments().rows).unwrap();
        let names: Vec<&str> = figures.iter().map(|(name, _)| *name).collect();
        assert_eq!(names, ["fig5.svg", "fig6.svg", "fig7.svg", "fig8.svg", "fig9.svg"]);
        for (text, place) in [
            ("earth-relative vertical velocity, m/s", 0),
            ("P = 5, plan", 1),
            ("gimbal, deg", 1),
            ("theta0 = 120 deg, closed loop", 2),
            ("w0 = -1 m/s, plan", 3),
            ("q0 = +5 deg/s, plan", 4),
        ] {
            assert!(figures[place].1.contains(text), "{text}");
        }
    }
}

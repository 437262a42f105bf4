//! The list of plots, and the limits of their values.

use protocol::log::v1::{LandingVerdict as RecordedVerdict, LimitResult};

use crate::survey::Survey;

/// A plot: its name with its unit, as in its entity path, and its title.
pub(crate) struct Plot {
    pub(crate) name: &'static str,
    pub(crate) title: &'static str,
    /// Whether to show a legend: it covers much of a plot, and the colours mean the same in all plots.
    pub(crate) legend: bool,
}

/// Every plot of a ground station's telemetry, in the order of the layout.
const TELEMETRY: [Plot; 10] = [
    Plot { name: "altitude_m", title: "Altitude, m", legend: true },
    Plot { name: "x_m", title: "Horizontal position, m", legend: false },
    Plot { name: "u_m_s", title: "Axial velocity u, m/s", legend: false },
    Plot { name: "w_m_s", title: "Lateral velocity w, m/s", legend: false },
    Plot { name: "pitch_error_deg", title: "Pitch from upright, deg", legend: false },
    Plot { name: "q_deg_s", title: "Pitch rate q, deg/s", legend: false },
    Plot { name: "gimbal_deg", title: "Gimbal, deg", legend: true },
    Plot { name: "solve_time_ms", title: "Solve time, ms", legend: false },
    Plot { name: "iterations", title: "Newton iterations", legend: false },
    Plot { name: "level", title: "Control level (0 idle, 2 converged, 5 stabiliser)", legend: false },
];

/// Every plot of a vehicle's own log, in the order of the layout.
const VEHICLE: [Plot; 12] = [
    Plot { name: "altitude_m", title: "Height of the feet, m", legend: false },
    Plot { name: "vertical_m_s", title: "Vertical speed, m/s", legend: false },
    Plot { name: "x_m", title: "Position x, m", legend: false },
    Plot { name: "y_m", title: "Position y, m", legend: false },
    Plot { name: "lateral_m_s", title: "Lateral speed, m/s", legend: false },
    Plot { name: "tilt_deg", title: "Tilt, deg", legend: false },
    Plot { name: "gimbal_pitch_deg", title: "Gimbal in pitch, deg", legend: true },
    Plot { name: "gimbal_yaw_deg", title: "Gimbal in yaw, deg", legend: false },
    Plot { name: "fins_mean_deg", title: "Fins, mean opening, deg", legend: false },
    Plot { name: "thrust_n", title: "Thrust, N", legend: false },
    Plot { name: "solve_time_ms", title: "Time of a frame that plans, ms", legend: false },
    Plot { name: "iterations", title: "Newton iterations, run again", legend: false },
];

/// Every plot that a log may have.
pub(crate) fn plots_of(survey: &Survey) -> &'static [Plot] {
    if survey.of_vehicle { &VEHICLE } else { &TELEMETRY }
}

/// The plots of a gimbal with two axes.
pub(crate) const GIMBAL_IN_SPACE: [&str; 2] = ["gimbal_pitch_deg", "gimbal_yaw_deg"];

/// A range that a plotted value should stay in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PlotLimit {
    /// The plot's name.
    pub(crate) plot: &'static str,
    /// Lowest value, in the plot's unit.
    pub(crate) lowest: f64,
    /// Highest value, in the plot's unit.
    pub(crate) highest: f64,
}

/// The plot of a number that the landing verdict judges, by the verdict's name for it.
pub(crate) fn plot_of_verdict(name: &str) -> Option<&'static str> {
    Some(match name {
        "x" => "x_m",
        "altitude" => "altitude_m",
        "pitch error" => "pitch_error_deg",
        "u" => "u_m_s",
        "w" => "w_m_s",
        "pitch rate" => "q_deg_s",
        "vertical speed" => "vertical_m_s",
        "lateral speed" => "lateral_m_s",
        "tilt" => "tilt_deg",
        _ => return None,
    })
}

/// The limits of the landing, from the recorded verdict, and those of the gimbal.
pub(crate) fn limits_of(survey: &Survey, verdict: Option<&RecordedVerdict>) -> Vec<PlotLimit> {
    let limit = |judged: &LimitResult| {
        let (lowest, highest) = (judged.minimum, judged.maximum);
        plot_of_verdict(&judged.name).map(|plot| PlotLimit { plot, lowest, highest })
    };
    let mut limits: Vec<PlotLimit> =
        verdict.iter().flat_map(|verdict| &verdict.limits).filter_map(limit).collect();
    if let Some(mission) = &survey.mission {
        let limit_deg = mission.airframe.gimbal.limit_rad().to_degrees();
        for plot in GIMBAL_IN_SPACE {
            limits.push(PlotLimit { plot, lowest: -limit_deg, highest: limit_deg });
        }
    }
    limits
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_of_the_verdict_has_a_plot() {
        for (judged, plots) in [
            ("x", &TELEMETRY[..]),
            ("altitude", &TELEMETRY),
            ("pitch error", &TELEMETRY),
            ("u", &TELEMETRY),
            ("w", &TELEMETRY),
            ("pitch rate", &TELEMETRY),
            ("vertical speed", &VEHICLE),
            ("lateral speed", &VEHICLE),
            ("tilt", &VEHICLE),
        ] {
            let plot = plot_of_verdict(judged).unwrap();
            assert!(plots.iter().any(|known| known.name == plot), "{plot}");
        }
        assert_eq!(plot_of_verdict("colour"), None);
    }
}

//! A vehicle as OpenRocket simulates it: the table that it exports of a flight.

use super::table::{self, TableError};

/// The vehicle on the pad, with its motor full; `None`: the table has no such column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Simulated {
    pub mass_kg: f64,
    /// Centre of gravity, from the tip of the nose towards the tail, m.
    pub cg_below_nose_m: Option<f64>,
    /// About a cross axis through that centre of gravity.
    pub pitch_inertia_kg_m2: Option<f64>,
    pub roll_inertia_kg_m2: Option<f64>,
    /// The body's largest cross section, unless the design states another.
    pub reference_area_m2: Option<f64>,
}

/// Reads the first row of an exported flight, in whatever units and order its columns are.
///
/// # Errors
/// It has no row with time and mass, a unit is unknown, or one of its stages separates.
pub fn read(text: &str) -> Result<Simulated, TableError> {
    let wanted = [
        ("time", "s"),
        ("mass", "kg"),
        ("cg location", "m"),
        ("longitudinal moment of inertia", "kg m2"),
        ("rotational moment of inertia", "kg m2"),
        ("reference area", "m2"),
    ];
    if let Some((_, line)) = text.lines().zip(1..).find(|(line, _)| line.contains("STAGE_SEPARATION")) {
        let required = "simulate the landing vehicle alone, without its booster";
        return Err(TableError::bad(line, "the event", "STAGE_SEPARATION", required));
    }
    let first = table::rows(text, &wanted, 2)?.next().transpose()?;
    let Some((_, [_, Some(mass_kg), cg, pitch, roll, area])) = first else {
        return Err(TableError::bad(
            text.lines().count(),
            "the table",
            "",
            "a row with the motor full is needed",
        ));
    };
    Ok(Simulated {
        mass_kg,
        cg_below_nose_m: cg,
        pitch_inertia_kg_m2: pitch,
        roll_inertia_kg_m2: roll,
        reference_area_m2: area,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The head and first row of github.com/psas/Launch-10, sim/launch-output_sim.csv (OpenRocket
    /// 13.05), without columns that are not read. Its README has mass and centre of gravity: 34.069
    /// kg, 241 cm from the nose, 14.0 cm of diameter.
    const LAUNCH_10: &str = "# Brothers Summer 2013 (Up to date)\n\
        # 1098 data points written for 54 variables.\n\
        # Simulation warnings:\n\
        #   Recovery device deployment at high speed (24.4 m/s).\n\
        #\n\
        # Time (s),Altitude (m),Mass (g),Propellant mass (g),Longitudinal moment of inertia (kg·m²),Rotational moment of inertia \
        (kg·m²),CP location (cm),CG location (cm),Stability margin calibers (),Thrust (N),Drag coefficient (),Axial drag coefficient \
        (),Reference length (cm),Reference area (cm²),Vertical orientation (zenith) (°)\n\
        # Event LAUNCH occurred at t=0 seconds\n\
        # Event IGNITION occurred at t=0 seconds\n\
        0,0,34066,6961.8,39.48,0.12767,NaN,240.92,NaN,329.5,0.7135,9.4393e-6,13.97,153.28,89\n\
        0.01,0,34066,6961.8,39.48,0.12767,NaN,240.92,NaN,706.26,0.71511,9.4607e-6,13.97,153.28,89\n";

    #[test]
    fn val_launch_10_the_first_row_is_the_vehicle_with_its_motor_full() {
        let found = read(LAUNCH_10).unwrap();
        assert!((found.mass_kg - 34.069).abs() < 0.005, "{found:?}");
        assert!((found.cg_below_nose_m.unwrap() - 2.41).abs() < 0.005, "{found:?}");
        let diameter_m = (found.reference_area_m2.unwrap() * 4.0 / core::f64::consts::PI).sqrt();
        assert!((diameter_m - 0.14).abs() < 0.000_5, "{diameter_m}");
        assert_eq!((found.pitch_inertia_kg_m2, found.roll_inertia_kg_m2), (Some(39.48), Some(0.127_67)));
    }

    #[test]
    fn other_units_and_a_missing_column() {
        let found = read("Mass (lb);CG location (in);Time (s)\n2;10;0\n").unwrap();
        assert!(
            (found.mass_kg - 0.907_184_74).abs() < 1e-12
                && (found.cg_below_nose_m.unwrap() - 0.254).abs() < 1e-12
        );
        assert_eq!(found.pitch_inertia_kg_m2, None);
    }

    #[test]
    fn a_rocket_with_its_booster_and_a_table_without_rows_are_refused() {
        let text = format!("{LAUNCH_10}# Event STAGE_SEPARATION occurred at t=1.2 seconds\n");
        let error = read(&text).unwrap_err().to_string();
        assert!(
            error.starts_with("line 11: the event is 'STAGE_SEPARATION'; simulate the landing vehicle alone"),
            "{error}"
        );
        let error = read("time (s),mass (g)\n# nothing\n").unwrap_err().to_string();
        assert!(error.ends_with("a row with the motor full is needed"), "{error}");
    }
}

//! The motors that come with the program, by name. Each file carries its origin in its header.

use crate::thrust_curve::{ThrustCurve, ThrustCurveError};

/// Name and RASP text of every built-in motor.
const BUILTIN: &[(&str, &str)] = &[
    ("F10", include_str!("../motors/Apogee_F10.eng")),
    ("F30", include_str!("../motors/Cesaroni_73F30-6A.eng")),
    ("G12", include_str!("../motors/AeroTech_G12ST.eng")),
    ("G33", include_str!("../motors/Cesaroni_143G33-9A.eng")),
    ("H42", include_str!("../motors/Cesaroni_186H42-10A.eng")),
    ("H45W", include_str!("../motors/AeroTech_H45.eng")),
    ("H53", include_str!("../motors/Cesaroni_234H53-12A.eng")),
];

/// A built-in motor that cannot be had.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MotorError {
    /// No motor has this name.
    #[error("no motor is named '{name}'; these are built in: {known}")]
    Unknown {
        /// The name asked for.
        name: String,
        /// The names there are.
        known: String,
    },
    /// The file does not parse.
    #[error("motor '{name}'")]
    Unusable {
        /// The motor's name.
        name: &'static str,
        /// Why.
        #[source]
        source: ThrustCurveError,
    },
}

/// The names of the built-in motors, sorted.
pub fn names() -> impl Iterator<Item = &'static str> {
    BUILTIN.iter().map(|(name, _)| *name)
}

/// The built-in motor of a name.
///
/// # Errors
///
/// [`MotorError::Unknown`] lists the names there are.
pub fn builtin(name: &str) -> Result<ThrustCurve, MotorError> {
    let Some((name, text)) = BUILTIN.iter().find(|(known, _)| *known == name) else {
        let known = names().collect::<Vec<_>>().join(", ");
        return Err(MotorError::Unknown { name: name.to_owned(), known });
    };
    ThrustCurve::from_rasp(text).map_err(|source| MotorError::Unusable { name, source })
}

/// The motor that an airframe names: a built-in one, or the text of its own file, RASP (`.eng`) or RockSim (`.rse`).
/// With the text a mission, and the log of its flight, stand by themselves.
///
/// # Errors
///
/// There is no motor of that name, or the text is that of no motor.
pub fn named(motor: &str) -> Result<ThrustCurve, MotorError> {
    if !motor.contains('\n') {
        return builtin(motor);
    }
    let curve = if motor.trim_start().starts_with('<') {
        ThrustCurve::from_rocksim(motor)
    } else {
        ThrustCurve::from_rasp(motor)
    };
    curve.map_err(|source| MotorError::Unusable { name: "of the airframe", source })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Impulse (N s) of each motor as its maker or certifier states it, and the share the file's curve may be off.
    #[test]
    fn val_catalogue_impulse_of_the_builtin_motors() {
        for (name, impulse_n_s, share) in [
            ("F10", 76.3, 0.03),
            ("F30", 73.1, 0.01),
            ("G12", 144.0, 0.02),
            ("G33", 143.1, 0.005),
            ("H42", 186.0, 0.005),
            ("H45W", 289.0, 0.01),
            ("H53", 234.2, 0.005),
        ] {
            let motor = builtin(name).unwrap();
            let found = motor.total_impulse_n_s();
            assert!((found / impulse_n_s - 1.0).abs() < share, "{name}: {found} N s, stated {impulse_n_s}");
        }
    }

    #[test]
    fn every_builtin_motor_parses_and_carries_its_origin() {
        for (name, text) in BUILTIN {
            let motor = builtin(name).unwrap();
            assert!(name.starts_with(motor.name().trim_end_matches('W')), "{name}: {}", motor.name());
            assert!(text.starts_with("; origin:") || text.starts_with("; DERIVED"), "{name}");
        }
        assert!(names().is_sorted());
    }

    #[test]
    fn an_unknown_name_is_answered_with_the_known_ones() {
        let error = builtin("Z99").unwrap_err().to_string();
        assert_eq!(error, "no motor is named 'Z99'; these are built in: F10, F30, G12, G33, H42, H45W, H53");
    }

    #[test]
    fn an_airframe_may_bring_its_motors_own_file() {
        let (_, rasp) = BUILTIN.iter().find(|(name, _)| *name == "H45W").expect("built in");
        assert_eq!(named(rasp), builtin("H45W"));
        let rocksim = r#"<engine-database><engine-list><engine mfg="M" code="X10" dia="24" len="70" initWt="50"
            propWt="20"><data><eng-data t="0" f="0"/><eng-data t="0.1" f="10"/><eng-data t="2" f="10"/>
            <eng-data t="2.1" f="0"/></data></engine></engine-list></engine-database>"#;
        let curve = named(rocksim).expect("a motor");
        assert!((curve.total_impulse_n_s() - 20.0).abs() < 1e-9, "{}", curve.total_impulse_n_s());
        let refused = named("<engine-database>\n</engine-database>").expect_err("no motor in it");
        assert!(refused.to_string().contains("of the airframe"), "{refused}");
        assert!(named("H4").expect_err("no such motor").to_string().contains("H45W"));
    }
}

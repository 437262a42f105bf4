//! Mass, centre of gravity and inertia as the propellant burns.

use super::Mass;

/// The mass properties at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassProperties {
    pub mass_kg: f64,
    /// Centre of gravity, m above the nozzle: also the arm of the thrust.
    pub cg_station_m: f64,
    /// Moment of inertia about the pitch or yaw axis through the centre of gravity, kg m^2.
    pub pitch_inertia_kg_m2: f64,
    /// Moment of inertia about the roll axis, kg m^2.
    pub roll_inertia_kg_m2: f64,
    /// Change of the pitch inertia per kilogram burnt, m^2; negative.
    pub pitch_inertia_slope_m2: f64,
}

/// The vehicle without propellant, and the place of the propellant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassModel {
    dry_mass_kg: f64,
    dry_cg_station_m: f64,
    dry_pitch_inertia_kg_m2: f64,
    roll_inertia_kg_m2: f64,
    propellant_mass_kg: f64,
    propellant_station_m: f64,
}

impl MassModel {
    /// Removes the propellant, a point mass on the axis, from the loaded vehicle (parallel axes).
    pub fn new(mass: &Mass, propellant_mass_kg: f64) -> Self {
        let dry_mass_kg = mass.loaded_kg - propellant_mass_kg;
        let moment_kg_m = mass.loaded_kg * mass.loaded_cg_station_m;
        let dry_cg_station_m = (moment_kg_m - propellant_mass_kg * mass.propellant_station_m) / dry_mass_kg;
        let reduced_kg = dry_mass_kg * propellant_mass_kg / mass.loaded_kg;
        let apart_m = dry_cg_station_m - mass.propellant_station_m;
        Self {
            dry_mass_kg,
            dry_cg_station_m,
            dry_pitch_inertia_kg_m2: mass.loaded_pitch_inertia_kg_m2 - reduced_kg * apart_m * apart_m,
            roll_inertia_kg_m2: mass.roll_inertia_kg_m2,
            propellant_mass_kg,
            propellant_station_m: mass.propellant_station_m,
        }
    }

    /// Mass without propellant, kg.
    pub fn dry_mass_kg(&self) -> f64 {
        self.dry_mass_kg
    }

    /// The same vehicle with all masses and inertias scaled.
    #[must_use]
    pub fn scaled(self, scale: f64) -> Self {
        Self {
            dry_mass_kg: self.dry_mass_kg * scale,
            dry_pitch_inertia_kg_m2: self.dry_pitch_inertia_kg_m2 * scale,
            roll_inertia_kg_m2: self.roll_inertia_kg_m2 * scale,
            propellant_mass_kg: self.propellant_mass_kg * scale,
            ..self
        }
    }

    /// The mass properties after some propellant has burnt, kg (limited to between none and all).
    pub fn at(&self, burnt_kg: f64) -> MassProperties {
        let left_kg = self.propellant_mass_kg - burnt_kg.clamp(0.0, self.propellant_mass_kg);
        let mass_kg = self.dry_mass_kg + left_kg;
        let moment_kg_m = self.dry_mass_kg * self.dry_cg_station_m + left_kg * self.propellant_station_m;
        let apart_m = self.dry_cg_station_m - self.propellant_station_m;
        let dry_share = self.dry_mass_kg / mass_kg;
        MassProperties {
            mass_kg,
            cg_station_m: moment_kg_m / mass_kg,
            pitch_inertia_kg_m2: self.dry_pitch_inertia_kg_m2 + left_kg * dry_share * apart_m * apart_m,
            roll_inertia_kg_m2: self.roll_inertia_kg_m2,
            pitch_inertia_slope_m2: -dry_share * dry_share * apart_m * apart_m,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A 2 kg vehicle at 1 m with 1 kg of propellant at 0.25 m, worked by hand.
    #[test]
    fn val_hand_parallel_axes() {
        let loaded = Mass {
            loaded_kg: 3.0,
            loaded_cg_station_m: 0.75,
            loaded_pitch_inertia_kg_m2: 0.5,
            roll_inertia_kg_m2: 0.01,
            propellant_station_m: 0.25,
        };
        let model = MassModel::new(&loaded, 1.0);
        let full = model.at(0.0);
        assert!((full.mass_kg - 3.0).abs() < 1e-15 && (full.cg_station_m - 0.75).abs() < 1e-15);
        assert!((full.pitch_inertia_kg_m2 - 0.5).abs() < 1e-15);
        let empty = model.at(1.0);
        assert!((empty.mass_kg - 2.0).abs() < 1e-15 && (empty.cg_station_m - 1.0).abs() < 1e-15);
        // 0.5 - 2 (0.25)^2 - 1 (0.5)^2
        assert!((empty.pitch_inertia_kg_m2 - 0.125).abs() < 1e-15);
        let half = model.at(0.5);
        assert!((half.cg_station_m - 2.125 / 2.5).abs() < 1e-15);
        // 0.125 + 2 (0.15)^2 + 0.5 (0.6)^2
        assert!((half.pitch_inertia_kg_m2 - 0.35).abs() < 1e-15);
        let slope = (model.at(0.5001).pitch_inertia_kg_m2 - model.at(0.4999).pitch_inertia_kg_m2) / 2e-4;
        assert!((half.pitch_inertia_slope_m2 - slope).abs() < 1e-6);
    }
}

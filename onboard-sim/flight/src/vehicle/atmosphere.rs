//! The air by height: U.S. Standard Atmosphere, 1976 (NOAA-S/T 76-1562), to 20 km.
//!
//! It has the standard's first two layers: temperature falls by 6.5 K per kilometre of geopotential
//! height up to 11 km and is 216.65 K above. Heights are above mean sea level. The standard's
//! lowest layer is used down to -5 km, and a height outside -5 to 20 km gets the air of the nearest
//! end.
//!
//! A warmer day has the standard's pressure at each height, as density altitude is computed in
//! aviation. [`Site`](super::site::Site) has the air of a flight.

pub const STANDARD_GRAVITY_M_S2: f64 = 9.806_65;

/// The standard's radius of the Earth, which converts geometric into geopotential height, m.
const EARTH_RADIUS_M: f64 = 6_356_766.0;
/// Universal gas constant of the standard divided by the molar mass of air, J/(kg K).
const GAS_CONSTANT_J_KG_K: f64 = 8.314_32 / 0.028_964_4;
const SEA_LEVEL_TEMPERATURE_K: f64 = 288.15;
const SEA_LEVEL_PRESSURE_PA: f64 = 101_325.0;
const LAPSE_K_M: f64 = 0.006_5;
const TROPOPAUSE_M: f64 = 11_000.0;
const TROPOPAUSE_TEMPERATURE_K: f64 = SEA_LEVEL_TEMPERATURE_K - LAPSE_K_M * TROPOPAUSE_M;
/// Exponent of pressure over temperature in the lowest layer: 5.2559.
const EXPONENT: f64 = STANDARD_GRAVITY_M_S2 / (GAS_CONSTANT_J_KG_K * LAPSE_K_M);
const LOWEST_M: f64 = -5_000.0;
const HIGHEST_M: f64 = 20_000.0;

/// The air at one height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Air {
    pub temperature_k: f64,
    pub pressure_pa: f64,
    pub density_kg_m3: f64,
    /// Derivative of the density by height, kg/m^4; negative.
    pub density_gradient_kg_m4: f64,
}

impl Air {
    /// The standard air at a geopotential height, m.
    pub fn at_geopotential_m(height_m: f64) -> Self {
        Self::warmer_at_geopotential_m(height_m, 0.0)
    }

    /// The air at a geopotential height, m, on a day that is warmer than the standard by this much,
    /// K.
    pub fn warmer_at_geopotential_m(height_m: f64, warmer_k: f64) -> Self {
        let height_m = height_m.clamp(LOWEST_M, HIGHEST_M);
        let standard_k = SEA_LEVEL_TEMPERATURE_K - LAPSE_K_M * height_m.min(TROPOPAUSE_M);
        let mut pressure_pa =
            SEA_LEVEL_PRESSURE_PA * libm::pow(standard_k / SEA_LEVEL_TEMPERATURE_K, EXPONENT);
        if height_m > TROPOPAUSE_M {
            pressure_pa *= libm::exp((TROPOPAUSE_M - height_m) / isothermal_scale_height_m());
        }
        let temperature_k = standard_k + warmer_k;
        let density_kg_m3 = pressure_pa / (GAS_CONSTANT_J_KG_K * temperature_k);
        let lapse_k_m = if height_m < TROPOPAUSE_M { LAPSE_K_M } else { 0.0 };
        let share_per_m =
            lapse_k_m / temperature_k - STANDARD_GRAVITY_M_S2 / (GAS_CONSTANT_J_KG_K * standard_k);
        let density_gradient_kg_m4 = density_kg_m3 * share_per_m;
        Self { temperature_k, pressure_pa, density_kg_m3, density_gradient_kg_m4 }
    }
}

fn isothermal_scale_height_m() -> f64 {
    GAS_CONSTANT_J_KG_K * TROPOPAUSE_TEMPERATURE_K / STANDARD_GRAVITY_M_S2
}

/// Geopotential height of a geometric height, m.
pub fn geopotential_m(height_m: f64) -> f64 {
    EARTH_RADIUS_M * height_m / (EARTH_RADIUS_M + height_m)
}

/// The geopotential height at which the standard has a pressure, m, which is a barometer's height.
/// The result is limited to -5 to 20 km; a pressure that is not a positive number gives the top.
pub fn pressure_altitude_m(pressure_pa: f64) -> f64 {
    let ratio = pressure_pa / SEA_LEVEL_PRESSURE_PA;
    if ratio.is_nan() || ratio <= 0.0 {
        return HIGHEST_M;
    }
    let in_lowest_layer_m = SEA_LEVEL_TEMPERATURE_K / LAPSE_K_M * (1.0 - libm::pow(ratio, 1.0 / EXPONENT));
    let height_m = if in_lowest_layer_m <= TROPOPAUSE_M {
        in_lowest_layer_m
    } else {
        let tropopause_pa = Air::at_geopotential_m(TROPOPAUSE_M).pressure_pa;
        TROPOPAUSE_M + isothermal_scale_height_m() * libm::log(tropopause_pa / pressure_pa)
    };
    height_m.clamp(LOWEST_M, HIGHEST_M)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Geopotential height m, temperature K, pressure Pa, density kg/m^3.
    const TABLE: [(f64, f64, f64, f64); 8] = [
        (0.0, 288.150, 101_325.0, 1.225_00),
        (1_000.0, 281.650, 89_874.6, 1.111_64),
        (2_000.0, 275.150, 79_495.2, 1.006_49),
        (3_000.0, 268.650, 70_108.5, 0.909_122),
        (5_000.0, 255.650, 54_019.9, 0.736_116),
        (8_000.0, 236.150, 35_599.8, 0.525_168),
        (10_000.0, 223.150, 26_436.3, 0.412_707),
        (11_000.0, 216.650, 22_632.1, 0.363_918),
    ];

    #[test]
    fn val_coesa_1976_table() {
        for (height_m, temperature_k, pressure_pa, density_kg_m3) in TABLE {
            let air = Air::at_geopotential_m(height_m);
            for (name, found, expected) in [
                ("temperature", air.temperature_k, temperature_k),
                ("pressure", air.pressure_pa, pressure_pa),
                ("density", air.density_kg_m3, density_kg_m3),
            ] {
                assert!(
                    (found / expected - 1.0).abs() < 5e-6,
                    "{name} at {height_m} m: {found}, the standard has {expected}"
                );
            }
        }
    }

    /// The standard's own pair: 11,019 m geometric is 11,000 m geopotential.
    #[test]
    fn val_coesa_1976_geopotential_height() {
        assert!((geopotential_m(11_019.1) - 11_000.0).abs() < 0.1);
    }

    #[test]
    fn pressure_altitude_is_the_inverse_of_pressure() {
        for height_m in [-1_000.0, 0.0, 350.0, 9_999.0, 11_000.0, 15_000.0] {
            let pressure_pa = Air::at_geopotential_m(height_m).pressure_pa;
            let found_m = pressure_altitude_m(pressure_pa);
            assert!((found_m - height_m).abs() < 1e-6, "{height_m}: {found_m}");
        }
        for nonsense in [f64::NAN, 0.0, -5.0] {
            assert!((pressure_altitude_m(nonsense) - HIGHEST_M).abs() < f64::EPSILON, "{nonsense}");
        }
    }

    #[test]
    fn the_density_gradient_is_the_slope_of_the_density() {
        for (height_m, warmer_k) in
            [(0.0, 0.0), (300.0, 0.0), (5_000.0, 0.0), (15_000.0, 0.0), (600.0, 25.0), (15_000.0, -30.0)]
        {
            let at = |height_m: f64| Air::warmer_at_geopotential_m(height_m, warmer_k);
            let slope = (at(height_m + 1.0).density_kg_m3 - at(height_m - 1.0).density_kg_m3) / 2.0;
            let found = at(height_m).density_gradient_kg_m4;
            assert!((found / slope - 1.0).abs() < 1e-6, "{height_m}: {found} and {slope}");
        }
    }
}

//! The launch site: where the pad lies on the Earth, its air and its ground. The computer, the
//! simulated world, the hazard radii, the card and the check all use the same one.

use core::fmt;

use serde::{Deserialize, Serialize};

use super::atmosphere::{Air, geopotential_m};

const ZERO_CELSIUS_K: f64 = 273.15;

/// The site of a launch and the temperature of its day. The default is level, at sea level, with
/// standard air.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Site {
    /// Latitude of the pad, degrees, north positive, -85 to 85, because close to a pole a path to
    /// the east circles the pole.
    pub latitude_deg: f64,
    /// Longitude of the pad, degrees, east positive, -180 to 180.
    pub longitude_deg: f64,
    /// Altitude of the pad above mean sea level, m, -450 to 6000.
    pub altitude_m: f64,
    /// Air temperature at the pad, degrees Celsius, -40 to 60; `None` is the standard's at this
    /// altitude.
    pub temperature_c: Option<f64>,
    /// Slope of the ground in each horizontal direction, one standard deviation, degrees.
    pub ground_slope_deg: f64,
}

impl Site {
    /// The air at a height above the pad, m. The whole column differs from the standard's
    /// temperature as the air at the pad does.
    pub fn air_at_m(&self, above_pad_m: f64) -> Air {
        let warmer_k = self.temperature_c.map_or(0.0, |pad_c| {
            pad_c + ZERO_CELSIUS_K - Air::at_geopotential_m(geopotential_m(self.altitude_m)).temperature_k
        });
        Air::warmer_at_geopotential_m(geopotential_m(self.altitude_m + above_pad_m), warmer_k)
    }
}

impl fmt::Display for Site {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let pad_c = self.air_at_m(0.0).temperature_k - ZERO_CELSIUS_K;
        let standard = if self.temperature_c.is_none() { " (standard)" } else { "" };
        write!(out, "{:.0} m above sea level, {pad_c:.0} °C{standard}", self.altitude_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mojave(temperature_c: Option<f64>) -> Site {
        Site { altitude_m: 625.0, temperature_c, ..Site::default() }
    }

    /// Density altitude by the formula of the National Weather Service
    /// (weather.gov/media/epz/wxcalc/densityAltitude.pdf): 940.4 hPa are 27.77 inHg, and 40 degrees
    /// Celsius are 563.67 degrees Rankine.
    #[test]
    fn val_nws_a_hot_day_has_its_density_altitude() {
        let density_altitude_ft = 145_366.0 * (1.0 - libm::pow(17.326 * 27.77 / 563.67, 0.235));
        let hot = mojave(Some(40.0)).air_at_m(0.0);
        assert!((hot.pressure_pa / 94_040.0 - 1.0).abs() < 1e-3, "{hot:?}");
        let standard = Air::at_geopotential_m(0.3048 * density_altitude_ft);
        assert!((hot.density_kg_m3 / standard.density_kg_m3 - 1.0).abs() < 1e-3, "{hot:?} {standard:?}");
    }

    #[test]
    fn the_standard_temperature_of_a_site_changes_nothing() {
        let standard_c = mojave(None).air_at_m(0.0).temperature_k - ZERO_CELSIUS_K;
        let stated = mojave(Some(standard_c));
        for above_pad_m in [0.0, 250.0, 1_000.0] {
            let (stated, standard) = (stated.air_at_m(above_pad_m), mojave(None).air_at_m(above_pad_m));
            assert!((stated.density_kg_m3 / standard.density_kg_m3 - 1.0).abs() < 1e-14, "{above_pad_m}");
        }
        let warm = mojave(Some(30.0)).air_at_m(100.0);
        assert!((warm.temperature_k - (303.15 - 0.65)).abs() < 0.01, "the lapse is the standard's: {warm:?}");
        assert_eq!(mojave(None).to_string(), "625 m above sea level, 11 °C (standard)");
    }
}

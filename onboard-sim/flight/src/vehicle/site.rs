//! The position of the pad on the Earth, for maps and for a satellite receiver's degrees. No decision depends on it.

use serde::{Deserialize, Serialize};

/// The Earth's equatorial radius, m, and its first eccentricity squared (WGS 84).
const EQUATORIAL_RADIUS_M: f64 = 6_378_137.0;
const ECCENTRICITY_SQUARED: f64 = 6.694_379_990_14e-3;

/// The position of a pad on the Earth.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Site {
    /// Latitude, degrees, north positive, -85 to 85, because close to a pole a path to the east circles the pole.
    pub latitude_deg: f64,
    /// Longitude, degrees, east positive, -180 to 180.
    pub longitude_deg: f64,
}

impl Default for Site {
    /// The field of the Friends of Amateur Rocketry in the Mojave desert.
    fn default() -> Self {
        Self { latitude_deg: 35.347, longitude_deg: -117.809 }
    }
}

impl Site {
    /// Latitude and longitude, degrees, of a place at a distance north and east of the pad, m. It uses the ellipsoid's
    /// curvature at the pad, which is accurate to a millimetre within a kilometre.
    pub fn at_deg(&self, north_m: f64, east_m: f64) -> (f64, f64) {
        let (north_radius_m, east_radius_m) = self.radii_m();
        let north_deg = (north_m / north_radius_m).to_degrees();
        let east_deg = (east_m / east_radius_m).to_degrees();
        (self.latitude_deg + north_deg, half_turn_deg(self.longitude_deg + east_deg))
    }

    /// The distance north and east of the pad, m, of a place with this latitude and longitude, degrees: the inverse of
    /// [`at_deg`](Self::at_deg).
    pub fn place_m(&self, latitude_deg: f64, longitude_deg: f64) -> (f64, f64) {
        let (north_radius_m, east_radius_m) = self.radii_m();
        let north_m = (latitude_deg - self.latitude_deg).to_radians() * north_radius_m;
        let east_m = half_turn_deg(longitude_deg - self.longitude_deg).to_radians() * east_radius_m;
        (north_m, east_m)
    }

    /// How far from the pad a radian of latitude and a radian of longitude reach, m: the ellipsoid's two radii of curvature
    /// (P. D. Groves, Principles of GNSS, Inertial, and Multisensor Integrated Navigation Systems, 2nd edition, section 2.4).
    fn radii_m(&self) -> (f64, f64) {
        let latitude_rad = self.latitude_deg.to_radians();
        let flattened = 1.0 - ECCENTRICITY_SQUARED * libm::pow(libm::sin(latitude_rad), 2.0);
        let across_m = EQUATORIAL_RADIUS_M / libm::sqrt(flattened);
        let along_m = across_m * (1.0 - ECCENTRICITY_SQUARED) / flattened;
        (along_m, across_m * libm::cos(latitude_rad))
    }
}

/// The same direction between -180 and 180 degrees.
fn half_turn_deg(angle_deg: f64) -> f64 {
    match angle_deg {
        east if east > 180.0 => east - 360.0,
        west if west < -180.0 => west + 360.0,
        within => within,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Length of a degree of latitude and of longitude at 45 degrees north on WGS 84, m: 111,131.75 and 78,846.81.
    #[test]
    fn val_wgs84_the_length_of_a_degree_matches_the_tables() {
        let site = Site { latitude_deg: 45.0, longitude_deg: 10.0 };
        let (latitude_deg, longitude_deg) = site.at_deg(1_111.317_5, 788.468_1);
        assert!((latitude_deg - 45.01).abs() < 1e-8, "{latitude_deg}");
        assert!((longitude_deg - 10.01).abs() < 1e-8, "{longitude_deg}");
        assert_eq!(site.at_deg(0.0, 0.0), (45.0, 10.0));
    }

    #[test]
    fn a_place_is_found_again_from_its_degrees() {
        for site in [Site::default(), Site { latitude_deg: -10.0, longitude_deg: 180.0 }] {
            let (latitude_deg, longitude_deg) = site.at_deg(120.5, -75.25);
            let (north_m, east_m) = site.place_m(latitude_deg, longitude_deg);
            assert!((north_m - 120.5).abs() < 1e-6 && (east_m + 75.25).abs() < 1e-6, "{north_m} {east_m}");
        }
    }

    #[test]
    fn a_place_east_of_the_date_line_has_a_western_longitude() {
        let (_, longitude_deg) = Site { latitude_deg: 0.0, longitude_deg: 180.0 }.at_deg(0.0, 111_319.5);
        assert!((longitude_deg + 179.0).abs() < 1e-4, "{longitude_deg}");
    }
}

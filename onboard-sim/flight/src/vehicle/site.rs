//! The position of the pad on the Earth, for maps and for a satellite receiver's degrees. No decision depends on it; distances
//! from it are the wire's (`protocol::motion::Degrees`).

use serde::{Deserialize, Serialize};

with_defaults! {
    /// The position of a pad on the Earth. The default is the field of the Friends of Amateur Rocketry in the Mojave desert.
    #[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize)]
    #[serde(deny_unknown_fields)]
    pub struct Site {
        /// Latitude, degrees, north positive, -85 to 85, because close to a pole a path to the east circles the pole.
        pub latitude_deg: f64 = 35.347,
        /// Longitude, degrees, east positive, -180 to 180.
        pub longitude_deg: f64 = -117.809,
    }
}

//! Widens intervals beyond the noise of a flight.
//!
//! A fit knows the noise of its samples, and not what its models lack: a crooked inertial unit, a
//! shape of the thrust that five cosines do not follow, gusts that are not the military standard's.
//! `examples/fit_coverage.rs` flies vehicles whose truth it knows in sets of dispersions whose
//! world is not the model's, fits each flight, and writes into `calibration.toml` the deviation
//! that has to be added (as squares) for 95 % of the intervals to hold the truth. What it cannot
//! make hold has the reason there instead.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{Fit, NotFound, Z_95};

const TABLE: &str = include_str!("calibration.toml");

/// The table of what intervals lack.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Table {
    /// The sets that were flown, which count alike.
    pub sets: Vec<String>,
    /// Flights of each vehicle in each set, from apogee and as many from the pad.
    pub flights: u64,
    pub seed: u64,
    /// By vehicle and parameter.
    pub vehicles: BTreeMap<String, BTreeMap<String, Entry>>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Entry {
    /// Standard deviation, in the parameter's unit.
    Wider(f64),
    /// Why no deviation makes the intervals hold.
    Not(String),
}

/// What a fit's intervals were widened by.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Calibration {
    pub vehicles: Vec<String>,
    /// Flights of all of them.
    pub flights: u64,
    pub sets: Vec<String>,
    /// It is of this vehicle. Otherwise it is the widest of the vehicles'.
    pub own: bool,
}

impl Table {
    /// The table that stands beside this file; `None` if it is none.
    pub fn built_in() -> Option<Self> {
        toml::from_str(TABLE).ok()
    }

    /// Widens the intervals of a flight.
    #[must_use]
    pub fn applied(&self, mut fit: Fit) -> Fit {
        let own = self.vehicles.get(&fit.mission);
        for parameter in &mut fit.found {
            let entries = match own {
                Some(own) => vec![own.get(&parameter.name)],
                None => self.vehicles.values().map(|vehicle| vehicle.get(&parameter.name)).collect(),
            };
            match widest(&entries) {
                Ok(wider) => {
                    parameter.sigma = libm::hypot(parameter.sigma, wider);
                    parameter.low = parameter.value - Z_95 * parameter.sigma;
                    parameter.high = parameter.value + Z_95 * parameter.sigma;
                    parameter.systematic = Some(wider);
                }
                Err(reason) => {
                    fit.not_calibrated
                        .push(NotFound { name: parameter.name.clone(), reason: reason.to_owned() });
                }
            }
        }
        let vehicles: Vec<String> = match own {
            Some(_) => vec![fit.mission.clone()],
            None => self.vehicles.keys().cloned().collect(),
        };
        let flights = self.flights * (vehicles.len() * self.sets.len()) as u64;
        fit.calibration =
            Some(Calibration { vehicles, flights, sets: self.sets.clone(), own: own.is_some() });
        fit
    }
}

/// The widest of what the vehicles need, or the reason of one that cannot have it.
fn widest<'a>(entries: &[Option<&'a Entry>]) -> Result<f64, &'a str> {
    entries.iter().try_fold(0.0, |widest: f64, entry| match entry {
        Some(Entry::Wider(sigma)) => Ok(widest.max(*sigma)),
        Some(Entry::Not(reason)) => Err(reason.as_str()),
        None => Err("no simulated flight has a truth to compare it with"),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::{Basis, Parameter};

    fn fit(mission: &str) -> Fit {
        let names = ["thrust_scale", "lidar_noise", "updraught_rms"];
        let found = names.map(|name| Parameter::normal(name, "", 1.0, 0.03)).to_vec();
        Fit { found, ..Fit::of("", mission, "", Basis::default()) }
    }

    /// 0.03 of noise and 0.04 that the models lack are 0.05.
    #[test]
    fn val_hand_a_calibrated_vehicle_uses_its_row_and_another_one_the_widest() {
        let table: Table = toml::from_str(
            "sets = ['real']\nflights = 7\nseed = 1\n[vehicles.a]\nthrust_scale = 0.04\nlidar_noise = 'grass'\n\
             [vehicles.b]\nthrust_scale = 0.0\nlidar_noise = 0.1\n",
        )
        .unwrap();
        let own = table.applied(fit("a"));
        let thrust = own.get("thrust_scale").unwrap();
        assert!((thrust.sigma - 0.05).abs() < 1e-12 && thrust.systematic == Some(0.04), "{thrust:?}");
        assert!((thrust.high - 1.0 - Z_95 * 0.05).abs() < 1e-12, "{thrust:?}");
        let reasons: Vec<&str> = own.not_calibrated.iter().map(|lack| lack.reason.as_str()).collect();
        assert_eq!(reasons, ["grass", "no simulated flight has a truth to compare it with"]);
        assert!((own.get("lidar_noise").unwrap().sigma - 0.03).abs() < 1e-12, "that of the noise alone");
        assert!(table.applied(fit("b")).get("thrust_scale").unwrap().sigma < 0.031);
        let other = table.applied(fit("c"));
        assert!((other.get("thrust_scale").unwrap().sigma - 0.05).abs() < 1e-12, "the widest");
        let calibration = other.calibration.unwrap();
        assert!(!calibration.own && calibration.flights == 14 && calibration.vehicles == ["a", "b"]);
    }

    #[test]
    fn the_table_that_is_built_in_can_be_read() {
        let Table { vehicles, .. } = Table::built_in().unwrap();
        assert!(["mk2", "mk3"].iter().all(|vehicle| vehicles[*vehicle].contains_key("thrust_scale")));
    }
}

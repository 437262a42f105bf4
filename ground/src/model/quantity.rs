//! Every number that can be pinned to the screen or plotted over time.

use std::time::Duration;

use protocol::dialect::{TD_CONTROLLER_DATA, TD_DESCENT_DATA};

use super::Model;
use super::motion::{Attitude, BodySpeed, Motion};
use super::vehicle::{Sample, Vehicle};

/// A number of the telemetry or of the link, in the unit of the screen.
pub struct Quantity {
    /// Unique, in lower case.
    pub name: &'static str,
    pub unit: &'static str,
    pub decimals: usize,
    read: fn(&Model, Duration) -> Option<Sample<f64>>,
}

impl PartialEq for Quantity {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl std::fmt::Debug for Quantity {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(self.name)
    }
}

impl Quantity {
    /// The present value; `None` while it is not known.
    pub fn read(&self, model: &Model, now: Duration) -> Option<Sample<f64>> {
        (self.read)(model, now).filter(|sample| sample.value.is_finite())
    }

    /// Its place in [`ALL`].
    pub fn place(&self) -> usize {
        ALL.iter().position(|quantity| quantity == self).unwrap_or(0)
    }

    /// The quantity of this name.
    pub fn named(name: &str) -> Option<&'static Self> {
        ALL.iter().find(|quantity| quantity.name == name)
    }
}

/// How many quantities there are.
pub const COUNT: usize = 36;

pub static ALL: [Quantity; COUNT] = [
    Quantity { name: "height", unit: "m", decimals: 1, read: |model, _| model.vehicle.height_m() },
    Quantity {
        name: "vertical speed",
        unit: "m/s",
        decimals: 1,
        read: |model, _| model.vehicle.vertical_m_s(),
    },
    Quantity {
        name: "horizontal speed",
        unit: "m/s",
        decimals: 1,
        read: |m, _| motion(m, Motion::horizontal_m_s),
    },
    Quantity { name: "distance", unit: "m", decimals: 1, read: |m, _| motion(m, Motion::distance_m) },
    Quantity { name: "north", unit: "m", decimals: 1, read: |m, _| motion(m, |motion| motion.x_m) },
    Quantity { name: "east", unit: "m", decimals: 1, read: |m, _| motion(m, |motion| motion.y_m) },
    Quantity { name: "axial speed", unit: "m/s", decimals: 2, read: |m, _| body(m, |body| body.u_m_s) },
    Quantity {
        name: "lateral speed",
        unit: "m/s",
        decimals: 2,
        read: |m, _| body(m, BodySpeed::lateral_m_s),
    },
    Quantity {
        name: "tilt",
        unit: "deg",
        decimals: 1,
        read: |m, _| attitude(m, |a| a.tilt_rad.to_degrees()),
    },
    Quantity {
        name: "pitch",
        unit: "deg",
        decimals: 1,
        read: |m, _| attitude(m, |a| a.pitch_rad.to_degrees()),
    },
    Quantity {
        name: "turn rate",
        unit: "deg/s",
        decimals: 1,
        read: |m, _| attitude(m, |a| a.turn_rate_rad_s().to_degrees()),
    },
    Quantity {
        name: "gimbal pitch",
        unit: "deg",
        decimals: 2,
        read: |m, _| m.vehicle.gimbal.map(|gimbal| gimbal.map(|g| g.pitch.measured_rad.to_degrees())),
    },
    Quantity {
        name: "gimbal yaw",
        unit: "deg",
        decimals: 2,
        read: |m, _| m.vehicle.gimbal.map(|gimbal| gimbal.map(|g| g.yaw.measured_rad.to_degrees())),
    },
    Quantity { name: "fin 1", unit: "deg", decimals: 1, read: |m, _| fin(&m.vehicle, 0) },
    Quantity { name: "fin 2", unit: "deg", decimals: 1, read: |m, _| fin(&m.vehicle, 1) },
    Quantity { name: "fin 3", unit: "deg", decimals: 1, read: |m, _| fin(&m.vehicle, 2) },
    Quantity { name: "fin 4", unit: "deg", decimals: 1, read: |m, _| fin(&m.vehicle, 3) },
    Quantity { name: "apogee", unit: "m", decimals: 0, read: |m, _| descent(m, |d| d.apogee_m) },
    Quantity {
        name: "ignition height",
        unit: "m",
        decimals: 1,
        read: |m, _| descent(m, |d| d.chosen_height_m),
    },
    Quantity {
        name: "commit height",
        unit: "m",
        decimals: 1,
        read: |m, _| descent(m, |d| d.commit_height_m),
    },
    Quantity {
        name: "time to ignition",
        unit: "s",
        decimals: 1,
        read: |m, now| m.vehicle.ignition_in_s(now),
    },
    Quantity {
        name: "wind",
        unit: "m/s",
        decimals: 1,
        read: |m, _| descent(m, |d| libm::hypotf(d.wind_x_m_s, d.wind_y_m_s)),
    },
    Quantity {
        name: "touchdown north",
        unit: "m",
        decimals: 1,
        read: |m, _| descent(m, |d| d.touchdown_x_m),
    },
    Quantity { name: "touchdown east", unit: "m", decimals: 1, read: |m, _| descent(m, |d| d.touchdown_y_m) },
    Quantity { name: "drag", unit: "x", decimals: 3, read: |m, _| descent(m, |d| d.drag_scale) },
    Quantity {
        name: "time to touchdown",
        unit: "s",
        decimals: 1,
        read: |m, now| m.vehicle.touchdown_in_s(now),
    },
    Quantity {
        name: "predicted speed",
        unit: "m/s",
        decimals: 2,
        read: |m, _| m.vehicle.predicted_speed_m_s(),
    },
    Quantity {
        name: "thrust",
        unit: "x",
        decimals: 3,
        read: |m, _| solver(m, |c| f64::from(c.thrust_scale)),
    },
    Quantity {
        name: "solve time",
        unit: "ms",
        decimals: 2,
        read: |m, _| solver(m, |c| f64::from(c.solve_time_us) / 1_000.0),
    },
    Quantity {
        name: "solver margin",
        unit: "ms",
        decimals: 1,
        read: |m, _| solver(m, |c| f64::from(c.deadline_margin_us) / 1_000.0),
    },
    Quantity { name: "cost", unit: "", decimals: 1, read: |m, _| solver(m, |c| f64::from(c.cost)) },
    Quantity {
        name: "battery",
        unit: "V",
        decimals: 2,
        read: |m, _| m.vehicle.battery.map(|battery| battery.map(|battery| battery.volts)),
    },
    Quantity {
        name: "battery left",
        unit: "%",
        decimals: 0,
        read: |m, _| {
            let battery = m.vehicle.battery?;
            battery.value.percent.map(|percent| Sample::new(percent.into(), battery.received_at))
        },
    },
    // Known only of a check that has seen everything.
    Quantity {
        name: "check failures",
        unit: "",
        decimals: 0,
        read: |m, _| {
            let check = m.vehicle.pad_check.as_ref().filter(|check| check.is_judged())?;
            Some(Sample::new(check.failing().count() as f64, check.told_at))
        },
    },
    Quantity {
        name: "link rate",
        unit: "B/s",
        decimals: 0,
        read: |m, now| m.link.heard_at.map(|_| Sample::new(m.link.stats.figures(now).rx_bytes_s, now)),
    },
    Quantity {
        name: "link loss",
        unit: "%",
        decimals: 1,
        read: |m, now| m.link.loss(now).map(|loss| Sample::new(100.0 * loss, now)),
    },
];

fn motion(model: &Model, pick: fn(&Motion) -> f64) -> Option<Sample<f64>> {
    model.vehicle.best_motion().map(|motion| motion.map(pick))
}

fn attitude(model: &Model, pick: fn(&Attitude) -> f64) -> Option<Sample<f64>> {
    model.vehicle.attitude.map(|attitude| attitude.map(pick))
}

fn body(model: &Model, pick: fn(&BodySpeed) -> f64) -> Option<Sample<f64>> {
    model.vehicle.body_speed().map(|body| body.map(pick))
}

fn fin(vehicle: &Vehicle, number: usize) -> Option<Sample<f64>> {
    vehicle.fins.map(|fins| fins.map(|fins| fins[number].measured_rad.to_degrees()))
}

fn descent(model: &Model, pick: fn(&TD_DESCENT_DATA) -> f32) -> Option<Sample<f64>> {
    model.vehicle.descent.as_ref().map(|d| Sample::new(f64::from(pick(&d.value)), d.received_at))
}

fn solver(model: &Model, pick: fn(&TD_CONTROLLER_DATA) -> f64) -> Option<Sample<f64>> {
    model.vehicle.controller.as_ref().map(|c| Sample::new(pick(&c.value), c.received_at))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_is_its_own_and_finds_its_quantity() {
        for quantity in &ALL {
            assert_eq!(Quantity::named(quantity.name), Some(quantity));
            assert_eq!(quantity.name, quantity.name.to_lowercase());
            assert_eq!(ALL.iter().filter(|other| *other == quantity).count(), 1, "{quantity:?}");
        }
        assert_eq!(Quantity::named("colour"), None);
    }
}

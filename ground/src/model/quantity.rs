//! Every number that can be plotted over time.

use std::time::Duration;

use protocol::dialect::TD_CONTROLLER_DATA;
use protocol::link_stats::LinkFigures;

use super::{BodySpeed, Deflection, Gimbal, Model, Motion, Sample, Vehicle, margin_db, rssi_dbm};

type Read = fn(&Model, Duration) -> Option<Sample<f64>>;

/// A number of the telemetry or of the link, in the unit of the screen.
#[derive(Debug)]
pub struct Quantity {
    /// Unique, in lower case.
    pub name: &'static str,
    pub unit: &'static str,
    pub decimals: usize,
    read: Read,
}

impl PartialEq for Quantity {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Default for &Quantity {
    fn default() -> Self {
        &ALL[0]
    }
}

impl Quantity {
    /// The present value; `None` while it is not available.
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
pub const COUNT: usize = 42;

const fn quantity(name: &'static str, unit: &'static str, decimals: usize, read: Read) -> Quantity {
    Quantity { name, unit, decimals, read }
}

pub static ALL: [Quantity; COUNT] = [
    quantity("height", "m", 1, |model, _| model.vehicle.height_m()),
    quantity("vertical speed", "m/s", 1, |model, _| model.vehicle.vertical_m_s()),
    quantity("horizontal speed", "m/s", 1, |m, _| m.vehicle.of_motion(Motion::horizontal_m_s)),
    quantity("distance", "m", 1, |m, _| m.vehicle.of_motion(Motion::distance_m)),
    quantity("north", "m", 1, |m, _| m.vehicle.of_motion(|motion| motion.x_m)),
    quantity("east", "m", 1, |m, _| m.vehicle.of_motion(|motion| motion.y_m)),
    quantity("axial speed", "m/s", 2, |m, _| body(m, |body| body.u_m_s)),
    quantity("lateral speed", "m/s", 2, |m, _| body(m, BodySpeed::lateral_m_s)),
    quantity("tilt", "deg", 1, |m, _| m.vehicle.tilt_deg()),
    quantity("pitch", "deg", 1, |m, _| m.vehicle.of_attitude(|a| a.pitch_rad.to_degrees())),
    quantity("turn rate", "deg/s", 1, |m, _| m.vehicle.of_attitude(|a| a.turn_rate_rad_s().to_degrees())),
    quantity("gimbal pitch", "deg", 2, |m, _| gimbal(&m.vehicle, |gimbal| gimbal.pitch)),
    quantity("gimbal yaw", "deg", 2, |m, _| gimbal(&m.vehicle, |gimbal| gimbal.yaw)),
    quantity("fin 1", "deg", 1, |m, _| fin(&m.vehicle, 0)),
    quantity("fin 2", "deg", 1, |m, _| fin(&m.vehicle, 1)),
    quantity("fin 3", "deg", 1, |m, _| fin(&m.vehicle, 2)),
    quantity("fin 4", "deg", 1, |m, _| fin(&m.vehicle, 3)),
    quantity("apogee", "m", 0, |m, _| m.vehicle.of_descent(|d| d.apogee_m).filter(|of| of.value != 0.0)),
    quantity("time to apogee", "s", 1, |m, _| m.vehicle.of_descent(|d| d.time_to_apogee_s)),
    quantity("band low", "m", 1, |m, _| m.vehicle.of_descent(|d| d.band_low_m)),
    quantity("band high", "m", 1, |m, _| m.vehicle.of_descent(|d| d.band_high_m)),
    quantity("ignition height", "m", 1, |m, _| m.vehicle.of_descent(|d| d.chosen_height_m)),
    quantity("commit height", "m", 1, |m, _| m.vehicle.of_descent(|d| d.commit_height_m)),
    quantity("time to ignition", "s", 1, |m, now| m.vehicle.ignition_in_s(now)),
    quantity("wind", "m/s", 1, |m, _| Some(m.vehicle.wind_m_s()?.map(|[x, y]| libm::hypot(*x, *y)))),
    quantity("touchdown north", "m", 1, |m, _| m.vehicle.of_touchdown(|d| d.touchdown_x_m)),
    quantity("touchdown east", "m", 1, |m, _| m.vehicle.of_touchdown(|d| d.touchdown_y_m)),
    quantity("drag", "x", 3, |m, _| m.vehicle.of_descent(|d| d.drag_scale)),
    quantity("time to touchdown", "s", 1, |m, now| m.vehicle.touchdown_in_s(now)),
    quantity("predicted speed", "m/s", 2, |m, _| m.vehicle.predicted_speed_m_s()),
    quantity("thrust", "x", 3, |m, _| m.vehicle.of_descent(|d| d.thrust_scale)),
    quantity("solve time", "ms", 2, |m, _| solver(m, |c| f64::from(c.solve_time_us) / 1_000.0)),
    quantity("solver margin", "ms", 1, |m, _| solver(m, |c| f64::from(c.deadline_margin_us) / 1_000.0)),
    quantity("battery", "V", 2, |m, _| {
        m.vehicle.battery().map(|battery| battery.map(|battery| battery.volts))
    }),
    quantity("battery left", "%", 0, |m, _| {
        let battery = m.vehicle.battery()?;
        battery.value.percent.map(|percent| Sample::new(percent.into(), battery.received_at))
    }),
    // Only of a complete check.
    quantity("check failures", "", 0, |m, _| {
        let check = m.vehicle.pad_check.as_ref().filter(|check| check.is_judged())?;
        Some(Sample::new(check.failing().count() as f64, check.reported_at))
    }),
    quantity("link rate", "B/s", 0, |m, now| link(m, now, |figures| figures.rx_bytes_s)),
    quantity("link sent", "B/s", 0, |m, now| link(m, now, |figures| figures.tx_bytes_s)),
    quantity("round trip", "ms", 0, |m, now| {
        m.link.round_trip.map(|trip| Sample::new(1_000.0 * trip.as_secs_f64(), now))
    }),
    quantity("rssi", "dBm", 0, |m, now| Some(Sample::new(rssi_dbm(m.link.radio(now)?)?, now))),
    quantity("radio margin", "dB", 1, |m, now| Some(Sample::new(margin_db(m.link.radio(now)?)?, now))),
    quantity("link loss", "%", 1, |m, now| m.link.loss(now).map(|loss| Sample::new(100.0 * loss, now))),
];

fn link(model: &Model, now: Duration, pick: fn(&LinkFigures) -> f64) -> Option<Sample<f64>> {
    model.link.last_frame_at.map(|_| Sample::new(pick(&model.link.stats.figures(now)), now))
}

fn body(model: &Model, pick: fn(&BodySpeed) -> f64) -> Option<Sample<f64>> {
    model.vehicle.body_speed().map(|body| body.map(pick))
}

fn gimbal(vehicle: &Vehicle, plane: fn(&Gimbal) -> Deflection) -> Option<Sample<f64>> {
    vehicle.gimbal().map(|gimbal| gimbal.map(|gimbal| plane(gimbal).measured_rad.to_degrees()))
}

fn fin(vehicle: &Vehicle, number: usize) -> Option<Sample<f64>> {
    vehicle.fins().map(|fins| fins.map(|fins| fins[number].measured_rad.to_degrees()))
}

fn solver(model: &Model, pick: fn(&TD_CONTROLLER_DATA) -> f64) -> Option<Sample<f64>> {
    model.vehicle.last::<TD_CONTROLLER_DATA>().map(|c| Sample::new(pick(&c.value), c.received_at))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_is_unique_and_finds_its_quantity() {
        for quantity in &ALL {
            assert_eq!(Quantity::named(quantity.name), Some(quantity));
            assert_eq!(quantity.name, quantity.name.to_lowercase());
            assert_eq!(ALL.iter().filter(|other| *other == quantity).count(), 1, "{quantity:?}");
        }
        assert_eq!(Quantity::named("colour"), None);
    }
}

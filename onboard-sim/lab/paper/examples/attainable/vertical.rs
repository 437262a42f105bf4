//! The true vehicle in a vertical fall through still air: the same thrust, masses and drag as in
//! [`sim::world::World`], without attitude dynamics. Tilt and fin opening are given, so the forces
//! are those of a vehicle that turns at once.

use flight::vehicle::airframe::{Airframe, MassModel};
use flight::vehicle::site::Site;
use flight::vehicle::thrust_curve::ThrustCurve;
use sim::world::{TrueBurn, Truth};

/// The vehicle's forces and masses.
#[derive(Debug, Clone)]
pub(crate) struct Vertical {
    pub(crate) site: Site,
    burn: TrueBurn,
    mass_model: MassModel,
    truth: Truth,
    /// Drag areas along the body, of the fins fully closed and fully open, and across the body,
    /// m^2.
    body_m2: f64,
    fins_m2: [f64; 2],
    across_m2: f64,
    base_m2: f64,
    cg_above_feet_m: f64,
}

/// Drag forces at one speed, N, all positive.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(clippy::struct_field_names, reason = "each name ends in its unit")]
pub(crate) struct Drag {
    /// Along the body of an upright vehicle.
    pub(crate) body_n: f64,
    /// Of the fins, closed and fully open.
    pub(crate) fins_n: [f64; 2],
    /// Across the body of a vehicle that lies flat.
    pub(crate) across_n: f64,
}

impl Drag {
    /// Vertical force with the nose at an angle from the vertical, given by its sine and cosine,
    /// and with the fins open to a share between closed (0) and fully open (1), N. The air meets
    /// the body along its axis with the cosine of the speed and across it with the sine; the fins'
    /// drag follows the wind.
    pub(crate) fn at_n(&self, [sin, cos]: [f64; 2], fin_share: f64) -> f64 {
        let [closed_n, open_n] = self.fins_n;
        self.body_n * cos * cos + self.across_n * sin * sin * sin + closed_n + fin_share * (open_n - closed_n)
    }
}

impl Vertical {
    /// The vehicle of an airframe and a motor file as the truth changes them. Fins hang exactly at
    /// their commanded angle, without misalignment or play.
    pub(crate) fn new(site: &Site, airframe: &Airframe, motor: &ThrustCurve, truth: &Truth) -> Self {
        let (body, fins) = (&airframe.body, airframe.fin_model());
        let legs_m2 = airframe.legs.drag_area_m2 + truth.leg_drag_m2;
        let fins_m2 = [airframe.fins.closed_rad(), airframe.fins.open_rad()].map(|opening_rad| {
            let whole_m2 = 4.0 * fins.reference_area_m2 * fins.drag_coefficient * libm::sin(opening_rad);
            truth.drag_scale * (truth.fin_drag_scale * whole_m2 + legs_m2)
        });
        let across_m2 = body.crossflow_drag_coefficient * body.diameter_m * body.length_m;
        let mass_model = MassModel::new(&airframe.mass, motor.propellant_mass_kg()).scaled(truth.mass_scale);
        let cg_station_m = mass_model.at(0.0).cg_station_m + truth.cg_offset_m[0];
        Self {
            site: *site,
            burn: TrueBurn::new(motor, truth),
            mass_model,
            truth: *truth,
            body_m2: truth.drag_scale
                * (body.reference_area_m2 * body.axial_drag_coefficient * truth.body_drag_scale),
            fins_m2,
            across_m2: truth.drag_scale * (across_m2 * truth.crossflow_scale),
            base_m2: airframe.body.reference_area_m2,
            cg_above_feet_m: airframe.above_feet_m(cg_station_m),
        }
    }

    /// The motor.
    pub(crate) fn burn(&self) -> &TrueBurn {
        &self.burn
    }

    /// Mass at a time since the thrust began, kg.
    pub(crate) fn mass_kg(&self, burning_s: f64) -> f64 {
        self.mass_model.at(self.burn.burnt_kg(burning_s) * self.truth.mass_scale).mass_kg
    }

    /// Distance from the feet up to the centre of gravity before ignition, m.
    pub(crate) fn cg_above_feet_m(&self) -> f64 {
        self.cg_above_feet_m
    }

    /// The drag at a speed in air of a density under a thrust.
    pub(crate) fn drag(&self, density_kg_m3: f64, speed_m_s: f64, thrust_n: f64) -> Drag {
        let pressure_pa = 0.5 * density_kg_m3 * speed_m_s * speed_m_s;
        // The exhaust takes its share when its thrust exceeds the pressure on the base, and in
        // proportion below that.
        let on_base_n = pressure_pa * self.base_m2;
        let strength = if thrust_n > on_base_n { 1.0 } else { (thrust_n / on_base_n).max(0.0) };
        let [body, fins] =
            [self.truth.plume_body_loss, self.truth.plume_fin_loss].map(|loss| 1.0 - loss * strength);
        Drag {
            body_n: pressure_pa * self.body_m2 * body,
            fins_n: self.fins_m2.map(|fins_m2| pressure_pa * fins_m2 * fins),
            across_n: pressure_pa * self.across_m2,
        }
    }
}

#[cfg(test)]
mod tests {
    use core::f64::consts::FRAC_PI_2;

    use flight::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;
    use flight::vehicle::rigid::RigidState;

    use super::*;
    use sim::world::{Actuators, World};

    /// The whole world with a vehicle that is upright in still air: its vertical acceleration is
    /// this room's.
    #[test]
    fn val_world_the_forces_are_those_of_an_upright_vehicle() {
        let airframe = flight::vehicles::mission::builtin_airframe("mk2").unwrap();
        let motor = flight::vehicles::motors::builtin(&airframe.motor).unwrap();
        let truth = Truth {
            impulse_scale: 1.04,
            burn_time_scale: 0.93,
            mass_scale: 1.02,
            drag_scale: 0.9,
            body_drag_scale: 1.1,
            fin_drag_scale: 1.05,
            plume_body_loss: 0.7,
            plume_fin_loss: 0.1,
            thrust_shape: [0.03, -0.02, 0.01, 0.0, 0.01],
            gust_scale: 0.0,
            ..Truth::default()
        };
        let mut start = RigidState::upright(200.0);
        start.velocity_m_s.z = -35.0;
        let world = World::new(&Site::default(), &airframe, &motor, &truth, &start, 1).unwrap();
        let mut world = world.with_fins_at(FRAC_PI_2);
        let vertical = Vertical::new(&Site::default(), &airframe, &motor, &truth);
        assert!((vertical.cg_above_feet_m() - world.cg_above_feet_m()).abs() < 1e-12);
        let actuators = Actuators { fins_rad: [FRAC_PI_2; 4], ignite: true, ..Actuators::default() };
        // It stops falling after 2.2 s.
        for _ in 0..23 {
            world.advance(&actuators, 100);
            let (before, air) = (*world.state(), world.air());
            let burning_s = world.time_s() + 0.5e-3 - world.thrust_begins_s().unwrap();
            world.step(&actuators);
            let found_m_s2 = (world.state().velocity_m_s.z - before.velocity_m_s.z) / 1e-3;
            let thrust_n = vertical.burn().thrust_n(burning_s);
            let speed_m_s = 0.5 * (before.velocity_m_s.z + world.state().velocity_m_s.z);
            let drag_n = vertical.drag(air.density_kg_m3, speed_m_s, thrust_n).at_n([0.0, 1.0], 1.0);
            let told_m_s2 = (thrust_n + drag_n) / vertical.mass_kg(burning_s) - STANDARD_GRAVITY_M_S2;
            assert!((found_m_s2 - told_m_s2).abs() < 1e-4, "{burning_s} s: {found_m_s2}, {told_m_s2}");
        }
    }
}

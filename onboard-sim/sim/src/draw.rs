//! One flight's truth from a seed and its number.

use core::f64::consts::TAU;

use crate::world::normal;
use crate::world::truth::{SHAPE_MOST, SHAPE_TERMS, Truth};
use crate::world::wind::Wind;
use crate::world::wind::aloft::WindsAloft;
use crate::world::{AscentTruth, Hanging};
use flight::vehicle::mission::Mission;
use flight::vehicle::rigid::{RigidState, upright};
use nalgebra::{UnitQuaternion, Vector3};
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha12Rng;

use crate::dispersion::{Dispersion, Mismatch};

/// The random differences of one flight.
#[derive(Debug, Clone, PartialEq)]
pub struct Draw {
    /// The vehicle and the day.
    pub truth: Truth,
    /// The state in which the fall begins: at apogee, or when it is sensed after a drone's release.
    /// A flight from the pad rises to its own apogee.
    pub apogee: RigidState,
    /// The mean wind over height, if it is measured.
    pub winds_aloft: Option<WindsAloft>,
    /// The ascent of a flight from the pad.
    pub ascent: AscentTruth,
    /// How a vehicle hangs that starts below a drone.
    pub hanging: Option<Hanging>,
    /// Seed of everything random during the flight: gusts and sensors.
    pub flight_seed: u64,
}

/// Draws flight `number` of a seed.
///
/// Every value is drawn in a fixed order, even if its deviation is zero. So a changed deviation
/// does not change the other draws, and two sets of dispersions can be compared flight by flight.
pub fn draw(mission: &Mission, dispersion: &Dispersion, seed: u64, number: u64) -> Draw {
    let mut chance = Chance::of(seed, number);
    let sigma = &narrowed_by_lot(mission, dispersion);
    let mut truth = Truth { gust_scale: sigma.gust_scale, ..Truth::default() };
    truth.impulse_scale =
        (1.0 + sigma.impulse_share * chance.normal() + sigma.impulse_even_share * chance.even()).max(0.1);
    truth.burn_time_scale = (1.0 + sigma.burn_time_share * chance.normal()).max(0.3);
    let scatter_scale = mission.airframe.igniter_scatter();
    truth.ignition_delay_s = (truth.ignition_delay_s
        + scatter_scale * sigma.ignition_delay_s * chance.normal()
        + scatter_scale * sigma.ignition_delay_even_s * chance.even())
    .max(0.02);
    let misalignment_rad = sigma.thrust_misalignment_deg.to_radians();
    truth.thrust_misalignment_rad = [(); 2].map(|()| misalignment_rad * chance.normal());
    truth.mass_scale = (1.0 + sigma.mass_share * chance.normal()).max(0.5);
    truth.drag_scale = (1.0 + sigma.drag_share * chance.normal()).max(0.2);
    truth.cg_offset_m = [0.0, sigma.cg_off_axis_m * chance.normal(), sigma.cg_off_axis_m * chance.normal()];
    let [calmest, windiest] = sigma.wind_m_s;
    truth.wind_m_s = calmest + (windiest - calmest) * chance.unit();
    truth.wind_towards_rad = TAU * chance.unit();
    if let Some(winds) = &sigma.winds_aloft {
        (truth.wind_m_s, truth.wind_towards_rad) = winds.near_ground();
    }

    let start = &mission.start;
    let away_rad = TAU * chance.unit();
    let (away_sin, away_cos) = libm::sincos(away_rad);
    let away = Vector3::new(away_cos, away_sin, 0.0);
    let place = Vector3::new(chance.normal(), chance.normal(), 0.0) * sigma.apogee_place_m;
    let height_m = start.height_m + sigma.apogee_height_m * chance.normal();
    let velocity = Vector3::new(chance.normal(), chance.normal(), 0.0) * sigma.apogee_velocity_m_s;
    let tilt = Vector3::new(chance.normal(), chance.normal(), 0.0) * sigma.apogee_tilt_deg.to_radians();
    let rate = Vector3::new(chance.normal(), chance.normal(), chance.normal())
        * sigma.apogee_rate_deg_s.to_radians();
    let roll_rad = TAU * chance.unit();
    let flight_seed = chance.random.next_u64();

    let wind =
        Wind::new(truth.wind_m_s, truth.wind_towards_rad, 0.0, 0).with_aloft(sigma.winds_aloft.as_ref());
    let carried = wind.mean_m_s(height_m) * start.carried_share;
    // It leans in the direction of its motion; the roll angle is arbitrary.
    let leaning = Vector3::z().cross(&away) * start.tilt_deg.to_radians();
    let roll = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), roll_rad);
    let apogee = RigidState {
        position_m: away * start.distance_m + place + Vector3::z() * height_m,
        velocity_m_s: away * start.speed_m_s + velocity + carried,
        world_from_body: UnitQuaternion::from_scaled_axis(leaning + tilt) * roll * upright(),
        rate_rad_s: rate,
    };
    mismatch(&mut truth, mission, &sigma.mismatch, seed, number);
    // The booster's motor is of another lot.
    let ascent = ascended(mission, dispersion, seed, number);
    let hanging = hung(mission, dispersion, seed, number);
    Draw { truth, apogee, winds_aloft: sigma.winds_aloft.clone(), ascent, hanging, flight_seed }
}

/// The set, which scatters landing motors as certified curves differ, with the scatter of the
/// mission's lot, and a weighed vehicle. A value without scatter in the set is unchanged.
fn narrowed_by_lot(mission: &Mission, set: &Dispersion) -> Dispersion {
    let (Some(lot), Some(expected)) = (&mission.lot, &mission.expected) else { return set.clone() };
    let weighed = lot.weighed.vehicle_kg.map_or(set.mass_share, |_| set.mass_share.min(expected.mass_share));
    let set = Dispersion { mass_share: weighed, ..set.clone() };
    if lot.burns == 0 {
        return set;
    }
    // The variance of an even distribution is a third of its half-width's square.
    let both = libm::hypot(set.impulse_share, set.impulse_even_share / libm::sqrt(3.0));
    let narrows = if both > 0.0 { expected.impulse.share / both } else { 1.0 };
    Dispersion {
        impulse_share: set.impulse_share * narrows,
        impulse_even_share: set.impulse_even_share * narrows,
        burn_time_share: if set.burn_time_share > 0.0 { expected.burn_time.share } else { 0.0 },
        ..set
    }
}

/// The ascent of flight `number`, from a separate generator.
fn ascended(mission: &Mission, sigma: &Dispersion, seed: u64, number: u64) -> AscentTruth {
    /// Any number that no other draw uses.
    const OF_ASCENT: u64 = 0x5ce7_0000_0000_0003;
    let nominal = AscentTruth::default();
    if mission.launch.is_none() {
        return nominal;
    }
    let mut chance = Chance::of(seed ^ OF_ASCENT, number);
    let rate_rad_s = sigma.apogee_rate_deg_s.to_radians();
    let lean_rad = sigma.rail_lean_deg.to_radians();
    AscentTruth {
        impulse_scale: (1.0
            + sigma.impulse_share * chance.normal()
            + sigma.impulse_even_share * chance.even())
        .max(0.1),
        burn_time_scale: (1.0 + sigma.burn_time_share * chance.normal()).max(0.3),
        ignition_delay_s: (nominal.ignition_delay_s + sigma.ignition_delay_s * chance.normal()).max(0.02),
        drag_scale: (1.0 + sigma.drag_share * chance.normal()).max(0.2),
        rail_lean_rad: [lean_rad * chance.normal(), lean_rad * chance.normal()],
        fin_cant_rad: sigma.fin_cant_deg.to_radians() * chance.normal(),
        tip_off_rad_s: [rate_rad_s * chance.normal(), rate_rad_s * chance.normal()],
    }
}

/// Position of a rail that should be upwind of the pad by a time, s, times the wind: placed by the
/// crew of flight `number` from its wind measurement, x and y, m. The measurement is drawn from a
/// separate generator.
pub(crate) fn rail_upwind_m(
    upwind_s: f64,
    sigma: &Dispersion,
    truth: &Truth,
    seed: u64,
    number: u64,
) -> [f64; 2] {
    /// Any number that no other draw uses.
    const OF_CREW: u64 = 0x77aa_0000_0000_0009;
    let mut chance = Chance::of(seed ^ OF_CREW, number);
    let measured_m_s = (truth.wind_m_s + sigma.measured_wind_m_s * chance.normal()).max(0.0);
    let towards_rad = truth.wind_towards_rad + sigma.measured_wind_deg.to_radians() * chance.normal();
    let (sin, cos) = libm::sincos(towards_rad);
    [cos, sin].map(|downwind| -downwind * measured_m_s * upwind_s)
}

/// Attitude and swing of the vehicle of flight `number` below its drone, from a separate generator;
/// `None` without a drone.
fn hung(mission: &Mission, sigma: &Dispersion, seed: u64, number: u64) -> Option<Hanging> {
    /// Any number that no other draw uses.
    const OF_HANGING: u64 = 0xd120_0000_0000_0004;
    let drop = mission.drop.as_ref()?;
    let airframe = &mission.airframe;
    let mut chance = Chance::of(seed ^ OF_HANGING, number);
    let (drift_sin, drift_cos) = libm::sincos(TAU * chance.unit());
    let drift_m_s = drop.drift_m_s * chance.unit();
    Some(Hanging {
        height_m: drop.height_m + sigma.drop_height_m * chance.normal(),
        drift_m_s: [drift_m_s * drift_cos, drift_m_s * drift_sin],
        length_m: drop.rope_m + airframe.body.length_m - airframe.mass.loaded_cg_station_m,
        swing_rad: drop.swing_deg.to_radians() * chance.unit(),
        towards_rad: TAU * chance.unit(),
        phase_rad: TAU * chance.unit(),
    })
}

/// The rise of the thrust of which the nominal ignition delay contains half, s.
const EXPECTED_RISE_S: f64 = 0.18;

/// How long a chuffing motor burns, and how long it is out before it burns on, s.
const CHUFF_S: [f64; 2] = [0.1, 0.2];

/// Draws the deviations of flight `number` that the flight computer's models do not contain. They
/// come from a separate generator: a set without them draws the same values as before.
fn mismatch(truth: &mut Truth, mission: &Mission, sigma: &Mismatch, seed: u64, number: u64) {
    /// Any number that no other draw uses.
    const OF_MISMATCH: u64 = 0x3d15_0000_0000_0002;
    let mut chance = Chance::of(seed ^ OF_MISMATCH, number);
    // Amplitudes that fall as 1 / k; a cosine's rms is its amplitude over the root of 2.
    let terms: [f64; SHAPE_TERMS] = core::array::from_fn(|k| 1.0 / (k + 1) as f64);
    let whole = libm::sqrt(0.5 * terms.iter().map(|term| term * term).sum::<f64>());
    truth.thrust_shape = terms.map(|term| {
        (sigma.thrust_shape_share * term / whole * chance.normal()).clamp(-SHAPE_MOST, SHAPE_MOST)
    });
    truth.plume_body_loss = chance.between(sigma.plume_body_loss);
    truth.plume_fin_loss = chance.between(sigma.plume_fin_loss);
    for (factor, share) in [
        (&mut truth.body_drag_scale, sigma.body_drag_share),
        (&mut truth.fin_drag_scale, sigma.fin_drag_share),
        (&mut truth.crossflow_scale, sigma.crossflow_share),
        (&mut truth.inertia_scale, sigma.inertia_share),
        (&mut truth.gimbal_gain, sigma.gimbal_gain_share),
    ] {
        *factor = (1.0 + share * chance.normal()).clamp(0.2, 2.0);
    }
    truth.cg_offset_m[0] = sigma.cg_along_m * chance.normal();
    truth.thrust_offset_m = [(); 2].map(|()| sigma.thrust_offset_m * chance.normal());
    truth.gimbal_slop_rad = chance.between(sigma.gimbal_slop_deg).to_radians();
    truth.fin_slop_rad = chance.between(sigma.fin_slop_deg).to_radians();
    truth.fin_offset_rad = [(); 4].map(|()| sigma.fin_offset_deg.to_radians() * chance.normal());
    truth.wind_exponent = (truth.wind_exponent + sigma.wind_exponent * chance.normal()).clamp(0.0, 0.5);
    truth.wind_veer_rad_m = sigma.wind_veer_deg_100m.to_radians() / 100.0 * chance.normal();
    let slope_deg = sigma.ground_slope_scale * mission.site.ground_slope_deg;
    truth.ground_rise = [(); 2].map(|()| libm::tan(slope_deg.to_radians()) * chance.normal());
    truth.principal_axis_rad = [(); 2].map(|()| sigma.principal_axis_deg.to_radians() * chance.normal());
    truth.chuff_s = if chance.unit() < sigma.chuff_share { CHUFF_S } else { [0.0; 2] };
    truth.thrust_rise_s = chance.between(sigma.thrust_rise_s);
    if truth.thrust_rise_s > 0.0 {
        truth.ignition_delay_s = (truth.ignition_delay_s - 0.5 * EXPECTED_RISE_S).max(0.02);
    }
    let legs = &mission.airframe.legs;
    truth.leg_drag_m2 = (legs.drag_area_m2 * sigma.leg_drag_share * chance.normal()
        + chance.between(sigma.leg_drag_m2))
    .max(-legs.drag_area_m2);
    truth.inertia_split = (sigma.inertia_split_share * chance.normal()).clamp(-0.3, 0.3);
    truth.other_curve = chance.between(sigma.other_curve);
    truth.ignition_delay_s -= sigma.ignition_tail_s * libm::log(1.0 - chance.unit());
    truth.fin_radial = chance.between(sigma.fin_radial);
}

/// Fractions of a delay, uniform in [0, 1), for the faults of flight `number`. They come from a
/// separate generator, so that a fault changes no other draw of the flight.
pub(crate) fn fault_shares(seed: u64, number: u64, faults: usize) -> Vec<f64> {
    /// Any number that no other draw uses.
    const OF_FAULTS: u64 = 0xfa17_0000_0000_0001;
    let mut chance = Chance::of(seed ^ OF_FAULTS, number);
    (0..faults).map(|_| chance.unit()).collect()
}

/// Random numbers on `libm`, the same on every machine.
pub struct Chance {
    random: ChaCha12Rng,
}

impl Chance {
    /// The numbers of flight `number` from a generator of this seed.
    pub fn of(seed: u64, number: u64) -> Self {
        let mut random = ChaCha12Rng::seed_from_u64(seed);
        random.set_stream(number);
        Self { random }
    }

    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        normal::unit(&mut self.random)
    }

    /// Uniform in [-1, 1).
    fn even(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }

    /// Uniform between two values.
    fn between(&mut self, [least, most]: [f64; 2]) -> f64 {
        least + (most - least) * self.unit()
    }

    /// Standard normal, by Box and Muller.
    pub fn normal(&mut self) -> f64 {
        let radius = libm::sqrt(-2.0 * libm::log(1.0 - self.unit()));
        radius * libm::cos(TAU * self.unit())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn truth(lot: &str, set: &str) -> Truth {
        let (name, text) = flight::vehicles::mission::BUILTIN[0];
        let mission = flight::vehicles::mission::from_toml(&format!("{text}{lot}"), name).unwrap();
        draw(&mission, &Dispersion::builtin(set).unwrap(), 7, 3).truth
    }

    /// The same draw, as far from the mean as the lot's motors scatter; without burns as far as the
    /// set's.
    #[test]
    fn a_lot_scatters_as_it_did_on_the_stand() {
        let lot = "\n[lot]\nname = \"2609\"\nburns = 400\nimpulse = { mean = 1.0, scatter = 0.01 }\nburn_time = { mean = 1.0, scatter = 0.015 }\n";
        for (set, shares) in [("real", [0.025, 0.04]), ("harsh", [0.05, 0.08])] {
            let (certified, known) = (truth("", set), truth(lot, set));
            let off = [certified.impulse_scale, certified.burn_time_scale].map(|scale| scale - 1.0);
            let now = [known.impulse_scale, known.burn_time_scale].map(|scale| scale - 1.0);
            // 400 burns determine the scatter to a fortieth of it and less.
            for (place, scatter) in [0.01, 0.015].into_iter().enumerate() {
                let expected = off[place] * scatter / shares[place];
                assert!((now[place] / expected - 1.0).abs() < 0.025, "{set}: {} {expected}", now[place]);
            }
            assert_eq!(
                Truth { impulse_scale: 1.0, burn_time_scale: 1.0, ..certified },
                Truth { impulse_scale: 1.0, burn_time_scale: 1.0, ..known }
            );
            assert_eq!(truth("\n[lot]\nname = \"2609\"\nburns = 0\n", set), certified);
        }
    }

    /// A crew that measures well walks 7 m for each m/s, against the wind; one that does not, not
    /// always to the same place.
    #[test]
    fn the_rail_stands_upwind_of_the_pad() {
        let day =
            |wind_m_s| Truth { wind_m_s, wind_towards_rad: 0.5 * core::f64::consts::PI, ..Truth::default() };
        let well = Dispersion::builtin("none").unwrap();
        let [x_m, y_m] = rail_upwind_m(7.0, &well, &day(4.0), 7, 3);
        assert!(x_m.abs() < 1e-9 && (y_m + 28.0).abs() < 1e-9, "{x_m} {y_m}");
        let [x_m, y_m] = rail_upwind_m(7.0, &well, &day(0.0), 7, 3);
        assert!(x_m.abs() < 1e-9 && y_m.abs() < 1e-9, "{x_m} {y_m}");
        let rough = Dispersion::builtin("real").unwrap();
        let walked = |number| rail_upwind_m(7.0, &rough, &day(4.0), 7, number);
        let mean_y_m = (0..400).map(|number| walked(number)[1]).sum::<f64>() / 400.0;
        // The mean of cosines of errors of 20 degrees is 0.94; 7 m of scatter over the root of 400
        // is 0.35 m.
        assert!((mean_y_m + 0.94 * 28.0).abs() < 1.05, "{mean_y_m}");
        assert!(
            (0..20).any(|number| walked(number)[0] > 5.0) && (0..20).any(|number| walked(number)[0] < -5.0)
        );
    }

    /// Of 400 delays with a tail of 0.1 s, a third is longer than its mean, and 1 / e^3 than three
    /// times that; nothing else changes.
    #[test]
    fn val_hand_ignition_delays_have_a_tail() {
        let mission = flight::vehicles::mission::builtin("mk3").unwrap().unwrap();
        let plain = Dispersion::builtin("none").unwrap();
        let tailed = Dispersion { mismatch: Mismatch { ignition_tail_s: 0.1, ..plain.mismatch }, ..plain };
        let late = |over_s: f64| {
            (0..400)
                .filter(|number| {
                    let [before, after] = [&plain, &tailed].map(|set| draw(&mission, set, 7, *number).truth);
                    let late_s = after.ignition_delay_s - before.ignition_delay_s;
                    assert_eq!(Truth { ignition_delay_s: before.ignition_delay_s, ..after }, before);
                    late_s > over_s
                })
                .count()
        };
        // 147 and 20 expected; four standard deviations are 38 and 17.
        assert!((109..=185).contains(&late(0.1)), "{}", late(0.1));
        assert!((3..=37).contains(&late(0.3)), "{}", late(0.3));
    }

    #[test]
    fn a_weighed_vehicle_has_its_weight() {
        let lot = "\n[lot]\nname = \"2609\"\nburns = 0\nweighed = { vehicle_kg = 3.1 }\n";
        let (certified, weighed) = (truth("", "real").mass_scale - 1.0, truth(lot, "real").mass_scale - 1.0);
        assert!((weighed / certified - 0.005 / 3.1 / 0.01).abs() < 1e-9, "{weighed} {certified}");
    }
}

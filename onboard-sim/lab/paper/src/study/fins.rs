//! The fins' forces in falls of the flight computer: as the landing paper prints them (Eq. 9-14),
//! as the world has them, and the force along `Y_f`, away from the axis, which both leave out.
//!
//! The paper drops that force because "the angles in-between the fin angles are small compared to"
//! the openings. A fin is a plate at an incidence kappa whose force is normal to it (S. F. Hoerner,
//! Fluid-Dynamic Drag, chapter 3): with a drag `D` it has `D cot kappa` away from the axis. Below
//! the angle at which a plate stalls, some 40 degrees, the force itself falls with the incidence.

use std::io::Write;

use flight::rules::phase::Phase;
use flight::vehicle::fins::{FinModel, ROLL};
use nalgebra::Vector3;
use onboard_sim::run::in_parallel;
use onboard_sim::statistics::{quantile, sorted};
use sim::recipe::Recipe;
use sim::sortie::Sortie;
use sim::world::World;

use super::PaperError;

/// Missions of which falls are measured, and the set.
const MISSIONS: [&str; 3] = ["mk3", "mk2", "vlr"];
const SET: &str = "real";
/// Falls of each.
const FALLS: u64 = 40;
const SEED: u64 = 2001;
/// Frames between two samples.
const EVERY: u64 = 10;
/// Less airspeed is no steered fall, m/s.
const LEAST_AIRSPEED_M_S: f64 = 12.0;
/// Incidence from which a plate's force no longer grows, rad: 40 degrees.
const STALL_RAD: f64 = 0.698;

/// The fins' forces at one instant.
#[derive(Debug, Clone, Copy)]
struct Instant {
    /// Largest opening less the smallest, rad.
    spread_rad: f64,
    /// Moments across the axis about the centre of gravity, N m: of the unequal drags about the
    /// axis, of the side force of the lifts, and of a flat plate's force away from the axis.
    of_drag_n_m: f64,
    of_lift_n_m: f64,
    of_radial_n_m: f64,
    /// Angle between tail and wind, rad.
    incidence_rad: f64,
    /// All of the fins' moments across the axis: turned into the local wind, and the difference of
    /// the printed ones to them, N m.
    turned_n_m: f64,
    printed_off_n_m: f64,
    /// The same of their force, N.
    turned_n: f64,
    printed_off_n: f64,
}

/// Angle of attack and sideslip at each fin, rad: Eq. 9-12. The second pair of Eq. 11 and 12 is
/// printed twice.
pub(crate) fn fin_incidence_rad(fins: &FinModel, alpha_rad: f64, beta_rad: f64) -> [(f64, f64); 4] {
    let (sin, cos) = fins.from_y;
    [(1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0)].map(|(along, across)| {
        (along * cos * alpha_rad - across * sin * beta_rad, across * sin * alpha_rad + along * cos * beta_rad)
    })
}

/// Force of a flat plate along `Y_f` over the dynamic pressure and area, at an opening.
pub(crate) fn plate_radial(fins: &FinModel, opening_rad: f64) -> f64 {
    let stalls = libm::sin(opening_rad) / libm::sin(STALL_RAD);
    fins.drag_coefficient * libm::cos(opening_rad) * stalls.min(1.0)
}

impl Instant {
    fn of(world: &World) -> Self {
        let (airframe, cg_m) = (world.airframe(), world.cg_m());
        let fins = airframe.fin_model();
        let velocity = world.state().world_from_body.inverse_transform_vector(&world.air_velocity_m_s());
        let rate = world.state().rate_rad_s;
        let half_m2 = 0.5 * world.air().density_kg_m3 * fins.reference_area_m2;
        let [alpha_rad, beta_rad] = [
            libm::atan2(-velocity.z, -velocity.x),
            libm::asin((-velocity.y / velocity.norm()).clamp(-1.0, 1.0)),
        ];
        let incidence = fin_incidence_rad(&fins, alpha_rad, beta_rad);
        let (mut forces, mut moments) = ([Vector3::zeros(); 2], [Vector3::zeros(); 2]);
        let mut parts = [Vector3::zeros(); 3];
        let openings_rad = world.fins_rad();
        for (fin, opening_rad) in openings_rad.into_iter().enumerate() {
            let sine = libm::sin(opening_rad);
            let outward = Vector3::from([0.0, fins.outward(fin)[0], fins.outward(fin)[1]]);
            let place = Vector3::x() * airframe.fins.station_m - cg_m + outward * fins.radius_m(sine);
            let across = Vector3::x().cross(&outward) * ROLL[fin];
            // Turned into the wind where the fin is, as in the world.
            let local = velocity + rate.cross(&place);
            let turned = (local * fins.drag_coefficient
                + local.cross(&outward) * (fins.lift_coefficient * ROLL[fin]))
                * (-half_m2 * sine * local.norm());
            let (alpha_rad, beta_rad) = incidence[fin];
            let cosines = libm::cos(alpha_rad) * libm::cos(beta_rad);
            let pressed = half_m2 * velocity.norm_squared();
            let printed = (Vector3::x() * fins.drag_coefficient + across * fins.lift_coefficient)
                * (pressed * sine * cosines);
            for (at, force) in [turned, printed].into_iter().enumerate() {
                forces[at] += force;
                moments[at] += place.cross(&force);
            }
            let drag = Vector3::x() * (pressed * fins.drag_coefficient * sine);
            let arm = Vector3::x() * place.x;
            parts[0] += (outward * fins.radius_m(sine)).cross(&drag);
            parts[1] += arm.cross(&(across * (pressed * fins.lift_coefficient * sine)));
            parts[2] += arm.cross(&(outward * (pressed * plate_radial(&fins, opening_rad))));
        }
        let size = |moment: Vector3<f64>| libm::hypot(moment.y, moment.z);
        Self {
            spread_rad: openings_rad.iter().copied().fold(f64::MIN, f64::max)
                - openings_rad.iter().copied().fold(f64::MAX, f64::min),
            of_drag_n_m: size(parts[0]),
            of_lift_n_m: size(parts[1]),
            of_radial_n_m: size(parts[2]),
            incidence_rad: libm::acos((-velocity.x / velocity.norm()).clamp(-1.0, 1.0)),
            turned_n_m: size(moments[0]),
            printed_off_n_m: size(moments[1] - moments[0]),
            turned_n: forces[0].norm(),
            printed_off_n: (forces[1] - forces[0]).norm(),
        }
    }
}

/// The steered part of a fall, sample by sample.
fn fall(recipe: &Recipe, number: u64) -> Result<Vec<Instant>, PaperError> {
    let mut sortie = Sortie::new(recipe, number)?;
    let mut fall = Vec::new();
    while sortie.goes_on() {
        sortie.step();
        match sortie.mode().phase {
            Phase::AeroDescent | Phase::LandArmed => {
                let world = sortie.world();
                let steers = world.air_velocity_m_s().norm() > LEAST_AIRSPEED_M_S;
                if steers && sortie.frame().is_multiple_of(EVERY) {
                    fall.push(Instant::of(world));
                }
            }
            phase if phase.before_apogee() || phase == Phase::Deploy => {}
            _ => break,
        }
    }
    Ok(fall)
}

/// Median and 95 % of a value; NaN without samples.
fn quantiles(samples: &[Instant], of: impl Fn(&Instant) -> f64) -> [f64; 2] {
    let values = sorted(samples.iter().map(of));
    [0.5, 0.95].map(|share| quantile(&values, share).unwrap_or(f64::NAN))
}

/// A value of an instant.
type Value = fn(&Instant) -> f64;

/// Flies the falls and writes the table.
///
/// # Errors
/// A fall cannot be set up, or the output not be written.
pub(crate) fn write_fins(out: &mut impl Write) -> Result<(), PaperError> {
    writeln!(
        out,
        "The fins in {FALLS} falls of each mission ({SET}, seed {SEED}), from {LEAST_AIRSPEED_M_S} m/s to the ignition; median, 95 %\n\
         {:<52}{}",
        "",
        MISSIONS.map(|mission| format!("{mission:>18}")).concat()
    )?;
    let mut columns = Vec::new();
    for mission in MISSIONS {
        let recipe = Recipe { seed: SEED, ..Recipe::built_in(mission, SET)? };
        let numbers: Vec<u64> = (0..FALLS).collect();
        let falls = in_parallel(&numbers, |number| fall(&recipe, *number), &|_| ());
        let falls = falls.into_iter().collect::<Result<Vec<_>, _>>()?;
        columns.push(falls.concat());
    }
    let rows: [(&str, Value); 8] = [
        ("largest opening less the smallest, deg", |i| i.spread_rad.to_degrees()),
        ("tail to the wind, deg", |i| i.incidence_rad.to_degrees()),
        ("moment of the drags about the axis, mN m", |i| 1e3 * i.of_drag_n_m),
        ("moment of the lifts' side force, mN m", |i| 1e3 * i.of_lift_n_m),
        ("moment of a plate's force along Y_f, mN m", |i| 1e3 * i.of_radial_n_m),
        ("  over that of the drags", |i| i.of_radial_n_m / i.of_drag_n_m.max(1e-9)),
        ("Eq. 9-14 less turned into the wind, moment, share", |i| i.printed_off_n_m / i.turned_n_m.max(1e-9)),
        ("Eq. 9-14 less turned into the wind, force, share", |i| i.printed_off_n / i.turned_n.max(1e-9)),
    ];
    for (name, of) in rows {
        write!(out, "{name:<52}")?;
        for samples in &columns {
            let [median, high] = quantiles(samples, of);
            write!(out, "{:>18}", format!("{median:.2} {high:.2}"))?;
        }
        writeln!(out)?;
    }
    let apart = columns.iter().map(|samples| {
        let wide = samples.iter().filter(|instant| instant.spread_rad > 15_f64.to_radians()).count();
        format!("{:>18}", format!("{:.0} %", 100.0 * wide as f64 / samples.len().max(1) as f64))
    });
    Ok(writeln!(
        out,
        "{:<52}{}",
        "frames with more than 15 deg between the openings",
        apart.collect::<String>()
    )?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fins() -> FinModel {
        flight::vehicles::mission::builtin_airframe("mk2").unwrap().fin_model()
    }

    /// Eq. 9-12 for alpha 0.2, beta 0.1, worked by hand: 0.2 cos 30 = 0.1732051, 0.1 sin 30 = 0.05,
    /// and so on.
    #[test]
    fn val_hand_fin_incidence() {
        let expected = [
            (0.123_205_080_756_887_7, 0.186_602_540_378_443_9),
            (0.223_205_080_756_887_7, -0.013_397_459_621_556_1),
            (-0.123_205_080_756_887_7, -0.186_602_540_378_443_9),
            (-0.223_205_080_756_887_7, 0.013_397_459_621_556_1),
        ];
        for (found, expected) in fin_incidence_rad(&fins(), 0.2, 0.1).into_iter().zip(expected) {
            assert!(
                (found.0 - expected.0).abs() < 1e-15 && (found.1 - expected.1).abs() < 1e-15,
                "{found:?}"
            );
        }
    }

    /// A plate's force is normal to it: at 45 degrees as large away from the axis as along it, none
    /// fully open, and none lying in the wind.
    #[test]
    fn val_hand_force_of_a_plate_along_y_f() {
        let fins = fins();
        let drag = |opening_rad: f64| fins.drag_coefficient * libm::sin(opening_rad);
        let at = |deg: f64| plate_radial(&fins, deg.to_radians());
        assert!((at(45.0) - drag(45_f64.to_radians())).abs() < 1e-12);
        assert!((at(60.0) - drag(60_f64.to_radians()) / 3_f64.sqrt()).abs() < 1e-12);
        assert!(at(90.0).abs() < 1e-12 && at(0.0).abs() < 1e-12);
        assert!(at(10.0) < fins.drag_coefficient * 0.3);
    }
}

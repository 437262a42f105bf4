//! Legs that give way: the stroke of a drop, the limits of tipping over, and landings at the
//! design's corners.

use flight::vehicle::airframe::Crush;

use super::*;
use crate::world::ground::{RestOutcome, Strain};

const CRUSH: Crush =
    Crush { force_n: 40.0, guide_share: 0.3, stroke_m: 0.05, strength_n: 150.0, strength_across_n: 80.0 };

/// mk2 with blocks in its legs, stiff springs without damping, and 110 mm below the nozzle.
fn on_blocks(crush: Crush) -> Airframe {
    let mut airframe = flight::vehicles::mission::builtin_airframe("mk2").unwrap();
    airframe.legs.foot_station_m = -0.11;
    airframe.legs.stiffness_n_m = 20_000.0;
    airframe.legs.damping_n_s_m = 20.0;
    airframe.legs.crush = Some(crush);
    airframe
}

fn placed(airframe: &Airframe, truth: &Truth, state: &RigidState) -> World {
    let motor = motors::builtin(&airframe.motor).unwrap();
    let truth = Truth { drag_scale: 0.0, gust_scale: 0.0, ..*truth };
    World::new(&Site::default(), airframe, &motor, &truth, state, 1).unwrap()
}

fn until_rest(world: &mut World) -> (RestOutcome, Strain) {
    for _ in 0..20_000 {
        world.step(&Actuators::NONE);
        if let Some(rest) = world.rest() {
            return (rest.outcome, rest.strain.unwrap());
        }
    }
    panic!("no rest after 20 s: {:?}", world.state());
}

/// All four legs at once: the weight falls by the height and by what the legs give way and bend;
/// the blocks take the crush force times what they give way, and the springs half of that force
/// times what they bend.
#[test]
fn val_hand_a_level_drop_uses_energy_over_force_of_the_stroke() {
    for height_m in [0.05, 0.1, 0.2] {
        let mut airframe = on_blocks(CRUSH);
        airframe.legs.damping_n_s_m = 0.0;
        let above_feet_m = airframe.above_feet_m(airframe.mass.loaded_cg_station_m);
        let mut world = placed(&airframe, &Truth::default(), &RigidState::upright(above_feet_m + height_m));
        let weight_n = world.weight_n();
        while world.touchdown().is_none() || world.state().velocity_m_s.z < 0.0 {
            world.step(&Actuators::NONE);
        }
        let strain = world.ground.strain().unwrap();
        let bends_m = CRUSH.force_n / airframe.legs.stiffness_n_m;
        let gives_m = (weight_n * (height_m + bends_m) - 2.0 * CRUSH.force_n * bends_m)
            / (4.0 * CRUSH.force_n - weight_n);
        let found_m = strain.stroke_used * CRUSH.stroke_m;
        assert!((found_m - gives_m).abs() < 0.01 * gives_m, "{height_m}: {found_m} for {gives_m}");
        assert!((strain.strength_used - CRUSH.force_n / CRUSH.strength_n).abs() < 1e-9, "{strain:?}");
        let clear_m = 0.11 - gives_m - bends_m;
        assert!((strain.clearance_m - clear_m).abs() < 1e-3, "{strain:?} for {clear_m}");
    }
}

/// From 0.4 m the blocks cannot take the energy: they become solid, and the springs bear what is
/// left.
#[test]
fn a_drop_beyond_the_stroke_uses_it_up_and_overloads_the_legs() {
    let airframe = on_blocks(CRUSH);
    let above_feet_m = airframe.above_feet_m(airframe.mass.loaded_cg_station_m);
    let mut world = placed(&airframe, &Truth::default(), &RigidState::upright(above_feet_m + 0.4));
    let (outcome, strain) = until_rest(&mut world);
    assert_eq!(outcome, RestOutcome::Upright);
    assert!(strain.stroke_used >= 1.0 && strain.strength_used > 1.0, "{strain:?}");
}

/// A vehicle that stands on a slope, let go at rest, its feet along the slope.
fn on_slope(airframe: &Airframe, slope_rad: f64, towards_rad: f64) -> World {
    let (sin, cos) = libm::sincos(towards_rad);
    let rise = libm::tan(slope_rad);
    let truth = Truth { ground_rise: [-rise * cos, -rise * sin], ..Truth::default() };
    let downhill = UnitQuaternion::from_scaled_axis(Vector3::new(-sin, cos, 0.0) * slope_rad);
    let mut state = RigidState::upright(0.0);
    state.world_from_body = downhill * state.world_from_body;
    let above_feet_m = airframe.above_feet_m(airframe.mass.loaded_cg_station_m);
    state.position_m = downhill * Vector3::z() * (above_feet_m - 1e-4);
    placed(airframe, &truth, &state)
}

/// It stands while its centre of gravity is above the square of its feet: towards a foot by the
/// feet's distance from the axis, between two feet by that over the root of two.
#[test]
fn val_hand_a_slope_tips_it_over_when_the_centre_of_gravity_leaves_the_feet() {
    let mut airframe = on_blocks(Crush { force_n: 400.0, strength_n: 1000.0, ..CRUSH });
    // Narrow, so that the limits are slopes that a world may have.
    airframe.legs.foot_radius_m = 0.12;
    airframe.legs.stiffness_n_m = 200_000.0;
    airframe.legs.damping_n_s_m = 200.0;
    let height_m = airframe.above_feet_m(airframe.mass.loaded_cg_station_m);
    let radius_m = airframe.legs.foot_radius_m;
    let quarter = core::f64::consts::FRAC_PI_4;
    for (towards_rad, reach_m) in [(quarter, radius_m / 2_f64.sqrt()), (0.0, radius_m)] {
        let limit_rad = libm::atan(reach_m / height_m);
        for (slope_rad, outcome) in
            [(limit_rad - 0.02, RestOutcome::Upright), (limit_rad + 0.02, RestOutcome::TippedOver)]
        {
            let (found, _) = until_rest(&mut on_slope(&airframe, slope_rad, towards_rad));
            assert_eq!(found, outcome, "{} of {} degrees", slope_rad.to_degrees(), limit_rad.to_degrees());
        }
    }
}

/// A vehicle that turns about its two downhill feet tips over if its energy lifts the centre of
/// gravity to above them.
#[test]
fn val_hand_a_turn_about_two_feet_tips_it_over_when_its_energy_lifts_it_above_them() {
    let mut airframe = on_blocks(Crush { force_n: 400.0, strength_n: 1000.0, ..CRUSH });
    airframe.legs.damping_n_s_m = 100.0;
    let height_m = airframe.above_feet_m(airframe.mass.loaded_cg_station_m);
    let reach_m = airframe.legs.foot_radius_m / 2_f64.sqrt();
    let far_m = libm::hypot(height_m, reach_m);
    let (sin, cos) = libm::sincos(core::f64::consts::FRAC_PI_4);
    let across = Vector3::new(-sin, cos, 0.0);
    for slope_rad in [0.0, 5_f64.to_radians()] {
        let at_rest = on_slope(&airframe, slope_rad, core::f64::consts::FRAC_PI_4);
        let (mass_kg, inertia_kg_m2) = (at_rest.mass().mass_kg, at_rest.mass().pitch_inertia_kg_m2);
        // The edge is `reach_m` downhill and `height_m` below.
        let along_slope = UnitQuaternion::from_scaled_axis(across * slope_rad);
        let from_edge_m = along_slope * Vector3::new(-reach_m * cos, -reach_m * sin, height_m);
        let lift_m = far_m - from_edge_m.z;
        let about_edge_kg_m2 = inertia_kg_m2 + mass_kg * far_m * far_m;
        let limit_rad_s = libm::sqrt(2.0 * mass_kg * STANDARD_GRAVITY_M_S2 * lift_m / about_edge_kg_m2);
        for (share, outcome) in [(0.93, RestOutcome::Upright), (1.07, RestOutcome::TippedOver)] {
            let rate = across * (share * limit_rad_s);
            let mut state = *at_rest.state();
            state.velocity_m_s = rate.cross(&from_edge_m);
            state.rate_rad_s = state.world_from_body.inverse_transform_vector(&rate);
            let mut world = placed(&airframe, at_rest.truth(), &state);
            let (found, _) = until_rest(&mut world);
            assert_eq!(found, outcome, "{share} of {limit_rad_s} rad/s on {slope_rad} rad");
        }
    }
}

/// An angle of its own for each number and each of four directions, spread evenly (Kronecker's
/// sequence with roots of primes).
fn azimuth_rad(number: usize, direction: usize) -> f64 {
    let root = libm::sqrt([2.0, 3.0, 5.0, 7.0][direction]);
    core::f64::consts::TAU * libm::modf(root * number as f64).0
}

/// A contact: speeds down and across, m/s, tilt and slope, degrees, rotation rate across the axis,
/// deg/s.
struct Contact {
    down_m_s: f64,
    across_m_s: f64,
    tilt_deg: f64,
    rate_deg_s: f64,
    slope_deg: f64,
}

fn contact(down_m_s: f64, across_m_s: f64, tilt_deg: f64, rate_deg_s: f64, slope_deg: f64) -> Contact {
    Contact { down_m_s, across_m_s, tilt_deg, rate_deg_s, slope_deg }
}

/// The world at a contact whose slope, tilt, speed across and rotation point in directions of their
/// own.
fn at_contact(airframe: &Airframe, contact: &Contact, number: usize) -> World {
    let towards = |direction: usize| {
        let (sin, cos) = libm::sincos(azimuth_rad(number, direction));
        Vector3::new(cos, sin, 0.0)
    };
    let rise = towards(0) * libm::tan(contact.slope_deg.to_radians());
    let truth = Truth { ground_rise: [rise.x, rise.y], ..Truth::default() };
    let mut state = RigidState::upright(1.0);
    let lean = UnitQuaternion::from_scaled_axis(towards(1) * contact.tilt_deg.to_radians());
    state.world_from_body = lean * state.world_from_body;
    state.velocity_m_s = towards(2) * contact.across_m_s - Vector3::z() * contact.down_m_s;
    let turn = towards(3) * contact.rate_deg_s.to_radians();
    // The body's x axis is the nose.
    state.rate_rad_s = Vector3::new(0.0, turn.x, turn.y);
    let above = placed(airframe, &truth, &state);
    state.position_m.z -= above.ground.clearance_m(&state, &above.cg_m()) - 1e-4;
    placed(airframe, &truth, &state)
}

/// mk3 with blocks of a force, N, and guides that add a share of the force across, on ground of a
/// friction.
fn mk3_on((force_n, guide_share): (f64, f64), friction: f64) -> Airframe {
    let mut mk3 = flight::vehicles::mission::builtin_airframe("mk3").unwrap();
    mk3.legs.friction_coefficient = friction;
    mk3.legs.crush = mk3.legs.crush.map(|crush| Crush { force_n, guide_share, ..crush });
    mk3
}

/// The softest block in the smoothest guide that a scale lets pass, N and share, and the hardest in
/// the roughest: docs/build-mk3.md.
const FEET: [(f64, f64); 2] = [(80.0, 0.2), (100.0, 0.45)];

/// mk3's legs were designed for all of these at once, to slopes of 5 degrees, and for 2 m/s nearly
/// upright, never mind which way each of them points.
fn corners() -> Vec<Contact> {
    let mut corners = vec![contact(2.0, 0.0, 0.0, 0.0, 0.0), contact(2.0, 0.3, 4.0, 20.0, 1.0)];
    for corner in 0..32 {
        let of = |bit: usize, most: f64| if corner >> bit & 1 == 1 { most } else { 0.0 };
        let down_m_s = if corner & 1 == 1 { 1.5 } else { 0.5 };
        corners.push(contact(down_m_s, of(1, 0.7), of(2, 10.0), of(3, 60.0), of(4, 5.0)));
    }
    corners
}

#[test]
fn regress_mk3s_legs_stand_undamaged_at_every_corner_of_their_design() {
    for (kind, foot) in FEET.into_iter().enumerate() {
        for friction in [0.3, 0.6] {
            let mk3 = mk3_on(foot, friction);
            for (corner, contact) in corners().iter().enumerate() {
                for number in 1..=4 {
                    let number = 8 * corner + 4 * kind + number;
                    let (outcome, strain) = until_rest(&mut at_contact(&mk3, contact, number));
                    let reported = format!("{foot:?}, {friction}, corner {corner}, {number}: {strain:?}");
                    assert_eq!(outcome, RestOutcome::Upright, "{reported}");
                    assert!(strain.stroke_used < 0.95 && strain.strength_used < 1.0, "{reported}");
                    assert!(strain.clearance_m > 0.07, "{reported}");
                }
            }
        }
    }
}

/// Ground that grips more than it was designed for: no block is used up, and a vehicle that slides
/// fast, leans and turns at once may trip.
#[test]
fn regress_mk3s_legs_on_ground_that_grips() {
    let mk3 = mk3_on((90.0, 0.4), 0.9);
    let (mut tripped, mut overloaded) = (0, 0);
    for (corner, contact) in corners().iter().enumerate() {
        for number in 1..=8 {
            let (outcome, strain) = until_rest(&mut at_contact(&mk3, contact, 8 * corner + number));
            let slow = contact.across_m_s < 0.7 || contact.tilt_deg < 10.0 || contact.rate_deg_s < 60.0;
            let reported = format!("corner {corner}, {number}: {outcome:?} {strain:?}");
            assert!(strain.stroke_used < 0.95 && strain.clearance_m > 0.07, "{reported}");
            assert!(!slow || outcome == RestOutcome::Upright, "{reported}");
            tripped += u32::from(outcome != RestOutcome::Upright);
            overloaded += u32::from(strain.strength_used > 1.0);
        }
    }
    assert!(tripped + overloaded <= 13, "{tripped} and {overloaded} of 272");
}

/// A drop of a dummy: how far its lowest and its highest foot have risen, and how far it bounced,
/// mm.
fn dropped(airframe: &Airframe, height_m: f64, lean_rad: f64) -> [f64; 3] {
    let mut state = RigidState::upright(1.0);
    state.world_from_body = UnitQuaternion::from_scaled_axis(Vector3::y() * lean_rad) * state.world_from_body;
    let above = placed(airframe, &Truth::default(), &state);
    state.position_m.z -= above.ground.clearance_m(&state, &above.cg_m()) - height_m;
    let mut world = placed(airframe, &Truth::default(), &state);
    let mut bounce_m = 0.0_f64;
    while world.rest().is_none() {
        world.step(&Actuators::NONE);
        if world.touchdown().is_some() {
            bounce_m = bounce_m.max(world.ground.clearance_m(world.state(), &world.cg_m()));
        }
    }
    let fold = |of: fn(f64, f64) -> f64| world.ground.given_m.into_iter().reduce(of).unwrap();
    [fold(f64::max), fold(f64::min), bounce_m].map(|length_m| 1e3 * length_m)
}

/// The bounds of the drop test on the page are those of the world, on floors that grip by 0.2 to
/// 0.9, with every block and guide that a scale lets pass. Blocks of half and twice the force do
/// not pass.
#[test]
fn the_drop_test_on_the_page_has_the_worlds_bounds() {
    let page = include_str!("../../../../../../docs/build-mk3.md");
    let words = page.split_whitespace().collect::<Vec<_>>().join(" ");
    let [soft, hard] = FEET;
    assert!(words.contains(&format!("between {} and {} N", soft.0, hard.0)), "of the scale");
    // Across a foot hang 5 kg.
    let adds_n = [soft, hard].map(|(_, guide_share)| 5.0 * STANDARD_GRAVITY_M_S2 * guide_share);
    assert!(words.contains(&format!("{:.0} to {:.0} N more", adds_n[0], adds_n[1])), "{adds_n:?}");
    let mk3 = flight::vehicles::mission::builtin_airframe("mk3").unwrap();
    let Crush { force_n, guide_share, .. } = mk3.legs.crush.unwrap();
    let most_n = force_n / (1.0 - guide_share * mk3.legs.friction_coefficient);
    assert!(page.contains(&format!("| foot gives way at | {force_n} to {most_n:.0} N |")), "{most_n}");
    let lean_rad = libm::asin(0.16 / 0.9);
    let mut missing = Vec::new();
    for (drop, height_m, lean_rad) in [
        ("level, from 0.12 m", 0.12, 0.0),
        ("level, from 0.20 m", 0.20, 0.0),
        ("one foot 0.16 m higher, the others from 0.12 m", 0.12, lean_rad),
    ] {
        let all: Vec<[f64; 3]> = [soft, (90.0, 0.4), hard]
            .into_iter()
            .flat_map(|foot| [0.2, 0.4, 0.6, 0.9].map(|friction| mk3_on(foot, friction)))
            .map(|airframe| dropped(&airframe, height_m, lean_rad))
            .collect();
        let bounds = |of: usize| {
            let found = all.iter().map(|drop| drop[of]);
            [found.clone().fold(f64::INFINITY, f64::min).floor(), found.fold(0.0, f64::max).ceil()]
        };
        let [[least, most], [least_high, most_high], [_, bounce]] = [0, 1, 2].map(bounds);
        let row = format!("| {drop} | {least} to {most} | {least_high} to {most_high} | {bounce} |");
        if !page.contains(&row) {
            missing.push(row);
        }
        for force_n in [42.0, 181.0] {
            let [low, ..] = dropped(&mk3_on((force_n, 0.4), 0.6), height_m, lean_rad);
            assert!(low < least || low > most, "{drop}, {force_n} N: {low} mm");
        }
    }
    assert!(missing.is_empty(), "{missing:#?}");
}

/// Legs cannot make good what they were not designed for, and the verdict says so.
#[test]
fn mk3s_legs_give_way_to_what_they_were_not_designed_for() {
    let mk3 = flight::vehicles::mission::builtin_airframe("mk3").unwrap();
    let (_, strain) = until_rest(&mut at_contact(&mk3, &contact(4.5, 0.0, 0.0, 0.0, 0.0), 1));
    assert!(strain.stroke_used >= 1.0 && strain.strength_used > 1.0, "{strain:?}");
    let (outcome, _) = until_rest(&mut at_contact(&mk3, &contact(1.0, 4.0, 25.0, 0.0, 0.0), 1));
    assert!(outcome != RestOutcome::Upright, "{outcome:?}");
}

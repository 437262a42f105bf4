//! Properties of every flight: finite numbers, the same bits, mirror symmetry, faults, refusals.

use proptest::prelude::*;

use super::*;
use crate::world::plant::WorldError;

fn actuators() -> impl Strategy<Value = Actuators> {
    let any = proptest::num::f64::ANY;
    let angle = prop_oneof![3 => -2.0..2.0_f64, 1 => any];
    (
        proptest::array::uniform2(angle.clone()),
        proptest::array::uniform4(angle),
        proptest::bool::weighted(0.1),
        proptest::bool::weighted(0.02),
    )
        .prop_map(|(gimbal_rad, fins_rad, ignite, parachute)| Actuators {
            gimbal_rad,
            fins_rad,
            ignite,
            parachute,
            ..Actuators::NONE
        })
}

fn windy() -> Truth {
    Truth { wind_m_s: 6.0, thrust_misalignment_rad: [0.005, -0.003], ..Truth::default() }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// For any commands, in the air, under thrust, under the parachute and on the ground: the
    /// numbers are finite, the attitude is a unit quaternion, and the actuators are between their
    /// stops.
    #[test]
    fn any_commands_give_finite_numbers(
        commands in proptest::collection::vec(actuators(), 1..40),
        height_m in 0.0..60.0_f64,
        rate in proptest::array::uniform3(-20.0..20.0_f64),
        velocity in proptest::array::uniform3(-50.0..20.0_f64),
        lean_rad in -3.0..3.0_f64,
    ) {
        let mut initial = leaning(height_m, lean_rad, 0.3);
        initial.velocity_m_s = Vector3::from(velocity);
        initial.rate_rad_s = Vector3::from(rate);
        let mut world = world("mk2", &windy(), &initial);
        for command in &commands {
            world.advance(command, 100);
            prop_assert!(world.state().is_finite(), "{:?}", world.state());
            prop_assert!((world.state().world_from_body.norm_squared() - 1.0).abs() < 1e-12);
            prop_assert!(world.inertial().specific_force_m_s2.iter().all(|value| value.is_finite()));
            let limit_rad = world.airframe().gimbal.limit_rad();
            prop_assert!(world.gimbal_rad().iter().all(|angle| angle.abs() <= limit_rad));
            prop_assert!(world.fins_rad().iter().all(|angle| (0.0..=FRAC_PI_2).contains(angle)));
        }
    }

    /// A vehicle rolled by half a turn, with its commands rolled as well, flies the same path in
    /// the world.
    #[test]
    fn half_a_roll_mirrors(
        gimbal_rad in proptest::array::uniform2(-0.1..0.1_f64),
        fins_rad in proptest::array::uniform4(0.3..1.5_f64),
        lean in proptest::array::uniform2(-0.3..0.3_f64),
        rate in proptest::array::uniform3(-1.0..1.0_f64),
    ) {
        let truth = Truth { wind_m_s: 5.0, gust_scale: 0.0, ..Truth::default() };
        let mut initial = leaning(200.0, lean[0], lean[1]);
        initial.velocity_m_s = Vector3::new(1.0, -2.0, -30.0);
        initial.rate_rad_s = Vector3::from(rate);
        let half_roll = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), core::f64::consts::PI);
        let mut rolled = initial;
        rolled.world_from_body *= half_roll;
        rolled.rate_rad_s = half_roll * initial.rate_rad_s;
        let command = Actuators { gimbal_rad, fins_rad, ignite: true, ..Actuators::NONE };
        // Half a roll moves fin 1 to the place of fin 3, and reverses both gimbal axes.
        let [one, two, three, four] = fins_rad;
        let rolled_command = Actuators {
            gimbal_rad: gimbal_rad.map(|angle| -angle),
            fins_rad: [three, four, one, two],
            ..command
        };
        let (mut first, mut second) = (world("mk2", &truth, &initial), world("mk2", &truth, &rolled));
        first.advance(&command, 1500);
        second.advance(&rolled_command, 1500);
        prop_assert!((first.state().position_m - second.state().position_m).norm() < 1e-8);
        prop_assert!((first.state().velocity_m_s - second.state().velocity_m_s).norm() < 1e-8);
        prop_assert!((half_roll * first.state().rate_rad_s - second.state().rate_rad_s).norm() < 1e-7);
    }
}

#[test]
fn the_same_arguments_give_the_same_bits() {
    let fly = |seed: u64| {
        let airframe = flight::vehicles::mission::builtin_airframe("mk2").unwrap();
        let motor = motors::builtin(&airframe.motor).unwrap();
        let mut world =
            World::new(&Site::default(), &airframe, &motor, &windy(), &leaning(150.0, 0.05, 0.02), seed)
                .unwrap();
        world.advance(&OPEN, 2000);
        world.advance(&Actuators { gimbal_rad: [0.03, -0.02], ignite: true, ..OPEN }, 4000);
        format!("{:?} {:?} {:?}", world.state(), world.touchdown(), world.rest())
    };
    assert_eq!(fly(9), fly(9));
    assert_ne!(fly(9), fly(10));
}

#[test]
fn faults_make_actuators_stuck_or_slow() {
    let mut world = world("mk2", &Truth::default(), &RigidState::upright(900.0));
    let command = Actuators { gimbal_rad: [0.08, -0.08], ..OPEN };
    world.inject(&Fault::FinStuck { fin: 2 });
    world.inject(&Fault::FinStuck { fin: 9 });
    world.advance(&command, 1000);
    let [one, two, three, four] = world.fins_rad();
    assert!(three.abs() < 1e-15 && [one, two, four].iter().all(|angle| (angle - FRAC_PI_2).abs() < 1e-9));
    let before = world.gimbal_rad();
    world.inject(&Fault::GimbalStuck);
    world.advance(&OPEN, 500);
    assert_eq!(world.gimbal_rad().map(f64::to_bits), before.map(f64::to_bits));
}

#[test]
fn a_slow_gimbal_turns_at_its_reduced_rate() {
    let turned_rad = |fault: Option<Fault>| {
        let mut world = world("mk2", &Truth::default(), &RigidState::upright(900.0));
        if let Some(fault) = fault {
            world.inject(&fault);
        }
        world.advance(&Actuators { gimbal_rad: [0.1, 0.0], ..OPEN }, 35);
        world.gimbal_rad()[0] + 0.25_f64.to_radians()
    };
    let (full_rad, fifth_rad) = (turned_rad(None), turned_rad(Some(Fault::GimbalSlow { scale: 0.2 })));
    assert!((fifth_rad / full_rad - 0.2).abs() < 0.01, "{full_rad} {fifth_rad}");
}

#[test]
fn data_out_of_range_are_refused() {
    let airframe = flight::vehicles::mission::builtin_airframe("mk2").unwrap();
    let motor = motors::builtin("H45W").unwrap();
    let start = RigidState::upright(100.0);
    let refuse = |truth: &Truth, start: &RigidState| {
        World::new(&Site::default(), &airframe, &motor, truth, start, 1).unwrap_err().to_string()
    };
    let truth = Truth { mass_scale: f64::NAN, ..Truth::default() };
    assert_eq!(refuse(&truth, &start), "truth.mass_scale is NaN; 0.1 to 10 is accepted");
    let truth = Truth { cg_offset_m: [0.0, 5.0, 0.0], ..Truth::default() };
    assert_eq!(refuse(&truth, &start), "truth.cg_offset_m is 5; -0.1 to 0.1 is accepted");
    let [mk2, mk3] = ["mk2", "mk3"].map(|name| flight::vehicles::mission::builtin(name).unwrap().unwrap());
    for (mission, other_curve, required) in
        [(&mk2, 0.5, "0 (the mission has no other_motor)"), (&mk3, 1.5, "0 to 1")]
    {
        let refused = Truth { other_curve, ..Truth::default() }.curve(mission).unwrap_err().to_string();
        assert_eq!(refused, format!("truth.other_curve is {other_curve}; {required} is accepted"));
    }
    let mut nowhere = start;
    nowhere.position_m.x = f64::INFINITY;
    assert!(refuse(&Truth::default(), &nowhere).starts_with("the initial state is "));
    let mut light = airframe.clone();
    light.mass.loaded_kg = 0.15;
    let error = World::new(&Site::default(), &light, &motor, &Truth::default(), &start, 1).unwrap_err();
    assert!(matches!(error, WorldError::Motor { propellant_kg, .. } if propellant_kg > 0.19), "{error}");
}

/// Five steps at once end where they do one after the other, and have their mean rate: in a fall
/// with moving fins, under the landing motor with a swinging gimbal, and while the parachute
/// opens.
#[test]
fn a_stride_ends_where_its_steps_do() {
    let truth = Truth { wind_m_s: 6.0, ..Truth::default() };
    for (ignites, ejects) in [(false, false), (true, false), (false, true)] {
        let mut strides = world("mk3", &truth, &leaning(300.0, 0.1, 0.05)).with_fins_at(1.0);
        let mut steps = strides.clone();
        let mut apart_rad_s: f64 = 0.0;
        for frame in 0..1_000 {
            let sway = libm::sin(0.05 * f64::from(frame));
            let actuators = Actuators {
                fins_rad: [1.0 + 0.4 * sway, 1.0 - 0.4 * sway, 1.0 + 0.2 * sway, 1.0],
                gimbal_rad: [0.1 * sway, -0.05 * sway],
                ignite: ignites && frame >= 200,
                parachute: ejects && frame >= 200,
                ..Actuators::NONE
            };
            let mut stepped = strides.clone();
            let stepped_rad_s = (0..STRIDE).map(|_| {
                stepped.step(&actuators);
                stepped.state().rate_rad_s / STRIDE as f64
            });
            assert_eq!(strides.stride(&actuators, STRIDE), STRIDE);
            apart_rad_s =
                apart_rad_s.max((strides.inertial().rate_rad_s - stepped_rad_s.sum::<Vector3<f64>>()).norm());
            steps.advance(&actuators, 1);
            (1..STRIDE).for_each(|_| steps.step(&actuators));
        }
        let [one, other] = [&strides, &steps].map(World::state);
        let apart_m = (one.position_m - other.position_m).norm();
        let apart_m_s = (one.velocity_m_s - other.velocity_m_s).norm();
        let apart_rad = one.world_from_body.angle_to(&other.world_from_body);
        assert!(
            apart_m < 0.05 && apart_m_s < 0.05 && apart_rad < 0.01 && apart_rad_s < 0.002,
            "{ignites} {ejects}: {apart_m} m, {apart_m_s} m/s, {apart_rad} rad, {apart_rad_s} rad/s"
        );
    }
}

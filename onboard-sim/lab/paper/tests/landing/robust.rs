//! Many starts and many disturbances.

use paper::plane::Outcome;
use paper::problem::THRUST_N;

use super::*;

/// Pitch 60 to 120 deg, w within 3 m/s, q within 60 deg/s, height and speed within 20 %.
#[test]
fn cold_starts_from_the_box_around_the_nominal_converge() {
    const STARTS: u32 = 1000;
    let mut draw = draws(1);
    let mut between = |least: f64, most: f64| least + (most - least) * draw();
    let (mut landed, mut converged, mut refused) = (0, 0, 0_u32);
    for _ in 0..STARTS {
        let nominal = nominal_start();
        let start = PlanarState {
            z_m: nominal.z_m * between(0.8, 1.2),
            theta_rad: between(60.0, 120.0).to_radians(),
            u_m_s: nominal.u_m_s * between(0.8, 1.2),
            w_m_s: between(-3.0, 3.0),
            q_rad_s: between(-60.0, 60.0).to_radians(),
            ..nominal
        };
        let problem = settled(start, HORIZON);
        if best_touchdown_speed_m_s(&problem) > TOUCHDOWN_SPEED_MAX_M_S {
            refused += 1;
            continue;
        }
        let Outcome { status, iterations, miss, .. } = solve(&problem, None).outcome;
        if status == Status::Converged {
            converged += 1;
            landed += i32::from(miss < 1e-3);
        } else {
            println!("{status:?} after {iterations} from {start:?}");
        }
    }
    println!("{converged} of {STARTS} converged, {landed} of them to a landing; {refused} cannot be landed");
    assert_eq!(converged + refused, STARTS);
}

/// Of the first 10,000 starts of the test above, the three whose best descent ends at its cap,
/// beside a saddle.
#[test]
fn cold_starts_beside_a_saddle_converge() {
    for [z_m, theta_rad, u_m_s, w_m_s, q_rad_s] in [
        [
            16.225_608_928_503_65,
            1.310_509_457_639_175_4,
            -5.901_864_912_327_085,
            -0.243_072_586_400_492_78,
            0.561_521_835_501_444_5,
        ],
        [
            14.656_736_070_932_24,
            1.809_240_901_601_812_5,
            -4.885_615_713_195_906,
            -1.546_818_690_525_429_5,
            -0.974_391_171_649_133_1,
        ],
        [
            14.293_374_950_411_154,
            2.006_500_430_588_156_6,
            -4.894_313_296_948_15,
            -2.830_417_487_264_049,
            0.188_067_510_246_349_96,
        ],
    ] {
        let start = PlanarState { z_m, theta_rad, u_m_s, w_m_s, q_rad_s, ..nominal_start() };
        assert!(solve(&settled(start, HORIZON), None).converged(), "{start:?}");
    }
}

/// Uniform numbers from 0 to 1 from a seed: a `SplitMix64` stream.
fn draws(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((bits ^ (bits >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Whole landings along the shrinking horizon, with a disturbance of 2 mm/s and 0.05 deg/s (one
/// sigma) per sample. In the last steps the end is out of reach and is missed at its penalty.
#[test]
fn no_solve_fails_in_the_disturbed_closed_loop() {
    let model = model();
    for pose in [problem as Pose, settled] {
        let mut draw = draws(1);
        let mut normal = || (0..12).map(|_| draw()).sum::<f64>() - 6.0;
        let mut solves = 0;
        for (name, start, _) in BEST_COSTS {
            let mut state = start();
            let mut solution = solve(&pose(state, HORIZON), None);
            for k in 1..HORIZON {
                state = model.rk4_step(&state, solution.inputs_rad[0][0], THRUST_N, 0.1);
                state.u_m_s += 0.002 * normal();
                state.w_m_s += 0.002 * normal();
                state.q_rad_s += 0.05_f64.to_radians() * normal();
                solution = solve(&pose(state, HORIZON - k), Some(&solution.start(1)));
                assert!(solution.converged(), "{name} after {k}");
                solves += 1;
            }
        }
        assert_eq!(solves, 343);
    }
}

//! Detects a stuck gimbal in the fall, before ignition.
//!
//! The landing motor has some per cent of the body's inertia. When it swings, the body turns the
//! other way ([`swinging_kg_m2`](crate::vehicle::airframe::Airframe::swinging_kg_m2)), and the gyro
//! measures that independently of the servo feedback. So the gimbal swings to and fro from fin
//! deployment to ignition, pitch and yaw alternately, and the gyro is compared with the expected
//! rate.
//!
//! Aerodynamic and fin moments turn the body more, but more slowly. The signs of the swing's rate
//! are a Thue-Morse sequence, and the sum of any parabola over it with these signs is zero (E.
//! Prouhet, 1851; J.-P. Allouche and J. Shallit, "The ubiquitous Prouhet-Thue-Morse sequence",
//! 1999).

use serde::{Deserialize, Serialize};

use crate::computer::FRAME_S;
use crate::vehicle::airframe::MassProperties;
use crate::vehicle::mission::Mission;

/// Signs of the gimbal rate in the legs of a swing: it is centred again after every second one.
const SIGNS: [f64; 8] = [1.0, -1.0, -1.0, 1.0, -1.0, 1.0, 1.0, -1.0];
/// Ratio of a swing to the gyro's noise, reached by as many repetitions as needed, up to a maximum.
const SIGMAS: f64 = 10.0;
const REPEATS_MAX: f64 = 4.0;
/// Share of the expected swing below which it counts against the gimbal. A stuck one shows zero,
/// with a scatter of 0.05; one at 0.3 of its rate with 1.5 degrees of play, which lands, shows
/// 0.17, and a sound one at least 0.5 (4,800 swings of mk3 in `real`, `wild` and `harsh`). Longer
/// legs would show more of a slow gimbal, and more of the fins.
const MOVES: f64 = 0.09;
/// The deficit is accumulated swing by swing, and a surplus reduces it (E. S. Page, "Continuous
/// inspection schemes", Biometrika 41, 1954). At this sum the gimbal is stuck: three or four swings
/// of a stuck one, one of a reversed one.
const STUCK: f64 = 0.25;

/// Definition of a swing and its expected response.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Swing {
    limit_rad: f64,
    leg_frames: u32,
    /// Delay from a command to the frame in which the gyro shows it.
    late_frames: u32,
    legs: u32,
    /// Change of the body rate per frame by a leg, rad/s.
    leg_rad_s: f64,
}

impl Swing {
    /// The swing for a mission's vehicle; `None` if its gyro would show too little.
    pub(super) fn of(mission: &Mission, mass: &MassProperties) -> Option<Self> {
        let (airframe, curve) = (&mission.airframe, &mission.motor_curve);
        let servo = &airframe.gimbal.servo;
        let limit_rad = airframe.gimbal.limit_rad();
        let leg_frames = libm::round(limit_rad / (servo.rate_rad_s() * FRAME_S)).max(1.0);
        let swinging_kg_m2 = airframe.swinging_kg_m2(curve, curve.total_mass_kg(), mass.cg_station_m);
        let leg_rad_s = limit_rad / FRAME_S * swinging_kg_m2 / mass.pitch_inertia_kg_m2;
        let noise_rad_s = mission.estimator.gyro_noise_deg_s_sqrt_hz.to_radians()
            * libm::sqrt(leg_frames / (SIGNS.len() as f64 * FRAME_S));
        let sigmas = leg_rad_s / noise_rad_s;
        let repeats = libm::ceil(SIGMAS * SIGMAS / (sigmas * sigmas)).max(1.0);
        (repeats <= REPEATS_MAX).then(|| Self {
            limit_rad,
            leg_frames: leg_frames as u32,
            late_frames: libm::round(servo.delay_s / FRAME_S) as u32 + 1,
            legs: repeats as u32 * SIGNS.len() as u32,
            leg_rad_s,
        })
    }
}

/// The monitor of both axes.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct SwingWatch {
    /// The swinging axis, pitch or yaw, and the frame of its swing.
    axis: usize,
    frame: u32,
    sum_rad_s: f64,
    /// Accumulated deficit, as a share of a swing.
    missing: f64,
}

impl SwingWatch {
    /// The state before the interrupted swing.
    pub(super) fn interrupted(self) -> Self {
        Self { axis: self.axis, missing: self.missing, ..Self::default() }
    }

    /// Whether an axis is stuck; permanent.
    pub(super) fn found_stuck(&self) -> bool {
        self.missing >= STUCK
    }

    /// Takes a frame's cross rates, rad/s. Returns the gimbal command (pitch, yaw), rad, and the
    /// rates that the swing should have added, rad/s.
    pub(super) fn update(&mut self, swing: &Swing, rates_rad_s: [f64; 2]) -> ([f64; 2], [f64; 2]) {
        let (mut command_rad, mut added_rad_s) = ([0.0; 2], [0.0; 2]);
        if self.found_stuck() {
            return (command_rad, added_rad_s);
        }
        let leg_frames = swing.leg_frames;
        let axis = self.axis.min(1);
        if self.frame / leg_frames < swing.legs {
            let leg = (self.frame / leg_frames) as usize % SIGNS.len();
            command_rad[axis] = swing.limit_rad * SIGNS[..=leg].iter().sum::<f64>();
        }
        // The body turns against the gimbal.
        if let Some(frame) = self.frame.checked_sub(swing.late_frames) {
            let against = -SIGNS[(frame / leg_frames) as usize % SIGNS.len()];
            self.sum_rad_s += against * rates_rad_s[axis];
            added_rad_s[axis] = against * swing.leg_rad_s / f64::from(leg_frames);
        }
        self.frame += 1;
        if self.frame == swing.legs * leg_frames + swing.late_frames {
            let shown = self.sum_rad_s / (swing.leg_rad_s * f64::from(swing.legs));
            let missing = (self.missing + MOVES - shown).max(0.0);
            // An axis with a deficit swings again at once.
            *self = Self { axis: if missing > 0.0 { axis } else { 1 - axis }, missing, ..Self::default() };
        }
        (command_rad, added_rad_s)
    }
}

#[cfg(test)]
pub(super) mod reaction;

#[cfg(test)]
mod tests {
    use rand::{Rng as _, SeedableRng as _};
    use rand_chacha::ChaCha8Rng;

    use super::reaction::Reaction;
    use super::*;
    use crate::vehicle::airframe::MassModel;
    use crate::vehicles::mission::test_missions::TEST_MISSIONS;
    use crate::vehicles::mission::{BUILTIN, from_toml};

    fn swing_of(name: &str) -> (Mission, Option<Swing>) {
        let mut missions = BUILTIN.iter().chain(&TEST_MISSIONS);
        let (_, text) = missions.find(|(available, _)| *available == name).unwrap();
        let mission = from_toml(text, name).unwrap();
        let mass = MassModel::new(&mission.airframe.mass, mission.motor_curve.propellant_mass_kg()).at(0.0);
        let swing = Swing::of(&mission, &mass);
        (mission, swing)
    }

    /// Time at which the gimbal of mk3 is found stuck, s, with its axes turning by shares of their
    /// commands; within 20 s. The vehicle sways by 40 degrees/s, 0.8 times a second, and the gyro
    /// has the mission's noise.
    fn found_s(shares: [f64; 2], seed: u64) -> Option<f64> {
        let (mission, swing) = swing_of("mk3");
        let swing = swing.unwrap();
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut reaction = Reaction::of(&mission, swing);
        reaction.shares = shares;
        let (mut watch, mut command_rad) = (SwingWatch::default(), [0.0; 2]);
        (0..4000).find_map(|frame| {
            let time_s = f64::from(frame) * FRAME_S;
            let sway_rad_s = 0.7 * libm::sin(5.0 * time_s);
            let rates_rad_s = reaction.sensed_rad_s(command_rad).map(|sensed_rad_s| {
                // Twelve even numbers have the spread of one normal one.
                let normal: f64 =
                    (0..12).map(|_| f64::from(random.next_u32()) / f64::from(u32::MAX) - 0.5).sum();
                sensed_rad_s + sway_rad_s + 0.0125 * normal
            });
            (command_rad, _) = watch.update(&swing, rates_rad_s);
            watch.found_stuck().then_some(time_s)
        })
    }

    /// mk3's motor has 0.365 (0.203^2 / 12 + 0.038^2 / 16) = 0.001 286 kg m^2, and the body 0.137:
    /// 9 degrees of swing turn it by 0.0845 degrees.
    #[test]
    fn val_hand_a_leg_turns_mk3_by_a_twelfth_of_a_degree() {
        let swing = swing_of("mk3").1.unwrap();
        assert!((swing.leg_rad_s * FRAME_S / 0.084_5_f64.to_radians() - 1.0).abs() < 1e-3, "{swing:?}");
        // 9 degrees at 300 degrees/s, after 15 ms.
        assert_eq!((swing.leg_frames, swing.late_frames, swing.legs), (6, 4, 8));
        // A small motor shows too little.
        assert_eq!(
            ["mk2", "mk2-h53", "mini-f10", "vlr"].map(|name| swing_of(name).1.is_some()),
            [true, true, false, false]
        );
    }

    #[test]
    fn the_swing_stays_between_the_stops_and_one_axis_moves_at_a_time() {
        let (mission, swing) = swing_of("mk3");
        let mut reaction = Reaction::of(&mission, swing.unwrap());
        let (mut watch, mut command_rad, mut moved) = (SwingWatch::default(), [0.0; 2], [false; 2]);
        for _ in 0..200 {
            let rates_rad_s = reaction.sensed_rad_s(command_rad);
            (command_rad, _) = watch.update(&swing.unwrap(), rates_rad_s);
            assert!(command_rad.iter().all(|rad| rad.abs() <= mission.airframe.gimbal.limit_rad()));
            assert!(command_rad.contains(&0.0), "{command_rad:?}");
            moved = [0, 1].map(|axis: usize| moved[axis] || command_rad[axis] != 0.0);
        }
        assert_eq!(moved, [true; 2]);
    }

    #[test]
    fn a_stuck_or_reversed_axis_is_found_and_one_that_moves_by_half_is_not() {
        for seed in 0..20 {
            assert_eq!(found_s([1.0, 1.0], seed), None);
            assert_eq!(found_s([0.5, 0.5], seed), None);
            // Four or five swings of 0.26 s, after one of the other axis.
            for shares in [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0]] {
                assert!(found_s(shares, seed).is_some_and(|found_s| found_s < 1.6), "{shares:?}");
            }
            for shares in [[-1.0, 1.0], [1.0, -1.0]] {
                assert!(found_s(shares, seed).is_some_and(|found_s| found_s < 0.6), "{shares:?}");
            }
        }
    }

    /// A restart preserves the result, and an interrupted swing is repeated.
    #[test]
    fn a_restart_forgets_the_swing_and_nothing_else() {
        let swing = swing_of("mk3").1.unwrap();
        let mut watch = SwingWatch::default();
        let silent =
            |watch: &mut SwingWatch, frames| (0..frames).for_each(|_| _ = watch.update(&swing, [0.0; 2]));
        silent(&mut watch, 52 + 26);
        let resumed = watch.interrupted();
        assert_eq!((resumed.missing.to_bits(), resumed.frame), (MOVES.to_bits(), 0));
        let mut resumed = resumed;
        silent(&mut resumed, 2 * 52);
        assert!(resumed.found_stuck() && resumed.interrupted().found_stuck());
        assert_eq!(resumed.update(&swing, [0.0; 2]).0.map(f64::to_bits), [0; 2], "it rests");
    }
}

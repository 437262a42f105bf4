//! How far the thrust points off the gimbal's angle, from the rotation that the gimbal does not explain.
//!
//! In each of the two axes the rotation obeys `rate' = -T sin(g + e) arm / I + other` with the gimbal angle `g`, the
//! thrust's offset `e` and what else is known to turn the vehicle. An observer follows the rate and lets the offset
//! explain what is left (Luenberger, both poles at 8 rad/s). Slop and misalignment are in `e`, and slow
//! moments of the air as well: to a controller they are all an offset to be steered against.

/// Both poles of the observer, rad/s: slow beside the gimbal, fast beside the burn.
const BANDWIDTH_RAD_S: f64 = 8.0;
/// The offset stays inside this, rad: 3 deg, six times a bad misalignment.
pub const LARGEST_OFFSET_RAD: f64 = 0.052;
/// Below this angular acceleration per radian of gimbal there is nothing to learn, 1/s^2.
const SMALLEST_AUTHORITY_S2: f64 = 20.0;

/// What one frame tells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OffsetSample {
    /// Rotation rates about body y and z, rad/s.
    pub rate_rad_s: [f64; 2],
    /// Gimbal angles, pitch and yaw, rad.
    pub gimbal_rad: [f64; 2],
    /// Thrust, N.
    pub thrust_n: f64,
    /// From the nozzle forward to the centre of gravity, m.
    pub arm_m: f64,
    /// Inertia about a lateral axis, kg m^2.
    pub inertia_kg_m2: f64,
    /// Angular acceleration from elsewhere, about body y and z, rad/s^2.
    pub other_rad_s2: [f64; 2],
    /// Length of the frame, s.
    pub interval_s: f64,
}

/// The offsets in pitch and yaw.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ThrustOffset {
    rate_rad_s: Option<[f64; 2]>,
    offset_rad: [f64; 2],
}

impl ThrustOffset {
    /// The offset to add to the gimbal's pitch and yaw angles to have the thrust's, rad.
    pub fn offset_rad(&self) -> [f64; 2] {
        self.offset_rad
    }

    /// Takes one frame. Without thrust the offset is held; a sample that is not finite teaches nothing.
    pub fn update(&mut self, sample: &OffsetSample) {
        let authority_s2 = sample.thrust_n * sample.arm_m / sample.inertia_kg_m2;
        let finite = sample
            .rate_rad_s
            .iter()
            .chain(&sample.gimbal_rad)
            .chain(&sample.other_rad_s2)
            .chain([&authority_s2, &sample.interval_s])
            .all(|value| value.is_finite());
        if !finite {
            return;
        }
        let Some(followed) = self.rate_rad_s.filter(|_| authority_s2 > SMALLEST_AUTHORITY_S2) else {
            self.rate_rad_s = Some(sample.rate_rad_s);
            return;
        };
        let mut next = followed;
        for axis in 0..2 {
            let left_rad_s = sample.rate_rad_s[axis] - followed[axis];
            let turned = -authority_s2 * libm::sin(sample.gimbal_rad[axis] + self.offset_rad[axis])
                + sample.other_rad_s2[axis]
                + 2.0 * BANDWIDTH_RAD_S * left_rad_s;
            next[axis] += sample.interval_s * turned;
            let change = BANDWIDTH_RAD_S * BANDWIDTH_RAD_S * left_rad_s / authority_s2;
            self.offset_rad[axis] = (self.offset_rad[axis] - sample.interval_s * change)
                .clamp(-LARGEST_OFFSET_RAD, LARGEST_OFFSET_RAD);
        }
        self.rate_rad_s = Some(next);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ARM_M: f64 = 0.52;
    const INERTIA_KG_M2: f64 = 0.12;
    const DT_S: f64 = 0.005;

    /// Turns a vehicle by a thrust that is off, under a gimbal that moves, and tells the observer of it.
    fn turn(offset_rad: [f64; 2], thrust_n: f64, frames: u32) -> ThrustOffset {
        let mut observer = ThrustOffset::default();
        let mut rate = [0.0; 2];
        for frame in 0..frames {
            let swing = 0.02 * libm::sin(0.05 * f64::from(frame));
            let gimbal_rad = [swing, -0.5 * swing];
            let sample = OffsetSample {
                rate_rad_s: rate,
                gimbal_rad,
                thrust_n,
                arm_m: ARM_M,
                inertia_kg_m2: INERTIA_KG_M2,
                other_rad_s2: [0.3, 0.0],
                interval_s: DT_S,
            };
            observer.update(&sample);
            for axis in 0..2 {
                let angle = gimbal_rad[axis] + offset_rad[axis];
                rate[axis] +=
                    DT_S * (sample.other_rad_s2[axis] - thrust_n * ARM_M / INERTIA_KG_M2 * libm::sin(angle));
            }
        }
        observer
    }

    #[test]
    fn half_a_degree_of_misalignment_is_found_within_a_second() {
        let truth = [0.5_f64.to_radians(), -0.25_f64.to_radians()];
        let found = turn(truth, 40.0, 200).offset_rad();
        for axis in 0..2 {
            // What is left after eight time constants of a double pole: 9 exp(-8).
            let left = 9.0 * 0.000_335_5 * truth[axis].abs();
            assert!((found[axis] - truth[axis]).abs() < left, "{found:?} of {truth:?}");
        }
    }

    #[test]
    fn it_is_bounded_and_without_thrust_it_is_held() {
        let stuck = turn([0.2, -0.2], 40.0, 400).offset_rad();
        assert_eq!(stuck.map(f64::to_bits), [LARGEST_OFFSET_RAD, -LARGEST_OFFSET_RAD].map(f64::to_bits));
        let held = turn([0.2, -0.2], 1.0, 400).offset_rad();
        assert_eq!(held.map(f64::to_bits), [0; 2]);
    }

    #[test]
    fn nonsense_teaches_nothing() {
        let good = OffsetSample {
            rate_rad_s: [0.1, 0.2],
            gimbal_rad: [0.01, 0.0],
            thrust_n: 40.0,
            arm_m: ARM_M,
            inertia_kg_m2: INERTIA_KG_M2,
            other_rad_s2: [0.0; 2],
            interval_s: DT_S,
        };
        let mut observer = ThrustOffset::default();
        observer.update(&good);
        let before = observer;
        for bad in [
            OffsetSample { rate_rad_s: [f64::NAN, 0.0], ..good },
            OffsetSample { thrust_n: f64::INFINITY, ..good },
            OffsetSample { inertia_kg_m2: f64::NAN, ..good },
            OffsetSample { other_rad_s2: [0.0, f64::NAN], ..good },
        ] {
            observer.update(&bad);
            assert_eq!(observer, before, "{bad:?}");
        }
    }
}

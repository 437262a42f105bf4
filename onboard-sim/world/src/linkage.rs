//! What lies between a servo and what it moves: a gain, a misalignment, and play that the servo's data do not know. The
//! servo's feedback sees none of it.

/// One linkage. Angles in rad.
#[derive(Debug, Clone)]
pub(crate) struct Linkage {
    gain: f64,
    offset_rad: f64,
    half_slop_rad: f64,
    stops_rad: (f64, f64),
    moved_rad: f64,
}

impl Linkage {
    /// A linkage at rest with its servo at an angle, rad. Play and misalignment move nothing past the stops.
    pub(crate) fn new(
        gain: f64,
        offset_rad: f64,
        slop_rad: f64,
        stops_rad: (f64, f64),
        servo_rad: f64,
    ) -> Self {
        Self { gain, offset_rad, half_slop_rad: 0.5 * slop_rad, stops_rad, moved_rad: gain * servo_rad }
    }

    /// This linkage with the data of `after`; what it moves stays where it is.
    pub(crate) fn changed(&self, after: &Self) -> Self {
        Self { moved_rad: self.moved_rad, ..after.clone() }
    }

    /// Follows the servo.
    pub(crate) fn step(&mut self, servo_rad: f64) {
        let driven_rad = self.gain * servo_rad;
        self.moved_rad =
            self.moved_rad.clamp(driven_rad - self.half_slop_rad, driven_rad + self.half_slop_rad);
    }

    /// Angle of what it moves, rad.
    pub(crate) fn rad(&self) -> f64 {
        (self.moved_rad + self.offset_rad).clamp(self.stops_rad.0, self.stops_rad.1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn val_hand_gain_offset_and_play() {
        let mut linkage = Linkage::new(1.1, 0.01, 0.02, (-0.2, 0.2), 0.0);
        linkage.step(0.1);
        // 1.1 * 0.1 less half the play, and the misalignment.
        assert!((linkage.rad() - (0.11 - 0.01 + 0.01)).abs() < 1e-15);
        linkage.step(0.09);
        assert!((linkage.rad() - 0.11).abs() < 1e-15, "inside the play");
        linkage.step(0.3);
        assert!((linkage.rad() - 0.2).abs() < 1e-15, "stop");
    }

    #[test]
    fn a_sound_linkage_follows_its_servo_to_the_bit() {
        let mut linkage = Linkage::new(1.0, 0.0, 0.0, (-0.12, 0.12), 0.03);
        for servo_rad in [0.031, -0.07, 0.119_999_9] {
            linkage.step(servo_rad);
            assert_eq!(linkage.rad().to_bits(), servo_rad.to_bits());
        }
    }
}

//! A servo as a fit sees it: commands in, angles out, for any delay. Unlike the simulated one it
//! has no grid of time, so that its angles follow a change of the delay smoothly.

/// The unknown properties of a servo.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ServoModel {
    pub(super) delay_s: f64,
    pub(super) rate_rad_s: f64,
    /// Whole play between horn and load, rad.
    pub(super) play_rad: f64,
    /// It turns between plus and minus this, rad.
    pub(super) limit_rad: f64,
}

/// Parts of a frame, of a millisecond each. In a part the angle is the one that it ends with, as in
/// the simulated vehicle, whose delay is defined so; a delay between two angles' means would be
/// half a millisecond shorter.
pub(super) const PARTS: usize = 5;

impl ServoModel {
    /// The load's angles, rad: of every frame those of its parts and the angle at its end.
    /// `commands_rad[k]` is given at the end of frame `k`; before the first the servo rests at
    /// `rests_rad`.
    pub(super) fn angles_rad(
        &self,
        rests_rad: f64,
        commands_rad: &[f64],
        frame_s: f64,
    ) -> Vec<([f64; PARTS], f64)> {
        let delay = (self.delay_s.max(0.0)) / frame_s;
        let frames_late = libm::floor(delay);
        let late = delay - frames_late;
        let frames_late = frames_late as usize;
        let half_play_rad = 0.5 * self.play_rad.max(0.0);
        let part_s = frame_s / PARTS as f64;
        let (mut horn_rad, mut load_rad) = (rests_rad, rests_rad);
        let given = |frame: usize, back: usize| {
            frame.checked_sub(back).and_then(|place| commands_rad.get(place)).copied().unwrap_or(rests_rad)
        };
        (0..commands_rad.len())
            .map(|frame| {
                // In this frame it obeys first the older command, and after the rest of the delay
                // the newer one.
                let (older, newer) = (given(frame, frames_late + 2), given(frame, frames_late + 1));
                let parts = core::array::from_fn(|part| {
                    let from = part as f64 / PARTS as f64;
                    let of_older = ((late - from) * PARTS as f64).clamp(0.0, 1.0);
                    for (command_rad, share) in [(older, of_older), (newer, 1.0 - of_older)] {
                        let wanted_rad = command_rad.clamp(-self.limit_rad, self.limit_rad);
                        let most_rad = self.rate_rad_s.max(0.0) * part_s * share;
                        horn_rad += (wanted_rad - horn_rad).clamp(-most_rad, most_rad);
                        load_rad = load_rad.clamp(horn_rad - half_play_rad, horn_rad + half_play_rad);
                    }
                    load_rad
                });
                (parts, load_rad)
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ends(servo: &ServoModel, commands_rad: &[f64]) -> Vec<f64> {
        servo.angles_rad(0.0, commands_rad, 0.005).into_iter().map(|(_, end_rad)| end_rad).collect()
    }

    /// A step of 0.05 rad at the end of frame 0, 12 ms of delay, 5 rad/s: it moves from 12 ms after
    /// frame 0 to 22 ms, and is at 0.015 rad after three frames, at 0.04 after four.
    #[test]
    fn val_hand_delay_rate_and_play() {
        let servo = ServoModel { delay_s: 0.012, rate_rad_s: 5.0, play_rad: 0.0, limit_rad: 0.12 };
        let found = ends(&servo, &[0.05; 6]);
        for (found, expected) in found.iter().zip([0.0, 0.0, 0.0, 0.015, 0.04, 0.05]) {
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        }
        // Half of the play is lost, and the stop holds.
        let loose = ServoModel { play_rad: 0.01, ..servo };
        assert!((ends(&loose, &[0.5; 40])[39] - 0.115).abs() < 1e-12);
    }

    #[test]
    fn an_integer_delay_shifts_by_that_many_frames() {
        let servo = ServoModel { delay_s: 0.02, rate_rad_s: 1e6, play_rad: 0.0, limit_rad: 0.12 };
        let commands: Vec<f64> = (1..10).map(|k| 0.01 * f64::from(k)).collect();
        let found = ends(&servo, &commands);
        // Given at the end of frame 0, obeyed 20 ms later: in frame 5.
        assert!(found[4].abs() < 1e-12 && (found[5] - 0.01).abs() < 1e-12 && (found[8] - 0.04).abs() < 1e-12);
    }
}

//! A servo: a pure delay, a rate limit, stops, and play between horn and load. A linkage connects
//! it to the surface that it moves.
//!
//! Play: G. Tao and P. V. Kokotovic, "Adaptive control of systems with backlash", Automatica
//! 29, 1993.

use flight::vehicle::airframe::Servo as ServoData;

use crate::world::STEP_S;

/// Steps that the delay line holds: an airframe's servo delay is 0.1 s at most.
const LINE_STEPS: usize = 128;

/// One servo and its load. Angles in rad.
#[derive(Debug, Clone)]
pub(crate) struct Servo {
    line_rad: [f64; LINE_STEPS],
    next: usize,
    delay_steps: usize,
    step_max_rad: f64,
    half_slop_rad: f64,
    stops_rad: (f64, f64),
    horn_rad: f64,
    load_rad: f64,
    /// Steps for which it does not move; the largest number is for ever.
    stuck_steps: u64,
    /// Where it runs to and stays, whatever is commanded.
    jams_at_rad: Option<f64>,
}

impl Servo {
    /// A servo at rest at an angle, rad, between its stops, rad.
    pub(crate) fn new(data: &ServoData, stops_rad: (f64, f64), at_rad: f64) -> Self {
        let at_rad = at_rad.clamp(stops_rad.0, stops_rad.1);
        let delay_steps = libm::round(data.delay_s / STEP_S) as usize;
        Self {
            line_rad: [at_rad; LINE_STEPS],
            next: 0,
            delay_steps: delay_steps.min(LINE_STEPS - 1),
            step_max_rad: data.rate_rad_s() * STEP_S,
            half_slop_rad: 0.5 * data.slop_rad(),
            stops_rad,
            horn_rad: at_rad,
            load_rad: at_rad,
            stuck_steps: 0,
            jams_at_rad: None,
        }
    }

    /// This servo with the delay, rate, play and stops of `after`; `before` is the data that it was
    /// built from. A stuck servo stays stuck, and a slow one stays slow by the same factor.
    pub(crate) fn changed(&self, before: &ServoData, after: &Self) -> Self {
        let was_rad = before.rate_rad_s() * STEP_S;
        // Unchanged values are bit-identical.
        let step_max_rad = if after.step_max_rad.to_bits() == was_rad.to_bits() {
            self.step_max_rad
        } else {
            after.step_max_rad * (self.step_max_rad / was_rad)
        };
        Self {
            delay_steps: after.delay_steps,
            step_max_rad,
            half_slop_rad: after.half_slop_rad,
            stops_rad: after.stops_rad,
            ..self.clone()
        }
    }

    /// Takes a command and moves for one step. NaN is ignored.
    pub(crate) fn step(&mut self, command_rad: f64) {
        let last_rad = self.line_rad[(self.next + LINE_STEPS - 1) % LINE_STEPS];
        self.line_rad[self.next] = if command_rad.is_nan() { last_rad } else { command_rad };
        let delayed_rad = self.line_rad[(self.next + LINE_STEPS - self.delay_steps) % LINE_STEPS];
        self.next = (self.next + 1) % LINE_STEPS;
        if self.stuck_steps > 0 {
            self.stuck_steps -= u64::from(self.stuck_steps < u64::MAX);
            return;
        }
        let (low_rad, high_rad) = self.stops_rad;
        let wanted_rad = self.jams_at_rad.unwrap_or(delayed_rad).clamp(low_rad, high_rad);
        self.horn_rad += (wanted_rad - self.horn_rad).clamp(-self.step_max_rad, self.step_max_rad);
        // The load does not move until the horn has taken up the play.
        self.load_rad =
            self.load_rad.clamp(self.horn_rad - self.half_slop_rad, self.horn_rad + self.half_slop_rad);
    }

    /// Angle of the load, rad.
    pub(crate) fn load_rad(&self) -> f64 {
        self.load_rad
    }

    /// The servo is stuck from now on.
    pub(crate) fn stick(&mut self) {
        self.stuck_steps = u64::MAX;
    }

    /// The servo has no power for so many steps, and stays where it is.
    pub(crate) fn rest(&mut self, steps: u64) {
        self.stuck_steps = self.stuck_steps.max(steps);
    }

    /// Whether its pack gives current.
    pub(crate) fn has_power(&self) -> bool {
        self.stuck_steps == 0 || self.stuck_steps == u64::MAX
    }

    /// The servo runs to an angle, rad, from now on, and stays there.
    pub(crate) fn jam(&mut self, at_rad: f64) {
        self.jams_at_rad = Some(at_rad);
    }

    /// The servo turns at a fraction of its rate from now on.
    pub(crate) fn slow(&mut self, scale: f64) {
        self.step_max_rad *= scale.clamp(0.0, 1.0);
    }
}

// Linkage between a servo and its surface: a gain, a misalignment, and play that is not in the
// servo's data. The servo's feedback does not include it.

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
    /// A linkage at rest with its servo at an angle, rad. Play and misalignment move nothing past
    /// the stops.
    pub(crate) fn new(
        gain: f64,
        offset_rad: f64,
        slop_rad: f64,
        stops_rad: (f64, f64),
        servo_rad: f64,
    ) -> Self {
        Self { gain, offset_rad, half_slop_rad: 0.5 * slop_rad, stops_rad, moved_rad: gain * servo_rad }
    }

    /// This linkage with the data of `after`; its surface does not move.
    pub(crate) fn changed(&self, after: &Self) -> Self {
        Self { moved_rad: self.moved_rad, ..after.clone() }
    }

    /// Follows the servo.
    pub(crate) fn step(&mut self, servo_rad: f64) {
        let driven_rad = self.gain * servo_rad;
        self.moved_rad =
            self.moved_rad.clamp(driven_rad - self.half_slop_rad, driven_rad + self.half_slop_rad);
    }

    /// Angle of its surface, rad.
    pub(crate) fn rad(&self) -> f64 {
        (self.moved_rad + self.offset_rad).clamp(self.stops_rad.0, self.stops_rad.1)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn servo(delay_s: f64, rate_deg_s: f64, slop_deg: f64) -> Servo {
        let data = ServoData { rate_deg_s, delay_s, slop_deg };
        Servo::new(&data, (-0.12, 0.12), 0.0)
    }

    fn after(servo: &mut Servo, command_rad: f64, steps: usize) -> f64 {
        for _ in 0..steps {
            servo.step(command_rad);
        }
        servo.load_rad()
    }

    /// 20 ms of delay, then 100 rad/s over 1 ms steps of 0.1 rad.
    #[test]
    fn delay_and_rate() {
        let mut servo = servo(0.020, 1.0_f64.to_degrees(), 0.0);
        assert!(after(&mut servo, 0.05, 20).abs() < 1e-15);
        assert!((after(&mut servo, 0.05, 10) - 0.010).abs() < 1e-12);
        assert!((after(&mut servo, 0.05, 100) - 0.05).abs() < 1e-12);
        assert!((after(&mut servo, 9.0, 300) - 0.12).abs() < 1e-12, "stop");
    }

    #[test]
    fn play_is_lost_at_each_turn() {
        let mut servo = servo(0.0, 1e6, 0.02_f64.to_degrees());
        assert!((after(&mut servo, 0.05, 1) - 0.04).abs() < 1e-12);
        assert!((after(&mut servo, 0.035, 1) - 0.04).abs() < 1e-12, "inside the play");
        assert!((after(&mut servo, 0.0, 1) - 0.01).abs() < 1e-12);
    }

    #[test]
    fn a_stuck_servo_stays() {
        let mut servo = servo(0.0, 1e6, 0.0);
        let at_rad = after(&mut servo, 0.05, 1);
        servo.stick();
        assert!((after(&mut servo, -0.1, 50) - at_rad).abs() < 1e-15);
    }

    #[test]
    fn a_servo_without_power_stays_and_follows_again() {
        let mut servo = servo(0.0, 1.0_f64.to_degrees(), 0.0);
        servo.rest(50);
        assert!(after(&mut servo, 0.05, 50).abs() < 1e-15);
        assert!((after(&mut servo, 0.05, 20) - 0.020).abs() < 1e-12);
        servo.stick();
        servo.rest(50);
        assert!((after(&mut servo, -0.1, 200) - 0.020).abs() < 1e-12, "stuck for ever");
    }

    #[test]
    fn a_jammed_servo_runs_to_its_angle_at_its_rate() {
        let mut servo = servo(0.0, 1.0_f64.to_degrees(), 0.0);
        servo.jam(0.05);
        assert!((after(&mut servo, -0.1, 10) - 0.010).abs() < 1e-12);
        assert!((after(&mut servo, -0.1, 100) - 0.05).abs() < 1e-12);
    }

    proptest! {
        #[test]
        fn any_command_stays_between_the_stops(
            commands in proptest::collection::vec(proptest::num::f64::ANY, 1..100)
        ) {
            let mut servo = servo(0.005, 2000.0, 1.0);
            for command_rad in commands {
                servo.step(command_rad);
                prop_assert!(servo.load_rad().abs() <= 0.12);
            }
        }
    }

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

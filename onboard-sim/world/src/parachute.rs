//! The parachute: it is ejected by command, its lines are taut after a delay, and then it fills with the distance
//! fallen through the air.

use flight::vehicle::airframe::Parachute as ParachuteData;

use crate::STEP_S;

#[derive(Debug, Clone)]
pub(crate) struct Parachute {
    data: ParachuteData,
    commanded_s: Option<f64>,
    travelled_m: f64,
    fails: bool,
}

impl Parachute {
    pub(crate) fn new(data: &ParachuteData) -> Self {
        Self { data: *data, commanded_s: None, travelled_m: 0.0, fails: false }
    }

    /// Ejects the parachute; only the first command counts.
    pub(crate) fn eject(&mut self, time_s: f64) {
        if !self.fails {
            self.commanded_s.get_or_insert(time_s);
        }
    }

    /// From now on no command ejects it.
    pub(crate) fn break_down(&mut self) {
        self.fails = true;
    }

    pub(crate) fn ejected(&self) -> bool {
        self.commanded_s.is_some()
    }

    pub(crate) fn ejected_s(&self) -> Option<f64> {
        self.commanded_s
    }

    /// One step at an airspeed, m/s.
    pub(crate) fn step(&mut self, time_s: f64, airspeed_m_s: f64) {
        if self.commanded_s.is_some_and(|commanded_s| time_s - commanded_s >= self.data.ejection_delay_s) {
            self.travelled_m += airspeed_m_s * STEP_S;
        }
    }

    /// Fraction of the canopy that is open, 0 to 1. The area grows with the square of the distance, because the
    /// diameter of the canopy grows linearly with it.
    pub(crate) fn open_share(&self) -> f64 {
        let filled = (self.travelled_m / self.data.inflation_distance_m).min(1.0);
        filled * filled
    }

    pub(crate) fn drag_area_m2(&self) -> f64 {
        self.data.area_m2 * self.data.drag_coefficient * self.open_share()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_canopy_opens_after_delay_and_distance() {
        let data = ParachuteData {
            area_m2: 2.0,
            drag_coefficient: 0.8,
            ejection_delay_s: 1.0,
            inflation_distance_m: 10.0,
        };
        let mut parachute = Parachute::new(&data);
        parachute.step(100.0, 50.0);
        assert!(parachute.drag_area_m2().abs() < 1e-15 && !parachute.ejected());
        parachute.eject(0.0);
        for (step, expected) in [(1000, 0.0), (1250, 0.25), (1500, 1.0), (3000, 1.0)] {
            let mut parachute = parachute.clone();
            for now in 0..step {
                parachute.step(f64::from(now) * STEP_S, 20.0);
            }
            assert!((parachute.open_share() - expected).abs() < 1e-9, "{step}: {}", parachute.open_share());
        }
        let mut broken = Parachute::new(&data);
        broken.break_down();
        broken.eject(0.0);
        broken.step(100.0, 50.0);
        assert!(broken.drag_area_m2().abs() < 1e-15 && !broken.ejected());
    }
}

//! The battery of the vehicle: charge, voltage under load, and the vehicle's consumption.
//!
//! Two lithium-polymer cells of 1 Ah. Nothing of it was measured on this vehicle.
//!
//! An open-circuit voltage behind a resistance (G. L. Plett, Battery Management Systems, volume 1,
//! 2015, chapter 2).

/// Cells in series.
const CELLS: f64 = 2.0;
/// Charge of the full battery, A s: 1 Ah.
const FULL_A_S: f64 = 3600.0;
/// Resistance of the battery and its wires, ohm: about 30 mohm a cell, as such cells have, and the
/// plug.
const RESISTANCE_OHM: f64 = 0.07;
/// Voltage of a cell at rest over its charge, typical of the tables that makers and users of such
/// cells publish.
const AT_REST_V: [(f64, f64); 9] = [
    (0.0, 3.0),
    (0.05, 3.45),
    (0.1, 3.68),
    (0.2, 3.74),
    (0.4, 3.79),
    (0.6, 3.87),
    (0.8, 3.98),
    (0.9, 4.06),
    (1.0, 4.2),
];
/// Flight computer, sensors and radio, A: 2.6 W.
const STEADY_A: f64 = 0.35;
/// A servo at rest, A.
const SERVO_HOLDS_A: f64 = 0.02;
/// A small servo in motion, A.
const SERVO_MOVES_A: f64 = 0.7;
/// Current through an ignited igniter, A.
const IGNITER_A: f64 = 5.0;
/// A surface that turned by more than this in a frame, rad, is moved by its servo: 2 deg/s.
const MOVES_RAD: f64 = 1.7e-4;

/// The battery, and the currents of the last frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Battery {
    /// 0 to 1.
    charge: f64,
    current_a: f64,
    surfaces_rad: [f64; 6],
}

impl Battery {
    /// A battery with this charge, 0 to 1, in a vehicle with its surfaces at these angles, rad.
    pub fn new(charge: f64, surfaces_rad: [f64; 6]) -> Self {
        let current_a = STEADY_A + 6.0 * SERVO_HOLDS_A;
        Self { charge: charge.clamp(0.0, 1.0), current_a, surfaces_rad }
    }

    /// Advances by a frame of this length, s, at whose end the surfaces are at these angles, rad.
    pub fn step(&mut self, surfaces_rad: [f64; 6], igniters: usize, step_s: f64) {
        let before = core::mem::replace(&mut self.surfaces_rad, surfaces_rad);
        let moving =
            before.iter().zip(&surfaces_rad).filter(|(was, is)| (*was - *is).abs() > MOVES_RAD).count();
        self.current_a = STEADY_A
            + SERVO_HOLDS_A * (6 - moving) as f64
            + SERVO_MOVES_A * moving as f64
            + IGNITER_A * igniters as f64;
        self.charge = (self.charge - self.current_a * step_s / FULL_A_S).max(0.0);
    }

    /// Voltage at its plug, V.
    pub fn volts(&self) -> f64 {
        CELLS * cell_at_rest_v(self.charge) - RESISTANCE_OHM * self.current_a
    }

    /// Current drawn, A.
    pub fn current_a(&self) -> f64 {
        self.current_a
    }

    /// Remaining share of the full charge, 0 to 1, as a coulomb counter measures it.
    pub fn charge(&self) -> f64 {
        self.charge
    }
}

fn cell_at_rest_v(charge: f64) -> f64 {
    let after = AT_REST_V.iter().position(|(at, _)| *at >= charge).unwrap_or(AT_REST_V.len() - 1).max(1);
    let ((low, low_v), (high, high_v)) = (AT_REST_V[after - 1], AT_REST_V[after]);
    low_v + (high_v - low_v) * (charge - low) / (high - low)
}

#[cfg(test)]
mod tests {
    use super::*;

    const RESTS: [f64; 6] = [0.0; 6];

    #[test]
    fn it_empties_and_its_voltage_falls_all_the_way() {
        let mut battery = Battery::new(1.0, RESTS);
        let mut volts = battery.volts();
        assert!((8.3..8.4).contains(&volts), "{volts}");
        let mut seconds = 0;
        while battery.charge() > 0.0 {
            battery.step(RESTS, 0, 1.0);
            assert!(battery.volts() < volts);
            (volts, seconds) = (battery.volts(), seconds + 1);
        }
        // 1 Ah at 0.47 A.
        assert!((7600..7700).contains(&seconds), "{seconds}");
        assert!((5.9..6.0).contains(&volts), "{volts}");
    }

    #[test]
    fn moving_servos_and_an_igniter_pull_the_voltage_down() {
        let mut battery = Battery::new(0.5, RESTS);
        battery.step(RESTS, 0, 0.005);
        let rests_v = battery.volts();
        battery.step([0.01; 6], 0, 0.005);
        let moves_v = battery.volts();
        battery.step([0.01; 6], 1, 0.005);
        let lights_v = battery.volts();
        // 6 times 0.68 A, and 5 A, through 0.07 ohm.
        assert!((rests_v - moves_v - 0.286).abs() < 0.001, "{}", rests_v - moves_v);
        assert!((rests_v - lights_v - 0.35).abs() < 0.001, "{}", rests_v - lights_v);
        battery.step([0.01; 6], 0, 0.005);
        assert!((battery.volts() - rests_v).abs() < 0.001, "it recovers");
    }
}

//! The vehicle's two packs: charge, voltage under load, and consumption. One feeds the flight
//! computer, the other servos and igniters.
//!
//! Lithium-polymer cells of 1 Ah. Nothing of it was measured on this vehicle.
//!
//! An open-circuit voltage behind a resistance (G. L. Plett, Battery Management Systems, volume 1,
//! 2015, chapter 2).

/// Charge of a full pack, A s: 1 Ah.
const FULL_A_S: f64 = 3600.0;
/// Cells in series, and resistance with wires, ohm, of the computer's pack: about 30 mohm a cell,
/// as such cells have, and the plug.
const COMPUTER: (f64, f64) = (2.0, 0.07);
/// The same of the pack of servos and igniters.
const SERVOS: (f64, f64) = (3.0, 0.1);
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

/// Both packs, and their currents in the last frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Battery {
    computer: Pack,
    servos: Pack,
    surfaces_rad: [f64; 6],
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Pack {
    /// 0 to 1.
    charge: f64,
    current_a: f64,
}

impl Pack {
    fn step(&mut self, current_a: f64, step_s: f64) {
        self.current_a = current_a;
        self.charge = (self.charge - current_a * step_s / FULL_A_S).max(0.0);
    }

    fn volts(&self, (cells, resistance_ohm): (f64, f64)) -> f64 {
        cells * cell_at_rest_v(self.charge) - resistance_ohm * self.current_a
    }
}

impl Battery {
    /// Packs with this charge, 0 to 1, in a vehicle with its surfaces at these angles, rad.
    pub fn new(charge: f64, surfaces_rad: [f64; 6]) -> Self {
        let pack = |current_a| Pack { charge: charge.clamp(0.0, 1.0), current_a };
        Self { computer: pack(STEADY_A), servos: pack(6.0 * SERVO_HOLDS_A), surfaces_rad }
    }

    /// Advances by a frame of this length, s, at whose end the surfaces are at these angles, rad.
    pub fn step(&mut self, surfaces_rad: [f64; 6], igniters: usize, step_s: f64) {
        let before = core::mem::replace(&mut self.surfaces_rad, surfaces_rad);
        let moving =
            before.iter().zip(&surfaces_rad).filter(|(was, is)| (*was - *is).abs() > MOVES_RAD).count();
        self.computer.step(STEADY_A, step_s);
        let servos_a = SERVO_HOLDS_A * (6 - moving) as f64 + SERVO_MOVES_A * moving as f64;
        self.servos.step(servos_a + IGNITER_A * igniters as f64, step_s);
    }

    /// Voltage at the plug of the computer's pack, V.
    pub fn volts(&self) -> f64 {
        self.computer.volts(COMPUTER)
    }

    /// Voltage at the plug of the pack of servos and igniters, V.
    pub fn servo_volts(&self) -> f64 {
        self.servos.volts(SERVOS)
    }

    /// Current that the computer draws, A.
    pub fn current_a(&self) -> f64 {
        self.computer.current_a
    }

    /// Remaining share of the full charge of its pack, 0 to 1, as a coulomb counter measures it.
    pub fn charge(&self) -> f64 {
        self.computer.charge
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
        // 1 Ah at 0.35 A.
        assert!((10_250..10_320).contains(&seconds), "{seconds}");
        assert!((5.9..6.0).contains(&volts), "{volts}");
    }

    #[test]
    fn moving_servos_and_igniters_pull_their_own_pack_down() {
        let mut battery = Battery::new(0.5, RESTS);
        battery.step(RESTS, 0, 0.005);
        let (computer_v, rests_v) = (battery.volts(), battery.servo_volts());
        battery.step([0.01; 6], 0, 0.005);
        let moves_v = battery.servo_volts();
        battery.step([0.02; 6], 2, 0.005);
        let ignites_v = battery.servo_volts();
        // 6 times 0.68 A, and 2 times 5 A, through 0.1 ohm.
        assert!((rests_v - moves_v - 0.408).abs() < 0.001, "{}", rests_v - moves_v);
        assert!((rests_v - ignites_v - 1.408).abs() < 0.001, "{}", rests_v - ignites_v);
        assert!((battery.volts() - computer_v).abs() < 0.001, "the computer's");
        battery.step([0.02; 6], 0, 0.005);
        assert!((battery.servo_volts() - rests_v).abs() < 0.001, "it recovers");
    }
}

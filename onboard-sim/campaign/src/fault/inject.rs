//! Breaks things in a flight when they are due.

use flight::phase::Phase;
use nalgebra::Vector3;

use super::{Breakage, TimedFault, When};
use crate::draw::fault_shares;
use crate::fly::Flight;

/// Standard gravity, m/s^2: what a thousandth of is meant in an accelerometer's bias.
const GRAVITY_M_S2: f64 = flight::atmosphere::STANDARD_GRAVITY_M_S2;

/// The faults of a flight that have not come about yet.
#[derive(Debug, Clone)]
pub struct Injector {
    waiting: Vec<TimedFault>,
    /// When each phase was entered, s since apogee.
    entered_s: [Option<f64>; Phase::ALL.len()],
    happened: u64,
}

impl Injector {
    /// All of them are waiting, those of flight `number` of a seed.
    pub fn new(faults: &[TimedFault], seed: u64, number: u64) -> Self {
        let shares = fault_shares(seed, number, faults.len());
        let waiting = faults.iter().zip(shares).map(|(fault, share)| match fault.when {
            When::PhaseBetween(phase, [from_s, to_s]) => {
                TimedFault { when: When::Phase(phase, from_s + share * (to_s - from_s)), ..*fault }
            }
            When::Time(_) | When::Phase(..) => *fault,
        });
        Self { waiting: waiting.collect(), entered_s: [None; Phase::ALL.len()], happened: 0 }
    }

    /// How many came about.
    pub fn happened(&self) -> u64 {
        self.happened
    }

    /// Called before every frame.
    pub fn step(&mut self, flight: &mut Flight) {
        let time_s = flight.world().time_s();
        let phase = flight.pilot().mode().phase;
        self.entered_s[usize::from(phase.index())].get_or_insert(time_s);
        let entered_s = self.entered_s;
        let due = |fault: &TimedFault| match fault.when {
            When::Time(at_s) => time_s >= at_s,
            // Drawn as a delay when the flight was.
            When::PhaseBetween(phase, [delay_s, _]) | When::Phase(phase, delay_s) => {
                entered_s[usize::from(phase.index())].is_some_and(|entered_s| time_s >= entered_s + delay_s)
            }
        };
        let (now, later): (Vec<_>, Vec<_>) = self.waiting.drain(..).partition(due);
        self.waiting = later;
        for fault in now {
            self.happened += 1;
            break_down(flight, &fault.breakage);
        }
    }
}

fn break_down(flight: &mut Flight, breakage: &Breakage) {
    let every = Vector3::from_element(1.0);
    match *breakage {
        Breakage::Vehicle(fault) => flight.world_mut().inject(&fault),
        Breakage::GnssOut => flight.sensor_faults_mut().gnss_out = true,
        Breakage::BarometerOut => flight.sensor_faults_mut().barometer_out = true,
        Breakage::LidarOut => flight.sensor_faults_mut().lidar_out = true,
        Breakage::GyroBiasStep(deg_s) => {
            flight.sensor_faults_mut().gyro_bias_step_rad_s += every * deg_s.to_radians();
        }
        Breakage::AccelerometerBiasStep(mg) => {
            flight.sensor_faults_mut().accelerometer_bias_step_m_s2 += every * (1e-3 * mg * GRAVITY_M_S2);
        }
        Breakage::LinkLoss => flight.radio_mut().silent = true,
        Breakage::LinkDelay(delay_s) => flight.radio_mut().delay_s = delay_s,
        Breakage::Reboot(down_s) => flight.reboot(down_s),
        Breakage::Abort => flight.abort(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_delay_between_two_is_drawn_for_each_flight_and_again_alike() {
        let faults = ["abort@ignition+1..3".parse().unwrap(), "gnss-out@ignition+1..3".parse().unwrap()];
        let drawn_s = |number| {
            Injector::new(&faults, 5, number)
                .waiting
                .iter()
                .map(|fault| match fault.when {
                    When::Phase(Phase::Ignition, delay_s) => delay_s,
                    other => panic!("not drawn: {other:?}"),
                })
                .collect::<Vec<f64>>()
        };
        let all: Vec<f64> = (0..200).flat_map(drawn_s).collect();
        assert!(all.iter().all(|delay_s| (1.0..3.0).contains(delay_s)));
        let mean_s = all.iter().sum::<f64>() / all.len() as f64;
        // Five deviations of the mean of 400 even draws over two seconds.
        assert!((mean_s - 2.0).abs() < 5.0 * 2.0 / (12.0_f64 * 400.0).sqrt(), "{mean_s}");
        assert_eq!(drawn_s(7), drawn_s(7));
        assert_ne!(drawn_s(7)[0].to_bits(), drawn_s(7)[1].to_bits(), "each fault has its own draw");
    }
}

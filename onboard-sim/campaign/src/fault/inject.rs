//! Breaks things in a flight when they are due.

use flight::phase::Phase;
use nalgebra::Vector3;

use super::{Breakage, TimedFault, When};
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
    /// All of them are waiting.
    pub fn new(faults: &[TimedFault]) -> Self {
        Self { waiting: faults.to_vec(), entered_s: [None; Phase::ALL.len()], happened: 0 }
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
            When::Phase(phase, delay_s) => {
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

//! Applies a fault to a flight.

use flight::vehicle::atmosphere::STANDARD_GRAVITY_M_S2;
use nalgebra::Vector3;

use super::Sortie;
use crate::fault::Breakage;

impl Sortie {
    pub(super) fn break_down(&mut self, breakage: &Breakage) {
        let every = Vector3::from_element(1.0);
        let sensors = &mut self.surroundings.faults;
        match *breakage {
            Breakage::Vehicle(fault) => self.surroundings.world.inject(&fault),
            Breakage::GnssOut => sensors.gnss_out = true,
            Breakage::BarometerOut => sensors.barometer_out = true,
            Breakage::LidarOut => sensors.lidar_out = true,
            Breakage::GyroBiasStep(deg_s) => sensors.gyro_bias_step_rad_s += every * deg_s.to_radians(),
            Breakage::AccelerometerBiasStep(mg) => {
                sensors.accelerometer_bias_step_m_s2 += every * (1e-3 * mg * STANDARD_GRAVITY_M_S2);
            }
            Breakage::AccelerometerDead => sensors.accelerometer_dead = true,
            Breakage::BarometerStep(step_m) => sensors.barometer_step_m += step_m,
            Breakage::LinkLoss => self.radio.silent = true,
            Breakage::LinkDelay(delay_s) => self.radio.delay_s = delay_s,
            Breakage::Reboot(down_s) => self.reboot(down_s),
            Breakage::Abort => self.abort(),
        }
    }
}

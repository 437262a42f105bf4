//! ICM-42688-P over SPI (TDK, DS-000347): registers, scales, and one sample a frame.
//!
//! Compared with its maker's two public drivers: eMD's `Icm426xxDefs.h` ("eMD") and Linux'
//! `drivers/iio/imu/inv_icm42600` ("Linux"). The names are theirs.

use embedded_hal::delay::DelayNs;
use embedded_hal::spi::SpiDevice;
use flight::estimation::estimator::GRAVITY_M_S2;

use crate::Trouble;

const READ: u8 = 0x80;
/// eMD: DEVICE_CONFIG, whose bit 0 resets.
const DEVICE_CONFIG: u8 = 0x11;
/// eMD: ACCEL_DATA_X0_UI, with GYRO_DATA_X0_UI behind the accelerometer's six bytes. Linux: high
/// byte first.
const ACCEL_DATA_X1: u8 = 0x1F;
/// eMD: WHO_AM_I, and ICM42688_WHOAMI for its value.
const WHO_AM_I: u8 = 0x75;
const NAME: u8 = 0x47;
/// PWR_MGMT_0: gyro and accelerometer in low noise (bits 3:2 and 1:0). GYRO_CONFIG0 and
/// ACCEL_CONFIG0: 2,000 deg/s and 16 g (bits 7:5), 1 kHz (6 in bits 3:0). ACCEL_GYRO_CONFIG0: both
/// filtered to a tenth of that (4 in both halves), because a frame takes one sample of five and
/// needs their mean. All from eMD.
const SETTINGS: [[u8; 2]; 4] = [[0x4E, 0x0F], [0x4F, 0x06], [0x50, 0x06], [0x52, 0x44]];
/// Counts at full scale (Linux: `inv_icm42600_gyro_scale`, 1,065,264 nrad/s a count; and
/// `inv_icm42600_accel_scale`). The data sheet rounds the gyro's to 16.4 per deg/s.
const FULL_SCALE: f64 = 32_768.0;
const LSB_PER_G: f64 = FULL_SCALE / 16.0;
pub(crate) const LSB_PER_DEG_S: f64 = FULL_SCALE / 2_000.0;
/// Linux: INV_ICM42600_DATA_INVALID. Every axis of a sensor that is off, or was reset, has it; an
/// axis alone that has it measures beyond its range.
const INVALID: i16 = i16::MIN;
/// Linux: INV_ICM42600_RESET_TIME_MS is 1, and GYRO_STARTUP_TIME_MS the longer start.
const RESET_MS: u32 = 2;
const START_MS: u32 = 60;
const SILENT: Trouble = Trouble::Part("the inertial unit does not answer on its bus");

/// Sets it up.
pub(crate) fn start(bus: &mut impl SpiDevice, delay: &mut impl DelayNs) -> Result<(), Trouble> {
    let mut found = [READ | WHO_AM_I, 0];
    bus.write(&[DEVICE_CONFIG, 1]).map_err(|_bus| SILENT)?;
    delay.delay_ms(RESET_MS);
    bus.transfer_in_place(&mut found).map_err(|_bus| SILENT)?;
    if found[1] != NAME {
        return Err(Trouble::AnotherImu(found[1]));
    }
    for setting in SETTINGS {
        bus.write(&setting).map_err(|_bus| SILENT)?;
        delay.delay_ms(1);
    }
    delay.delay_ms(START_MS);
    Ok(())
}

/// The newest sample in the unit's axes: specific force, m/s^2, and rate, rad/s; `None` if the bus
/// has failed, or a sensor is off.
pub(crate) fn read(bus: &mut impl SpiDevice) -> Option<[[f64; 3]; 2]> {
    let mut bytes = [0; 13];
    bytes[0] = READ | ACCEL_DATA_X1;
    bus.transfer_in_place(&mut bytes).ok()?;
    let counts = |places: [usize; 3]| {
        let axes = places.map(|place| i16::from_be_bytes([bytes[place], bytes[place + 1]]));
        (axes != [INVALID; 3]).then(|| axes.map(f64::from))
    };
    let (force, rate) = (counts([1, 3, 5])?, counts([7, 9, 11])?);
    Some([
        force.map(|counts| counts / LSB_PER_G * GRAVITY_M_S2),
        rate.map(|counts| (counts / LSB_PER_DEG_S).to_radians()),
    ])
}

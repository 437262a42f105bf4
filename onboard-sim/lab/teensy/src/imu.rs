//! ICM-42688-P over SPI (TDK, DS-000347): registers, scales, and one sample a frame.

use embedded_hal::delay::DelayNs;
use embedded_hal::spi::SpiDevice;
use flight::estimation::estimator::GRAVITY_M_S2;

use crate::Trouble;

const READ: u8 = 0x80;
const DEVICE_CONFIG: u8 = 0x11;
const ACCEL_DATA_X1: u8 = 0x1F;
const WHO_AM_I: u8 = 0x75;
/// Value of [`WHO_AM_I`].
const NAME: u8 = 0x47;
/// Gyro and accelerometer in low noise; 2,000 deg/s and 16 g, both at 1 kHz; both filtered to 100
/// Hz, a tenth of that, because a frame takes one sample of five and needs their mean.
const SETTINGS: [[u8; 2]; 4] = [[0x4E, 0x0F], [0x4F, 0x06], [0x50, 0x06], [0x52, 0x44]];
const LSB_PER_G: f64 = 2048.0;
const LSB_PER_DEG_S: f64 = 16.4;
const SILENT: Trouble = Trouble::Part("the inertial unit does not answer on its bus");

/// Sets it up.
pub(crate) fn start(bus: &mut impl SpiDevice, delay: &mut impl DelayNs) -> Result<(), Trouble> {
    let mut found = [READ | WHO_AM_I, 0];
    bus.write(&[DEVICE_CONFIG, 1]).map_err(|_bus| SILENT)?;
    delay.delay_ms(2);
    bus.transfer_in_place(&mut found).map_err(|_bus| SILENT)?;
    if found[1] != NAME {
        return Err(Trouble::AnotherImu(found[1]));
    }
    for setting in SETTINGS {
        bus.write(&setting).map_err(|_bus| SILENT)?;
        delay.delay_ms(1);
    }
    // The gyro starts within 45 ms.
    delay.delay_ms(50);
    Ok(())
}

/// The newest sample in the unit's axes: specific force, m/s^2, and rate, rad/s; `None` if the bus
/// has failed.
pub(crate) fn read(bus: &mut impl SpiDevice) -> Option<[[f64; 3]; 2]> {
    let mut bytes = [0; 13];
    bytes[0] = READ | ACCEL_DATA_X1;
    bus.transfer_in_place(&mut bytes).ok()?;
    let axis = |place: usize| f64::from(i16::from_be_bytes([bytes[place], bytes[place + 1]]));
    let force_m_s2 = [1, 3, 5].map(|place| axis(place) / LSB_PER_G * GRAVITY_M_S2);
    Some([force_m_s2, [7, 9, 11].map(|place| (axis(place) / LSB_PER_DEG_S).to_radians())])
}

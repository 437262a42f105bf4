//! BMP390 over I2C (Bosch, BST-BMP390-DS002): a pressure and a temperature every 20 ms, without
//! waiting for any.
//!
//! Registers, bits, times and formulas were compared with Bosch's public driver BMP3_SensorAPI,
//! version of 2022-07-12: `bmp3_defs.h`, whose names are given here, and `bmp3.c`.

use embedded_hal::delay::DelayNs;
use embedded_hal::i2c::I2c;

use crate::Trouble;

/// Address with the pin SDO high: BMP3_ADDR_I2C_SEC.
const ADDRESS: u8 = 0x77;
/// Registers: BMP3_REG_CHIP_ID (with BMP390_CHIP_ID in it), SENS_STATUS, PWR_CTRL, OSR, ODR,
/// CONFIG, CALIB_DATA and CMD (which takes BMP3_SOFT_RESET). The samples follow the status.
const CHIP_ID: u8 = 0x00;
const STATUS: u8 = 0x03;
const PWR_CTRL: u8 = 0x1B;
const OSR: u8 = 0x1C;
const ODR: u8 = 0x1D;
const CONFIG: u8 = 0x1F;
const COEFFICIENTS: u8 = 0x31;
const CMD: u8 = 0x7E;
const NAME: u8 = 0x60;
const SOFT_RESET: u8 = 0xB6;
/// Both sensors (BMP3_PRESS_EN and TEMP_EN) are measured without an end (BMP3_MODE_NORMAL, bits
/// 5:4); 8 pressures (BMP3_OVERSAMPLING_8X) and 1 temperature make a sample, which takes 18.9 ms:
/// 234 us, 392 us and 8 times 2 ms, 313 us and 2 ms (`bmp3.c`, `validate_osr_and_odr_settings`); 50
/// samples a second (BMP3_ODR_50_HZ); no filter (bits 3:1), which would delay them.
const SETTINGS: [[u8; 2]; 4] = [[OSR, 0x03], [ODR, 0x02], [CONFIG, 0x00], [PWR_CTRL, 0x33]];
/// In [`STATUS`]: BMP3_DRDY_PRESS and BMP3_DRDY_TEMP.
const READY: u8 = 0x60;
/// Time of a soft reset, five times that of `bmp3_soft_reset`.
const RESET_MS: u32 = 10;
const SILENT: Trouble = Trouble::Part("the barometer does not answer on its bus");

/// A barometer.
#[derive(Debug)]
pub struct Barometer {
    coefficients: Coefficients,
    /// Temperature of the sensor at the last pressure, degrees Celsius.
    pub temperature_c: Option<f64>,
}

/// Coefficients of a sensor: of the temperature, and of the pressure, as floating-point
/// numbers (`bmp3.c`, `parse_calib_data`).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Coefficients {
    t: [f64; 3],
    p: [f64; 11],
}

impl Barometer {
    /// Sets it up, and reads its coefficients.
    pub(crate) fn start(bus: &mut impl I2c, delay: &mut impl DelayNs) -> Result<Self, Trouble> {
        let (mut name, mut bytes) = ([0], [0; 21]);
        bus.write(ADDRESS, &[CMD, SOFT_RESET]).map_err(|_bus| SILENT)?;
        delay.delay_ms(RESET_MS);
        bus.write_read(ADDRESS, &[CHIP_ID], &mut name).map_err(|_bus| SILENT)?;
        if name != [NAME] {
            return Err(Trouble::AnotherBarometer(name[0]));
        }
        bus.write_read(ADDRESS, &[COEFFICIENTS], &mut bytes).map_err(|_bus| SILENT)?;
        for setting in SETTINGS {
            bus.write(ADDRESS, &setting).map_err(|_bus| SILENT)?;
        }
        Ok(Self { coefficients: Coefficients::of(&bytes), temperature_c: None })
    }

    /// Called once a frame. Returns the pressure, Pa, in the frame in which one is ready; `None`
    /// before, and if the bus has failed.
    pub(crate) fn poll(&mut self, bus: &mut impl I2c) -> Option<f64> {
        let mut bytes = [0; 7];
        bus.write_read(ADDRESS, &[STATUS], &mut bytes).ok()?;
        if bytes[0] & READY != READY {
            return None;
        }
        let raw = |at: usize| u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], 0]);
        let (temperature_c, pressure_pa) = self.coefficients.compensated(raw(1), raw(4));
        self.temperature_c = Some(temperature_c);
        Some(pressure_pa)
    }
}

impl Coefficients {
    /// Those of the registers from BMP3_REG_CALIB_DATA on, BMP3_LEN_CALIB_DATA bytes.
    pub(crate) fn of(bytes: &[u8; 21]) -> Self {
        let unsigned = |at: usize| f64::from(u16::from_le_bytes([bytes[at], bytes[at + 1]]));
        let signed = |at: usize| f64::from(i16::from_le_bytes([bytes[at], bytes[at + 1]]));
        let byte = |at: usize| f64::from(bytes[at].cast_signed());
        let scaled = |value: f64, exponent: i32| libm::ldexp(value, -exponent);
        Self {
            t: [scaled(unsigned(0), -8), scaled(unsigned(2), 30), scaled(byte(4), 48)],
            p: [
                scaled(signed(5) - 16_384.0, 20),
                scaled(signed(7) - 16_384.0, 29),
                scaled(byte(9), 32),
                scaled(byte(10), 37),
                scaled(unsigned(11), -3),
                scaled(unsigned(13), 6),
                scaled(byte(15), 8),
                scaled(byte(16), 15),
                scaled(signed(17), 48),
                scaled(byte(19), 48),
                scaled(byte(20), 65),
            ],
        }
    }

    /// Temperature, degrees Celsius, and pressure, Pa (`bmp3.c`, `compensate_temperature` and
    /// `compensate_pressure`).
    pub(crate) fn compensated(&self, pressure_raw: u32, temperature_raw: u32) -> (f64, f64) {
        let Self { t: [t1, t2, t3], p: [p1, p2, p3, p4, p5, p6, p7, p8, p9, p10, p11] } = *self;
        let (raw, above) = (f64::from(pressure_raw), f64::from(temperature_raw) - t1);
        let t = above * t2 + above * above * t3;
        let offset = p5 + t * (p6 + t * (p7 + t * p8));
        let slope = p1 + t * (p2 + t * (p3 + t * p4));
        (t, offset + raw * (slope + raw * (p9 + p10 * t + raw * p11)))
    }
}

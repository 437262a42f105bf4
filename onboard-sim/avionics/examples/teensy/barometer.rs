//! MS5611 over I2C (TE Connectivity, MS5611-01BA03): one conversion after the other, and no waiting
//! for any.

use embedded_hal::delay::DelayNs;
use embedded_hal::i2c::I2c;

use crate::Trouble;

/// Address with the pin CSB low.
const ADDRESS: u8 = 0x77;
const RESET: u8 = 0x1E;
const READ_ADC: u8 = 0x00;
const READ_PROM: u8 = 0xA0;
/// Conversions with the finest resolution; they take 9.04 ms at most: two frames.
const CONVERT_PRESSURE: u8 = 0x48;
const CONVERT_TEMPERATURE: u8 = 0x58;
const CONVERSION_FRAMES: u8 = 2;
const SILENT: Trouble = Trouble::Part("the barometer does not answer on its bus");

/// A barometer that converts temperature and pressure in turn: a pressure every 20 ms.
#[derive(Debug)]
pub struct Barometer {
    prom: [u16; 8],
    /// The command of the conversion that runs, if any.
    converts: Option<u8>,
    frames: u8,
    temperature_raw: u32,
}

impl Barometer {
    /// Reads its coefficients.
    pub(crate) fn start(bus: &mut impl I2c, delay: &mut impl DelayNs) -> Result<Self, Trouble> {
        bus.write(ADDRESS, &[RESET]).map_err(|_bus| SILENT)?;
        delay.delay_ms(3);
        let mut prom = [0; 8];
        for (word, command) in prom.iter_mut().zip((READ_PROM..).step_by(2)) {
            let mut bytes = [0; 2];
            bus.write_read(ADDRESS, &[command], &mut bytes).map_err(|_bus| SILENT)?;
            *word = u16::from_be_bytes(bytes);
        }
        if crc4(&prom) != prom[7] as u8 & 0xF {
            return Err(Trouble::Part("the checksum of the barometer's coefficients is wrong"));
        }
        Ok(Self { prom, converts: None, frames: 0, temperature_raw: 0 })
    }

    /// Called once a frame. Returns the pressure, Pa, in the frame in which one is ready. After a
    /// bus failure it returns none, and restarts the conversion.
    pub(crate) fn poll(&mut self, bus: &mut impl I2c) -> Option<f64> {
        self.frames += 1;
        if self.converts.is_some() && self.frames < CONVERSION_FRAMES {
            return None;
        }
        self.frames = 0;
        let mut bytes = [0; 4];
        let ended = self.converts.take();
        let read = ended.and_then(|_| bus.write_read(ADDRESS, &[READ_ADC], &mut bytes[1..]).ok());
        // A sensor queried too early returns 0.
        let raw = read.map(|()| u32::from_be_bytes(bytes)).filter(|raw| *raw > 0);
        let pressure_next = ended == Some(CONVERT_TEMPERATURE) && raw.is_some();
        let next = if pressure_next { CONVERT_PRESSURE } else { CONVERT_TEMPERATURE };
        self.converts = bus.write(ADDRESS, &[next]).ok().map(|()| next);
        if ended == Some(CONVERT_PRESSURE) {
            return Some(compensated(&self.prom, raw?, self.temperature_raw).1);
        }
        self.temperature_raw = raw.unwrap_or(self.temperature_raw);
        None
    }
}

/// Temperature, 0.01 degrees Celsius, and pressure, Pa, with compensation of the second order, as
/// on pages 8 and 9 of the data sheet.
pub(crate) fn compensated(prom: &[u16; 8], pressure_raw: u32, temperature_raw: u32) -> (i64, f64) {
    let [_, c1, c2, c3, c4, c5, c6, _] = prom.map(i64::from);
    let difference = i64::from(temperature_raw) - (c5 << 8);
    let mut temperature = 2000 + ((difference * c6) >> 23);
    let mut offset = (c2 << 16) + ((c4 * difference) >> 7);
    let mut sensitivity = (c1 << 15) + ((c3 * difference) >> 8);
    if temperature < 2000 {
        let [cold, very_cold] = [temperature - 2000, (temperature + 1500).min(0)].map(|below| below * below);
        temperature -= (difference * difference) >> 31;
        offset -= 5 * cold / 2 + 7 * very_cold;
        sensitivity -= 5 * cold / 4 + 11 * very_cold / 2;
    }
    let pressure = ((i64::from(pressure_raw) * sensitivity) >> 21) - offset;
    // The data sheet's integer is 1 Pa, which is 8 cm: the fraction is retained.
    (temperature, pressure as f64 / f64::from(1 << 15))
}

/// The checksum of the coefficients (AN520); the last four bits, where it is kept, count as zero
/// with their byte.
pub(crate) fn crc4(prom: &[u16; 8]) -> u8 {
    let mut remainder: u16 = 0;
    for place in 0..16 {
        let word = if place / 2 == 7 { prom[7] & 0xFF00 } else { prom[place / 2] };
        remainder ^= if place % 2 == 1 { word & 0xFF } else { word >> 8 };
        for _ in 0..8 {
            remainder = if remainder & 0x8000 == 0 { remainder << 1 } else { (remainder << 1) ^ 0x3000 };
        }
    }
    (remainder >> 12) as u8
}

//! State that survives a reset: the flight computer's record, and the zeros of this board's
//! sensors.
//!
//! Without the zeros a barometer that restarts in the air would report the ground there.

use flight::computer::saved::Saved;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Zero of a sensor on the pad: the mean of its first samples after power-up.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Zero {
    samples: u32,
    mean: Vector3<f64>,
}

impl Zero {
    /// Deviation of a sample from the zero, once that has this many samples.
    pub(crate) fn from(&mut self, needed: u32, sample: Vector3<f64>) -> Option<Vector3<f64>> {
        if self.samples >= needed {
            return Some(sample - self.mean);
        }
        self.samples += 1;
        self.mean += (sample - self.mean) / f64::from(self.samples);
        None
    }
}

/// Longest record with its checksum, bytes; the numbers beside the flight computer's record
/// have 66.
pub const MOST_BYTES: usize = 4 + 66 + Saved::MOST_BYTES;

/// A record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Record {
    /// The clock at its writing, s.
    pub(crate) clock_s: f64,
    pub(crate) height: Zero,
    pub(crate) place: Zero,
    pub(crate) saved: Saved,
}

impl Record {
    /// Its bytes; `None` if they do not fit, which their lengths exclude.
    pub(crate) fn write<'a>(&self, into: &'a mut [u8; MOST_BYTES]) -> Option<&'a [u8]> {
        let (sum, record) = into.split_first_chunk_mut()?;
        let written = postcard::to_slice(self, record).ok()?;
        *sum = crc32fast::hash(written).to_le_bytes();
        let bytes = sum.len() + written.len();
        into.get(..bytes)
    }

    /// A complete record.
    pub(crate) fn read(bytes: &[u8]) -> Option<Self> {
        let (sum, record) = bytes.split_first_chunk()?;
        let intact = u32::from_le_bytes(*sum) == crc32fast::hash(record);
        if intact { postcard::from_bytes(record).ok() } else { None }
    }
}

//! What outlasts a reset: the flight computer's record, and where this board's sensors have their zero.
//!
//! Without the zeros a barometer that starts again in the air would say that the ground is there.

use alloc::vec::Vec;

use flight::computer::saved::Saved;
use nalgebra::Vector3;

/// What a sensor says where the vehicle stands: the mean of its first samples after power-up.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Zero {
    samples: u32,
    mean: Vector3<f64>,
}

impl Zero {
    /// How far a sample is from the zero, once that has so many samples.
    pub(crate) fn from(&mut self, needed: u32, sample: Vector3<f64>) -> Option<Vector3<f64>> {
        if self.samples >= needed {
            return Some(sample - self.mean);
        }
        self.samples += 1;
        self.mean += (sample - self.mean) / f64::from(self.samples);
        None
    }
}

/// Longest record, bytes: checksum, clock, zeros, and the flight computer's record.
pub(crate) const MOST_BYTES: usize = 4 + 8 + 2 * 28 + Saved::MOST_BYTES;

/// The clock at its writing, s, and the zeros of height and place.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Beside {
    pub(crate) clock_s: f64,
    pub(crate) height: Zero,
    pub(crate) place: Zero,
}

impl Beside {
    /// Writes a record into a buffer that has room for [`MOST_BYTES`].
    pub(crate) fn write(&self, saved: &Saved, into: &mut Vec<u8>) {
        let mut room = [0; Saved::MOST_BYTES];
        into.clear();
        // Its own length excludes that it does not fit.
        let Ok(written) = saved.write(&mut room) else { return };
        into.extend([0; 4]);
        into.extend(self.clock_s.to_le_bytes());
        for Zero { samples, mean } in [self.height, self.place] {
            into.extend(samples.to_le_bytes());
            mean.iter().for_each(|axis| into.extend(axis.to_le_bytes()));
        }
        into.extend_from_slice(written);
        let sum = crc32fast::hash(&into[4..]);
        into[..4].copy_from_slice(&sum.to_le_bytes());
    }

    /// A record that is whole.
    pub(crate) fn read(bytes: &[u8]) -> Option<(Self, Saved)> {
        let (sum, rest) = bytes.split_first_chunk()?;
        if u32::from_le_bytes(*sum) != crc32fast::hash(rest) {
            return None;
        }
        let (clock, mut rest) = rest.split_first_chunk()?;
        let mut zero = || {
            let (samples, axes) = rest.split_first_chunk()?;
            let (axes, left) = axes.split_first_chunk::<24>()?;
            rest = left;
            let axis = |axis: usize, _| {
                let bytes = axes.as_chunks::<8>().0[axis];
                f64::from_le_bytes(bytes)
            };
            Some(Zero { samples: u32::from_le_bytes(*samples), mean: Vector3::from_fn(axis) })
        };
        let beside = Self { clock_s: f64::from_le_bytes(*clock), height: zero()?, place: zero()? };
        Some((beside, Saved::read(rest).ok()?))
    }
}

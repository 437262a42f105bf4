//! A digest of a flight computer's memory, bit by bit.
//!
//! Everything that decides the future goes in, in a fixed order. Fields that cannot decide it are left out by name:
//! constants of the mission, and workspace that is written before it is read. [`remembers!`] lists a type's fields, so
//! a new field that is named on neither side does not compile.

use alloc::vec::Vec;
use core::hash::Hasher as _;
use nalgebra::{ArrayStorage, Const, Matrix, UnitQuaternion};
use twox_hash::XxHash64;

use super::pad_check::PadCheck;
use super::{Computer, CrewMemory};
use crate::rules::phase::Motor;

/// Bytes that are given to the hash at once. Word by word, the hash took a third of the time of `replay verify`.
const BLOCK: usize = 1024;

/// The hash being computed: XXH64, of words in little-endian order.
pub(crate) struct Memory {
    hash: XxHash64,
    /// What the hash has not taken yet, in the first `waiting` bytes.
    block: [u8; BLOCK],
    waiting: usize,
}

impl Memory {
    fn new() -> Self {
        Self { hash: XxHash64::with_seed(0), block: [0; BLOCK], waiting: 0 }
    }

    pub(crate) fn digest_of(remembered: &impl Remembers) -> u64 {
        let mut memory = Self::new();
        remembered.remember(&mut memory);
        memory.finish()
    }

    fn word(&mut self, word: u64) {
        self.bytes(&word.to_le_bytes());
    }

    /// Adds bytes, whose division into blocks does not change the hash.
    #[inline]
    fn bytes(&mut self, bytes: &[u8]) {
        for part in bytes.chunks(BLOCK) {
            if self.waiting + part.len() > BLOCK {
                self.flush();
            }
            self.block[self.waiting..self.waiting + part.len()].copy_from_slice(part);
            self.waiting += part.len();
        }
    }

    fn flush(&mut self) {
        self.hash.write(&self.block[..self.waiting]);
        self.waiting = 0;
    }

    fn finish(mut self) -> u64 {
        self.flush();
        self.hash.finish()
    }
}

/// The checksum of what is kept through a reset: XXH64.
pub(crate) fn checksum(bytes: &[u8]) -> u64 {
    XxHash64::oneshot(0, bytes)
}

/// A type with memory that decides the future.
pub(crate) trait Remembers {
    /// Adds all of the memory to the hash.
    fn remember(&self, memory: &mut Memory);
}

impl Remembers for f64 {
    fn remember(&self, memory: &mut Memory) {
        memory.word(self.to_bits());
    }
}

macro_rules! whole_numbers {
    ($($number:ty),*) => {
        $(impl Remembers for $number {
            fn remember(&self, memory: &mut Memory) {
                memory.word(u64::from(*self));
            }
        })*
    };
}
whole_numbers!(bool, u8, u16, u32, u64);

impl Remembers for usize {
    fn remember(&self, memory: &mut Memory) {
        memory.word(*self as u64);
    }
}

/// A list is hashed as its length and its elements, so that an element cannot move from one list into the next
/// unnoticed.
impl<T: Remembers> Remembers for [T] {
    fn remember(&self, memory: &mut Memory) {
        self.len().remember(memory);
        for element in self {
            element.remember(memory);
        }
    }
}

impl<T: Remembers> Remembers for Vec<T> {
    fn remember(&self, memory: &mut Memory) {
        self.as_slice().remember(memory);
    }
}

impl<T: Remembers, const LENGTH: usize> Remembers for [T; LENGTH] {
    fn remember(&self, memory: &mut Memory) {
        for element in self {
            element.remember(memory);
        }
    }
}

impl<T: Remembers> Remembers for Option<T> {
    fn remember(&self, memory: &mut Memory) {
        self.is_some().remember(memory);
        if let Some(value) = self {
            value.remember(memory);
        }
    }
}

impl<A: Remembers, B: Remembers> Remembers for (A, B) {
    fn remember(&self, memory: &mut Memory) {
        self.0.remember(memory);
        self.1.remember(memory);
    }
}

impl Remembers for &str {
    fn remember(&self, memory: &mut Memory) {
        self.len().remember(memory);
        memory.bytes(self.as_bytes());
    }
}

impl<const ROWS: usize, const COLUMNS: usize> Remembers
    for Matrix<f64, Const<ROWS>, Const<COLUMNS>, ArrayStorage<f64, ROWS, COLUMNS>>
{
    fn remember(&self, memory: &mut Memory) {
        for number in self.iter() {
            number.remember(memory);
        }
    }
}

impl Remembers for UnitQuaternion<f64> {
    fn remember(&self, memory: &mut Memory) {
        self.coords.remember(memory);
    }
}

/// [`Remembers`] for a struct: the fields it remembers, and after `but` those that decide nothing or never change.
macro_rules! remembers {
    ($type:ty { $($field:ident),* $(,)? } $(but { $($left_out:ident),* $(,)? })?) => {
        impl $crate::computer::memory::Remembers for $type {
            fn remember(&self, memory: &mut $crate::computer::memory::Memory) {
                let Self { $($field,)* $($($left_out: _,)*)? } = self;
                $($crate::computer::memory::Remembers::remember($field, memory);)*
            }
        }
    };
}
pub(crate) use remembers;

// The digest of the flight computer's memory.

fn stage(motor: Motor) -> u8 {
    match motor {
        Motor::Unlit => 0,
        Motor::Commanded => 1,
        Motor::Burning => 2,
        Motor::BurntOut { .. } => 3,
    }
}

impl Remembers for Motor {
    fn remember(&self, memory: &mut Memory) {
        stage(*self).remember(memory);
        if let Self::BurntOut { at_s } = self {
            at_s.remember(memory);
        }
    }
}

/// The whole memory. Law and first state are constants of the flight; the last frame in the air came with its input, and its
/// decisions are compared as output. Time, frame, uplink, battery and booster wire come with each input; limits and the length of the countdown never change.
struct Whole<'a>(&'a Computer);

impl Remembers for Whole<'_> {
    fn remember(&self, memory: &mut Memory) {
        let Computer {
            table,
            pad,
            pilot,
            law: _,
            believed: _,
            flown: _,
            gate_told,
            frame: _,
            arming: _,
            countdown_s: _,
            commands,
            self_test,
            readiness,
            rehearsed,
            motor_watch,
            log,
            uplink: _,
            commander: _,
            people: _,
            crew,
            fins_answering,
            igniter_continuity,
            booster_attached: _,
            battery_v: _,
            pad_check,
            release,
            level,
        } = self.0;
        table.mode().remember(memory);
        pad.remember(memory);
        pilot.remember(memory);
        gate_told.remember(memory);
        commands.remember(memory);
        self_test.remember(memory);
        readiness.remember(memory);
        rehearsed.is_some().remember(memory);
        motor_watch.remember(memory);
        log.remember(memory);
        fins_answering.remember(memory);
        igniter_continuity.remember(memory);
        release.remember(memory);
        level.index().remember(memory);
        // A crew without operators leaves nothing behind, and logs from before there were any have the same digest.
        if *crew != CrewMemory::default() {
            crew.remember(memory);
        }
        // The same for a check that nobody has asked for.
        if *pad_check != PadCheck::default() {
            pad_check.remember(memory);
        }
    }
}

impl Computer {
    /// A number that changes with anything that the computer remembers, to compare a replay with a log.
    ///
    /// The mission is left out because it is constant, and a solve's workspace because the next solve reads nothing of
    /// it.
    pub fn digest(&self) -> u64 {
        Memory::digest_of(&Whole(self))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Sample {
        numbers: Vec<f64>,
        more: Vec<f64>,
        maybe: Option<u32>,
        constant: f64,
    }
    remembers!(Sample { numbers, more, maybe } but { constant });

    fn sample() -> Sample {
        Sample { numbers: vec![1.0, 0.0], more: vec![2.0], maybe: None, constant: 1.0 }
    }

    #[test]
    fn every_bit_of_the_memory_changes_the_digest() {
        let digest = Memory::digest_of(&sample());
        let other_constant = Sample { constant: sample().constant + 6.0, ..sample() };
        assert_eq!(Memory::digest_of(&other_constant), digest);
        let others = [
            Sample { numbers: vec![1.0, -0.0], ..sample() },
            Sample { numbers: vec![f64::from_bits(1.0_f64.to_bits() + 1), 0.0], ..sample() },
            Sample { numbers: vec![1.0], more: vec![0.0, 2.0], ..sample() },
            Sample { maybe: Some(0), ..sample() },
        ];
        for other in others {
            assert_ne!(Memory::digest_of(&other), digest);
        }
    }

    /// The published value of XXH64 for no input and seed 0.
    #[test]
    fn val_xxh64_of_nothing() {
        assert_eq!(Memory::new().finish(), 0xef46_db37_51d8_e999);
    }

    /// The digest of many words, with texts between them, is the hash of all their bytes at once.
    #[test]
    fn blocks_do_not_change_the_digest() {
        let text = "seven b";
        let long = "x".repeat(3 * BLOCK);
        let (mut memory, mut all) = (Memory::new(), Vec::new());
        for word in 0..1000_u64 {
            memory.word(word);
            all.extend_from_slice(&word.to_le_bytes());
            let text = if word == 500 { long.as_str() } else { text };
            memory.bytes(text.as_bytes());
            all.extend_from_slice(text.as_bytes());
        }
        let mut at_once = XxHash64::with_seed(0);
        at_once.write(&all);
        assert_eq!(memory.finish(), at_once.finish());
    }
}

//! One direction of a wire that mistreats messages, on a simulated clock.

use std::time::Duration;

use protocol::dialect::MavMessage;
use protocol::frame::{Encoder, Framer};
use protocol::identity::Address;
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha12Rng;

/// What is wrong with a wire.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Badness {
    /// Of 1000 messages so many are lost, each by itself: also a part of a frame.
    pub(super) lost: u32,
    /// Of 1000 messages so many arrive twice.
    pub(super) doubled: u32,
    /// What is sent together takes up to this time, ms: it overtakes what was sent before it.
    pub(super) late_ms: u32,
    /// From and until when nothing is carried, ms.
    pub(super) unplugged_ms: (u64, u64),
}

pub(super) struct BadWire {
    badness: Badness,
    random: ChaCha12Rng,
    encoder: Encoder,
    framer: Framer,
    /// Frames on their way, with the time of their arrival.
    carried: Vec<(Duration, Vec<u8>)>,
}

impl BadWire {
    pub(super) fn new(badness: Badness, seed: u64, source: Address) -> Self {
        Self {
            badness,
            random: ChaCha12Rng::seed_from_u64(seed),
            encoder: Encoder::new(source),
            framer: Framer::new(),
            carried: Vec::new(),
        }
    }

    fn below(&mut self, most: u32) -> u32 {
        if most == 0 { 0 } else { self.random.next_u32() % most }
    }

    pub(super) fn send(&mut self, messages: &[MavMessage], now: Duration) {
        let (from_ms, until_ms) = self.badness.unplugged_ms;
        let unplugged = (u128::from(from_ms)..u128::from(until_ms)).contains(&now.as_millis());
        let late_ms = self.below(self.badness.late_ms + 1);
        for message in messages {
            let bytes = self.encoder.encode(message).as_bytes().to_vec();
            let copies = match self.below(1000) {
                _ if unplugged => 0,
                chance if chance < self.badness.lost => 0,
                chance if chance < self.badness.lost + self.badness.doubled => 2,
                _ => 1,
            };
            for _ in 0..copies {
                self.carried.push((now + Duration::from_millis(u64::from(late_ms)), bytes.clone()));
            }
        }
    }

    /// What has arrived by now, in the order of arrival.
    pub(super) fn arrived(&mut self, now: Duration) -> Vec<MavMessage> {
        self.carried.sort_by_key(|(at, _)| *at);
        let here = self.carried.partition_point(|(at, _)| *at <= now);
        let mut messages = Vec::new();
        for (_, bytes) in self.carried.drain(..here) {
            self.framer.push(&bytes);
            while let Some(frame) = self.framer.next_frame() {
                messages.push(frame.decode().unwrap());
            }
        }
        messages
    }
}

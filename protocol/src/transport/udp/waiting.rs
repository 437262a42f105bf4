//! Datagrams that wait for their reader: each sender's apart and taken by turns, so that a flood loses its own and
//! nobody else's.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, VecDeque};
use std::net::SocketAddr;

/// Datagrams of proven senders that may wait; they share it equally. At the fastest simulated telemetry, 5,000
/// datagrams a second, it holds a fifth of a second.
const PROVEN_MOST: usize = 1024;
/// The same for all others together.
const UNPROVEN_MOST: usize = 256;

/// Whether a believed frame has come from a sender.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Standing {
    Proven,
    Unproven,
}

/// Senders that share so many places.
#[derive(Debug)]
struct Class {
    most: usize,
    /// Of each sender that has something waiting.
    queues: BTreeMap<SocketAddr, VecDeque<Vec<u8>>>,
    turns: VecDeque<SocketAddr>,
}

impl Class {
    fn new(most: usize) -> Self {
        Self { most, queues: BTreeMap::new(), turns: VecDeque::new() }
    }

    fn push(&mut self, from: SocketAddr, bytes: &[u8]) -> bool {
        let senders = self.queues.len();
        match self.queues.entry(from) {
            // Who came when there were fewer may hold more than its share; it gets no more until it is below.
            Entry::Occupied(queue) if queue.get().len() >= (self.most / senders).max(1) => return false,
            Entry::Occupied(mut queue) => queue.get_mut().push_back(bytes.to_vec()),
            Entry::Vacant(_) if senders >= self.most => return false,
            Entry::Vacant(place) => {
                place.insert(VecDeque::from([bytes.to_vec()]));
                self.turns.push_back(from);
            }
        }
        true
    }

    fn pop(&mut self) -> Option<(SocketAddr, Vec<u8>)> {
        let from = self.turns.pop_front()?;
        let queue = self.queues.get_mut(&from)?;
        let bytes = queue.pop_front()?;
        if queue.is_empty() {
            self.queues.remove(&from);
        } else {
            self.turns.push_back(from);
        }
        Some((from, bytes))
    }
}

/// What waits. Proven senders and all others take turns, too.
#[derive(Debug)]
pub(super) struct Waiting {
    proven: Class,
    unproven: Class,
    proven_next: bool,
}

impl Waiting {
    pub(super) fn new() -> Self {
        Self { proven: Class::new(PROVEN_MOST), unproven: Class::new(UNPROVEN_MOST), proven_next: true }
    }

    /// Keeps a datagram, or drops it where its sender has too much waiting already. Says which.
    pub(super) fn push(&mut self, from: SocketAddr, standing: Standing, bytes: &[u8]) -> bool {
        match standing {
            Standing::Proven => self.proven.push(from, bytes),
            Standing::Unproven => self.unproven.push(from, bytes),
        }
    }

    /// A sender is proven from now on; what waits of it keeps its order.
    pub(super) fn prove(&mut self, sender: SocketAddr) {
        let Some(queue) = self.unproven.queues.remove(&sender) else { return };
        self.unproven.turns.retain(|other| *other != sender);
        if !self.proven.queues.contains_key(&sender) {
            self.proven.turns.push_back(sender);
        }
        self.proven.queues.entry(sender).or_default().extend(queue);
    }

    pub(super) fn is_empty(&self) -> bool {
        self.proven.turns.is_empty() && self.unproven.turns.is_empty()
    }

    /// The datagram whose turn it is.
    pub(super) fn pop(&mut self) -> Option<(SocketAddr, Vec<u8>)> {
        let [first, second] = if self.proven_next {
            [&mut self.proven, &mut self.unproven]
        } else {
            [&mut self.unproven, &mut self.proven]
        };
        let taken = first.pop().or_else(|| second.pop());
        self.proven_next = !self.proven_next;
        taken
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(port: u16) -> SocketAddr {
        ([127, 0, 0, 1], port).into()
    }

    /// How many datagrams are taken before the first of this sender.
    fn ahead_of(waiting: &mut Waiting, sender: SocketAddr) -> usize {
        std::iter::from_fn(|| waiting.pop()).position(|(from, _)| from == sender).unwrap()
    }

    #[test]
    fn a_flood_of_many_does_not_push_out_one() {
        for flooding in [Standing::Proven, Standing::Unproven] {
            let mut waiting = Waiting::new();
            for _ in 0..10_000 {
                for port in 1..=40 {
                    waiting.push(at(port), flooding, b"flood");
                }
            }
            assert!(
                waiting.push(at(99), Standing::Proven, b"abort"),
                "kept although the others' places are full"
            );
            let ahead = ahead_of(&mut waiting, at(99));
            assert!(ahead <= 80, "{ahead} of {flooding:?} are taken first");
            assert!(waiting.push(at(98), Standing::Unproven, b"a newcomer"));
        }
    }

    #[test]
    fn what_waits_is_bounded() {
        let mut waiting = Waiting::new();
        for port in 1..=60_000 {
            for _ in 0..3 {
                waiting.push(at(port), Standing::Unproven, b"a port for every datagram");
            }
        }
        for _ in 0..5_000 {
            waiting.push(at(1), Standing::Proven, b"one sender, faster than it is read");
        }
        let count = std::iter::from_fn(|| waiting.pop()).count();
        // The first ones came when there was more room for each: most * (1/1 + 1/2 + ... ) at the worst.
        assert!(count <= PROVEN_MOST + 7 * UNPROVEN_MOST, "{count}");
        assert!(waiting.is_empty());
    }

    #[test]
    fn the_order_of_one_sender_is_kept_when_it_is_proven() {
        let mut waiting = Waiting::new();
        for number in 0..3 {
            waiting.push(at(1), Standing::Unproven, &[number]);
        }
        waiting.prove(at(1));
        waiting.push(at(1), Standing::Proven, &[3]);
        let taken: Vec<u8> = std::iter::from_fn(|| waiting.pop()).map(|(_, bytes)| bytes[0]).collect();
        assert_eq!(taken, [0, 1, 2, 3]);
    }
}

//! Queues datagrams fairly: each sender has its own queue and the senders take turns, so that a flood loses only its
//! own datagrams.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, VecDeque};
use std::net::SocketAddr;

/// This many datagrams of proven senders may wait; the senders share the places equally. It holds a fifth of a second
/// of the fastest simulated telemetry, 5,000 datagrams a second.
const PROVEN_PLACES: usize = 1024;
/// This many datagrams of all other senders together may wait.
const UNPROVEN_PLACES: usize = 256;

/// Whether a frame of a sender was accepted before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Standing {
    Proven,
    Unproven,
}

/// Queues of senders that share a number of places.
#[derive(Debug)]
struct FairQueue {
    most: usize,
    /// The queue of each sender that has datagrams waiting.
    queues: BTreeMap<SocketAddr, VecDeque<Vec<u8>>>,
    turns: VecDeque<SocketAddr>,
}

impl FairQueue {
    fn new(most: usize) -> Self {
        Self { most, queues: BTreeMap::new(), turns: VecDeque::new() }
    }

    fn push(&mut self, from: SocketAddr, bytes: &[u8]) -> bool {
        let senders = self.queues.len();
        match self.queues.entry(from) {
            // A sender that queued when there were fewer senders may hold more than its share; it gets no more places
            // until it holds less.
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

/// The waiting datagrams. Proven senders as a group and all others as a group take turns, too.
#[derive(Debug)]
pub(super) struct DatagramQueue {
    proven: FairQueue,
    unproven: FairQueue,
    proven_next: bool,
}

impl DatagramQueue {
    pub(super) fn new() -> Self {
        Self {
            proven: FairQueue::new(PROVEN_PLACES),
            unproven: FairQueue::new(UNPROVEN_PLACES),
            proven_next: true,
        }
    }

    /// Queues a datagram and returns true, or drops it because its sender has too many waiting already.
    pub(super) fn push(&mut self, from: SocketAddr, standing: Standing, bytes: &[u8]) -> bool {
        match standing {
            Standing::Proven => self.proven.push(from, bytes),
            Standing::Unproven => self.unproven.push(from, bytes),
        }
    }

    /// Marks a sender as proven; its waiting datagrams keep their order.
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

    /// Takes the datagram whose turn it is.
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

    /// Returns how many datagrams are taken before the first one of this sender.
    fn ahead_of(waiting: &mut DatagramQueue, sender: SocketAddr) -> usize {
        std::iter::from_fn(|| waiting.pop()).position(|(from, _)| from == sender).unwrap()
    }

    #[test]
    fn a_flood_does_not_displace_another_sender() {
        for flooding in [Standing::Proven, Standing::Unproven] {
            let mut waiting = DatagramQueue::new();
            for _ in 0..10_000 {
                for port in 1..=40 {
                    waiting.push(at(port), flooding, b"flood");
                }
            }
            assert!(
                waiting.push(at(99), Standing::Proven, b"abort"),
                "it is kept although the places of the others are full"
            );
            let ahead = ahead_of(&mut waiting, at(99));
            assert!(ahead <= 80, "{ahead} of {flooding:?} are taken first");
            assert!(waiting.push(at(98), Standing::Unproven, b"a newcomer"));
        }
    }

    #[test]
    fn the_queue_is_bounded() {
        let mut waiting = DatagramQueue::new();
        for port in 1..=60_000 {
            for _ in 0..3 {
                waiting.push(at(port), Standing::Unproven, b"a port for every datagram");
            }
        }
        for _ in 0..5_000 {
            waiting.push(at(1), Standing::Proven, b"one sender, faster than it is read");
        }
        let count = std::iter::from_fn(|| waiting.pop()).count();
        // Early senders got more places than their later share: at worst most * (1/1 + 1/2 + ...).
        assert!(count <= PROVEN_PLACES + 7 * UNPROVEN_PLACES, "{count}");
        assert!(waiting.is_empty());
    }

    #[test]
    fn the_order_of_one_sender_is_kept_when_it_is_proven() {
        let mut waiting = DatagramQueue::new();
        for number in 0..3 {
            waiting.push(at(1), Standing::Unproven, &[number]);
        }
        waiting.prove(at(1));
        waiting.push(at(1), Standing::Proven, &[3]);
        let taken: Vec<u8> = std::iter::from_fn(|| waiting.pop()).map(|(_, bytes)| bytes[0]).collect();
        assert_eq!(taken, [0, 1, 2, 3]);
    }
}

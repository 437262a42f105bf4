//! Whom a UDP link answers, and what it says about everybody else.
//!
//! A datagram proves nothing: its sender is answered once a frame of it was believed. Time is an argument, counted from
//! when the link was opened.

use std::collections::{BTreeMap, VecDeque};
use std::net::SocketAddr;
use std::time::Duration;

use super::waiting::Standing;

/// Proven senders that are answered at the same time; each costs what the vehicle sends, 2,000 bytes a second. Without
/// a key anybody's frame is valid, and a crowd of strangers must leave places for the true ground.
const MAX_PROVEN: usize = 64;
/// Where no place is left, a proven sender that has been silent for this long gives its own to a newcomer. One that
/// speaks never does.
const SILENT_AFTER: Duration = Duration::from_secs(10);
/// While nobody is proven one stranger is answered, so that a ground with the wrong key can see why it is refused. It
/// keeps that place until it has been silent for this long.
const GUEST_SILENT_AFTER: Duration = Duration::from_secs(5);

/// Strangers are spoken of this often at most.
const SAID_EVERY: Duration = Duration::from_secs(10);
/// The first of them after this long, so that a newcomer whose first frame is still being judged is none.
const FIRST_SAID_AFTER: Duration = Duration::from_secs(1);
/// Peers that are named in [`SAID_EVERY`]; of more only the number is said.
const MAX_NAMED: usize = 4;
/// Strangers that are told apart; of more only the datagrams are counted.
const MAX_COUNTED: usize = 1024;

#[derive(Debug)]
struct Proven {
    address: SocketAddr,
    /// When a frame of it was last believed.
    believed_at: Duration,
}

/// Senders that were not believed since they were last spoken of.
#[derive(Debug, Default)]
struct Strangers {
    datagrams: BTreeMap<SocketAddr, u64>,
    uncounted: u64,
    last: Option<SocketAddr>,
}

/// The senders that a link knows.
#[derive(Debug)]
pub(super) struct Peers {
    /// The one that the link was opened to; there are no others then.
    fixed: Option<SocketAddr>,
    proven: Vec<Proven>,
    guest: Option<(SocketAddr, Duration)>,
    strangers: Strangers,
    /// When the latest peers were named.
    named_at: VecDeque<Duration>,
    unnamed: u64,
    said_at: Option<Duration>,
    say_at: Option<Duration>,
}

impl Peers {
    /// Whoever proves itself.
    pub(super) fn anybody() -> Self {
        Self {
            fixed: None,
            proven: Vec::new(),
            guest: None,
            strangers: Strangers::default(),
            named_at: VecDeque::new(),
            unnamed: 0,
            said_at: None,
            say_at: None,
        }
    }

    /// This one and nobody else.
    pub(super) fn only(peer: SocketAddr) -> Self {
        Self { fixed: Some(peer), ..Self::anybody() }
    }

    /// Takes note of a datagram's sender; `None` if it is nobody to listen to.
    pub(super) fn on_datagram(&mut self, from: SocketAddr, now: Duration) -> Option<Standing> {
        if self.fixed == Some(from) || self.proven.iter().any(|peer| peer.address == from) {
            return Some(Standing::Proven);
        }
        let strangers = &mut self.strangers;
        if strangers.datagrams.len() < MAX_COUNTED || strangers.datagrams.contains_key(&from) {
            *strangers.datagrams.entry(from).or_default() += 1;
        } else {
            strangers.uncounted += 1;
        }
        strangers.last = Some(from);
        self.will_say(now);
        if self.fixed.is_some() {
            return None;
        }
        if self.proven.is_empty()
            && self.guest.is_none_or(|(guest, heard_at)| {
                guest == from || now.saturating_sub(heard_at) >= GUEST_SILENT_AFTER
            })
        {
            self.guest = Some((from, now));
        }
        Some(Standing::Unproven)
    }

    /// Takes note that a frame of this sender was believed. Says whether it is answered from now on and was not before,
    /// and if so, whether it is to be named.
    pub(super) fn on_believed(&mut self, from: SocketAddr, now: Duration) -> Option<Newcomer> {
        if self.fixed.is_some() {
            return None;
        }
        if let Some(peer) = self.proven.iter_mut().find(|peer| peer.address == from) {
            peer.believed_at = now;
            return None;
        }
        if self.proven.len() >= MAX_PROVEN {
            let silent = self.proven.iter().enumerate().min_by_key(|(_, peer)| peer.believed_at);
            let (place, _) =
                silent.filter(|(_, peer)| now.saturating_sub(peer.believed_at) >= SILENT_AFTER)?;
            self.proven.swap_remove(place);
        }
        self.proven.push(Proven { address: from, believed_at: now });
        self.guest = None;
        self.strangers.datagrams.remove(&from);
        self.named_at.retain(|at| now.saturating_sub(*at) < SAID_EVERY);
        if self.named_at.len() < MAX_NAMED {
            self.named_at.push_back(now);
            return Some(Newcomer::Named);
        }
        self.unnamed += 1;
        self.will_say(now);
        Some(Newcomer::Unnamed)
    }

    /// Whom to send to.
    pub(super) fn answered(&self) -> impl Iterator<Item = SocketAddr> {
        let guest = self.guest.map(|(address, _)| address);
        self.fixed.into_iter().chain(self.proven.iter().map(|peer| peer.address)).chain(guest)
    }

    fn will_say(&mut self, now: Duration) {
        let soonest = self.said_at.map_or(Duration::ZERO, |at| at + SAID_EVERY);
        self.say_at.get_or_insert((now + FIRST_SAID_AFTER).max(soonest));
    }

    /// When [`Peers::say`] has something to say, if ever.
    pub(super) fn say_at(&self) -> Option<Duration> {
        self.say_at
    }

    /// One line about all those that are not answered, and about peers that were not named.
    pub(super) fn say(&mut self, now: Duration) -> Option<String> {
        self.say_at = None;
        let Strangers { datagrams, uncounted, last } = std::mem::take(&mut self.strangers);
        let further = std::mem::take(&mut self.unnamed);
        let count: u64 = datagrams.values().sum::<u64>() + uncounted;
        let mut words = Vec::new();
        if count > 0 {
            let senders = datagrams.len();
            let more = if uncounted > 0 { " and more" } else { "" };
            let last = last.map(|last| format!(", the last from {last}")).unwrap_or_default();
            words.push(format!("{senders} unknown senders{more}: {count} datagrams not answered{last}"));
        }
        if further > 0 {
            words.push(format!("{further} further peers"));
        }
        if words.is_empty() {
            return None;
        }
        self.said_at = Some(now);
        Some(words.join("; "))
    }
}

/// A sender that was not answered before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Newcomer {
    /// To be named.
    Named,
    /// One of too many to be named.
    Unnamed,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(port: u16) -> SocketAddr {
        ([127, 0, 0, 1], port).into()
    }

    fn s(seconds: u64) -> Duration {
        Duration::from_secs(seconds)
    }

    fn answered(peers: &Peers) -> Vec<SocketAddr> {
        peers.answered().collect()
    }

    #[test]
    fn strangers_never_take_the_place_of_whom_is_believed() {
        let mut peers = Peers::anybody();
        assert_eq!(peers.on_datagram(at(1), s(0)), Some(Standing::Unproven));
        assert_eq!(peers.on_believed(at(1), s(0)), Some(Newcomer::Named));
        for second in 1..1_000 {
            for port in 100..140 {
                assert_eq!(peers.on_datagram(at(port), s(second)), Some(Standing::Unproven));
            }
            assert_eq!(answered(&peers), [at(1)], "also when it has been silent for long");
        }
    }

    #[test]
    fn while_nobody_is_believed_one_stranger_is_answered() {
        let mut peers = Peers::anybody();
        for second in 0..20 {
            for port in 100..140 {
                peers.on_datagram(at(port), s(second));
            }
            assert_eq!(answered(&peers), [at(100)], "one that speaks keeps the place");
        }
        for second in 20..30 {
            peers.on_datagram(at(101), s(second));
        }
        assert_eq!(answered(&peers), [at(101)]);
        peers.on_believed(at(7), s(30));
        assert_eq!(answered(&peers), [at(7)]);
    }

    #[test]
    fn another_port_and_a_second_station_are_answered_beside_the_first() {
        let mut peers = Peers::anybody();
        for port in 1..=3 {
            assert!(peers.on_believed(at(port), s(0)).is_some());
            assert!(peers.on_believed(at(port), s(1)).is_none(), "said once");
        }
        assert_eq!(answered(&peers), [at(1), at(2), at(3)]);
    }

    /// Without a key every stranger's frame is valid.
    #[test]
    fn a_crowd_that_is_believed_takes_no_place_of_one_that_speaks() {
        let mut peers = Peers::anybody();
        peers.on_believed(at(1), s(0));
        for second in 0..100 {
            for port in 1_000..2_000 {
                peers.on_believed(at(port), s(second));
            }
            peers.on_believed(at(1), s(second));
            assert!(answered(&peers).contains(&at(1)));
            assert!(peers.proven.len() <= MAX_PROVEN);
        }
        // Silent ones make room.
        assert_eq!(peers.on_believed(at(2), s(108)), None);
        assert!(peers.on_believed(at(2), s(109)).is_some());
    }

    #[test]
    fn a_fixed_peer_is_the_only_one() {
        let mut peers = Peers::only(at(1));
        assert_eq!(peers.on_datagram(at(1), s(0)), Some(Standing::Proven));
        assert_eq!(peers.on_datagram(at(2), s(0)), None);
        assert_eq!(peers.on_believed(at(2), s(0)), None);
        assert_eq!(answered(&peers), [at(1)]);
        assert!(
            peers.say(s(1)).unwrap().contains("1 unknown senders: 1 datagrams"),
            "but others are counted"
        );
    }

    #[test]
    fn many_strangers_are_one_line_in_ten_seconds() {
        let mut peers = Peers::anybody();
        let mut lines = Vec::new();
        let (mut named, mut believed) = (0, 0);
        for tenth in 0..600 {
            let now = Duration::from_millis(100 * tenth);
            for port in 0..3_000 {
                peers.on_datagram(at(1_000 + port), now);
            }
            // And a believed sender on another port each time.
            believed += 1;
            named += u32::from(peers.on_believed(at(10_000 + tenth as u16), now) == Some(Newcomer::Named));
            if peers.say_at().is_some_and(|due| now >= due) {
                lines.extend(peers.say(now));
            }
        }
        assert!((5..=7).contains(&lines.len()), "{lines:?}");
        assert!(
            lines[0].contains("1024 unknown senders and more") && lines[0].contains("further peers"),
            "{lines:?}"
        );
        assert!(named <= 28 && believed == 600, "{named}");
    }

    #[test]
    fn a_newcomer_that_is_believed_at_once_is_no_stranger() {
        let mut peers = Peers::anybody();
        peers.on_datagram(at(1), s(0));
        peers.on_believed(at(1), Duration::from_millis(20));
        assert_eq!(peers.say_at(), Some(s(1)));
        assert_eq!(peers.say(s(1)), None);
    }
}

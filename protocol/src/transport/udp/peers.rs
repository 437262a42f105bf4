//! Decides which senders a UDP link answers, and reports all others.
//!
//! A datagram proves nothing about its sender. A sender is answered once a frame of it was
//! accepted. Time is an argument, counted from the opening of the link.

use std::collections::{BTreeMap, VecDeque};
use std::net::SocketAddr;
use std::time::Duration;

use super::Standing;
use crate::hub::Origin;

/// Most proven senders answered at the same time; each costs the vehicle's complete telemetry,
/// 2,000 bytes a second. Without a key every frame is valid, so there must be more entries than
/// strangers usually take.
const MAX_PROVEN: usize = 64;
/// When all places are taken, a newcomer displaces a proven sender that has been silent for this
/// long. A sender that still sends is never displaced.
const SILENT_AFTER: Duration = Duration::from_secs(10);
/// While no sender is proven, one stranger (the guest) is answered, so that a ground with the wrong
/// key can see why it is refused. It is replaced once it has been silent for this long.
const GUEST_SILENT_AFTER: Duration = Duration::from_secs(5);

/// Unknown senders are reported at most this often.
const REPORT_INTERVAL: Duration = Duration::from_secs(10);
/// The first report waits this long, so that a newcomer whose first frame is still being checked is
/// not reported.
const FIRST_REPORT_DELAY: Duration = Duration::from_secs(1);
/// This many new peers are named in [`REPORT_INTERVAL`]; of further ones only the number is
/// reported.
const MAX_NAMED: usize = 4;
/// This many strangers are counted by sender; of further ones only the datagrams are counted.
const MAX_COUNTED_SENDERS: usize = 1024;

#[derive(Debug)]
struct Proven {
    address: SocketAddr,
    /// When a frame of this sender was last accepted.
    accepted_at: Duration,
}

/// Senders that were not accepted since the last report.
#[derive(Debug, Default)]
struct UnknownSenders {
    datagrams: BTreeMap<SocketAddr, u64>,
    uncounted: u64,
    last: Option<SocketAddr>,
}

#[derive(Debug)]
pub(super) struct Peers {
    /// The only peer of a `udpout` link.
    fixed: Option<SocketAddr>,
    /// The broadcast address of a `udpout` link, which receives what is for every peer.
    network: Option<SocketAddr>,
    proven: Vec<Proven>,
    guest: Option<(SocketAddr, Duration)>,
    strangers: UnknownSenders,
    /// When the most recent peers were named.
    named_at: VecDeque<Duration>,
    unnamed: u64,
    reported_at: Option<Duration>,
    report_due_at: Option<Duration>,
}

impl Peers {
    /// A link that answers every proven sender.
    pub(super) fn any() -> Self {
        Self {
            fixed: None,
            network: None,
            proven: Vec::new(),
            guest: None,
            strangers: UnknownSenders::default(),
            named_at: VecDeque::new(),
            unnamed: 0,
            reported_at: None,
            report_due_at: None,
        }
    }

    /// A link with only this peer.
    pub(super) fn only(peer: SocketAddr) -> Self {
        Self { fixed: Some(peer), ..Self::any() }
    }

    /// A link to every host of a network, each of which may answer.
    pub(super) fn of_network(broadcast: SocketAddr) -> Self {
        Self { network: Some(broadcast), ..Self::any() }
    }

    /// Notes the sender of a datagram; returns `None` if its datagrams are to be dropped.
    pub(super) fn on_datagram(&mut self, from: SocketAddr, now: Duration) -> Option<Standing> {
        if self.fixed == Some(from) || self.proven.iter().any(|peer| peer.address == from) {
            return Some(Standing::Proven);
        }
        let strangers = &mut self.strangers;
        if strangers.datagrams.len() < MAX_COUNTED_SENDERS || strangers.datagrams.contains_key(&from) {
            *strangers.datagrams.entry(from).or_default() += 1;
        } else {
            strangers.uncounted += 1;
        }
        strangers.last = Some(from);
        self.schedule_report(now);
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

    /// Notes that a frame of this sender was accepted. Returns a value if the sender is answered
    /// from now on and was not before; the value states whether it is to be named.
    pub(super) fn on_accepted(&mut self, from: SocketAddr, now: Duration) -> Option<Newcomer> {
        if self.fixed.is_some() {
            return None;
        }
        if let Some(peer) = self.proven.iter_mut().find(|peer| peer.address == from) {
            peer.accepted_at = now;
            return None;
        }
        if self.proven.len() >= MAX_PROVEN {
            let silent = self.proven.iter().enumerate().min_by_key(|(_, peer)| peer.accepted_at);
            let (place, _) =
                silent.filter(|(_, peer)| now.saturating_sub(peer.accepted_at) >= SILENT_AFTER)?;
            self.proven.swap_remove(place);
        }
        self.proven.push(Proven { address: from, accepted_at: now });
        self.guest = None;
        self.strangers.datagrams.remove(&from);
        self.named_at.retain(|at| now.saturating_sub(*at) < REPORT_INTERVAL);
        if self.named_at.len() < MAX_NAMED {
            self.named_at.push_back(now);
            return Some(Newcomer::Named);
        }
        self.unnamed += 1;
        self.schedule_report(now);
        Some(Newcomer::Unnamed)
    }

    /// The addresses to send to: the one peer, or all.
    pub(super) fn receivers(&self, to: Option<Origin>) -> impl Iterator<Item = SocketAddr> {
        let all = self.network.filter(|_| to.is_none());
        let guest = self.guest.map(|(address, _)| address);
        let answered = self.fixed.into_iter().chain(self.proven.iter().map(|peer| peer.address)).chain(guest);
        let receives = move |peer: &SocketAddr| to.is_none_or(|to| to == Origin::Datagram(*peer));
        all.into_iter().chain(answered.filter(move |peer| all.is_none() && receives(peer)))
    }

    fn schedule_report(&mut self, now: Duration) {
        let soonest = self.reported_at.map_or(Duration::ZERO, |at| at + REPORT_INTERVAL);
        self.report_due_at.get_or_insert((now + FIRST_REPORT_DELAY).max(soonest));
    }

    /// When [`Peers::report`] is due, if there is something to report.
    pub(super) fn report_due_at(&self) -> Option<Duration> {
        self.report_due_at
    }

    /// Returns one line about the senders that are not answered and the peers that were not named.
    pub(super) fn report(&mut self, now: Duration) -> Option<String> {
        self.report_due_at = None;
        let UnknownSenders { datagrams, uncounted, last } = std::mem::take(&mut self.strangers);
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
        self.reported_at = Some(now);
        Some(words.join("; "))
    }
}

/// A sender that is answered from now on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Newcomer {
    Named,
    /// There were too many newcomers to name this one.
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
        peers.receivers(None).collect()
    }

    #[test]
    fn strangers_never_displace_an_accepted_sender() {
        let mut peers = Peers::any();
        assert_eq!(peers.on_datagram(at(1), s(0)), Some(Standing::Unproven));
        assert_eq!(peers.on_accepted(at(1), s(0)), Some(Newcomer::Named));
        for second in 1..1_000 {
            for port in 100..140 {
                assert_eq!(peers.on_datagram(at(port), s(second)), Some(Standing::Unproven));
            }
            assert_eq!(answered(&peers), [at(1)], "it keeps its place although it is silent");
        }
    }

    #[test]
    fn while_no_sender_is_accepted_one_stranger_is_answered() {
        let mut peers = Peers::any();
        for second in 0..20 {
            for port in 100..140 {
                peers.on_datagram(at(port), s(second));
            }
            assert_eq!(answered(&peers), [at(100)], "a stranger that still sends keeps the place");
        }
        for second in 20..30 {
            peers.on_datagram(at(101), s(second));
        }
        assert_eq!(answered(&peers), [at(101)]);
        peers.on_accepted(at(7), s(30));
        assert_eq!(answered(&peers), [at(7)]);
    }

    #[test]
    fn another_port_and_a_second_station_are_answered_beside_the_first() {
        let mut peers = Peers::any();
        for port in 1..=3 {
            assert!(peers.on_accepted(at(port), s(0)).is_some());
            assert!(peers.on_accepted(at(port), s(1)).is_none(), "it is named only once");
        }
        assert_eq!(answered(&peers), [at(1), at(2), at(3)]);
    }

    /// Without a key every stranger's frame is accepted.
    #[test]
    fn many_accepted_senders_do_not_displace_one_that_still_sends() {
        let mut peers = Peers::any();
        peers.on_accepted(at(1), s(0));
        for second in 0..100 {
            for port in 1_000..2_000 {
                peers.on_accepted(at(port), s(second));
            }
            peers.on_accepted(at(1), s(second));
            assert!(answered(&peers).contains(&at(1)));
            assert!(peers.proven.len() <= MAX_PROVEN);
        }
        // Silent senders make room.
        assert_eq!(peers.on_accepted(at(2), s(108)), None);
        assert!(peers.on_accepted(at(2), s(109)).is_some());
    }

    #[test]
    fn a_fixed_peer_is_the_only_one_answered() {
        let mut peers = Peers::only(at(1));
        assert_eq!(peers.on_datagram(at(1), s(0)), Some(Standing::Proven));
        assert_eq!(peers.on_datagram(at(2), s(0)), None);
        assert_eq!(peers.on_accepted(at(2), s(0)), None);
        assert_eq!(answered(&peers), [at(1)]);
        assert!(
            peers.report(s(1)).unwrap().contains("1 unknown senders: 1 datagrams"),
            "datagrams of others are counted"
        );
    }

    #[test]
    fn many_strangers_are_reported_in_one_line_every_ten_seconds() {
        let mut peers = Peers::any();
        let mut lines = Vec::new();
        let (mut named, mut accepted) = (0, 0);
        for tenth in 0..600 {
            let now = Duration::from_millis(100 * tenth);
            for port in 0..3_000 {
                peers.on_datagram(at(1_000 + port), now);
            }
            // In addition an accepted sender appears on a new port each time.
            accepted += 1;
            named += u32::from(peers.on_accepted(at(10_000 + tenth as u16), now) == Some(Newcomer::Named));
            if peers.report_due_at().is_some_and(|due| now >= due) {
                lines.extend(peers.report(now));
            }
        }
        assert!((5..=7).contains(&lines.len()), "{lines:?}");
        assert!(
            lines[0].contains("1024 unknown senders and more") && lines[0].contains("further peers"),
            "{lines:?}"
        );
        assert!(named <= 28 && accepted == 600, "{named}");
    }

    #[test]
    fn a_newcomer_accepted_at_once_is_not_reported_as_a_stranger() {
        let mut peers = Peers::any();
        peers.on_datagram(at(1), s(0));
        peers.on_accepted(at(1), Duration::from_millis(20));
        assert_eq!(peers.report_due_at(), Some(s(1)));
        assert_eq!(peers.report(s(1)), None);
    }
}

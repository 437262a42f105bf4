//! Tracks the boots received under a system id and selects the one to display. A *boot* is one
//! vehicle from one power-up on. `TD_FLIGHT_STATUS` identifies it by the vehicle's unique id, the
//! boot number and the vehicle's clock. Heartbeats and the messages of this dialect carry the boot
//! number. Any other message is assigned to the boot whose clock or sequence numbers it fits.

use std::collections::VecDeque;
use std::time::Duration;

use protocol::dialect::TdPhase;
use protocol::identity::LARGEST_BOOT_NUMBER;

use super::{KeepAway, Model, Vehicle, foreign_name, words};

/// Messages of a slow and a fast link mix: a vehicle's clock, ms, may go back by this much.
const REORDERED_MS: i64 = 5_000;
/// Two boots of one vehicle follow each other. This much of an overlap, ms, are the delays of its
/// links.
const OVERLAP_MS: i64 = 500;
/// Over different links one clock arrives with different delays, up to this, ms; beyond it there
/// are two clocks.
const LINKS_APART_MS: i64 = 2_000;
/// Silence after which one of several vehicles under an id is removed.
pub const EXPIRES_AFTER: Duration = Duration::from_secs(10);
/// Silence after which the next boot from the same source is a reset of the shown vehicle: twenty
/// reports on a network, and more than one on the slowest line.
const RESET_AFTER: Duration = Duration::from_secs(2);
/// Number of tracked boots: the shown one, and a few that run beside it or preceded it.
const BOOTS_MAX: usize = 4;
/// Number of reports within [`STEADY_WITHIN`] that show a boot to be running; a single frame may be
/// forged.
const STEADY_REPORTS: usize = 3;
const STEADY_WITHIN: Duration = Duration::from_secs(3);
/// How many sources of one boot are distinguished.
const SOURCES_MAX: usize = 4;
/// Sequence number and clock of one sender rise together. Reports this near to each other, ms, have
/// fewer than 128 frames between them.
const NEAR_MS: i64 = 500;
/// Maximum age of the last report from a source that a boot still uses.
const ALIVE_WITHIN: Duration = Duration::from_secs(2);
/// Number of contradictions of clock and sequence number within [`EXPIRES_AFTER`] that prove
/// two vehicles.
const CONTRADICTIONS: usize = 3;

/// Identification of the sender in a flight status.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StatusReport {
    /// The vehicle's unique id; 0: not reported.
    pub uid: u16,
    /// The number of its boot; 0: not reported.
    pub boot: u32,
    /// The time on its clock, ms.
    pub clock_ms: u32,
    /// The sequence number of the frame.
    pub sequence: u8,
    /// From where the frame came: a number for each link and address, with that of the link in its
    /// upper byte.
    pub source: u16,
}

/// Names a boot for as long as the station runs.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct BootId(u32);

/// The last report of a boot from one source.
#[derive(Debug, Clone, Copy)]
struct Source {
    number: u16,
    /// When the boot began on our clock, ms, if nothing has been delayed: the least that was found.
    began_ms: i64,
    reports: u32,
    clock_ms: u32,
    sequence: u8,
    received_at: Duration,
}

impl Source {
    /// Clock difference of another report to its last one, ms.
    fn clock_by_ms(&self, report: &StatusReport) -> i64 {
        i64::from(report.clock_ms) - i64::from(self.clock_ms)
    }

    /// Whether clock and sequence number have risen, or fallen, together since its last report.
    fn is_in_order(&self, report: &StatusReport) -> bool {
        let sequence_by = i64::from(report.sequence.wrapping_sub(self.sequence).cast_signed());
        self.clock_by_ms(report).signum() == sequence_by.signum()
    }
}

/// The link of a source.
const fn link_of(source: u16) -> u16 {
    source >> 8
}

#[derive(Debug, Clone, Default)]
struct TrackedBoot {
    id: BootId,
    uid: u16,
    number: u32,
    sources: Vec<Source>,
    /// The latest time on its clock, ms.
    clock_ms: u32,
    received_at: Duration,
    /// When its last reports came.
    reports_at: VecDeque<Duration>,
    /// When its clock and its sequence numbers last contradicted each other.
    contradicted_at: VecDeque<Duration>,
    /// Armed, in a countdown, in flight, or down and not yet safe.
    is_busy: bool,
}

fn ms(time: Duration) -> i64 {
    i64::try_from(time.as_millis()).unwrap_or(i64::MAX)
}

fn is_within(at: Duration, limit: Duration, now: Duration) -> bool {
    now.saturating_sub(at) < limit
}

impl TrackedBoot {
    /// Whether this is its number, as far as a heartbeat has room for it.
    fn is_number(&self, number: u32) -> bool {
        (self.number ^ number) & LARGEST_BOOT_NUMBER == 0
    }

    fn is_alive(&self, now: Duration) -> bool {
        is_within(self.received_at, EXPIRES_AFTER, now)
    }

    /// Difference between a clock reading and this boot's extrapolated clock, ms.
    fn away_ms(&self, clock_ms: u32, now: Duration) -> i64 {
        i64::from(clock_ms) - i64::from(self.clock_ms) - ms(now.saturating_sub(self.received_at))
    }

    /// Whether a report may be one of this boot.
    fn fits(&self, report: &StatusReport, now: Duration) -> bool {
        let is_late = i64::from(report.clock_ms) + REORDERED_MS < i64::from(self.clock_ms);
        (self.uid, self.number) == (report.uid, report.boot)
            && !is_late
            && self.away_ms(report.clock_ms, now) <= REORDERED_MS
    }

    fn update(&mut self, report: &StatusReport, now: Duration) {
        self.received_at = now;
        self.clock_ms = self.clock_ms.max(report.clock_ms);
        self.reports_at.push_back(now);
        self.reports_at.drain(..self.reports_at.len().saturating_sub(STEADY_REPORTS));
        let began_ms = ms(now) - i64::from(report.clock_ms);
        let known = self.sources.iter_mut().find(|source| source.number == report.source);
        let Some(source) = known else {
            self.sources.drain(..(self.sources.len() + 1).saturating_sub(SOURCES_MAX));
            let StatusReport { source: number, clock_ms, sequence, .. } = *report;
            self.sources.push(Source { number, began_ms, reports: 1, clock_ms, sequence, received_at: now });
            return;
        };
        let contradicts = source.clock_by_ms(report).abs() <= NEAR_MS && !source.is_in_order(report);
        source.began_ms = source.began_ms.min(began_ms);
        source.reports = source.reports.saturating_add(1);
        (source.clock_ms, source.sequence, source.received_at) = (report.clock_ms, report.sequence, now);
        if contradicts {
            self.contradict(now);
        }
    }

    /// Notes that two senders claim to be this boot.
    fn contradict(&mut self, now: Duration) {
        self.contradicted_at.push_back(now);
        self.contradicted_at.drain(..self.contradicted_at.len().saturating_sub(CONTRADICTIONS));
    }

    /// Whether a report comes from another address of the link over which this boot reports, and is
    /// out of step with it. Copies of the same vehicle's frames over another link stay in step.
    fn is_out_of_step(&self, report: &StatusReport, now: Duration) -> bool {
        let recent = self.sources.iter().filter(|source| is_within(source.received_at, ALIVE_WITHIN, now));
        // The newest one: a vehicle that gets another address continues from there.
        let Some(usual) = recent.max_by_key(|source| source.received_at) else { return false };
        let since_ms = ms(now.saturating_sub(usual.received_at));
        let is_on_time = (usual.clock_by_ms(report) - since_ms).abs() <= NEAR_MS;
        let is_in_step = is_on_time && (since_ms > NEAR_MS || usual.is_in_order(report));
        usual.number != report.source && link_of(usual.number) == link_of(report.source) && !is_in_step
    }

    /// How many frames after its last report a sequence number comes.
    fn behind(&self, sequence: u8) -> i64 {
        self.sources.iter().map(|source| i64::from(sequence.wrapping_sub(source.sequence))).min().unwrap_or(0)
    }

    /// When it began, ms on our clock.
    fn began_ms(&self) -> i64 {
        self.sources.iter().map(|source| source.began_ms).min().unwrap_or(0)
    }

    fn is_at(&self, source: u16) -> bool {
        self.sources.iter().any(|known| known.number == source)
    }

    fn shares_a_source(&self, other: &Self) -> bool {
        self.sources.iter().any(|source| other.is_at(source.number))
    }

    /// Whether it may be the same vehicle after its next power-up.
    fn follows(&self, former: &Self) -> bool {
        self.uid == former.uid
            && self.began_ms() + OVERLAP_MS >= former.began_ms() + i64::from(former.clock_ms)
    }

    fn is_steady(&self, now: Duration) -> bool {
        self.reports_at.len() == STEADY_REPORTS
            && self.reports_at.iter().all(|at| is_within(*at, STEADY_WITHIN, now))
    }

    /// Whether two vehicles speak with this unique id and this boot: a copied memory card.
    fn is_of_two(&self, now: Duration) -> bool {
        let contradicts = self.contradicted_at.len() == CONTRADICTIONS
            && self.contradicted_at.iter().all(|at| is_within(*at, EXPIRES_AFTER, now));
        let clocks = || self.sources.iter().filter(|source| source.reports > 5).map(|source| source.began_ms);
        let apart_ms = clocks().max().zip(clocks().min()).map_or(0, |(last, first)| last - first);
        contradicts || apart_ms > LINKS_APART_MS
    }
}

/// Another vehicle beside the shown one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Beside {
    /// This boot; its number, 0 if it reports none.
    Boot(BootId, u32),
    /// One that has the unique id and the boot of the shown one.
    Twin,
}

/// The tracked boots.
#[derive(Debug, Clone, Default)]
pub struct Boots {
    list: Vec<TrackedBoot>,
    shown: Option<BootId>,
    /// The boot that the crew has chosen by name.
    chosen: Option<BootId>,
    next_id: u32,
}

impl Boots {
    fn of(&self, id: BootId) -> Option<&TrackedBoot> {
        self.list.iter().find(|boot| boot.id == id)
    }

    fn shown_boot(&self) -> Option<&TrackedBoot> {
        self.of(self.shown?)
    }

    pub fn shown(&self) -> Option<BootId> {
        self.shown
    }

    /// The boot that fits, if it is the only one.
    fn only(&self, fits: impl Fn(&TrackedBoot) -> bool) -> Option<BootId> {
        let mut fitting = self.list.iter().filter(|boot| fits(boot)).map(|boot| boot.id);
        fitting.next().filter(|_| fitting.next().is_none())
    }

    /// Whether this boot may be the shown vehicle after a reset, rather than another vehicle.
    pub fn follows(&self, id: BootId, former: BootId) -> bool {
        self.of(id).zip(self.of(former)).is_some_and(|(boot, former)| boot.follows(former))
    }

    /// Whether a flight status only claims to be of the shown boot. It is noted: two vehicles may
    /// have one boot and unique id.
    pub fn disowns(&mut self, report: &StatusReport, now: Duration) -> bool {
        let shown = self.shown;
        let claims = |boot: &&mut TrackedBoot| {
            Some(boot.id) == shown && boot.fits(report, now) && boot.is_out_of_step(report, now)
        };
        self.list.iter_mut().find(claims).map(|boot| boot.contradict(now)).is_some()
    }

    /// Assigns a flight status to a boot and returns it. The first boot is shown.
    pub fn identify(&mut self, report: &StatusReport, now: Duration) -> BootId {
        let fitting = self.list.iter_mut().filter(|boot| boot.fits(report, now));
        if let Some(boot) = fitting.min_by_key(|boot| boot.away_ms(report.clock_ms, now).abs()) {
            boot.update(report, now);
            return boot.id;
        }
        let id = BootId(self.next_id);
        self.next_id = self.next_id.wrapping_add(1);
        if self.list.len() == BOOTS_MAX {
            let retained = [self.shown, self.chosen];
            let oldest = (0..BOOTS_MAX)
                .filter(|place| !retained.contains(&Some(self.list[*place].id)))
                .min_by_key(|place| (self.list[*place].is_busy, self.list[*place].received_at));
            self.list.remove(oldest.unwrap_or(0));
        }
        let mut boot = TrackedBoot { id, uid: report.uid, number: report.boot, ..TrackedBoot::default() };
        boot.update(report, now);
        self.list.push(boot);
        self.shown.get_or_insert(id);
        id
    }

    /// Which boot another message comes from: the one that it names, or the only one at this
    /// source, else by its clock or its sequence number; `None` before the first flight status.
    /// What fits several goes to the shown one.
    pub fn sender(
        &self,
        source: u16,
        (number, clock_ms, sequence): (Option<u32>, Option<u32>, u8),
        now: Duration,
    ) -> Option<BootId> {
        let shown = self.shown_boot()?;
        let named = |boot: &TrackedBoot| number.is_some_and(|number| boot.is_number(number));
        let here = |boot: &TrackedBoot| boot.is_alive(now) && boot.is_at(source);
        if let Some(only) = self.only(named).or_else(|| self.only(here)) {
            return Some(only);
        }
        let off = |boot: &TrackedBoot| match clock_ms {
            Some(clock_ms) => boot.away_ms(clock_ms, now).abs(),
            None => boot.behind(sequence),
        };
        let others = self.list.iter().filter(|boot| boot.id != shown.id && boot.is_steady(now));
        let nearest = others.min_by_key(|boot| off(boot)).filter(|boot| off(boot) < off(shown));
        Some(nearest.unwrap_or(shown).id)
    }

    /// Whether a message names a boot that has not reported yet: its sender is not identified.
    pub fn is_stray(&self, number: u32) -> bool {
        self.shown.is_some() && !self.list.iter().any(|boot| boot.is_number(number))
    }

    /// Whether a source is another address of the link over which the shown boot reports, and no
    /// boot has reported from it: its sender is another one, not identified yet.
    pub fn is_strange(&self, source: u16, now: Duration) -> bool {
        let reports_beside = |boot: &TrackedBoot| {
            let beside = |known: &Source| link_of(known.number) == link_of(source);
            is_within(boot.received_at, ALIVE_WITHIN, now) && boot.sources.iter().any(beside)
        };
        self.shown_boot().is_some_and(reports_beside) && !self.list.iter().any(|boot| boot.is_at(source))
    }

    /// Notes whether a boot is armed, in a countdown, in flight, or down and not yet safe.
    pub fn note(&mut self, id: BootId, is_busy: bool) {
        self.list.iter_mut().filter(|boot| boot.id == id).for_each(|boot| boot.is_busy = is_busy);
    }

    /// Decides which boot is shown. Returns the one that takes the screen. The shown boot stays on
    /// the screen while it is received; a single frame of another one never replaces it. It is
    /// replaced by a boot chosen by name; by the next boot of the same vehicle, after a reset; and,
    /// while idle, by one from the same source that is armed or flies.
    pub fn settle(&mut self, now: Duration) -> Option<BootId> {
        let shown = self.shown_boot()?;
        let chosen = self.chosen.filter(|id| self.of(*id).is_some_and(|boot| boot.is_alive(now)));
        let silence = now.saturating_sub(shown.received_at);
        let takes = |boot: &&TrackedBoot| {
            let reports = boot.reports_at.iter().filter(|at| **at > shown.received_at).count();
            let near = boot.shares_a_source(shown);
            let after = if near && boot.follows(shown) { RESET_AFTER } else { EXPIRES_AFTER };
            let is_alone = silence >= after && reports > 1;
            boot.id != shown.id
                && boot.is_alive(now)
                && (is_alone || (near && boot.is_busy && !shown.is_busy && boot.is_steady(now)))
        };
        let next = chosen.unwrap_or_else(|| {
            let taking = self.list.iter().filter(takes);
            taking.max_by_key(|boot| (boot.is_busy, boot.received_at)).map_or(shown.id, |boot| boot.id)
        });
        self.chosen = chosen;
        let changed = self.shown.replace(next) != Some(next);
        changed.then_some(next)
    }

    /// Selects this boot by its number. Returns false if it is not received, or not the only one of
    /// its number.
    pub fn choose(&mut self, number: u32, now: Duration) -> bool {
        let only = self.only(|boot| boot.number == number && boot.is_alive(now));
        self.chosen = only.or(self.chosen);
        only.is_some()
    }

    /// Other vehicles received beside the shown one.
    pub fn beside(&self, now: Duration) -> Vec<Beside> {
        let Some(shown) = self.shown_boot().filter(|shown| shown.is_alive(now)) else { return Vec::new() };
        let is_other = |boot: &&TrackedBoot| {
            let is_same = boot.shares_a_source(shown) && (boot.follows(shown) || shown.follows(boot));
            boot.id != shown.id && boot.is_alive(now) && !is_same
        };
        let others = self.list.iter().filter(is_other).map(|boot| Beside::Boot(boot.id, boot.number));
        let twin = self.list.iter().any(|boot| boot.is_alive(now) && boot.is_of_two(now));
        others.chain(twin.then_some(Beside::Twin)).collect()
    }

    /// Whether the crew has chosen the shown one among several, and a command can name it: its boot
    /// has a number that no other one has.
    pub fn is_chosen(&self, now: Duration) -> bool {
        let Some(shown) = self.shown_boot() else { return false };
        let same = self.list.iter().filter(|boot| boot.number == shown.number && boot.is_alive(now)).count();
        self.chosen == self.shown && shown.number > 0 && same == 1 && !shown.is_of_two(now)
    }

    /// Time since the last report of a boot.
    pub fn age(&self, id: BootId, now: Duration) -> Option<Duration> {
        self.of(id).map(|boot| now.saturating_sub(boot.received_at))
    }
}

// The vehicles of these boots: the model shows one, and stores the others beside it.

impl Model {
    /// The vehicles received beside the shown one, in words; `None` if it is alone.
    pub fn beside(&self, now: Duration) -> Option<String> {
        let is_alive = |at: Duration| is_within(at, EXPIRES_AFTER, now);
        let ours = self.vehicle.status.as_ref().is_some_and(|status| is_alive(status.received_at));
        let foreign = self.vehicle.foreign.as_ref().filter(|foreign| ours && is_alive(foreign.received_at));
        let words = self.boots.beside(now).into_iter().map(|other| match other {
            Beside::Boot(_, 0) => "one without a boot number".to_owned(),
            Beside::Boot(id, boot) => {
                let state = self.others.get(&id).map(|of| format!(" {}", state_words(of)));
                format!("boot {}{}", words::boot(boot), state.unwrap_or_default())
            }
            Beside::Twin => "another one with the same boot and unique id".to_owned(),
        });
        let words: Vec<String> = words.chain(foreign.map(foreign_name)).collect();
        (!words.is_empty()).then(|| words.join(", "))
    }

    /// A row for each vehicle while there are several: its boot, phase, whether it is armed, its
    /// countdown and its age.
    pub fn vehicle_rows(&self, now: Duration) -> Vec<String> {
        let beside = self.boots.beside(now);
        let row = |lead: &str, vehicle: &Vehicle, age: Option<Duration>| {
            let boot = vehicle.boot.number().map_or_else(|| "--".to_owned(), words::boot);
            let age = age.map_or_else(String::new, |age| format!(" {}s", age.as_secs()));
            format!("{lead} {boot} {}{age}", state_words(vehicle))
        };
        let others = beside.iter().filter_map(|other| match other {
            Beside::Boot(id, _) => Some(row("also", self.others.get(id)?, self.boots.age(*id, now))),
            Beside::Twin => Some("also one with the same boot and unique id".to_owned()),
        });
        let shown = self.boots.shown().filter(|_| !beside.is_empty());
        let shown = shown.map(|id| row("this", &self.vehicle, self.boots.age(id, now)));
        shown.into_iter().chain(others).collect()
    }

    /// Boot numbers of the other vehicles, among which the crew may choose.
    pub fn other_boots(&self, now: Duration) -> Vec<u32> {
        let boot = |other| match other {
            Beside::Boot(_, boot) if boot > 0 => Some(boot),
            _ => None,
        };
        self.boots.beside(now).into_iter().filter_map(boot).collect()
    }

    /// All received vehicles: the shown one, and those beside it.
    pub fn every_vehicle(&self, now: Duration) -> impl Iterator<Item = &Vehicle> {
        let received = self
            .others
            .iter()
            .filter(move |(id, _)| self.boots.age(**id, now).is_some_and(|age| age < EXPIRES_AFTER));
        std::iter::once(&self.vehicle).chain(received.map(|(_, vehicle)| vehicle))
    }
}

/// Its phase, whether it is armed, and its countdown.
fn state_words(vehicle: &Vehicle) -> String {
    let phase = vehicle.phase_now().map_or_else(|| "phase ?".to_owned(), words::phase);
    let armed = match vehicle.armed() {
        None => "armed ?",
        Some(armed) if armed.value => "ARMED",
        Some(_) => "disarmed",
    };
    let left = vehicle.countdown_s().filter(|left| left.value > 0.0);
    let left = left.map_or_else(String::new, |left| format!(" T-{:.0}", left.value));
    format!("{phase} {armed}{left}")
}

/// Whether a vehicle is armed, in a countdown, in flight, or down and not yet safe: then it stays
/// on the screen.
pub(crate) fn is_busy(vehicle: &Vehicle, now: Duration) -> bool {
    let is_armed_on_pad = vehicle.phase_now() == Some(TdPhase::TD_PHASE_PAD_ARMED);
    vehicle.is_armed() || is_armed_on_pad || vehicle.in_flight() || KeepAway::of(vehicle, now).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn at(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    /// A vehicle that was switched on at this time, ms.
    #[derive(Debug, Clone, Copy)]
    struct Sender {
        uid: u16,
        boot: u32,
        on_ms: u64,
        source: u16,
        sequence: u8,
    }

    impl Sender {
        const fn new(uid: u16, boot: u32, on_ms: u64) -> Self {
            Self { uid, boot, on_ms, source: 0, sequence: (on_ms % 251) as u8 }
        }

        /// Its report of this time; six frames of other kinds lie between two of them.
        fn report(&mut self, said_ms: u64) -> StatusReport {
            self.sequence = self.sequence.wrapping_add(7);
            let clock_ms = (said_ms - self.on_ms) as u32;
            StatusReport {
                uid: self.uid,
                boot: self.boot,
                clock_ms,
                sequence: self.sequence,
                source: self.source,
            }
        }
    }

    fn beside(boots: &Boots, now: Duration) -> usize {
        boots.beside(now).len()
    }

    #[test]
    fn a_second_vehicle_is_one_at_once_and_does_not_take_the_screen() {
        let mut boots = Boots::default();
        let [mut first, mut second] = [Sender::new(1, 7, 0), Sender::new(2, 9, 20_000)];
        let shown = boots.identify(&first.report(10_000), at(10_000));
        for ms in (10_000..60_000).step_by(100) {
            boots.identify(&first.report(ms), at(ms));
            if ms >= 20_000 {
                boots.identify(&second.report(ms), at(ms));
                assert_eq!(beside(&boots, at(ms)), 1, "{ms}");
            }
            assert_eq!((boots.settle(at(ms)), boots.shown()), (None, Some(shown)));
        }
        // The shown one is switched off: 10 s later the other one is alone, and has the screen.
        for ms in (60_000..71_000).step_by(100) {
            let boot = boots.identify(&second.report(ms), at(ms));
            let takes = boots.settle(at(ms));
            assert_eq!(takes, (ms == 69_900).then_some(boot), "{ms}");
        }
        assert_eq!(beside(&boots, at(70_000)), 0);
    }

    #[test]
    fn a_reset_with_a_fixed_boot_number_is_seen_by_the_clock() {
        let mut boots = Boots::default();
        let [mut before, mut after] = [Sender::new(1, 7, 0), Sender::new(1, 7, 30_500)];
        for ms in (0..30_000).step_by(100) {
            boots.identify(&before.report(ms), at(ms));
        }
        let taken = (31_000..34_000).step_by(100).find(|ms| {
            boots.identify(&after.report(*ms), at(*ms));
            assert_eq!(beside(&boots, at(*ms)), 0, "{ms}");
            boots.settle(at(*ms)).is_some()
        });
        assert_eq!(taken, Some(31_900), "2 s after its last report");
    }

    #[test]
    fn two_vehicles_with_one_boot_and_one_unique_id_differ_by_clock_or_sequence_number() {
        for (apart_ms, sources) in
            [(0, [0, 0]), (300, [0, 0]), (3_000, [0, 1]), (60_000, [0, 0]), (60_000, [0, 1])]
        {
            let mut boots = Boots::default();
            let mut both = [Sender::new(1, 7, 0), Sender::new(1, 7, apart_ms)];
            (both[0].source, both[1].source, both[1].sequence) = (sources[0], sources[1], 100);
            for ms in (100_000..103_000).step_by(100) {
                let two = &mut both;
                for sender in two {
                    boots.identify(&sender.report(ms), at(ms));
                }
                boots.settle(at(ms));
            }
            assert!(beside(&boots, at(103_000)) > 0, "{apart_ms} {sources:?}");
            assert!(!boots.choose(7, at(103_000)) || !boots.is_chosen(at(103_000)), "no command can name it");
        }
    }

    /// From another address of the same link, with the boot, the unique id and about the clock of
    /// the vehicle.
    #[test]
    fn a_status_that_only_claims_to_be_the_vehicle_s_is_not_taken_and_seen_as_a_second_one() {
        let mut boots = Boots::default();
        let mut ours = Sender { source: 0x101, ..Sender::new(1, 7, 0) };
        let mut disowned = 0;
        for ms in (10_000..20_000).step_by(100) {
            let report = ours.report(ms);
            assert!(!boots.disowns(&report, at(ms)));
            boots.identify(&report, at(ms));
            // The same over another link, and a copy that another way of the same link brings
            // first.
            for (source, later) in [(0x201, 0), (0x102, 1)] {
                let copy = StatusReport {
                    source,
                    sequence: report.sequence.wrapping_add(later),
                    clock_ms: report.clock_ms + u32::from(later),
                    ..report
                };
                assert!(!boots.disowns(&copy, at(ms)), "{source}");
            }
            if ms % 1_000 == 0 {
                let forged = StatusReport {
                    source: 0x103,
                    clock_ms: report.clock_ms + 20,
                    sequence: report.sequence.wrapping_add(200),
                    ..report
                };
                disowned += usize::from(boots.disowns(&forged, at(ms)));
            }
        }
        assert_eq!((disowned, beside(&boots, at(20_000))), (10, 1));
    }

    /// As when a router gives it another port: at once, or after a pause.
    #[test]
    fn a_vehicle_that_gets_another_address_stays_one() {
        for pause_ms in [0, 1_000] {
            let mut boots = Boots::default();
            let mut ours = Sender { source: 0x101, ..Sender::new(1, 7, 0) };
            for ms in (10_000..20_000).step_by(100).filter(|ms| !(15_000..15_000 + pause_ms).contains(ms)) {
                ours.source = if ms < 15_000 { 0x101 } else { 0x102 };
                let report = ours.report(ms);
                assert!(!boots.disowns(&report, at(ms)), "{ms} after {pause_ms}");
                boots.identify(&report, at(ms));
                assert_eq!(beside(&boots, at(ms)), 0);
            }
        }
    }

    proptest! {
        /// The shown vehicle stays on the screen while it is received, whatever other frames arrive
        /// in any order and at any rate.
        #[test]
        fn no_vehicle_takes_the_screen_from_one_that_is_received(
            others in prop::collection::vec(
                (0_u16..3, 0_u32..4, 0_u64..100_000, 0_u16..2, any::<bool>(), any::<u8>()), 1..300,
            ),
            gaps_ms in prop::collection::vec(1_u64..1_900, 20..60),
            is_busy in any::<bool>(),
        ) {
            let mut boots = Boots::default();
            let mut ours = Sender::new(9, 9, 0);
            let shown = boots.identify(&ours.report(100_000), at(100_000));
            boots.note(shown, true);
            let mut now_ms = 100_000;
            let mut others = others.iter().cycle();
            for gap_ms in gaps_ms {
                let mut left_ms = gap_ms;
                while left_ms > 0 {
                    let step_ms = left_ms.min(97);
                    (left_ms, now_ms) = (left_ms - step_ms, now_ms + step_ms);
                    if let Some((uid, boot, clock_ms, source, _, sequence)) = others.next() {
                        let clock_ms = *clock_ms as u32;
                        let report = StatusReport { uid: *uid, boot: *boot, clock_ms, sequence: *sequence, source: *source };
                        let id = boots.identify(&report, at(now_ms));
                        boots.note(id, is_busy);
                        prop_assert_eq!(boots.settle(at(now_ms)), None);
                    }
                    prop_assert!(boots.list.len() <= BOOTS_MAX && boots.shown() == Some(shown));
                }
                prop_assert_eq!(boots.identify(&ours.report(now_ms), at(now_ms)), shown);
            }
        }

        /// An unsigned frame every 4 s that says it is the same vehicle, or another one, with any
        /// boot, clock and source.
        #[test]
        fn a_forged_frame_now_and_then_takes_nothing(
            forged in prop::collection::vec((0_u16..2, 0_u32..3, 0_u32..200_000, 0_u16..2, any::<u8>()), 5),
            is_busy in any::<bool>(),
        ) {
            let mut boots = Boots::default();
            let mut ours = Sender::new(1, 1, 0);
            let shown = boots.identify(&ours.report(100_000), at(100_000));
            let mut forged = forged.into_iter();
            for ms in (100_100..120_000).step_by(100) {
                if ms % 4_000 == 0 && let Some((uid, boot, clock_ms, source, sequence)) = forged.next() {
                    let id = boots.identify(&StatusReport { uid, boot, clock_ms, sequence, source }, at(ms));
                    if id != shown {
                        boots.note(id, is_busy);
                    }
                }
                let report = ours.report(ms);
                prop_assert_eq!(boots.identify(&report, at(ms)), shown);
                // Everything else that ours says is still taken for ours.
                prop_assert_eq!(boots.sender(report.source, (None, None, report.sequence.wrapping_add(1)), at(ms)), Some(shown));
                prop_assert_eq!(boots.settle(at(ms)), None);
            }
        }

        /// One vehicle that reboots, over a link that is late by any time up to 4 s and 0.4 s more
        /// or less, is never two, and its last boot is shown in the end.
        #[test]
        fn one_vehicle_is_never_two(
            boots_s in prop::collection::vec(5_u64..60, 1..6),
            late_ms in 0_u64..4_000,
            more_ms in prop::collection::vec(0_u64..400, 100),
            fixed in any::<bool>(),
        ) {
            let mut sent = Vec::new();
            let mut on_ms = 0;
            for (number, runs_s) in boots_s.iter().enumerate() {
                let mut vehicle = Sender::new(1, if fixed { 7 } else { number as u32 + 1 }, on_ms);
                for said_ms in (on_ms..on_ms + 1_000 * runs_s).step_by(500) {
                    let more = more_ms[sent.len() % more_ms.len()];
                    sent.push((at(said_ms + late_ms + more), vehicle.report(said_ms)));
                }
                on_ms += 1_000 * runs_s + 600;
            }
            let mut boots = Boots::default();
            for (now, report) in &sent {
                boots.identify(report, *now);
                boots.settle(*now);
                prop_assert_eq!(boots.beside(*now), vec![]);
            }
            let (now, report) = sent[sent.len() - 1];
            let last = boots.identify(&report, now);
            prop_assert_eq!(boots.shown(), Some(last));
        }
    }
}

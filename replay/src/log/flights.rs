//! Separates the flights of a log: where each begins, and whether it was recorded to its end.
//!
//! A log normally has one flight. A log joined by other tools has several, and a log cut by a tool
//! may end in the middle of its flight although every checksum is right. A flight begins with its
//! record `/computer/start`; a second one at the release belongs to it. A vehicle records until its
//! flight computer says that the flight is over; a flight that begins at its release, until it is
//! judged.

use std::collections::BTreeMap;
use std::fmt;

use avionics::log::frame::phase_of;
use flight::computer::FRAME_S;
use flight::rules::phase::Phase;
use serde::Serialize;

use super::{Clock, ClockTime, Entry, RecordingError, StampedEntry};

/// Tolerance for rounding: times are sums of periods.
const ROUNDING_S: f64 = 1e-6;

/// A flight of a log.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LoggedFlight {
    /// Frames from the release on.
    pub frames: u64,
    /// Vehicle time, s, and phase of the latest of them.
    last: Option<(f64, u32)>,
    /// The latest frame of the flight computer since power-up: its time, s, and phase.
    on_the_pad: Option<(f64, u32)>,
    /// Time of contact in the verdict, s.
    contact_s: Option<f64>,
    /// When the verdict and the latest frame were recorded, ns since the Unix epoch.
    judged_ns: Option<u64>,
    framed_ns: u64,
    /// It began with the power-up of its flight computer.
    powered_up: bool,
    /// The flight computer has said that the flight is over.
    over: bool,
}

/// Where an incomplete record of a flight ends.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Cut {
    /// Time of the last frame on its clock, s.
    pub time_s: f64,
    /// The clock: a log that ends before the release has no T+.
    pub clock: Clock,
    pub phase: &'static str,
    /// It ends before the vehicle left its pad.
    pub on_pad: bool,
    /// Time of contact in the verdict, s, if the verdict is there and only frames are missing.
    pub contact_s: Option<f64>,
    /// Contact is there, and the frames behind it are missing.
    pub after_contact: bool,
}

impl fmt::Display for Cut {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { time_s, clock, phase, on_pad, contact_s, after_contact } = self;
        let place = if *on_pad { "on the pad, " } else { "" };
        let time = ClockTime { clock: *clock, time_s: *time_s };
        write!(formatter, "ends {place}at {time} in {phase}, ")?;
        match contact_s {
            Some(_) if *after_contact => write!(formatter, "before the flight was over"),
            Some(contact_s) => write!(formatter, "before its contact at T+{contact_s:.3} s"),
            None => write!(formatter, "without a verdict"),
        }
    }
}

impl LoggedFlight {
    fn note(&mut self, time_s: f64, phase: u32) {
        self.frames += 1;
        // Frames in the file may be slightly out of order.
        if self.last.is_none_or(|(last_s, _)| last_s <= time_s) {
            self.last = Some((time_s, phase));
        }
    }

    /// Where the record ends, if that is before the end of the flight; `None` also for a flight
    /// without frames.
    pub fn cut(&self) -> Option<Cut> {
        let flown = self.last.map(|last| (last, Clock::Flight));
        let ((time_s, phase), clock) = flown.or(self.on_the_pad.map(|last| (last, Clock::Boot)))?;
        let down = self.contact_s.is_some_and(|contact_s| contact_s - time_s <= FRAME_S + ROUNDING_S);
        let ended = if self.powered_up {
            self.over && (down || self.frames == 0)
        } else {
            down && self.judged_ns.is_some_and(|judged_ns| judged_ns <= self.framed_ns)
        };
        let phase = u8::try_from(phase).ok().and_then(Phase::from_index);
        (!ended).then_some(Cut {
            time_s,
            clock,
            phase: phase.map_or("an unknown phase", Phase::name),
            on_pad: clock == Clock::Boot && phase.is_some_and(Phase::on_pad),
            contact_s: self.contact_s,
            after_contact: down,
        })
    }
}

/// Finds the frames in flight: from the release until the flight computer says that the flight is
/// over. Frames of a flight without a pad are all in flight.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct InFlight {
    /// The start of the flight was seen: at its power-up or at its release.
    started: Option<Started>,
    /// The frame of the release.
    release: Option<u64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Started {
    AtPowerUp,
    AtRelease,
}

impl InFlight {
    /// Notes a record; a frame learns its place in the flight.
    pub(super) fn place(&mut self, entry: &mut Entry) {
        match entry {
            Entry::ComputerStart(start)
                if start.released
                    && self.started == Some(Started::AtPowerUp)
                    && self.release.is_none_or(|release| release == start.frame) =>
            {
                self.release = Some(start.frame);
            }
            Entry::ComputerStart(start) => {
                let started = if start.released { Started::AtRelease } else { Started::AtPowerUp };
                let release = start.released.then_some(start.frame);
                *self = Self { started: Some(started), release };
            }
            Entry::ComputerFrame(frame) => {
                let (input, output) = (&frame.record.input, &frame.record.output);
                let phase = phase_of(output);
                // Without a start, a flight that is under way began at power-up.
                let flies = !phase.is_some_and(Phase::on_pad) && !output.released;
                let release = self.release.or((self.started.is_none() && flies).then_some(0));
                let waits = output.over && self.started == Some(Started::AtPowerUp);
                frame.since_release = release
                    .filter(|release| !waits && input.frame > *release)
                    .map(|release| input.frame - release);
                if output.released {
                    self.release = Some(input.frame);
                }
            }
            _ => {}
        }
    }
}

/// Separates flights while the records of a log are read.
#[derive(Debug, Clone, Default)]
pub struct Flights {
    /// Every flight so far, in file order.
    pub(crate) found: Vec<LoggedFlight>,
}

impl Flights {
    pub(super) fn note(&mut self, stamped: &StampedEntry) {
        match &stamped.entry {
            // If the log has frames of the pad, or the power-up, the release begins no other
            // flight.
            Entry::ComputerStart(start)
                if start.released
                    && self.found.last().is_some_and(|flight| {
                        flight.frames == 0 && (flight.powered_up || flight.on_the_pad.is_some())
                    }) => {}
            Entry::ComputerStart(start) => {
                self.found.push(LoggedFlight { powered_up: !start.released, ..LoggedFlight::default() });
            }
            Entry::ComputerFrame(frame) => {
                // The start may be lost.
                if self.found.is_empty() {
                    self.found.push(LoggedFlight::default());
                }
                let Some(flight) = self.found.last_mut() else { return };
                let phase = frame.record.output.phase;
                flight.over |= frame.record.output.over;
                flight.framed_ns = flight.framed_ns.max(stamped.log_time_ns);
                match frame.flight_time_s() {
                    Some(time_s) => flight.note(time_s, phase),
                    None => flight.on_the_pad = Some((frame.record.input.time_s, phase)),
                }
            }
            Entry::Verdict(verdict) => {
                if let Some(flight) = self.found.last_mut() {
                    flight.contact_s = Some(verdict.time_s);
                    flight.judged_ns = Some(stamped.log_time_ns);
                }
            }
            _ => {}
        }
    }

    /// Where the record ends, for the first flight that is incomplete.
    pub fn cut(&self) -> Option<Cut> {
        self.found.iter().find_map(LoggedFlight::cut)
    }

    /// How many flights have frames.
    pub fn flown(&self) -> usize {
        self.found.iter().filter(|flight| flight.frames > 0).count()
    }

    /// # Errors
    /// More than one flight has frames.
    pub(crate) fn refuse_several(&self, name: &str) -> Result<(), RecordingError> {
        match self.flown() {
            0 | 1 => Ok(()),
            flights => Err(RecordingError::SeveralFlights { name: name.to_owned(), flights }),
        }
    }
}

/// Sequence numbers of records, which show losses. MCAP leaves them to the writer: each channel has
/// its counter, or all share one, or every number is 0. Numbers are signed: those of a counter that
/// wraps in the log begin below 0.
#[derive(Debug, Clone, Default)]
pub(crate) struct Sequences {
    channels: BTreeMap<u16, Numbers>,
    last: Option<i64>,
    /// The smallest number: some writers count from 1.
    smallest: Option<i64>,
    each_has_its_counter: bool,
    /// Records that are missing, if all share a counter.
    missing: u32,
}

/// The numbers of a channel.
#[derive(Debug, Clone, Copy, Default)]
struct Numbers {
    first: i64,
    next: i64,
    /// Records of all channels that were missing by then.
    missing: u32,
    highest: i64,
    records: u64,
}

impl Sequences {
    /// Takes a record of a channel; returns how many records are missing since the last one of the
    /// channel: of it, or of all that share the counter.
    pub(crate) fn note(&mut self, channel: u16, sequence: u32) -> u32 {
        let number = i64::from(sequence.cast_signed());
        let gap_after = |expected: i64| u32::try_from(number - expected).unwrap_or(0);
        self.each_has_its_counter |= self.last.is_some_and(|last| number <= last);
        self.smallest = self.smallest.into_iter().chain([number]).min();
        let first = self.first_number();
        let of_all = self.last.map_or(first, |last| last + 1);
        self.missing = self.missing.saturating_add(gap_after(of_all));
        self.last = Some(number);
        let before = self.channels.get(&channel).copied();
        let missing_before = before.map_or(0, |before| before.missing);
        let numbers = Numbers {
            first: before.map_or(number, |before| before.first),
            next: number + 1,
            missing: self.missing,
            highest: before.map_or(number, |before| before.highest.max(number)),
            records: before.map_or(0, |before| before.records) + 1,
        };
        self.channels.insert(channel, numbers);
        if self.each_has_its_counter {
            gap_after(before.map_or(first, |before| before.next))
        } else {
            self.missing - missing_before
        }
    }

    /// The number from which the writer counts.
    fn first_number(&self) -> i64 {
        i64::from(self.smallest == Some(1))
    }

    /// The number of missing records of a channel that has its counter.
    pub(crate) fn lost_of(&self, channel: u16) -> u64 {
        let Some(Numbers { first, highest, records, .. }) = self.channels.get(&channel).copied() else {
            return 0;
        };
        // A writer without numbering leaves 0 everywhere.
        if [first, highest] == [0, 0] || self.is_shared() {
            return 0;
        }
        let numbered = highest + 1 - first.min(self.first_number());
        numbered.unsigned_abs().saturating_sub(records)
    }

    /// The number of missing records.
    pub(crate) fn lost(&self) -> u64 {
        if self.is_shared() {
            return self.missing.into();
        }
        self.channels.keys().map(|channel| self.lost_of(*channel)).sum()
    }

    fn is_shared(&self) -> bool {
        !self.each_has_its_counter && self.channels.len() > 1
    }
}

/// Checks the order of frames as they are read from the file.
#[derive(Debug, Clone, Copy, Default)]
pub struct FrameOrder {
    pub(crate) last_frame: u64,
    /// Another flight comes before this one in the log. Sequence numbers may continue or start
    /// again, so the number of the flight's first frame shows whether frames are lost.
    behind_another: bool,
}

/// The number of a flight's first frame.
const FIRST_FRAME: u64 = 1;

impl FrameOrder {
    /// The order of a flight that follows another one in the same log.
    pub fn behind_another() -> Self {
        Self { behind_another: true, ..Self::default() }
    }

    /// Takes a frame and the number of records lost before it; returns the gap before it.
    pub fn note(&mut self, frame: u64, lost_before: u32) -> Option<Gap> {
        let gap = Gap { after: self.last_frame, before: frame };
        let lost = if self.behind_another { frame > FIRST_FRAME } else { lost_before > 0 };
        self.behind_another = false;
        self.last_frame = frame;
        lost.then_some(gap)
    }
}

/// A gap between two frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Gap {
    /// The last frame before the gap.
    pub after: u64,
    /// The first frame after the gap.
    pub before: u64,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gaps(frames: &[(u64, u32)]) -> Vec<(u64, u64)> {
        let (mut order, mut sequences) = (FrameOrder::default(), Sequences::default());
        frames
            .iter()
            .filter_map(|(frame, record)| order.note(*frame, sequences.note(1, *record)))
            .map(|gap| (gap.after, gap.before))
            .collect()
    }

    /// Logs of three channels whose counters wrap after 0, 1, ... records, each its own or all one:
    /// an intact log has lost nothing, and one without its record `missing` that one.
    #[test]
    fn a_counter_that_wraps_has_lost_what_is_missing_and_nothing_else() {
        const RECORDS: u32 = 30;
        for (before_wrap, each_its_own) in
            (1..=RECORDS).flat_map(|records| [(records, true), (records, false)])
        {
            let number = |at: u32| if each_its_own { at / 3 } else { at };
            let begin = 0_u32.wrapping_sub(number(before_wrap).max(1));
            let log = |missing: Option<u32>| {
                let mut sequences = Sequences::default();
                let records = (0..RECORDS).filter(|at| Some(*at) != missing);
                let before: u32 = records
                    .map(|at| sequences.note((at % 3) as u16, begin.wrapping_add(number(at))))
                    .max()
                    .unwrap_or_default();
                (before, sequences.lost())
            };
            assert_eq!(log(None), (0, 0), "{before_wrap} {each_its_own}");
            // Nothing shows the first and the last record of a channel.
            for missing in 3..RECORDS - 3 {
                assert_eq!(log(Some(missing)), (1, 1), "{before_wrap} {each_its_own} without {missing}");
            }
        }
    }

    /// Two channels in turn, whose records count from 0 each, then together: one is lost.
    #[test]
    fn a_shared_counter_is_no_loss_and_its_gaps_are() {
        let lost = |records: &[(u16, u32)]| {
            let mut sequences = Sequences::default();
            let lost: Vec<u32> =
                records.iter().map(|(channel, number)| sequences.note(*channel, *number)).collect();
            (lost, sequences.lost())
        };
        assert_eq!(lost(&[(1, 0), (2, 0), (1, 1), (2, 1), (1, 3)]), (vec![0, 0, 0, 0, 1], 1));
        assert_eq!(lost(&[(1, 0), (2, 1), (2, 3), (1, 4), (2, 5)]), (vec![0, 0, 1, 1, 0], 1));
        assert_eq!(lost(&[(1, 0), (2, 0), (1, 0)]), (vec![0, 0, 0], 0));
        assert_eq!(lost(&[(1, 7), (1, 8)]), (vec![7, 0], 7));
        // From 1, each channel or all together; then one of a writer from 0 that lost its first.
        assert_eq!(lost(&[(1, 1), (2, 1), (1, 2), (2, 3)]), (vec![0, 0, 0, 1], 1));
        assert_eq!(lost(&[(1, 1), (2, 2), (1, 4)]), (vec![0, 0, 1], 1));
        assert_eq!(lost(&[(1, 1), (2, 0), (2, 1)]), (vec![0, 0, 0], 1));
    }

    #[test]
    fn a_restart_is_no_loss_and_a_loss_is() {
        assert_eq!(gaps(&[(1, 0), (2, 1), (52, 2), (53, 3)]), []);
        assert_eq!(gaps(&[(1, 0), (2, 1), (52, 51), (53, 52)]), [(2, 52)]);
        assert_eq!(gaps(&[(7, 6), (8, 7)]), [(0, 7)]);
        assert_eq!(gaps(&[(1, 0), (2, 0), (90, 0)]), []);
        let mut second = FrameOrder::behind_another();
        assert_eq!((second.note(1, 600), second.note(2, 0)), (None, None));
        assert!(second.note(5, 3).is_some() && FrameOrder::behind_another().note(601, 0).is_some());
        assert_eq!(gaps(&[(1, i32::MAX as u32), (2, u32::MAX), (3, 0)]), [(0, 1)]);
    }
}

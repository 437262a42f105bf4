//! The checks on the pad: the vehicle's self-check, reported value by value, and the radio range
//! test.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use protocol::dialect::{
    RADIO_STATUS_DATA, TD_PAD_CHECK_DATA, TdPadCheckItem, TdPadCheckState, TdPadCheckVerdict,
};
use protocol::link_stats::FrameCounts;

use super::{Acknowledgement, CommandKind, Model, Seat, words};

/// How long a requested check may run without a received answer or end. One with motion takes 13 s,
/// and 40 s if people watch the surfaces.
const LONGEST: Duration = Duration::from_secs(50);
/// What the vehicle reported before it had a command may arrive so much later than the command was
/// given.
const LATE: Duration = Duration::from_secs(3);
/// A second press of the key this soon after the end of a check was intended to end it, not to
/// begin another.
const JUST_ENDED: Duration = Duration::from_secs(3);

/// The surfaces in the order in which a check moves them, the number of the first item of each, and
/// what people see. Fins have their numbers painted on: seen from the nose they count
/// counter-clockwise (docs/build-mk3.md, Axes and signs).
pub const SURFACES: [(&str, u32, &str); 6] = [
    ("gimbal pitch", 0, "nozzle swings towards fins 1 and 4, then towards 2 and 3"),
    ("gimbal yaw", 3, "nozzle swings towards fins 1 and 2, then towards 3 and 4"),
    ("fin 1", 6, "fin 1 alone opens fully, then closes"),
    ("fin 2", 9, "fin 2 alone opens fully, then closes"),
    ("fin 3", 12, "fin 3 alone opens fully, then closes"),
    ("fin 4", 15, "fin 4 alone opens fully, then closes"),
];

/// State of a check, as far as this station has received it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Standing {
    /// The vehicle reports that it runs.
    Runs,
    /// It was requested; the outcome has not arrived.
    MayRun,
    /// It ended a moment ago.
    JustEnded,
    /// None runs.
    Rests,
}

/// The state of a vehicle's check.
pub fn standing(model: &Model, now: Duration) -> Standing {
    let report = model.vehicle.pad_check.as_ref();
    let requested = [CommandKind::Check, CommandKind::CheckStill].map(|kind| model.commands.of(kind));
    let ended = model.commands.of(CommandKind::EndCheck).filter(|end| end.accepted());
    let may_run = requested.into_iter().flatten().any(|track| {
        let is_refused = matches!(track.acknowledged, Acknowledgement::Answered(_)) && !track.accepted();
        let is_reported = report.is_some_and(|report| report.reported_at > track.commanded_at + LATE);
        let is_ended = ended.is_some_and(|end| end.commanded_at > track.commanded_at);
        !is_refused && !is_reported && !is_ended && now.saturating_sub(track.commanded_at) < LONGEST
    });
    match report.and_then(|report| report.ended_at) {
        _ if report.is_some_and(PadCheck::is_running) => Standing::Runs,
        _ if may_run => Standing::MayRun,
        Some(at) if now.saturating_sub(at) < JUST_ENDED => Standing::JustEnded,
        _ => Standing::Rests,
    }
}

/// A check, as far as its messages have arrived.
#[derive(Debug, Clone, PartialEq)]
pub struct PadCheck {
    /// The vehicle's last report. Its value may be one of [`Self::values`] too.
    pub report: TD_PAD_CHECK_DATA,
    /// When the vehicle last reported it.
    pub reported_at: Duration,
    /// When the first report of its end arrived, after a report that it runs.
    pub ended_at: Option<Duration>,
    /// The values that have arrived, by their place. No limit is NaN.
    values: BTreeMap<u8, TD_PAD_CHECK_DATA>,
}

impl PadCheck {
    /// This check with another report. Another number is another check.
    pub(crate) fn with(before: Option<Self>, report: &TD_PAD_CHECK_DATA, now: Duration) -> Self {
        let before = before.filter(|before| before.report.run == report.run);
        let runs = report.state == TdPadCheckState::TD_PAD_CHECK_STATE_RUNNING;
        let ended_at = before
            .as_ref()
            .and_then(|before| if before.is_running() && !runs { Some(now) } else { before.ended_at });
        let mut values = before.map_or_else(BTreeMap::new, |before| before.values);
        if report.place < report.found {
            values.insert(report.place, report.clone());
        }
        Self { report: report.clone(), reported_at: now, ended_at, values }
    }

    pub fn is_running(&self) -> bool {
        self.report.state == TdPadCheckState::TD_PAD_CHECK_STATE_RUNNING
    }

    /// Whether it moved surfaces without feedback, and every other value is in order: people
    /// confirm what they saw.
    pub fn awaits_eyes(&self) -> bool {
        let verdict = |item: TdPadCheckItem| self.of(item).map(|value| value.verdict);
        self.report.state == TdPadCheckState::TD_PAD_CHECK_STATE_PASSED
            && verdict(TdPadCheckItem::TD_PAD_CHECK_ITEM_FIN_1_RANGE)
                == Some(TdPadCheckVerdict::TD_PAD_CHECK_VERDICT_NOT_JUDGED)
    }

    /// Whether it is over, and every value that it found has arrived.
    pub fn is_complete(&self) -> bool {
        !self.is_running() && self.values.len() == usize::from(self.report.found)
    }

    /// Whether it ran to its end, and every value has arrived.
    pub fn is_judged(&self) -> bool {
        let stopped = self.report.state == TdPadCheckState::TD_PAD_CHECK_STATE_STOPPED;
        self.report.found > 0 && !stopped && self.is_complete()
    }

    /// What has arrived, in the order in which it was found.
    pub fn values(&self) -> impl Iterator<Item = &TD_PAD_CHECK_DATA> {
        self.values.values()
    }

    /// The value of an item, if it has arrived.
    pub fn of(&self, item: TdPadCheckItem) -> Option<&TD_PAD_CHECK_DATA> {
        self.values().find(|value| value.item == item)
    }

    /// That the check has failed, and what is outside, if it has.
    pub fn failure(&self) -> Option<String> {
        let names: Vec<String> = self.failing().map(|value| shown(value).0).collect();
        let outside = if names.is_empty() { String::new() } else { format!(": {}", names.join(", ")) };
        (self.report.state == TdPadCheckState::TD_PAD_CHECK_STATE_FAILED)
            .then(|| format!("CHECK FAILED{outside}"))
    }

    /// The values outside their limits.
    pub fn failing(&self) -> impl Iterator<Item = &TD_PAD_CHECK_DATA> {
        self.values().filter(|value| value.verdict == TdPadCheckVerdict::TD_PAD_CHECK_VERDICT_NOT_OK)
    }
}

/// Name and unit for the screen, and how to convert a number of the wire's unit to it.
pub fn shown(value: &TD_PAD_CHECK_DATA) -> (String, &'static str, impl Fn(f32) -> String) {
    use TdPadCheckItem as I;
    const DEG: f64 = 180.0 / std::f64::consts::PI;
    const MIB: f64 = 1.0 / (1024.0 * 1024.0);
    let (unit, factor, decimals) = match value.item {
        item if (item as u32) < 18 && item as u32 % 3 == 2 => ("ms", 1e3, 0),
        item if (item as u32) < 18 => ("deg", DEG, 1),
        I::TD_PAD_CHECK_ITEM_RAIL_LEAN => ("deg", DEG, 1),
        I::TD_PAD_CHECK_ITEM_GYRO_BIAS | I::TD_PAD_CHECK_ITEM_GYRO_NOISE => ("deg/s", DEG, 2),
        I::TD_PAD_CHECK_ITEM_GRAVITY => ("m/s2", 1.0, 2),
        I::TD_PAD_CHECK_ITEM_ACCELEROMETER_NOISE => ("m/s2", 1.0, 3),
        I::TD_PAD_CHECK_ITEM_BAROMETER_NOISE | I::TD_PAD_CHECK_ITEM_LIDAR_RANGE => ("m", 1.0, 2),
        I::TD_PAD_CHECK_ITEM_GNSS_SPEED => ("m/s", 1.0, 2),
        I::TD_PAD_CHECK_ITEM_BATTERY_VOLTAGE | I::TD_PAD_CHECK_ITEM_SERVO_BATTERY_VOLTAGE => ("V", 1.0, 2),
        I::TD_PAD_CHECK_ITEM_LOG_SPACE => ("MiB", MIB, 0),
        _ => ("", 1.0, 0),
    };
    // Short enough for a column of the smallest screen.
    let name = match value.item {
        I::TD_PAD_CHECK_ITEM_ACCELEROMETER_NOISE => "accel noise".to_owned(),
        I::TD_PAD_CHECK_ITEM_BAROMETER_NOISE => "baro noise".to_owned(),
        I::TD_PAD_CHECK_ITEM_IGNITER_CONTINUITY => "igniter wire".to_owned(),
        I::TD_PAD_CHECK_ITEM_BATTERY_VOLTAGE => "battery".to_owned(),
        I::TD_PAD_CHECK_ITEM_SERVO_BATTERY_VOLTAGE => "servo batt.".to_owned(),
        I::TD_PAD_CHECK_ITEM_GNSS_FIXES => "GNSS fixes".to_owned(),
        I::TD_PAD_CHECK_ITEM_GNSS_SPEED => "GNSS speed".to_owned(),
        item => words::lower_case(&item, "TD_PAD_CHECK_ITEM_"),
    };
    (name, unit, move |number: f32| words::fixed(factor * f64::from(number), decimals))
}

// The radio range test: how much is lost both ways, and how far the signal is above the noise. It
// requests the vehicle's time five times a second and counts the answers, and the gaps in the
// vehicle's frames. It sends no command.

/// Duration of the requests. With 150 of them a loss of 5 % is measured to 3.5 percentage points
/// (95 %).
pub const QUERIES_FOR: Duration = Duration::from_secs(30);
pub const QUERY_INTERVAL: Duration = Duration::from_millis(200);
/// Then it waits for the last answers: a slow radio with a full queue takes a second.
pub const WAITS_FOR: Duration = Duration::from_secs(2);

/// Most loss either way that passes. Without a margin to show, a link that loses every twentieth
/// frame on the ground is at its end; one that does not loses nearly none.
pub const LOSS_MOST: f64 = 0.05;
/// Least signal above the noise that passes, dB: a tenth of the power may be lost to a turning
/// antenna, a hand or wet grass. In free space 6 dB more carry twice as far, 20 dB ten times.
pub const MARGIN_LEAST_DB: f64 = 10.0;
/// Steps of a SiK radio's RSSI in 1 dB: its manual gives RSSI = 1.9 (dBm + 127).
const STEPS_PER_DB: f64 = 1.9;

/// Signal strength at 0 steps, dBm, by the same manual.
const RSSI_ZERO_DBM: f64 = -127.0;

/// Received signal strength, dBm, at the weaker end; `None` if the radio does not report it.
pub fn rssi_dbm(radio: &RADIO_STATUS_DATA) -> Option<f64> {
    let steps = [radio.rssi, radio.remrssi].into_iter().filter(|steps| *steps != u8::MAX).min()?;
    Some(RSSI_ZERO_DBM + f64::from(steps) / STEPS_PER_DB)
}

/// Signal over noise, dB, at the worse end; `None` if the radio does not report it.
pub fn margin_db(radio: &RADIO_STATUS_DATA) -> Option<f64> {
    let known = |signal: u8, noise: u8| {
        let is_reported = signal != u8::MAX && noise != u8::MAX;
        is_reported.then(|| (f64::from(signal) - f64::from(noise)) / STEPS_PER_DB)
    };
    let (here, there) = (known(radio.rssi, radio.noise), known(radio.remrssi, radio.remnoise));
    here.into_iter().chain(there).reduce(f64::min)
}

/// What a test came to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RangeTestResult {
    /// Share of the vehicle's frames that did not arrive here.
    pub loss_down: f64,
    /// Share of the questions that did not arrive at the vehicle.
    pub loss_up: f64,
    /// The least that the radio reported in this time; `None` if it reported nothing.
    pub margin_db: Option<f64>,
    /// It was cut short by this.
    pub stopped: Option<&'static str>,
}

impl RangeTestResult {
    pub fn passed(&self) -> bool {
        self.stopped.is_none()
            && self.loss_down <= LOSS_MOST
            && self.loss_up <= LOSS_MOST
            && self.margin_db.is_none_or(|margin_db| margin_db >= MARGIN_LEAST_DB)
    }

    /// The verdict, as for the events and the book.
    pub fn words(&self) -> String {
        let verdict = match (self.stopped, self.passed()) {
            (Some(why), _) => format!("STOPPED, {why}"),
            (None, true) => "PASSED".to_owned(),
            (None, false) => "FAILED".to_owned(),
        };
        let margin = match self.margin_db {
            Some(margin_db) => format!("margin {margin_db:.1} dB (at least {MARGIN_LEAST_DB:.0})"),
            None => "margin not known: the radio reports none".to_owned(),
        };
        let percent = |share: f64| format!("{:.1} %", 100.0 * share);
        format!(
            "radio range test {verdict}: loss down {}, up {} (at most {:.0} %), {margin}",
            percent(self.loss_down),
            percent(self.loss_up),
            100.0 * LOSS_MOST
        )
    }
}

/// A running or a finished test.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RangeTest {
    pub by: Seat,
    pub began_at: Duration,
    pub found: Option<RangeTestResult>,
    counts_before: FrameCounts,
    counts: FrameCounts,
    queries: u32,
    answered: u32,
    /// Requests without an answer, by their time stamps, ns.
    open: BTreeSet<i64>,
    due_at: Duration,
    margin_db: Option<f64>,
}

impl RangeTest {
    pub(crate) fn begin(by: Seat, counts: FrameCounts, now: Duration) -> Self {
        Self { by, began_at: now, counts_before: counts, counts, due_at: now, ..Self::default() }
    }

    pub fn is_running(&self) -> bool {
        self.found.is_none()
    }

    pub fn left(&self, now: Duration) -> Duration {
        (self.began_at + QUERIES_FOR + WAITS_FOR).saturating_sub(now)
    }

    /// What has been found so far.
    pub fn so_far(&self, stopped: Option<&'static str>) -> RangeTestResult {
        let (arrived, lost) = (
            self.counts.arrived.saturating_sub(self.counts_before.arrived),
            self.counts.lost.saturating_sub(self.counts_before.lost),
        );
        let share = |part: f64, whole: f64| if whole > 0.0 { part / whole } else { 1.0 };
        let loss_down = share(lost as f64, (arrived + lost) as f64);
        // An answer takes both directions: the share lost on the downlink is not the uplink's. If
        // the downlink loses all of them, the uplink's loss is unknown, which is no pass.
        let (answered, could_arrive) =
            (f64::from(self.answered), f64::from(self.queries) * (1.0 - loss_down));
        let loss_up = if could_arrive > 0.0 { (1.0 - answered / could_arrive).max(0.0) } else { 1.0 };
        RangeTestResult { loss_down, loss_up, margin_db: self.margin_db, stopped }
    }

    /// Lets time pass. Returns the time stamp of a request to send now, ns.
    pub(crate) fn pass(&mut self, counts: FrameCounts, now: Duration) -> Option<i64> {
        if self.is_running() {
            self.counts = counts;
        }
        if self.is_running() && self.left(now).is_zero() {
            self.found = Some(self.so_far(None));
        }
        let is_due = self.is_running() && now < self.began_at + QUERIES_FOR && now >= self.due_at;
        if !is_due {
            return None;
        }
        self.due_at = (self.due_at + QUERY_INTERVAL).max(now);
        let stamp = i64::try_from(now.as_nanos()).ok()?;
        self.queries += 1;
        self.open.insert(stamp);
        Some(stamp)
    }

    /// The vehicle has answered the request with this time stamp, ns.
    pub(crate) fn answered(&mut self, stamp: i64) {
        if self.is_running() && self.open.remove(&stamp) {
            self.answered += 1;
        }
    }

    pub(crate) fn note_radio(&mut self, radio: &RADIO_STATUS_DATA) {
        if self.is_running() {
            self.margin_db = self.margin_db.into_iter().chain(margin_db(radio)).reduce(f64::min);
        }
    }

    pub(crate) fn stop(&mut self, why: &'static str) {
        if self.is_running() {
            self.found = Some(self.so_far(Some(why)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn radio(rssi: u8, noise: u8, remrssi: u8, remnoise: u8) -> RADIO_STATUS_DATA {
        RADIO_STATUS_DATA { rssi, noise, remrssi, remnoise, ..RADIO_STATUS_DATA::default() }
    }

    /// A test over a link that loses one of so many down, and answers one of so many not.
    fn tested(lost_of: u64, unanswered_of: u64, margins: &[RADIO_STATUS_DATA]) -> RangeTestResult {
        let counts = |n: u64| FrameCounts {
            arrived: 1_000 + n * 10,
            lost: 7 + (n * 10).checked_div(lost_of).unwrap_or(0),
        };
        let mut test = RangeTest::begin(Seat::default(), counts(0), Duration::from_secs(100));
        for report in margins {
            test.note_radio(report);
        }
        let mut questions = 0;
        for tick in 0..400_u64 {
            let now = Duration::from_secs(100) + Duration::from_millis(100 * tick);
            if let Some(stamp) = test.pass(counts(tick), now) {
                questions += 1;
                if unanswered_of == 0 || questions % unanswered_of != 0 {
                    test.answered(stamp);
                    test.answered(stamp);
                }
            }
        }
        assert_eq!(questions, 150);
        test.found.unwrap()
    }

    #[test]
    fn the_margin_is_that_of_the_worse_end_in_decibels() {
        assert_eq!(margin_db(&radio(100, 62, 81, 62)), Some(10.0));
        assert_eq!(margin_db(&radio(81, 62, 100, 62)), Some(10.0));
        assert_eq!(margin_db(&radio(255, 62, 100, 62)), Some(20.0));
        assert_eq!(margin_db(&radio(255, 62, 100, 255)), None);
        assert_eq!(margin_db(&radio(43, 62, 255, 255)), Some(-10.0));
    }

    #[test]
    fn each_limit_alone_fails_the_test() {
        let good = radio(100, 40, 100, 40);
        assert!(tested(0, 0, std::slice::from_ref(&good)).passed());
        assert!(tested(0, 0, &[]).passed(), "a link that is no radio has no margin");
        assert!(tested(25, 25, std::slice::from_ref(&good)).passed());
        let down = tested(15, 0, std::slice::from_ref(&good));
        assert!(!down.passed() && down.loss_down > LOSS_MOST, "{down:?}");
        let up = tested(0, 15, std::slice::from_ref(&good));
        assert!(!up.passed() && up.loss_up > LOSS_MOST && up.loss_down <= 0.0, "{up:?}");
        // The worst of all reports counts.
        let weak = tested(0, 0, &[good.clone(), radio(58, 40, 100, 40), good]);
        assert!(!weak.passed());
        assert_eq!(weak.margin_db, Some(18.0 / STEPS_PER_DB), "9.5 dB, and 10 are needed");
    }

    #[test]
    fn a_silent_vehicle_has_lost_everything_and_a_stop_is_no_pass() {
        let silent = FrameCounts::default();
        let mut test = RangeTest::begin(Seat::default(), silent, Duration::ZERO);
        for second in 0..40 {
            test.pass(silent, Duration::from_secs(second));
        }
        let found = test.found.unwrap();
        assert!(!found.passed() && found.loss_up >= 1.0 && found.loss_down >= 1.0, "{found:?}");
        let mut test = RangeTest::begin(Seat::default(), silent, Duration::ZERO);
        test.stop("the vehicle is armed");
        let found = test.found.unwrap();
        assert_eq!((found.stopped, found.passed()), (Some("the vehicle is armed"), false));
    }

    proptest! {
        #[test]
        fn every_share_is_one(arrived: u32, lost: u32, answered in 0..200_u32, queries in 0..200_u32) {
            let mut test = RangeTest::begin(Seat::default(), FrameCounts::default(), Duration::ZERO);
            test.counts = FrameCounts { arrived: arrived.into(), lost: lost.into() };
            (test.queries, test.answered) = (queries, answered.min(queries));
            let found = test.so_far(None);
            prop_assert!((0.0..=1.0).contains(&found.loss_down) && (0.0..=1.0).contains(&found.loss_up));
        }
    }
}

//! The last check of the vehicle on its pad, as it tells it value by value.

use std::collections::BTreeMap;
use std::time::Duration;

use protocol::dialect::{TD_PAD_CHECK_DATA, TdPadCheckItem, TdPadCheckState, TdPadCheckVerdict};

use super::Model;
use super::command::{Acknowledgement, CommandKind};

/// A check with motion takes 13 s. If neither answer nor end of one that was asked for is heard, it may run for so long.
const LONGEST: Duration = Duration::from_secs(20);
/// What the vehicle told before it knew of a command may arrive so much later than the command was given.
const LATE: Duration = Duration::from_secs(3);
/// Whoever presses the key again to end a check that has just ended does not want another one.
const JUST_ENDED: Duration = Duration::from_secs(3);

/// How a check stands, as far as this station can know.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Standing {
    /// The vehicle says that it runs.
    Runs,
    /// It was asked for; what came of it is not known.
    MayRun,
    /// It ended a moment ago.
    JustEnded,
    /// None runs.
    Rests,
}

/// How the check of a vehicle stands.
pub fn standing(model: &Model, now: Duration) -> Standing {
    let told = model.vehicle.pad_check.as_ref();
    if told.is_some_and(PadCheck::is_running) {
        return Standing::Runs;
    }
    let asked = [CommandKind::Check, CommandKind::CheckStill].map(|kind| model.commands.of(kind));
    let ended = model.commands.of(CommandKind::EndCheck).filter(|end| end.accepted());
    let may_run = asked.into_iter().flatten().any(|asked| {
        let is_refused = matches!(asked.acknowledged, Acknowledgement::Answered(_)) && !asked.accepted();
        let is_told = told.is_some_and(|told| told.told_at > asked.commanded_at + LATE);
        let is_ended = ended.is_some_and(|end| end.commanded_at > asked.commanded_at);
        !is_refused && !is_told && !is_ended && now.saturating_sub(asked.commanded_at) < LONGEST
    });
    if may_run {
        return Standing::MayRun;
    }
    match told.and_then(|told| told.ended_at) {
        Some(at) if now.saturating_sub(at) < JUST_ENDED => Standing::JustEnded,
        _ => Standing::Rests,
    }
}

/// One value, in the unit of its item; no limit is NaN.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CheckedValue {
    pub item: TdPadCheckItem,
    pub value: f64,
    pub least: f64,
    pub most: f64,
    pub verdict: TdPadCheckVerdict,
}

#[derive(Debug, Clone, PartialEq)]
pub struct PadCheck {
    /// Its number since the vehicle's power-up.
    pub run: u16,
    pub state: TdPadCheckState,
    /// How much is done, percent.
    pub progress: u8,
    /// How many values the vehicle has found; not all of them may have arrived.
    pub found: u8,
    /// The key of whoever asked for it; 0 without operators.
    pub asked_by: u8,
    /// When the vehicle last told of it.
    pub told_at: Duration,
    /// When the vehicle was first heard to say that it is over, after it was heard to run.
    pub ended_at: Option<Duration>,
    /// Those that have arrived, by their place.
    values: BTreeMap<u8, CheckedValue>,
}

impl PadCheck {
    /// This check with what the vehicle tells now. Another number is another check.
    pub(crate) fn with(before: Option<Self>, told: &TD_PAD_CHECK_DATA, now: Duration) -> Self {
        let before = before.filter(|before| before.run == told.run);
        let runs = told.state == TdPadCheckState::TD_PAD_CHECK_STATE_RUNNING;
        let ended_at = match &before {
            Some(before) if before.is_running() && !runs => Some(now),
            Some(before) => before.ended_at,
            None => None,
        };
        let mut values = before.map_or_else(BTreeMap::new, |before| before.values);
        if told.place < told.found {
            let value = CheckedValue {
                item: told.item,
                value: told.value.into(),
                least: told.least.into(),
                most: told.most.into(),
                verdict: told.verdict,
            };
            values.insert(told.place, value);
        }
        Self {
            run: told.run,
            state: told.state,
            progress: told.progress,
            found: told.found,
            asked_by: told.asked_by,
            told_at: now,
            ended_at,
            values,
        }
    }

    pub fn is_running(&self) -> bool {
        self.state == TdPadCheckState::TD_PAD_CHECK_STATE_RUNNING
    }

    /// Whether it is over, and every value that it found has arrived.
    pub fn is_whole(&self) -> bool {
        !self.is_running() && self.values.len() == usize::from(self.found)
    }

    /// Whether it has seen everything, and every value has arrived.
    pub fn is_judged(&self) -> bool {
        let stopped = self.state == TdPadCheckState::TD_PAD_CHECK_STATE_STOPPED;
        self.found > 0 && !stopped && self.is_whole()
    }

    /// What has arrived, in the order in which it was found.
    pub fn values(&self) -> impl Iterator<Item = &CheckedValue> {
        self.values.values()
    }

    /// The value of an item, if it has arrived.
    pub fn of(&self, item: TdPadCheckItem) -> Option<&CheckedValue> {
        self.values().find(|value| value.item == item)
    }

    /// That the check has failed, and what is outside, if it has.
    pub fn failure(&self) -> Option<String> {
        let names: Vec<String> = self.failing().map(|value| value.shown().0).collect();
        let outside = if names.is_empty() { String::new() } else { format!(": {}", names.join(", ")) };
        (self.state == TdPadCheckState::TD_PAD_CHECK_STATE_FAILED).then(|| format!("CHECK FAILED{outside}"))
    }

    /// The values outside their limits.
    pub fn failing(&self) -> impl Iterator<Item = &CheckedValue> {
        self.values().filter(|value| value.verdict == TdPadCheckVerdict::TD_PAD_CHECK_VERDICT_NOT_OK)
    }
}

impl CheckedValue {
    /// Name, unit, factor from the wire's unit, and decimals, for the screen.
    pub fn shown(&self) -> (String, &'static str, f64, usize) {
        use TdPadCheckItem as I;
        const DEG: f64 = 180.0 / std::f64::consts::PI;
        const MIB: f64 = 1.0 / (1024.0 * 1024.0);
        let (unit, factor, decimals) = match self.item {
            item if (item as u32) < 18 && item as u32 % 3 == 2 => ("ms", 1e3, 0),
            item if (item as u32) < 18 => ("deg", DEG, 1),
            I::TD_PAD_CHECK_ITEM_GYRO_BIAS | I::TD_PAD_CHECK_ITEM_GYRO_NOISE => ("deg/s", DEG, 2),
            I::TD_PAD_CHECK_ITEM_GRAVITY => ("m/s2", 1.0, 2),
            I::TD_PAD_CHECK_ITEM_ACCELEROMETER_NOISE => ("m/s2", 1.0, 3),
            I::TD_PAD_CHECK_ITEM_BAROMETER_NOISE | I::TD_PAD_CHECK_ITEM_LIDAR_RANGE => ("m", 1.0, 2),
            I::TD_PAD_CHECK_ITEM_GNSS_SPEED => ("m/s", 1.0, 2),
            I::TD_PAD_CHECK_ITEM_BATTERY_VOLTAGE => ("V", 1.0, 2),
            I::TD_PAD_CHECK_ITEM_LOG_SPACE => ("MiB", MIB, 0),
            _ => ("", 1.0, 0),
        };
        // Short enough for a column of the smallest screen.
        let name = match self.item {
            I::TD_PAD_CHECK_ITEM_ACCELEROMETER_NOISE => "accel noise".to_owned(),
            I::TD_PAD_CHECK_ITEM_BAROMETER_NOISE => "baro noise".to_owned(),
            I::TD_PAD_CHECK_ITEM_IGNITER_CONTINUITY => "igniter wire".to_owned(),
            I::TD_PAD_CHECK_ITEM_BATTERY_VOLTAGE => "battery".to_owned(),
            I::TD_PAD_CHECK_ITEM_GNSS_FIXES => "GNSS fixes".to_owned(),
            I::TD_PAD_CHECK_ITEM_GNSS_SPEED => "GNSS speed".to_owned(),
            item => super::words::lower_case(&item, "TD_PAD_CHECK_ITEM_"),
        };
        (name, unit, factor, decimals)
    }
}

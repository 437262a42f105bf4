//! Alarms: a condition raises them, and the bell rings until a person acknowledges them. Also:
//! callouts.

use std::time::Duration;

use clap::ValueEnum;
use protocol::dialect::TdPhase;
use serde::{Deserialize, Serialize};

use super::CommandKind;

/// Interval at which an unacknowledged alarm rings again.
pub const RING_EVERY: Duration = Duration::from_secs(4);

/// What an alarm is about. There is at most one alarm of each kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum AlarmKind {
    LinkLost,
    /// A screen that commands nothing was given a command.
    NothingSent,
    /// The vehicle does not receive this station.
    UplinkLost,
    /// Frames are refused for their signature, and no other data arrive from the vehicle.
    Signatures,
    /// The transport does not work.
    LinkDown,
    /// An attached screen receives no more data. The station itself never raises this alarm.
    StationSilent,
    /// Two vehicles send under the vehicle's id.
    TwoVehicles,
    /// Another station uses our id.
    SameId,
    /// A station that may not be of this crew has armed the vehicle or started its countdown.
    OtherStation(CommandKind),
    /// The vehicle has another autopilot.
    Foreign,
    /// The vehicle acknowledged the command, but its own state does not show the effect.
    Disagreement(CommandKind),
    /// The command was sent repeatedly and not answered.
    Unanswered(CommandKind),
    Refused(CommandKind),
    /// The vehicle has latched an abort, or inhibited its landing motor permanently.
    Aborted,
    /// The landing motor was fired and did not ignite.
    NoLight,
    /// The upright stabiliser flies instead of the landing controller.
    Degraded,
    /// The controller did not answer in time.
    DeadlineMissed,
    /// Under thrust, the current plan ends outside a limit.
    PlanOutside,
    /// The flight did not end with a landing.
    NotLanded,
    /// The crowd line crosses the fence of the mission.
    CrowdLine,
    /// The vehicle has rebooted.
    Rebooted,
    /// Recording has failed, or records are lost.
    Log,
    /// The motor may still ignite.
    LiveMotor,
    Held,
    /// The vehicle's battery is low.
    Battery,
    /// In flight or after it, the vehicle has no satellite fix or no valid position.
    Position,
    /// The vehicle does not write its log, or has no room for it.
    VehicleLog,
    /// The last check on the pad found something outside its limit.
    CheckFailed,
    /// It is armed, and an arming check fails.
    Unfit,
    /// The countdown has reached zero while no telemetry arrived.
    MayBeFlying,
    /// An abort requested in an earlier run of the station was not confirmed.
    AbortBefore,
}

/// What holds now.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Condition {
    pub kind: AlarmKind,
    /// The more urgent of two alarms hides the other.
    pub urgency: u8,
    /// Whether it belongs to one boot of the vehicle and ends with it.
    pub ends_with_boot: bool,
    /// The text for a person; safe to print on a terminal.
    pub text: String,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Alarm {
    /// What holds, or held.
    pub what: Condition,
    /// When it was last raised, since the start of the run.
    pub raised_at: Duration,
    /// When its condition ended; `None` while it holds.
    pub ended_at: Option<Duration>,
    /// Whether a person has seen it.
    pub acknowledged: bool,
    /// It ended before this screen was attached: it is listed, but the bell does not ring for it.
    pub past: bool,
}

impl Alarm {
    pub fn is_active(&self) -> bool {
        self.ended_at.is_none()
    }
}

/// The active and the unacknowledged alarms, oldest first.
#[derive(Debug, Default)]
pub struct Alarms {
    list: Vec<Alarm>,
    /// Whether the received messages are still history: no bell rings until a screen has all of it.
    pub(crate) in_history: bool,
    rung_at: Option<Duration>,
}

impl Alarms {
    /// The history has been received. Alarms that ended in it are past; alarms that still hold
    /// ring.
    pub fn history_ends(&mut self) {
        if std::mem::take(&mut self.in_history) {
            for alarm in &mut self.list {
                alarm.past = !alarm.is_active();
            }
            self.rung_at = None;
        }
    }

    pub fn list(&self) -> &[Alarm] {
        &self.list
    }

    /// The foremost alarm: unacknowledged before acknowledged (past ones last), then active before
    /// ended, then by urgency, then the newest.
    pub fn foremost(&self) -> Option<&Alarm> {
        self.list.iter().max_by_key(|alarm| {
            let unseen = if alarm.acknowledged { 0 } else { 2 - u8::from(alarm.past) };
            (unseen, alarm.is_active(), alarm.what.urgency, alarm.raised_at)
        })
    }

    /// Whether an unacknowledged alarm of this kind exists.
    pub fn is_unseen(&self, kind: AlarmKind) -> bool {
        self.list.iter().any(|alarm| alarm.what.kind == kind && !alarm.acknowledged)
    }

    /// Number of unacknowledged alarms.
    pub fn unacknowledged(&self) -> usize {
        self.list.iter().filter(|alarm| !alarm.acknowledged).count()
    }

    /// Takes the conditions that hold now and returns the alarms that they raise. A condition that
    /// returns raises a new alarm with a new age, which must be acknowledged again.
    pub(crate) fn watch(&mut self, now: Duration, conditions: Vec<Condition>) -> Vec<Alarm> {
        for alarm in &mut self.list {
            if !conditions.iter().any(|condition| condition.kind == alarm.what.kind) {
                alarm.ended_at.get_or_insert(now);
            }
        }
        let mut raised = Vec::new();
        for what in conditions {
            match self.list.iter_mut().find(|alarm| alarm.what.kind == what.kind) {
                Some(present) if present.is_active() => present.what.text = what.text,
                present => {
                    let alarm =
                        Alarm { what, raised_at: now, ended_at: None, acknowledged: false, past: false };
                    raised.push(alarm.clone());
                    match present {
                        Some(present) => *present = alarm,
                        None => self.list.push(alarm),
                    }
                }
            }
        }
        self.list.sort_by_key(|alarm| alarm.raised_at);
        self.forget_seen();
        raised
    }

    /// The vehicle has rebooted: alarms about the previous boot have ended.
    pub(crate) fn vehicle_rebooted(&mut self, now: Duration) {
        for alarm in self.list.iter_mut().filter(|alarm| alarm.what.ends_with_boot) {
            alarm.ended_at.get_or_insert(now);
        }
        self.forget_seen();
    }

    /// Marks an alarm as seen. Returns its text if it was not marked before.
    pub(crate) fn acknowledge(&mut self, kind: AlarmKind) -> Option<String> {
        let new = self.list.iter_mut().find(|alarm| alarm.what.kind == kind && !alarm.acknowledged)?;
        new.acknowledged = true;
        let text = new.what.text.clone();
        self.forget_seen();
        if self.unacknowledged() == 0 {
            self.rung_at = None;
        }
        Some(text)
    }

    fn forget_seen(&mut self) {
        self.list.retain(|alarm| alarm.is_active() || !alarm.acknowledged);
    }

    /// Whether to ring the bell now. Returning `true` counts as ringing it.
    pub(crate) fn rings(&mut self, now: Duration, raised: bool) -> bool {
        let again = self.rung_at.is_none_or(|at| now.saturating_sub(at) >= RING_EVERY);
        let open = self.list.iter().any(|alarm| !alarm.acknowledged && !alarm.past);
        let rings = open && !self.in_history && (raised || again);
        if rings {
            self.rung_at = Some(now);
        }
        rings
    }
}

// Callouts: the last ones made, the amount that the crew wants, and the bells still to ring.

/// How much is called out.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Deserialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Amount {
    /// Neither voice nor bells, except those of alarms
    Nothing,
    /// Liftoff, apogee, ignition, touchdown, verdict, parachute, NO-GO and a lost link
    Few,
    /// Also phases and every 50 m
    #[default]
    Normal,
    /// Also every 10 m below 50 m
    All,
}

/// The crew's settings for callouts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Talk {
    pub amount: Amount,
    /// The least time between two heights; other callouts never wait.
    pub height_every: Duration,
    /// Whether a command speaks; without one, bells ring.
    pub has_voice: bool,
}

impl Default for Talk {
    fn default() -> Self {
        Self { amount: Amount::default(), height_every: Duration::from_millis(1_500), has_voice: false }
    }
}

/// What has been called out.
#[derive(Debug, Clone, Default)]
pub struct Called {
    pub(crate) phase: Option<TdPhase>,
    pub(crate) height_m: Option<f64>,
    pub(crate) height_at: Option<Duration>,
    pub(crate) way_at: Option<Duration>,
    /// The last callout of each other row.
    pub(crate) rows: [Option<String>; 5],
    pub(crate) bells_left: u8,
}

#[cfg(test)]
mod tests {
    use super::*;

    const S: fn(u64) -> Duration = Duration::from_secs;

    fn condition(kind: AlarmKind, urgency: u8) -> Condition {
        Condition { kind, urgency, ends_with_boot: kind == AlarmKind::Aborted, text: "ALARM".to_owned() }
    }

    fn lost() -> Vec<Condition> {
        vec![condition(AlarmKind::LinkLost, 1)]
    }

    /// The link that is lost later hides neither an abort that does not work nor a station that is
    /// gone.
    #[test]
    fn the_most_urgent_alarm_is_foremost_and_of_equal_ones_the_newest() {
        let unsent = condition(AlarmKind::Unanswered(CommandKind::Abort), 3);
        let gone = condition(AlarmKind::StationSilent, 2);
        let low = condition(AlarmKind::Battery, 0);
        let foremost = |alarms: &Alarms| alarms.foremost().map(|alarm| alarm.what.kind);
        let mut alarms = Alarms::default();
        let mut conditions = vec![unsent, gone];
        alarms.watch(S(1), conditions.clone());
        conditions.extend(lost());
        alarms.watch(S(3), conditions.clone());
        conditions.push(low);
        alarms.watch(S(4), conditions.clone());
        assert_eq!(foremost(&alarms), Some(AlarmKind::Unanswered(CommandKind::Abort)));
        alarms.acknowledge(AlarmKind::Unanswered(CommandKind::Abort));
        assert_eq!(foremost(&alarms), Some(AlarmKind::StationSilent), "the other one is seen");
        alarms.watch(S(5), conditions[2..].to_vec());
        assert_eq!(foremost(&alarms), Some(AlarmKind::LinkLost), "what holds goes before what has ended");
    }

    #[test]
    fn an_alarm_that_is_raised_again_or_after_a_reboot_has_a_new_age() {
        let mut alarms = Alarms::default();
        alarms.watch(S(1), lost());
        alarms.watch(S(3), Vec::new());
        assert_eq!(
            alarms.watch(S(20), lost()).len(),
            1,
            "the first is unacknowledged, and yet it is a new one"
        );
        assert_eq!(alarms.list()[0].raised_at, S(20));
        let latched = || vec![condition(AlarmKind::Aborted, 1)];
        alarms.watch(S(30), latched());
        alarms.vehicle_rebooted(S(40));
        assert_eq!(alarms.watch(S(40), latched()).len(), 1);
        assert_eq!(alarms.list().last().map(|alarm| alarm.raised_at), Some(S(40)));
    }
}

//! Alarms: raised by a condition, rung by the bell until a person has acknowledged them.

use std::time::Duration;

use super::command::CommandKind;

/// An alarm that nobody has acknowledged rings again after this long.
pub const RING_EVERY: Duration = Duration::from_secs(4);

/// What an alarm is about; one of each at a time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AlarmKind {
    /// No heartbeat.
    LinkLost,
    /// The transport does not work.
    LinkDown,
    /// Acknowledged, and yet not observed.
    Disagreement(CommandKind),
    /// Sent again and again without an answer.
    Unanswered(CommandKind),
    /// Refused by the vehicle.
    Refused(CommandKind),
    /// The vehicle has latched an abort.
    Aborted,
    /// The landing motor was fired and did not light.
    NoLight,
    /// The upright stabiliser flies instead of the landing controller.
    Degraded,
    /// The controller did not answer in time.
    DeadlineMissed,
    /// The present plan ends outside a limit, under thrust.
    PlanOutside,
    /// The verdict says: not landed.
    NotLanded,
    /// The vehicle has begun anew.
    Rebooted,
    /// Recording has failed, or loses records.
    Log,
}

/// One alarm.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Alarm {
    /// What it is about.
    pub kind: AlarmKind,
    /// For a person to read; fit for a terminal.
    pub text: String,
    /// Since the start of the run.
    pub raised_at: Duration,
    /// Its condition still holds.
    pub active: bool,
    /// A person has seen it.
    pub acknowledged: bool,
    /// It was over before this screen was there: worth knowing, and nothing to ring for.
    pub past: bool,
}

/// The alarms that hold or that nobody has acknowledged yet, oldest first.
#[derive(Debug, Default)]
pub struct Alarms {
    list: Vec<Alarm>,
    in_history: bool,
    rung_at: Option<Duration>,
}

impl Alarms {
    /// Of a screen that is told first what happened before it was there: nothing rings until that is over.
    pub(crate) fn in_history() -> Self {
        Self { in_history: true, ..Self::default() }
    }

    /// What comes from now on happens now. What is over by then is past; what still holds rings.
    pub(crate) fn history_ends(&mut self) {
        if std::mem::take(&mut self.in_history) {
            for alarm in &mut self.list {
                alarm.past = !alarm.active;
            }
            self.rung_at = None;
        }
    }

    /// Oldest first.
    pub fn list(&self) -> &[Alarm] {
        &self.list
    }

    /// The newest that nobody has acknowledged, those of the past last; else the newest that holds.
    pub fn foremost(&self) -> Option<&Alarm> {
        let newest = |past: bool| self.list.iter().rfind(|alarm| !alarm.acknowledged && alarm.past == past);
        newest(false).or_else(|| newest(true)).or_else(|| self.list.last())
    }

    /// How many nobody has acknowledged.
    pub fn unacknowledged(&self) -> usize {
        self.list.iter().filter(|alarm| !alarm.acknowledged).count()
    }

    /// Takes the conditions that hold now. Returns the alarms that were raised by them.
    pub(crate) fn watch(&mut self, now: Duration, conditions: Vec<(AlarmKind, String)>) -> Vec<Alarm> {
        for alarm in &mut self.list {
            alarm.active = conditions.iter().any(|(kind, _)| *kind == alarm.kind);
        }
        let mut raised = Vec::new();
        for (kind, text) in conditions {
            if let Some(known) = self.list.iter_mut().find(|alarm| alarm.kind == kind) {
                known.text = text;
                // It is back.
                known.past = false;
            } else {
                let alarm =
                    Alarm { kind, text, raised_at: now, active: true, acknowledged: false, past: false };
                self.list.push(alarm.clone());
                raised.push(alarm);
            }
        }
        self.list.retain(|alarm| alarm.active || !alarm.acknowledged);
        raised
    }

    /// A person has seen them all. Returns how many were new to them.
    pub(crate) fn acknowledge(&mut self) -> usize {
        let count = self.unacknowledged();
        for alarm in &mut self.list {
            alarm.acknowledged = true;
        }
        self.list.retain(|alarm| alarm.active);
        self.rung_at = None;
        count
    }

    /// Whether the bell is due; then it counts as rung.
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

#[cfg(test)]
mod tests {
    use super::*;

    const S: fn(u64) -> Duration = Duration::from_secs;

    fn lost() -> Vec<(AlarmKind, String)> {
        vec![(AlarmKind::LinkLost, "LINK LOST".to_owned())]
    }

    #[test]
    fn an_alarm_outlives_its_condition_until_a_person_has_seen_it() {
        let mut alarms = Alarms::default();
        assert_eq!(alarms.watch(S(1), lost()).len(), 1);
        assert!(alarms.watch(S(2), lost()).is_empty(), "raised once");
        alarms.watch(S(3), Vec::new());
        assert!(!alarms.list()[0].active);
        assert_eq!(alarms.acknowledge(), 1);
        assert!(alarms.list().is_empty());
    }

    #[test]
    fn an_acknowledged_alarm_stays_while_its_condition_holds_and_is_new_when_it_returns() {
        let mut alarms = Alarms::default();
        alarms.watch(S(1), lost());
        alarms.acknowledge();
        alarms.watch(S(2), lost());
        assert!(alarms.list()[0].acknowledged);
        alarms.watch(S(3), Vec::new());
        assert!(alarms.list().is_empty());
        assert_eq!(alarms.watch(S(4), lost()).len(), 1);
        assert_eq!(alarms.unacknowledged(), 1);
    }

    /// A screen that comes late hears of what was, and rings for what is.
    #[test]
    fn what_was_over_before_the_screen_came_does_not_ring() {
        let mut alarms = Alarms::in_history();
        let down = (AlarmKind::LinkDown, "LINK DOWN".to_owned());
        alarms.watch(S(1), [lost(), vec![down.clone()]].concat());
        assert!(!alarms.rings(S(1), true));
        alarms.watch(S(9), vec![down]);
        assert!(!alarms.rings(S(9), false));
        alarms.history_ends();
        assert!(alarms.rings(S(10), false), "the link is still down");
        assert_eq!(alarms.foremost().map(|alarm| alarm.kind), Some(AlarmKind::LinkDown));
        alarms.watch(S(11), Vec::new());
        assert!(alarms.rings(S(20), false), "nobody has seen it, and it was there when the screen came");
        alarms.acknowledge();
        assert!(alarms.list().is_empty());

        let mut alarms = Alarms::in_history();
        alarms.watch(S(1), lost());
        alarms.watch(S(2), Vec::new());
        alarms.history_ends();
        assert!(alarms.list()[0].past && !alarms.rings(S(30), false));
        assert!(alarms.watch(S(40), lost()).is_empty() && !alarms.list()[0].past);
        assert!(alarms.rings(S(40), false), "it has come back");
    }

    #[test]
    fn the_bell_rings_at_once_and_again_until_acknowledged() {
        let mut alarms = Alarms::default();
        let raised = !alarms.watch(S(1), lost()).is_empty();
        assert!(alarms.rings(S(1), raised));
        assert!(!alarms.rings(S(2), false));
        assert!(alarms.rings(S(1) + RING_EVERY, false));
        alarms.acknowledge();
        assert!(!alarms.rings(S(60), false));
    }
}

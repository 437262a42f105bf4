//! Alarms: raised by a condition, rung by the bell until a person has acknowledged them.

use std::time::Duration;

use super::command::CommandKind;

/// An alarm that nobody has acknowledged rings again after this long.
pub const RING_EVERY: Duration = Duration::from_secs(4);

/// What an alarm is about; one of each at a time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AlarmKind {
    /// The vehicle is not heard.
    LinkLost,
    /// The vehicle does not hear this station.
    UplinkLost,
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
    /// The motor may still light.
    LiveMotor,
    /// The countdown was held.
    Held,
}

impl AlarmKind {
    /// Every kind there is.
    pub fn all() -> impl Iterator<Item = Self> {
        let of_commands =
            [Self::Disagreement, Self::Unanswered, Self::Refused].into_iter().flat_map(|kind| {
                [CommandKind::Arm, CommandKind::Disarm, CommandKind::Start, CommandKind::Abort].map(kind)
            });
        let others = [
            Self::LinkLost,
            Self::UplinkLost,
            Self::LinkDown,
            Self::Aborted,
            Self::NoLight,
            Self::Degraded,
            Self::DeadlineMissed,
            Self::PlanOutside,
            Self::NotLanded,
            Self::Rebooted,
            Self::Log,
            Self::LiveMotor,
            Self::Held,
        ];
        others.into_iter().chain(of_commands)
    }

    /// Whether it is about one boot of the vehicle, and over with it.
    fn ends_with_the_boot(self) -> bool {
        !matches!(self, Self::LinkLost | Self::UplinkLost | Self::LinkDown | Self::Rebooted | Self::Log)
    }
}

/// One alarm.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Alarm {
    /// What it is about.
    pub kind: AlarmKind,
    /// For a person to read; fit for a terminal.
    pub text: String,
    /// When it was raised, the last time if it was raised anew; since the start of the run.
    pub raised_at: Duration,
    /// When its condition ended; `None` while it holds.
    pub ended_at: Option<Duration>,
    /// A person has seen it.
    pub acknowledged: bool,
    /// It was over before this screen was there: worth knowing, and nothing to ring for.
    pub past: bool,
}

impl Alarm {
    /// Whether its condition holds.
    pub fn is_active(&self) -> bool {
        self.ended_at.is_none()
    }
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
                alarm.past = !alarm.is_active();
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

    /// Takes the conditions that hold now. Returns the alarms that were raised by them. A condition that comes back has
    /// an age of its own, and must be seen anew.
    pub(crate) fn watch(&mut self, now: Duration, conditions: Vec<(AlarmKind, String)>) -> Vec<Alarm> {
        for alarm in &mut self.list {
            if !conditions.iter().any(|(kind, _)| *kind == alarm.kind) {
                alarm.ended_at.get_or_insert(now);
            }
        }
        let mut raised = Vec::new();
        for (kind, text) in conditions {
            match self.list.iter_mut().find(|alarm| alarm.kind == kind) {
                Some(known) if known.is_active() => known.text = text,
                known => {
                    let alarm = Alarm {
                        kind,
                        text,
                        raised_at: now,
                        ended_at: None,
                        acknowledged: false,
                        past: false,
                    };
                    raised.push(alarm.clone());
                    match known {
                        Some(known) => *known = alarm,
                        None => self.list.push(alarm),
                    }
                }
            }
        }
        self.list.sort_by_key(|alarm| alarm.raised_at);
        self.forget_seen();
        raised
    }

    /// The vehicle is another from now on: what was about the one before has ended.
    pub(crate) fn vehicle_is_another(&mut self, now: Duration) {
        for alarm in self.list.iter_mut().filter(|alarm| alarm.kind.ends_with_the_boot()) {
            alarm.ended_at.get_or_insert(now);
        }
        self.forget_seen();
    }

    /// A person has seen this one. Returns its text, if it was new to them.
    pub(crate) fn acknowledge(&mut self, kind: AlarmKind) -> Option<String> {
        let new = self.list.iter_mut().find(|alarm| alarm.kind == kind && !alarm.acknowledged)?;
        new.acknowledged = true;
        let text = new.text.clone();
        self.forget_seen();
        if self.unacknowledged() == 0 {
            self.rung_at = None;
        }
        Some(text)
    }

    fn forget_seen(&mut self) {
        self.list.retain(|alarm| alarm.is_active() || !alarm.acknowledged);
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
        assert_eq!(alarms.list()[0].ended_at, Some(S(3)));
        assert!(alarms.acknowledge(AlarmKind::LinkLost).is_some());
        assert!(alarms.list().is_empty());
    }

    #[test]
    fn an_acknowledged_alarm_stays_while_its_condition_holds_and_is_new_when_it_returns() {
        let mut alarms = Alarms::default();
        alarms.watch(S(1), lost());
        alarms.acknowledge(AlarmKind::LinkLost);
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
        alarms.acknowledge(AlarmKind::LinkLost);
        alarms.acknowledge(AlarmKind::LinkDown);
        assert!(alarms.list().is_empty());

        let mut alarms = Alarms::in_history();
        alarms.watch(S(1), lost());
        alarms.watch(S(2), Vec::new());
        alarms.history_ends();
        assert!(alarms.list()[0].past && !alarms.rings(S(30), false));
        assert_eq!(alarms.watch(S(40), lost()).len(), 1, "it has come back");
        assert!(!alarms.list()[0].past && alarms.rings(S(40), true));
    }

    #[test]
    fn the_bell_rings_at_once_and_again_until_acknowledged() {
        let mut alarms = Alarms::default();
        let raised = !alarms.watch(S(1), lost()).is_empty();
        assert!(alarms.rings(S(1), raised));
        assert!(!alarms.rings(S(2), false));
        assert!(alarms.rings(S(1) + RING_EVERY, false));
        alarms.acknowledge(AlarmKind::LinkLost);
        assert!(!alarms.rings(S(60), false));
    }

    #[test]
    fn each_alarm_is_acknowledged_by_itself() {
        let mut alarms = Alarms::default();
        let down = (AlarmKind::LinkDown, "LINK DOWN".to_owned());
        alarms.watch(S(1), [lost(), vec![down]].concat());
        alarms.acknowledge(AlarmKind::LinkLost);
        assert_eq!(alarms.unacknowledged(), 1);
        assert!(alarms.rings(S(9), false), "the other is not seen yet");
    }

    #[test]
    fn an_alarm_that_is_raised_anew_or_by_another_vehicle_has_an_age_of_its_own() {
        let mut alarms = Alarms::default();
        alarms.watch(S(1), lost());
        alarms.watch(S(3), Vec::new());
        assert_eq!(
            alarms.watch(S(20), lost()).len(),
            1,
            "nobody has seen the first, and yet it is a new one"
        );
        assert_eq!(alarms.list()[0].raised_at, S(20));
        let latched = || vec![(AlarmKind::Aborted, "ABORT LATCHED".to_owned())];
        alarms.watch(S(30), latched());
        alarms.vehicle_is_another(S(40));
        assert_eq!(alarms.watch(S(40), latched()).len(), 1);
        assert_eq!(alarms.list().last().map(|alarm| alarm.raised_at), Some(S(40)));
    }
}

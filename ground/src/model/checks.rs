//! The vehicle's arming checks: which fail, in its words, and for which it has held the countdown.

use protocol::dialect::{TdCheck, TdHold, TdPhase};

use super::{Vehicle, words};

/// Checks whose texts name the sensor at fault; the texts of other checks state the value found.
pub const SENSORS: TdCheck = TdCheck::TD_CHECK_ACCELEROMETER
    .union(TdCheck::TD_CHECK_GYRO)
    .union(TdCheck::TD_CHECK_BAROMETER)
    .union(TdCheck::TD_CHECK_GNSS)
    .union(TdCheck::TD_CHECK_LIDAR);

/// The vehicle's texts about its checks, beside which of them fail.
#[derive(Debug, Clone, Default)]
pub struct ReportedChecks {
    /// Text of each check, the newest last.
    reported: Vec<(TdCheck, String)>,
    /// The check for which it holds the countdown; it stays named after it passes again.
    held: Option<TdCheck>,
}

impl Vehicle {
    /// The failing checks, each in the vehicle's words if they have arrived, otherwise by its name.
    pub fn failing(&self) -> Vec<(TdCheck, String)> {
        let failed = self.status.as_ref().map_or(TdCheck::empty(), |status| status.value.checks_failed);
        failed.iter().map(|check| (check, self.words_of(check))).collect()
    }

    /// The failing checks in one line; `None` if all pass.
    pub fn why_no_go(&self) -> Option<String> {
        let failing: Vec<String> = self.failing().into_iter().map(|(_, words)| words).collect();
        (!failing.is_empty()).then(|| failing.join(", "))
    }

    /// The first check that forbids the start, by its name and in words. The vehicle judges the
    /// requesting station's uplink, and a lost uplink has a separate alarm.
    pub fn unfit(&self) -> Option<(String, String)> {
        let fails = |(check, _): &(TdCheck, String)| *check != TdCheck::TD_CHECK_UPLINK;
        self.failing().into_iter().find(fails).map(|(check, words)| (name(check), words))
    }

    /// The check for which it holds the countdown, likewise.
    pub fn held_for(&self) -> Option<(String, String)> {
        self.checks.held.map(|check| (name(check), self.words_of(check)))
    }

    /// Why it is armed and not ready: the first failing check, likewise. A hold has its own words.
    pub fn unfit_while_armed(&self) -> Option<(String, String)> {
        let status = &self.status.as_ref()?.value;
        let waits = status.phase == TdPhase::TD_PHASE_PAD_ARMED && status.hold == TdHold::TD_HOLD_NONE;
        self.unfit().filter(|_| waits)
    }

    /// The checks that this vehicle makes: only one that hangs below a drone has a height.
    pub fn checks_made(&self) -> TdCheck {
        let hangs = self.mission().is_some_and(|mission| mission.start == Some("drone"));
        let height = if hangs { TdCheck::empty() } else { TdCheck::TD_CHECK_HEIGHT };
        TdCheck::all().difference(height)
    }

    /// Its words for a check, if they have arrived.
    pub fn reported_words(&self, check: TdCheck) -> Option<&str> {
        self.checks.reported.iter().find(|(reported, _)| *reported == check).map(|(_, words)| words.as_str())
    }

    fn words_of(&self, check: TdCheck) -> String {
        self.reported_words(check).map_or_else(|| name(check), str::to_owned)
    }

    /// Stores its text about a check. Its flight status reports whether the check still fails.
    pub(crate) fn note_check_text(&mut self, text: &str) {
        let text = ["not ready: ", "armed, and "].iter().find_map(|of| text.strip_prefix(of)).unwrap_or(text);
        let text = text.split_once(" refused: ").map_or(text, |(_, reason)| reason);
        let Some(check) = check_of(text) else { return };
        self.checks.reported.retain(|(reported, _)| *reported != check);
        self.checks.reported.push((check, in_short(text, check)));
        let holds = self.reports(|status| status.hold == TdHold::TD_HOLD_CHECK_FAILED);
        self.checks.held = self.checks.held.or_else(|| holds.then_some(check));
    }

    /// Updates the check for which it holds, and removes the texts of checks that pass again.
    pub(crate) fn note_checks(&mut self) {
        let Some(status) = self.status.as_ref().map(|status| &status.value) else { return };
        let Self { checks: ReportedChecks { reported, held }, .. } = self;
        let failed = status.checks_failed;
        if status.hold == TdHold::TD_HOLD_CHECK_FAILED {
            // It reports the check just before the hold.
            let first = || failed.iter().find(|check| *check != TdCheck::TD_CHECK_UPLINK);
            *held = held.or_else(|| reported.last().map(|(check, _)| *check)).or_else(first);
        } else {
            *held = None;
        }
        reported.retain(|(check, _)| failed.contains(*check) || *held == Some(*check));
    }
}

/// The check that a text of the vehicle is about.
fn check_of(text: &str) -> Option<TdCheck> {
    let has_found = text.contains(": found ");
    let text = text.to_lowercase().replace('-', " ");
    let is_about = |(name, check): &(String, TdCheck)| {
        if has_found { text.starts_with(name) } else { SENSORS.contains(*check) && text.contains(name) }
    };
    let named = TdCheck::all().iter_names().map(|(name, check)| (words::lower_case_name(name), check));
    // `log space` begins with `log`.
    named.filter(is_about).max_by_key(|(name, _)| name.len()).map(|(_, check)| check)
}

/// Without what was required, and without a time, which grows on: `no GNSS fix for 9 s` becomes `no
/// GNSS fix`.
fn in_short(text: &str, check: TdCheck) -> String {
    let text = text.split_once(", required ").map_or(text, |(found, _)| found);
    let text = match text.rsplit_once(" for ") {
        Some((what, time)) if time.ends_with(" s") => what,
        _ => text,
    };
    let whose =
        if (TdCheck::TD_CHECK_LOG | TdCheck::TD_CHECK_LOG_SPACE).contains(check) { "vehicle " } else { "" };
    format!("{whose}{}", text.replacen(": found ", " ", 1))
}

/// The name of a check.
fn name(check: TdCheck) -> String {
    check.iter_names().next().map_or_else(String::new, |(name, _)| words::check(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_of_the_vehicle_names_its_check_in_short() {
        let cases = [
            ("no GNSS fix for 9 s", Some((TdCheck::TD_CHECK_GNSS, "no GNSS fix"))),
            ("gyro repeats one value for 2 s", Some((TdCheck::TD_CHECK_GYRO, "gyro repeats one value"))),
            (
                "log space: found 1 MiB, required at least 9 MiB",
                Some((TdCheck::TD_CHECK_LOG_SPACE, "vehicle log space 1 MiB")),
            ),
            (
                "log: found not running, required running",
                Some((TdCheck::TD_CHECK_LOG, "vehicle log not running")),
            ),
            (
                "self-test: found not passed, required passed",
                Some((TdCheck::TD_CHECK_SELF_TEST, "self-test not passed")),
            ),
            (
                "tilt from vertical: found 6.00 deg, required at most 5 deg",
                Some((TdCheck::TD_CHECK_TILT, "tilt from vertical 6.00 deg")),
            ),
            ("pin out: landing motor live", None),
            ("HOLD: no countdown; start again or it disarms in 60 s", None),
        ];
        for (text, expected) in cases {
            let found = check_of(text).map(|check| (check, in_short(text, check)));
            assert_eq!(found, expected.map(|(check, words)| (check, words.to_owned())), "{text}");
        }
    }
}

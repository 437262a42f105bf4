//! A vehicle that has to refuse says why once, and then counts: a flood of refused requests must neither fill the radio
//! nor the crew's screen.

use std::collections::BTreeMap;

use protocol::identity::Address;

/// Refused commands of one station that are answered at once. More than this no client sends before it waits.
const AT_ONCE: f64 = 8.0;
/// After those, answers to one station's refused commands, in a second: whoever repeats waits 0.5 s for each.
const PER_S: f64 = 2.0;
/// Stations told apart. A flood of forged addresses shares the last place.
const MAX_STATIONS: usize = 16;

/// How often each station's refused commands are answered.
#[derive(Debug, Default)]
pub(super) struct Refusals {
    stations: BTreeMap<Address, Left>,
}

/// Answers that are left.
#[derive(Debug, Clone, Copy)]
struct Left {
    answers: f64,
    at_s: f64,
}

impl Refusals {
    /// Whether a station is answered that one more of its commands is refused.
    pub(super) fn may_answer(&mut self, station: Address, now_s: f64) -> bool {
        let known = self.stations.contains_key(&station) || self.stations.len() < MAX_STATIONS - 1;
        let place = if known { station } else { Address { system_id: 0, component_id: 0 } };
        let left = self.stations.entry(place).or_insert(Left { answers: AT_ONCE, at_s: now_s });
        left.answers = (left.answers + PER_S * (now_s - left.at_s).max(0.0)).min(AT_ONCE);
        left.at_s = now_s;
        let may = left.answers >= 1.0;
        if may {
            left.answers -= 1.0;
        }
        may
    }
}

/// A warning that was said is said again after this at the earliest, s, with how often it would have been said.
const SAID_FOR_S: f64 = 5.0;
/// Different warnings in that time; of more only the number is said.
const MAX_DIFFERENT: usize = 8;

/// Warnings that were said just now.
#[derive(Debug, Default)]
pub(super) struct Warnings {
    said: Vec<Said>,
    others: u32,
    others_since_s: f64,
}

#[derive(Debug)]
struct Said {
    words: String,
    at_s: f64,
    more: u32,
}

impl Warnings {
    /// Whether a warning is to be said now. Words that differ in their figures only are the same warning: a value that
    /// is measured anew each time is no news.
    pub(super) fn is_news(&mut self, words: &str, now_s: f64) -> bool {
        if let Some(said) = self.said.iter_mut().find(|said| same_but_for_figures(&said.words, words)) {
            said.more += 1;
            words.clone_into(&mut said.words);
            return false;
        }
        if self.said.len() >= MAX_DIFFERENT {
            if self.others == 0 {
                self.others_since_s = now_s;
            }
            self.others += 1;
            return false;
        }
        self.said.push(Said { words: words.to_owned(), at_s: now_s, more: 0 });
        true
    }

    /// What has been counted for long enough, in words.
    pub(super) fn counted(&mut self, now_s: f64) -> Vec<String> {
        let mut words = Vec::new();
        self.said.retain_mut(|said| {
            if now_s - said.at_s < SAID_FOR_S {
                return true;
            }
            let more = std::mem::take(&mut said.more);
            if more > 0 {
                said.at_s = now_s;
                words.push(format!("{} ({more} more)", said.words));
            }
            more > 0
        });
        if self.others > 0 && now_s - self.others_since_s >= SAID_FOR_S {
            words.push(format!("{} other warnings", std::mem::take(&mut self.others)));
        }
        words
    }
}

fn same_but_for_figures(one: &str, other: &str) -> bool {
    let without = |words| {
        str::chars(words).filter(|character| !(character.is_ascii_digit() || ".-".contains(*character)))
    };
    without(one).eq(without(other))
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::identity::GROUND;

    #[test]
    fn a_station_that_repeats_is_answered_at_once_first_and_then_twice_a_second() {
        let mut refusals = Refusals::default();
        let answered = |refusals: &mut Refusals, from_s: f64| {
            (0..200).filter(|n| refusals.may_answer(GROUND, from_s + 0.05 * f64::from(*n))).count()
        };
        // 10 s at 20 Hz.
        assert!((26..=28).contains(&answered(&mut refusals, 0.0)));
        assert!((18..=20).contains(&answered(&mut refusals, 10.0)));
        // Another station is not made to wait by this one.
        assert!(refusals.may_answer(Address { system_id: 254, component_id: 190 }, 20.0));
    }

    #[test]
    fn forged_addresses_share_one_place() {
        let mut refusals = Refusals::default();
        let stations = (1..=255).map(|system_id| Address { system_id, component_id: 1 });
        let answered = stations.clone().filter(|station| refusals.may_answer(*station, 0.0)).count();
        assert_eq!(answered, MAX_STATIONS - 1 + AT_ONCE as usize);
        assert_eq!(refusals.stations.len(), MAX_STATIONS);
    }

    #[test]
    fn a_warning_is_said_once_and_then_counted() {
        let mut warnings = Warnings::default();
        assert!(warnings.is_news("arm refused: tilt: found 5.21 deg, required at most 5 deg", 0.0));
        for n in 1..=40 {
            assert!(
                !warnings
                    .is_news("arm refused: tilt: found 5.4 deg, required at most 5 deg", 0.1 * f64::from(n))
            );
        }
        assert!(warnings.counted(4.9).is_empty());
        let words = warnings.counted(5.0);
        assert_eq!(words, ["arm refused: tilt: found 5.4 deg, required at most 5 deg (40 more)"]);
        assert!(!warnings.is_news("arm refused: tilt: found 5.4 deg, required at most 5 deg", 6.0));
        assert!(warnings.is_news("arm refused: pin: found in, required out", 6.0), "another reason");
        assert_eq!(warnings.counted(11.0).len(), 1);
        assert!(warnings.counted(17.0).is_empty());
        assert!(
            warnings.is_news("arm refused: pin: found in, required out", 17.0),
            "after a pause it is news again"
        );
    }

    #[test]
    fn of_many_different_warnings_only_the_number_is_said() {
        let mut warnings = Warnings::default();
        let mut words = (0..26u8).map(|n| format!("no {}", char::from(b'a' + n)));
        assert_eq!(words.by_ref().filter(|words| warnings.is_news(words, 0.0)).count(), MAX_DIFFERENT);
        assert_eq!(warnings.counted(5.0), ["18 other warnings"]);
    }
}

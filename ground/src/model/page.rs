//! The pages of the screen: the flight phase chooses one, unless the crew holds another by its key.

use protocol::dialect::TdPhase;
use strum::{IntoStaticStr, VariantArray};

use super::{AlarmKind, quantity::Quantity};

#[derive(Debug, Clone, Copy, PartialEq, Eq, IntoStaticStr, VariantArray)]
pub enum Page {
    /// Arming checks and the arming ladder.
    Pad,
    /// Height, speed, apogee and booster on the way up; it shares the key of the descent.
    Ascent,
    /// Height and speed against the ignition band.
    Descent,
    /// The burn: side view, controller, actuators.
    Landing,
    /// The verdict, the limits and what went wrong.
    Review,
    /// The link's figures and the age of every message.
    Link,
    /// The event list.
    #[strum(serialize = "Texts")]
    Messages,
    /// The state of the recording.
    Log,
    /// Every alarm, to be acknowledged one by one.
    Alarms,
    /// Where to look for the vehicle.
    Find,
    /// The checks on the pad.
    #[strum(serialize = "Check")]
    Checks,
    /// Every number, and one of them over time.
    Plot,
    Help,
}

impl Page {
    /// Every page that a key shows: those with a digit in that order, then those with a letter or a
    /// mark.
    pub fn all() -> impl Iterator<Item = Self> {
        Self::VARIANTS.iter().copied().filter(|page| page.keyed() == *page)
    }

    /// The page whose key shows this one: ascent and descent share one.
    #[must_use]
    pub fn keyed(self) -> Self {
        if self == Self::Ascent { Self::Descent } else { self }
    }

    /// The name shown at the bottom of the screen.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// The page for a phase.
    pub fn of_phase(phase: TdPhase) -> Self {
        match phase {
            TdPhase::TD_PHASE_SAFE | TdPhase::TD_PHASE_PAD_IDLE | TdPhase::TD_PHASE_PAD_ARMED => Self::Pad,
            TdPhase::TD_PHASE_BOOST | TdPhase::TD_PHASE_COAST => Self::Ascent,
            TdPhase::TD_PHASE_DEPLOY
            | TdPhase::TD_PHASE_AERO_DESCENT
            | TdPhase::TD_PHASE_LAND_ARMED
            | TdPhase::TD_PHASE_CHUTE => Self::Descent,
            TdPhase::TD_PHASE_IGNITION | TdPhase::TD_PHASE_POWERED => Self::Landing,
            TdPhase::TD_PHASE_TOUCHDOWN | TdPhase::TD_PHASE_SAFED => Self::Review,
        }
    }
}

/// Which page is shown, and how far its list is scrolled.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Pages {
    /// The page that the crew holds; `None` follows the flight.
    pub held: Option<Page>,
    /// How many lines a list is scrolled back from its newest line, or down from its first.
    pub scroll: usize,
    /// The alarm chosen in the list of alarms; `None` for the foremost.
    pub chosen: Option<AlarmKind>,
    /// What the plot page shows.
    pub plotted: &'static Quantity,
    /// Whether the Pad page lists the checklist instead of the arming checks.
    pub checklist: bool,
    /// The chosen step of the checklist; `None` for the first that is open.
    pub step: Option<usize>,
    /// The system id of the tracker whose position page Find shows; `None` for the vehicle.
    pub tracker: Option<u8>,
    /// A text that is being typed.
    pub entry: Option<TextEntry>,
    /// The letters of a word that have been typed and not recorded yet.
    pub(crate) word: String,
}

/// A text that is being typed; the keys go to it.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct TextEntry {
    pub typed: String,
    /// In the palette the place of the marked entry among those found; `None` for a note, which
    /// goes into log and book.
    pub chosen: Option<usize>,
}

impl Pages {
    /// The page to show in this phase.
    pub fn shown(&self, phase: Option<TdPhase>) -> Page {
        let of_phase = phase.map_or(Page::Pad, Page::of_phase);
        match self.held {
            // The same key, on the way up.
            Some(Page::Descent) if of_phase == Page::Ascent => Page::Ascent,
            held => held.unwrap_or(of_phase),
        }
    }

    /// Holds a page; `None` follows the flight again.
    pub fn hold(&mut self, page: Option<Page>) {
        (self.held, self.scroll, self.chosen) = (page, 0, None);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_phase_chooses_the_page_unless_one_is_held() {
        let mut pages = Pages::default();
        assert_eq!(pages.shown(None), Page::Pad);
        assert_eq!(pages.shown(Some(TdPhase::TD_PHASE_COAST)), Page::Ascent);
        assert_eq!(pages.shown(Some(TdPhase::TD_PHASE_AERO_DESCENT)), Page::Descent);
        assert_eq!(pages.shown(Some(TdPhase::TD_PHASE_POWERED)), Page::Landing);
        assert_eq!(pages.shown(Some(TdPhase::TD_PHASE_TOUCHDOWN)), Page::Review);
        pages.hold(Some(Page::Link));
        assert_eq!(pages.shown(Some(TdPhase::TD_PHASE_POWERED)), Page::Link);
        pages.hold(None);
        assert_eq!(pages.shown(Some(TdPhase::TD_PHASE_POWERED)), Page::Landing);
    }
}

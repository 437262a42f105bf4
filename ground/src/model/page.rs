//! The pages of the screen: the flight phase chooses one, unless the crew holds another by its key.

use protocol::dialect::TdPhase;

use super::alarm::AlarmKind;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Page {
    /// Arming checks and the arming ladder.
    Pad,
    /// Height, speed, apogee and booster on the way up; it shares the key of the descent.
    Ascent,
    /// Height and speed against the ignition band.
    Descent,
    /// The burn: side view, controller, actuators.
    Landing,
    /// The verdict, greatest values and timeline of the flight.
    Review,
    /// The link's figures and the age of every message.
    Link,
    /// The event list.
    Messages,
    Parameters,
    /// The state of the recording.
    Log,
    /// Every alarm, to be acknowledged one by one.
    Alarms,
    Help,
}

impl Page {
    /// The pages with a digit, in that order; help has `?`.
    pub const ALL: [Self; 9] = [
        Self::Pad,
        Self::Descent,
        Self::Landing,
        Self::Review,
        Self::Link,
        Self::Messages,
        Self::Parameters,
        Self::Log,
        Self::Alarms,
    ];

    /// The key that shows the page.
    pub fn key(self) -> char {
        let of = if self == Self::Ascent { Self::Descent } else { self };
        let digit = Self::ALL.iter().position(|page| *page == of).map(|place| place as u32 + 1);
        digit.and_then(|digit| char::from_digit(digit, 10)).unwrap_or('?')
    }

    /// The page of a digit.
    pub fn from_digit(digit: char) -> Option<Self> {
        let number = usize::try_from(digit.to_digit(10)?).ok()?;
        Self::ALL.get(number.checked_sub(1)?).copied()
    }

    /// The name shown at the bottom of the screen.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pad => "Pad",
            Self::Ascent => "Ascent",
            Self::Descent => "Descent",
            Self::Landing => "Landing",
            Self::Review => "Review",
            Self::Link => "Link",
            Self::Messages => "Texts",
            Self::Parameters => "Params",
            Self::Log => "Log",
            Self::Alarms => "Alarms",
            Self::Help => "Help",
        }
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
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Pages {
    /// The page that the crew holds; `None` follows the flight.
    pub held: Option<Page>,
    /// How many lines a list is scrolled back from its newest line, or down from its first.
    pub scroll: usize,
    /// The alarm chosen in the list of alarms; `None` for the foremost.
    pub chosen: Option<AlarmKind>,
}

impl Pages {
    /// The page to show in this phase.
    pub fn shown(self, phase: Option<TdPhase>) -> Page {
        let of_phase = phase.map_or(Page::Pad, Page::of_phase);
        match self.held {
            // The same key, on the way up.
            Some(Page::Descent) if of_phase == Page::Ascent => Page::Ascent,
            held => held.unwrap_or(of_phase),
        }
    }

    /// Holds a page; `None` follows the flight again.
    pub fn hold(&mut self, page: Option<Page>) {
        *self = Self { held: page, ..Self::default() };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_page_has_its_digit() {
        for page in Page::ALL {
            assert_eq!(Page::from_digit(page.key()), Some(page));
        }
        assert_eq!((Page::Help.key(), Page::Ascent.key()), ('?', Page::Descent.key()));
        for other in ['0', 'x', '\u{0661}'] {
            assert_eq!(Page::from_digit(other), None);
        }
    }

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

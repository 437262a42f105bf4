//! Frames that a log has lost, told from frames that were never there.
//!
//! A flight computer that was restarted leaves out frames, and its records are numbered without a hole. A log that has
//! lost some leaves out records. What the computer remembered behind a loss is not known, so nothing behind the first one
//! can be run again.

use super::Gap;

/// Watches a log's frames go by, in file order.
#[derive(Debug, Clone, Copy, Default)]
pub struct FrameOrder {
    last_frame: u64,
    /// Number that the next record of the channel has if none is lost.
    next_record: u32,
    /// Another flight stands before this one in the log. Whether its records are numbered on or anew is not known, so its
    /// first frame must be the first there is.
    behind_another: bool,
}

/// The number of the first frame of a flight.
const FIRST_FRAME: u64 = 1;

impl FrameOrder {
    /// The order of a flight that stands behind another one in the same log.
    pub fn behind_another() -> Self {
        Self { behind_another: true, ..Self::default() }
    }

    /// Notes a frame and its record's number within its channel; the gap before it, if records are lost there.
    pub fn note(&mut self, frame: u64, record: u32) -> Option<Gap> {
        let gap = Gap { after: self.last_frame, before: frame };
        let lost = if self.behind_another { frame != FIRST_FRAME } else { record > self.next_record };
        self.behind_another = false;
        self.last_frame = frame;
        // A writer that does not number leaves 0 everywhere, and nothing is ever missing.
        self.next_record = record.saturating_add(1);
        lost.then_some(gap)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gaps(frames: &[(u64, u32)]) -> Vec<(u64, u64)> {
        let mut order = FrameOrder::default();
        frames
            .iter()
            .filter_map(|(frame, record)| order.note(*frame, *record))
            .map(|gap| (gap.after, gap.before))
            .collect()
    }

    #[test]
    fn a_restart_is_no_loss_and_a_loss_is() {
        assert_eq!(gaps(&[(1, 0), (2, 1), (52, 2), (53, 3)]), []);
        assert_eq!(gaps(&[(1, 0), (2, 1), (52, 51), (53, 52)]), [(2, 52)]);
        assert_eq!(gaps(&[(7, 6), (8, 7)]), [(0, 7)]);
        assert_eq!(gaps(&[(1, 0), (2, 0), (90, 0)]), []);
        let mut second = FrameOrder::behind_another();
        assert_eq!((second.note(1, 600), second.note(2, 601)), (None, None));
        assert!(second.note(5, 605).is_some() && FrameOrder::behind_another().note(601, 600).is_some());
        assert_eq!(gaps(&[(1, u32::MAX), (2, u32::MAX)]), [(0, 1)]);
    }
}

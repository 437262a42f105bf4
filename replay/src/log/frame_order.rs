//! Tells frames that a log has lost from frames that never existed.
//!
//! A flight computer that restarts skips frame numbers, but the sequence numbers of its records have no gap. A log that
//! lost frames has a gap in the sequence numbers. The computer's memory after a loss is unknown, so no frame after the
//! first loss can be executed again.

use super::Gap;

/// Checks the order of frames as they are read from the file.
#[derive(Debug, Clone, Copy, Default)]
pub struct FrameOrder {
    last_frame: u64,
    /// The sequence number of the channel's next record if none is lost.
    next_record: u32,
    /// Another flight comes before this one in the log. Sequence numbers may continue or start again, so the number of
    /// the flight's first frame shows whether frames are lost.
    behind_another: bool,
}

/// The number of a flight's first frame.
const FIRST_FRAME: u64 = 1;

impl FrameOrder {
    /// The order of a flight that follows another one in the same log.
    pub fn behind_another() -> Self {
        Self { behind_another: true, ..Self::default() }
    }

    /// Takes a frame and the sequence number of its record; returns the gap before it, if records are lost there.
    pub fn note(&mut self, frame: u64, record: u32) -> Option<Gap> {
        let gap = Gap { after: self.last_frame, before: frame };
        let lost = if self.behind_another { frame > FIRST_FRAME } else { record > self.next_record };
        self.behind_another = false;
        self.last_frame = frame;
        // A writer without sequence numbers leaves 0 everywhere, and no loss can be seen.
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

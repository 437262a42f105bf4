//! The last check of the vehicle on its pad, value by value.

use flight::computer::pad_check::{CheckState, Finding, PadCheck, Verdict};
use num_traits::FromPrimitive as _;
use protocol::dialect::{MavMessage, TD_PAD_CHECK_DATA, TdPadCheckItem, TdPadCheckState, TdPadCheckVerdict};

use super::boot_ms;

/// The value at this place, or how the check stands while nothing has been found.
pub(crate) fn pad_check(check: &PadCheck, place: usize, time_s: f64) -> MavMessage {
    let findings = check.findings();
    let mut data = TD_PAD_CHECK_DATA {
        time_boot_ms: boot_ms(time_s),
        value: f32::NAN,
        least: f32::NAN,
        most: f32::NAN,
        run: check.run(),
        state: match check.state() {
            CheckState::NotRun => TdPadCheckState::TD_PAD_CHECK_STATE_NOT_RUN,
            CheckState::Running => TdPadCheckState::TD_PAD_CHECK_STATE_RUNNING,
            CheckState::Passed => TdPadCheckState::TD_PAD_CHECK_STATE_PASSED,
            CheckState::Failed => TdPadCheckState::TD_PAD_CHECK_STATE_FAILED,
            CheckState::Stopped => TdPadCheckState::TD_PAD_CHECK_STATE_STOPPED,
        },
        progress: check.progress_percent(),
        found: u8::try_from(findings.len()).unwrap_or(u8::MAX),
        asked_by: check.by().map_or(0, |by| by.number),
        ..TD_PAD_CHECK_DATA::default()
    };
    if let Some(Finding { item, value, least, most, verdict }) = findings.get(place).copied()
        && let Some(item) = TdPadCheckItem::from_u8(item.number())
    {
        (data.value, data.least, data.most) = (value as f32, least as f32, most as f32);
        (data.item, data.place) = (item, u8::try_from(place).unwrap_or(u8::MAX));
        data.verdict = match verdict {
            Verdict::NotJudged => TdPadCheckVerdict::TD_PAD_CHECK_VERDICT_NOT_JUDGED,
            Verdict::Ok => TdPadCheckVerdict::TD_PAD_CHECK_VERDICT_OK,
            Verdict::NotOk => TdPadCheckVerdict::TD_PAD_CHECK_VERDICT_NOT_OK,
        };
    }
    MavMessage::TD_PAD_CHECK(data)
}

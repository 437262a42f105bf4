//! Notices that every frame of a sender is refused for its time stamp although its key is right, and says what to do.

use alloc::collections::BTreeMap;
use alloc::format;
use alloc::string::String;
use core::time::Duration;

use super::Rejection;
use super::timestamp::STAMPS_PER_S;
use crate::frame::Frame;
use crate::identity::Address;

/// A sender is locked out when for this long only such frames arrived.
const AFTER: Duration = Duration::from_secs(2);
/// It is said again after this time.
const AGAIN_AFTER: Duration = Duration::from_secs(30);
/// At most this many senders are watched. Only holders of the key come here.
const MAX_SENDERS: usize = 16;

#[derive(Debug, Clone, Copy)]
struct Refused {
    since: Duration,
    said_at: Option<Duration>,
}

/// The senders of which nothing but refused time stamps has arrived for a while.
#[derive(Debug, Default)]
pub struct Lockouts(BTreeMap<Address, Refused>);

impl Lockouts {
    /// Notes a frame that was accepted: its sender is not locked out.
    pub fn accepted(&mut self, frame: &Frame) {
        if frame.is_signed() {
            self.0.remove(&frame.source());
        }
    }

    /// Notes a refused frame. Returns the words for the crew when they are due. `clock` is the time that the frame was judged
    /// by, as a time stamp.
    pub fn refused(&mut self, frame: &Frame, why: Rejection, now: Duration, clock: u64) -> Option<String> {
        let stamp = frame.stamp()?;
        if !matches!(why, Rejection::Replayed | Rejection::TooOld | Rejection::TooNew) {
            return None;
        }
        let source = frame.source();
        if self.0.len() >= MAX_SENDERS && !self.0.contains_key(&source) {
            return None;
        }
        let refused = self.0.entry(source).or_insert(Refused { since: now, said_at: None });
        let due = now.saturating_sub(refused.since) >= AFTER
            && refused.said_at.is_none_or(|at| now.saturating_sub(at) >= AGAIN_AFTER);
        if !due {
            return None;
        }
        refused.said_at = Some(now);
        let Address { system_id, component_id } = source;
        let off = in_words(stamp.abs_diff(clock));
        let side = if stamp > clock { "ahead of" } else { "behind" };
        let what_to_do = match why {
            Rejection::TooNew => {
                "if this clock is right, set the vehicle's, remove its file KEY.vehicle.stamps and restart it"
            }
            Rejection::TooOld => "set the clock that is wrong, then restart that program",
            _ => {
                "either somebody plays a recording, or its clock or its file of stamps was set back: set its clock, remove \
                 this station's file KEY.ground.stamps and restart the station"
            }
        };
        Some(format!(
            "LOCKED OUT: nothing of {system_id}/{component_id} is believed, its time stamps are {off} {side} this clock \
             ({why}); {what_to_do}"
        ))
    }
}

/// A span of time stamps in the unit that fits.
fn in_words(stamps: u64) -> String {
    let seconds = stamps / STAMPS_PER_S;
    match seconds {
        0..120 => format!("{seconds} s"),
        120..7_200 => format!("{} min", seconds / 60),
        7_200..172_800 => format!("{} h", seconds / 3_600),
        _ => format!("{:.1} days", seconds as f64 / 86_400.0),
    }
}

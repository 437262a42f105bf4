//! Whether an abort sent now would still find what it is to prevent. The vehicle says what it would do at this
//! moment; the way there takes time.

use std::time::Duration;

use protocol::dialect::TdAbortEffect;

use super::Model;

/// The way of a command while nothing was measured: a telemetry radio's usual latency upward.
const ONE_WAY_UNMEASURED: Duration = Duration::from_millis(250);

/// Why an abort sent now comes too late for what the vehicle offers; `None` while it is in time, or unknown.
pub fn why(model: &Model, now: Duration) -> Option<&'static str> {
    // What was said before the link fell silent counts on: silence gives no time back.
    let offered = model.vehicle.status.as_ref()?.value.abort_effect;
    let chute = offered == TdAbortEffect::TD_ABORT_EFFECT_CHUTE_NOW;
    let before_ignition = chute
        || matches!(
            offered,
            TdAbortEffect::TD_ABORT_EFFECT_BURN
                | TdAbortEffect::TD_ABORT_EFFECT_IMPACT
                | TdAbortEffect::TD_ABORT_EFFECT_BURN_OR_INHIBIT
        );
    if !before_ignition {
        return None;
    }
    let descent = model.vehicle.descent.as_ref()?;
    let d = &descent.value;
    let one_way = model.link.round_trip.map_or(ONE_WAY_UNMEASURED, |round_trip| round_trip / 2);
    // Since it was sent, and until ours is there.
    let passes_s = (descent.age(now) + 2 * one_way).as_secs_f64();
    let left_s = f64::from(d.time_to_ignition_s);
    if left_s.is_finite() && left_s < passes_s {
        return Some(if offered == TdAbortEffect::TD_ABORT_EFFECT_BURN_OR_INHIBIT {
            // An older vehicle gives up its landing then.
            "TOO LATE: arrives after ignition"
        } else {
            "TOO LATE: arrives after ignition, lands here"
        });
    }
    let (above_m, down_m_s) =
        (f64::from(d.height_m) - f64::from(d.commit_height_m), -f64::from(d.vertical_speed_m_s));
    let chute_lost = chute && above_m > 0.0 && down_m_s > 0.0 && above_m < down_m_s * passes_s;
    chute_lost.then_some("TOO LATE for a chute: arrives below the commit height")
}

//! Whether an abort that is sent now would arrive too late. The vehicle reports what an abort would do at this
//! moment; the command takes time to reach it.

use std::time::Duration;

use protocol::dialect::TdAbortEffect;

use super::Model;

/// The assumed one-way delay before a round trip has been measured: a telemetry radio's usual uplink latency.
const ONE_WAY_UNMEASURED: Duration = Duration::from_millis(250);

/// Why an abort sent now would be too late for what the vehicle offers; `None` if it is in time, or if that is
/// unknown.
pub fn reason(model: &Model, now: Duration) -> Option<&'static str> {
    // A report from before a loss of the link still counts: the time keeps running.
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
    // Since the vehicle sent its report, and until the command arrives.
    let passes_s = (descent.age(now) + 2 * one_way).as_secs_f64();
    let left_s = f64::from(d.time_to_ignition_s);
    if left_s.is_finite() && left_s < passes_s {
        return Some(if offered == TdAbortEffect::TD_ABORT_EFFECT_BURN_OR_INHIBIT {
            // An older vehicle may then abandon its landing.
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

//! The line that says what happens next: the event, when and where.

use std::time::Duration;

use protocol::dialect::{TdBooster, TdChute, TdMotor, TdPhase};
use ratatui::text::{Line, Span};

use super::number::{STALE_MARK, fixed};
use super::theme::{TextRole, Theme};
use crate::model::motion::GRAVITY_M_S2;
use crate::model::vehicle::Vehicle;
use crate::model::{Model, latch};

/// A vehicle that is slower than this is not falling, m/s.
const FALLS_M_S: f64 = 0.5;

/// The next event of a flight; `None` on the pad, where the crew decides.
pub fn line(model: &Model, theme: Theme, now: Duration) -> Option<Line<'static>> {
    let phase = model.vehicle.phase()?;
    let (event, rest) = event(&model.vehicle, phase.value, now)?;
    let stale = phase.is_stale(now);
    let (mark, role) = if stale { (STALE_MARK, TextRole::Stale) } else { (" ", TextRole::Title) };
    Some(Line::from(vec![
        Span::styled(" next", theme.style(TextRole::Label)),
        Span::styled(format!("{mark}{event}"), theme.style(role)),
        Span::styled(rest, theme.style(if stale { TextRole::Stale } else { TextRole::Plain })),
    ]))
}

/// The event, and what else is known about it.
fn event(vehicle: &Vehicle, phase: TdPhase, now: Duration) -> Option<(String, String)> {
    let words = |event: &str, rest: &str| Some((event.to_owned(), rest.to_owned()));
    match phase {
        TdPhase::TD_PHASE_SAFE | TdPhase::TD_PHASE_PAD_IDLE | TdPhase::TD_PHASE_PAD_ARMED => None,
        TdPhase::TD_PHASE_BOOST => words("burn-out", ", then it coasts to apogee"),
        TdPhase::TD_PHASE_COAST => {
            let climb = vehicle.best_motion().map(|motion| (motion.value.climb_m_s, motion.age(now)));
            let left_s = climb.map(|(climb, age)| climb / GRAVITY_M_S2 - age.as_secs_f64());
            let attached =
                vehicle.descent.as_ref().is_some_and(|d| d.value.booster == TdBooster::TD_BOOSTER_ATTACHED);
            let (before, after) = if attached { ("separation, ", "") } else { ("", ", then the fins open") };
            Some((format!("{before}apogee{}", within(left_s)), after.to_owned()))
        }
        TdPhase::TD_PHASE_DEPLOY => words("fins open", ", then the steered descent"),
        TdPhase::TD_PHASE_AERO_DESCENT | TdPhase::TD_PHASE_LAND_ARMED => Some(ignition(vehicle, phase, now)),
        TdPhase::TD_PHASE_IGNITION => words("thrust", " within 0.5 s, or NO LIGHT"),
        TdPhase::TD_PHASE_POWERED => {
            let left_s = vehicle.touchdown_in_s(now).map(|left| left.value);
            Some((format!("touchdown{}", within(left_s)), String::new()))
        }
        TdPhase::TD_PHASE_TOUCHDOWN => {
            words("SAFED", " once the motor is burnt out and cool, or the pin is in")
        }
        TdPhase::TD_PHASE_SAFED => words("nothing", ": the flight is over"),
        TdPhase::TD_PHASE_CHUTE => Some(under_chute(vehicle, now)),
    }
}

fn ignition(vehicle: &Vehicle, phase: TdPhase, now: Duration) -> (String, String) {
    if vehicle.interlocks().is_some() && !vehicle.may_light() {
        let why = latch::cause(vehicle).map_or_else(String::new, |cause| format!(", {cause}"));
        return ("the ground".to_owned(), format!(": the motor will NOT be lit{why}"));
    }
    let descent = vehicle.descent.as_ref();
    let left_s = vehicle.ignition_in_s(now).map(|left| left.value);
    let chosen_m =
        descent.map(|d| f64::from(d.value.chosen_height_m)).filter(|height_m| height_m.is_finite());
    let at = chosen_m.map_or_else(String::new, |height_m| format!(" at {} m", fixed(height_m, 0)));
    let armed = if phase == TdPhase::TD_PHASE_LAND_ARMED { ", motor armed" } else { ", motor not armed yet" };
    (format!("IGNITION{}", within(left_s)), format!("{at}{armed}"))
}

/// Until the canopy carries the vehicle nothing is known of the time: it falls fast, and will not for long.
fn under_chute(vehicle: &Vehicle, now: Duration) -> (String, String) {
    let live = vehicle.status.as_ref().is_some_and(|status| status.value.motor == TdMotor::TD_MOTOR_LIVE);
    let motor = if live { ", LIVE MOTOR" } else { "" };
    let Some(descent) = vehicle.descent.as_ref().filter(|d| d.value.chute == TdChute::TD_CHUTE_OPEN) else {
        return ("chute opens".to_owned(), format!(": fired, still falling fast{motor}"));
    };
    let sinks_m_s = -f64::from(descent.value.vertical_speed_m_s);
    let falls_s = f64::from(descent.value.height_m) / sinks_m_s - descent.age(now).as_secs_f64();
    let left_s = Some(falls_s).filter(|_| sinks_m_s > FALLS_M_S);
    ("the ground".to_owned(), format!("{} under the parachute{motor}", within(left_s)))
}

/// As in ` in 3.4 s`; empty if the time is unknown or over.
fn within(left_s: Option<f64>) -> String {
    left_s
        .filter(|left_s| left_s.is_finite() && *left_s >= 0.0)
        .map_or_else(String::new, |left_s| format!(" in {} s", fixed(left_s, 1)))
}

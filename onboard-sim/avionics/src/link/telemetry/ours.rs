//! The messages of our dialect that every vehicle sends: flight status, controller, verdict, crew,
//! check on the pad, and findings.

use flight::computer::AbortEffect;
use flight::computer::crew::People;
use flight::computer::events::FlightEvents;
use flight::computer::findings::Findings;
use flight::computer::pad_check::{CheckedValue, PadCheck};
use flight::computer::pilot::planner::PLAN_WITHIN_S;
use flight::rules::operator::Operator;
use flight::rules::phase::{Mode, Phase};
use flight::rules::verdict::LandingVerdict;
use mavlink::types::CharArray;
use num_traits::FromPrimitive;
use protocol::dialect::{
    MavMessage, TD_CONTROLLER_DATA, TD_CREW_DATA, TD_EVENTS_DATA, TD_FINDING_DATA, TD_FINS_DATA,
    TD_FLIGHT_STATUS_DATA, TD_GIMBAL_DATA, TD_LANDING_VERDICT_DATA, TD_MISSION_DATA, TD_OPERATOR_DATA,
    TD_PAD_CHECK_DATA, TD_PREDICTED_PATH_DATA, TD_TOUCHDOWN_LIMITS_DATA, TD_TOUCHDOWN_PREDICTION_DATA,
    TdAbortEffect, TdCheck, TdInterlock, TdLanding, TdLimit, TdPadCheckItem, TdVehicleFlag,
};

use super::{boot_ms, centidegrees, centimetres, characters};
use crate::link::vehicle::{Identity, VehicleKind, VehicleState, bits, violations};

pub(super) fn flight_status(state: &VehicleState<'_>, identity: Identity) -> MavMessage {
    let (mode, time_s) = (state.mode(), state.time_s);
    let countdown_s = mode.countdown_remaining_s(time_s);
    let seconds = countdown_s.or_else(|| state.since_zero_s().map(|since_s| -since_s));
    let held = mode.held(time_s);
    let last_hold_s = state.computer.last_hold_s().filter(|_| mode.countdown_end_s.is_some());
    let (abort_effect, abort_impact_m_s) = td_abort_effect(state.computer.abort_effect());
    MavMessage::TD_FLIGHT_STATUS(TD_FLIGHT_STATUS_DATA {
        time_boot_ms: boot_ms(time_s),
        countdown_ms: seconds.map_or(i32::MAX, |s| libm::round(1000.0 * s) as i32),
        interlocks: interlocks(mode),
        checks_failed: TdCheck::from_bits_truncate(state.checks_failed()),
        approach_wait_s: mode.approach_wait_s(time_s).map_or(u16::MAX, |s| libm::ceil(s) as u16),
        // In the dialect's order, behind the unknown one.
        motor: numbered(mode.motor_status(time_s) as u8 + 1),
        hold: numbered(held.map_or(0, |(cause, _)| cause as u8)),
        hold_left_s: held.map_or(0, |(_, left_s)| libm::ceil(left_s) as u8),
        phase: numbered(mode.phase.index()),
        abort_effect,
        abort_impact_m_s,
        boot_number: identity.boot_number,
        vehicle_uid: identity.uid,
        vehicle_flags: match identity.kind {
            VehicleKind::Simulated => TdVehicleFlag::TD_VEHICLE_FLAG_SIMULATED,
            VehicleKind::Real => TdVehicleFlag::empty(),
        },
        latch: numbered(state.computer.latch().map_or(0, |latch| latch as u8)),
        last_hold_ds: last_hold_s.map_or(0, |s| libm::ceil(10.0 * s) as u8),
    })
}

/// Effect of an abort, and the impact speed it leads to, m/s, or zero.
fn td_abort_effect(effect: AbortEffect) -> (TdAbortEffect, u8) {
    match effect {
        AbortEffect::None => (TdAbortEffect::TD_ABORT_EFFECT_NONE, 0),
        AbortEffect::SafeOnPad => (TdAbortEffect::TD_ABORT_EFFECT_SAFE_ON_PAD, 0),
        AbortEffect::ChuteAtApogee => (TdAbortEffect::TD_ABORT_EFFECT_CHUTE_AT_APOGEE, 0),
        AbortEffect::ChuteNow => (TdAbortEffect::TD_ABORT_EFFECT_CHUTE_NOW, 0),
        AbortEffect::Burn => (TdAbortEffect::TD_ABORT_EFFECT_BURN, 0),
        AbortEffect::Impact { m_s } => (TdAbortEffect::TD_ABORT_EFFECT_IMPACT, m_s),
        AbortEffect::LandInPlace => (TdAbortEffect::TD_ABORT_EFFECT_LAND_IN_PLACE, 0),
        AbortEffect::LandUpright => (TdAbortEffect::TD_ABORT_EFFECT_LAND_UPRIGHT, 0),
    }
}

fn interlocks(mode: &Mode) -> TdInterlock {
    let locks = mode.interlocks;
    let mut bits = TdInterlock::empty();
    bits.set(TdInterlock::TD_INTERLOCK_PIN_OUT, locks.pin_out);
    bits.set(TdInterlock::TD_INTERLOCK_ARMED, locks.armed);
    bits.set(TdInterlock::TD_INTERLOCK_MOTOR_INHIBITED, locks.landing_motor_inhibited);
    bits.set(TdInterlock::TD_INTERLOCK_ABORT_LATCHED, locks.abort_latched);
    bits.set(TdInterlock::TD_INTERLOCK_NO_LIGHT, locks.no_light_latched);
    bits.set(TdInterlock::TD_INTERLOCK_PIN_DUE, mode.aborted_before_s.is_some());
    bits
}

/// A value of the dialect with the same number as ours.
fn numbered<T: FromPrimitive + Default>(number: u8) -> T {
    T::from_u8(number).unwrap_or_default()
}

pub(super) fn fins(state: &VehicleState<'_>, boot_number: u32) -> MavMessage {
    MavMessage::TD_FINS(TD_FINS_DATA {
        boot_number,
        time_boot_ms: boot_ms(state.time_s),
        commanded: state.computer.commands().fins_rad.map(centidegrees),
        measured: state.input().fins_rad.map(centidegrees),
    })
}

pub(super) fn gimbal(state: &VehicleState<'_>, boot_number: u32) -> MavMessage {
    let [pitch_commanded, yaw_commanded] = state.computer.commands().gimbal_rad.map(centidegrees);
    let [pitch_measured, yaw_measured] = state.input().gimbal_rad.map(centidegrees);
    MavMessage::TD_GIMBAL(TD_GIMBAL_DATA {
        boot_number,
        time_boot_ms: boot_ms(state.time_s),
        pitch_commanded,
        pitch_measured,
        yaw_commanded,
        yaw_measured,
    })
}

pub(super) fn controller(state: &VehicleState<'_>, boot_number: u32) -> Option<MavMessage> {
    let (level, report) = state.controller()?;
    let solve_time_s = state.solve_time_s();
    let microseconds = |s: f64| libm::round(1e6 * s);
    Some(MavMessage::TD_CONTROLLER(TD_CONTROLLER_DATA {
        boot_number,
        time_boot_ms: boot_ms(state.time_s),
        solve_time_us: microseconds(solve_time_s) as u32,
        deadline_margin_us: microseconds(PLAN_WITHIN_S - solve_time_s) as i32,
        iterations: u16::try_from(report.iterations).unwrap_or(u16::MAX),
        level: numbered(level.index()),
        solver_status: numbered(report.status as u8),
    }))
}

pub(super) fn touchdown_prediction(state: &VehicleState<'_>, boot_number: u32) -> Option<MavMessage> {
    let planned = state.planned()?;
    let end = planned.end(state.mission().powered.landing_miss);
    let violated = violations(&LandingVerdict::judge_plan(&state.limits(), &end));
    Some(MavMessage::TD_TOUCHDOWN_PREDICTION(TD_TOUCHDOWN_PREDICTION_DATA {
        boot_number,
        time_boot_ms: boot_ms(state.time_s),
        time_to_go_ms: libm::round(1000.0 * planned.time_to_go_s) as i32,
        distance_m: end.distance_m as f32,
        height_m: end.height_m as f32,
        vertical_m_s: end.vertical_m_s as f32,
        lateral_m_s: end.lateral_m_s as f32,
        tilt_rad: end.tilt_rad as f32,
        rate_rad_s: end.rate_rad_s as f32,
        limits_violated: TdLimit::from_bits_truncate(violated),
    }))
}

pub(super) fn predicted_path(state: &VehicleState<'_>, boot_number: u32) -> Option<MavMessage> {
    let (points_m, count) = state.planned()?.path_from_the_east();
    Some(MavMessage::TD_PREDICTED_PATH(TD_PREDICTED_PATH_DATA {
        boot_number,
        x: points_m.map(|(north_m, _)| centimetres(north_m)),
        altitude: points_m.map(|(_, up_m)| centimetres(up_m)),
        count: count as u8,
    }))
}

pub(super) fn landing_verdict(state: &VehicleState<'_>, boot_number: u32) -> Option<MavMessage> {
    let judged = state.judged.as_ref()?;
    let at = &judged.touchdown;
    let violated = violations(&LandingVerdict::judge(&state.limits(), at));
    let landing = judged.landing.flags().into_iter();
    Some(MavMessage::TD_LANDING_VERDICT(TD_LANDING_VERDICT_DATA {
        boot_number,
        time_boot_ms: boot_ms(state.time_s),
        contact_ms: boot_ms(judged.time_s),
        distance_m: at.distance_m as f32,
        vertical_m_s: at.vertical_m_s as f32,
        lateral_m_s: at.lateral_m_s as f32,
        tilt_rad: at.tilt_rad as f32,
        rate_rad_s: at.rate_rad_s as f32,
        limits_violated: TdLimit::from_bits_truncate(violated),
        landing: TdLanding::from_bits_truncate(bits(landing) as u8),
    }))
}

pub(super) fn touchdown_limits(state: &VehicleState<'_>, boot_number: u32) -> MavMessage {
    let limits = state.limits();
    MavMessage::TD_TOUCHDOWN_LIMITS(TD_TOUCHDOWN_LIMITS_DATA {
        boot_number,
        vertical_m_s: limits.vertical_m_s as f32,
        lateral_m_s: limits.lateral_m_s as f32,
        tilt_rad: limits.tilt_rad as f32,
        rate_rad_s: limits.rate_rad_s as f32,
        fence_m: state.mission().gate.fence_radius_m as f32,
        gimbal_limit_rad: state.mission().airframe.gimbal.limit_rad() as f32,
    })
}

// Commander, pending proposal, and the flown mission.

pub(super) fn mission(state: &VehicleState<'_>, boot_number: u32) -> MavMessage {
    let name = characters(&state.name.name);
    MavMessage::TD_MISSION(TD_MISSION_DATA {
        boot_number,
        hash: state.name.hash.0,
        name,
        start: numbered(state.name.start.map_or(0, |start| start.index() + 1)),
        motor_burns: state.name.motor_burns,
    })
}

pub(super) fn crew(state: &VehicleState<'_>, boot_number: u32) -> Option<MavMessage> {
    let people = state.input().people?;
    let crew = state.computer.crew();
    let (ask, tap) = (crew.two_person.waiting(state.time_s), crew.two_person.tapping);
    let commander = state.input().commander;
    let ms = |left_s: f64| (1000.0 * left_s).clamp(0.0, f64::from(u16::MAX)) as u16;
    let number = |operator: Option<Operator>| operator.map_or(0, |operator| operator.number);
    Some(MavMessage::TD_CREW(TD_CREW_DATA {
        boot_number,
        time_boot_ms: boot_ms(state.time_s),
        ask_number: ask.map_or(0, |ask| ask.number),
        ask_left_ms: ask.map_or(0, |ask| ms(ask.left_s(state.time_s))),
        tap_left_ms: tap.map_or(0, |tap| ms(tap.left_s(state.time_s))),
        people: match people {
            People::One => 1,
            People::Two { .. } => 2,
        },
        act: numbered(ask.map_or(0, |ask| ask.act as u8)),
        asked_by: number(ask.map(|ask| ask.by)),
        tapped_by: number(tap.map(|tap| tap.by)),
        commanded_by: number(commander.and_then(|commander| commander.by)),
        commanding_system: commander.map_or(0, |commander| commander.station.system),
        commanding_component: commander.map_or(0, |commander| commander.station.component),
        held_by: number(crew.held_by),
    }))
}

/// Operators per second.
const TURNS_PER_S: f64 = 0.5;

/// Each operator in turn.
pub(super) fn operator(state: &VehicleState<'_>, boot_number: u32) -> Option<MavMessage> {
    state.input().people?;
    let count = state.operators.len().max(1);
    let operator = state.operators.get((TURNS_PER_S * state.time_s) as usize % count)?;
    Some(MavMessage::TD_OPERATOR(TD_OPERATOR_DATA {
        boot_number,
        number: operator.number,
        role: numbered(operator.role.index()),
        name: CharArray::new(*operator.name.bytes()),
    }))
}

/// The finding at this index, or that there is none.
pub(crate) fn finding(findings: &Findings, place: usize, time_s: f64, boot_number: u32) -> MavMessage {
    let found = findings.as_found();
    let mut data = TD_FINDING_DATA {
        boot_number,
        time_boot_ms: boot_ms(time_s),
        found: u8::try_from(found.len()).unwrap_or(u8::MAX),
        ..TD_FINDING_DATA::default()
    };
    if let Some(finding) = found.get(place) {
        (data.since_s, data.held_s) = (finding.since_s as f32, finding.held_s as f32);
        data.place = u8::try_from(place).unwrap_or(u8::MAX);
        data.text = characters(&finding.words());
    }
    MavMessage::TD_FINDING(data)
}

/// The events of the flight so far; `None` before the first.
pub fn events(events: &FlightEvents, boot_number: u32) -> Option<MavMessage> {
    let mut data = TD_EVENTS_DATA { boot_number, ..TD_EVENTS_DATA::default() };
    for phase in Phase::ALL {
        let place = phase.index().checked_sub(Phase::Boost.index());
        let at = events.of(phase).filter(|(at_s, _)| 100.0 * at_s < f64::from(u16::MAX));
        if let Some((place, (at_s, height_m))) = place.zip(at) {
            data.at[usize::from(place)] = libm::round(100.0 * at_s) as u16;
            data.height[usize::from(place)] = libm::round(10.0 * height_m) as i16;
            data.entered |= 1 << phase.index();
        }
    }
    (data.entered > 0).then_some(MavMessage::TD_EVENTS(data))
}

// The last check of the vehicle on its pad, value by value.

/// The value at this index, or the state of the check while there are no values.
pub(crate) fn pad_check(check: &PadCheck, place: usize, time_s: f64, boot_number: u32) -> MavMessage {
    let findings = &check.findings;
    let mut data = TD_PAD_CHECK_DATA {
        boot_number,
        time_boot_ms: boot_ms(time_s),
        value: f32::NAN,
        least: f32::NAN,
        most: f32::NAN,
        run: check.run,
        state: numbered(check.state as u8),
        progress: check.progress_percent(),
        found: u8::try_from(findings.len()).unwrap_or(u8::MAX),
        asked_by: check.by.map_or(0, |by| by.number),
        ..TD_PAD_CHECK_DATA::default()
    };
    if let Some(CheckedValue { item, value, least, most, verdict }) = findings.get(place).copied()
        && let Some(item) = TdPadCheckItem::from_u8(item.number())
    {
        (data.value, data.least, data.most) = (value as f32, least as f32, most as f32);
        (data.item, data.place) = (item, u8::try_from(place).unwrap_or(u8::MAX));
        data.verdict = numbered(verdict as u8);
    }
    MavMessage::TD_PAD_CHECK(data)
}

#[cfg(test)]
mod tests {
    use core::fmt::Debug;

    use flight::computer::pad_check::{CheckState, Verdict};
    use flight::guidance::powered::ControlLevel;
    use flight::rules::operator::Role;
    use flight::rules::phase::{HoldCause, Latch, MotorStatus, Phase};
    use flight::rules::two_person::Act;
    use flight::vehicle::mission::StartPoint;
    use protocol::dialect::{
        TdAct, TdControlLevel, TdHold, TdLatch, TdMotor, TdPadCheckState, TdPadCheckVerdict, TdPhase, TdRole,
        TdStart,
    };

    use super::*;

    /// Our values of these numbers have the dialect's names, whatever their underscores.
    fn agree<T: FromPrimitive + Default + Debug, O: Copy + Debug>(
        ours: &[O],
        number: fn(O) -> u8,
        prefix: &str,
    ) {
        let plain = |text: alloc::string::String| text.replace('_', "").to_uppercase();
        for value in ours {
            let theirs = plain(alloc::format!("{:?}", numbered::<T>(number(*value))));
            assert_eq!(theirs, plain(alloc::format!("{prefix}{value:?}")));
        }
    }

    /// The same of every variant: one that is not named here does not compile.
    macro_rules! every {
        ($theirs:ty, $ours:ident, $number:expr, $prefix:literal: $($variant:ident),*) => {
            agree::<$theirs, $ours>(&[$($ours::$variant),*], $number, $prefix);
            let _ = |ours: $ours| match ours { $($ours::$variant => (),)* };
        };
    }

    #[test]
    fn every_number_means_the_same_in_the_dialect() {
        agree::<TdPhase, _>(&Phase::ALL, Phase::index, "TdPhase");
        agree::<TdControlLevel, _>(&ControlLevel::ALL, ControlLevel::index, "TdControlLevel");
        agree::<TdRole, _>(&Role::ALL, Role::index, "TdRole");
        agree::<TdStart, _>(&StartPoint::ALL, |start| start.index() + 1, "TdStart");
        every!(TdAct, Act, |act| act as u8, "TdAct": Arm, Start);
        every!(TdPadCheckState, CheckState, |state| state as u8, "TdPadCheckState": NotRun, Running, Passed, Failed, Stopped);
        every!(TdPadCheckVerdict, Verdict, |verdict| verdict as u8, "TdPadCheckVerdict": NotJudged, Ok, NotOk);
        every!(TdHold, HoldCause, |cause| cause as u8, "TdHold": UplinkSilent, Commanded, TapOverdue, StationDeaf, CheckFailed);
        every!(TdLatch, Latch, |latch| latch as u8, "TdLatch": Commanded, UncommandedLiftOff, UncommandedRelease, NoSeparation, Gate, NoLight, Other);
        every!(TdMotor, MotorStatus, |status| status as u8 + 1, "TdMotor": PinIn, Live, Burning, Hot, Burnt);
    }

    #[test]
    fn only_an_impact_is_sent_with_its_speed() {
        let effects = [
            (AbortEffect::None, 0, 0),
            (AbortEffect::SafeOnPad, 1, 0),
            (AbortEffect::ChuteAtApogee, 2, 0),
            (AbortEffect::ChuteNow, 3, 0),
            (AbortEffect::LandUpright, 5, 0),
            (AbortEffect::LandInPlace, 6, 0),
            (AbortEffect::Burn, 7, 0),
            (AbortEffect::Impact { m_s: 41 }, 8, 41),
        ];
        for (effect, number, m_s) in effects {
            let (td_effect, td_m_s) = td_abort_effect(effect);
            assert_eq!((td_effect as u32, td_m_s), (number, m_s), "{effect:?}");
        }
    }
}

//! Everything that one key does, with its name in the settings, its usual key and its words.
//!
//! The abort is not among them: its keys cannot be changed. What commands the vehicle only opens a dialog.

use std::time::Duration;

use protocol::dialect::TdPhase;

use super::page::Page;
use super::{Model, Role, permits};
use crate::key::Key;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Act {
    /// Open the dialog that arms.
    Arm,
    /// Open the dialog that starts the countdown.
    Start,
    /// Open the dialog that disarms.
    Disarm,
    /// Open the dialog that holds the countdown.
    HoldCountdown,
    /// Tap: our operator has confirmed the start and is still there.
    Tap,
    /// Open the dialog that takes command.
    TakeCommand,
    /// Open the dialog that checks the vehicle; end the check that runs.
    Check,
    /// The same for a check without motion.
    CheckStill,
    /// Begin the radio range test.
    RangeTest,
    Acknowledge,
    /// Show the checklist on the Pad page, or the arming checks again.
    Checklist,
    /// Show the flight just flown again.
    ReplayFlight,
    /// Write the report of the flight.
    Report,
    /// Fetch the vehicle's own log.
    Download,
    /// Open the dialog that signs the chosen step of the checklist.
    SignStep,
    /// Open the dialog that takes the signature of the chosen step back.
    VoidStep,
    Show(Page),
    Hold,
    Follow,
    Filter,
    Palette,
    Pin,
    NextTheme,
    AskParameters,
    Redraw,
    Quit,
}

/// An action, its name in the settings, its usual key, and what it does.
pub struct Definition {
    pub act: Act,
    pub name: &'static str,
    pub usual: Key,
    pub words: &'static str,
}

const fn define(act: Act, name: &'static str, usual: Key, words: &'static str) -> Definition {
    Definition { act, name, usual, words }
}

/// Every action; the most important first.
pub const DEFINITIONS: [Definition; 40] = [
    define(Act::Arm, "arm", Key::Char('A'), "arm: then type ARM and Enter within 10 s"),
    define(Act::Start, "start", Key::Char('S'), "start the countdown: then type START and Enter within 10 s"),
    define(Act::Disarm, "disarm", Key::Char('D'), "disarm: then Enter within 5 s"),
    define(Act::HoldCountdown, "hold-countdown", Key::Char('H'), "hold the countdown: then Enter within 5 s"),
    define(
        Act::Tap,
        "tap",
        Key::Char('T'),
        "two people: tap at least every 2 s, from the start to the release",
    ),
    define(
        Act::TakeCommand,
        "take",
        Key::Char('C'),
        "take command from a silent station: then TAKE and Enter",
    ),
    define(Act::Check, "check", Key::Char('X'), "check the vehicle: then Enter; fins and gimbal MOVE"),
    define(Act::CheckStill, "check-still", Key::Char('E'), "the same check without motion: then Enter"),
    define(Act::RangeTest, "range-test", Key::Char('U'), "radio range test: 30 s, nothing is commanded"),
    define(Act::Acknowledge, "acknowledge", Key::Char(' '), "acknowledge the shown alarm"),
    define(
        Act::Checklist,
        "checklist",
        Key::Char('k'),
        "the checklist on the Pad page; Up and Down choose a step",
    ),
    define(
        Act::SignStep,
        "sign",
        Key::Char('G'),
        "sign the chosen step of the checklist: then Enter within 5 s",
    ),
    define(Act::VoidStep, "void", Key::Char('V'), "take a step's signature back: then Enter within 5 s"),
    define(Act::Show(Page::Pad), "pad", Key::Char('1'), "page: arming checks and ladder"),
    define(Act::Show(Page::Descent), "flight", Key::Char('2'), "page: ascent and descent"),
    define(Act::Show(Page::Landing), "landing", Key::Char('3'), "page: the burn"),
    define(Act::Show(Page::Review), "review", Key::Char('4'), "page: verdict, greatest values, timeline"),
    define(Act::Show(Page::Link), "link", Key::Char('5'), "page: link rates and the age of every message"),
    define(Act::Show(Page::Messages), "texts", Key::Char('6'), "page: events and messages"),
    define(Act::Show(Page::Parameters), "parameters", Key::Char('7'), "page: parameters of the vehicle"),
    define(Act::Show(Page::Log), "log", Key::Char('8'), "page: the recording"),
    define(Act::Show(Page::Alarms), "alarms", Key::Char('9'), "page: every alarm"),
    define(Act::Show(Page::Path), "path", Key::Char('p'), "page: the flight from two sides and from above"),
    define(
        Act::Show(Page::Find),
        "find",
        Key::Char('f'),
        "page: where to look for the vehicle, and the way there",
    ),
    define(
        Act::Show(Page::Checks),
        "checks",
        Key::Char('x'),
        "page: checks on the pad, radio range, battery and storage",
    ),
    define(
        Act::Show(Page::Values),
        "values",
        Key::Char('v'),
        "page: every value, with the solver's residuals",
    ),
    define(Act::Show(Page::Plot), "plot", Key::Char('t'), "page: one number over time"),
    define(Act::Show(Page::Help), "help", Key::Char('?'), "page: the keys that work now"),
    define(Act::Hold, "hold", Key::Char('h'), "hold this page, or follow the flight again"),
    define(Act::Follow, "follow", Key::Char('0'), "follow the flight again (Esc does too)"),
    define(Act::Filter, "filter", Key::Char('/'), "show only events, messages or parameters with a text"),
    define(Act::Palette, "palette", Key::Char(':'), "list every action; type a part of its words"),
    define(Act::Pin, "pin", Key::Char('i'), "pin the plotted number to every page, or remove it"),
    define(Act::NextTheme, "theme", Key::Char('c'), "colours: dark, light for sunlight, 16, none, contrast"),
    define(
        Act::ReplayFlight,
        "replay",
        Key::Char('R'),
        "the flight just flown, again on this screen; q ends it",
    ),
    define(Act::Report, "report", Key::Char('W'), "write the report of the flight beside the log"),
    define(Act::Download, "download", Key::Char('L'), "fetch the vehicle's own log; disarmed on the ground"),
    define(Act::AskParameters, "ask", Key::Char('r'), "ask the vehicle for its parameters again"),
    define(Act::Redraw, "redraw", Key::CtrlL, "draw the screen again"),
    define(Act::Quit, "quit", Key::Char('q'), "quit; armed or in flight: then type QUIT and Enter"),
];

/// Whether a flight has been flown that this screen's log holds, and nothing is at risk.
fn flown_here(model: &Model) -> bool {
    let is_live = model.settings.role != Role::Replaying;
    is_live && model.outcome.started && model.settings.log_path.is_some() && !model.is_at_risk()
}

/// Whether the vehicle is down and nothing is at risk: it may have a log to offer.
fn is_down(model: &Model) -> bool {
    let phase = model.vehicle.phase().map(|phase| phase.value);
    !model.is_at_risk() && matches!(phase, Some(TdPhase::TD_PHASE_TOUCHDOWN | TdPhase::TD_PHASE_SAFED))
}

impl Act {
    /// Whether the key would do something now.
    pub fn works(self, model: &Model, now: Duration) -> bool {
        let commands = model.settings.role.why_not_command().is_none();
        let acts = permits::why_not_here(model).is_none();
        match self {
            Self::Arm => acts && permits::why_not_arm(model, now).is_none(),
            Self::Start => acts && permits::why_not_start(model, now).is_none(),
            Self::Disarm => acts && model.vehicle.armed().is_some_and(|armed| armed.value),
            Self::HoldCountdown => {
                commands && model.vehicle.countdown_s().is_some_and(|left| left.value > 0.0)
            }
            Self::Tap => acts && model.tapping(now).is_some_and(|(by, _)| by == model.own_number()),
            Self::TakeCommand => acts && permits::why_not_take(model, now).is_none(),
            Self::RangeTest => commands && permits::why_not_check(model, now).is_none(),
            Self::Check | Self::CheckStill => acts && permits::why_not_check(model, now).is_none(),
            Self::Acknowledge => !model.alarms.list().is_empty() && model.settings.role != Role::Replaying,
            Self::Follow => model.pages.held.is_some(),
            Self::Pin => matches!(model.page(), Page::Plot),
            Self::AskParameters => model.page() == Page::Parameters && model.settings.role != Role::Replaying,
            Self::Checklist => model.checklist.is_some(),
            Self::ReplayFlight => flown_here(model),
            Self::Report => commands && flown_here(model),
            Self::Download => commands && is_down(model),
            Self::SignStep | Self::VoidStep => commands && model.checklist.is_some(),
            Self::Show(_)
            | Self::Hold
            | Self::Filter
            | Self::Palette
            | Self::NextTheme
            | Self::Redraw
            | Self::Quit => true,
        }
    }

    pub fn definition(self) -> &'static Definition {
        let place = DEFINITIONS.iter().position(|definition| definition.act == self);
        &DEFINITIONS[place.unwrap_or(0)]
    }

    /// Whether it opens a dialog that commands the vehicle.
    pub fn opens_ladder(self) -> bool {
        matches!(
            self,
            Self::Arm
                | Self::Start
                | Self::Disarm
                | Self::HoldCountdown
                | Self::Tap
                | Self::TakeCommand
                | Self::Check
                | Self::CheckStill
                | Self::RangeTest
                | Self::SignStep
                | Self::VoidStep
        )
    }

    /// Whether it changes only what is shown, or opens a dialog: it works however fast its key arrives.
    pub fn only_shows_or_asks(self, model: &Model) -> bool {
        match self {
            Self::Tap | Self::RangeTest => false,
            Self::Quit => model.is_at_risk(),
            act if act.opens_ladder() => true,
            act => matches!(
                act,
                Self::Checklist
                    | Self::Show(_)
                    | Self::Hold
                    | Self::Follow
                    | Self::Filter
                    | Self::Palette
                    | Self::Pin
                    | Self::NextTheme
                    | Self::Redraw
            ),
        }
    }
}

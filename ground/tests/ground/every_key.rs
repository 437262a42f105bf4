//! Every key in every state and role: it does what the help page says of it, and a key that the
//! page does not list says why.

use std::time::Duration;

use ground::key::Key;
use ground::model::{Act, CommandKind, DEFINITIONS, Page, Role};
use ground::update::{Action, Msg, Request};

use crate::pictures::states;
use crate::rig::Rig;

/// What a key has done, besides texts.
fn has_acted(rig: &Rig, before: (Page, Option<Page>)) -> bool {
    let is_act = |action: &Action| {
        matches!(
            action,
            Action::Request(_)
                | Action::MovePin(_)
                | Action::NextTheme
                | Action::Redraw
                | Action::LeaveScreen
                | Action::Quit
        )
    };
    let model = &rig.model;
    model.dialog.is_some()
        || model.pages.entry.is_some()
        || (model.page(), model.pages.held) != before
        || rig.actions.iter().any(is_act)
}

/// Whether a request commands the vehicle or writes a file.
fn is_forbidden(action: &Action) -> bool {
    // The station itself judges a tap, which must not wait for a screen's telemetry.
    let is_allowed =
        |request: &Request| matches!(request, Request::Acknowledge(_) | Request::Command(CommandKind::Tap));
    match action {
        Action::Request(request) => !is_allowed(request),
        Action::Send(_) | Action::WriteReport | Action::MovePin(_) => true,
        _ => false,
    }
}

#[test]
fn every_key_does_what_the_help_page_states_in_every_state_and_role() {
    let mut wrong = Vec::new();
    for definition in &DEFINITIONS {
        for (state, mut rig) in states() {
            for role in [Role::Replaying, Role::Watching, Role::Attached, Role::Station] {
                rig.model.settings.role = role;
                let (act, events) = (definition.act, rig.events());
                let works = act.works(&rig.model, rig.now);
                let before = (rig.model.page(), rig.model.pages.held);
                rig.actions.clear();
                rig.key(definition.key);
                if act == Act::Quit {
                    // Only a pause shows that no word follows.
                    let ticks = matches!(role, Role::Station | Role::Replaying);
                    rig.now += Duration::from_secs(1);
                    rig.msg(if ticks { Msg::Tick } else { Msg::ScreenTick });
                }
                let said = rig.events().replacen(&events, "", 1);
                let acted = has_acted(&rig, before);
                let refused =
                    ["cannot ", "no report: ", "NOTHING WAS SENT"].iter().any(|words| said.contains(words));
                let name = format!("{} in {state} as {role:?}: {said:?}", definition.name);
                let answer = rig.events().lines().next_back().unwrap_or_default().to_owned();
                let begins: String = answer.chars().take(20).collect();
                let is_elsewhere = act == Act::Acknowledge || rig.model.dialog.is_some();
                if !said.is_empty() && !is_elsewhere && !rig.screen(80, 24).contains(&begins) {
                    wrong.push(format!("its answer is not on the smallest screen: {name}"));
                }
                if works && (refused || !(acted || is_shown(act, &rig, before))) {
                    wrong.push(format!("listed and does nothing: {name}"));
                }
                if !works && rig.actions.iter().any(is_forbidden) {
                    wrong.push(format!("acts and is not listed: {name}"));
                }
                if !works && !acted && said.is_empty() && !matches!(act, Act::Follow | Act::Acknowledge) {
                    wrong.push(format!("does nothing and says nothing: {name}"));
                }
                rig.model.dialog = None;
                rig.model.pages.entry = None;
                rig.model.pages.hold(None);
                // A refused key takes the letters of its word with it.
                rig.key(Key::Escape);
            }
        }
    }
    assert!(wrong.is_empty(), "{} wrong:\n{}", wrong.len(), wrong.join("\n"));
}

/// A page that is shown already stays.
fn is_shown(act: Act, rig: &Rig, before: (Page, Option<Page>)) -> bool {
    match act {
        Act::Show(page) => rig.model.page() == page || before.0 == page,
        Act::Checklist | Act::Acknowledge => true,
        _ => false,
    }
}

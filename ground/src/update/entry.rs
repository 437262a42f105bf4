//! The keys while a text is typed: a filter of a list, or a part of an action's words in the palette.

use std::time::Duration;

use super::keys;
use crate::key::Key;
use crate::model::Model;
use crate::model::act::Act;
use crate::model::page::{Page, TextEntry};
use crate::model::palette::{self, Does};

/// The longest text.
const TYPED_MAX: usize = 30;

/// Opens the filter of the shown list; on a page without one, of the events.
pub(super) fn open_filter(model: &mut Model) {
    if !model.page().has_filter() {
        model.pages.hold(Some(Page::Messages));
    }
    model.pages.entry = Some(TextEntry::Filter);
}

pub(super) fn open_palette(model: &mut Model) {
    model.pages.entry = Some(TextEntry::Palette { typed: String::new(), chosen: 0 });
}

/// A key while a text is typed. Esc gives up; the keys of the abort never come here.
pub(super) fn on_key(model: &mut Model, key: Key, now: Duration) {
    match model.pages.entry.take() {
        None => {}
        Some(TextEntry::Filter) => on_filter_key(model, key),
        Some(TextEntry::Palette { typed, chosen }) => on_palette_key(model, (typed, chosen), key, now),
    }
}

fn on_filter_key(model: &mut Model, key: Key) {
    match key {
        Key::Enter => return,
        Key::Escape => return model.pages.filter.clear(),
        _ => edit(&mut model.pages.filter, key),
    }
    model.pages.scroll = 0;
    model.pages.entry = Some(TextEntry::Filter);
}

fn on_palette_key(model: &mut Model, (mut typed, mut chosen): (String, usize), key: Key, now: Duration) {
    match key {
        Key::Escape => return,
        Key::Enter => {
            let entry = palette::found(model, &typed).into_iter().nth(chosen);
            return match entry.map(|entry| entry.does) {
                Some(Does::Act(act)) if model.key_timing.hurried && !act.only_shows_or_asks(model) => {
                    keys::drop_run(model, now);
                }
                Some(does) => perform(model, does, now),
                None => {}
            };
        }
        Key::Up => chosen = chosen.saturating_sub(1),
        Key::Down => chosen = (chosen + 1).min(palette::found(model, &typed).len().saturating_sub(1)),
        _ => {
            edit(&mut typed, key);
            chosen = 0;
        }
    }
    model.pages.entry = Some(TextEntry::Palette { typed, chosen });
}

/// Does what an entry of the palette says. It goes the way of its key, so it never does more than the key.
fn perform(model: &mut Model, does: Does, now: Duration) {
    match does {
        // Enter has chosen it, and a held Enter would confirm it.
        Does::Act(act @ (Act::Disarm | Act::HoldCountdown)) => {
            let key = model.settings.keys.name(act);
            let does = if act == Act::Disarm { "disarm" } else { "hold" };
            model.info(now, format!("press {key}, then Enter: only these keys {does}"));
        }
        Does::Act(act @ (Act::SignStep | Act::VoidStep)) => {
            let key = model.settings.keys.name(act);
            model.info(now, format!("press {key}, then Enter: only these keys sign or void"));
        }
        Does::Act(act @ Act::Tap) => {
            let key = model.settings.keys.name(act);
            model.info(now, format!("press {key}: only this key taps"));
        }
        Does::Act(act) => keys::perform(model, act, now),
        Does::TellAbort => model.info(now, "press Ctrl-X, then Enter: only these keys abort"),
        Does::Plot(quantity) => {
            model.pages.plotted = quantity;
            keys::perform(model, Act::Show(Page::Plot), now);
        }
        Does::Pin(quantity) => model.pages.pin(quantity),
    }
}

fn edit(text: &mut String, key: Key) {
    match key {
        Key::Backspace => drop(text.pop()),
        Key::Char(letter) if text.chars().count() < TYPED_MAX => text.push(letter),
        _ => {}
    }
}

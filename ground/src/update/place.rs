//! Follows the last place of the vehicle, and has it kept, so that a lost vehicle can be found also after a restart.

use std::time::Duration;

use super::Action;
use crate::model::{Model, Role};

/// How often it is kept in flight.
const KEPT_EVERY: Duration = Duration::from_secs(2);

pub(super) fn pass(model: &mut Model, now: Duration) {
    if model.place_due.is_some_and(|due| now < due) {
        return;
    }
    model.place_due = Some(now + KEPT_EVERY);
    let Some(place) = model.last_place(now).filter(|place| model.place.as_ref() != Some(place)) else {
        return;
    };
    model.place = Some(place);
    if model.settings.role == Role::Station {
        model.outbox.push(Action::KeepPlace(Box::new(place)));
    }
}

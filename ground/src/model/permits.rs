//! Whether the ground may command to arm and to start.

use std::time::Duration;

use protocol::dialect::{TdAct, TdPhase};

use protocol::identity::Address;

use super::boot::GONE_AFTER;
use super::seat::Seat;
use super::two_person::Ask;
use super::vehicle::is_on_pad;
use super::{Model, Settings, words};

/// Why nothing that can move is commanded now: it is not certain which vehicle, or which station, would be obeyed.
pub fn why_nothing_moves(model: &Model, now: Duration) -> Option<String> {
    let Settings { us, vehicle: of, .. } = &model.settings;
    let vehicle = &model.vehicle;
    if vehicle.beside(now).is_some() {
        return Some(format!("TWO VEHICLES under id {}: switch one off", of.system_id));
    }
    if let Some(foreign) =
        vehicle.foreign.as_ref().filter(|foreign| now.saturating_sub(foreign.heard_at) < GONE_AFTER)
    {
        return Some(format!("not a Touchdown vehicle: {}", foreign.name()));
    }
    if vehicle.status.is_none() {
        return Some("it is not known yet what the vehicle is: it has told no flight status".to_owned());
    }
    let Address { system_id, component_id } = us;
    let same = "another station uses our id";
    model
        .link
        .shares_our_id(now)
        .then(|| format!("{same} {system_id}/{component_id}: give one another --sysid"))
}

/// Why this seat does not act with the station's key. A hold and an abort are anybody's.
pub fn why_not_seat(model: &Model, by: &Seat) -> Option<String> {
    let owner = model.settings.key_owner.as_ref()?;
    let is_theirs = by.operator == owner.name || *by == Seat::automatic();
    let name = &owner.name;
    (!is_theirs).then(|| {
        format!("this station signs as {name}: only a screen of {name} does that (a hold, an abort anybody)")
    })
}

/// Why the person at this screen commands nothing but a hold and an abort; `None` if they may more.
pub fn why_not_here(model: &Model) -> Option<String> {
    let by_role = model.settings.role.why_not_command().map(str::to_owned);
    by_role.or_else(|| why_not_seat(model, &model.settings.seat)).or_else(|| why_no_key(model))
}

/// Why the ground does not command to arm. Failing checks are left for the vehicle to refuse, with its own text.
pub fn why_not_arm(model: &Model, now: Duration) -> Option<String> {
    if !model.link.state(now).carries() {
        return Some("the vehicle is not heard".to_owned());
    }
    if let Some(why) = why_nothing_moves(model, now) {
        return Some(why);
    }
    if model.vehicle.armed().is_some_and(|armed| armed.value) {
        return Some("armed already".to_owned());
    }
    if !model.link.uplink.is_proven(now) {
        let why = model.link.uplink.why_unheard();
        return Some(format!("the uplink is not proven: {why}"));
    }
    let why = why_no_key(model).or_else(|| why_other_mission(model)).or_else(|| model.why_checklist(now));
    if why.is_some() {
        return why;
    }
    let Some(phase) = model.vehicle.phase().map(|phase| phase.value) else {
        return Some("the phase is unknown".to_owned());
    };
    // Last: it is the only reason that the crew can overrule.
    if is_on_pad(phase) { model.why_no_log(now) } else { Some(format!("phase {}", words::phase(phase))) }
}

/// Whether this reason is that the station's log is unfit, so that the crew may go on without it.
pub fn is_only_the_log(model: &Model, why: &str, now: Duration) -> bool {
    model.why_no_log(now).as_deref() == Some(why)
}

/// Why the ground does not command to start the countdown.
pub fn why_not_start(model: &Model, now: Duration) -> Option<String> {
    if !model.link.state(now).carries() {
        return Some("the vehicle is not heard".to_owned());
    }
    if let Some(why) = why_nothing_moves(model, now) {
        return Some(why);
    }
    if !model.vehicle.armed().is_some_and(|armed| armed.value) {
        return Some("not armed".to_owned());
    }
    if let Some(why) = why_no_key(model) {
        return Some(why);
    }
    let Some(phase) = model.vehicle.phase().map(|phase| phase.value) else {
        return Some("the phase is unknown".to_owned());
    };
    if phase != TdPhase::TD_PHASE_PAD_ARMED {
        return Some(format!("phase {}", words::phase(phase)));
    }
    model.why_no_log(now)
}

/// Why the ground does not confirm this ask.
pub fn why_not_confirm(model: &Model, ask: &Ask, now: Duration) -> Option<String> {
    match model.ask(now) {
        Some(waits) if waits.number == ask.number && waits.act == ask.act => {}
        _ => return Some("it is no longer asked".to_owned()),
    }
    match ask.act {
        TdAct::TD_ACT_START => why_not_start(model, now),
        _ => why_not_arm(model, now),
    }
}

/// Why the ground asks for no check of the vehicle, and tests no radio.
pub fn why_not_check(model: &Model, now: Duration) -> Option<String> {
    if !model.link.state(now).carries() {
        return Some("the vehicle is not heard".to_owned());
    }
    if let Some(why) = why_nothing_moves(model, now) {
        return Some(why);
    }
    if model.vehicle.armed().is_some_and(|armed| armed.value) {
        return Some("armed: disarm first".to_owned());
    }
    if let Some(why) = why_no_key(model) {
        return Some(why);
    }
    let phase = model.vehicle.phase().map(|phase| phase.value);
    match phase {
        None => Some("the phase is unknown".to_owned()),
        Some(phase) => (!is_on_pad(phase)).then(|| format!("phase {}", words::phase(phase))),
    }
}

/// Why the ground does not take command.
pub fn why_not_take(model: &Model, now: Duration) -> Option<String> {
    if !model.link.state(now).carries() {
        return Some("the vehicle is not heard".to_owned());
    }
    if let Some(why) = why_nothing_moves(model, now) {
        return Some(why);
    }
    if !model.vehicle.armed().is_some_and(|armed| armed.value) {
        return Some("not armed".to_owned());
    }
    if model.link.uplink.armed_by_us {
        return Some("this station commands already".to_owned());
    }
    why_no_key(model)
}

/// Why a vehicle with operators would refuse everything that this station asks.
fn why_no_key(model: &Model) -> Option<String> {
    let observes = model.people().is_some() && model.settings.key_owner.is_none();
    observes.then(|| "no operator's key here (--crew, --operator): this station looks on".to_owned())
}

/// Why the vehicle is not the one that this station is prepared for.
pub fn why_other_mission(model: &Model) -> Option<String> {
    let ours = model.settings.mission?;
    match &model.vehicle.mission {
        Some((theirs, _)) if *theirs == ours => None,
        Some((theirs, name)) => Some(format!("the vehicle flies {name} {theirs}, --mission is {ours}")),
        None => Some(format!("the vehicle has not said whether it flies {ours} (--mission)")),
    }
}

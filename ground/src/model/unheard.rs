//! What to say while the vehicle has never been heard, and while frames are refused for their signature.

use std::time::Duration;

use protocol::signing::SigningCounters;

use super::link_state::LinkState;
use super::{Model, Role};

/// A vehicle that is switched on sends a HEARTBEAT every second.
pub const HINTS_AFTER: Duration = Duration::from_secs(5);
/// Refused frames raise an alarm for this long after the last of them.
const REFUSED_SHOWN: Duration = Duration::from_secs(5);

/// What to check, the most likely first; `None` once the vehicle was heard, and in the first seconds.
pub fn hints(model: &Model, now: Duration) -> Option<Vec<String>> {
    let live = model.settings.role != Role::Replaying && model.link.station_silence(now).is_none();
    if !live || now < HINTS_AFTER || model.link.state(now) != LinkState::NeverHeard {
        return None;
    }
    let id = model.settings.vehicle.system_id;
    let link = &model.settings.link_name;
    let framing = &model.link.framing;
    let mut hints = vec![format!("Nothing heard from system {id} for {} s on {link}.", now.as_secs())];
    hints.extend(model.link.trouble.as_ref().map(|why| format!("The link does not work: {why}.")));
    hints.extend(refused(model, now));
    let others: Vec<String> = model.link.strangers.iter().map(|other| other.system_id.to_string()).collect();
    if !others.is_empty() {
        hints.push(format!("Heard instead: system {}. Choose it with --vehicle.", others.join(", ")));
    } else if framing.frames == 0 && framing.garbage_bytes > 0 {
        hints.push("Bytes come, but no MAVLink: is the baud rate right?".to_owned());
    }
    hints.push(what_the_link_does(link));
    hints.push("Is the vehicle switched on, and its antenna fitted?".to_owned());
    Some(hints)
}

/// What the station does on its link, and so what the other end has to do.
fn what_the_link_does(link: &str) -> String {
    let (kind, rest) = link.split_once(':').unwrap_or((link, ""));
    match kind {
        "udpin" => format!("It listens on {rest}: does the vehicle send to that port here?"),
        "udpout" => format!("It sends to {rest}: does the vehicle listen there?"),
        "tcpin" => format!("It waits on {rest}: does the vehicle connect to it?"),
        "tcpout" => format!("It connects to {rest}: does the vehicle serve there?"),
        _ => "Are port and baud rate those of the radio, and both radios paired?".to_owned(),
    }
}

/// How many frames were refused for their signature, while that goes on and the vehicle is not heard.
pub fn refused(model: &Model, now: Duration) -> Option<String> {
    let goes_on = now.saturating_sub(model.link.refused_at?) < REFUSED_SHOWN;
    let counts: SigningCounters =
        model.link.signing.filter(|_| goes_on && !model.link.state(now).carries())?;
    let why = if counts.wrong >= counts.unsigned.max(counts.too_old) {
        "is --key the vehicle's key?"
    } else if counts.unsigned >= counts.too_old {
        "they are not signed: the vehicle has no key"
    } else {
        "their time is too old: see the clocks"
    };
    Some(format!("{} frames REFUSED, wrong signature: {why}", counts.rejected()))
}

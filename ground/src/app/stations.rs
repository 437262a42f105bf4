//! Finds, lists and stops this user's stations.

use std::io;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::Context as _;
use futures_util::StreamExt as _;
use protocol::identity::Address;
use protocol::transport::LinkAddress;
use serde_json::json;
use tokio::io::AsyncWriteExt as _;

use super::output::{absolute, print};
use super::station::Attached;
use crate::attach::codec::{decode_to_screen, encode_to_station, messages};
use crate::attach::{StationStatus, ToScreen, ToStation, socket};
use crate::exit::Exit;
use crate::model::{Model, Seat, why_not_stop, words};

/// How long a station may take to answer.
const ANSWERS_WITHIN: Duration = Duration::from_secs(5);
/// How long a station may take to end and finish its log.
const ENDS_WITHIN: Duration = Duration::from_secs(10);
const LOOK_AGAIN_AFTER: Duration = Duration::from_millis(50);

/// The status of this station.
pub(super) fn of(model: &Model, screens: &[Attached]) -> StationStatus {
    let settings = &model.settings;
    let vehicle = &model.vehicle;
    let kind = match settings.demonstration {
        true => "DEMO",
        false if vehicle.boot.is_simulated() => "SIM",
        false => "LIVE",
    };
    let watching = screens.iter().filter(|one| one.watch).map(|one| format!("{} (watches)", one.seat));
    let silent = model.crew.silent().iter().map(|(seat, why)| format!("{seat} ({why})"));
    let screens = model.crew.seats().iter().map(Seat::to_string).chain(silent).chain(watching);
    let Address { system_id, component_id } = settings.vehicle;
    StationStatus {
        pid: std::process::id(),
        link: settings.link_name.clone(),
        demonstration: settings.demonstration,
        kind: kind.to_owned(),
        vehicle: vehicle.heartbeat.map(|_| format!("{system_id}/{component_id}")),
        boot_number: vehicle.boot.number().unwrap_or(0),
        phase: vehicle.phase_now().map_or_else(|| "phase unknown".to_owned(), words::phase),
        armed: vehicle.is_armed(),
        at_risk: model.is_at_risk(),
        log: settings.log_path.as_deref().map(absolute),
        screens: screens.collect(),
    }
}

/// Answers a request to stop this station.
pub(super) fn stopping(model: &Model, force: bool, now: Duration) -> ToScreen {
    let free = force || model.settings.demonstration;
    if let Some(why) = why_not_stop(model, now).filter(|_| !free) {
        return ToScreen::Stopping { stops: false, words: format!("{why}; --force ends the station anyway") };
    }
    let log = model.settings.log_path.as_deref().map_or_else(|| "none".to_owned(), absolute);
    ToScreen::Stopping { stops: true, words: format!("log: {log}") }
}

/// Sends one query to the station on this socket.
async fn query(path: &Path, request: &ToStation) -> io::Result<ToScreen> {
    let exchange = async {
        let (read, mut write) = socket::connect(path).await?.into_split();
        write.write_all(&encode_to_station(request)).await?;
        let bytes = messages(read).next().await.ok_or(ErrorKind::UnexpectedEof)??;
        Ok(decode_to_screen(&bytes).map_err(|error| io::Error::new(ErrorKind::InvalidData, error))?.0)
    };
    tokio::time::timeout(ANSWERS_WITHIN, exchange)
        .await
        .unwrap_or_else(|_elapsed| Err(io::Error::from(ErrorKind::TimedOut)))
}

/// A socket and the status of its station, or why it gives none.
type Found = (PathBuf, Result<StationStatus, String>);

/// Every station of this user. The sockets of killed stations are removed.
///
/// # Errors
/// The directory belongs to another user or cannot be read.
pub(super) async fn stations() -> io::Result<Vec<Found>> {
    let mut found = Vec::new();
    for path in socket::sockets()? {
        let status = match query(&path, &ToStation::Status).await {
            Ok(ToScreen::Status(status)) => Ok(status),
            Ok(_) => Err("unexpected answer".to_owned()),
            Err(error) if matches!(error.kind(), ErrorKind::ConnectionRefused | ErrorKind::NotFound) => {
                // The station has ended. If its socket cannot be removed, it is skipped again next
                // time.
                let _ = std::fs::remove_file(&path);
                continue;
            }
            Err(error) => Err(error.to_string()),
        };
        found.push((path, status));
    }
    Ok(found)
}

/// The named station, or the only one.
///
/// # Errors
/// No station runs, or several do.
pub(super) async fn the_station(named: Option<&Path>) -> anyhow::Result<PathBuf> {
    if let Some(path) = named {
        return Ok(path.to_owned());
    }
    let mut found = stations().await.context("looking for ground stations")?;
    match found.len() {
        0 => anyhow::bail!("no ground station of yours runs; start one with `ground daemon`"),
        1 => Ok(found.remove(0).0),
        _ => {
            anyhow::bail!(
                "several ground stations of yours run: add --socket and one of these sockets, as in `ground attach --socket PATH`\n{}",
                listed(&found)
            )
        }
    }
}

/// The only station over these links, for a screen that has lost its station.
pub(super) async fn station_over(links: &str) -> Option<PathBuf> {
    let found = stations().await.ok()?;
    let mut same = found.into_iter().filter(|(_, of)| of.as_ref().is_ok_and(|of| of.link == links));
    same.next().filter(|_| same.next().is_none()).map(|(path, _)| path)
}

/// As in `PAD_IDLE disarmed`.
fn state(StationStatus { phase, armed, .. }: &StationStatus) -> String {
    format!("{phase} {}", if *armed { "ARMED" } else { "disarmed" })
}

fn listed(found: &[Found]) -> String {
    let one = |(path, status): &Found| match (path.display(), status) {
        (path, Ok(status @ StationStatus { pid, link, kind, boot_number, log, screens, .. })) => {
            let boot = Some(*boot_number).filter(|boot| *boot > 0).map(words::boot);
            let boot = boot.map_or_else(String::new, |boot| format!(" boot {boot}"));
            let vehicle = status.vehicle.as_ref().map(|ids| format!("{ids} {kind}{boot}"));
            let (vehicle, state) = (vehicle.as_deref().unwrap_or("no vehicle"), state(status));
            let (log, screens) = (log.as_deref().unwrap_or("none"), screens.join("; "));
            let screens = if screens.is_empty() { "none" } else { &screens };
            format!(
                "pid {pid}  {link}  vehicle {vehicle}  {state}\n  socket {path}\n  log {log}\n  screens {screens}\n"
            )
        }
        (path, Err(why)) => format!("socket {path}  gives no status: {why}\n"),
    };
    found.iter().map(one).collect()
}

/// Adds to a failure to open an address the station that uses it.
///
/// # Errors
/// It was not opened.
pub(super) async fn explained<T>(opened: anyhow::Result<T>, endpoints: &[LinkAddress]) -> anyhow::Result<T> {
    let in_use = |cause: &(dyn std::error::Error + 'static)| {
        cause.downcast_ref::<io::Error>().is_some_and(|error| error.kind() == ErrorKind::AddrInUse)
    };
    let error = match opened {
        Err(error) if error.chain().any(in_use) => error,
        opened => return opened,
    };
    let places: Vec<String> = endpoints.iter().map(|endpoint| kind_and_port(&endpoint.to_string())).collect();
    let found = stations().await.unwrap_or_default();
    let holder = found.iter().find_map(|(_, status)| {
        let status = status.as_ref().ok()?;
        let mut links = status.link.split(" and ");
        links.any(|link| places.contains(&kind_and_port(link))).then_some(status)
    });
    Err(match holder {
        Some(status @ StationStatus { pid, link, .. }) => anyhow::anyhow!(
            "your ground station pid {pid} ({}) uses {link}: `ground attach` shows it, `ground stop` ends it",
            state(status)
        ),
        None => error.context("another program uses the address; none of your ground stations does"),
    })
}

/// Kind and port of a link: a port can be opened only once, whatever the address.
fn kind_and_port(link: &str) -> String {
    let kind = link.split(':').next().unwrap_or_default();
    let port = link.rsplit(':').next().unwrap_or_default();
    format!("{kind}:{port}")
}

/// `ground status`.
///
/// # Errors
/// The stations cannot be looked for.
pub async fn list(as_json: bool) -> anyhow::Result<Exit> {
    let found = stations().await.context("looking for ground stations")?;
    let text = match &found[..] {
        _ if as_json => {
            let one = |(socket, status): &Found| {
                let answer = status.as_ref().map(|status| json!(status));
                let mut one = answer.unwrap_or_else(|error| json!({ "error": error }));
                one["socket"] = json!(socket.display().to_string());
                one
            };
            format!("{:#}\n", found.iter().map(one).collect::<serde_json::Value>())
        }
        [] => "no ground station of yours runs\n".to_owned(),
        _ => listed(&found),
    };
    print(text.as_bytes()).map(|()| Exit::Yes)
}

/// `ground stop`: requests that the station ends, and waits for its end.
///
/// # Errors
/// No station runs, or several run.
pub async fn stop(named: Option<&Path>, force: bool, operator: String) -> anyhow::Result<Exit> {
    let path = the_station(named).await?;
    let request = ToStation::Stop { force, operator };
    let answer = query(&path, &request).await.with_context(|| format!("stopping {}", path.display()))?;
    let ToScreen::Stopping { stops, words } = answer else {
        anyhow::bail!("{} sent an unexpected answer", path.display());
    };
    if !stops {
        print(format!("refused: {words}\n").as_bytes())?;
        return Ok(Exit::RefusedOrAborted);
    }
    for _ in 0..ENDS_WITHIN.as_millis() / LOOK_AGAIN_AFTER.as_millis() {
        if socket::connect(&path).await.is_err() {
            print(format!("the station has ended; {words}\n").as_bytes())?;
            return Ok(Exit::Yes);
        }
        tokio::time::sleep(LOOK_AGAIN_AFTER).await;
    }
    anyhow::bail!("{} has not ended within {} s of the request", path.display(), ENDS_WITHIN.as_secs())
}

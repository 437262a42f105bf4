//! The stations of this user: found, listed, ended.

use std::fmt::Write as _;
use std::io::{self, ErrorKind, Write as _};
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::Context as _;
use protocol::transport::Endpoint;
use tokio::io::AsyncWriteExt as _;

use super::server::read_one;
use crate::attach::codec::{Asked, Status, Told, VERSION, decode_told, encode_asked};
use crate::attach::place;
use crate::exit::Exit;
use crate::model::seat::Seat;
use crate::model::{Model, words};

/// A station answers at once, unless its machine is very busy.
const ANSWERS_WITHIN: Duration = Duration::from_secs(5);
/// A station that was told to end has ended its log by then.
const ENDS_WITHIN: Duration = Duration::from_secs(10);
const LOOK_AGAIN_AFTER: Duration = Duration::from_millis(50);

/// How this station does.
pub(super) fn of(model: &Model, screens: &[(Seat, bool)]) -> Status {
    let settings = &model.settings;
    let vehicle = &model.vehicle;
    let boot = vehicle.status.as_ref().map_or(0, |status| status.value.boot_number);
    let boot = if boot == 0 { String::new() } else { format!(" boot {boot}") };
    let kind = match settings.demonstration {
        true => "DEMO",
        false if vehicle.is_simulated() => "SIM",
        false => "LIVE",
    };
    let heard = vehicle.heartbeat.is_some();
    let named = format!("{}/{} {kind}{boot}", settings.vehicle.system_id, settings.vehicle.component_id);
    let armed = vehicle.armed().is_some_and(|armed| armed.value);
    let phase = vehicle.phase().map_or_else(|| "phase unknown".to_owned(), |phase| words::phase(phase.value));
    let own = model.crew.seats().iter().find(|seat| **seat == settings.seat).map(Seat::to_string);
    let attached =
        screens.iter().map(|(seat, watch)| format!("{seat}{}", if *watch { " (watches)" } else { "" }));
    Status {
        pid: std::process::id(),
        link: settings.link_name.clone(),
        demonstration: settings.demonstration,
        vehicle: if heard { named } else { "not heard".to_owned() },
        phase: format!("{phase} {}", if armed { "ARMED" } else { "disarmed" }),
        at_risk: model.is_at_risk(),
        log: settings.log_path.clone().unwrap_or_default(),
        screens: own.into_iter().chain(attached).collect::<Vec<_>>().join("; "),
    }
}

/// Whether this station ends when it is asked to.
pub(super) fn stopping(model: &Model, force: bool) -> Told {
    let refused = model.is_at_risk() && !model.settings.demonstration && !force;
    let log = model.settings.log_path.as_deref().unwrap_or("none");
    let words = if refused {
        "the vehicle is armed or in flight; --force ends the station nevertheless".to_owned()
    } else {
        format!("log: {log}")
    };
    Told::Stopping { stops: !refused, words }
}

/// Asks the station on this socket one thing.
async fn ask(path: &Path, asked: &Asked) -> io::Result<Told> {
    let asking = async {
        let (mut read, mut write) = place::connect(path).await?.into_split();
        write.write_all(&encode_asked(asked)).await?;
        let bytes = read_one(&mut read).await.ok_or_else(|| io::Error::from(ErrorKind::UnexpectedEof))?;
        let (told, _) = decode_told(&bytes).map_err(|error| io::Error::new(ErrorKind::InvalidData, error))?;
        Ok(told)
    };
    tokio::time::timeout(ANSWERS_WITHIN, asking)
        .await
        .unwrap_or_else(|_elapsed| Err(io::Error::from(ErrorKind::TimedOut)))
}

/// A station of this user, and how it does, or why it does not say.
type Found = (PathBuf, Result<Status, String>);

/// Every station of this user. What a killed one has left is cleared away.
///
/// # Errors
/// Their directory is somebody else's, or cannot be read.
pub(super) async fn stations() -> io::Result<Vec<Found>> {
    let mut found = Vec::new();
    for path in place::places()? {
        let status = match ask(&path, &Asked::Status).await {
            Ok(Told::Status(status)) => Ok(status),
            Ok(Told::Hello(hello)) => {
                Err(format!("it speaks version {}, this program {VERSION}", hello.version))
            }
            Ok(_) => Err("it answers something else".to_owned()),
            Err(error) if matches!(error.kind(), ErrorKind::ConnectionRefused | ErrorKind::NotFound) => {
                // Nobody listens there any more; if it cannot be removed, it is only passed over again.
                let _ = std::fs::remove_file(&path);
                continue;
            }
            Err(error) => Err(error.to_string()),
        };
        found.push((path, status));
    }
    Ok(found)
}

/// The station that is meant: the one that was named, or the only one.
///
/// # Errors
/// There is none, or there are several.
pub(super) async fn the_station(named: Option<&Path>) -> anyhow::Result<PathBuf> {
    if let Some(path) = named {
        return Ok(path.to_owned());
    }
    let mut found = stations().await.context("looking for ground stations")?;
    match found.len() {
        0 => anyhow::bail!("no ground station of yours runs; start one with `ground daemon`"),
        1 => Ok(found.remove(0).0),
        _ => {
            anyhow::bail!("several ground stations of yours run; name one with --socket:\n{}", listed(&found))
        }
    }
}

/// The one station over these links, for a screen whose station is gone.
pub(super) async fn station_over(links: &str) -> Option<PathBuf> {
    let found = stations().await.ok()?;
    let mut same =
        found.into_iter().filter(|(_, status)| status.as_ref().is_ok_and(|status| status.link == links));
    same.next().filter(|_| same.next().is_none()).map(|(path, _)| path)
}

fn listed(found: &[Found]) -> String {
    let mut text = String::new();
    for (path, status) in found {
        // Writing into a String cannot fail.
        let _ = match status {
            Ok(status) => {
                let or = |text: &str, other: &str| {
                    if text.is_empty() { other.to_owned() } else { text.to_owned() }
                };
                let Status { pid, link, vehicle, phase, log, screens, .. } = status;
                let (log, screens) = (or(log, "none"), or(screens, "none"));
                writeln!(
                    text,
                    "pid {pid}  {link}  vehicle {vehicle}  {phase}\n  socket {}\n  log {log}\n  screens {screens}",
                    path.display()
                )
            }
            Err(why) => writeln!(text, "socket {}  does not say how it does: {why}", path.display()),
        };
    }
    text
}

/// Beside a demonstration: that a station runs, and how to reach it; in one line.
pub(super) async fn beside() -> Option<String> {
    // Whoever cannot look finds none: a demonstration needs none.
    let found = stations().await.ok()?;
    match &found[..] {
        [] => None,
        [(_, Ok(Status { pid, link, .. }))] => {
            Some(format!("a station runs: pid {pid}, {link}; `ground attach` shows it"))
        }
        _ => Some(format!(
            "{} stations run: `ground status` lists them, `ground attach` shows one",
            found.len()
        )),
    }
}

/// Why a link could not be opened: where the address is in use, by whom.
pub(super) async fn explain(error: anyhow::Error, endpoints: &[Endpoint]) -> anyhow::Error {
    let in_use = |cause: &(dyn std::error::Error + 'static)| {
        cause.downcast_ref::<io::Error>().is_some_and(|error| error.kind() == ErrorKind::AddrInUse)
    };
    if !error.chain().any(in_use) {
        return error;
    }
    let places: Vec<String> =
        endpoints.iter().map(|endpoint| listening_place(&endpoint.to_string())).collect();
    let found = stations().await.unwrap_or_default();
    let holder = found.iter().find_map(|(_, status)| {
        let status = status.as_ref().ok()?;
        let mut links = status.link.split(" and ");
        links.any(|link| places.contains(&listening_place(link))).then_some(status)
    });
    match holder {
        Some(Status { pid, link, phase, .. }) => error.context(format!(
            "your ground station pid {pid} ({phase}) holds {link}: `ground attach` gives a screen, `ground stop` ends it"
        )),
        None => error.context("another program holds the address, and none of your ground stations does"),
    }
}

/// Kind and port: one port can be listened on once, by whatever address.
fn listening_place(link: &str) -> String {
    let kind = link.split(':').next().unwrap_or_default();
    let port = link.rsplit(':').next().unwrap_or_default();
    format!("{kind}:{port}")
}

/// `ground status`.
///
/// # Errors
/// They cannot be looked for.
pub async fn list() -> anyhow::Result<Exit> {
    let found = stations().await.context("looking for ground stations")?;
    let text = if found.is_empty() { "no ground station of yours runs\n".to_owned() } else { listed(&found) };
    print(&text)?;
    Ok(Exit::Landed)
}

/// `ground stop`: asks the station to end, and waits until it has.
///
/// # Errors
/// None runs, several run, or it refuses.
pub async fn stop(named: Option<&Path>, force: bool, operator: String) -> anyhow::Result<Exit> {
    let path = the_station(named).await?;
    let asked = Asked::Stop { force, operator };
    let told = ask(&path, &asked).await.with_context(|| format!("asking {} to end", path.display()))?;
    let Told::Stopping { stops, words } = told else {
        anyhow::bail!("{} answers something else", path.display());
    };
    anyhow::ensure!(stops, "refused: {words}");
    for _ in 0..ENDS_WITHIN.as_millis() / LOOK_AGAIN_AFTER.as_millis() {
        if place::connect(&path).await.is_err() {
            print(&format!("the station has ended; {words}\n"))?;
            return Ok(Exit::Landed);
        }
        tokio::time::sleep(LOOK_AGAIN_AFTER).await;
    }
    anyhow::bail!("{} was told to end, and has not within {} s", path.display(), ENDS_WITHIN.as_secs())
}

fn print(text: &str) -> anyhow::Result<()> {
    let mut out = io::stdout().lock();
    out.write_all(text.as_bytes()).and_then(|()| out.flush()).context("writing to standard output")
}

//! `ground download`: fetches the vehicle's own log (MAVLink FTP) over a link of its own. It sends
//! no heartbeat, so that the vehicle cannot take it for a station that watches over it.
//! `protocol::ftp::download` decides what to request.

use std::fs::File;
use std::io;
use std::io::{Read as _, Seek as _, Write as _};
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::Context as _;
use protocol::ftp::download::{Download, DownloadEvent, GIVE_UP, Progress};
use protocol::ftp::{Packet, crc};
use protocol::log::recorder::{other_name, under_free_name};
use protocol::program::is_quiet;
use tokio::time::{MissedTickBehavior, interval};

use super::KeyRing;
use super::clock::{Clock, LogTime, Signals};
use super::output::print;
use super::stations::explained;
use super::wire::Wire;
use crate::cli::DownloadArgs;
use crate::exit::Exit;
use crate::update::Msg;

const TICK: Duration = Duration::from_millis(20);

/// Fetches the log over this program's own link.
///
/// # Errors
/// The link cannot be opened, the vehicle refuses, or a file cannot be written.
pub(in crate::app) async fn run_download(args: &DownloadArgs) -> anyhow::Result<Exit> {
    let DownloadArgs { name, out, link, .. } = args;
    let (us, vehicle) = (link.us(), link.vehicle());
    anyhow::ensure!(!link.connect.is_empty(), "no link to a vehicle: give --connect");
    let KeyRing { key, .. } = KeyRing::open(link)?;
    let clock = Clock::start();
    let log_time = LogTime::Run(clock);
    let opened = Wire::open((us, vehicle), link.connect.clone(), key, clock, None, log_time).await;
    let mut wire = explained(opened, &link.connect).await?;
    anyhow::ensure!(out.is_dir(), "--out {}: is no folder", out.display());
    let links: Vec<String> = wire.endpoints().map(ToString::to_string).collect();
    let (links, limit_s) = (links.join(", "), GIVE_UP.as_secs());
    report(&format!("waiting for system {} on {links}, up to {limit_s} s", vehicle.system_id));
    // Another number every millisecond: its requests differ from those of an earlier download.
    let mut download = Download::new(name.as_deref(), (clock.start_unix_ns() >> 20) as u16);
    let mut partial: Option<PartialLog> = None;
    let mut signals = Signals::listen()?;
    let mut ticks = interval(TICK);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Skip);
    let mut tenths_shown = 0;
    loop {
        let msgs = tokio::select! {
            biased;
            signal = signals.next() => {
                anyhow::bail!("stopped by {signal}; the same command resumes it");
            }
            received = wire.receive() => wire.take(received),
            _ = ticks.tick() => Vec::new(),
        };
        let now = clock.now();
        for msg in msgs {
            let frame = match msg {
                Msg::Frame(frame) => frame,
                Msg::LinkDown(why) | Msg::LinkWarning(why) => {
                    report(&why);
                    continue;
                }
                _ => continue,
            };
            let Some((target, packet)) = Packet::answer_in(&frame) else { continue };
            if target != us || frame.source() != vehicle {
                continue;
            }
            match download.take(&packet, now) {
                Some(DownloadEvent::Opened { crc }) => {
                    let name = download.name().unwrap_or_default();
                    let (opened, bytes) = PartialLog::open(out, vehicle.system_id, name, crc)?;
                    partial = Some(opened);
                    download.resume(bytes);
                }
                Some(DownloadEvent::Data(data)) => {
                    if let Some(partial) = &mut partial {
                        partial.file.write_all(&data)?;
                    }
                }
                None => {}
            }
        }
        for packet in download.poll(now) {
            wire.send(&packet.message(vehicle), 0);
        }
        if let Some(progress) = download.progress() {
            let tenths = 1 + 10 * u64::from(progress.bytes) / u64::from(progress.len.max(1));
            if tenths > std::mem::replace(&mut tenths_shown, tenths) {
                let name = download.name().unwrap_or_default();
                report(&format!("log {name}: {}", in_words(&progress)));
            }
        }
        if let Some(ended) = download.ended() {
            ended?;
            let path = partial.context("the vehicle's log has no content")?.finish()?;
            wire.save_timestamps();
            print(format!("log {}\n", path.display()).as_bytes())?;
            return Ok(Exit::Yes);
        }
    }
}

/// Reports what happens on the way. The download continues without a reader.
fn report(words: &str) {
    if !is_quiet() {
        let _ = writeln!(io::stderr(), "{words}");
    }
}

/// As in `1.20 of 10.00 MB, 3.6 kB/s, 41 min left`.
fn in_words(progress: &Progress) -> String {
    let megabytes = |bytes: u32| f64::from(bytes) / 1e6;
    let left = match progress.left_s {
        None => String::new(),
        Some(left_s) if left_s >= 90.0 => format!(", {:.0} min left", left_s / 60.0),
        Some(left_s) => format!(", {left_s:.0} s left"),
    };
    let (here, all) = (megabytes(progress.bytes), megabytes(progress.len));
    format!("{here:.2} of {all:.2} MB, {:.1} kB/s{left}", progress.bytes_s / 1000.0)
}

// The files of a download: the received beginning of the log, with the checksum of the complete log
// in its name (`.1A2B3C4D.part`), and the complete log. An existing log is preserved.

/// Bytes read at once for a checksum.
const READ_AT_ONCE: usize = 256 * 1024;

/// The files of one download.
#[derive(Debug)]
struct PartialLog {
    log: PathBuf,
    part: PathBuf,
    file: File,
    crc: u32,
}

impl PartialLog {
    /// Opens the file for the vehicle's log of this name and checksum, and returns the bytes of an
    /// earlier download.
    ///
    /// # Errors
    /// This log is here already, or a file cannot be created.
    fn open(folder: &Path, vehicle: u8, name: &str, crc: u32) -> anyhow::Result<(Self, u32)> {
        // The name comes over the air: it must not lead out of the folder.
        let is_plain = |letter: &char| letter.is_ascii_alphanumeric() || "._-".contains(*letter);
        let plain: String = name.chars().filter(is_plain).collect();
        let log = folder.join(format!("vehicle{vehicle}-{plain}"));
        let is_it = |mut file| checksum(&mut file).is_ok_and(|here| here == crc);
        anyhow::ensure!(!File::open(&log).is_ok_and(is_it), "{} is this log already", log.display());
        let part = folder.join(format!("vehicle{vehicle}-{plain}.{crc:08X}.part"));
        let opened = File::options().create(true).read(true).append(true).open(&part);
        let file = opened.with_context(|| format!("opening {}", part.display()))?;
        let bytes = u32::try_from(file.metadata()?.len())?;
        Ok((Self { log, part, file, crc }, bytes))
    }

    /// Gives the complete log its name, or the next free one.
    ///
    /// # Errors
    /// It differs from the vehicle's log, or the disk fails.
    fn finish(self) -> anyhow::Result<PathBuf> {
        let Self { log, part, mut file, crc } = self;
        if checksum(&mut file)? != crc {
            std::fs::remove_file(&part)?;
            anyhow::bail!("the download differs from the vehicle's log (checksum); fetch it again");
        }
        file.sync_all()?;
        // A link fails if the name is taken; a rename would overwrite. Some file systems have no
        // such links.
        let named = under_free_name(&log, |name| match std::fs::hard_link(&part, name) {
            Err(_) if name.symlink_metadata().is_err() => std::fs::rename(&part, name),
            linked => linked.and_then(|()| std::fs::remove_file(&part)),
        });
        let (free, ()) =
            named.with_context(|| format!("{}: the download is in {}", log.display(), part.display()))?;
        if let Some(words) = other_name(&log, &free) {
            print(format!("{words}\n").as_bytes())?;
        }
        Ok(free)
    }
}

fn checksum(file: &mut File) -> io::Result<u32> {
    file.rewind()?;
    let (mut sum, mut piece) = (0, vec![0; READ_AT_ONCE]);
    loop {
        let read = file.read(&mut piece)?;
        if read == 0 {
            return Ok(sum);
        }
        sum = crc::continued(sum, &piece[..read]);
    }
}

#[cfg(test)]
mod partial_log_tests {
    use super::*;

    const CRC: u32 = 0x5;

    fn open(folder: &Path, crc: u32) -> anyhow::Result<(PartialLog, u32)> {
        PartialLog::open(folder, 1, "../flight.mcap", crc)
    }

    #[test]
    fn the_beginning_survives_and_becomes_a_log_that_is_never_overwritten() {
        let folder = tempfile::tempdir().unwrap();
        let crc = crc::continued(0, b"abcdefg");
        let (mut partial, bytes) = open(folder.path(), crc).unwrap();
        assert_eq!(bytes, 0);
        partial.file.write_all(b"abc").unwrap();
        drop(partial);
        assert_eq!(open(folder.path(), CRC).unwrap().1, 0, "another log of this name");
        let (mut partial, bytes) = open(folder.path(), crc).unwrap();
        assert_eq!(bytes, 3);
        partial.file.write_all(b"defg").unwrap();
        let log = partial.finish().unwrap();
        assert_eq!(log, folder.path().join("vehicle1-..flight.mcap"));
        assert_eq!(std::fs::read(&log).unwrap(), b"abcdefg");
        let refused = open(folder.path(), crc).unwrap_err();
        assert_eq!(refused.to_string(), format!("{} is this log already", log.display()));
    }

    #[test]
    fn another_log_of_the_name_stays() {
        let folder = tempfile::tempdir().unwrap();
        let (mut partial, _) = open(folder.path(), crc::continued(0, b"new")).unwrap();
        partial.file.write_all(b"new").unwrap();
        let log = folder.path().join("vehicle1-..flight.mcap");
        std::fs::write(&log, "old").unwrap();
        assert_eq!(std::fs::read(partial.finish().unwrap()).unwrap(), b"new");
        assert_eq!(std::fs::read(log).unwrap(), b"old");
    }

    #[test]
    fn a_log_that_is_not_the_vehicle_s_gets_no_name_and_is_fetched_anew() {
        let folder = tempfile::tempdir().unwrap();
        let (mut partial, _) = open(folder.path(), CRC).unwrap();
        partial.file.write_all(b"damaged").unwrap();
        assert!(partial.finish().is_err());
        assert_eq!(open(folder.path(), CRC).unwrap().1, 0);
    }
}

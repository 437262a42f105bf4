//! Ends the log of a station that runs for days, and begins the next one beside it, while no
//! vehicle flies; also a log whose files were removed. All records are made in the run loop, so no
//! frame falls between the two logs. The book is closed in the one and opened in the other, whose
//! first entry names the log before and the end of its book.

use std::path::Path;
use std::sync::mpsc::{Receiver, TryRecvError};
use std::sync::{MutexGuard, PoisonError};
use std::time::Duration;

use protocol::book::BookKey;
use protocol::log::recorder::{Recorder, RecorderError};
use protocol::log::writer::LogHeader;

use super::background::{Outcome, Target};
use super::files::{GuardedLog, LogWatch, open_log};
use super::output::absolute;
use super::programs::in_a_thread;
use super::server::hello;
use super::station::Station;
use crate::cli::{LogChoice, StationArgs};
use crate::update::Msg;

/// A log of this size is ended: a day over a radio of 57,600 baud, which brings 490 MB.
const LONG_BYTES: u64 = 512 << 20;
/// If no next log can be created, it is tried again after this time.
const AGAIN_AFTER: Duration = Duration::from_hours(1);

/// The parts of the next log.
#[derive(Default)]
pub(super) struct NextLog {
    /// The name that was given.
    name: Option<LogChoice>,
    /// Times of the next log count from the start of the station, too.
    header: LogHeader,
    pub(super) book_key: Option<BookKey>,
    guarded: GuardedLog,
    /// The next one could not be created; when to try again.
    not_before: Duration,
    /// The next one is being created.
    begins: bool,
    /// The log before, while its end is written.
    pub(super) ending: Option<Receiver<Result<(), RecorderError>>>,
}

impl NextLog {
    pub(super) fn new(args: &StationArgs, header: LogHeader, guarded: GuardedLog) -> Self {
        Self { name: args.flags.log.clone(), header, guarded, ..Self::default() }
    }

    /// The present log; `None` if none is wanted.
    pub(super) fn guarded(&self) -> MutexGuard<'_, Option<Recorder>> {
        self.guarded.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

impl Station {
    /// Begins the next log if the present one is long and no vehicle flies, or immediately if it
    /// was removed.
    pub(super) fn rotate_log(&mut self) {
        let now = self.clock.now();
        let ended = self.next_log.ending.as_ref().map(Receiver::try_recv);
        if let Some(Ok(ended)) = &ended {
            self.next_log.ending = None;
            if let Err(why) = ended {
                self.model.warn(now, format!("the log before is not complete: {why}"));
            }
        }
        let is_long = self.log_watch.bytes() >= LONG_BYTES;
        let waits = now < self.next_log.not_before || matches!(ended, Some(Err(TryRecvError::Empty)));
        // A demonstration has one log, shared with its vehicle: it is written again at the end.
        let is_removed =
            self.model.log.removed && self.log_watch.removed && !self.model.settings.demonstration;
        if !waits && (is_removed || is_long && self.model.may_change_log(now)) {
            self.begin_next_log();
        }
    }

    /// Has the next log created.
    fn begin_next_log(&mut self) {
        // The crew sees a log that has failed; a new one would hide it.
        let before = self.recorder.clone().filter(|log| log.is_intact() && !self.next_log.begins);
        let Some(before) = before else { return };
        let (name, mut header) = (self.next_log.name.clone(), self.next_log.header.clone());
        header.run.insert("after".to_owned(), file_name(before.path()));
        self.next_log.begins = self.background.queue(Target::NextLog, move || {
            before.take_names();
            Outcome::NextLog(open_log(name.as_ref(), before.tlog_path().is_some(), &header))
        });
    }

    /// Continues in the next log, once it is created.
    pub(super) fn change_log(&mut self, next: anyhow::Result<Option<Recorder>>) {
        let now = self.clock.now();
        self.next_log.begins = false;
        let next = match next {
            Ok(Some(next)) => next,
            Ok(None) => return,
            Err(why) => {
                self.next_log.not_before = now + AGAIN_AFTER;
                return self.model.warn(now, format!("the log stays the same: {why:#}"));
            }
        };
        let Some(before) = &self.recorder else { return };
        let before_name = file_name(before.path());
        self.close_book(&format!("the log continues in {}", file_name(next.path())));
        let end_of_book = self.model.book.short().map_or_else(String::new, |end| format!(" with book {end}"));
        let before = self.next_log.guarded().replace(next.clone());
        self.wire.recorder = Some(next.clone());
        (self.recorder, self.log_watch) = (Some(next.clone()), LogWatch::default());
        // In a thread, because the disk may be slow. Without one the last handle is dropped,
        // and the recorder ends the log by itself.
        let end = |log: Recorder| in_a_thread("log end", move || log.finish().map(drop)).ok();
        self.next_log.ending = before.and_then(end);
        self.open_book(&format!(", after {before_name}{end_of_book}"));
        let log = absolute(&next.path().display().to_string());
        self.step(Msg::LogBegins { log });
        if let Some(server) = &mut self.server {
            server.greet_with(hello(&self.model));
        }
    }
}

#[cfg(test)]
mod tests {
    use std::net::UdpSocket;
    use std::path::PathBuf;

    use clap::Parser as _;
    use prost::Message as _;
    use protocol::book::{Audit, RecordedHead, SignedHead, audit, shown};
    use protocol::dialect::{HEARTBEAT_DATA, MavMessage};
    use protocol::log::record::{TOPIC_BOOK, TOPIC_BOOK_HEAD, TOPIC_RAW_TX};
    use protocol::log::{reader::LogItem, reader::LogReader, v1};

    use super::super::files::LogGuard;
    use super::super::{Clock, Duty, start};
    use super::*;
    use crate::cli::{Cli, Command};
    use crate::config::Config;

    /// The raw frames of a log, its book, and what is found of the book.
    fn read(path: &Path) -> (Vec<Vec<u8>>, Vec<v1::BookEntry>, Audit) {
        let mut reader = LogReader::new(std::fs::File::open(path).unwrap());
        let (mut frames, mut entries, mut heads) = (Vec::new(), Vec::new(), Vec::new());
        while let Some(item) = reader.next_item().unwrap() {
            let LogItem::Message { channel_id, data, .. } = item else { continue };
            match reader.channel(channel_id).unwrap().topic.as_str() {
                TOPIC_RAW_TX => frames.push(data),
                TOPIC_BOOK => entries.push(v1::BookEntry::decode(&data[..]).unwrap()),
                TOPIC_BOOK_HEAD => {
                    let signed = SignedHead::of_record(&v1::BookHead::decode(&data[..]).unwrap()).unwrap();
                    heads.push(RecordedHead { from: String::new(), by_vehicle: false, signed });
                }
                _ => {}
            }
        }
        assert_eq!(reader.damage(), None);
        let audited = audit(&entries, &heads, None);
        (frames, entries, audited)
    }

    /// Changes the log and waits for the disk.
    fn change_log(station: &mut Station) {
        let before = station.model.settings.log_path.clone();
        station.begin_next_log();
        while station.model.settings.log_path == before {
            std::thread::yield_now();
            station.take_outcomes();
        }
    }

    #[test]
    fn no_frame_is_lost_between_two_logs_and_both_books_are_complete() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
        let vehicle = UdpSocket::bind("127.0.0.1:0").unwrap();
        let link = format!("udpout:{}", vehicle.local_addr().unwrap());
        let [log, socket] = [path("flight.mcap"), path("station.sock")];
        let cli =
            Cli::try_parse_from(["ground", "daemon", "--connect", &link, "--log", &log, "--socket", &socket]);
        let Some(Command::Daemon { station: args }) = cli.unwrap().command else { panic!("a daemon") };
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        runtime.block_on(async {
            let clock = Clock::start();
            let header = LogHeader { start_unix_ns: clock.start_unix_ns(), ..LogHeader::default() };
            let guard = LogGuard::new(open_log(args.flags.log.as_ref(), true, &header).unwrap());
            let duty = Duty { is_daemon: true, interactive: false, time_limit: None, json: false };
            let next_log = NextLog::new(&args, header, std::sync::Arc::clone(&guard.0));
            let config = Config::default();
            let started = Box::pin(start(&args, &config, duty, (clock, None, None), next_log)).await;
            let mut station = started.unwrap();
            let say = |station: &mut Station| {
                for _ in 0..3 {
                    station.wire.send(&MavMessage::HEARTBEAT(HEARTBEAT_DATA::default()), 0);
                }
            };
            say(&mut station);
            station.rotate_log();
            assert_eq!(station.model.settings.log_path.as_deref(), Some(&*log), "a short log goes on");
            change_log(&mut station);
            say(&mut station);
            assert_eq!(super::super::stations::of(&station.model, &[]).log, Some(path("flight-2.mcap")));
            change_log(&mut station);
            say(&mut station);
            station.close_book("the station ends");
            Box::pin(station.close()).await;
            assert_eq!(guard.finish().unwrap(), Some(PathBuf::from(path("flight-3.mcap"))));
        });
        let logs = ["flight.mcap", "flight-2.mcap", "flight-3.mcap"].map(|name| read(Path::new(&path(name))));
        // The fifth byte of a frame is its number (MAVLink 2).
        let numbers: Vec<u8> =
            logs.iter().flat_map(|(frames, ..)| frames.iter().map(|frame| frame[4])).collect();
        assert!(
            numbers.len() >= 9 && numbers.iter().zip(0..).all(|(number, place)| *number == place),
            "{numbers:?}"
        );
        for (place, (frames, entries, audit)) in logs.iter().enumerate() {
            assert!(frames.len() >= 3 && audit.closed && audit.broken.is_none(), "{place}: {audit:?}");
            let Some((_, _, before)) = place.checked_sub(1).map(|before| &logs[before]) else { continue };
            let head = before.head.unwrap();
            let link = format!(" with book {}:{};", head.entries, shown(&head.hash));
            assert!(entries[0].text.contains(&link), "{}", entries[0].text);
        }
    }
}

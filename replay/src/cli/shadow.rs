//! `replay shadow`.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context as _, Result, bail};
use clap::Args;
use flight::rules::phase::Phase;
use protocol::frame::{Frame, Framer};
use protocol::hub::{Hub, News};
use protocol::log::record::{Direction, Event, EventLevel, RawFrame, Record};
use protocol::log::recorder::Recorder;
use protocol::log::writer::LogHeader;
use protocol::transport::{LinkAddress, Transport};
use replay::log::{Entry, FlightLog};
use replay::print::{ShadowReport, print_flag, print_json, print_shadow};
use replay::shadow::{Flag, Shadow};

use super::{Answer, answer, say, stop_on_interrupt, text_of};

/// How often a silent link is left to look for Ctrl-C.
const LOOK: Duration = Duration::from_millis(100);
/// Telemetry that still comes after the vehicle is on the ground is heard for so long.
const LINGERS: Duration = Duration::from_secs(3);

#[derive(Debug, Args)]
pub(super) struct Ask {
    /// A link (udpin:ADDRESS:PORT, udpout:…, tcp:…, serial:DEVICE:BAUD), or the log of a ground station or a vehicle.
    #[arg(long, value_name = "LINK|LOG")]
    connect: String,
    /// The mission or profile that the vehicle flies: a built-in name or a file [default: that of the log, if it has one].
    #[arg(long, value_name = "NAME|FILE")]
    profile: Option<String>,
    /// MAVLink system id of the vehicle.
    #[arg(long, default_value_t = 1)]
    vehicle_sysid: u8,
    /// End by itself three seconds after touchdown.
    #[arg(long)]
    once: bool,
    /// Where to record the frames and the flags [default: shadow-UNIXTIME.mcap, or LOG.shadow.mcap]; `none` records nothing.
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,
    /// Answer in JSON at the end, instead of lines as the frames arrive.
    #[arg(long)]
    json: bool,
}

/// The shadow with its log and its answer.
struct Listener {
    shadow: Shadow,
    system_id: u8,
    live: bool,
    recorder: Option<Recorder>,
    frames: u64,
    flags: Vec<Flag>,
}

impl Listener {
    /// Takes a frame that arrived at a time, ns since the log's start.
    fn take(&mut self, frame: &Frame, link: &str, time_ns: u64) -> Result<()> {
        if let (Some(recorder), Some(bytes)) = (&self.recorder, frame.for_log()) {
            let raw = RawFrame { direction: Direction::Rx, endpoint: "ground", link: link.to_owned(), bytes };
            recorder.record(Record::RawFrame(raw), time_ns);
        }
        if frame.source().system_id != self.system_id {
            return Ok(());
        }
        self.frames += 1;
        // A message that this build does not know shows nothing.
        let Ok(message) = frame.decode() else { return Ok(()) };
        for flag in self.shadow.heard(time_ns as f64 / 1e9, &message) {
            if let Some(recorder) = &self.recorder {
                let event = Event {
                    level: EventLevel::Warning,
                    name: "shadow".to_owned(),
                    message: flag.to_string(),
                };
                recorder.record(Record::Event(event), time_ns);
            }
            if self.live {
                answer(|output| print_flag(&flag, output).and_then(|()| output.flush()))?;
            }
            self.flags.push(flag);
        }
        Ok(())
    }

    fn is_down(&self) -> bool {
        matches!(self.shadow.phase(), Some(Phase::Touchdown | Phase::Safed))
    }
}

impl Ask {
    pub(super) fn run(self) -> Result<Answer> {
        let path = Path::new(&self.connect);
        let is_log = path.is_file();
        let mut source = is_log.then(|| FlightLog::open(path)).transpose()?;
        // The profile lies before the records.
        let first = source.as_mut().map(FlightLog::next_entry).transpose()?.flatten();
        let recorded = source.as_ref().and_then(|log| log.head().profile_toml.clone()).and_then(Result::ok);
        let header = LogHeader {
            writer: "replay shadow".to_owned(),
            start_unix_ns: match &first {
                Some(entry) => entry.log_time_ns,
                None => u64::try_from(since_epoch().as_nanos()).unwrap_or(0),
            },
            ..LogHeader::default()
        };
        let (shadow, profile_toml) = self.shadow(recorded)?;
        let log = self.log_path(is_log, &header);
        let header = LogHeader { profile_toml: Some(profile_toml), ..header };
        let recorder = log.as_deref().map(|log| Recorder::create(log, &header)).transpose()?;
        let mut listener = Listener {
            shadow,
            system_id: self.vehicle_sysid,
            live: !self.json,
            recorder,
            frames: 0,
            flags: Vec::new(),
        };
        let heard = match source {
            Some(log) => hear_log(&mut listener, log, first, header.start_unix_ns),
            None => self.hear_link(&mut listener),
        };
        // Whatever happened, the log is finished.
        let finished = listener.recorder.as_ref().map(Recorder::finish).transpose();
        if heard.is_err()
            && listener.frames == 0
            && let Some(recorder) = &listener.recorder
        {
            // No link: nothing was heard, so nothing stays.
            recorder
                .discard()
                .with_context(|| format!("{}: cannot be removed", recorder.path().display()))?;
        }
        heard?;
        let written = finished?;
        let Listener { shadow, frames, flags, .. } = listener;
        let report = ShadowReport {
            log: written.map(|path| path.display().to_string()),
            ..ShadowReport::new(self.connect.clone(), frames, flags, shadow.coverage())
        };
        answer(|output| if self.json { print_json(&report, output) } else { print_shadow(&report, output) })?;
        if frames == 0 {
            bail!("{}: no frame of system {} was heard", self.connect, self.vehicle_sysid);
        }
        Ok(Answer::Compared { within: report.flags.is_empty() })
    }

    /// The shadow of the profile asked for, or of the log's; with the profile's text.
    fn shadow(&self, recorded: Option<String>) -> Result<(Shadow, String)> {
        let (origin, text) = match (&self.profile, recorded) {
            (Some(name), _) => {
                let built_in = [vehicles::mission::BUILTIN, vehicles::profile::BUILTIN].concat();
                (name.clone(), text_of(name, &built_in, "profile")?)
            }
            (None, Some(text)) => (self.connect.clone(), text),
            (None, None) => {
                bail!("--profile is needed: telemetry does not say what the vehicle is made of")
            }
        };
        let shadow = if vehicles::mission::is_meant(&text) {
            Shadow::of_mission(&vehicles::mission::from_toml(&text, &origin)?)
        } else {
            // Only to refuse what is no profile.
            vehicles::profile::from_toml(&text, &origin)?;
            Shadow::of_the_planar_vehicle()
        };
        Ok((shadow, text))
    }

    fn log_path(&self, is_log: bool, header: &LogHeader) -> Option<PathBuf> {
        match &self.log {
            Some(path) if path.as_os_str() == "none" => None,
            Some(path) => Some(path.clone()),
            None if is_log => Some(Path::new(&self.connect).with_extension("shadow.mcap")),
            None => Some(PathBuf::from(format!("shadow-{}.mcap", header.start_unix_ns / 1_000_000_000))),
        }
    }

    fn hear_link(&self, listener: &mut Listener) -> Result<()> {
        let address: LinkAddress = self
            .connect
            .parse()
            .with_context(|| format!("--connect {}: neither a file nor a link", self.connect))?;
        let stop = stop_on_interrupt()?;
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        runtime.block_on(self.listen(listener, address, &stop))
    }

    #[expect(
        clippy::disallowed_methods,
        reason = "a link has the time of the machine; the shadow is given it"
    )]
    async fn listen(&self, listener: &mut Listener, address: LinkAddress, stop: &AtomicBool) -> Result<()> {
        let mut transport =
            Transport::open(address).await.with_context(|| format!("opening {}", self.connect))?;
        let name = transport.address().to_string();
        say(&format!("listening on {name}; Ctrl-C ends"));
        let (sender, mut hub, started) = (transport.sender(), Hub::new(1, None), Instant::now());
        let mut down_since = None;
        while !stop.load(Ordering::Relaxed) {
            if self.once
                && listener.is_down()
                && started.elapsed() > *down_since.get_or_insert(started.elapsed()) + LINGERS
            {
                break;
            }
            let Ok(received) = tokio::time::timeout(LOOK, transport.receive()).await else { continue };
            let Some(received) = received else { bail!("{name}: the link has ended") };
            let since = started.elapsed();
            for news in hub.take(0, received, since, 0) {
                match news {
                    News::Frame(frame) => {
                        listener.take(&frame, &name, u64::try_from(since.as_nanos()).unwrap_or(u64::MAX))?;
                    }
                    News::Believed(origin) => sender.believe(origin),
                    News::Down(why) => say(&format!("{name}: {why}")),
                    News::Up(peer) => say(&format!("{name}: {peer}")),
                    News::Copy(_) | News::Rejected(..) | News::Strangers(_) => {}
                }
            }
        }
        Ok(())
    }
}

/// Hears every frame of a log, at the times of its records.
fn hear_log(
    listener: &mut Listener,
    mut log: FlightLog<impl std::io::Read>,
    first: Option<replay::log::StampedEntry>,
    start_unix_ns: u64,
) -> Result<()> {
    let mut next = first;
    while let Some(stamped) = next {
        if stamped.entry == Entry::RawFrame {
            let mut framer = Framer::default();
            framer.push_datagram(&stamped.data);
            while let Some(frame) = framer.next_frame() {
                listener.take(&frame, "log", stamped.log_time_ns.saturating_sub(start_unix_ns))?;
            }
        }
        next = log.next_entry()?;
    }
    if let Some(damage) = log.damage() {
        say(&format!("warning: {} is damaged: {damage}; everything before was heard", log.name()));
    }
    Ok(())
}

#[expect(clippy::disallowed_methods, reason = "the name and the start of the log; decides nothing")]
fn since_epoch() -> Duration {
    std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default()
}

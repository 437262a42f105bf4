//! Makes a whole flight from apogee with the log that a campaign writes.

use std::path::PathBuf;
use std::sync::LazyLock;

use onboard_sim::tally::Tally;
use protocol::log::record::Record;
use protocol::log::writer::LogWriter;
use sim::recipe::Recipe;
use sim::wire::record::{self, LastFrame};
use tempfile::TempDir;

const NUMBER: u64 = 3;

pub(crate) struct Logged {
    directory: TempDir,
    pub(crate) log: PathBuf,
    pub(crate) landed: bool,
}

/// Flight 3 of the campaign with field dispersions and seed 1; it lands.
pub(crate) static LANDED: LazyLock<Logged> = LazyLock::new(|| fly(&[]));

/// The same flight with faults.
pub(crate) fn fly(faults: &[&str]) -> Logged {
    let faults = faults.iter().map(|fault| fault.parse().unwrap()).collect();
    fly_recipe(&Recipe { faults, ..Recipe::built_in("mk2", "field").unwrap() })
}

/// Flight 3 of another recipe.
pub(crate) fn fly_recipe(recipe: &Recipe) -> Logged {
    let directory = tempfile::tempdir().unwrap();
    let log = directory.path().join("apogee.mcap");
    let mut tally = Tally::new(recipe, NUMBER).unwrap();
    let file = std::fs::File::create(&log).unwrap();
    let mut writer = LogWriter::new(file, &record::campaign_header(recipe, NUMBER)).unwrap();
    writer.write(&Record::ComputerStart(Box::new(record::start(tally.flight().computer()))), 0).unwrap();
    let mut last = LastFrame::default();
    let mut phase = tally.flight().computer().mode().phase;
    loop {
        let goes_on = tally.step_watched(&mut last);
        for record in record::frame_and_phase(tally.flight(), &mut last, phase) {
            writer.write(&record, record::time_ns(tally.flight())).unwrap();
        }
        phase = tally.flight().computer().mode().phase;
        if !goes_on {
            break;
        }
    }
    let verdict = Box::new(record::verdict(tally.flight()).unwrap());
    writer.write(&Record::LandingVerdict(verdict), record::time_ns(tally.flight())).unwrap();
    writer.finish().unwrap();
    Logged { directory, log, landed: tally.row().stands }
}

impl Logged {
    /// A new file's path beside the log.
    pub(crate) fn beside(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }
}

//! A whole flight from apogee with the log that a campaign writes of it.

use std::path::PathBuf;
use std::sync::LazyLock;

use campaign::baseline::Controller;
use campaign::dispersion::Dispersion;
use campaign::order::Order;
use campaign::sortie::Sortie;
use flight::mission::Mission;
use onboard_sim::{from_apogee, pilot_log};
use protocol::log::record::Record;
use protocol::log::writer::LogWriter;
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
    let order = Order { faults: faults.iter().map(|fault| fault.parse().unwrap()).collect(), ..order() };
    let directory = tempfile::tempdir().unwrap();
    let log = directory.path().join("apogee.mcap");
    let mut sortie = Sortie::new(&order, NUMBER).unwrap();
    let file = std::fs::File::create(&log).unwrap();
    let mut writer = LogWriter::new(file, &from_apogee::header(&order, NUMBER)).unwrap();
    writer.write(&pilot_log::start(sortie.flight()), 0).unwrap();
    let mut phase = sortie.flight().pilot().mode().phase;
    loop {
        let goes_on = sortie.step();
        for record in from_apogee::frame(sortie.flight(), phase) {
            writer.write(&record, from_apogee::time_ns(sortie.flight())).unwrap();
        }
        phase = sortie.flight().pilot().mode().phase;
        if !goes_on {
            break;
        }
    }
    let verdict = Box::new(from_apogee::verdict(sortie.flight()).unwrap());
    writer.write(&Record::LandingVerdict(verdict), from_apogee::time_ns(sortie.flight())).unwrap();
    writer.finish().unwrap();
    Logged { directory, log, landed: sortie.row().legs }
}

fn order() -> Order {
    let toml = |texts: &[(&str, &str)], name: &str| {
        texts.iter().find(|(known, _)| *known == name).unwrap().1.to_owned()
    };
    let mission_toml = toml(flight::mission::BUILTIN, "mk2");
    let dispersion_toml = toml(campaign::dispersion::BUILTIN, "field");
    Order {
        mission: Mission::from_toml(&mission_toml, "mk2").unwrap(),
        mission_toml,
        dispersion: Dispersion::from_toml(&dispersion_toml, "field").unwrap(),
        dispersion_name: "field".to_owned(),
        dispersion_toml,
        seed: 1,
        flights: 10,
        controller: Controller::Nmpc,
        faults: Vec::new(),
    }
}

impl Logged {
    /// A new file's path beside the log.
    pub(crate) fn beside(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }
}

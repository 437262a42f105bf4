//! A flight over socat's pseudo-terminals: it is what a crew tests its radio with.

use std::path::Path;

use clients::{found, outside};
use e2e::{Program, Running, program};

#[test]
fn val_socat_over_a_pair_of_its_serial_ports_they_land() {
    let folder = tempfile::tempdir().unwrap();
    let ends = ["near", "far"].map(|end| folder.path().join(end));
    let address = |end: &Path| format!("pty,raw,echo=0,link={}", end.display());
    let mut socat = outside(found(&["socat"], "socat"));
    let mut socat = Running::start(socat.args(["-d", "-d", &address(&ends[0]), &address(&ends[1])]));
    socat.wait_for_line("starting data transfer loop");
    let link = |end: &Path| format!("serial:{}:57600", end.display());
    let (mut vehicle, mut ground) = (program(Program::OnboardSim), program(Program::Ground));
    vehicle.args(["fly", "--mavlink", &link(&ends[0]), "--log", "vehicle.mcap"]).current_dir(folder.path());
    ground.args(["--connect", &link(&ends[1]), "--headless", "--auto", "--log", "ground.mcap"]);
    let flight = Running::start(&mut vehicle);
    let station = Running::start(ground.current_dir(folder.path()));
    let (station, flight) = (station.wait(), flight.wait());
    assert_eq!((station.code, flight.code), (Some(0), Some(0)), "{}\n{}", station.output, flight.output);
}

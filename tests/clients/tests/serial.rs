//! A flight over socat's pseudo-terminals, with which a crew may test its serial link.

use std::path::Path;

use clients::{found, outside};
use e2e::{Running, auto_ground, expect_landing, vehicle};

#[test]
fn val_socat_they_land_over_a_pair_of_its_serial_ports() {
    let folder = tempfile::tempdir().unwrap();
    let ends = ["near", "far"].map(|end| folder.path().join(end));
    let address = |end: &Path| format!("pty,raw,echo=0,link={}", end.display());
    let mut socat = outside(found(&["socat"], "socat"));
    let mut socat = Running::start(socat.args(["-d", "-d", &address(&ends[0]), &address(&ends[1])]));
    socat.wait_for_line("starting data transfer loop");
    let link = |end: &Path| format!("serial:{}:57600", end.display());
    let vehicle = Running::start(&mut vehicle(folder.path(), &[&link(&ends[0])]));
    expect_landing(vehicle, Running::start(&mut auto_ground(folder.path(), &[&link(&ends[1])])));
}

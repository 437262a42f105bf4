//! Wireshark reads what the vehicle sends, whatever its user has configured.
#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

use clients::{PYMAVLINK, dialect, tshark, tshark_folder};
use e2e::{BareGround, Program, Running, program, raw_frames_of};
use protocol::dialect::{MavMessage, TD_PAD_CHECK_DATA};
use protocol::frame::Encoder;
use protocol::identity::VEHICLE;

/// A dissector that pymavlink's generator made of our XML reads every frame of a whole flight. It
/// has every message of ours but those of a crew.
#[test]
fn val_wireshark_finds_no_malformed_frame() {
    // The usual folder for temporary files may be readable by root only.
    let folder = tempfile::tempdir_in("/tmp").unwrap();
    tshark_folder(folder.path()).unwrap();
    let mut generator = PYMAVLINK.program("mavgen.py");
    generator.args(["--lang", "WLua", "--wire-protocol", "2.0", "-o", "touchdown"]).arg(dialect());
    let generated = Running::to_end(generator.current_dir(folder.path()));
    assert_eq!(generated.code, Some(0), "{}", generated.output);

    // pymavlink writes `le_double` for a double, which Wireshark does not have: its `le_float`
    // reads eight bytes as well.
    let dissector = folder.path().join("touchdown.lua");
    let text = std::fs::read_to_string(&dissector).unwrap();
    std::fs::write(&dissector, text.replace(":le_double()", ":le_float()")).unwrap();

    // HEARTBEAT, SYS_STATUS, ATTITUDE_QUATERNION, LOCAL_POSITION_NED, VFR_HUD, EXTENDED_SYS_STATE,
    // STATUSTEXT, ESTIMATOR_STATUS, TD_DESCENT.
    let flown = dissected(folder.path(), "mk2");
    for id in [0, 1, 31, 32, 74, 245, 253, 230, 54_008] {
        assert!(flown.contains(&id), "message {id} is not among {flown:?}");
    }
    let text = std::fs::read_to_string(dialect()).unwrap();
    let ours = text.split("<message id=\"").skip(1).filter_map(|rest| rest.split('"').next()?.parse().ok());
    // TD_CREW and TD_OPERATOR are sent by a vehicle with operators only, and that one does not
    // start by itself; TD_BOOK_HEAD is sent by a station, and TD_BOOK_KEPT answers it.
    let ours: BTreeSet<u32> = ours.filter(|id| ![54_010, 54_011, 54_013, 54_014].contains(id)).collect();
    let check = Encoder::new(VEHICLE).encode(&value_of_a_pad_check()).as_bytes().to_vec();
    let checked = read_by_wireshark(folder.path(), "check", &[check]);
    let seen: BTreeSet<u32> = flown.iter().chain(&checked).copied().collect();
    assert!(!ours.is_empty() && ours.is_subset(&seen), "{ours:?} of ours, {seen:?} seen");
}

/// Flies this profile and lets Wireshark read every frame of the vehicle; returns the message ids.
fn dissected(folder: &Path, profile: &str) -> BTreeSet<u32> {
    let log = format!("{profile}.mcap");
    let flown = Running::to_end(
        program(Program::OnboardSim)
            .args(["fly", "--mission", profile, "--speed", "max", "--auto", "--log", &log])
            .args(["--mavlink", &BareGround::new().link()])
            .current_dir(folder),
    );
    assert_eq!(flown.code, Some(0), "{}", flown.output);
    let frames = raw_frames_of(&folder.join(&log), "tx");
    assert!(frames.len() > 500, "{} frames", frames.len());
    read_by_wireshark(folder, profile, &frames)
}

/// What a vehicle that starts by itself is not asked for: a value of a check on its pad.
fn value_of_a_pad_check() -> MavMessage {
    MavMessage::TD_PAD_CHECK(TD_PAD_CHECK_DATA {
        time_boot_ms: 12_345,
        value: 0.25,
        least: f32::NAN,
        most: 2.0,
        run: 1,
        progress: 40,
        found: 3,
        ..TD_PAD_CHECK_DATA::DEFAULT
    })
}

/// Lets Wireshark read these frames; returns their message ids.
fn read_by_wireshark(folder: &Path, name: &str, frames: &[Vec<u8>]) -> BTreeSet<u32> {
    let capture = format!("{name}.pcap");
    std::fs::write(folder.join(&capture), capture_of(frames)).unwrap();
    let read = |filter: &[&str]| {
        let mut command = tshark(folder);
        command
            .args(["-r", &capture, "-X", "lua_script:touchdown.lua", "-d", "udp.port==14550,mavlink_proto"])
            .args(filter);
        Running::to_end(&mut command).output
    };
    let found = read(&["-Y", "mavlink_proto", "-T", "fields", "-e", "mavlink_proto.msgid"]);
    let ids: Vec<u32> = found.lines().filter_map(|line| line.parse().ok()).collect();
    assert_eq!(ids.len(), frames.len(), "some frames were not read");
    let malformed = read(&["-V", "-Y", "_ws.malformed || _ws.lua.error || _ws.expert.severity >= error"]);
    let lines: Vec<&str> = malformed.lines().filter(|line| !line.starts_with("Running as user")).collect();
    assert!(lines.is_empty(), "{}", lines.join("\n"));
    ids.into_iter().collect()
}

/// A libpcap file with one UDP datagram to port 14550 for each frame.
fn capture_of(frames: &[Vec<u8>]) -> Vec<u8> {
    // Magic, version 2.4, zone, accuracy, longest packet, link type 228: IPv4 without anything
    // below it.
    let mut capture = Vec::new();
    for word in [0xa1b2_c3d4_u32, 0x0004_0002, 0, 0, 65_535, 228] {
        capture.extend_from_slice(&word.to_le_bytes());
    }
    for frame in frames {
        let udp_len = 8 + frame.len() as u16;
        let len = u32::from(20 + udp_len);
        for word in [0, 0, len, len] {
            capture.extend_from_slice(&word.to_le_bytes());
        }
        capture.extend_from_slice(&[0x45, 0]);
        capture.extend_from_slice(&(20 + udp_len).to_be_bytes());
        capture.extend_from_slice(&[0, 0, 0, 0, 64, 17, 0, 0, 127, 0, 0, 1, 127, 0, 0, 1]);
        for word in [14_551, 14_550, udp_len, 0] {
            capture.extend_from_slice(&u16::to_be_bytes(word));
        }
        capture.extend_from_slice(frame);
    }
    capture
}

/// Runs the same test for a user with Wireshark plugins, preferences and paths, among them another
/// project's dissector with our dissector's name, which is broken.
#[test]
fn a_users_wireshark_settings_have_no_effect() {
    let home = tempfile::tempdir_in("/tmp").unwrap();
    tshark_folder(home.path()).unwrap();
    let (settings, plugins) =
        (home.path().join(".config/wireshark"), home.path().join(".local/lib/wireshark/plugins"));
    for folder in [&settings, &settings.join("plugins"), &plugins] {
        std::fs::create_dir_all(folder).unwrap();
        std::fs::write(folder.join("mavlink.lua"), OTHER_DISSECTOR).unwrap();
    }
    std::fs::write(settings.join("init.lua"), OTHER_DISSECTOR).unwrap();
    std::fs::write(settings.join("disabled_protos"), "udp\n").unwrap();
    std::fs::write(settings.join("preferences"), "gui.column.format: \"No.\", \"%m\"\n").unwrap();
    // The programs are built and installed with the user's real settings; Cargo keeps its own below
    // the home folder.
    program(Program::OnboardSim);
    PYMAVLINK.installed();
    let cargo = std::env::home_dir().unwrap().join(".cargo");
    let again = Command::new(std::env::current_exe().unwrap())
        .env("CARGO_HOME", std::env::var_os("CARGO_HOME").unwrap_or(cargo.into()))
        .args(["--exact", "val_wireshark_finds_no_malformed_frame"])
        .env("HOME", home.path())
        .env("XDG_CONFIG_HOME", home.path().join(".config"))
        .env("WIRESHARK_CONFIG_DIR", &settings)
        .env("WIRESHARK_PLUGIN_DIR", &plugins)
        .env("WIRESHARK_DATA_DIR", home.path())
        .output()
        .unwrap();
    let printed = String::from_utf8_lossy(&again.stdout);
    assert!(again.status.success() && printed.contains("1 passed"), "{printed}");
}

const OTHER_DISSECTOR: &str = "local other = Proto('mavlink_proto', 'Another project')\nerror('not ours')\n";

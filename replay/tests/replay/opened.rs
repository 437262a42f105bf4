//! Tests the start of other programs that show a log.

use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;

use crate::command_line::replay;
use crate::simulated::MK2;

/// Without a viewer it says what installs one; with one it runs it on the log, and what that fails with is an error.
#[test]
fn a_log_is_opened_in_the_viewer_that_is_installed_or_the_answer_says_what_installs_one() {
    let folder = tempfile::tempdir().unwrap();
    let run = |log: &Path| {
        let output = replay("open", log).env("PATH", folder.path()).output().unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    let (code, said) = run(&MK2.log);
    assert!(code == Some(1) && said.contains("pip install rerun-sdk"), "{code:?} {said}");

    let (program, told) = (folder.path().join("lichtblick"), folder.path().join("told"));
    let script = |exit: u8| format!("#!/bin/sh\necho \"$@\" > {}\nexit {exit}\n", told.display());
    std::fs::write(&program, script(0)).unwrap();
    std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).unwrap();
    let (code, said) = run(&MK2.log);
    assert_eq!(code, Some(0), "{said}");
    assert_eq!(std::fs::read_to_string(&told).unwrap().trim_end(), MK2.log.to_str().unwrap());
    // The layout lies where it says.
    let layout = Path::new(said.trim_end().rsplit_once(": ").unwrap().1);
    assert!(std::fs::read_to_string(layout).unwrap().contains("/vehicle/truth3d.height_m"), "{said}");
    std::fs::remove_dir_all(layout.parent().unwrap()).unwrap();

    std::fs::write(&program, script(7)).unwrap();
    let (code, said) = run(&MK2.log);
    assert_eq!(code, Some(1), "{said}");
    // A file that is no log is named before anything is started.
    std::fs::remove_file(&told).unwrap();
    let (code, said) = run(&program);
    assert!(code == Some(1) && !told.exists(), "{code:?} {said}");
}

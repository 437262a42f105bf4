//! A screen in tmux, which answers for its terminal while a person cannot see or command it.

use std::process::Command;

use e2e::{Program, Terminal, program};

use super::rig::{Pad, SIZE};

/// A server of the test's own, with the user's settings left out.
struct Tmux {
    socket: std::path::PathBuf,
    client: Terminal,
}

impl Tmux {
    /// tmux on a terminal, with a screen of the station as its only pane.
    fn attach_to(pad: &Pad) -> Self {
        let socket = pad.folder.path().join("tmux");
        let mut tmux = Command::new("tmux");
        tmux.arg("-S").arg(&socket).args(["-f", "/dev/null", "new-session"]);
        tmux.arg(program(Program::Ground).get_program()).arg("attach").current_dir(pad.folder.path());
        tmux.env("XDG_RUNTIME_DIR", pad.folder.path()).env("XDG_CONFIG_HOME", pad.folder.path());
        Self { client: Terminal::start(&tmux, SIZE, false), socket }
    }

    fn run(&self, arguments: &[&str]) {
        let ran = Command::new("tmux").arg("-S").arg(&self.socket).args(arguments).status().unwrap();
        assert!(ran.success(), "tmux {arguments:?}");
    }
}

impl Drop for Tmux {
    fn drop(&mut self) {
        // Fails only if the server has ended.
        let _ = Command::new("tmux").arg("-S").arg(&self.socket).arg("kill-server").status();
    }
}

/// Reports where the tests are left out.
fn is_installed() -> bool {
    let is_installed = Command::new("tmux").arg("-V").output().is_ok();
    if !is_installed {
        eprintln!("tmux is not installed: not tested");
    }
    is_installed
}

/// A mouse wheel enters copy mode: the picture stands still, and Ctrl-X Enter goes to tmux.
#[test]
fn a_screen_that_tmux_does_not_show_holds_the_countdown() {
    if !is_installed() {
        return;
    }
    for (hide, show) in [
        (&["copy-mode"][..], &["send-keys", "-X", "cancel"][..]),
        (&["new-window", "sleep 1000"][..], &["select-window", "-t", ":0"][..]),
        (&["split-window", "-Z", "sleep 1000"][..], &["resize-pane", "-Z"][..]),
    ] {
        let pad = Pad::new();
        let mut daemon = pad.daemon("flight.mcap");
        let mut tmux = Tmux::attach_to(&pad);
        let screen = &mut tmux.client;
        screen.wait_for("every arming check passes");
        screen.type_until(b"AARM\r", " ARMED ");
        screen.wait_for("✓ armed (HEARTBEAT)");
        screen.type_until(b"SSTART\r", "START  commanded");
        daemon.wait_for_line("countdown runs");
        tmux.run(hide);
        daemon.wait_for_line("no commanding screen in the countdown: HOLD");
        daemon.wait_for_line("holds by itself: no commanding screen");
        tmux.run(show);
        daemon.wait_for_line("at the controls: screen 1");
        tmux.client.wait_for("HOLD");
    }
}

#[test]
fn a_screen_in_a_tmux_without_a_client_does_not_count() {
    if !is_installed() {
        return;
    }
    let pad = Pad::new();
    let mut daemon = pad.daemon("flight.mcap");
    let tmux = Tmux::attach_to(&pad);
    daemon.wait_for_line("at the controls: screen 1");
    tmux.run(&["detach-client"]);
    daemon.wait_for_line("is not shown (tmux has no client)");
}

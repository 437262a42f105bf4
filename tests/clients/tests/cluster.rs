//! The engineer's recipes for campaigns over many machines, run by the programs they are for: GNU parallel, and Slurm with a
//! cluster of this one machine. What is merged from their parts must be one machine's campaign, byte for byte.

#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use clients::{file, found, outside};
use e2e::{Program, Running, program, unshared_address};

/// The recipe of a program, as the page has it, for a small campaign: 9 flights in 4 parts instead of 100,000 in 64.
fn recipe(program: &str) -> String {
    let page = fs::read_to_string(file("../../ENGINEER.md")).expect("the page");
    let line = page.lines().find(|line| line.starts_with(program)).expect("a recipe on the page");
    assert!(line.contains("--flights 100000") && line.contains("64"), "{line}");
    line.replace("--flights 100000", "--flights 9").replace("64", "4")
}

/// Runs a line of a shell in a folder, with our programs on the path.
fn shell(line: &str, folder: &Path, variables: &[(&str, &Path)]) {
    let ours = Path::new(program(Program::OnboardSim).get_program()).parent().expect("a folder").to_owned();
    let theirs = std::env::var_os("PATH").unwrap_or_default();
    let path =
        std::env::join_paths([ours].into_iter().chain(std::env::split_paths(&theirs))).expect("a path");
    let mut shell = outside("sh");
    shell.args(["-c", line]).env("PATH", path).current_dir(folder).envs(variables.iter().copied());
    let ended = Running::to_end(&mut shell);
    assert_eq!(ended.code, Some(0), "{line}\n{}", ended.output);
}

/// The files of a campaign's folder and of the folders in it, by their paths in it.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(inner) = folders.pop() {
        for entry in fs::read_dir(inner).expect("the folder of a campaign") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let bytes = fs::read(&path).expect("a file");
                found.insert(path.strip_prefix(folder).expect("inside").to_owned(), bytes);
            }
        }
    }
    found
}

/// Merges the parts in a folder as the page says, and compares the whole with a campaign that was never cut. Only one machine's
/// campaign knows how long it took.
fn expect_the_campaign_of_one_machine(folder: &Path) {
    let merge = fs::read_to_string(file("../../ENGINEER.md")).expect("the page");
    let merge =
        merge.lines().find(|line| line.starts_with("onboard-sim campaign merge")).expect("how to merge");
    shell(merge, folder, &[]);
    shell("onboard-sim campaign --flights 9 --out one", folder, &[]);
    let (whole, mut one) = (files(&folder.join("whole")), files(&folder.join("one")));
    assert!(one.remove(Path::new("cost.json")).is_some(), "{:?}", one.keys());
    for name in ["flights.csv", "summary.json"] {
        assert!(one.contains_key(Path::new(name)), "{:?}", one.keys());
    }
    assert!(whole.keys().eq(one.keys()), "{:?} and {:?}", whole.keys(), one.keys());
    for (name, bytes) in one {
        assert!(whole[&name] == bytes, "{} differs", name.display());
    }
}

#[test]
fn val_parallel_runs_its_recipe() {
    found(&["parallel"], "parallel");
    let folder = tempfile::tempdir().unwrap();
    shell(&recipe("parallel"), folder.path(), &[]);
    expect_the_campaign_of_one_machine(folder.path());
}

/// A cluster of this machine alone, without anything of the machine's own configuration.
struct Cluster {
    _controller: Running,
    _node: Running,
    _authentication: Running,
}

impl Cluster {
    fn start(folder: &Path) -> Self {
        let key = folder.join("key");
        fs::write(&key, [0x5a; 64]).unwrap();
        fs::set_permissions(&key, fs::Permissions::from_mode(0o400)).unwrap();
        for name in ["state", "spool"] {
            fs::create_dir(folder.join(name)).unwrap();
        }
        // Its socket must be reachable for every user, or it refuses to start.
        fs::set_permissions(folder, fs::Permissions::from_mode(0o755)).unwrap();
        fs::write(folder.join("slurm.conf"), configuration(folder)).unwrap();

        let mut munged = outside(found(&["munged"], "munge"));
        munged.arg("--foreground").args(["key-file", "socket", "pid-file", "log-file", "seed-file"].map(
            |what| {
                let path = folder.join(what.trim_end_matches("-file"));
                format!("--{what}={}", path.display())
            },
        ));
        let authentication = Running::start(&mut munged);
        e2e::wait_for_content(&folder.join("pid"));

        let daemon = |name: &str| -> Command {
            let mut daemon = outside(found(&[name], "slurm-wlm"));
            daemon.args(["-D", "-c"]).env("SLURM_CONF", folder.join("slurm.conf"));
            daemon
        };
        let mut controller = Running::start(&mut daemon("slurmctld"));
        controller.wait_for_line("started on cluster");
        let mut node = Running::start(&mut daemon("slurmd"));
        node.wait_for_line("started");
        Self { _controller: controller, _node: node, _authentication: authentication }
    }
}

fn configuration(folder: &Path) -> String {
    let host = fs::read_to_string("/proc/sys/kernel/hostname").expect("Linux");
    let host = host.trim().split('.').next().unwrap_or_default().to_owned();
    let user = nix::unistd::User::from_uid(nix::unistd::geteuid()).unwrap().expect("a user with a name").name;
    let (controller, node) = (unshared_address(), unshared_address());
    let folder = folder.display();
    format!(
        "ClusterName=recipes\n\
         SlurmctldHost={host}({})\nSlurmctldPort={}\nSlurmdPort={}\n\
         AuthType=auth/munge\nAuthInfo=socket={folder}/socket\nCredType=cred/munge\n\
         SlurmUser={user}\nSlurmdUser={user}\n\
         StateSaveLocation={folder}/state\nSlurmdSpoolDir={folder}/spool\n\
         SlurmctldPidFile={folder}/controller.pid\nSlurmdPidFile={folder}/node.pid\n\
         ProctrackType=proctrack/linuxproc\nTaskPlugin=task/none\nMpiDefault=none\nReturnToService=2\n\
         NodeName={host} NodeAddr={} CPUs=2\nPartitionName=all Nodes=ALL Default=YES State=UP\n",
        controller.ip(),
        controller.port(),
        node.port(),
        node.ip(),
    )
}

#[test]
fn val_slurm_runs_its_recipe() {
    let folder = tempfile::tempdir().unwrap();
    let cluster = tempfile::tempdir().unwrap();
    let _cluster = Cluster::start(cluster.path());
    let recipe = recipe("sbatch").replacen("sbatch", "sbatch --wait", 1);
    shell(&recipe, folder.path(), &[("SLURM_CONF", &cluster.path().join("slurm.conf"))]);
    expect_the_campaign_of_one_machine(folder.path());
}

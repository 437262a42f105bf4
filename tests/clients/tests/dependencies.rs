//! What the dependencies of every program may be: their licences, and where they come from.
//!
//! Here and not with the other tests, because `cargo metadata` wants every package of the lock
//! file, also those that are only for other systems, and may have to download them.

use std::path::Path;
use std::process::Command;

use serde_json::Value;
use spdx::{Expression, ParseMode};

/// Licences that ask for no more than their text beside a program. MPL-2.0 asks for the source of
/// its own files, which are used unchanged; CDLA-Permissive-2.0 is that of a list of certificates,
/// which comes with the export to Rerun.
const ACCEPTED: [&str; 11] = [
    "MIT",
    "Apache-2.0",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "ISC",
    "Zlib",
    "Unicode-3.0",
    "BSL-1.0",
    "MPL-2.0",
    "CC0-1.0",
    "CDLA-Permissive-2.0",
];

/// Whether a manifest's licence can be met. The slash of old manifests means `OR`.
fn is_accepted(licence: &str) -> bool {
    let accepted = |id: spdx::LicenseId| ACCEPTED.contains(&id.name);
    Expression::parse_mode(licence, ParseMode::LAX)
        .is_ok_and(|expression| expression.evaluate(|asked| asked.license.id().is_some_and(accepted)))
}

#[test]
fn licences_are_evaluated_by_their_expressions() {
    for good in ["MIT", "MIT/Apache-2.0", "MIT OR GPL-3.0-only", "(MIT OR Apache-2.0) AND Unicode-3.0"] {
        assert!(is_accepted(good), "{good}");
    }
    for bad in ["GPL-3.0-only", "MIT AND GPL-3.0-only", "LicenseRef-own", "", "no licence"] {
        assert!(!is_accepted(bad), "{bad}");
    }
}

/// `cargo about` cannot read the list from here.
#[test]
fn a_release_accepts_the_same_licences() {
    let settings =
        std::fs::read_to_string(clients::file("../../ground/packaging/about.toml")).expect("settings");
    let (list, _) = settings.split_once(']').expect("a list that ends");
    let names: Vec<&str> = list.split('"').skip(1).step_by(2).collect();
    assert_eq!(names, ACCEPTED);
}

#[test]
fn every_dependency_has_an_accepted_licence_and_comes_from_the_registry() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let asked = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1", "--locked", "--all-features"])
        .current_dir(root)
        .output()
        .expect("cargo runs");
    assert!(asked.status.success(), "{}", String::from_utf8_lossy(&asked.stderr));
    let answer: Value = serde_json::from_slice(&asked.stdout).expect("JSON");
    let packages = answer["packages"].as_array().expect("a list of packages");
    let others: Vec<&Value> = packages.iter().filter(|package| !package["source"].is_null()).collect();
    assert!(others.len() > 300, "only {} dependencies", others.len());
    let mut refused = Vec::new();
    for package in others {
        let text = |key: &str| package[key].as_str().unwrap_or_default();
        let named = format!("{} {}", text("name"), text("version"));
        if !is_accepted(text("license")) {
            refused.push(format!("{named}: licence `{}`", text("license")));
        }
        if !text("source").starts_with("registry+") {
            refused.push(format!("{named}: from {}", text("source")));
        }
    }
    assert!(refused.is_empty(), "{}", refused.join("\n"));
}

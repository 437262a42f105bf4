//! Checks ARCHITECTURE.md against the workspace: every member has its row, every public module of a
//! library its line, and the arrows are those of the manifests.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().expect("the workspace")
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn page() -> String {
    read(&root().join("ARCHITECTURE.md"))
}

/// The two workspaces: the product's, and the lab's.
const WORKSPACES: [&str; 2] = ["", "onboard-sim/lab"];

/// A TOML file of the project.
fn toml(path: &Path) -> toml::Table {
    read(path).parse().unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Folders of the members of both workspaces, by package name.
fn members() -> BTreeMap<String, String> {
    let mut members = BTreeMap::new();
    for workspace in WORKSPACES.map(|folder| root().join(folder)) {
        let manifest = toml(&workspace.join("Cargo.toml"));
        for member in manifest["workspace"]["members"].as_array().expect("a list of members") {
            let folder = workspace.join(member.as_str().expect("a folder")).canonicalize().expect("a folder");
            let package = toml(&folder.join("Cargo.toml"));
            let name = package["package"]["name"].as_str().expect("a name").to_owned();
            let relative = folder.strip_prefix(root()).expect("a folder of the project");
            members.insert(name, relative.to_str().expect("a path in UTF-8").to_owned());
        }
    }
    members
}

/// The members that a member needs to be built: its dependencies, not those of its tests.
fn needs(folder: &str, members: &BTreeMap<String, String>) -> BTreeSet<String> {
    let manifest = read(&root().join(folder).join("Cargo.toml"));
    let section =
        manifest.split("\n[").find(|section| section.starts_with("dependencies]")).unwrap_or_default();
    let named = section.lines().filter_map(|line| line.split(['.', ' ', '=']).next());
    named.filter(|name| members.contains_key(*name)).map(str::to_owned).collect()
}

/// The arrows of the page: lines `a -> b, c` in its block of arrows.
fn arrows_of_the_page() -> BTreeMap<String, BTreeSet<String>> {
    let page = page();
    let block =
        page.split("```arrows\n").nth(1).expect("a block of arrows").split("```").next().expect("its end");
    block
        .lines()
        .map(|line| {
            let (from, to) = line.split_once("->").unwrap_or((line, ""));
            let to = to.split(',').map(str::trim).filter(|name| !name.is_empty() && *name != "nothing");
            (from.trim().to_owned(), to.map(str::to_owned).collect())
        })
        .collect()
}

#[test]
fn every_member_has_its_row_and_every_row_is_of_a_member() {
    let page = page();
    let folders: BTreeSet<String> = members().into_values().collect();
    let rows: BTreeSet<String> = page
        .lines()
        .filter_map(|line| line.strip_prefix("| `")?.split('`').next())
        .map(|folder| folder.trim_end_matches('/').to_owned())
        .filter(|folder| root().join(folder).join("Cargo.toml").exists())
        .collect();
    assert_eq!(rows, folders);
}

#[test]
fn the_arrows_are_those_of_the_manifests() {
    let members = members();
    let found: BTreeMap<String, BTreeSet<String>> =
        members.iter().map(|(name, folder)| (name.clone(), needs(folder, &members))).collect();
    let drawn = arrows_of_the_page();
    for (name, needs) in &found {
        assert_eq!(drawn.get(name), Some(needs), "{name}");
    }
    assert_eq!(drawn.len(), found.len(), "{drawn:?}");
}

/// Cargo shares neither versions, lints nor profiles between workspaces. With other versions the
/// lab would measure another flight computer.
#[test]
fn the_lab_is_built_as_the_product_is() {
    let [product, lab] = WORKSPACES.map(|folder| toml(&root().join(folder).join("Cargo.toml")));
    for table in ["package", "lints"] {
        assert_eq!(lab["workspace"][table], product["workspace"][table], "[workspace.{table}]");
    }
    let version = |dependency: &toml::Value| dependency.get("version").unwrap_or(dependency).clone();
    let [versions, of_lab] = [&product, &lab].map(|manifest| &manifest["workspace"]["dependencies"]);
    for (name, dependency) in of_lab.as_table().expect("a table") {
        if let Some(same) = versions.get(name).filter(|same| same.get("path").is_none()) {
            assert_eq!(version(dependency), version(same), "version of {name}");
        }
    }
    let packages = |profile: &toml::Value| profile["package"].as_table().expect("packages").clone();
    for profile in ["dev", "release"] {
        let of_lab = packages(&lab["profile"][profile]);
        for (name, settings) in packages(&product["profile"][profile]) {
            assert_eq!(of_lab.get(&name), Some(&settings), "profile {profile}, package {name}");
        }
    }
    let locked = |folder: &str| -> BTreeSet<(String, String)> {
        let lock = toml(&root().join(folder).join("Cargo.lock"));
        let text = |package: &toml::Value, key: &str| package[key].as_str().expect("a text").to_owned();
        let packages = lock["package"].as_array().expect("a list of packages");
        packages.iter().map(|package| (text(package, "name"), text(package, "version"))).collect()
    };
    let [product, lab] = WORKSPACES.map(locked);
    let names: BTreeSet<&String> = product.iter().map(|(name, _)| name).collect();
    let others: Vec<_> = product
        .iter()
        .filter(|entry| !lab.contains(*entry) && lab.iter().any(|(name, _)| *name == entry.0))
        .collect();
    assert!(names.len() > 100, "{}", names.len());
    assert_eq!(others, Vec::<&(String, String)>::new(), "versions that the lab does not have");
}

/// A library's page must name its public modules, so that a newcomer finds the code.
#[test]
fn every_public_module_has_its_line_on_its_library_s_page() {
    for (name, folder) in members() {
        let path = root().join(&folder).join("src/lib.rs");
        let Ok(text) = fs::read_to_string(&path) else { continue };
        let page: Vec<&str> = text.lines().take_while(|line| line.starts_with("//!")).collect();
        for module in text.lines().filter_map(|line| line.strip_prefix("pub mod ")) {
            let module = module.trim_end_matches(';').trim_end_matches(" {");
            let named = page.iter().any(|line| line.contains(&format!("`{module}`")));
            assert!(named, "{name}: `{module}` is not named on the page of {}", path.display());
        }
    }
}

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

/// Folders of the members, by their package's name.
fn members() -> BTreeMap<String, String> {
    let manifest = read(&root().join("Cargo.toml"));
    let list = manifest.split("members = [").nth(1).expect("a list of members");
    let folders =
        list.split(']').next().expect("its end").split(',').map(|entry| entry.trim().trim_matches('"'));
    folders
        .filter(|folder| !folder.is_empty())
        .map(|folder| {
            let manifest = read(&root().join(folder).join("Cargo.toml"));
            let name = manifest.lines().find_map(|line| line.strip_prefix("name = ")).expect("a name");
            (name.trim_matches('"').to_owned(), folder.to_owned())
        })
        .collect()
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

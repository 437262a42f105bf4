//! A campaign's results do not depend on how it was run.
#![expect(clippy::unwrap_used, reason = "a test that cannot be set up fails")]

use std::fs;
use std::path::Path;

use flight::rules::verdict::Landing;
use onboard_sim::row;
use onboard_sim::run::{publish, run, threads};
use onboard_sim::store::{CHUNK_FLIGHTS, Order, Shard, Store, StoreError, merge};
use parquet::file::reader::{FileReader as _, SerializedFileReader};
use parquet::record::RowAccessor as _;
use sim::dispersion;
use sim::recipe::Recipe;

const FLIGHTS: u64 = 23;

/// Flights from a low height, which are quick to simulate.
fn order(seed: u64) -> Order {
    let (name, text) = flight::vehicles::mission::BUILTIN[0];
    let low = text.replace("height_m = 300.0", "height_m = 60.0");
    let recipe = Recipe::from_texts((name, &low), dispersion::BUILTIN[2]).unwrap();
    Order { recipe: Recipe { seed, ..recipe }, flights: FLIGHTS }
}

fn fly(order: &Order, shard: Shard, jobs: usize, out: &Path) -> u64 {
    let store = Store::open(out, order, &order.manifest("test", shard)).unwrap();
    let flown = threads(Some(jobs)).unwrap().install(|| run(order, &store, &|_| ()).unwrap().flown);
    publish(order, &store).unwrap();
    flown
}

const FILES: [&str; 8] = [
    "flights.csv",
    "flights.parquet",
    "summary.json",
    "summary.md",
    "touchdown.svg",
    "vertical-speed.svg",
    "ignition-height.svg",
    "tilt.svg",
];

fn assert_same(one: &Path, two: &Path) {
    for file in FILES {
        assert!(fs::read(one.join(file)).unwrap() == fs::read(two.join(file)).unwrap(), "{file} differs");
    }
}

#[test]
fn the_results_do_not_depend_on_threads_shards_or_a_stop() {
    let root = tempfile::tempdir().unwrap();
    let at = |name: &str| root.path().join(name);
    let order = order(1);
    assert_eq!(fly(&order, Shard::WHOLE, 1, &at("one")), FLIGHTS);
    assert_eq!(fly(&order, Shard::WHOLE, 3, &at("three")), FLIGHTS);
    assert_same(&at("one"), &at("three"));

    let parts = [at("part-1"), at("part-2")];
    let flown: u64 =
        (1..=2).zip(&parts).map(|(index, part)| fly(&order, Shard { index, count: 2 }, 1, part)).sum();
    assert_eq!(flown, FLIGHTS);
    let (store, merged) = merge(&parts, &at("merged")).unwrap();
    publish(&merged, &store).unwrap();
    assert_same(&at("one"), &at("merged"));

    // Stopped after a chunk, then continued.
    fs::remove_file(at("three").join("chunks/000001.csv")).unwrap();
    fs::remove_file(at("three").join("flights.csv")).unwrap();
    assert_eq!(fly(&order, Shard::WHOLE, 2, &at("three")), CHUNK_FLIGHTS);
    assert_same(&at("one"), &at("three"));
    assert_eq!(fly(&order, Shard::WHOLE, 2, &at("three")), 0);

    read_them(&at("one"));
}

/// The formats that other programs read.
fn read_them(out: &Path) {
    let csv = fs::read(out.join("flights.csv")).unwrap();
    let rows = row::from_csv(&csv).unwrap();
    assert!(rows.iter().map(|row| row.number).eq(0..FLIGHTS));
    assert!(rows.iter().all(|row| row.touchdown_vertical_m_s.is_some_and(f64::is_finite)));
    assert_eq!(row::to_csv(&rows).unwrap(), csv);

    let reader = SerializedFileReader::new(fs::File::open(out.join("flights.parquet")).unwrap()).unwrap();
    let columns = reader.metadata().file_metadata().schema_descr().columns().to_vec();
    let column = |name: &str| columns.iter().position(|column| column.name() == name).unwrap();
    let [number, impulse, vertical, failure, onset] =
        ["number", "impulse_scale", "touchdown_vertical_m_s", "failure", "onset_height_m"].map(column);
    let landing = Landing::COLUMNS.map(column);
    let mut count = 0;
    for (record, row) in reader.get_row_iter(None).unwrap().zip(&rows) {
        let record = record.unwrap();
        assert_eq!(record.get_long(number).unwrap(), i64::try_from(row.number).unwrap());
        assert_eq!(record.get_double(impulse).unwrap().to_bits(), row.impulse_scale.to_bits());
        assert_eq!(record.get_double(vertical).ok(), row.touchdown_vertical_m_s);
        assert_eq!(landing.map(|word| record.get_bool(word).unwrap()), row.landing().flags());
        assert_eq!(record.get_string(failure).unwrap(), &row.failure);
        assert_eq!(record.get_double(onset).ok(), row.onset_height_m);
        count += 1;
    }
    assert_eq!(count, rows.len());

    let summary: serde_json::Value =
        serde_json::from_slice(&fs::read(out.join("summary.json")).unwrap()).unwrap();
    for word in Landing::COLUMNS {
        assert_eq!(summary[word]["of"], FLIGHTS, "{word}");
    }
    assert_eq!(summary["attainable"]["attainable"]["of"], FLIGHTS);
    assert_eq!(summary["attainable"]["landed"]["of"], summary["attainable"]["attainable"]["count"]);
    let markdown = fs::read_to_string(out.join("summary.md")).unwrap();
    assert!(markdown.contains("landed of attainable"), "{markdown}");
    for file in
        FILES.iter().filter(|file| std::path::Path::new(file).extension().is_some_and(|kind| kind == "svg"))
    {
        let text = fs::read_to_string(out.join(file)).unwrap();
        let picture = roxmltree::Document::parse(&text).unwrap();
        assert_eq!(picture.root_element().tag_name().name(), "svg", "{file}");
        assert!(picture.root_element().attribute("width").is_some(), "{file}");
        assert!(!text.contains("NaN") && !text.contains("inf"), "{file}");
    }
}

#[test]
fn a_directory_of_another_order_or_in_use_is_refused_with_the_reason() {
    let root = tempfile::tempdir().unwrap();
    let order_1 = order(1);
    let store = Store::open(root.path(), &order_1, &order_1.manifest("test", Shard::WHOLE)).unwrap();
    let again = Store::open(root.path(), &order_1, &order_1.manifest("test", Shard::WHOLE)).unwrap_err();
    assert!(matches!(again, StoreError::InUse { .. }), "{again}");
    drop(store);

    let refused = |order: &Order, build: &str, shard: Shard| {
        Store::open(root.path(), order, &order.manifest(build, shard)).unwrap_err().to_string()
    };
    let message = refused(&order(2), "test", Shard::WHOLE);
    assert!(message.contains("its seed is `1`, this run's is `2`"), "{message}");
    let message = refused(&order_1, "other", Shard::WHOLE);
    assert!(message.contains("its program is `test`, this run's is `other`"), "{message}");
    let manifest_json = root.path().join("manifest.json");
    let text = fs::read_to_string(&manifest_json).unwrap();
    fs::write(&manifest_json, text.replace("\"format\": 2", "\"format\": 1")).unwrap();
    let message = refused(&order_1, "test", Shard::WHOLE);
    assert!(message.contains("its format is `1`, this run's is `2`"), "{message}");
    let parts = [root.path().to_owned()];
    let error = merge(&parts, &root.path().join("whole")).unwrap_err();
    assert!(error.to_string().contains("format 1"), "{error}");
    fs::write(&manifest_json, text).unwrap();
    let message = refused(&order_1, "test", Shard { index: 1, count: 2 });
    assert!(message.contains("its shard is `1/1`, this run's is `1/2`"), "{message}");
    let mut heavier = order_1.clone();
    heavier.recipe.mission_toml.push('\n');
    let message = refused(&heavier, "test", Shard::WHOLE);
    assert!(message.contains("text of the mission"), "{message}");
}

/// A directory with files of the same names from another program.
#[test]
fn files_that_no_campaign_wrote_are_never_overwritten() {
    let order = order(1);
    let manifest = order.manifest("test", Shard::WHOLE);
    let picture = onboard_sim::summary::PICTURES[0].0;
    for name in ["mission.toml", "flights.csv", "summary.md", picture] {
        let root = tempfile::tempdir().unwrap();
        let path = root.path().join(name);
        std::fs::write(&path, "notes").unwrap();
        let refused = Store::open(root.path(), &order, &manifest);
        assert!(matches!(refused, Err(StoreError::Foreign { .. })), "{name}");
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "notes", "{name}");
    }
    // A campaign that was stopped before its manifest was written continues.
    let root = tempfile::tempdir().unwrap();
    std::fs::write(root.path().join("mission.toml"), &order.recipe.mission_toml).unwrap();
    assert!(Store::open(root.path(), &order, &manifest).is_ok());
}

#[test]
fn a_merge_refuses_parts_of_another_campaign_and_missing_flights() {
    let root = tempfile::tempdir().unwrap();
    let at = |name: &str| root.path().join(name);
    let (order_1, order_2) = (order(1), order(2));
    let half = Shard { index: 1, count: 2 };
    for (name, order) in [("one", &order_1), ("other", &order_2)] {
        let store = Store::open(&at(name), order, &order.manifest("test", half)).unwrap();
        store.write(0, &[]).unwrap();
    }
    let error = merge(&[at("one"), at("other")], &at("both")).unwrap_err();
    assert!(error.to_string().contains("its seed is `2`, this run's is `1`"), "{error}");
    let error = merge(&[at("one")], &at("half")).unwrap_err();
    assert!(error.to_string().contains("flights 10 to 19"), "{error}");
}

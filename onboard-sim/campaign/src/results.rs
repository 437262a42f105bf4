//! Writes a campaign's tables, summary and pictures into its directory.

use crate::order::Order;
use crate::picture::{PICTURES, pictures};
use crate::store::{Store, StoreError};
use crate::summary::{Summary, to_markdown};
use crate::table;

/// Writes `flights.csv`, `flights.parquet`, `summary.json`, `summary.md` and the pictures from the store's chunks.
///
/// # Errors
/// A chunk is missing or damaged, or a file cannot be written.
pub fn publish(order: &Order, store: &Store) -> Result<Summary, StoreError> {
    let rows = store.rows()?;
    let failed = |name: &str, message: String| StoreError::Content { path: store.path().join(name), message };
    let csv = table::to_csv(&rows).map_err(|error| failed("flights.csv", error.to_string()))?;
    store.publish("flights.csv", &csv)?;
    let parquet = table::to_parquet(&rows).map_err(|error| failed("flights.parquet", error.to_string()))?;
    store.publish("flights.parquet", &parquet)?;
    let summary = Summary::new(store.manifest(), &rows);
    let json =
        serde_json::to_string_pretty(&summary).map_err(|error| failed("summary.json", error.to_string()))?;
    store.publish("summary.json", json.as_bytes())?;
    store.publish("summary.md", to_markdown(&summary).as_bytes())?;
    for ((name, _), picture) in PICTURES.iter().zip(pictures(&rows, &order.recipe.mission.leg_limits)) {
        store.publish(name, picture.as_bytes())?;
    }
    Ok(summary)
}

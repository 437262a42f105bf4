//! Tests the layouts for Foxglove and PlotJuggler: every path in them exists in the schemas of a
//! recorded log.
//!
//! Neither application is run here, and PlotJuggler could not be: it is neither in Debian nor on
//! PyPI. Its file is read as XML, and its series are named as its parser of protobuf names them:
//! topic and fields with slashes, elements of a list with brackets.

use std::collections::BTreeMap;
use std::path::Path;

use prost_reflect::{DescriptorPool, Kind, MessageDescriptor};

use crate::simulated::{MK2, Simulated};

/// The message of each topic of a log, by the schemas in the log.
fn topics(flight: &Simulated) -> BTreeMap<String, MessageDescriptor> {
    let bytes = std::fs::read(&flight.log).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let of_channel = |channel: &std::sync::Arc<mcap::Channel<'_>>| {
        let schema = channel.schema.as_ref().filter(|schema| schema.encoding == "protobuf")?;
        let pool = DescriptorPool::decode(schema.data.as_ref()).unwrap();
        Some((channel.topic.clone(), pool.get_message_by_name(&schema.name).unwrap()))
    };
    summary.channels.values().filter_map(of_channel).collect()
}

/// Whether a path of fields leads to a number; a list needs an index.
fn is_number(message: &MessageDescriptor, path: &[&str]) -> bool {
    let [first, rest @ ..] = path else { return false };
    let (name, index) = first.strip_suffix(']').and_then(|named| named.split_once('[')).unzip();
    let Some(field) = message.get_field_by_name(name.unwrap_or(first)) else { return false };
    if field.is_list() != index.is_some_and(|index| index.parse::<u8>().is_ok()) {
        return false;
    }
    match field.kind() {
        Kind::Message(inner) => is_number(&inner, rest),
        Kind::String | Kind::Bytes => false,
        _ => rest.is_empty(),
    }
}

fn layout(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("layouts").join(name);
    std::fs::read_to_string(path).unwrap()
}

/// Every `value` of a Foxglove layout's plots: topic and path.
fn foxglove_paths(text: &str) -> Vec<String> {
    let layout: serde_json::Value = serde_json::from_str(text).unwrap();
    let panels = layout["configById"].as_object().unwrap();
    let paths = panels.values().filter_map(|panel| panel["paths"].as_array()).flatten();
    let paths: Vec<String> = paths.map(|path| path["value"].as_str().unwrap().to_owned()).collect();
    // Every panel that a tab or the layout names is there.
    for named in text.split('"').filter(|word| word.contains('!')) {
        assert!(panels.contains_key(named), "{named}");
    }
    paths
}

/// Every curve of a PlotJuggler layout.
fn plotjuggler_curves(text: &str) -> Vec<String> {
    let document = roxmltree::Document::parse(text).unwrap();
    let curves = document.descendants().filter(|node| node.has_tag_name("curve"));
    curves.map(|curve| curve.attribute("name").unwrap().to_owned()).collect()
}

#[test]
fn every_path_of_a_layout_is_a_number_of_a_recorded_log() {
    let topics = topics(&MK2);
    let found = |topic: &str, path: Vec<&str>| {
        let message = topics.get(topic).unwrap_or_else(|| panic!("no topic {topic}"));
        assert!(is_number(message, &path), "{topic} has no number {path:?}");
    };
    let foxglove = foxglove_paths(&layout("foxglove-space.json"));
    for value in &foxglove {
        let (topic, path) = value.split_once('.').unwrap();
        found(topic, path.split('.').collect());
    }
    let plotjuggler = plotjuggler_curves(&layout("plotjuggler-space.xml"));
    for curve in &plotjuggler {
        let topic = topics.keys().find(|topic| curve.starts_with(&format!("{topic}/")));
        let topic = topic.unwrap_or_else(|| panic!("no topic of {curve}"));
        found(topic, curve[topic.len() + 1..].split('/').collect());
    }
    // Both programs are shown the same.
    assert!(foxglove.len() > 15 && foxglove.len() == plotjuggler.len());
}

//! Live values: a client of Foxglove's WebSocket protocol beside a flight.

use std::collections::BTreeMap;
use std::io::{BufRead as _, BufReader};
use std::process::{Child, Command, Stdio};

use futures_util::{SinkExt as _, StreamExt as _};
use prost::Message as _;
use protocol::log::reader::{LogItem, LogReader};
use protocol::log::v1;
use serde_json::{Value, json};
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::tungstenite::client::IntoClientRequest as _;

/// The demonstration of one flight in a folder, with its live values at any free port.
fn demonstration(folder: &std::path::Path) -> (Child, impl Iterator<Item = String> + use<>) {
    let mut child = Command::new(env!("CARGO_BIN_EXE_ground"))
        .args(["--headless", "--start", "apogee", "--speed", "2", "--log", "flight.mcap"])
        .args(["--foxglove", "127.0.0.1:0"])
        .current_dir(folder)
        .env("XDG_RUNTIME_DIR", folder)
        .env("XDG_CONFIG_HOME", folder)
        .stdout(Stdio::piped())
        .spawn()
        .expect("the program can be started");
    let lines = BufReader::new(child.stdout.take().expect("its output")).lines();
    (child, lines.map(|line| line.expect("a line of text")))
}

/// What a client receives: the channels by topic, with their ids, and the records by id.
async fn record_until_the_end(url: String) -> (BTreeMap<String, (u64, Value)>, BTreeMap<u64, Vec<Vec<u8>>>) {
    let connected = || async {
        let mut request = url.clone().into_client_request().expect("an address");
        request.headers_mut().insert("sec-websocket-protocol", "foxglove.sdk.v1".parse().expect("a header"));
        tokio_tungstenite::connect_async(request).await.expect("the station listens").0
    };
    // The second one subscribes to everything and reads nothing.
    let (mut socket, mut hung) = (connected().await, connected().await);
    let (mut channels, mut messages) = (BTreeMap::new(), BTreeMap::<u64, Vec<Vec<u8>>>::new());
    while let Some(Ok(message)) = socket.next().await {
        match message {
            Message::Text(text) => {
                let text: Value = serde_json::from_str(&text).expect("JSON");
                let advertised = text["channels"].as_array().cloned().unwrap_or_default();
                let ids: Vec<Value> = advertised.iter().map(|channel| channel["id"].clone()).collect();
                for channel in advertised {
                    let topic = channel["topic"].as_str().expect("a topic").to_owned();
                    channels.insert(topic, (channel["id"].as_u64().expect("an id"), channel));
                }
                // At its end the station takes the channels back, and closes.
                if ids.is_empty() {
                    continue;
                }
                let wanted: Vec<Value> = ids.iter().map(|id| json!({ "id": id, "channelId": id })).collect();
                let subscribe = json!({ "op": "subscribe", "subscriptions": wanted }).to_string();
                for client in [&mut hung, &mut socket] {
                    client.send(Message::Text(subscribe.clone().into())).await.expect("the station listens");
                }
            }
            // One byte 1, the id of the subscription, the time of the log, and the record.
            Message::Binary(bytes) if bytes[0] == 1 => {
                let id = u32::from_le_bytes(bytes[1..5].try_into().expect("four bytes"));
                messages.entry(id.into()).or_default().push(bytes[13..].to_vec());
            }
            _ => {}
        }
    }
    (channels, messages)
}

/// The channels and messages of a flight arrive as they are in the log, and the log is complete.
#[test]
fn a_client_receives_the_records_of_the_log() {
    let folder = tempfile::tempdir().unwrap();
    let (mut child, mut lines) = demonstration(folder.path());
    let url = lines.find_map(|line| Some(line[line.find("ws://")?..].to_owned())).expect("an address");
    let client = std::thread::Builder::new().spawn(|| {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        runtime.block_on(record_until_the_end(url))
    });
    let client = client.unwrap();
    let rest: Vec<String> = lines.collect();
    assert!(child.wait().unwrap().success(), "{rest:?}");
    let (channels, messages) = client.join().unwrap();

    let mut reader = LogReader::new(std::fs::File::open(folder.path().join("flight.mcap")).unwrap());
    let mut logged = BTreeMap::<String, Vec<Vec<u8>>>::new();
    let mut schemas = BTreeMap::new();
    while let Some(item) = reader.next_item().unwrap() {
        let LogItem::Message { channel_id, data, .. } = item else { continue };
        let channel = reader.channel(channel_id).unwrap();
        if channel.message_encoding == "protobuf" {
            schemas.insert(channel.topic.clone(), channel.schema_name.clone());
            logged.entry(channel.topic.clone()).or_default().push(data);
        }
    }
    let advertised: BTreeMap<String, String> = channels
        .iter()
        .map(|(topic, (_, channel))| (topic.clone(), channel["schemaName"].as_str().unwrap().to_owned()))
        .collect();
    assert_eq!(advertised, schemas);
    for (topic, records) in &logged {
        let received = messages.get(&channels[topic].0).map_or(&[][..], Vec::as_slice);
        // Records before the subscription and of the last moment are not received.
        let first = records.iter().position(|record| Some(record) == received.first());
        let matching = first.map_or(&[][..], |first| &records[first..]);
        let astray = matching.iter().zip(received).position(|(one, other)| one != other);
        let (got, of) = (received.len(), records.len());
        assert!(
            matching.starts_with(received),
            "{topic}: {got} of {of}, from {first:?}, astray at {astray:?}"
        );
    }
    let telemetry = &messages[&channels["/telemetry"].0];
    let altitudes: Vec<f64> = telemetry
        .iter()
        .filter_map(|record| v1::Telemetry::decode(&record[..]).unwrap().altitude_m)
        .collect();
    assert!(telemetry.len() > 20 && altitudes.iter().any(|altitude_m| *altitude_m > 10.0), "{altitudes:?}");
}

/// A port in use is an error that names it, and no log is left.
#[test]
fn a_port_in_use_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let other = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let at = other.local_addr().unwrap().to_string();
    for (arguments, code, named) in [
        (&["--foxglove", &at][..], 1, at.as_str()),
        (&["--foxglove", "127.0.0.1:0", "--log", "none"], 1, "--log none"),
        (&["--foxglove", "8765"], 2, "--foxglove"),
    ] {
        let output = Command::new(env!("CARGO_BIN_EXE_ground"))
            .args(arguments)
            .current_dir(folder.path())
            .env("XDG_CONFIG_HOME", folder.path())
            .output()
            .unwrap();
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code() == Some(code) && error.contains(named), "{error}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

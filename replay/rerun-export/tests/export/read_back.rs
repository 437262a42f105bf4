//! Reads recordings back.

use std::collections::BTreeSet;
use std::path::Path;

use rerun::external::re_log_encoding::Decoder;
use rerun::log::{Chunk, LogMsg};

/// A recording that was read back.
pub(crate) struct Recording {
    pub(crate) application: String,
    pub(crate) ids: BTreeSet<String>,
    pub(crate) chunks: Vec<Chunk>,
    pub(crate) layouts: usize,
    pub(crate) layout_chunks: usize,
}

impl Recording {
    pub(crate) fn read(path: &Path) -> Self {
        let file = std::io::BufReader::new(std::fs::File::open(path).unwrap());
        let mut recording = Self {
            application: String::new(),
            ids: BTreeSet::new(),
            chunks: Vec::new(),
            layouts: 0,
            layout_chunks: 0,
        };
        for message in Decoder::<LogMsg>::decode_eager(file).unwrap() {
            match message.unwrap() {
                LogMsg::SetStoreInfo(set) => {
                    recording.application = set.info.application_id().to_string();
                }
                LogMsg::ArrowMsg(store, arrow) if store.is_recording() => {
                    recording.ids.insert(store.recording_id().as_str().to_owned());
                    recording.chunks.push(Chunk::from_arrow_msg(&arrow).unwrap());
                }
                LogMsg::ArrowMsg(..) => recording.layout_chunks += 1,
                LogMsg::BlueprintActivationCommand(_) => recording.layouts += 1,
            }
        }
        recording
    }

    pub(crate) fn of<'a>(&'a self, path: &'a str) -> impl Iterator<Item = &'a Chunk> {
        self.chunks.iter().filter(move |chunk| chunk.entity_path().to_string() == format!("/{path}"))
    }

    pub(crate) fn rows(&self, path: &str) -> usize {
        self.of(path).filter(|chunk| !chunk.is_static()).map(Chunk::num_rows).sum()
    }

    pub(crate) fn is_static(&self, path: &str) -> bool {
        self.of(path).any(Chunk::is_static)
    }

    /// The times of an entity on a timeline.
    pub(crate) fn times(&self, path: &str, timeline: &'static str) -> Vec<i64> {
        let columns = self.of(path).filter_map(|chunk| chunk.timelines().get(&timeline.into()));
        columns.flat_map(|column| column.times_raw().to_vec()).collect()
    }
}

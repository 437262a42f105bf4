//! The vehicle's parameters, as received.

use std::collections::BTreeMap;

use protocol::dialect::PARAM_VALUE_DATA;

/// How many parameters are kept, so that a vehicle that keeps sending new names cannot fill the memory.
const KEPT_MAX: usize = 1_024;

/// The values by name, and how many the vehicle has.
#[derive(Debug, Clone, Default)]
pub struct Parameters {
    known: BTreeMap<String, f64>,
    /// How many the vehicle says it has; `None` before the first.
    pub count: Option<u16>,
    pub(crate) asked: bool,
}

impl Parameters {
    pub fn iter(&self) -> impl Iterator<Item = (&str, f64)> {
        self.known.iter().map(|(name, value)| (name.as_str(), *value))
    }

    pub fn len(&self) -> usize {
        self.known.len()
    }

    pub fn is_empty(&self) -> bool {
        self.known.is_empty()
    }

    pub(crate) fn take(&mut self, data: &PARAM_VALUE_DATA) {
        // Up to 16 characters; no terminator when all are used.
        let bytes: Vec<u8> = data.param_id.as_ref().iter().copied().take_while(|byte| *byte != 0).collect();
        let name = protocol::text::printable(&bytes);
        if self.known.len() < KEPT_MAX || self.known.contains_key(&name) {
            self.known.insert(name, f64::from(data.param_value));
        }
        self.count = Some(data.param_count);
    }
}

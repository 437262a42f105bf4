//! The vehicle's parameters, as it has told them.

use std::collections::BTreeMap;

use protocol::dialect::PARAM_VALUE_DATA;

/// Parameters kept; a vehicle that invents names cannot grow memory.
const KEPT_MAX: usize = 1_024;

/// Name to value, and how many there are to be.
#[derive(Debug, Clone, Default)]
pub struct Parameters {
    known: BTreeMap<String, f64>,
    /// How many the vehicle says it has; `None` before the first.
    pub count: Option<u16>,
    pub(crate) asked: bool,
}

impl Parameters {
    /// By name.
    pub fn iter(&self) -> impl Iterator<Item = (&str, f64)> {
        self.known.iter().map(|(name, value)| (name.as_str(), *value))
    }

    /// How many are known.
    pub fn len(&self) -> usize {
        self.known.len()
    }

    /// None is known.
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

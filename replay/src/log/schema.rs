//! Finds the names of fields, and which fields of a record are missing or unknown, from this build's schemas; the
//! generated types do not know them.

use std::sync::LazyLock;

use prost_reflect::{
    Cardinality, DescriptorPool, DynamicMessage, MessageDescriptor, ReflectMessage as _, Value,
};
use protocol::log::{DESCRIPTORS_COMPUTER_V1, DESCRIPTORS_FLIGHT_V1, DESCRIPTORS_V1};

/// Package of the log's own records.
pub(super) const PACKAGE: &str = "touchdown.log.v1";

/// Package of the records of the flight from apogee.
pub(super) const PACKAGE_FLIGHT: &str = "touchdown.flight.v1";

/// Package of the flight computer's frames from power-up on.
pub(super) const PACKAGE_COMPUTER: &str = "touchdown.computer.v1";

static POOL: LazyLock<DescriptorPool> = LazyLock::new(|| {
    let mut pool = DescriptorPool::decode(DESCRIPTORS_V1).unwrap_or_default();
    // A schema that cannot be added would be missing, and the crate's tests would notice.
    let _ = pool.decode_file_descriptor_set(DESCRIPTORS_FLIGHT_V1);
    let _ = pool.decode_file_descriptor_set(DESCRIPTORS_COMPUTER_V1);
    pool
});

/// Describes a frame of the flight computer.
pub(crate) fn pilot_descriptor() -> Option<MessageDescriptor> {
    POOL.get_message_by_name("touchdown.flight.v1.PilotTick")
}

/// Descriptor of a frame of the flight computer from power-up on.
pub(crate) fn computer_descriptor() -> Option<MessageDescriptor> {
    POOL.get_message_by_name("touchdown.computer.v1.ComputerFrame")
}

/// Why a record cannot be understood exactly: a missing or an unknown field. `None` if it can.
pub(super) fn complaint(full_name: &str, data: &[u8]) -> Option<String> {
    let descriptor = POOL.get_message_by_name(full_name)?;
    match DynamicMessage::decode(descriptor, data) {
        Ok(message) => message_complaint(&message, ""),
        Err(error) => Some(error.to_string()),
    }
}

fn message_complaint(message: &DynamicMessage, path: &str) -> Option<String> {
    if let Some(unknown) = message.unknown_fields().next() {
        let place = if path.is_empty() { "the record" } else { path.trim_end_matches('.') };
        return Some(format!(
            "{place} has a field number {} that this build does not know: a newer version wrote it",
            unknown.number()
        ));
    }
    message.descriptor().fields().find_map(|field| {
        let name = format!("{path}{}", field.name());
        if field.cardinality() == Cardinality::Required && !message.has_field(&field) {
            return Some(format!("{name} is missing; this build needs it"));
        }
        match message.get_field(&field).as_ref() {
            Value::Message(inner) if message.has_field(&field) => {
                message_complaint(inner, &format!("{name}."))
            }
            Value::List(items) => items.iter().enumerate().find_map(|(index, item)| {
                message_complaint(item.as_message()?, &format!("{name}[{index}]."))
            }),
            _ => None,
        }
    })
}

#[cfg(test)]
mod tests {
    use prost::Message as _;
    use protocol::log::{flight_v1, v1};

    use super::*;

    #[test]
    fn every_record_is_described() {
        for name in ["LandingVerdict", "Telemetry", "OperatorAction"] {
            assert!(POOL.get_message_by_name(&format!("{PACKAGE}.{name}")).is_some(), "{name}");
        }
        assert!(pilot_descriptor().is_some() && computer_descriptor().is_some());
    }

    #[test]
    fn a_missing_field_is_named() {
        let tick = "touchdown.flight.v1.PilotTick";
        assert_eq!(complaint(tick, &flight_v1::PilotTick::default().encode_to_vec()), None);
        assert_eq!(complaint(tick, &[]).unwrap(), "input is missing; this build needs it");
        // Field 1, a message of no bytes.
        assert_eq!(complaint(tick, &[0x0a, 0x00]).unwrap(), "input.frame is missing; this build needs it");
    }

    #[test]
    fn an_unknown_field_is_named_with_its_place() {
        let mut action = v1::OperatorAction::default().encode_to_vec();
        // Field 15, a varint.
        action.extend([0x78, 0x01]);
        let complaint = complaint("touchdown.log.v1.OperatorAction", &action).unwrap();
        assert!(complaint.contains("field number 15"), "{complaint}");
    }
}

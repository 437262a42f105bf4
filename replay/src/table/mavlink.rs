//! Reads raw MAVLink frames as rows: one table for each message of each sender, one column for each field.
//!
//! The fields come from the dialect's XML, so every message has its table without any code here.

use protocol::frame::Frame;

use super::columns::{Column, Kind, TableShape};
use super::dialect::{Wire, message};
use super::rows::Cell;

/// The columns before the fields: who recorded the frame, whether it was received or sent, on which link, its number.
const OF_FRAME: [(&str, Kind); 4] = [
    ("recorded_by", Kind::Text),
    ("direction", Kind::Text),
    ("link", Kind::Text),
    ("frame_sequence", Kind::Integer),
];

/// The table of a frame's message, if the dialect has the message.
pub(super) fn shape_of(frame: &Frame) -> Option<TableShape> {
    let message = message(frame.message_id())?;
    let source = frame.source();
    let name =
        format!("mavlink_{}_{}_{}", source.system_id, source.component_id, message.name.to_ascii_lowercase());
    let mut shape = TableShape::new(&name, &OF_FRAME);
    for field in &message.fields {
        let kind = field.wire.kind();
        match field.count.filter(|_| kind != Kind::Text) {
            None => {
                let column = Column { name: field.name.clone(), kind, meaning: field.meaning.clone() };
                shape.columns.push(column);
            }
            Some(count) => shape.columns.extend((1..=count).map(|k| Column {
                name: format!("{}_{k}", field.name),
                kind,
                meaning: field.meaning.clone(),
            })),
        }
    }
    Some(shape)
}

/// The cells after the time.
pub(super) fn cells_of(frame: &Frame, [recorded_by, direction, link]: [&str; 3]) -> Vec<Cell> {
    let text = |words: &str| Cell::Text(words.to_owned());
    let sequence = Cell::Integer(i64::from(frame.sequence()));
    let mut cells = vec![text(recorded_by), text(direction), text(link), sequence];
    let payload = frame.padded_payload();
    for field in message(frame.message_id()).map(|message| &message.fields).into_iter().flatten() {
        let size = field.wire.size();
        let bytes = |at: usize, length: usize| payload.get(at..at + length).unwrap_or_default();
        match field.count {
            Some(count) if field.wire == Wire::Char => cells.push(field.wire.value(bytes(field.at, count))),
            count => cells
                .extend((0..count.unwrap_or(1)).map(|k| field.wire.value(bytes(field.at + k * size, size)))),
        }
    }
    cells
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use protocol::dialect::{MavMessage, TD_FINS_DATA, TD_LANDING_VERDICT_DATA};
    use protocol::frame::Encoder;
    use protocol::identity::VEHICLE;

    use super::*;

    fn row(message: &MavMessage) -> (TableShape, BTreeMap<String, Cell>) {
        let frame = Encoder::new(VEHICLE).encode(message);
        let shape = shape_of(&frame).unwrap();
        let cells = cells_of(&frame, ["ground", "rx", "udp"]);
        assert_eq!(shape.columns.len(), cells.len() + 1, "the time comes first");
        let named = shape.columns.iter().skip(1).map(|column| column.name.clone()).zip(cells).collect();
        (shape, named)
    }

    #[test]
    fn every_field_of_a_message_has_its_value() {
        let verdict = TD_LANDING_VERDICT_DATA {
            time_boot_ms: 19_846,
            u_m_s: -0.31,
            landed: 1,
            ..TD_LANDING_VERDICT_DATA::default()
        };
        let (shape, cells) = row(&MavMessage::TD_LANDING_VERDICT(verdict));
        assert_eq!(shape.name, "mavlink_1_1_td_landing_verdict");
        assert_eq!(cells["time_boot_ms"], Cell::Integer(19_846));
        assert_eq!(cells["u_m_s"], Cell::Float(f64::from(-0.31_f32)));
        assert_eq!(cells["landed"], Cell::Integer(1));
        let (_, cells) =
            row(&MavMessage::TD_FINS(TD_FINS_DATA { commanded: [1, -2, 3, -4], ..TD_FINS_DATA::default() }));
        assert_eq!((&cells["commanded_2"], &cells["commanded_4"]), (&Cell::Integer(-2), &Cell::Integer(-4)));
    }
}

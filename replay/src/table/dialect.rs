//! The messages of the MAVLink dialect, from its XML.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use protocol::dialect::XML_FILES;
use protocol::frame::Frame;
use roxmltree::{Document, Node};

use super::{Cell, Column, Kind, TableShape};

/// The messages of the dialect.
static MESSAGES: LazyLock<BTreeMap<u32, Message>> =
    LazyLock::new(|| XML_FILES.into_iter().flat_map(messages).collect());

/// A message and its fields in the order of the XML.
#[derive(Debug, Default)]
pub(super) struct Message {
    pub(super) name: String,
    pub(super) fields: Vec<Field>,
}

#[derive(Debug)]
pub(super) struct Field {
    pub(super) name: String,
    wire: Wire,
    /// Size of an element, bytes.
    size: usize,
    /// Number of elements; `None` for a single value.
    pub(super) count: Option<usize>,
    extension: bool,
    /// Place of its first byte in the payload.
    pub(super) at: usize,
}

/// A type on the wire.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Wire {
    Unsigned,
    Signed,
    Float,
    Char,
}

impl Wire {
    /// The type of a name, and the size of its values, bytes.
    fn named(name: &str) -> Option<(Self, usize)> {
        Some(match name.trim_end_matches("_mavlink_version") {
            "float" => (Self::Float, 4),
            "double" => (Self::Float, 8),
            "char" => (Self::Char, 1),
            whole => {
                let unsigned = whole.strip_prefix('u');
                let bits = unsigned.unwrap_or(whole).strip_prefix("int")?.strip_suffix("_t")?;
                let wire = if unsigned.is_some() { Self::Unsigned } else { Self::Signed };
                (wire, bits.parse::<usize>().ok()? / 8)
            }
        })
    }

    fn kind(self) -> Kind {
        match self {
            Self::Unsigned | Self::Signed => Kind::Integer,
            Self::Float => Kind::Float,
            Self::Char => Kind::Text,
        }
    }

    /// The value in these bytes, the least significant first; whole numbers of 64 bits wrap around.
    fn value(self, bytes: &[u8]) -> Cell {
        let mut wide = [0; 8];
        wide.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
        let whole = u64::from_le_bytes(wide);
        match self {
            Self::Unsigned => Cell::Integer(whole.cast_signed()),
            Self::Signed => {
                let unused = 64 - 8 * bytes.len().clamp(1, 8);
                Cell::Integer((whole << unused).cast_signed() >> unused)
            }
            Self::Float if bytes.len() == 4 => Cell::Float(f64::from(f32::from_bits(whole as u32))),
            Self::Float => Cell::Float(f64::from_bits(whole)),
            Self::Char => {
                let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
                Cell::Text(String::from_utf8_lossy(&bytes[..end]).into_owned())
            }
        }
    }
}

/// The messages of a file by their numbers. The files come with the program: that each can be read
/// is tested.
fn messages(xml: &str) -> Vec<(u32, Message)> {
    let message = |node: Node<'_, '_>| {
        let id = node.attribute("id").filter(|_| node.has_tag_name("message"))?.parse().ok()?;
        let mut extension = false;
        let mut fields = Vec::new();
        for child in node.children() {
            extension |= child.has_tag_name("extensions");
            fields.extend(field(child, extension));
        }
        place(&mut fields);
        Some((id, Message { name: node.attribute("name")?.to_owned(), fields }))
    };
    Document::parse(xml).iter().flat_map(Document::descendants).filter_map(message).collect()
}

fn field(node: Node<'_, '_>, extension: bool) -> Option<Field> {
    let given = node.attribute("type").filter(|_| node.has_tag_name("field"))?;
    let (wire, count) = match given.split_once('[') {
        None => (given, None),
        Some((wire, rest)) => (wire, Some(rest.trim_end_matches(']').parse().ok()?)),
    };
    let name = node.attribute("name")?.to_owned();
    let (wire, size) = Wire::named(wire)?;
    Some(Field { name, wire, size, count, extension, at: 0 })
}

/// On the wire the largest types come first, and extensions last, in their own order.
fn place(fields: &mut [Field]) {
    let mut order: Vec<usize> = (0..fields.len()).collect();
    order.sort_by_key(|k| {
        let field = &fields[*k];
        (field.extension, if field.extension { 0 } else { 8 - field.size })
    });
    let mut at = 0;
    for k in order {
        fields[k].at = at;
        at += fields[k].size * fields[k].count.unwrap_or(1);
    }
}

/// The columns before the fields: who recorded the frame, whether it was received or sent, on which
/// link, its number.
const OF_FRAME: [(&str, Kind); 4] = [
    ("recorded_by", Kind::Text),
    ("direction", Kind::Text),
    ("link", Kind::Text),
    ("frame_sequence", Kind::Integer),
];

/// The table of a frame's message, if the dialect has the message.
pub(super) fn shape_of_frame(frame: &Frame) -> Option<TableShape> {
    let message = MESSAGES.get(&frame.message_id())?;
    let source = frame.source();
    let name =
        format!("mavlink_{}_{}_{}", source.system_id, source.component_id, message.name.to_ascii_lowercase());
    let mut shape = TableShape::new(&name, &OF_FRAME);
    for field in &message.fields {
        let kind = field.wire.kind();
        match field.count.filter(|_| kind != Kind::Text) {
            None => {
                shape.columns.push(Column { name: field.name.clone(), kind });
            }
            Some(count) => {
                let column = |k| Column { name: format!("{}_{k}", field.name), kind };
                shape.columns.extend((1..=count).map(column));
            }
        }
    }
    Some(shape)
}

/// The cells after the time.
pub(super) fn cells_of_frame(frame: &Frame, [recorded_by, direction, link]: [&str; 3]) -> Vec<Cell> {
    let text = |words: &str| Cell::Text(words.to_owned());
    let sequence = Cell::Integer(i64::from(frame.sequence()));
    let mut cells = vec![text(recorded_by), text(direction), text(link), sequence];
    let payload = frame.padded_payload();
    for field in MESSAGES.get(&frame.message_id()).map(|message| &message.fields).into_iter().flatten() {
        let size = field.size;
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
    use super::*;
    use std::collections::BTreeMap;

    use protocol::dialect::{MavMessage, TD_FINS_DATA, TD_LANDING_VERDICT_DATA, TdLanding};
    use protocol::frame::Encoder;
    use protocol::identity::VEHICLE;

    /// The generated code and the XML agree on the name of every message, and no payload is longer
    /// than a frame's.
    #[test]
    fn every_message_of_the_dialect_has_its_fields() {
        assert!(XML_FILES.iter().all(|xml| Document::parse(xml).is_ok()));
        assert!(MESSAGES.len() > 200, "{}", MESSAGES.len());
        for (id, message) in &*MESSAGES {
            let Some(name) = protocol::dialect::message_name(*id) else { continue };
            assert_eq!(message.name, name);
            let end = |field: &Field| field.at + field.size * field.count.unwrap_or(1);
            assert!(message.fields.iter().map(end).max().is_some_and(|end| end <= 255), "{name}");
        }
    }

    fn row(message: &MavMessage) -> (TableShape, BTreeMap<String, Cell>) {
        let frame = Encoder::new(VEHICLE).encode(message);
        let shape = shape_of_frame(&frame).unwrap();
        let cells = cells_of_frame(&frame, ["ground", "rx", "udp"]);
        assert_eq!(shape.columns.len(), cells.len() + 1, "the time comes first");
        let named = shape.columns.iter().skip(1).map(|column| column.name.clone()).zip(cells).collect();
        (shape, named)
    }

    #[test]
    fn every_field_of_a_message_has_its_value() {
        let verdict = TD_LANDING_VERDICT_DATA {
            time_boot_ms: 19_846,
            vertical_m_s: -0.31,
            landing: TdLanding::TD_LANDING_STANDS,
            ..TD_LANDING_VERDICT_DATA::default()
        };
        let (shape, cells) = row(&MavMessage::TD_LANDING_VERDICT(verdict));
        assert_eq!(shape.name, "mavlink_1_1_td_landing_verdict");
        assert_eq!(cells["time_boot_ms"], Cell::Integer(19_846));
        assert_eq!(cells["vertical_m_s"], Cell::Float(f64::from(-0.31_f32)));
        assert_eq!(cells["landing"], Cell::Integer(1));
        let (_, cells) =
            row(&MavMessage::TD_FINS(TD_FINS_DATA { commanded: [1, -2, 3, -4], ..TD_FINS_DATA::default() }));
        assert_eq!((&cells["commanded_2"], &cells["commanded_4"]), (&Cell::Integer(-2), &Cell::Integer(-4)));
    }
}

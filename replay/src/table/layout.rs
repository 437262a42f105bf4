//! The columns of a record's fields, and the values of an encoded record in them.

use std::collections::BTreeMap;

use prost::DecodeError;
use prost::encoding::WireType::{LengthDelimited, SixtyFourBit, ThirtyTwoBit, Varint};
use prost::encoding::{self, DecodeContext, WireType};
use prost_reflect::Kind as FieldKind;

use super::{Cell, Kind};

/// The fields of a message by their numbers. A field without a column is absent.
#[derive(Default)]
pub(super) struct Layout(pub(super) BTreeMap<u32, Slot>);

/// The columns of a field: of a value, or of the elements of a list, from the first one on.
pub(super) enum Slot {
    Message(Layout),
    Values { scalar: Scalar, first: usize, count: usize },
}

/// Decoding of a kind of value: its column, its type on the wire, and its cell.
#[derive(Clone, Copy)]
pub(super) struct Scalar {
    pub(super) column: Kind,
    wire: WireType,
    read: fn(WireType, &mut &[u8]) -> Result<Cell, DecodeError>,
}

impl Scalar {
    /// `None` for what has no cell: messages, enums, bytes.
    pub(super) fn of(kind: &FieldKind) -> Option<Self> {
        macro_rules! scalar {
            ($column:ident, $wire:ident, $module:ident: $value:ty, $cell:expr) => {{
                let read = |wire: WireType, data: &mut &[u8]| {
                    let mut value = <$value>::default();
                    encoding::$module::merge(wire, &mut value, data, DecodeContext::default())?;
                    let cell: fn($value) -> Cell = $cell;
                    Ok(cell(value))
                };
                Self { column: Kind::$column, wire: $wire, read }
            }};
        }
        Some(match kind {
            FieldKind::Double => scalar!(Float, SixtyFourBit, double: f64, Cell::Float),
            FieldKind::Float => scalar!(Float, ThirtyTwoBit, float: f32, |n| Cell::Float(n.into())),
            FieldKind::Int32 => scalar!(Integer, Varint, int32: i32, |n| Cell::Integer(n.into())),
            FieldKind::Sint32 => scalar!(Integer, Varint, sint32: i32, |n| Cell::Integer(n.into())),
            FieldKind::Uint32 => scalar!(Integer, Varint, uint32: u32, |n| Cell::Integer(n.into())),
            FieldKind::Int64 => scalar!(Integer, Varint, int64: i64, Cell::Integer),
            FieldKind::Sint64 => scalar!(Integer, Varint, sint64: i64, Cell::Integer),
            FieldKind::Uint64 => scalar!(Integer, Varint, uint64: u64, |n| Cell::Integer(n.cast_signed())),
            FieldKind::Sfixed32 => scalar!(Integer, ThirtyTwoBit, sfixed32: i32, |n| Cell::Integer(n.into())),
            FieldKind::Fixed32 => scalar!(Integer, ThirtyTwoBit, fixed32: u32, |n| Cell::Integer(n.into())),
            FieldKind::Sfixed64 => scalar!(Integer, SixtyFourBit, sfixed64: i64, Cell::Integer),
            FieldKind::Fixed64 => {
                scalar!(Integer, SixtyFourBit, fixed64: u64, |n| Cell::Integer(n.cast_signed()))
            }
            FieldKind::Bool => scalar!(Integer, Varint, bool: bool, |flag| Cell::Integer(flag.into())),
            FieldKind::String => scalar!(Text, LengthDelimited, string: String, Cell::Text),
            _ => return None,
        })
    }
}

impl Layout {
    /// Writes the values of an encoded message into the cells of its row.
    ///
    /// # Errors
    /// The bytes are no such message.
    pub(super) fn read(&self, mut data: &[u8], cells: &mut [Cell]) -> Result<(), DecodeError> {
        while !data.is_empty() {
            let (number, wire) = encoding::decode_key(&mut data)?;
            match self.0.get(&number) {
                Some(Slot::Message(inner)) => inner.read(delimited(wire, &mut data)?, cells)?,
                Some(Slot::Values { scalar: Scalar { wire: packed, read, .. }, first, count }) => {
                    let mut room = cells[*first..first + count].iter_mut();
                    if wire == LengthDelimited && *packed != LengthDelimited {
                        let mut list = delimited(wire, &mut data)?;
                        while let (false, Some(cell)) = (list.is_empty(), room.next()) {
                            *cell = read(*packed, &mut list)?;
                        }
                    } else {
                        let value = read(wire, &mut data)?;
                        // The elements of a list may come one by one.
                        if let Some(cell) = room.find(|cell| *count == 1 || **cell == Cell::Absent) {
                            *cell = value;
                        }
                    }
                }
                None => encoding::skip_field(wire, number, &mut data, DecodeContext::default())?,
            }
        }
        Ok(())
    }
}

/// The bytes of a message or of a packed list, which are taken from `data`.
fn delimited<'a>(wire: WireType, data: &mut &'a [u8]) -> Result<&'a [u8], DecodeError> {
    let before = *data;
    // The field number does not matter here.
    encoding::skip_field(wire, 1, data, DecodeContext::default())?;
    let field = &before[..before.len() - data.len()];
    let mut rest = field;
    encoding::decode_varint(&mut rest)?;
    Ok(rest)
}

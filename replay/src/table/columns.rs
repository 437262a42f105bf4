//! The columns of a table, from a record's description.

use prost_reflect::{FieldDescriptor, Kind as FieldKind, MessageDescriptor};

/// A vehicle has four fins, and the log lists their angles.
const FINS: usize = 4;

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Numbers.
    Float,
    /// Whole numbers; also flags, as 0 and 1.
    Integer,
    /// Text.
    Text,
}

/// One column of a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Column {
    /// Its name, with its unit.
    pub name: String,
    /// What it holds.
    pub kind: Kind,
}

/// The name and the columns of a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TableShape {
    /// Its name: the topic in lower case with underscores, as in `controller_tick`.
    pub name: String,
    /// Its columns; the first is `log_time_ns`, Unix time.
    pub columns: Vec<Column>,
}

/// Where a column's value stands in a record: fields from the outside in, and an element of a list.
#[derive(Debug, Clone)]
pub(super) struct Place {
    pub(super) fields: Vec<FieldDescriptor>,
    pub(super) element: Option<usize>,
}

impl TableShape {
    pub(super) fn new(name: &str, columns: &[(&str, Kind)]) -> Self {
        let time = [("log_time_ns", Kind::Integer)];
        let columns = time.iter().chain(columns);
        Self {
            name: name.to_owned(),
            columns: columns.map(|(name, kind)| Column { name: (*name).to_owned(), kind: *kind }).collect(),
        }
    }

    /// The table of a kind of record, and where its columns' values stand, without the time.
    pub(super) fn of_record(name: &str, descriptor: &MessageDescriptor) -> (Self, Vec<Place>) {
        let mut shape = Self::new(name, &[]);
        let mut places = Vec::new();
        walk(descriptor, &mut Vec::new(), &mut |column, place| {
            shape.columns.push(column);
            places.push(place);
        });
        (shape, places)
    }
}

/// The name of a topic's table.
pub(super) fn table_name(topic: &str) -> String {
    let word = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '_' };
    topic.trim_matches('/').chars().map(word).collect()
}

fn walk(
    descriptor: &MessageDescriptor,
    above: &mut Vec<FieldDescriptor>,
    take: &mut impl FnMut(Column, Place),
) {
    for field in descriptor.fields() {
        above.push(field.clone());
        let name = above.iter().map(|field| field.name().to_owned()).collect::<Vec<_>>().join(".");
        match (field.kind(), kind_of(&field)) {
            (FieldKind::Message(inner), _) if !field.is_list() => walk(&inner, above, take),
            (_, Some(kind)) if !field.is_list() => {
                take(Column { name, kind }, Place { fields: above.clone(), element: None });
            }
            (_, Some(kind)) if field.name().starts_with("fin_") => {
                for fin in 0..FINS {
                    let place = Place { fields: above.clone(), element: Some(fin) };
                    take(Column { name: fin_name(&name, fin), kind }, place);
                }
            }
            _ => {}
        }
        above.pop();
    }
}

/// `fin_command_rad` of fin 2 is `fin_2_command_rad`: the unit stays at the end.
fn fin_name(name: &str, fin: usize) -> String {
    match name.rsplit_once("fin_") {
        Some((before, what)) => format!("{before}fin_{}_{what}", fin + 1),
        None => format!("{name}_{}", fin + 1),
    }
}

fn kind_of(field: &FieldDescriptor) -> Option<Kind> {
    match field.kind() {
        FieldKind::Double | FieldKind::Float => Some(Kind::Float),
        FieldKind::Int32
        | FieldKind::Int64
        | FieldKind::Uint32
        | FieldKind::Uint64
        | FieldKind::Sint32
        | FieldKind::Sint64
        | FieldKind::Fixed32
        | FieldKind::Fixed64
        | FieldKind::Sfixed32
        | FieldKind::Sfixed64
        | FieldKind::Bool => Some(Kind::Integer),
        FieldKind::String => Some(Kind::Text),
        _ => None,
    }
}

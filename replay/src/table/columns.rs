//! Derives the columns of a table from the schema of a record.

use prost_reflect::{
    DynamicMessage, FieldDescriptor, Kind as FieldKind, MessageDescriptor, ReflectMessage as _, Value,
};

use super::dialect::words_of;

/// A list up to this length has one column for each element; a longer one, has none.
const LIST_MAX: usize = 8;

/// Unit suffixes of field names and their units, the longest first.
const UNITS: [(&str, &str); 13] = [
    ("_rad_s2", "rad/s2"),
    ("_rad_s", "rad/s"),
    ("_m_s2", "m/s2"),
    ("_m_s", "m/s"),
    ("_kg_m2", "kg m2"),
    ("_bytes", "bytes"),
    ("_rad", "rad"),
    ("_deg", "deg"),
    ("_kg", "kg"),
    ("_ms", "ms"),
    ("_m", "m"),
    ("_n", "N"),
    ("_s", "s"),
];

/// The components of vectors and quaternions.
const COMPONENTS: [&str; 4] = ["x", "y", "z", "w"];

/// The type of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Numbers.
    Float,
    /// Whole numbers, and flags as 0 and 1.
    Integer,
    Text,
}

/// One column of a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Column {
    /// Its name, with its unit.
    pub name: String,
    pub kind: Kind,
    pub meaning: Meaning,
}

/// What the numbers of a column mean, from the schema or the dialect.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Meaning {
    /// As in `m/s`; empty without one.
    pub unit: String,
    /// In words; empty if neither schema nor dialect says more than the name.
    pub words: String,
    /// The enum of the dialect that has words for the numbers.
    pub(super) values_of: Option<String>,
}

impl Meaning {
    /// The words for the numbers of the column, if it is an enum.
    pub fn values(&self) -> &'static [(i64, String)] {
        self.values_of.as_deref().map_or(&[], words_of)
    }

    /// The meaning of a field of a record, from the names and the comments in its schema; `path` has the fields from the
    /// outside in. The components of a vector have the unit of the vector, and a field without a comment has that of the
    /// field around it.
    fn of(path: &[FieldDescriptor]) -> Self {
        let unit_of = |field: &FieldDescriptor| {
            UNITS.into_iter().find(|(suffix, _)| field.name().ends_with(suffix)).map(|(_, unit)| unit)
        };
        let mut inside_out = path.iter().rev().skip_while(|field| COMPONENTS.contains(&field.name()));
        let unit = inside_out.next().and_then(unit_of).unwrap_or_default();
        let mut comments = path.iter().rev().map(comment_on);
        let words = comments.find(|words| !words.is_empty()).unwrap_or_default();
        // "As in the dialect's TD_PHASE."
        let of_field = path.last().map(comment_on).unwrap_or_default();
        let mut all = of_field.split(|c: char| !(c.is_ascii_uppercase() || c == '_'));
        let values_of = all.find(|word| word.starts_with("TD_") && !words_of(word).is_empty());
        Self { unit: unit.to_owned(), values_of: values_of.map(str::to_owned), words }
    }
}

/// The comment before a field in its schema, in one line.
fn comment_on(field: &FieldDescriptor) -> String {
    let file = field.parent_file();
    let info = file.file_descriptor_proto().source_code_info.as_ref();
    let found = info.and_then(|info| info.location.iter().find(|location| location.path == field.path()));
    let comment = found.and_then(|location| location.leading_comments.as_deref()).unwrap_or_default();
    comment.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The name and the columns of a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TableShape {
    /// Its name: the topic in lower case with underscores, as in `controller_tick`.
    pub name: String,
    /// Its columns; the first is `log_time_ns`, Unix time.
    pub columns: Vec<Column>,
}

/// Path of a column's value in a record: fields from the outside in, and an element of a list.
#[derive(Debug, Clone)]
pub(super) struct Place {
    pub(super) fields: Vec<FieldDescriptor>,
    pub(super) element: Option<usize>,
}

impl TableShape {
    pub(super) fn new(name: &str, columns: &[(&str, Kind)]) -> Self {
        let time = Column {
            name: "log_time_ns".to_owned(),
            kind: Kind::Integer,
            meaning: Meaning {
                unit: "ns".to_owned(),
                words: "Unix time of the record.".to_owned(),
                values_of: None,
            },
        };
        let others = columns.iter().map(|(name, kind)| Column {
            name: (*name).to_owned(),
            kind: *kind,
            meaning: Meaning::default(),
        });
        Self { name: name.to_owned(), columns: std::iter::once(time).chain(others).collect() }
    }

    /// The table of a kind of record, and the paths of its columns' values, without the time. Lists are assumed to be
    /// as long as in this first record.
    pub(super) fn of_record(name: &str, first: &DynamicMessage) -> (Self, Vec<Place>) {
        let mut shape = Self::new(name, &[]);
        let mut places = Vec::new();
        walk(&first.descriptor(), Some(first), &mut Vec::new(), &mut |column, place| {
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
    record: Option<&DynamicMessage>,
    above: &mut Vec<FieldDescriptor>,
    take: &mut impl FnMut(Column, Place),
) {
    // A schema may contain itself; this is the deepest nesting that is followed.
    if above.len() > LIST_MAX {
        return;
    }
    for field in descriptor.fields() {
        above.push(field.clone());
        let name = above.iter().map(|field| field.name().to_owned()).collect::<Vec<_>>().join(".");
        let value = record.map(|record| record.get_field(&field).into_owned());
        match (field.kind(), kind_of(&field), value) {
            (FieldKind::Message(inner), _, value) if !field.is_list() && !field.is_map() => {
                let below = value.as_ref().and_then(|value| value.as_message());
                walk(&inner, below, above, take);
            }
            (_, Some(kind), Some(Value::List(items))) if field.is_list() && items.len() <= LIST_MAX => {
                for element in 0..items.len() {
                    let place = Place { fields: above.clone(), element: Some(element) };
                    let meaning = Meaning::of(above);
                    take(Column { name: element_name(&name, element), kind, meaning }, place);
                }
            }
            (_, Some(kind), _) if !field.is_list() => {
                let meaning = Meaning::of(above);
                take(Column { name, kind, meaning }, Place { fields: above.clone(), element: None });
            }
            _ => {}
        }
        above.pop();
    }
}

/// The second element of `fins_rad` is `fins_2_rad`: the unit stays at the end.
fn element_name(name: &str, element: usize) -> String {
    let unit = UNITS.into_iter().map(|(suffix, _)| suffix).find(|suffix| name.ends_with(suffix));
    let unit = unit.unwrap_or_default();
    format!("{}_{}{unit}", name.strip_suffix(unit).unwrap_or(name), element + 1)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_elements_number_stands_before_its_unit() {
        for (name, second) in [
            ("output.fins_rad", "output.fins_2_rad"),
            ("gimbal_rad_s", "gimbal_2_rad_s"),
            ("position_m", "position_2_m"),
            ("counts", "counts_2"),
        ] {
            assert_eq!(element_name(name, 1), second);
        }
    }
}

//! The names that a mission's settings can have, from the mission's own types.
//!
//! The names come from the types and not from a list: every struct gives its field names to the deserializer, so a
//! deserializer that supplies placeholder values visits the whole mission and notes each path.

use std::cell::RefCell;
use std::collections::BTreeSet;

use serde::Deserialize;
use serde::de::value::{Error, StrDeserializer};
use serde::de::{DeserializeSeed, Deserializer, IntoDeserializer as _, MapAccess, Visitor};

use super::{Setting, SettingError, collect_leaves};

/// The placeholder for a mission's airframe, which may be a name or a table.
const NAME_OR_TABLE: &str = "mk2";

/// The keys that a type may have.
#[derive(Debug, Clone, Default)]
pub(super) struct Names {
    /// All keys.
    pub(super) paths: BTreeSet<String>,
    /// Keys that take whole numbers.
    whole: BTreeSet<String>,
}

impl Names {
    /// The keys that a type may have, after a prefix.
    pub(super) fn of<'de, T: Deserialize<'de>>(prefix: &str) -> Self {
        let names = RefCell::default();
        // Placeholders may not be valid for every type; the keys noted so far are kept.
        let _ = T::deserialize(Walker { path: prefix.to_owned(), names: &names });
        names.into_inner()
    }

    /// Adds the keys of another type.
    pub(super) fn and(mut self, other: Self) -> Self {
        self.paths.extend(other.paths);
        self.whole.extend(other.whole);
        self
    }

    /// Adds the keys that a table has already.
    pub(super) fn with_those_in(mut self, table: &toml::Table) -> Self {
        collect_leaves("", table, &mut |path, _| {
            self.paths.insert(path);
        });
        self
    }

    /// Refuses an unknown name and suggests the most similar one.
    pub(super) fn check(&self, given: &str) -> Result<(), SettingError> {
        check(given, &self.paths)
    }

    /// Whether a key takes whole numbers.
    pub(super) fn is_whole(&self, path: &str) -> bool {
        self.whole.contains(path)
    }

    /// Converts a value to the type of its key: `10.0` from a range means `10` for a key that takes whole numbers.
    pub(super) fn value_of(&self, setting: &Setting) -> Result<toml::Value, SettingError> {
        match setting.value {
            toml::Value::Float(number) if self.is_whole(&setting.path) => {
                let whole = libm::trunc(number) as i64;
                if (whole as f64).to_bits() == number.to_bits() {
                    Ok(toml::Value::Integer(whole))
                } else {
                    Err(SettingError::NotWhole { given: setting.to_string() })
                }
            }
            _ => Ok(setting.value.clone()),
        }
    }
}

/// Refuses an unknown name and suggests the most similar one.
fn check(given: &str, known: &BTreeSet<String>) -> Result<(), SettingError> {
    if known.contains(given) {
        return Ok(());
    }
    let section = format!("{given}.");
    let keys: Vec<String> = known.iter().filter(|path| path.starts_with(&section)).cloned().collect();
    if !keys.is_empty() {
        return Err(SettingError::Section { given: given.to_owned(), keys });
    }
    let nearest = known.iter().max_by(|a, b| {
        strsim::jaro_winkler(given, a).total_cmp(&strsim::jaro_winkler(given, b)).then_with(|| b.cmp(a))
    });
    Err(SettingError::Unknown { given: given.to_owned(), nearest: nearest.cloned().unwrap_or_default() })
}

/// Answers every request with a placeholder and notes its path.
struct Walker<'a> {
    path: String,
    names: &'a RefCell<Names>,
}

impl Walker<'_> {
    fn note(&self) {
        self.names.borrow_mut().paths.insert(self.path.clone());
    }

    fn note_whole(&self) {
        self.note();
        self.names.borrow_mut().whole.insert(self.path.clone());
    }
}

/// Number methods: note the path and give zero.
macro_rules! numbers {
    ($note:ident: $($method:ident $visit:ident $nought:expr),* $(,)?) => {
        $(fn $method<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
            self.$note();
            visitor.$visit($nought)
        })*
    };
}

impl<'de> Deserializer<'de> for Walker<'_> {
    type Error = Error;

    numbers! { note_whole:
        deserialize_i8 visit_i8 0,
        deserialize_i16 visit_i16 0,
        deserialize_i32 visit_i32 0,
        deserialize_i64 visit_i64 0,
        deserialize_u8 visit_u8 0,
        deserialize_u16 visit_u16 0,
        deserialize_u32 visit_u32 0,
        deserialize_u64 visit_u64 0,
    }

    numbers! { note:
        deserialize_bool visit_bool false,
        deserialize_f32 visit_f32 0.0,
        deserialize_f64 visit_f64 0.0,
        deserialize_char visit_char ' ',
        deserialize_str visit_str "",
        deserialize_string visit_str "",
        deserialize_bytes visit_bytes &[],
        deserialize_byte_buf visit_bytes &[],
    }

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        self.note();
        visitor.visit_str(NAME_OR_TABLE)
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_some(self)
    }

    fn deserialize_unit<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_unit()
    }

    fn deserialize_unit_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        visitor: V,
    ) -> Result<V::Value, Error> {
        visitor.visit_unit()
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        visitor: V,
    ) -> Result<V::Value, Error> {
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        self.note();
        visitor.visit_seq(serde::de::value::SeqDeserializer::new(std::iter::empty::<f64>()))
    }

    fn deserialize_tuple<V: Visitor<'de>>(self, len: usize, visitor: V) -> Result<V::Value, Error> {
        self.note();
        visitor.visit_seq(serde::de::value::SeqDeserializer::new(std::iter::repeat_n(0.0_f64, len)))
    }

    fn deserialize_tuple_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        len: usize,
        visitor: V,
    ) -> Result<V::Value, Error> {
        self.deserialize_tuple(len, visitor)
    }

    fn deserialize_map<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_map(Fields { names: [].iter(), next: None, walker: self })
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        visitor.visit_map(Fields { names: fields.iter(), next: None, walker: self })
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        self.note();
        let first: StrDeserializer<'_, Error> =
            variants.first().copied().unwrap_or_default().into_deserializer();
        visitor.visit_enum(first)
    }

    fn deserialize_identifier<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_str("")
    }

    fn deserialize_ignored_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        visitor.visit_unit()
    }
}

/// The fields of a struct, one after the other.
struct Fields<'a> {
    names: std::slice::Iter<'static, &'static str>,
    next: Option<&'static str>,
    walker: Walker<'a>,
}

impl<'de> MapAccess<'de> for Fields<'_> {
    type Error = Error;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, Error> {
        self.next = self.names.next().copied();
        self.next
            .map(|name| {
                let name: StrDeserializer<'_, Error> = name.into_deserializer();
                seed.deserialize(name)
            })
            .transpose()
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, Error> {
        let name = self.next.unwrap_or_default();
        let above = &self.walker.path;
        let path = if above.is_empty() { name.to_owned() } else { format!("{above}.{name}") };
        seed.deserialize(Walker { path, names: self.walker.names })
    }
}

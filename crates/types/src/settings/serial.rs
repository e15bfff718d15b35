//! Sections as serde reads and writes them.
use super::{Section, Slot, Value, merge};
use alloc::{string::String, vec::Vec};
use core::fmt;
use serde::{
    Deserialize, Deserializer, Serialize, Serializer,
    de::{Error, MapAccess, SeqAccess, Visitor},
    ser::SerializeStruct,
};

/// Writes a section as a struct of its fields.
pub fn serialize<S: Serializer>(section: &dyn Section, serializer: S) -> Result<S::Ok, S::Error> {
    let fields = section.fields();
    let mut s = serializer.serialize_struct(section.name(), fields.len())?;
    for (field, slot) in fields.iter().zip(section.slots()) {
        match slot {
            Slot::Section(x) => s.serialize_field(field.name, &Written(x))?,
            Slot::Boolean(x) => s.serialize_field(field.name, &x)?,
            Slot::Integer(x) => s.serialize_field(field.name, &x)?,
            Slot::Number(x) => s.serialize_field(field.name, &x)?,
            Slot::Choice(x) => s.serialize_field(field.name, x.names()[x.index()])?,
            Slot::Integers(x) => s.serialize_field(field.name, x)?,
        }
    }
    s.end()
}

struct Written<'a>(&'a dyn Section);

impl Serialize for Written<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serialize(self.0, serializer)
    }
}

/// Reads into a section: what is left out keeps its value. Types are checked, ranges are left to
/// [`super::validate`].
///
/// # Errors
/// The text of a [`super::ConfigError`], in the deserializer's error.
pub fn deserialize<'de, D: Deserializer<'de>>(
    section: &mut dyn Section,
    deserializer: D,
) -> Result<(), D::Error> {
    merge(section, Value::deserialize(deserializer)?, false).map_err(D::Error::custom)
}

impl<'de> Deserialize<'de> for Value {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Value, D::Error> {
        deserializer.deserialize_any(Reader)
    }
}

impl Serialize for Value {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Value::Boolean(x) => serializer.serialize_bool(*x),
            Value::Integer(x) => serializer.serialize_i64(*x),
            Value::Number(x) => serializer.serialize_f64(*x),
            Value::Text(x) => serializer.serialize_str(x),
            Value::List(values) => serializer.collect_seq(values),
            Value::Table(entries) => serializer.collect_map(entries.iter().map(|(k, v)| (k, v))),
        }
    }
}

struct Reader;

impl<'de> Visitor<'de> for Reader {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the value of a setting")
    }

    fn visit_bool<E>(self, x: bool) -> Result<Value, E> {
        Ok(Value::Boolean(x))
    }

    fn visit_i64<E>(self, x: i64) -> Result<Value, E> {
        Ok(Value::Integer(x))
    }

    fn visit_u64<E>(self, x: u64) -> Result<Value, E> {
        Ok(i64::try_from(x).map_or(Value::Number(x as f64), Value::Integer))
    }

    fn visit_f64<E>(self, x: f64) -> Result<Value, E> {
        Ok(Value::Number(x))
    }

    fn visit_str<E>(self, x: &str) -> Result<Value, E> {
        Ok(Value::Text(x.into()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut values: A) -> Result<Value, A::Error> {
        let mut list = Vec::new();
        while let Some(value) = values.next_element()? {
            list.push(value);
        }
        Ok(Value::List(list))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<Value, A::Error> {
        let mut table = Vec::new();
        while let Some(entry) = entries.next_entry::<String, Value>()? {
            table.push(entry);
        }
        Ok(Value::Table(table))
    }
}

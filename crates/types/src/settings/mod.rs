//! Settings that are declared once: name, documentation, unit, default and range stand together
//! in [`settings!`](crate::settings!), and validation, reading, writing, setting by a dotted path
//! and documents follow from there.
//!
//! A *section* is a struct of settings and of further sections. Code here sees it as a
//! `&dyn Section`, so that it exists once for all sections, which keeps a browser's module small.
mod declare;
mod document;
mod path;
mod serial;

pub use document::{Documentation, Documented, documentation};
pub use path::{Entry, edit_distance, get, list, merge, set, validate};
pub use serial::{deserialize, serialize};

use alloc::{
    format,
    string::{String, ToString},
    vec::Vec,
};
use core::fmt;

/// Of each field one; a list that [`settings!`](crate::settings!) can name in every crate.
pub type Slots<T> = Vec<T>;

/// A value whose setting is not known yet.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// True or false.
    Boolean(bool),
    /// A whole number.
    Integer(i64),
    /// Any other number.
    Number(f64),
    /// A text, such as the name of a choice.
    Text(String),
    /// Several values.
    List(Vec<Value>),
    /// A section's keys and their values.
    Table(Vec<(String, Value)>),
}

impl Value {
    /// What a message calls its type.
    pub fn type_name(&self) -> &'static str {
        match self {
            Value::Boolean(_) => "boolean",
            Value::Integer(_) => "integer",
            Value::Number(_) => "number",
            Value::Text(_) => "string",
            Value::List(_) => "array",
            Value::Table(_) => "table",
        }
    }
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Boolean(x) => write!(f, "{x}"),
            Value::Integer(x) => write!(f, "{x}"),
            Value::Number(x) => write!(f, "{x}"),
            Value::Text(x) => f.write_str(x),
            Value::List(values) => {
                let values: Vec<String> = values.iter().map(ToString::to_string).collect();
                write!(f, "[{}]", values.join(", "))
            }
            Value::Table(entries) => {
                let keys: Vec<&str> = entries.iter().map(|(key, _)| key.as_str()).collect();
                write!(f, "{{{}}}", keys.join(", "))
            }
        }
    }
}

impl From<bool> for Value {
    fn from(x: bool) -> Value {
        Value::Boolean(x)
    }
}

impl From<u32> for Value {
    fn from(x: u32) -> Value {
        Value::Integer(x.into())
    }
}

impl From<f64> for Value {
    fn from(x: f64) -> Value {
        Value::Number(x)
    }
}

impl From<&str> for Value {
    fn from(x: &str) -> Value {
        Value::Text(x.into())
    }
}

/// The numbers that a setting may take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Range {
    /// Every value of the setting's type; numbers are finite.
    Any,
    /// From the first to the second, both included.
    Between(f64, f64),
    /// Above the first, at most the second.
    AboveUpTo(f64, f64),
    /// Above this.
    Above(f64),
    /// This or more.
    AtLeast(f64),
    /// One of these whole numbers.
    OneOf(&'static [u32]),
}

impl Range {
    /// Whether a number lies in the range; one that is not finite never does.
    pub fn contains(&self, x: f64) -> bool {
        x.is_finite()
            && match *self {
                Range::Any => true,
                Range::Between(low, high) => x >= low && x <= high,
                Range::AboveUpTo(low, high) => x > low && x <= high,
                Range::Above(low) => x > low,
                Range::AtLeast(low) => x >= low,
                Range::OneOf(values) => values.iter().any(|&v| f64::from(v) == x),
            }
    }
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Range::Any => f.write_str("any"),
            Range::Between(low, high) => write!(f, "{low} to {high}"),
            Range::AboveUpTo(low, high) => write!(f, "above {low}, at most {high}"),
            Range::Above(low) => write!(f, "above {low}"),
            Range::AtLeast(low) => write!(f, "at least {low}"),
            Range::OneOf(values) => {
                let names: Vec<String> = values.iter().map(ToString::to_string).collect();
                f.write_str(&alternatives(&names))
            }
        }
    }
}

/// `a, b or c`.
fn alternatives(names: &[impl AsRef<str>]) -> String {
    let mut text = String::new();
    for (i, name) in names.iter().enumerate() {
        text += match i {
            0 => "",
            i if i + 1 == names.len() => " or ",
            _ => ", ",
        };
        text += name.as_ref();
    }
    text
}

/// The type of a setting.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// True or false.
    Boolean,
    /// A whole number from 0 to 2^32 - 1.
    Integer,
    /// A finite number.
    Number,
    /// One of these names.
    Choice(&'static [&'static str]),
    /// This many whole numbers.
    Integers(usize),
}

impl Kind {
    /// What a value must be, with its range.
    pub fn expected(&self, range: &Range) -> String {
        let number = |name: &str, any: &str| match range {
            Range::Any => format!("{name}{any}"),
            range => format!("{name}, {range}"),
        };
        match self {
            Kind::Boolean => "boolean, true or false".into(),
            Kind::Integer => number("integer", ", 0 to 4294967295"),
            Kind::Number => number("number", ""),
            Kind::Choice(names) => format!("string, {}", alternatives(names)),
            Kind::Integers(n) => {
                format!(
                    "array of {n} integers, each {}",
                    number("", "0 to 4294967295").trim_start_matches(", ")
                )
            }
        }
    }
}

/// The declaration of a setting or section within its section.
#[derive(Clone, Copy, Debug)]
pub struct Field {
    /// Its key.
    pub name: &'static str,
    /// Its unit; empty where there is none.
    pub unit: &'static str,
    /// Its range.
    pub range: Range,
}

/// The value of a field.
pub enum Slot<'a> {
    /// A section within the section.
    Section(&'a dyn Section),
    /// [`Kind::Boolean`].
    Boolean(bool),
    /// [`Kind::Integer`].
    Integer(u32),
    /// [`Kind::Number`].
    Number(f64),
    /// [`Kind::Choice`].
    Choice(&'a dyn Choice),
    /// [`Kind::Integers`].
    Integers(&'a [u32]),
}

/// The place of a field's value.
pub enum SlotMut<'a> {
    /// A section within the section.
    Section(&'a mut dyn Section),
    /// [`Kind::Boolean`].
    Boolean(&'a mut bool),
    /// [`Kind::Integer`].
    Integer(&'a mut u32),
    /// [`Kind::Number`].
    Number(&'a mut f64),
    /// [`Kind::Choice`].
    Choice(&'a mut dyn Choice),
    /// [`Kind::Integers`].
    Integers(&'a mut [u32]),
}

/// A type that a field of a section can have.
pub trait Setting {
    /// Its value.
    fn slot(&self) -> Slot<'_>;
    /// The place of its value.
    fn slot_mut(&mut self) -> SlotMut<'_>;
}

/// A struct made by [`settings!`](crate::settings!).
pub trait Section {
    /// Name of the struct.
    fn name(&self) -> &'static str;
    /// Its declarations, in their order.
    fn fields(&self) -> &'static [Field];
    /// Its values, in the same order.
    fn slots(&self) -> Slots<Slot<'_>>;
    /// The places of its values, in the same order.
    fn slots_mut(&mut self) -> Slots<SlotMut<'_>>;
}

/// An enum made by [`choices!`](crate::choices!).
pub trait Choice {
    /// The names to choose from.
    fn names(&self) -> &'static [&'static str];
    /// Index of the name that is chosen.
    fn index(&self) -> usize;
    /// Chooses by index; one out of range changes nothing.
    fn choose(&mut self, index: usize);
}

macro_rules! setting {
    ($($type:ty, $variant:ident;)+) => {$(
        impl Setting for $type {
            fn slot(&self) -> Slot<'_> {
                Slot::$variant(*self)
            }
            fn slot_mut(&mut self) -> SlotMut<'_> {
                SlotMut::$variant(self)
            }
        }
    )+};
}
setting! { bool, Boolean; u32, Integer; f64, Number; }

impl<const N: usize> Setting for [u32; N] {
    fn slot(&self) -> Slot<'_> {
        Slot::Integers(self)
    }
    fn slot_mut(&mut self) -> SlotMut<'_> {
        SlotMut::Integers(self)
    }
}

/// Why a configuration cannot be used. `path` is the dotted path of the setting.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ConfigError {
    /// There is no such setting.
    Unknown {
        /// The path that was asked for.
        path: String,
        /// Paths of settings that may be meant, the likeliest first.
        similar: Vec<String>,
    },
    /// A value of another type.
    WrongType {
        /// The setting.
        path: String,
        /// Type and value.
        found: String,
        /// Type and range of the setting.
        expected: String,
    },
    /// A value of the right type that the setting may not have.
    OutOfRange {
        /// The setting.
        path: String,
        /// The value.
        found: String,
        /// What it may be.
        expected: String,
    },
}

impl ConfigError {
    /// Dotted path of the setting.
    pub fn path(&self) -> &str {
        match self {
            ConfigError::Unknown { path, .. }
            | ConfigError::WrongType { path, .. }
            | ConfigError::OutOfRange { path, .. } => path,
        }
    }

    /// The value that was found; `None` where there is no such setting.
    pub fn found(&self) -> Option<&str> {
        match self {
            ConfigError::Unknown { .. } => None,
            ConfigError::WrongType { found, .. } | ConfigError::OutOfRange { found, .. } => {
                Some(found)
            }
        }
    }
}

impl fmt::Display for ConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ConfigError::Unknown { path, similar } => {
                write!(f, "no setting `{path}`")?;
                if !similar.is_empty() {
                    let names: Vec<String> = similar.iter().map(|s| format!("`{s}`")).collect();
                    write!(f, ". Did you mean {}?", alternatives(&names))?;
                }
                Ok(())
            }
            ConfigError::WrongType { path, found, expected }
            | ConfigError::OutOfRange { path, found, expected } => {
                write!(f, "{path}: found {found}, expected {expected}")
            }
        }
    }
}

impl core::error::Error for ConfigError {}

#[cfg(test)]
mod tests;

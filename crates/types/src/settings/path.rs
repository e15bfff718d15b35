//! Settings by their dotted paths, such as `tracking.render_loss.depth`.
use super::{Choice, ConfigError, Field, Kind, Range, Section, Slot, SlotMut, Value, alternatives};
use alloc::{
    borrow::ToOwned,
    format,
    string::{String, ToString},
    vec::Vec,
};

/// One setting of a section and of those within it.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Dotted path.
    pub path: String,
    /// Type.
    pub kind: Kind,
    /// Unit; empty where there is none.
    pub unit: &'static str,
    /// Range of its numbers.
    pub range: Range,
    /// Value in the section that was listed.
    pub value: Value,
}

fn join(path: &str, key: &str) -> String {
    if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") }
}

fn described(value: &Value) -> String {
    format!("{} {value}", value.type_name())
}

/// Type and value of a setting; `None` for a section.
fn read(slot: &Slot<'_>) -> Option<(Kind, Value)> {
    Some(match slot {
        Slot::Section(_) => return None,
        Slot::Boolean(x) => (Kind::Boolean, Value::Boolean(*x)),
        Slot::Integer(x) => (Kind::Integer, (*x).into()),
        Slot::Number(x) => (Kind::Number, Value::Number(*x)),
        Slot::Choice(x) => (Kind::Choice(x.names()), x.names()[x.index()].into()),
        Slot::Integers(x) => {
            (Kind::Integers(x.len()), Value::List(x.iter().map(|x| (*x).into()).collect()))
        }
    })
}

/// Calls `visit` with path, declaration and value of every setting, in the order of declaration,
/// until it fails.
fn walk<E>(
    section: &dyn Section,
    path: &str,
    visit: &mut dyn FnMut(String, &Field, Slot<'_>) -> Result<(), E>,
) -> Result<(), E> {
    for (field, slot) in section.fields().iter().zip(section.slots()) {
        let path = join(path, field.name);
        match slot {
            Slot::Section(inner) => walk(inner, &path, visit)?,
            slot => visit(path, field, slot)?,
        }
    }
    Ok(())
}

/// Every setting, in the order of declaration.
pub fn list(section: &dyn Section) -> Vec<Entry> {
    let mut entries = Vec::new();
    let _ = walk::<()>(section, "", &mut |path, field, slot| {
        entries.extend(read(&slot).map(|(kind, value)| Entry {
            path,
            kind,
            unit: field.unit,
            range: field.range,
            value,
        }));
        Ok(())
    });
    entries
}

/// The value of a setting, `None` where there is none of that path.
pub fn get(section: &dyn Section, path: &str) -> Option<Value> {
    let (key, rest) = path.split_once('.').map_or((path, None), |(k, r)| (k, Some(r)));
    let index = section.fields().iter().position(|f| f.name == key)?;
    match (section.slots().into_iter().nth(index)?, rest) {
        (Slot::Section(inner), Some(rest)) => get(inner, rest),
        (slot, None) => Some(read(&slot)?.1),
        _ => None,
    }
}

fn find<'a>(section: &'a mut dyn Section, path: &str) -> Option<(&'static Field, SlotMut<'a>)> {
    let (key, rest) = path.split_once('.').map_or((path, None), |(k, r)| (k, Some(r)));
    let index = section.fields().iter().position(|f| f.name == key)?;
    let field = &section.fields()[index];
    match (section.slots_mut().into_iter().nth(index)?, rest) {
        (SlotMut::Section(inner), Some(rest)) => find(inner, rest),
        (slot, None) => Some((field, slot)),
        _ => None,
    }
}

/// Sets one setting by its path, or several of a section by a [`Value::Table`]. A whole number may
/// stand for any number.
///
/// # Errors
/// Where there is no such setting, with those that may be meant; a value of another type or out of
/// range. The setting is unchanged then.
pub fn set(section: &mut dyn Section, path: &str, value: Value) -> Result<(), ConfigError> {
    match find(section, path) {
        Some((field, slot)) => assign(slot, &field.range, path, value, true),
        None => Err(ConfigError::Unknown { path: path.into(), similar: similar(section, path) }),
    }
}

/// Sets what a table holds; `ranges` says whether ranges are checked, too.
///
/// # Errors
/// As [`set`]; settings before the wrong one are changed then.
pub fn merge(section: &mut dyn Section, table: Value, ranges: bool) -> Result<(), ConfigError> {
    match merge_at(section, "", table, ranges) {
        Err(ConfigError::Unknown { path, .. }) => {
            let similar = similar(section, &path);
            Err(ConfigError::Unknown { path, similar })
        }
        result => result,
    }
}

fn merge_at(
    section: &mut dyn Section,
    path: &str,
    table: Value,
    ranges: bool,
) -> Result<(), ConfigError> {
    let Value::Table(entries) = table else {
        let keys: Vec<String> = section.fields().iter().map(|f| join(path, f.name)).collect();
        return Err(ConfigError::WrongType {
            path: path.into(),
            found: described(&table),
            expected: format!("one of its keys: {}", keys.join(", ")),
        });
    };
    for (key, value) in entries {
        let path = join(path, &key);
        // A key with a dot in it is none, though it may look like a path.
        let field = if key.contains('.') { None } else { find(section, &key) };
        let Some((field, slot)) = field else {
            return Err(ConfigError::Unknown { path, similar: Vec::new() });
        };
        assign(slot, &field.range, &path, value, ranges)?;
    }
    Ok(())
}

fn assign(
    slot: SlotMut<'_>,
    range: &Range,
    path: &str,
    value: Value,
    ranges: bool,
) -> Result<(), ConfigError> {
    let kind = match &slot {
        SlotMut::Section(_) => None,
        SlotMut::Boolean(_) => Some(Kind::Boolean),
        SlotMut::Integer(_) => Some(Kind::Integer),
        SlotMut::Number(_) => Some(Kind::Number),
        SlotMut::Choice(x) => Some(Kind::Choice(x.names())),
        SlotMut::Integers(x) => Some(Kind::Integers(x.len())),
    };
    let outside = |found: String, expected: String| {
        Err(ConfigError::OutOfRange { path: path.into(), found, expected })
    };
    let integer = |x: i64| match u32::try_from(x) {
        Ok(n) if !ranges || range.contains(n.into()) => Ok(n),
        _ => outside(x.to_string(), whole(range)).map(|()| 0),
    };
    let number = |x: f64| match x {
        x if !ranges || range.contains(x) => Ok(x),
        x => outside(x.to_string(), finite(range)).map(|()| x),
    };
    match (slot, value) {
        (SlotMut::Section(inner), value) => merge_at(inner, path, value, ranges)?,
        (SlotMut::Boolean(to), Value::Boolean(x)) => *to = x,
        (SlotMut::Integer(to), Value::Integer(x)) => *to = integer(x)?,
        (SlotMut::Number(to), Value::Integer(x)) => *to = number(x as f64)?,
        (SlotMut::Number(to), Value::Number(x)) => *to = number(x)?,
        (SlotMut::Choice(to), Value::Text(name)) => choose(to, path, name)?,
        (SlotMut::Integers(to), Value::List(values)) if values.len() == to.len() => {
            let mut list = Vec::with_capacity(values.len());
            for value in values {
                match value {
                    Value::Integer(x) => list.push(integer(x)?),
                    value => return Err(wrong_type(path, &value, kind, range)),
                }
            }
            to.copy_from_slice(&list);
        }
        (_, value) => return Err(wrong_type(path, &value, kind, range)),
    }
    Ok(())
}

fn choose(choice: &mut dyn Choice, path: &str, name: String) -> Result<(), ConfigError> {
    match choice.names().iter().position(|n| *n == name) {
        Some(index) => {
            choice.choose(index);
            Ok(())
        }
        None => Err(ConfigError::OutOfRange {
            path: path.into(),
            found: name,
            expected: alternatives(choice.names()),
        }),
    }
}

fn wrong_type(path: &str, value: &Value, kind: Option<Kind>, range: &Range) -> ConfigError {
    ConfigError::WrongType {
        path: path.into(),
        found: described(value),
        expected: kind.map_or(String::new(), |kind| kind.expected(range)),
    }
}

fn whole(range: &Range) -> String {
    match range {
        Range::Any => "0 to 4294967295".into(),
        range => range.to_string(),
    }
}

fn finite(range: &Range) -> String {
    match range {
        Range::Any => "a finite number".into(),
        range => range.to_string(),
    }
}

/// Checks that every number lies in its range.
///
/// # Errors
/// [`ConfigError::OutOfRange`] of the first that does not.
pub fn validate(section: &dyn Section) -> Result<(), ConfigError> {
    walk(section, "", &mut |path, field, slot| {
        let range = &field.range;
        let (found, expected) = match slot {
            Slot::Integer(x) if !range.contains(x.into()) => (x.to_string(), whole(range)),
            Slot::Number(x) if !range.contains(x) => (x.to_string(), finite(range)),
            Slot::Integers(list) => match list.iter().find(|x| !range.contains((**x).into())) {
                Some(x) => (x.to_string(), whole(range)),
                None => return Ok(()),
            },
            _ => return Ok(()),
        };
        Err(ConfigError::OutOfRange { path, found, expected })
    })
}

/// Paths of at most four settings that someone who wrote `path` may have meant: the right name in
/// the wrong section, or a slip of the fingers.
fn similar(section: &dyn Section, path: &str) -> Vec<String> {
    let last = |path: &str| path.rsplit('.').next().unwrap_or_default().to_owned();
    let wanted = last(path);
    let mut near = Vec::new();
    let _ = walk::<()>(section, "", &mut |key, _, _| {
        let distance = edit_distance(&key, path).min(1 + edit_distance(&last(&key), &wanted));
        if distance <= 1 + wanted.len() / 3 {
            near.push((distance, key));
        }
        Ok(())
    });
    near.sort();
    near.into_iter().take(4).map(|(_, key)| key).collect()
}

/// Number of letters that must be changed, added or left out to turn one text into the other.
pub fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let substitute = diagonal + usize::from(x != *y);
            diagonal = row[j + 1];
            row[j + 1] = substitute.min(row[j] + 1).min(row[j + 1] + 1);
        }
    }
    row[b.len()]
}

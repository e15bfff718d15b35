use super::*;
use crate::settings::{ConfigError, Entry, Kind, Range, documentation};
use alloc::{format, string::ToString, vec, vec::Vec};

/// Numbers at the ends of a range, and close beyond them.
fn edges(kind: &Kind, range: &Range) -> (Vec<f64>, Vec<f64>) {
    let whole = !matches!(kind, Kind::Number);
    let step = if whole { 1.0 } else { 1e-6 };
    let highest = if whole { f64::from(u32::MAX) } else { 1e12 };
    let (inside, mut outside) = match *range {
        Range::Any => (vec![0.0, highest], vec![]),
        Range::Between(low, high) => (vec![low, high], vec![low - step, high + step]),
        Range::AboveUpTo(low, high) => (vec![low + step, high], vec![low, high + step]),
        Range::Above(low) => (vec![low + step, highest], vec![low, low - step]),
        Range::AtLeast(low) => (vec![low, highest], vec![low - step]),
        Range::OneOf(values) => {
            let inside: Vec<f64> = values.iter().map(|&v| v.into()).collect();
            let outside = inside.iter().map(|v| v + 1.0).collect();
            (inside, outside)
        }
    };
    match whole {
        true => outside.extend([-1.0, f64::from(u32::MAX) + 1.0]),
        false => outside.extend([f64::NAN, f64::INFINITY]),
    }
    (inside, outside)
}

fn number(kind: &Kind, x: f64) -> Value {
    match kind {
        Kind::Number => Value::Number(x),
        Kind::Integers(n) => Value::List(vec![Value::Integer(x as i64); *n]),
        _ => Value::Integer(x as i64),
    }
}

#[test]
fn every_setting_takes_the_ends_of_its_range_and_refuses_what_lies_beyond() {
    for Entry { path, kind, range, value, .. } in Config::default().settings() {
        let mut c = Config::default();
        assert_eq!(c.get(&path), Some(value), "{path}");
        let refused = |c: &mut Config, value: Value| {
            let error = c.set(&path, value.clone()).unwrap_err();
            assert!(matches!(error, ConfigError::OutOfRange { .. }), "{error:?}");
            assert_eq!(error.path(), path);
            assert_eq!(*c, Config::default(), "{path} was changed by {value}");
        };
        let (inside, outside) = match kind {
            Kind::Boolean => (vec![Value::Boolean(false), Value::Boolean(true)], vec![]),
            Kind::Choice(names) => {
                (names.iter().map(|n| (*n).into()).collect(), vec!["none such".into()])
            }
            kind => {
                let (inside, outside) = edges(&kind, &range);
                let values = |list: Vec<f64>| list.iter().map(|x| number(&kind, *x)).collect();
                (values(inside), values(outside))
            }
        };
        assert!(kind == Kind::Boolean || !outside.is_empty(), "{path}");
        outside.into_iter().for_each(|value| refused(&mut c, value));
        for value in inside {
            c.set(&path, value.clone()).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(c.get(&path), Some(value), "{path}");
        }
    }
}

/// A value that gets past [`Config::set`], as a field or from a file, is found by `validate`.
#[test]
fn validation_names_the_setting() {
    for Entry { path, kind, range, .. } in Config::default().settings() {
        if matches!(kind, Kind::Boolean | Kind::Choice(_)) {
            continue;
        }
        let (_, outside) = edges(&kind, &range);
        let whole = kind != Kind::Number;
        let fits = |x: &f64| !whole || (0.0..=f64::from(u32::MAX)).contains(x);
        for x in outside.into_iter().filter(fits) {
            let mut c = Config::default();
            let mut table = number(&kind, x);
            for key in path.rsplit('.') {
                table = Value::Table(vec![(key.into(), table)]);
            }
            settings::merge(&mut c, table, false).unwrap();
            let error = c.validate().unwrap_err();
            assert_eq!(error.path(), path);
            assert!(error.to_string().starts_with(&format!("{path}: found {x}, ")), "{error}");
        }
    }
    let mut c = Config::default();
    c.tracking.render_loss.depth = -1.0;
    assert_eq!(c.validate().unwrap_err().path(), "tracking.render_loss.depth");
    c = Config::default();
    c.field.geometry_fine_m = 0.07;
    assert_eq!(c.validate().unwrap_err().path(), "field.geometry_fine_m");
    c = Config::default();
    (c.mapping.rays, c.mapping.window) = (5, 6);
    assert_eq!(c.validate().unwrap_err().path(), "mapping.rays");
}

#[test]
fn wrong_types_and_unknown_keys_are_errors_of_their_own() {
    let mut c = Config::default();
    for Entry { path, kind, .. } in Config::default().settings() {
        let wrong = match kind {
            Kind::Boolean => Value::Integer(1),
            Kind::Choice(_) => true.into(),
            _ => "many".into(),
        };
        let error = c.set(&path, wrong).unwrap_err();
        assert!(matches!(error, ConfigError::WrongType { .. }), "{error:?}");
        let slip = format!("{path}x");
        match c.set(&slip, 1u32).unwrap_err() {
            ConfigError::Unknown { path: unknown, similar } => {
                assert_eq!(unknown, slip);
                assert!(similar.contains(&path), "{slip}: {similar:?}");
            }
            error => panic!("{error:?}"),
        }
    }
    let similar = match c.set("rays", 1u32).unwrap_err() {
        ConfigError::Unknown { similar, .. } => similar,
        error => panic!("{error:?}"),
    };
    assert_eq!(similar[0], "mapping.rays");
    assert_eq!(c, Config::default());
    for text in [r#"{"tracking":{"speed":3}}"#, r#"{"mapping.rays":100}"#, r#"{"seed":-1}"#] {
        assert!(serde_json::from_str::<Config>(text).is_err(), "{text}");
    }
}

#[test]
fn presets_are_valid_and_differ() {
    let all: Vec<Config> = Config::PRESETS.map(|name| Config::preset(name).unwrap()).into();
    for (i, c) in all.iter().enumerate() {
        c.validate().unwrap();
        assert!(!all[..i].contains(c), "{} is another preset, too", Config::PRESETS[i]);
        assert!(!presets::purpose(Config::PRESETS[i]).is_empty());
    }
    assert!(Config::preset("nope").is_none());
}

#[test]
fn a_configuration_survives_being_written() {
    for name in Config::PRESETS {
        let c = Config::preset(name).unwrap();
        let text = serde_json::to_string(&c).unwrap();
        assert_eq!(serde_json::from_str::<Config>(&text).unwrap(), c);
        // As it was recorded before the odometry's settings were part of it.
        let mut value: serde_json::Value = serde_json::from_str(&text).unwrap();
        value.as_object_mut().unwrap().remove("odometry").unwrap();
        assert_eq!(serde_json::from_value::<Config>(value).unwrap(), c);
    }
}

#[test]
fn every_setting_and_choice_has_a_text() {
    let texts = documentation::<Config>();
    for Entry { path, kind, .. } in Config::default().settings() {
        assert!(texts.of_setting(&path).is_some_and(|t| t.len() > 5), "{path}");
        if let Kind::Choice(names) = kind {
            let named: Vec<&str> = texts.of_choices(&path).iter().map(|c| c.0.as_str()).collect();
            assert_eq!(named, names, "{path}");
        }
        if let Some((section, _)) = path.rsplit_once('.') {
            assert!(texts.of_section(section).is_some(), "{section}");
        }
    }
}

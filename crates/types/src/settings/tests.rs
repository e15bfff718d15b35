use super::*;
use alloc::{string::ToString, vec, vec::Vec};

crate::choices! {
    /// A color of light.
    pub enum Light {
        /// As of a candle.
        Warm = "warm",
        /// As of the sky.
        Cold = "cold",
    }
}

crate::settings! {
    /// A room.
    pub struct RoomConfig {
        /// Number of windows.
        windows: u32 = 2, OneOf(&[1, 2, 4]);
        /// Its lamp.
        lamp: LampConfig = LampConfig { power: 0.25, ..LampConfig::default() };
    }

    /// A lamp.
    pub struct LampConfig {
        /// Share of its
        /// full power.
        power: f64["W/W"] = 1.0, AboveUpTo(0.0, 1.0);
        /// Its color.
        light: Light = Light::Cold;
        /// Whether it is on.
        on: bool = true;
        /// Where it stands.
        place: [u32; 2] = [3, 4], Between(0.0, 9.0);
    }
}

fn value(json: &str) -> Value {
    serde_json::from_str(json).unwrap()
}

#[test]
fn ranges_hold_their_ends_or_not() {
    for (range, inside, outside) in [
        (Range::Any, vec![-1e300, 0.0], vec![f64::NAN, f64::INFINITY]),
        (Range::Between(0.0, 1.0), vec![0.0, 1.0], vec![-1e-9, 1.0 + 1e-9, f64::NAN]),
        (Range::AboveUpTo(0.0, 1.0), vec![1e-9, 1.0], vec![0.0, 1.1]),
        (Range::Above(0.0), vec![1e-300, 1e300], vec![0.0, -1.0, f64::INFINITY]),
        (Range::AtLeast(2.0), vec![2.0, 9.0], vec![1.9, f64::NEG_INFINITY]),
        (Range::OneOf(&[1, 3]), vec![1.0, 3.0], vec![2.0, 1.5, 0.0]),
    ] {
        assert!(inside.iter().all(|x| range.contains(*x)), "{range}");
        assert!(!outside.iter().any(|x| range.contains(*x)), "{range}");
    }
    assert_eq!(Range::OneOf(&[8, 16, 24]).to_string(), "8, 16 or 24");
}

#[test]
fn values_are_set_and_read_by_path() {
    let mut room = RoomConfig::default();
    assert_eq!(room.lamp.power, 0.25);
    for (path, json) in [
        ("windows", "4"),
        ("lamp.power", "0.5"),
        ("lamp.light", "\"warm\""),
        ("lamp.on", "false"),
        ("lamp.place", "[0, 9]"),
    ] {
        set(&mut room, path, value(json)).unwrap();
        assert_eq!(get(&room, path), Some(value(json)));
    }
    let lamp = LampConfig { power: 0.5, light: Light::Warm, on: false, place: [0, 9] };
    assert_eq!(room, RoomConfig { windows: 4, lamp });
    set(&mut room, "lamp.power", value("1")).unwrap();
    set(&mut room, "lamp", value(r#"{"on": true, "place": [1, 1]}"#)).unwrap();
    assert!(room.lamp.on && room.lamp.place == [1, 1] && room.lamp.power == 1.0);
    assert_eq!((get(&room, "lamp"), get(&room, "lamp.no")), (None, None));
}

#[test]
fn what_is_wrong_is_an_error_of_its_type_and_changes_nothing() {
    let mut room = RoomConfig::default();
    for (path, json, expected) in [
        ("windows", "3", "windows: found 3, expected 1, 2 or 4"),
        ("windows", "-1", "windows: found -1, expected 1, 2 or 4"),
        ("lamp.power", "0", "lamp.power: found 0, expected above 0, at most 1"),
        ("lamp.light", "\"hot\"", "lamp.light: found hot, expected warm or cold"),
        ("lamp.place", "[10, 0]", "lamp.place: found 10, expected 0 to 9"),
    ] {
        let error = set(&mut room, path, value(json)).unwrap_err();
        assert!(matches!(error, ConfigError::OutOfRange { .. }), "{error:?}");
        assert_eq!(error.to_string(), expected);
    }
    for (path, json, expected) in [
        ("windows", "2.5", "windows: found number 2.5, expected integer, 1, 2 or 4"),
        ("windows", "true", "windows: found boolean true, expected integer, 1, 2 or 4"),
        ("lamp.on", "1", "lamp.on: found integer 1, expected boolean, true or false"),
        ("lamp.light", "1", "lamp.light: found integer 1, expected string, warm or cold"),
        (
            "lamp.place",
            "[1]",
            "lamp.place: found array [1], expected array of 2 integers, each 0 to 9",
        ),
        (
            "lamp",
            "1",
            "lamp: found integer 1, expected one of its keys: lamp.power, lamp.light, lamp.on, \
             lamp.place",
        ),
    ] {
        let error = set(&mut room, path, value(json)).unwrap_err();
        assert!(matches!(error, ConfigError::WrongType { .. }), "{error:?}");
        assert_eq!(error.to_string(), expected);
    }
    assert_eq!(room, RoomConfig::default());
}

#[test]
fn unknown_paths_bring_those_that_may_be_meant() {
    let mut room = RoomConfig::default();
    let mut of = |path: &str| match set(&mut room, path, value("1")).unwrap_err() {
        ConfigError::Unknown { path: found, similar } if found == path => similar,
        error => panic!("{error:?}"),
    };
    assert_eq!(of("lamp.powr"), ["lamp.power"]);
    assert_eq!(of("power"), ["lamp.power"]);
    assert!(of("qqqqqqqqqqqq").is_empty());
    assert!(of("windows.height").is_empty() || of("windows.height").len() <= 4);
    let table = value(r#"{"lamp": {"lihgt": "warm"}}"#);
    let error = merge(&mut room, table, true).unwrap_err();
    assert_eq!(error.to_string(), "no setting `lamp.lihgt`. Did you mean `lamp.light`?");
    assert!(merge(&mut room, value(r#"{"lamp.on": true}"#), true).is_err(), "a path is no key");
}

#[test]
fn sections_are_written_as_structs_and_read_with_defaults() {
    let room = RoomConfig::default();
    let text = serde_json::to_string(&room).unwrap();
    assert_eq!(
        text,
        r#"{"windows":2,"lamp":{"power":0.25,"light":"cold","on":true,"place":[3,4]}}"#
    );
    let read: RoomConfig = serde_json::from_str(&text).unwrap();
    assert_eq!(read, room);
    // What a section leaves out is as in the whole's default, not in the section's own.
    let read: RoomConfig = serde_json::from_str(r#"{"lamp":{"on":false}}"#).unwrap();
    assert_eq!(read.lamp, LampConfig { on: false, ..room.lamp });
    for wrong in [r#"{"lamb":1}"#, r#"{"windows":"two"}"#, "3", r#"{"windows":null}"#] {
        assert!(serde_json::from_str::<RoomConfig>(wrong).is_err(), "{wrong}");
    }
    // Ranges are left to `validate`, which names the path.
    let read: RoomConfig = serde_json::from_str(r#"{"lamp":{"power":7}}"#).unwrap();
    assert_eq!(validate(&read).unwrap_err().path(), "lamp.power");
}

#[test]
fn declarations_carry_units_and_texts() {
    let entries = list(&RoomConfig::default());
    let paths: Vec<&str> = entries.iter().map(|e| e.path.as_str()).collect();
    assert_eq!(paths, ["windows", "lamp.power", "lamp.light", "lamp.on", "lamp.place"]);
    assert_eq!((entries[1].unit, entries[0].unit), ("W/W", ""));
    let texts = documentation::<RoomConfig>();
    assert_eq!(texts.of_setting("lamp.power"), Some("Share of its full power."));
    assert_eq!(texts.of_section("lamp"), Some("A lamp."));
    assert_eq!(texts.of_setting("lamp"), Some("Its lamp."));
    assert_eq!(texts.of_choices("lamp.light")[1], ("cold".into(), "As of the sky.".into()));
}

#[test]
fn distances_count_letters() {
    for (a, b, n) in [("", "abc", 3), ("abc", "abc", 0), ("abc", "ac", 1), ("kitten", "sitting", 3)]
    {
        assert_eq!((edit_distance(a, b), edit_distance(b, a)), (n, n));
    }
}

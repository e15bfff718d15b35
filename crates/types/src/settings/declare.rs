//! The macros that declare settings.

/// Declares sections of settings.
///
/// ```
/// mte_slam_types::settings! {
///     /// How a room is lit.
///     pub struct LightConfig {
///         /// Distance of the lamp.
///         distance_m: f64["m"] = 2.0, Above(0.0);
///         /// Number of lamps.
///         lamps: u32 = 1, Between(1.0, 8.0);
///         /// Whether they are on.
///         on: bool = true;
///     }
/// }
///
/// let mut light = LightConfig::default();
/// mte_slam_types::settings::set(&mut light, "lamps", 3u32.into()).unwrap();
/// assert_eq!(light.lamps, 3);
/// let error = mte_slam_types::settings::set(&mut light, "lamps", 9u32.into()).unwrap_err();
/// assert_eq!(error.to_string(), "lamps: found 9, expected 1 to 8");
/// ```
///
/// A line is `name: type["unit"] = default, range;`; unit and range may be left out. Types are
/// `bool`, `u32`, `f64`, arrays of `u32`, [`choices!`](crate::choices!) and other sections. Ranges
/// are the variants of [`Range`](crate::settings::Range).
///
/// A section is `Clone`, `Debug`, `Default`, `PartialEq`, reads and writes itself with serde
/// (settings that are left out keep their defaults, unknown ones are errors) and is a
/// [`Section`](crate::settings::Section).
#[macro_export]
macro_rules! settings {
    ($(
        $(#[doc = $about:literal])+
        pub struct $name:ident {
            $(
                $(#[doc = $doc:literal])+
                $field:ident : $type:ty $([$unit:literal])? = $default:expr $(, $range:expr)?;
            )+
        }
    )+) => {$(
        $(#[doc = $about])+
        #[derive(Clone, Debug, PartialEq)]
        pub struct $name {
            $(
                $(#[doc = $doc])+
                #[doc = concat!(
                    "\n\nDefault: `", stringify!($default), "`",
                    $(" \\[", $unit, "\\]",)? $("; range: `", stringify!($range), "`",)? "."
                )]
                pub $field: $type,
            )+
        }

        impl Default for $name {
            fn default() -> Self {
                $name { $($field: $default,)+ }
            }
        }

        const _: () = {
            use $crate::settings as settings;
            #[allow(unused_imports)]
            use settings::Range::*;

            static FIELDS: &[settings::Field] = &[$(settings::Field {
                name: stringify!($field),
                unit: concat!("" $(, $unit)?),
                range: [$($range,)? Any][0],
            }),+];

            impl settings::Section for $name {
                fn name(&self) -> &'static str {
                    stringify!($name)
                }
                fn fields(&self) -> &'static [settings::Field] {
                    FIELDS
                }
                fn slots(&self) -> settings::Slots<settings::Slot<'_>> {
                    settings::Slots::from([$(settings::Setting::slot(&self.$field)),+])
                }
                fn slots_mut(&mut self) -> settings::Slots<settings::SlotMut<'_>> {
                    settings::Slots::from([$(settings::Setting::slot_mut(&mut self.$field)),+])
                }
            }

            impl settings::Setting for $name {
                fn slot(&self) -> settings::Slot<'_> {
                    settings::Slot::Section(self)
                }
                fn slot_mut(&mut self) -> settings::SlotMut<'_> {
                    settings::SlotMut::Section(self)
                }
            }

            impl settings::Documented for $name {
                fn document(path: &str, list: &mut settings::Documentation) {
                    list.section(path, &[$($about),+]);
                    $(
                        let path_of_field = list.setting(path, stringify!($field), &[$($doc),+]);
                        <$type as settings::Documented>::document(&path_of_field, list);
                    )+
                }
            }

            impl ::serde::Serialize for $name {
                fn serialize<S: ::serde::Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
                    settings::serialize(self, s)
                }
            }

            impl<'de> ::serde::Deserialize<'de> for $name {
                fn deserialize<D: ::serde::Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
                    let mut section = $name::default();
                    settings::deserialize(&mut section, d)?;
                    Ok(section)
                }
            }
        };
    )+};
}

/// Declares enums whose variants have names in a configuration; see [`settings!`](crate::settings!).
///
/// ```
/// mte_slam_types::choices! {
///     /// A colour of light.
///     pub enum Light {
///         /// As of a candle.
///         Warm = "warm",
///         /// As of the sky.
///         Cold = "cold",
///     }
/// }
/// ```
#[macro_export]
macro_rules! choices {
    ($(
        $(#[doc = $about:literal])+
        pub enum $name:ident {
            $($(#[doc = $doc:literal])+ $variant:ident = $text:literal,)+
        }
    )+) => {$(
        $(#[doc = $about])+
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum $name {
            $($(#[doc = $doc])+ $variant,)+
        }

        const _: () = {
            use $crate::settings as settings;

            impl $name {
                const ALL: &'static [$name] = &[$($name::$variant),+];
            }

            impl settings::Choice for $name {
                fn names(&self) -> &'static [&'static str] {
                    &[$($text),+]
                }
                fn index(&self) -> usize {
                    *self as usize
                }
                fn choose(&mut self, index: usize) {
                    if let Some(x) = $name::ALL.get(index) {
                        *self = *x;
                    }
                }
            }

            impl settings::Setting for $name {
                fn slot(&self) -> settings::Slot<'_> {
                    settings::Slot::Choice(self)
                }
                fn slot_mut(&mut self) -> settings::SlotMut<'_> {
                    settings::SlotMut::Choice(self)
                }
            }

            impl settings::Documented for $name {
                fn document(path: &str, list: &mut settings::Documentation) {
                    $(list.choice(path, $text, &[$($doc),+]);)+
                }
            }

            impl ::serde::Serialize for $name {
                fn serialize<S: ::serde::Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
                    s.serialize_str([$($text),+][*self as usize])
                }
            }
        };
    )+};
}

//! How a configuration section declares its keys: name, type, default, accepted range, unit and documentation stand together.

use std::fmt;

/// Visits a key: its full name, its declaration and its value if that is a number.
pub(crate) type Visitor<'a> = dyn FnMut(&str, &'static Key, Option<Number>) + 'a;

/// The declaration of a key.
#[derive(Debug)]
pub(crate) struct Key {
    /// Its name within the section.
    pub name: &'static str,
    /// One sentence, then the source.
    pub doc: &'static str,
    /// What it accepts.
    pub check: Check,
    /// Unit of a number, or the values that another type accepts; empty where the sentence says it all.
    pub unit: &'static str,
    /// Whether it is one of the few keys that users change.
    pub basic: bool,
}

/// What a key accepts.
#[derive(Debug)]
pub(crate) enum Check {
    /// A number between two others, both included.
    Range(fn() -> [Number; 2]),
    /// Every value of its type.
    Any,
    /// Nothing itself: it holds a section, which is about this.
    Section(&'static str),
}

/// The number in a key.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub(crate) enum Number {
    /// Any unsigned integer.
    Integer(u64),
    /// A single-precision number.
    Single(f32),
    /// A double-precision number.
    Double(f64),
}

impl Number {
    /// Returns the number as TOML, where floating-point numbers have a point or an exponent.
    pub(crate) fn to_toml(self) -> String {
        match self {
            Self::Integer(value) => value.to_string(),
            Self::Single(value) if value.is_nan() => "nan".to_owned(),
            Self::Double(value) if value.is_nan() => "nan".to_owned(),
            Self::Single(value) => format!("{value:?}"),
            Self::Double(value) => format!("{value:?}"),
        }
    }
}

impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Integer(value) => value.fmt(f),
            Self::Single(value) => value.fmt(f),
            Self::Double(value) => value.fmt(f),
        }
    }
}

/// The value of a key, or a section.
pub(crate) trait Entry {
    /// Returns the value if it is a number.
    fn number(&self) -> Option<Number> {
        None
    }

    /// Visits the key; a section visits its own keys after it.
    fn visit(&self, path: &str, key: &'static Key, visitor: &mut Visitor<'_>) {
        visitor(path, key, self.number());
    }

    /// Replaces the number of the key `path` within this entry.
    #[cfg(test)]
    fn set(&mut self, path: &str, number: Number);
}

/// A group of keys.
pub(crate) trait Section {
    /// Visits all keys in the order of their declaration; `prefix` is the full name of the section.
    fn visit_keys(&self, prefix: &str, visitor: &mut Visitor<'_>);
}

macro_rules! number_entries {
    ($($ty:ty => $kind:ident),*) => {
        $(impl Entry for $ty {
            fn number(&self) -> Option<Number> {
                Some((*self).into())
            }

            #[cfg(test)]
            fn set(&mut self, path: &str, number: Number) {
                assert!(path.is_empty(), "{path}");
                let Number::$kind(value) = number else { panic!("{number:?} for a {}", stringify!($ty)) };
                *self = value as $ty;
            }
        }

        impl From<$ty> for Number {
            fn from(value: $ty) -> Self {
                Self::$kind(value as _)
            }
        })*
    };
}

macro_rules! other_entries {
    ($($ty:ty),*) => {
        $(impl Entry for $ty {
            #[cfg(test)]
            fn set(&mut self, path: &str, number: Number) {
                panic!("{path} is no number, it cannot be {number}");
            }
        })*
    };
}

number_entries!(u8 => Integer, u32 => Integer, u64 => Integer, usize => Integer, f32 => Single, f64 => Double);
other_entries!(bool, Vec<String>, super::Method, super::Grouping, super::DepthSource, super::ReadoutEstimation);

/// Returns the full name of a key.
pub(crate) fn joined(prefix: &str, name: &str) -> String {
    if prefix.is_empty() { name.to_owned() } else { format!("{prefix}.{name}") }
}

/// Declares a section. Each key reads
///
/// ```text
/// /// One sentence.
/// /// Source: where the default is from.
/// name: type = default, in from..=to, "unit", basic;
/// ```
///
/// where `any` (every value of the type) or `section` may replace `in from..=to`, and the unit and `basic` may be left out.
macro_rules! config_section {
    ($(#[doc = $about:literal])* $name:ident { $(
        $(#[doc = $doc:literal])*
        $field:ident : $ty:ty = $default:expr, $check:ident $($from:literal ..= $to:expr)? $(, $unit:literal)? $(, $level:ident)?;
    )* }) => {
        $(#[doc = $about])*
        #[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(default, deny_unknown_fields)]
        pub struct $name {
            $(
                $(#[doc = $doc])*
                $(#[doc = concat!("Range: ", stringify!($from), " to ", stringify!($to), ".")])?
                $(#[doc = concat!("Unit or values: ", $unit, ".")])?
                pub $field: $ty,
            )*
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $default,)* }
            }
        }

        impl $name {
            pub(crate) const ABOUT: &'static str = concat!($($about, "\n"),*);
            const KEYS: &'static [$crate::config::section::Key] = &[$($crate::config::section::Key {
                name: stringify!($field),
                doc: concat!($($doc, "\n"),*),
                check: $crate::config::section::key_check!($check $ty $(, $from $to)?),
                unit: concat!($($unit)?),
                basic: $crate::config::section::key_level!($($level)?),
            },)*];
        }

        impl $crate::config::section::Section for $name {
            fn visit_keys(&self, prefix: &str, visitor: &mut $crate::config::section::Visitor<'_>) {
                let mut keys = Self::KEYS.iter();
                $(if let Some(key) = keys.next() {
                    let path = $crate::config::section::joined(prefix, key.name);
                    $crate::config::section::Entry::visit(&self.$field, &path, key, visitor);
                })*
            }
        }

        impl $crate::config::section::Entry for $name {
            fn visit(
                &self,
                path: &str,
                key: &'static $crate::config::section::Key,
                visitor: &mut $crate::config::section::Visitor<'_>,
            ) {
                visitor(path, key, None);
                $crate::config::section::Section::visit_keys(self, path, visitor);
            }

            #[cfg(test)]
            fn set(&mut self, path: &str, number: $crate::config::section::Number) {
                let (name, rest) = path.split_once('.').unwrap_or((path, ""));
                match name {
                    $(stringify!($field) => $crate::config::section::Entry::set(&mut self.$field, rest, number),)*
                    _ => panic!("no key {path}"),
                }
            }
        }
    };
}

macro_rules! key_check {
    (in $ty:ty, $from:literal $to:expr) => {
        $crate::config::section::Check::Range(|| {
            let range: std::ops::RangeInclusive<$ty> = $from..=$to;
            [(*range.start()).into(), (*range.end()).into()]
        })
    };
    (any $ty:ty) => {
        $crate::config::section::Check::Any
    };
    (section $ty:ty) => {
        $crate::config::section::Check::Section(<$ty>::ABOUT)
    };
}

macro_rules! key_level {
    () => {
        false
    };
    (basic) => {
        true
    };
}

pub(crate) use {config_section, key_check, key_level};

//! [`params!`](crate::params!): the one declaration of every parameter.
//!
//! A declaration gives the Rust struct, the default, the range, the unit, the tooltip, the set-up's
//! TOML key, the `--set` key, the WGSL struct and its upload, the panel's sections, and when a parameter means anything.

use anyhow::{Result, bail};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A parameter's value as a set-up stores it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Value {
    Bool(bool),
    Int(i64),
    Float(f64),
    Text(String),
}

impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            Value::Bool(v) => v.fmt(f),
            Value::Int(v) => v.fmt(f),
            // With its point, so that 3.0 is not taken for 3.
            Value::Float(v) => write!(f, "{v:?}"),
            Value::Text(v) => v.fmt(f),
        }
    }
}

/// The values of one technique, by parameter name.
pub type Values = BTreeMap<String, Value>;

/// What a parameter may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    Flag {
        default: bool,
    },
    /// Allowed are `min`, `min + step`, … up to `max`.
    Int {
        default: i64,
        min: i64,
        max: i64,
        step: i64,
    },
    Float {
        default: f64,
        min: f64,
        max: f64,
    },
    Choice {
        default: &'static str,
        options: &'static [&'static str],
    },
}

/// One declared parameter.
#[derive(Clone, Copy, Debug)]
pub struct Spec {
    pub name: &'static str,
    /// What it does, in a student's words.
    pub doc: &'static str,
    /// Unit of the value; empty for a pure number.
    pub unit: &'static str,
    pub kind: Kind,
    /// What the lowest and the highest value mean, where they have names.
    pub ends: Option<[&'static str; 2]>,
    /// Where its slider ends, as a share of the distance from which the scene is seen first: a length for which no one range
    /// fits all scenes.
    pub reach: Option<f64>,
    /// The section of the panel that it stands in.
    pub section: &'static str,
    /// It means something if all of one of these lists hold; always, where there are none.
    pub when: &'static [&'static [Condition]],
}

/// What the value of another parameter of the technique must be.
#[derive(Clone, Copy, Debug)]
pub struct Condition {
    pub of: &'static str,
    pub test: Test,
}

#[derive(Clone, Copy, Debug)]
pub enum Test {
    /// The flag has this value.
    Flag(bool),
    /// The choice is one of these.
    Among(&'static [&'static str]),
    /// The number is greater than this.
    Above(f64),
}

impl Group {
    /// The group where a choice of the technique is one of these.
    pub const fn when(self, of: &'static str, among: &'static [&'static str]) -> Group {
        Group { when: Some(Condition { of, test: Test::Among(among) }), ..self }
    }
}

/// How many groups some lists hold.
pub const fn count(lists: &[&[Group]]) -> usize {
    let (mut i, mut count) = (0, 0);
    while i < lists.len() {
        count += lists[i].len();
        i += 1;
    }
    count
}

/// The lists' groups, one after the other; N of them.
pub const fn join<const N: usize>(lists: &[&[Group]]) -> [Group; N] {
    let mut all = [Group { name: "", specs: &[], when: None }; N];
    let (mut i, mut at) = (0, 0);
    while i < lists.len() {
        let mut k = 0;
        while k < lists[i].len() {
            all[at] = lists[i][k];
            k += 1;
            at += 1;
        }
        i += 1;
    }
    all
}

/// Lists of groups as one: `groups!(&[A::GROUP], OTHERS)`.
#[macro_export]
macro_rules! groups {
    ($($list:expr),+ $(,)?) => {{
        const LISTS: &[&[$crate::params::Group]] = &[$($list),+];
        const ALL: [$crate::params::Group; $crate::params::count(LISTS)] = $crate::params::join(LISTS);
        &ALL
    }};
}

impl Test {
    pub fn holds(&self, value: &Value) -> bool {
        match (self, value) {
            (Test::Flag(wanted), Value::Bool(v)) => v == wanted,
            (Test::Among(options), Value::Text(v)) => options.contains(&v.as_str()),
            (Test::Above(least), Value::Int(v)) => *v as f64 > *least,
            (Test::Above(least), Value::Float(v)) => v > least,
            _ => false,
        }
    }
}

/// A declared group of parameters, which is also a WGSL struct of the same name.
#[derive(Clone, Copy, Debug)]
pub struct Group {
    pub name: &'static str,
    pub specs: &'static [Spec],
    /// It means something where this holds; always, if there is nothing.
    pub when: Option<Condition>,
}

/// Implemented by [`params!`](crate::params!).
pub trait Params: Sized {
    const GROUP: Group;
    /// Reads the group's values; what is absent takes its default.
    fn read(values: &Values) -> Self;
}

impl Spec {
    /// A parameter of this kind that nothing else is said of.
    pub const fn blank(unit: &'static str, kind: Kind) -> Spec {
        Spec { name: "", doc: "", unit, kind, ends: None, reach: None, section: "", when: &[] }
    }

    pub fn default(&self) -> Value {
        match self.kind {
            Kind::Flag { default } => Value::Bool(default),
            Kind::Int { default, .. } => Value::Int(default),
            Kind::Float { default, .. } => Value::Float(default),
            Kind::Choice { default, .. } => Value::Text(default.into()),
        }
    }

    /// The default where so many metres stand for one ([`crate::scene::Scene::unit`]), to two digits.
    pub fn default_in(&self, unit: f64) -> Value {
        match (self.kind, self.unit) {
            (Kind::Float { default, min, max }, "m") if unit != 1.0 && default != 0.0 => {
                let scaled: f64 = format!("{:.1e}", default * unit).parse().unwrap_or(default);
                Value::Float(scaled.clamp(min, max))
            }
            _ => self.default(),
        }
    }

    /// The values allowed, in words: `64 to 8192 texels`.
    pub fn range(&self) -> String {
        let unit = if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) };
        match self.kind {
            Kind::Flag { .. } => "true or false".into(),
            Kind::Int { min, max, step: 1, .. } => format!("a whole number from {min} to {max}{unit}"),
            Kind::Int { min, max, step, .. } => format!("{min} to {max}{unit} in steps of {step}"),
            Kind::Float { min, max, .. } => format!("a number from {min} to {max}{unit}"),
            Kind::Choice { options, .. } => format!("one of {}", options.join(", ")),
        }
    }

    /// Takes a value of the right type and range (a whole number for a float too), or says what is wrong with it.
    pub fn check(&self, key: &str, value: &Value) -> Result<Value> {
        let checked = match (self.kind, value) {
            (Kind::Flag { .. }, Value::Bool(_)) => Some(value.clone()),
            (Kind::Int { min, max, step, .. }, Value::Int(v)) if (min..=max).contains(v) && (v - min) % step == 0 => {
                Some(value.clone())
            }
            (Kind::Float { min, max, .. }, Value::Float(v)) if (min..=max).contains(v) => Some(value.clone()),
            (Kind::Float { min, max, .. }, Value::Int(v)) if (min..=max).contains(&(*v as f64)) => {
                Some(Value::Float(*v as f64))
            }
            (Kind::Choice { options, .. }, Value::Text(v)) if options.contains(&v.as_str()) => Some(value.clone()),
            _ => None,
        };
        match checked {
            Some(v) => Ok(v),
            None => bail!("{key} = {value} is not allowed; it takes {}", self.range()),
        }
    }

    /// Reads a value written on the command line.
    pub fn parse(&self, key: &str, text: &str) -> Result<Value> {
        let value = match self.kind {
            Kind::Flag { .. } => text.parse().map(Value::Bool).ok(),
            Kind::Int { .. } => text.parse().map(Value::Int).ok(),
            Kind::Float { .. } => text.parse().map(Value::Float).ok(),
            Kind::Choice { .. } => None,
        };
        self.check(key, &value.unwrap_or_else(|| Value::Text(text.into())))
    }

    /// The 32-bit word that the WGSL struct holds for a value.
    fn word(&self, values: &Values) -> u32 {
        let value = values.get(self.name).cloned().unwrap_or_else(|| self.default());
        match (self.kind, value) {
            (_, Value::Bool(v)) => v as u32,
            (_, Value::Int(v)) => v as u32,
            (_, Value::Float(v)) => (v as f32).to_bits(),
            (Kind::Choice { options, .. }, Value::Text(v)) => options.iter().position(|o| *o == v).unwrap_or(0) as u32,
            (_, Value::Text(_)) => 0,
        }
    }
}

impl Group {
    /// The group's values as uploaded: a 32-bit word each, in declared order, padded to 16 bytes.
    pub fn words(&self, values: &Values) -> Vec<u32> {
        let mut words: Vec<u32> = self.specs.iter().map(|s| s.word(values)).collect();
        words.resize(words.len().next_multiple_of(4), 0);
        words
    }

    /// The WGSL struct, and a constant for each option of a choice: `fit_receivers`.
    pub fn wgsl(&self) -> String {
        let mut fields = String::new();
        let mut constants = String::new();
        for s in self.specs {
            let ty = if matches!(s.kind, Kind::Float { .. }) { "f32" } else { "u32" };
            // WGSL keeps some names for itself.
            let kept = if wgpu::naga::keywords::wgsl::RESERVED.contains(&s.name) { "_" } else { "" };
            fields += &format!("    {}{kept}: {ty},\n", s.name);
            if let Kind::Choice { options, .. } = s.kind {
                for (i, o) in options.iter().enumerate() {
                    constants += &format!("const {}_{} = {i}u;\n", s.name, o.replace('-', "_"));
                }
            }
        }
        format!("struct {} {{\n{fields}}}\n{constants}", self.name)
    }
}

/// Declares a group of parameters, in the sections of the panel. A parameter that others can make meaningless says when it
/// is not: `if other = "value"`, `= ["one", "another"]`, `= true` or `> number`, put together by `and` and `or`. A length
/// whose slider should fit the scene names a share of the distance from which that is seen first:
/// `float(0.1, 0.0..=100.0, "m", 0.1 of view)`.
///
/// ```
/// shadowscope::params! {
///     /// Where a map looks.
///     pub struct Demo {
///         "Map" {
///             /// Side of the map.
///             resolution: int(1024, 64..=8192, "texels"),
///             /// Which faces are left out.
///             cull: choice("none", ["none", "front"]),
///         }
///         "Filter" {
///             /// Turn the pattern at every pixel.
///             rotate: flag(false),
///             /// How far it is turned.
///             turn: float(0.5, 0.0..=1.0, "none" => "once around") if rotate = true and resolution > 64,
///         }
///     }
/// }
/// ```
#[macro_export]
macro_rules! params {
    ($(#[$meta:meta])* pub struct $Name:ident {
        $( $section:literal {
            $( $(#[doc = $doc:literal])+ $field:ident : $kind:ident $args:tt
               $( if $( $( $other:ident $op:tt $value:tt )and+ )or+ )? ),* $(,)?
        } )+
    }) => {
        $(#[$meta])*
        #[derive(Clone, Debug, PartialEq)]
        pub struct $Name { $( $( $(#[doc = $doc])+ pub $field: $crate::params!(@type $kind) ),* ),+ }

        impl $crate::params::Params for $Name {
            const GROUP: $crate::params::Group = $crate::params::Group {
                name: stringify!($Name),
                specs: &[ $( $( $crate::params::Spec {
                    name: stringify!($field),
                    doc: concat!($($doc),+),
                    section: $section,
                    when: &[ $( $( &[ $( $crate::params::Condition {
                        of: stringify!($other),
                        test: $crate::params!(@test $op $value),
                    } ),+ ] ),+ )? ],
                    ..$crate::params!(@spec $kind $args)
                } ),* ),+ ],
                when: None,
            };
            fn read(values: &$crate::params::Values) -> Self {
                let mut specs = Self::GROUP.specs.iter();
                $( $( let $field = specs.next().map(|s| values.get(s.name).cloned().unwrap_or_else(|| s.default())); )* )+
                $Name { $( $( $field: $crate::params!(@read $kind $field) ),* ),+ }
            }
        }
    };
    (@type flag) => { bool };
    (@type int) => { u32 };
    (@type float) => { f32 };
    (@type choice) => { String };
    (@test = [$($option:literal),+]) => { $crate::params::Test::Among(&[$($option),+]) };
    (@test = true) => { $crate::params::Test::Flag(true) };
    (@test = false) => { $crate::params::Test::Flag(false) };
    (@test = $option:literal) => { $crate::params::Test::Among(&[$option]) };
    (@test > $least:literal) => { $crate::params::Test::Above($least as f64) };
    (@spec flag($default:expr)) => {
        $crate::params::Spec::blank("", $crate::params::Kind::Flag { default: $default })
    };
    (@spec int($default:expr, $min:literal ..= $max:literal, $unit:expr)) => {
        $crate::params!(@spec int($default, $min..=$max, $unit, 1))
    };
    (@spec int($default:expr, $min:literal ..= $max:literal, $unit:expr, $step:expr)) => {
        $crate::params::Spec::blank($unit, $crate::params::Kind::Int { default: $default, min: $min, max: $max, step: $step })
    };
    (@spec float($default:expr, $min:literal ..= $max:literal, $low:literal => $high:literal)) => {
        $crate::params::Spec { ends: Some([$low, $high]), ..$crate::params!(@spec float($default, $min..=$max, "")) }
    };
    (@spec float($default:expr, $min:literal ..= $max:literal, $unit:expr, $reach:literal of view)) => {
        $crate::params::Spec { reach: Some($reach), ..$crate::params!(@spec float($default, $min..=$max, $unit)) }
    };
    (@spec float($default:expr, $min:literal ..= $max:literal, $unit:expr)) => {
        $crate::params::Spec::blank($unit, $crate::params::Kind::Float { default: $default, min: $min, max: $max })
    };
    (@spec choice($default:expr, $options:expr)) => {
        $crate::params::Spec::blank("", $crate::params::Kind::Choice { default: $default, options: &$options })
    };
    (@read flag $v:ident) => { matches!($v, Some($crate::params::Value::Bool(true))) };
    (@read int $v:ident) => { if let Some($crate::params::Value::Int(v)) = $v { v as u32 } else { 0 } };
    (@read float $v:ident) => { if let Some($crate::params::Value::Float(v)) = $v { v as f32 } else { 0.0 } };
    (@read choice $v:ident) => { if let Some($crate::params::Value::Text(v)) = $v { v } else { String::new() } };
}

//! The declaration of parameters: what a group of each kind becomes.

use shadowscope::params::{Group, Kind, Params, Spec, Test, Value, Values};

shadowscope::params! {
    /// One of each kind.
    pub struct Sample {
        "First" {
            /// A flag.
            on: flag(true),
            /// Whole numbers.
            count: int(3, 1..=9, "taps", 2),
            /// Whole numbers, every one.
            size: int(64, 64..=8192, "texels"),
        }
        "Second" {
            /// A length.
            bias: float(0.02, 0.0..=1.5, "m") if on = true and count > 3 or mode = ["two", "thr-ee"],
            /// A share.
            share: float(0.5, 0.0..=1.0, "none" => "all"),
            /// A choice.
            mode: choice("two", ["one", "two", "thr-ee"]),
        }
    }
}

shadowscope::params! {
    /// Another.
    pub struct Other { "First" {
        /// A flag.
        off: flag(false)
    } }
}

fn spec(name: &str) -> &'static Spec {
    Sample::GROUP.specs.iter().find(|s| s.name == name).expect("a parameter of the sample")
}

fn values(of: &[(&str, Value)]) -> Values {
    of.iter().map(|(k, v)| (k.to_string(), v.clone())).collect()
}

/// Lists of groups become one in order, and a group's condition stays its own.
#[test]
fn groups_are_joined_in_order() {
    const CHOSEN: Group = Other::GROUP.when("mode", &["one"]);
    let all = shadowscope::groups!(&[Sample::GROUP, Other::GROUP], &[], &[CHOSEN]);
    assert_eq!(all.map(|g| (g.name, g.specs.len())), [("Sample", 6), ("Other", 1), ("Other", 1)]);
    assert!(all[0].when.is_none() && all[1].when.is_none());
    let condition = all[2].when.expect("a condition");
    assert_eq!(condition.of, "mode");
    assert!(condition.test.holds(&Value::Text("one".into())) && !condition.test.holds(&Value::Text("two".into())));
}

/// A condition holds of values of its own kind; a limit lies outside.
#[test]
fn conditions_hold_of_what_they_say() {
    let [first, second] = spec("bias").when else { panic!("two lists") };
    let text = |t: &str| Value::Text(t.into());
    for (test, holds, fails) in [
        (first[0].test, vec![Value::Bool(true)], vec![Value::Bool(false), Value::Int(1), text("true")]),
        (Test::Flag(false), vec![Value::Bool(false)], vec![Value::Bool(true)]),
        (
            first[1].test,
            vec![Value::Int(4), Value::Float(3.1)],
            vec![Value::Int(3), Value::Int(2), Value::Float(3.0), Value::Float(-4.0), Value::Bool(true)],
        ),
        (second[0].test, vec![text("two"), text("thr-ee")], vec![text("one"), Value::Bool(true)]),
    ] {
        assert!(holds.iter().all(|v| test.holds(v)), "{test:?}");
        assert!(fails.iter().all(|v| !test.holds(v)), "{test:?}");
    }
}

/// Lengths grow with the scene's unit, to two digits and within their range; nothing else does.
#[test]
fn lengths_follow_the_scenes_unit() {
    for (unit, bias) in [(1.0, 0.02), (10.0, 0.2), (0.123, 0.0025), (1e3, 1.5)] {
        assert_eq!(spec("bias").default_in(unit), Value::Float(bias), "{unit}");
        for other in ["on", "count", "size", "share", "mode"] {
            assert_eq!(spec(other).default_in(unit), spec(other).default(), "{other}");
        }
    }
    let unscaled = Spec::blank("m", Kind::Float { default: 0.025, min: 0.0, max: 1.0 });
    assert_eq!(unscaled.default_in(1.0), Value::Float(0.025));
    // Nothing is not a length that grows.
    let none = Spec::blank("m", Kind::Float { default: 0.0, min: 0.0, max: 1.0 });
    assert_eq!(none.default_in(10.0), Value::Float(0.0));
    let three = Spec::blank("m", Kind::Float { default: 0.0123, min: 0.0, max: 1.0 });
    assert_eq!((three.default_in(1.0), three.default_in(2.0)), (Value::Float(0.0123), Value::Float(0.025)));
}

/// What is written is read as its kind has it, or refused with what would be allowed.
#[test]
fn words_are_read_as_their_kind_has_them() {
    for (name, text, value) in [
        ("on", "false", Value::Bool(false)),
        ("count", "5", Value::Int(5)),
        ("bias", "1", Value::Float(1.0)),
        ("bias", "0.25", Value::Float(0.25)),
        ("mode", "thr-ee", Value::Text("thr-ee".into())),
    ] {
        assert_eq!(spec(name).parse("key", text).expect(text), value);
        // And is written so again.
        assert_eq!(spec(name).parse("key", &value.to_string()).expect(text), value);
    }
    assert_eq!([Value::Float(3.0), Value::Int(3), Value::Bool(true)].map(|v| v.to_string()), ["3.0", "3", "true"]);
    // Steps count from the least.
    let odd = Spec::blank("", Kind::Int { default: 1, min: 1, max: 10, step: 3 });
    let taken: Vec<i64> = (0..12).filter(|v| odd.check("key", &Value::Int(*v)).is_ok()).collect();
    assert_eq!(taken, [1, 4, 7, 10]);
    for (name, text, allowed) in [
        ("on", "1", "true or false"),
        ("count", "4", "1 to 9 taps in steps of 2"),
        ("count", "11", "1 to 9 taps in steps of 2"),
        ("size", "63", "a whole number from 64 to 8192 texels"),
        ("bias", "-0.1", "a number from 0 to 1.5 m"),
        ("share", "much", "a number from 0 to 1"),
        ("mode", "four", "one of one, two, thr-ee"),
    ] {
        let said = spec(name).parse("key", text).expect_err(text).to_string();
        assert_eq!(said, format!("key = {text} is not allowed; it takes {allowed}"));
    }
}

/// Rust and WGSL see the same words in the same order, padded to 16 bytes; what is absent has its default.
#[test]
fn wgsl_has_the_same_words() {
    let read = Sample::read(&Values::new());
    assert_eq!((read.on, read.count, read.size, read.bias, read.share), (true, 3, 64, 0.02, 0.5));
    assert_eq!(read.mode, "two");
    let given =
        values(&[("bias", Value::Float(0.75)), ("mode", Value::Text("thr-ee".into())), ("on", Value::Bool(false))]);
    assert_eq!(Sample::GROUP.words(&given), [0, 3, 64, 0.75f32.to_bits(), 0.5f32.to_bits(), 2, 0, 0]);
    assert_eq!(Other::GROUP.words(&values(&[("off", Value::Bool(true))])), [1, 0, 0, 0]);
    let module = wgpu::naga::front::wgsl::parse_str(&Sample::GROUP.wgsl()).expect("WGSL");
    let (_, held) = module.types.iter().find(|(_, t)| t.name.as_deref() == Some("Sample")).expect("the struct");
    let wgpu::naga::TypeInner::Struct { members, .. } = &held.inner else { panic!("{held:?}") };
    let names: Vec<_> = members.iter().filter_map(|m| m.name.as_deref()).collect();
    // `on` and the others are no keywords.
    assert_eq!(names, Sample::GROUP.specs.iter().map(|s| s.name).collect::<Vec<_>>());
    assert!(members.iter().enumerate().all(|(i, m)| m.offset == 4 * i as u32));
    let constants: Vec<_> = module.constants.iter().filter_map(|(_, c)| c.name.as_deref()).collect();
    assert_eq!(constants, ["mode_one", "mode_two", "mode_thr_ee"]);
}

//! The configurations of a sweep: techniques × parameter values.

use super::params_text;
use crate::params::{Kind, Value};
use crate::setup::Setup;
use crate::techniques;
use anyhow::{Context, Result, bail, ensure};
use std::collections::BTreeSet;

/// The most configurations that one sweep may have.
const MOST: usize = 100_000;

/// One `--set` of a sweep: a parameter and the values it takes.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// None: every technique that has the parameter.
    pub technique: Option<String>,
    pub name: String,
    /// As written: a list, or a range.
    values: String,
}

impl Axis {
    /// Reads `[technique.]name=values`.
    ///
    /// # Errors
    /// No equals sign, or an unknown technique.
    pub fn parse(text: &str) -> Result<Axis> {
        let Some((key, values)) = text.split_once('=') else {
            bail!("--set {text}: write it as key=values or technique.key=values, such as resolution=256..4096*2");
        };
        let (technique, name) = match key.split_once('.') {
            Some((id, name)) => (Some(techniques::find_or_say(id)?.id.to_string()), name),
            None => (None, key),
        };
        Ok(Axis { technique, name: name.into(), values: values.into() })
    }

    /// An axis that a technique names as one of its main parameters.
    fn main(technique: &str, (name, values): (&str, &str)) -> Axis {
        Axis { technique: Some(technique.into()), name: name.into(), values: values.into() }
    }

    /// Whether it fixes one value instead of varying it.
    pub fn is_fixed(&self) -> bool {
        !self.values.contains(',') && !self.values.contains("..")
    }

    fn is_of(&self, technique: &str) -> bool {
        self.technique.as_ref().is_none_or(|t| t == technique)
    }

    /// Its values for a technique; None if the technique has no such parameter.
    fn values(&self, technique: &str) -> Result<Option<Vec<Value>>> {
        let info = techniques::find_or_say(technique)?;
        let Some(spec) = info.specs().find(|s| s.name == self.name) else { return Ok(None) };
        let key = format!("{technique}.{}", self.name);
        let mut out = Vec::new();
        let mut held = BTreeSet::new();
        for part in self.values.split(',') {
            for text in match range(part) {
                Some(numbers) => numbers.with_context(|| format!("--set {key}={}", self.values))?,
                None => vec![part.trim().to_string()],
            } {
                // A linear range makes numbers such as 3.0, which a whole number may be written as.
                let whole = matches!(spec.kind, Kind::Int { .. }).then(|| text.parse::<f64>().ok()).flatten();
                let text = whole.filter(|v| v.fract() == 0.0).map_or(text, |v| format!("{v:.0}"));
                let value = spec.parse(&key, &text)?;
                if held.insert(value.to_string()) {
                    out.push(value);
                }
            }
            ensure!(out.len() <= MOST, "--set {key}: there are more than {MOST} values");
        }
        Ok(Some(out))
    }
}

/// The numbers of `a..b*f` (each f times the last), `a..b+d` (each d more) or `a..b` (steps of 1); None if it is no range.
fn range(text: &str) -> Option<Result<Vec<String>>> {
    let (from, rest) = text.split_once("..")?;
    let (to, step) = match rest.find(['*', '+']) {
        Some(at) => (&rest[..at], Some((&rest[at..=at], &rest[at + 1..]))),
        None => (rest, None),
    };
    Some(numbers(from, to, step).with_context(|| format!("{text} is no range; write a..b*factor, a..b+step or a..b")))
}

fn numbers(from: &str, to: &str, step: Option<(&str, &str)>) -> Result<Vec<String>> {
    let number = |t: &str| t.trim().parse::<f64>().with_context(|| format!("{t} is not a number"));
    let (from, to) = (number(from)?, number(to)?);
    let (grow, by) = match step {
        Some(("*", f)) => (true, number(f)?),
        Some((_, d)) => (false, number(d)?),
        None => (false, 1.0),
    };
    ensure!(from <= to, "it starts above its end");
    ensure!(if grow { by > 1.0 && from > 0.0 } else { by > 0.0 }, "its steps do not lead from its start to its end");
    let mut out = Vec::new();
    for i in 0..MOST {
        let x = if grow { from * by.powi(i as i32) } else { from + by * i as f64 };
        if x > to * (1.0 + 1e-12) + by.min(1.0) * 1e-9 {
            return Ok(out);
        }
        // Rounded to what was meant: 0.1 + 0.2 is 0.3.
        out.push(format!("{}", (x * 1e9).round() / 1e9));
    }
    bail!("it has more than {MOST} steps")
}

/// Every configuration of the techniques over the axes, in the order of both; the first axis changes slowest. Of
/// techniques that share no axis each has only the combinations of its own. `main`: each technique's main parameters
/// that no axis names are varied too. Of configurations that differ only where it means nothing the first stays.
///
/// # Errors
/// A value that is not allowed, or a parameter that no technique has.
pub fn expand(setup: &Setup, techniques: &[String], axes: &[Axis], main: bool) -> Result<Vec<Setup>> {
    for axis in axes {
        let known = |t: &&String| axis.is_of(t) && matches!(axis.values(t), Ok(Some(_)) | Err(_));
        if techniques.iter().any(|t| known(&t)) {
            continue;
        }
        let name = &axis.name;
        if let Some(t) = &axis.technique {
            ensure!(
                techniques.contains(t),
                "--set {t}.{name}: {t} is not among the techniques {}",
                techniques.join(", ")
            );
        }
        let asked: Vec<&String> = axis.technique.iter().chain(techniques.iter().filter(|t| axis.is_of(t))).collect();
        let mut names = BTreeSet::new();
        for id in asked {
            names.extend(techniques::find_or_say(id)?.specs().map(|s| s.name));
        }
        let names: Vec<&str> = names.into_iter().collect();
        let key = axis.technique.as_ref().map_or(name.clone(), |t| format!("{t}.{name}"));
        bail!("--set {key}: there is no such parameter; there are {}", names.join(", "));
    }
    let mut out = Vec::new();
    for id in techniques {
        let named: Vec<&Axis> = axes.iter().filter(|a| a.is_of(id)).collect();
        let own =
            techniques::find_or_say(id)?.main.iter().filter(|(name, _)| main && named.iter().all(|a| a.name != *name));
        let own: Vec<Axis> = own.map(|a| Axis::main(id, *a)).collect();
        let mut varied = Vec::new();
        for axis in named.into_iter().chain(&own) {
            varied.extend(axis.values(id)?.map(|values| (axis, values)));
        }
        // Counted before any is made: a few ranges multiply to more than any memory holds.
        let these = varied.iter().map(|(_, values)| values.len() as u128).fold(1, u128::saturating_mul);
        let count = these.saturating_add(out.len() as u128);
        ensure!(
            count <= MOST as u128,
            "the sweep has {count} configurations and more, but up to {MOST} are allowed; give --set fewer values"
        );
        let mut these = vec![setup.clone()];
        these[0].select(id)?;
        for (axis, values) in varied {
            let mut next = Vec::with_capacity(these.len() * values.len());
            for base in &these {
                for value in &values {
                    let mut setup = base.clone();
                    setup.params.entry(id.clone()).or_default().insert(axis.name.clone(), value.clone());
                    next.push(setup);
                }
            }
            these = next;
        }
        let mut seen = BTreeSet::new();
        these.retain(|s| seen.insert(params_text(s)));
        out.append(&mut these);
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(text: &str) -> Vec<String> {
        let axis = Axis::parse(text).unwrap();
        axis.values("pcf").unwrap().unwrap().iter().map(Value::to_string).collect()
    }

    #[test]
    fn ranges_and_lists() {
        assert_eq!(axis("resolution=256..4096*2"), ["256", "512", "1024", "2048", "4096"]);
        assert_eq!(axis("pcf.kernel=1,3,5..9+2"), ["1", "3", "5", "7", "9"]);
        assert_eq!(axis("slope_bias=0..0.3+0.1"), ["0.0", "0.1", "0.2", "0.3"]);
        assert_eq!(axis("samples=4..7"), ["4", "5", "6", "7"]);
        assert_eq!(axis("mode=grid,tent,grid"), ["grid", "tent"]);
        for wrong in ["resolution=256..4096*1", "resolution=4096..256*2", "resolution=a..b", "resolution=1..2*2"] {
            assert!(Axis::parse(wrong).unwrap().values("pcf").is_err(), "{wrong}");
        }
    }

    /// Two ranges of thousands: told by their number, not made.
    #[test]
    fn a_product_is_counted_before_it_is_made() {
        let (setup, _) = Setup::open("cubes").unwrap();
        let axes = ["resolution=64..8192", "slope_bias=0..1+0.0001"].map(|a| Axis::parse(a).unwrap());
        let error = expand(&setup, &["shadow-map".into()], &axes, false).unwrap_err().to_string();
        assert!(error.contains("81298129 configurations") && error.contains("100000"), "{error}");
    }

    #[test]
    fn what_means_nothing_is_not_swept() {
        let (setup, _) = Setup::open("cubes").unwrap();
        let axes = ["pcf.mode=grid,disk", "pcf.kernel=3,5,7", "pcf.samples=8,16"].map(|a| Axis::parse(a).unwrap());
        let all = expand(&setup, &["pcf".into()], &axes, false).unwrap();
        let told: Vec<String> = all.iter().map(params_text).collect();
        let of = |mode: &str| told.iter().filter(|t| t.contains(mode)).count();
        assert_eq!((told.len(), of("mode=grid"), of("mode=disk")), (5, 3, 2), "{told:#?}");
        assert!(told.iter().all(|t| t.contains("kernel=") != t.contains("samples=")), "{told:#?}");
    }

    #[test]
    fn the_first_axis_changes_slowest_and_each_technique_has_its_own() {
        let (setup, _) = Setup::open("cubes").unwrap();
        let ids = ["shadow-map".to_string(), "pcf".into(), "rt-hard".into()];
        let axes = [Axis::parse("resolution=256,512").unwrap(), Axis::parse("pcf.kernel=3,5").unwrap()];
        let all = expand(&setup, &ids, &axes, false).unwrap();
        let told: Vec<String> = all
            .iter()
            .map(|s| {
                let v = |name: &str| s.values().get(name).map_or("-".into(), Value::to_string);
                format!("{} {} {}", s.technique, v("resolution"), v("kernel"))
            })
            .collect();
        assert_eq!(
            told,
            ["shadow-map 256 -", "shadow-map 512 -", "pcf 256 3", "pcf 256 5", "pcf 512 3", "pcf 512 5", "rt-hard - -"]
        );
        assert!(expand(&setup, &ids, &[Axis::parse("nonsense=1").unwrap()], false).is_err());
        assert!(expand(&setup, &ids[..1], &[Axis::parse("pcf.kernel=3").unwrap()], false).is_err());
        for info in techniques::ALL.iter() {
            let all = expand(&setup, &[info.id.into()], &[], true).unwrap();
            assert!(all.len() > 1 || info.main.is_empty(), "{}: its main parameters have values", info.id);
            let known = |(name, _): &&(&str, &str)| info.specs().any(|s| s.name == *name);
            assert_eq!(info.main.iter().filter(known).count(), info.main.len(), "{}", info.id);
            let fixed = expand(&setup, &[info.id.into()], &[Axis::parse("resolution=512").unwrap()], true);
            let count = fixed.map_or(0, |f| f.len());
            assert!(count <= all.len(), "a parameter that an axis names is not varied twice");
        }
    }
}

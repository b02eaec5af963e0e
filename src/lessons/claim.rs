//! What a lesson says is so, over measured columns: `acne_share > 5 %`, `tried.error_share < 0.6 * error_share`.

use crate::measure::{Column, Record};
use crate::message;
use anyhow::{Context, Result, bail, ensure};
use std::fmt;

/// Which of a step's set-ups is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Whose {
    /// Of the step before.
    Before,
    /// The step's own.
    Here,
    /// Another side of its comparison, from 1.
    Side(usize),
    /// After what there is to try.
    Tried,
}

impl Whose {
    /// As claims write it; nothing for the step's own.
    fn name(self) -> &'static str {
        match self {
            Whose::Before => "before.",
            Whose::Here => "",
            Whose::Side(i) => ["", "b.", "c.", "d."][i.min(3)],
            Whose::Tried => "tried.",
        }
    }

    /// As readers are told.
    pub fn told(self) -> &'static str {
        match self {
            Whose::Before => "the step before",
            Whose::Here => "as it is",
            Whose::Side(i) => ["", "side B", "side C", "side D"][i.min(3)],
            Whose::Tried => "after the try",
        }
    }
}

/// A measured number: a column of one of the step's set-ups.
#[derive(Clone, Copy)]
pub struct Quantity {
    pub whose: Whose,
    pub column: &'static Column,
}

impl Quantity {
    /// From `COLUMN` or `before.COLUMN`, `tried.COLUMN`, `b.COLUMN`, `c.COLUMN`, `d.COLUMN`.
    ///
    /// # Errors
    /// No such column or set-up.
    pub fn parse(text: &str) -> Result<Quantity> {
        let (whose, column) = match text.trim().split_once('.') {
            None => (Whose::Here, text.trim()),
            Some(("before", column)) => (Whose::Before, column),
            Some(("tried", column)) => (Whose::Tried, column),
            Some(("b", column)) => (Whose::Side(1), column),
            Some(("c", column)) => (Whose::Side(2), column),
            Some(("d", column)) => (Whose::Side(3), column),
            Some((other, _)) => bail!("{other}.: there are before., tried., b., c. and d."),
        };
        Ok(Quantity { whose, column: Column::find(column)? })
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}{}", self.whose.name(), self.column.id)
    }
}

impl fmt::Debug for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{self}")
    }
}

/// Left and right of a comparison: a number of times a quantity, or a number alone.
#[derive(Clone, Copy, Debug)]
struct Side {
    factor: f64,
    of: Option<Quantity>,
}

impl Side {
    fn parse(text: &str) -> Result<Side> {
        let number = |text: &str| {
            let text = text.trim();
            let digits = text.trim_end_matches(|c: char| !c.is_ascii_digit() && c != '.').trim();
            digits.parse::<f64>().ok().filter(|n| n.is_finite())
        };
        let starts = text.trim().starts_with(|c: char| c.is_ascii_digit() || c == '-' || c == '.');
        match text.split_once('*') {
            Some((factor, quantity)) => Ok(Side {
                factor: number(factor).with_context(|| format!("{} is no number", message::quoted(factor.trim())))?,
                of: Some(Quantity::parse(quantity)?),
            }),
            None if starts => {
                let factor = number(text).with_context(|| format!("{} is no number", message::quoted(text.trim())))?;
                Ok(Side { factor, of: None })
            }
            None => Ok(Side { factor: 1.0, of: Some(Quantity::parse(text)?) }),
        }
    }

    fn value(&self, of: &dyn Fn(Quantity) -> Option<f64>) -> Option<f64> {
        Some(self.factor * self.of.map_or(Some(1.0), of)?)
    }
}

/// A comparison of measured numbers.
#[derive(Clone, Debug)]
pub struct Claim {
    text: String,
    left: Side,
    /// The left one is greater; else it is less.
    greater: bool,
    right: Side,
}

impl Claim {
    /// From `LEFT > RIGHT` or `LEFT < RIGHT`: numbers, quantities ([`Quantity::parse`]), or `NUMBER * QUANTITY`. A unit may stand
    /// behind a number; it is the column's.
    ///
    /// # Errors
    /// What is not understood.
    pub fn parse(text: &str) -> Result<Claim> {
        let read = || {
            let greater = text.contains('>');
            let (left, right) =
                text.split_once(['<', '>']).context("write it as COLUMN > NUMBER or COLUMN < NUMBER")?;
            let claim =
                Claim { text: text.trim().into(), left: Side::parse(left)?, greater, right: Side::parse(right)? };
            ensure!(claim.quantities().next().is_some(), "it names no column");
            Ok(claim)
        };
        read().with_context(|| format!("{} cannot be read", message::quoted(text)))
    }

    /// What it is about.
    pub fn quantities(&self) -> impl Iterator<Item = &Quantity> {
        [&self.left, &self.right].into_iter().filter_map(|side| side.of.as_ref())
    }

    /// Whether it is so; None where a number is not known.
    pub fn holds(&self, of: &dyn Fn(Quantity) -> Option<f64>) -> Option<bool> {
        let (left, right) = (self.left.value(of)?, self.right.value(of)?);
        Some(if self.greater { left > right } else { left < right })
    }
}

impl fmt::Display for Claim {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// A record's number of a quantity, with its unit, as readers take it in.
pub fn shown(column: &Column, record: &Record) -> String {
    let number = column.rounded(record);
    match column.unit() {
        "" => number,
        unit => format!("{number} {unit}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn holds(claim: &str, here: f64, tried: f64) -> Option<bool> {
        let of = |q: Quantity| match q.whose {
            Whose::Here => Some(here),
            Whose::Tried => Some(tried),
            _ => None,
        };
        Claim::parse(claim).unwrap().holds(&of)
    }

    #[test]
    fn claims_compare_numbers_and_multiples() {
        assert_eq!(holds("acne_share > 5 %", 5.1, 0.0), Some(true));
        assert_eq!(holds("acne_share > 5 %", 5.0, 0.0), Some(false));
        assert_eq!(holds("tried.error_share < 0.5 * error_share", 8.0, 3.9), Some(true));
        assert_eq!(holds("tried.error_share < 0.5 * error_share", 8.0, 4.1), Some(false));
        assert_eq!(holds("2 * rmse < tried.rmse", 1.0, 2.5), Some(true));
        assert_eq!(holds("b.rmse < rmse", 1.0, 2.5), None, "what was not measured is not known");
    }

    #[test]
    fn what_is_no_claim_is_refused_by_name() {
        let said = |text: &str| format!("{:#}", Claim::parse(text).unwrap_err());
        assert!(said("acne > 5").contains("acne: there is no such column"));
        assert!(said("acne_share").contains("COLUMN > NUMBER"));
        assert!(said("then.acne_share > 5").contains("there are before., tried."));
        assert!(said("1 < 2").contains("names no column"));
        assert!(said("x * acne_share < 5").contains("no number"));
    }
}

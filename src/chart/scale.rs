//! Axes: where values lie, and which are written beside them.

/// Room of the row or column for zeros on a logarithmic axis, points; the axis is broken in its middle.
const ZERO_ROOM: f64 = 18.0;
/// Where in it the zeros stand, from the axis' start.
const ZERO_AT: f64 = 5.0;

/// A linear or logarithmic axis over some values. Positions are in points of the page.
pub struct Scale {
    log: bool,
    /// A logarithmic axis has a row for zeros before its start.
    zero: bool,
    /// There is nothing but zeros.
    only_zero: bool,
    /// The least and greatest value (its logarithm to the base of ten if logarithmic).
    low: f64,
    high: f64,
    start: f64,
    end: f64,
}

/// A value written beside an axis, with its place.
pub struct Tick {
    pub at: f64,
    /// `5`, `0.02`, `10k`; before an exponent of ten: `2·10`.
    pub text: String,
    pub exponent: Option<i32>,
}

impl Scale {
    /// An axis that holds all values, and begins and ends at round ones. Negative values have no place on a logarithmic
    /// axis.
    pub fn new(values: impl Iterator<Item = f64>, log: bool) -> Scale {
        let (mut low, mut high, mut zero) = (f64::INFINITY, f64::NEG_INFINITY, false);
        for v in values.filter(|v| v.is_finite()) {
            if log && v <= 0.0 {
                zero = true;
            } else {
                (low, high) = (low.min(v), high.max(v));
            }
        }
        let only_zero = zero && low > high;
        if low > high {
            (low, high) = if log { (0.1, 1.0) } else { (0.0, 1.0) };
        }
        if log {
            // A little room, so that no marker stands on an end.
            (low, high) = (round_down(low / 1.08).log10(), -round_down(1.0 / (high * 1.08)).log10());
        } else {
            let step = round_step(low, high, 5);
            (low, high) = ((low / step + 1e-9).floor() * step, (high / step - 1e-9).ceil() * step);
            if low == high {
                high += step;
            }
        }
        Scale { log, zero, only_zero, low, high, start: 0.0, end: 1.0 }
    }

    /// A linear axis that ends where the values do.
    pub fn tight(values: impl Iterator<Item = f64> + Clone) -> Scale {
        let (low, high) = (values.clone().fold(f64::INFINITY, f64::min), values.fold(f64::NEG_INFINITY, f64::max));
        let round = Scale::new([low, high].into_iter(), false);
        if low < high { Scale { low, high, ..round } } else { round }
    }

    /// Lays the axis from one place of the page to another.
    pub fn lay(&mut self, start: f64, end: f64) {
        (self.start, self.end) = (start, end);
    }

    /// Where the part without zeros starts.
    fn inner(&self) -> f64 {
        self.start + if self.zero { ZERO_ROOM * (self.end - self.start).signum() } else { 0.0 }
    }

    /// Where the row of zeros stands, if there are any.
    pub fn zero(&self) -> Option<f64> {
        let sign = (self.end - self.start).signum();
        let at = if self.only_zero { (self.start + self.end) / 2.0 } else { self.start + ZERO_AT * sign };
        self.zero.then_some(at)
    }

    /// Where the axis is broken between zeros and the rest.
    pub fn gap(&self) -> Option<f64> {
        let at = self.start + (ZERO_AT + ZERO_ROOM) / 2.0 * (self.end - self.start).signum();
        (self.zero && !self.only_zero).then_some(at)
    }

    /// Where a value lies.
    pub fn at(&self, value: f64) -> f64 {
        if let (true, Some(zero)) = (value <= 0.0, self.zero()) {
            return zero;
        }
        let v = if self.log { value.log10() } else { value };
        self.inner() + (v - self.low) / (self.high - self.low) * (self.end - self.inner())
    }

    /// The values written: 1, 2, 5 of each decade where they fit, else 1, else every other one and so on. `room` is what a
    /// text takes along the axis, points.
    pub fn ticks(&self, room: impl Fn(&Tick) -> f64) -> Vec<Tick> {
        if self.only_zero {
            return Vec::new();
        }
        let fits = |ticks: &[Tick]| {
            ticks.windows(2).all(|t| (t[1].at - t[0].at).abs() > (room(&t[0]) + room(&t[1])) / 2.0 + 2.0)
        };
        if !self.log {
            let step = round_step(self.low, self.high, 5);
            let digits = (-step.log10().floor()).max(0.0) as usize;
            let ticks = |every: i64| -> Vec<Tick> {
                let (from, to) = ((self.low / step - 1e-9).ceil() as i64, (self.high / step + 1e-9).floor() as i64);
                let chosen = (from..=to).filter(|i| i.rem_euclid(every) == 0).map(|i| i as f64 * step);
                chosen.map(|v| Tick { at: self.at(v), text: minus(format!("{v:.digits$}")), exponent: None }).collect()
            };
            return [1, 2, 5].map(ticks).into_iter().find(|t| fits(t)).unwrap_or_default();
        }
        let [first, last] = [self.low.floor() as i32, self.high.ceil() as i32];
        let powers = 10f64.powf(self.low) < 0.00099;
        let ticks = |mantissas: &[i32], every: i32| -> Vec<Tick> {
            let decades = (first..=last).filter(|d| d.rem_euclid(every) == 0);
            let all = decades.flat_map(|d| mantissas.iter().map(move |m| (*m, d)));
            let inside = all.filter(|(m, d)| self.has((*m as f64).log10() + *d as f64));
            inside.map(|(m, d)| self.tick(m, d, powers)).collect()
        };
        let decades = ticks(&[1], 1);
        // Long numbers only where there are too few short ones.
        if !(powers && decades.len() >= 3) {
            let full = ticks(&[1, 2, 5], 1);
            if fits(&full) {
                return full;
            }
        }
        if decades.len() < 2 {
            return ticks(&[1, 3], 1);
        }
        (1..).map(|every| ticks(&[1], every)).find(|t| fits(t)).unwrap_or_default()
    }

    /// Places between the written values of a logarithmic axis: 1 to 9 of each decade.
    pub fn minor(&self) -> Vec<f64> {
        if !self.log || self.only_zero {
            return Vec::new();
        }
        let decades = self.low.floor() as i32..=self.high.ceil() as i32;
        let all = decades.flat_map(|d| (1..10).map(move |m| (m as f64).log10() + d as f64));
        all.filter(|v| self.has(*v)).map(|v| self.at(10f64.powf(v))).collect()
    }

    fn has(&self, exponent: f64) -> bool {
        (self.low - 1e-9..=self.high + 1e-9).contains(&exponent)
    }

    fn tick(&self, mantissa: i32, decade: i32, powers: bool) -> Tick {
        let value = mantissa as f64 * 10f64.powi(decade);
        let at = self.at(value);
        if powers && decade != 0 {
            let text = if mantissa == 1 { "10".into() } else { format!("{mantissa}·10") };
            return Tick { at, text, exponent: Some(decade) };
        }
        Tick { at, text: short(value), exponent: None }
    }
}

/// The greatest of 1, 2, 5 times a power of ten that is not above the value.
fn round_down(value: f64) -> f64 {
    let decade = 10f64.powf(value.log10().floor());
    let mantissa = value / decade * (1.0 + 1e-9);
    decade
        * if mantissa >= 5.0 {
            5.0
        } else if mantissa >= 2.0 {
            2.0
        } else {
            1.0
        }
}

/// Distance of the round values on a linear axis that has about `count` of them.
pub fn round_step(low: f64, high: f64, count: u32) -> f64 {
    let span = if high > low { high - low } else { low.abs().max(1.0) };
    let wanted = span / f64::from(count);
    let decade = 10f64.powf(wanted.log10().floor());
    decade * [1.0, 2.0, 5.0, 10.0].into_iter().find(|m| m * decade >= wanted * 0.85).unwrap_or(10.0)
}

/// A number of a few digits: with SI letters from ten thousand up, with a true minus sign.
pub fn short(value: f64) -> String {
    let text = match value.abs() {
        v if v >= 1e4 => {
            let (unit, letter) = [(1e12, "T"), (1e9, "G"), (1e6, "M"), (1e3, "k")]
                .into_iter()
                .find(|(u, _)| v >= *u * 0.9995)
                .unwrap_or((1e3, "k"));
            format!("{}{letter}", digits(value / unit))
        }
        _ => digits(value),
    };
    minus(text)
}

/// A number in the digits that a reader takes in: three that count, without zeros at the end, and none behind the ninth
/// place.
pub fn digits(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let places = (2.0 - value.abs().log10().floor()).clamp(0.0, 9.0) as usize;
    let text = format!("{value:.places$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
}

fn minus(text: String) -> String {
    text.replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(values: &[f64], log: bool, length: f64) -> Vec<String> {
        let mut s = Scale::new(values.iter().copied(), log);
        s.lay(0.0, length);
        let ticks = s.ticks(|t| t.text.len() as f64 * 4.0);
        ticks.iter().map(|t| t.exponent.map_or(t.text.clone(), |e| format!("{}^{e}", t.text))).collect()
    }

    #[test]
    fn axes_write_round_values() {
        assert_eq!(written(&[0.3, 4.0], true, 200.0), ["0.2", "0.5", "1", "2", "5"]);
        assert_eq!(written(&[0.3, 400.0], true, 60.0), ["1", "10", "100"]);
        assert_eq!(written(&[2e-5, 0.3], true, 200.0), ["10^-5", "10^-4", "10^-3", "10^-2", "10^-1"]);
        assert_eq!(written(&[3e5, 4e6], true, 200.0), ["200k", "500k", "1M", "2M", "5M"]);
        assert_eq!(written(&[0.0, 1.0], false, 200.0), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(written(&[-12.0, 30.0], false, 200.0), ["−20", "−10", "0", "10", "20", "30"]);
        assert!(written(&[7.0], false, 200.0).len() >= 2);
        assert!(written(&[1e-12, 1e12], true, 100.0).len() >= 2);
    }

    #[test]
    fn zeros_stand_before_the_break() {
        let mut s = Scale::new([0.0, 1.0, 100.0].into_iter(), true);
        s.lay(100.0, 0.0);
        let (zero, gap) = (s.zero().unwrap(), s.gap().unwrap());
        assert!(s.at(0.0) == zero && zero > gap && gap > s.at(1.0), "{zero} {gap} {}", s.at(1.0));
        assert!((s.at(10.0) - (s.at(1.0) + s.at(100.0)) / 2.0).abs() < 1e-9);
    }

    #[test]
    fn numbers_are_short() {
        for (v, text) in [(0.0, "0"), (1.0, "1"), (0.012345, "0.0123"), (2048.0, "2048"), (12e6, "12M"), (-3.5, "−3.5")]
        {
            assert_eq!(short(v), text);
        }
        assert_eq!((short(999_950.0), short(123.456)), ("1M".to_string(), "123".to_string()));
    }
}

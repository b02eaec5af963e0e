//! Text from files and users in messages and lists: on one line, of bounded length, without control characters.

/// Says something on standard error, as `eprintln!` does; where nobody listens any more, or the disk that it goes to is full, it is not
/// said, and the work goes on.
macro_rules! tell {
    ($($said:tt)*) => {{
        use std::io::Write as _;
        _ = writeln!(std::io::stderr(), $($said)*);
    }};
}
pub(crate) use tell;

/// Characters of a name that are shown.
const SHOWN: usize = 80;
/// Names of a list that are shown.
const LISTED: usize = 20;
/// Characters of a whole message that are shown.
const WHOLE: usize = 2000;

/// On one line and of bounded length.
pub fn shortened(text: &str) -> String {
    cut(text, SHOWN)
}

/// [`shortened`], in quotation marks.
pub fn quoted(text: &str) -> String {
    format!("\"{}\"", shortened(text))
}

/// On one line and of no more than so many characters, those of escapes counted.
pub fn cut(text: &str, most: usize) -> String {
    let (mut short, mut left) = (String::new(), most);
    for c in text.chars() {
        let takes = if is_plain(c) { 1 } else { c.escape_default().len() };
        if takes > left {
            short.push('…');
            break;
        }
        left -= takes;
        if is_plain(c) { short.push(c) } else { short.extend(c.escape_default()) }
    }
    short
}

/// Whether a character neither steers a terminal nor changes the order in which others are read.
fn is_plain(c: char) -> bool {
    !(c.is_control() || matches!(c, '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}'))
}

/// Names as one phrase, of bounded length.
pub fn list<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let mut names = names.into_iter();
    let mut text = names.by_ref().take(LISTED).map(shortened).collect::<Vec<_>>().join(", ");
    match names.count() {
        0 => {}
        more => text += &format!(" and {more} more"),
    }
    text
}

/// A sentence that starts with how many there are, if there are any.
pub fn counted(count: usize, one: &str, many: &str) -> Option<String> {
    match count {
        0 => None,
        1 => Some(format!("1 {one}")),
        _ => Some(format!("{count} {many}")),
    }
}

/// An error and its causes as one sentence. What a cause says that has been said already is not said again.
pub fn sentence(error: &anyhow::Error) -> String {
    let mut text = String::new();
    for cause in error.chain().map(ToString::to_string) {
        if !text.contains(cause.trim()) {
            text += if text.is_empty() { "" } else { ": " };
            text += cause.trim();
        }
    }
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    cut(&lines.collect::<Vec<_>>().join(" "), WHOLE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::anyhow;

    #[test]
    fn names_keep_to_their_line_and_length() {
        assert_eq!(shortened("Bob's \"äpfel\""), "Bob's \"äpfel\"");
        assert_eq!(shortened("a\nb\u{1b}[31m\u{202e}"), "a\\nb\\u{1b}[31m\\u{202e}");
        assert_eq!(shortened(&"x".repeat(1 << 20)).chars().count(), SHOWN + 1);
        assert!(shortened(&"\u{1b}".repeat(1000)).chars().count() <= SHOWN + 1);
        let many = vec!["name"; 1000];
        assert!(list(many).ends_with("name and 980 more"));
        assert_eq!(list(["a", "b"]), "a, b");
    }

    #[test]
    fn a_cause_is_told_once() {
        let full = || std::io::Error::from_raw_os_error(28);
        let error = anyhow!(full()).context(format!("writing failed ({})", full())).context("x.png cannot be written");
        let told = sentence(&error);
        assert_eq!(told.matches("os error 28").count(), 1, "{told}");
        assert_eq!(sentence(&anyhow!("a\n  b")), "a b");
        assert!(sentence(&anyhow!("y".repeat(1 << 20))).chars().count() < 3000);
    }
}

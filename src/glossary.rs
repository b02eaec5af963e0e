//! The field's words, each with what it means in a sentence or three.

use anyhow::Result;
use serde::Deserialize;
use std::fmt::Write;
use std::sync::OnceLock;

/// A word of the field.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Term {
    pub term: String,
    /// Other words for it.
    #[serde(default)]
    pub also: Vec<String>,
    pub text: String,
    /// Pages of the docs to read on, counted from docs/.
    #[serde(default)]
    pub read: Vec<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    terms: Vec<Term>,
}

/// Reads a glossary.
///
/// # Errors
/// What is not understood.
pub fn read(text: &str) -> Result<Vec<Term>> {
    let mut terms = toml::from_str::<File>(text)?.terms;
    terms.sort_by_key(|t| t.term.to_lowercase());
    Ok(terms)
}

/// All terms, by the alphabet.
pub fn all() -> &'static [Term] {
    static ALL: OnceLock<Vec<Term>> = OnceLock::new();
    // What is embedded is held by a test.
    ALL.get_or_init(|| read(include_str!("../assets/glossary.toml")).unwrap_or_default())
}

/// All words for all terms, the longest first.
fn words() -> &'static [(String, &'static Term)] {
    static WORDS: OnceLock<Vec<(String, &'static Term)>> = OnceLock::new();
    WORDS.get_or_init(|| {
        let names = |t: &'static Term| std::iter::once(&t.term).chain(&t.also).map(move |w| (w.to_lowercase(), t));
        let mut words: Vec<(String, &'static Term)> = all().iter().flat_map(names).collect();
        words.sort_by_key(|(word, _)| std::cmp::Reverse(word.len()));
        words
    })
}

/// The term that is called so, in capitals or small letters.
pub fn find(word: &str) -> Option<&'static Term> {
    let word = word.trim().to_lowercase();
    words().iter().find(|(w, _)| *w == word).map(|(_, term)| *term)
}

/// A part of a text.
#[derive(Clone, Debug, PartialEq)]
pub enum Piece<'a> {
    Text(&'a str),
    /// Between backticks.
    Code(&'a str),
    /// A word of the glossary.
    Term(&'a str, &'static str),
}

/// Cuts a text where it uses a word of the glossary: each term's first place alone, none inside backticks.
pub fn pieces(text: &str) -> Vec<Piece<'_>> {
    let mut out = Vec::new();
    let mut seen: Vec<&str> = Vec::new();
    for (i, part) in text.split('`').enumerate() {
        if i % 2 == 1 {
            out.push(Piece::Code(part));
            continue;
        }
        let (mut start, mut at) = (0, 0);
        while at < part.len() {
            let found = word_at(part, at).filter(|(_, term)| !seen.contains(&term.term.as_str()));
            if let Some((length, term)) = found {
                if at > start {
                    out.push(Piece::Text(&part[start..at]));
                }
                out.push(Piece::Term(&part[at..at + length], &term.term));
                seen.push(&term.term);
                (start, at) = (at + length, at + length);
            } else {
                // On to where the next word begins.
                let rest = &part[at..];
                let word = rest.find(|c: char| !c.is_alphanumeric()).unwrap_or(rest.len());
                let gap = rest[word..].find(char::is_alphanumeric).unwrap_or(rest.len() - word);
                at += (word + gap).max(1);
            }
        }
        if start < part.len() {
            out.push(Piece::Text(&part[start..]));
        }
    }
    out
}

/// The longest word of the glossary that a text uses at a place, with its length there; a plural is the word too.
fn word_at(text: &str, at: usize) -> Option<(usize, &'static Term)> {
    let rest = &text[at..];
    let ends = |length: usize| !rest[length..].starts_with(char::is_alphanumeric);
    words().iter().find_map(|(word, term)| {
        let here = rest.get(..word.len()).filter(|here| here.to_lowercase() == *word)?.len();
        let plurals = ["", "s", "es"].into_iter().filter(|s| rest[here..].starts_with(s));
        let length = plurals.map(|s| here + s.len()).find(|length| ends(*length))?;
        Some((length, *term))
    })
}

/// Where a term stands on the page.
fn anchor(term: &str) -> String {
    let kept = term.to_lowercase().chars().filter(|c| c.is_alphanumeric() || " -".contains(*c)).collect::<String>();
    kept.replace(' ', "-")
}

/// A text in Markdown, whose terms lead to the glossary's page.
pub fn linked(text: &str, page: &str) -> String {
    let one = |piece| match piece {
        Piece::Text(text) => text.to_string(),
        Piece::Code(code) => format!("`{code}`"),
        Piece::Term(word, term) => format!("[{word}]({page}#{})", anchor(term)),
    };
    pieces(text).into_iter().map(one).collect()
}

/// The page of the docs.
pub fn page() -> String {
    let mut out = String::from(
        "# Glossary\n\nThe words that the window, the lessons and these pages use. In the window they stand behind F1 and in tooltips. This page is what\n`shadowscope glossary` prints.\n",
    );
    for t in all() {
        let _ = write!(out, "\n## {}\n\n", t.term);
        if !t.also.is_empty() {
            let _ = write!(out, "*Also: {}.*\n\n", t.also.join(", "));
        }
        let _ = writeln!(out, "{}", t.text.trim());
        if !t.read.is_empty() {
            let links: Vec<String> = t.read.iter().map(|page| format!("[{page}]({page})")).collect();
            let _ = writeln!(out, "\nRead on: {}.", links.join(", "));
        }
    }
    out
}

/// Whether a term is among those searched for.
pub fn matches(term: &Term, wanted: &str) -> bool {
    let wanted = wanted.trim().to_lowercase();
    let text = format!("{} {} {}", term.term, term.also.join(" "), term.text).to_lowercase();
    wanted.split_whitespace().all(|word| text.contains(word))
}

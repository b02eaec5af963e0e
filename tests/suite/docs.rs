//! The docs as a book: every page in it, every link leads somewhere, every command does what it says it does.

use crate::common::{ok, shadowscope};
use pulldown_cmark::{CodeBlockKind, Event, Options, Parser, Tag, TagEnd};
use shadowscope::techniques;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};
use std::sync::LazyLock;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// A page as its readers have it.
struct Page {
    text: String,
    /// Where its links and pictures lead, as written.
    links: Vec<String>,
    pictures: Vec<String>,
    /// What may stand behind `#`.
    anchors: BTreeSet<String>,
    /// Fenced code: what stands behind the fence, and the lines.
    code: Vec<(String, String)>,
}

/// The pages by their paths from the root, README.md among them.
static PAGES: LazyLock<BTreeMap<String, Page>> = LazyLock::new(|| {
    let mut pages = BTreeMap::from([("README.md".to_string(), page("README.md"))]);
    let mut folders = vec![PathBuf::from("docs")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(root().join(&folder)).unwrap().flatten() {
            let path = folder.join(entry.file_name());
            if entry.path().is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "md") {
                let name = path.to_str().unwrap().to_string();
                pages.insert(name.clone(), page(&name));
            }
        }
    }
    pages
});

fn page(name: &str) -> Page {
    let text = std::fs::read_to_string(root().join(name)).unwrap();
    let mut page = Page { text: text.clone(), links: vec![], pictures: vec![], anchors: BTreeSet::new(), code: vec![] };
    let (mut heading, mut code): (Option<String>, Option<(String, String)>) = (None, None);
    for event in Parser::new_ext(&text, Options::ENABLE_TABLES) {
        match event {
            Event::Start(Tag::Link { dest_url, .. }) => page.links.push(dest_url.to_string()),
            Event::Start(Tag::Image { dest_url, .. }) => page.pictures.push(dest_url.to_string()),
            Event::Start(Tag::Heading { .. }) => heading = Some(String::new()),
            Event::End(TagEnd::Heading(_)) => {
                page.anchors.extend(heading.take().map(|h| slug(&h)));
            }
            Event::Start(Tag::CodeBlock(CodeBlockKind::Fenced(info))) => {
                code = Some((info.to_string(), String::new()));
            }
            Event::End(TagEnd::CodeBlock) => page.code.extend(code.take()),
            Event::Text(t) | Event::Code(t) => {
                if let Some(heading) = &mut heading {
                    *heading += &t;
                }
                if let Some(code) = &mut code {
                    code.1 += &t;
                }
            }
            _ => {}
        }
    }
    page
}

/// A heading as what follows `#` in a link.
fn slug(heading: &str) -> String {
    let kept = |c: &char| c.is_alphanumeric() || [' ', '-', '_'].contains(c);
    heading.to_lowercase().chars().filter(kept).map(|c| if c == ' ' { '-' } else { c }).collect()
}

/// A link's file from the root, as seen from a page.
fn target(from: &str, link: &str) -> String {
    let mut out = PathBuf::from(from);
    out.pop();
    for part in Path::new(link).components() {
        match part {
            Component::ParentDir => assert!(out.pop(), "{from}: {link} leads out"),
            Component::Normal(name) => out.push(name),
            _ => {}
        }
    }
    out.to_str().unwrap().to_string()
}

fn is_web(link: &str) -> bool {
    link.starts_with("https://")
}

#[test]
fn every_link_leads_somewhere() {
    let mut broken = Vec::new();
    for (name, page) in PAGES.iter() {
        for link in page.links.iter().chain(&page.pictures).filter(|l| !is_web(l)) {
            let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
            let file = if file.is_empty() { name.clone() } else { target(name, file) };
            let there = root().join(&file).exists();
            let known = anchor.is_empty() || PAGES.get(&file).is_some_and(|p| p.anchors.contains(anchor));
            if !there || !known {
                broken.push(format!("{name}: {link}"));
            }
        }
    }
    assert!(broken.is_empty(), "{broken:#?}");
}

/// The book's contents name each page once; pictures that no page shows are gone.
#[test]
fn the_book_has_every_page_and_picture() {
    let contents = &PAGES["docs/SUMMARY.md"];
    let mut named: Vec<String> =
        contents.links.iter().filter(|l| !l.is_empty()).map(|l| target("docs/SUMMARY.md", l)).collect();
    named.sort();
    let pages: Vec<String> =
        PAGES.keys().filter(|n| !["README.md", "docs/SUMMARY.md"].contains(&n.as_str())).cloned().collect();
    assert_eq!(named, pages);

    let shown: BTreeSet<String> = PAGES
        .iter()
        .flat_map(|(name, p)| p.pictures.iter().chain(&p.links).filter(|l| !is_web(l)).map(move |l| target(name, l)))
        .collect();
    let mut folders = vec![root().join("docs/images")];
    let mut unseen = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).unwrap().flatten() {
            let name = entry.path().strip_prefix(root()).unwrap().to_str().unwrap().to_string();
            match entry.path().is_dir() {
                true => folders.push(entry.path()),
                false if !shown.contains(&name) => unseen.push(name),
                false => {}
            }
        }
    }
    assert!(unseen.is_empty(), "no page shows {unseen:#?}");
}

/// Each technique has a page, named in the README, with a picture, its parameters, its paper, and where it fails.
#[test]
fn every_technique_has_its_page() {
    let readme = &PAGES["README.md"];
    let mut wrong = Vec::new();
    for info in techniques::ALL.iter() {
        let row = readme.text.lines().find(|l| l.starts_with("| [") && l.contains(&format!("`{}`", info.id)));
        let row = row.unwrap_or_else(|| panic!("README.md has no row for {}", info.id));
        let link = row.split_once("](").unwrap().1.split_once(')').unwrap().0;
        let file = target("README.md", link.split('#').next().unwrap());
        let page = &PAGES[&file];
        let mut need = |there: bool, what: &str| {
            if !there {
                wrong.push(format!("{file}, {}: {what}", info.id));
            }
        };
        let parameters = |l: &String| l.ends_with(&format!("parameters.md#{}", info.id));
        need(page.links.iter().any(parameters), "no link to its parameters");
        need(!page.pictures.is_empty(), "no picture");
        let says = ["**Where it fails", "**Where it is slow", "**Worst case"].iter().any(|s| page.text.contains(s));
        need(says, "does not say where it fails");
        need(page.text.contains("19") || page.text.contains("20"), "no source");
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn the_parameters_page_is_the_commands_output() {
    let dir = tempfile::tempdir().unwrap();
    let out = String::from_utf8(ok(dir.path(), &["list", "parameters"]).stdout).unwrap();
    let page = &PAGES["docs/parameters.md"].text;
    assert!(out == *page, "write it anew: shadowscope list parameters > docs/parameters.md");
    let headings = PAGES["docs/parameters.md"].anchors.len();
    assert!(headings > techniques::ALL.len(), "{headings}");
}

/// The `shadowscope` commands of a block, lines that go on put together; without what they write to standard output.
fn commands(code: &str) -> Vec<Vec<String>> {
    let whole = code.replace("\\\n", " ");
    let lines = whole.lines().map(str::trim).filter(|l| l.starts_with("shadowscope"));
    let typed =
        |l: &str| l.split(" #").next().and_then(|l| l.split(" > ").next()).map(str::to_string).unwrap_or_default();
    lines.map(|l| shlex::split(&typed(l)).unwrap_or_else(|| panic!("{l}"))).collect()
}

/// The same at an eighth of the size, of three frames, and with no more truth than a small picture needs.
fn smaller(mut words: Vec<String>) -> Vec<String> {
    let draws = ["capture", "measure", "table", "sweep", "inspect", "animate"];
    if !draws.contains(&words[1].as_str()) {
        return words;
    }
    let at = |words: &[String], option: &str| words.iter().position(|w| w == option);
    if let Some(i) = at(&words, "--truth-samples") {
        words[i + 1] = "4".into();
    }
    match at(&words, "--size") {
        Some(i) => {
            let side = |s: &str| (s.parse::<u32>().unwrap() / 8).max(32).to_string();
            let (w, h) = words[i + 1].split_once('x').unwrap();
            words[i + 1] = format!("{}x{}", side(w), side(h));
        }
        None => words.extend(["--size".into(), "96x54".into()]),
    }
    if words[1] == "animate" {
        for option in ["--turntable", "--frames"] {
            if let Some(i) = at(&words, option) {
                words.splice(i + 1..i + 1 + usize::from(words[i + 1].parse::<u32>().is_ok()), ["3".to_string()]);
            }
        }
        if at(&words, "--path").is_some() && at(&words, "--frames").is_none() {
            words.extend(["--frames".into(), "3".into()]);
        }
    }
    words
}

/// Every command of the docs runs, small, in the order of its page and among the files that those before it wrote; but for those
/// whose block is marked `not-run`, as they take minutes or files that are the reader's. That these are understood is a test of
/// the command line's own.
#[test]
fn every_command_runs() {
    let mut run = 0;
    let mut failed = Vec::new();
    for (name, page) in PAGES.iter() {
        let dir = tempfile::tempdir().unwrap();
        for (_, code) in page.code.iter().filter(|(info, _)| info == "sh") {
            for words in commands(code) {
                let words = smaller(words);
                let args: Vec<&str> = words[1..].iter().map(String::as_str).collect();
                let out = shadowscope(dir.path(), &args);
                if !out.status.success() {
                    failed.push(format!("{name}: {}: {}", words.join(" "), String::from_utf8_lossy(&out.stderr)));
                }
                run += 1;
            }
        }
    }
    assert!(failed.is_empty(), "{failed:#?}");
    assert!(run > 50, "{run} commands ran");
}

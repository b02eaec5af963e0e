//! `list parameters`: every parameter of every technique, as the page docs/parameters.md has them.

use crate::contact;
use crate::params::{Condition, Group, Spec, Test};
use crate::techniques;

/// The page. A group that several techniques have stands once.
pub fn page() -> String {
    let mut out = String::from(
        "# Parameters\n\nAll that can be set, by technique: on the command line as `--set name=value`, in a set-up under `[params.TECHNIQUE]`, \
         in the window by a slider or a list whose tooltip says the same. What a technique shares with others stands below, once. \
         `shadowscope list parameters` prints this page.\n\n",
    );
    let mut shared: Vec<&Group> = vec![&contact::GROUP];
    for info in techniques::ALL.iter() {
        out += &format!("## {}\n\n{} ({}). {}\n\n", info.id, info.title, info.paper, info.doc);
        let (own, others): (Vec<&Group>, Vec<&Group>) = info.params.iter().partition(|g| home(g) == Some(info.id));
        out += &table(own.iter().flat_map(|g| g.specs.iter().map(|s| (s, g.when.as_ref()))));
        let mut links = Vec::new();
        for group in others.into_iter().chain([&contact::GROUP]) {
            let anchor = home(group).map_or_else(|| title(group).to_lowercase().replace(' ', "-"), String::from);
            let link = format!("[{}](#{anchor})", title(group));
            if !links.contains(&link) {
                links.push(link);
            }
            if home(group).is_none() && !shared.iter().any(|s| s.name == group.name) {
                shared.push(group);
            }
        }
        out += &format!("{}: {}.\n\n", if own.is_empty() { "All shared" } else { "Shared" }, links.join(", "));
    }
    out += "## Shared parameters\n\n";
    shared.sort_by_key(|g| title(g));
    for group in shared {
        out += &format!("### {}\n\n", title(group));
        out += &table(group.specs.iter().map(|s| (s, None)));
    }
    out.truncate(out.trim_end().len());
    out + "\n"
}

/// The technique whose own a group is: the only one that has it, or the filter that it belongs to.
fn home(group: &Group) -> Option<&'static str> {
    let mut owners = techniques::ALL.iter().filter(|i| i.params.iter().any(|g| g.name == group.name));
    match (owners.next(), owners.next()) {
        (Some(info), None) => return Some(info.id),
        (None, _) => return None,
        _ => {}
    }
    let chosen = techniques::FILTERING.iter().find(|g| g.name == group.name)?;
    match chosen.when?.test {
        Test::Among([one]) => Some(one),
        _ => None,
    }
}

/// A group's name as a heading: `CsmConvolutionParams` is Csm convolution parameters.
fn title(group: &Group) -> String {
    let mut out = String::new();
    for c in group.name.trim_end_matches("Params").chars() {
        match c.is_uppercase() && !out.is_empty() {
            true => out.extend([' ', c.to_ascii_lowercase()]),
            false => out.push(c),
        }
    }
    format!("{out} parameters")
}

fn table<'a>(specs: impl Iterator<Item = (&'a Spec, Option<&'a Condition>)>) -> String {
    let mut rows = String::new();
    for (spec, when) in specs {
        let mut doc = spec.doc.trim().replace('|', "\\|");
        let needs: Vec<String> = spec.when.iter().map(|all| list(all.iter().map(told), " and ")).collect();
        let needs = [when.map(told), (!needs.is_empty()).then(|| needs.join(" or "))];
        let needs = list(needs.into_iter().flatten(), " and ");
        if !needs.is_empty() {
            doc += &format!(" *Where {needs}.*");
        }
        rows += &format!("| `{}` | {} | {} | {doc} |\n", spec.name, spec.default(), spec.range());
    }
    if rows.is_empty() { rows } else { format!("| parameter | default | takes | |\n|---|---|---|---|\n{rows}\n") }
}

fn list(of: impl Iterator<Item = String>, between: &str) -> String {
    of.collect::<Vec<_>>().join(between)
}

fn told(condition: &Condition) -> String {
    let name = condition.of;
    match condition.test {
        Test::Flag(value) => format!("`{name} = {value}`"),
        Test::Above(least) => format!("`{name} > {least}`"),
        Test::Among([first @ .., last]) if !first.is_empty() => format!("`{name}` is {} or {last}", first.join(", ")),
        Test::Among(options) => format!("`{name} = {}`", options.concat()),
    }
}

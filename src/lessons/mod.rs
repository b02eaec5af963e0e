//! Lessons: what goes wrong with shadows and what helps, step by step, each told by what is measured on the spot.
//!
//! A lesson is a file ([`read`]); what it says happens is written beside it as [`claim`]s over measured columns, which a test
//! holds. docs/lessons/README.md says how one is written.

pub mod claim;
mod page;
mod walk;

pub use page::page;
pub use walk::{Answer, Measured, answer, walk};

use crate::measure::Column;
use crate::scene::Scene;
use crate::scene::builtin::cases;
use crate::setup::{self, Setup, load_scene};
use crate::{files, message};
use anyhow::{Context, Result, anyhow, bail, ensure};
use claim::{Claim, Quantity, Whose};
use include_dir::{Dir, include_dir};
use serde::Deserialize;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use toml::{Table, Value};

static EMBEDDED: Dir = include_dir!("$CARGO_MANIFEST_DIR/assets/lessons");

/// A lesson.
#[derive(Clone, Debug)]
pub struct Lesson {
    /// Its file's name without the ending.
    pub id: String,
    pub title: String,
    /// What the start screen says under its picture.
    pub see: String,
    /// Its place among the others.
    order: u32,
    pub steps: Vec<Step>,
}

/// One set-up to look at, with what it shows.
#[derive(Clone, Debug)]
pub struct Step {
    pub title: String,
    /// Paragraphs with an empty line between them; code between backticks.
    pub text: String,
    pub scene: Plan,
    /// The drawer's tab that it opens: chart, stability or advice.
    pub drawer: Option<String>,
    pub trial: Option<Trial>,
    pub question: Option<Question>,
    /// What is true of it.
    pub expect: Vec<Claim>,
}

/// Something to change.
#[derive(Clone, Debug)]
pub struct Trial {
    pub text: String,
    /// What to change it with, as [`control`] has it.
    pub control: String,
    /// The set-up after it; None: there is nothing that changes the picture.
    pub scene: Option<Plan>,
}

/// Something to guess before it is measured.
#[derive(Clone, Debug)]
pub struct Question {
    pub ask: String,
    pub measure: Quantity,
    /// Answers to choose from; none: a number is asked for.
    pub choices: Vec<Choice>,
}

impl Question {
    /// What is asked, and what its choices are about.
    fn quantities(&self) -> impl Iterator<Item = &Quantity> {
        std::iter::once(&self.measure).chain(self.of_choices())
    }

    fn of_choices(&self) -> impl Iterator<Item = &Quantity> {
        self.choices.iter().flat_map(|c| &c.holds).flat_map(Claim::quantities)
    }
}

#[derive(Clone, Debug)]
pub struct Choice {
    pub text: String,
    /// It is right where all of these hold.
    pub holds: Vec<Claim>,
}

/// A set-up as files have it, which its scene makes whole.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    table: Table,
    /// Where on its path a stability case stands, 0 to 1.
    at: Option<f32>,
    /// Where paths count from.
    folder: PathBuf,
}

impl Plan {
    /// The scene's name, as set-ups have it.
    pub fn scene(&self) -> String {
        Setup::scene_named(&self.table, &self.folder).unwrap_or_default()
    }

    /// The set-up, in its scene that is there already.
    ///
    /// # Errors
    /// What does not fit it, by name.
    pub fn in_scene(&self, scene: &Scene) -> Result<Setup> {
        let (mut setup, _) = Setup::in_scene(self.table.clone(), &self.scene(), scene)?;
        if let Some(at) = self.at {
            let case = cases::find(&setup.scene).with_context(|| format!("{} has no path to be at", setup.scene))?;
            (case.place)(&mut setup, at);
            setup.complete();
        }
        Ok(setup)
    }

    /// The set-up and its scene.
    pub fn open(&self) -> Result<(Setup, Scene)> {
        let scene = load_scene(&Setup::scene_named(&self.table, &self.folder)?)?;
        Ok((self.in_scene(&scene)?, scene))
    }

    /// Where on its path a stability case stands, 0 to 1.
    pub fn at(&self) -> Option<f32> {
        self.at
    }

    /// The technique of another side of its comparison, from 1.
    pub fn side(&self, i: usize) -> Option<String> {
        let sides = self.table.get("against")?.as_array()?;
        Some(sides.get(i.checked_sub(1)?)?.get("technique")?.as_str()?.into())
    }

    /// With what differs from it. Another scene begins anew.
    fn changed(&self, by: &Table, at: Option<f32>) -> Plan {
        let mut table = if by.contains_key("scene") { Table::new() } else { self.table.clone() };
        // Another kind of light is another light.
        setup::lay_over(&mut table, by, &|_, new| new.contains_key("kind"));
        Plan { table, at: at.or(self.at.filter(|_| !by.contains_key("scene"))), folder: self.folder.clone() }
    }
}

/// Where a control is: what stands before the colon of its name, and behind it.
///
/// # Errors
/// No such place.
pub fn control(name: &str) -> Result<(&str, &str)> {
    let (place, what) = name.split_once(':').unwrap_or((name, ""));
    let places = ["parameter", "technique", "view", "light", "camera", "section", "drawer", "picture"];
    ensure!(
        places.contains(&place) && (place == "picture") == what.is_empty(),
        "control = {} is not allowed; it takes parameter:NAME, technique:ID, view:ID, light:NAME, camera:NAME, section:NAME, drawer:TAB or picture",
        message::quoted(name)
    );
    Ok((place, what))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LessonFile {
    title: String,
    see: String,
    #[serde(default)]
    order: u32,
    steps: Vec<StepFile>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StepFile {
    title: String,
    text: String,
    #[serde(default)]
    setup: Table,
    at: Option<f32>,
    drawer: Option<String>,
    r#try: Option<TryFile>,
    question: Option<QuestionFile>,
    #[serde(default)]
    expect: Vec<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct TryFile {
    text: String,
    control: String,
    #[serde(default)]
    change: Table,
    at: Option<f32>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct QuestionFile {
    ask: String,
    measure: String,
    #[serde(default)]
    choices: Vec<ChoiceFile>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ChoiceFile {
    text: String,
    holds: Vec<String>,
}

/// Most steps of a lesson.
const MOST_STEPS: usize = 20;
/// Most characters of a title or an answer, and of a text.
const MOST_WORDS: [usize; 2] = [500, 5000];
/// Most claims of a list, and answers of a question.
const MOST_LISTED: usize = 50;

/// Refuses texts that no card has room for.
fn check_length(key: &str, text: &str, most: usize) -> Result<()> {
    let count = text.chars().count();
    ensure!(count <= most, "{key} has {count} characters; it takes up to {most}");
    Ok(())
}

/// Reads a lesson; paths in it count from `folder`.
///
/// # Errors
/// One sentence that names the step, the key and what is allowed.
pub fn read(id: &str, text: &str, folder: &Path) -> Result<Lesson> {
    let file: LessonFile = toml::from_str(text).map_err(|e| setup::one_line(&e.to_string()))?;
    ensure!(
        (1..=MOST_STEPS).contains(&file.steps.len()),
        "it has {} steps; a lesson takes 1 to {MOST_STEPS}",
        file.steps.len()
    );
    check_length("title", &file.title, MOST_WORDS[0])?;
    check_length("see", &file.see, MOST_WORDS[0])?;
    let mut before = Plan { table: Table::new(), at: None, folder: folder.into() };
    let mut steps = Vec::new();
    for (i, step) in file.steps.into_iter().enumerate() {
        let step = read_step(step, &before, i > 0).with_context(|| format!("step {}", i + 1))?;
        before = step.scene.clone();
        steps.push(step);
    }
    Ok(Lesson { id: id.into(), title: file.title, see: file.see, order: file.order, steps })
}

fn read_step(file: StepFile, before: &Plan, later: bool) -> Result<Step> {
    check_length("title", &file.title, MOST_WORDS[0])?;
    check_length("text", &file.text, MOST_WORDS[1])?;
    let on_path = |at: Option<f32>| {
        ensure!(
            at.is_none_or(|at| (0.0..=1.0).contains(&at)),
            "at = {} is not allowed; it takes 0 to 1",
            at.unwrap_or(0.0)
        );
        Ok(())
    };
    on_path(file.at)?;
    let scene = before.changed(&file.setup, file.at);
    Setup::scene_named(&scene.table, &scene.folder)?;
    if let Some(tab) = &file.drawer {
        let tabs = ["chart", "stability", "advice"];
        ensure!(tabs.contains(&tab.as_str()), "drawer = {tab} is not allowed; it takes {}", tabs.join(", "));
    }
    let trial = file.r#try.map(|file| {
        check_length("text", &file.text, MOST_WORDS[1])?;
        on_path(file.at)?;
        control(&file.control)?;
        let changes = !file.change.is_empty() || file.at.is_some();
        let changed = changes.then(|| scene.changed(&file.change, file.at));
        changed.as_ref().map_or(Ok(()), |plan| Setup::scene_named(&plan.table, &plan.folder).map(drop))?;
        anyhow::Ok(Trial { text: file.text, control: file.control, scene: changed })
    });
    let trial = trial.transpose().context("try")?;
    let tried = trial.as_ref().is_some_and(|t| t.scene.is_some());
    let sides = scene.table.get("against").and_then(Value::as_array).map_or(0, Vec::len);
    let known = |quantity: &Quantity| match quantity.whose {
        Whose::Tried if !tried => bail!("{quantity}: this step has nothing to try that changes the picture"),
        Whose::Before if !later => bail!("{quantity}: no step stands before the first"),
        Whose::Side(i) if i > sides => bail!("{quantity}: the comparison has {} sides", sides + 1),
        _ => Ok(()),
    };
    let claims = |texts: &[String]| -> Result<Vec<Claim>> {
        ensure!(texts.len() <= MOST_LISTED, "there are {} claims; a list takes up to {MOST_LISTED}", texts.len());
        let one = |text: &String| {
            let claim = Claim::parse(text)?;
            claim.quantities().try_for_each(known)?;
            let timed = claim.quantities().any(|q| q.column.is_time() || q.column.is_multiple());
            ensure!(!timed, "{text}: times differ from machine to machine, and nothing can be claimed of them");
            Ok(claim)
        };
        texts.iter().map(one).collect()
    };
    let question = file.question.map(|file| {
        check_length("ask", &file.ask, MOST_WORDS[1])?;
        let count = file.choices.len();
        ensure!(count <= MOST_LISTED, "there are {count} choices; a question takes up to {MOST_LISTED}");
        file.choices.iter().try_for_each(|choice| check_length("the text of a choice", &choice.text, MOST_WORDS[0]))?;
        let measure = Quantity::parse(&file.measure)?;
        known(&measure)?;
        let choices = file.choices.into_iter().map(|c| anyhow::Ok(Choice { holds: claims(&c.holds)?, text: c.text }));
        let choices: Vec<Choice> = choices.collect::<Result<_>>()?;
        ensure!(choices.len() != 1, "a choice of one is none; give two or more");
        anyhow::Ok(Question { ask: file.ask, measure, choices })
    });
    Ok(Step {
        title: file.title,
        text: file.text.trim().into(),
        drawer: file.drawer,
        question: question.transpose().context("question")?,
        expect: claims(&file.expect).context("expect")?,
        scene,
        trial,
    })
}

impl Step {
    /// The set-ups that can be measured of it: as it is, after what there is to try, that of the step before, and the other sides of
    /// its comparison.
    pub fn plan(&self, whose: Whose, before: Option<&Step>) -> Option<Plan> {
        match whose {
            Whose::Here => Some(self.scene.clone()),
            Whose::Tried => self.trial.as_ref()?.scene.clone(),
            Whose::Before => Some(before?.scene.clone()),
            Whose::Side(_) => Some(self.scene.clone()),
        }
    }

    /// What its question and its claims are about, what is asked first.
    fn quantities(&self) -> impl Iterator<Item = &Quantity> {
        let asked = self.question.iter().map(|q| &q.measure);
        let claimed = self.expect.iter().flat_map(Claim::quantities);
        asked.chain(claimed).chain(self.question.iter().flat_map(Question::of_choices))
    }

    /// The columns of quantities of it, each once; and whose set-ups they are of, beside it itself and what there is to try.
    fn asked<'a>(&self, quantities: impl Iterator<Item = &'a Quantity>) -> (Vec<&'static Column>, Vec<Whose>) {
        let mut columns: Vec<&'static Column> = Vec::new();
        let mut sides = vec![Whose::Here];
        sides.extend(self.trial.as_ref().and_then(|t| t.scene.as_ref()).map(|_| Whose::Tried));
        for quantity in quantities {
            if !columns.iter().any(|c| c.id == quantity.column.id) {
                columns.push(quantity.column);
            }
            sides.push(quantity.whose);
        }
        sides.sort_unstable();
        sides.dedup();
        (columns, sides)
    }
}

static ALL: OnceLock<Vec<Lesson>> = OnceLock::new();

/// All lessons in their order: those of the folder that was chosen, or those that come with the program.
pub fn all() -> &'static [Lesson] {
    // The embedded ones are held by a test.
    ALL.get_or_init(|| embedded().unwrap_or_default())
}

/// A lesson by its id.
///
/// # Errors
/// No lesson of that name.
pub fn find(id: &str) -> Result<&'static Lesson> {
    all().iter().find(|l| l.id == id).with_context(|| {
        let ids = message::list(all().iter().map(|l| l.id.as_str()));
        format!("{}: there is no such lesson; there are {ids}", message::shortened(id))
    })
}

/// Those that come with the program.
///
/// # Errors
/// As [`read`].
pub fn embedded() -> Result<Vec<Lesson>> {
    let mut lessons = Vec::new();
    for file in EMBEDDED.files() {
        let id = file.path().file_stem().unwrap_or_default().to_string_lossy();
        let text = file.contents_utf8().with_context(|| format!("lesson {id} is no text"))?;
        lessons.push(read(&id, text, Path::new("")).with_context(|| format!("lesson {id}"))?);
    }
    Ok(sorted(lessons))
}

/// Those of a folder, a file each.
///
/// # Errors
/// As [`read`], with the file's name; or a folder without any.
pub fn of_folder(folder: &Path) -> Result<Vec<Lesson>> {
    let told = folder.display();
    let reason = |e: std::io::Error| anyhow!("the lessons in {told} cannot be read: {}", files::reason(&e));
    let entries = std::fs::read_dir(folder).map_err(reason)?;
    let mut lessons = Vec::new();
    for entry in entries {
        let path = entry.map_err(reason)?.path();
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
            let id = files::name_of(path.file_stem().unwrap_or_default());
            let text = files::read_text(&path)?;
            let lesson = read(&id, &text, folder).with_context(|| format!("{} is no usable lesson", path.display()))?;
            lessons.push(lesson);
        }
    }
    ensure!(!lessons.is_empty(), "{told} holds no lessons; they are files that end in .toml");
    Ok(sorted(lessons))
}

/// Takes the lessons of a folder in place of those that come with the program, before any is asked for.
///
/// # Errors
/// As [`of_folder`].
pub fn take_folder(folder: &Path) -> Result<()> {
    let lessons = of_folder(folder)?;
    ALL.set(lessons).map_err(|_| anyhow!("lessons are in use already"))
}

fn sorted(mut lessons: Vec<Lesson>) -> Vec<Lesson> {
    lessons.sort_by(|a, b| (a.order, &a.id).cmp(&(b.order, &b.id)));
    lessons
}

//! Published tables and figures measured again: ours beside theirs, as Markdown with pictures.

mod axis;
mod azri;
mod cascades;
mod chong;
mod conservative;
mod kenzel;
mod lamps;
mod morais;
mod navratil;
mod paraboloids;
mod pcf;
mod planes;
mod trapezoid;
mod trees;
mod wandering;
mod warped_lamps;

use crate::capture;
use crate::chart::{self, Lines};
use crate::files;
use crate::frame::Renderer;
use crate::gpu::Gpu;
use crate::scene::builtin;
use crate::setup::{Arrange, Setup};
use anyhow::{Context, Result, ensure};
use std::path::Path;
use std::sync::Arc;

/// A published table or figure that can be measured again.
pub struct Reproduction {
    /// Name on the command line.
    pub id: &'static str,
    /// Author, year, number and what it shows.
    pub title: &'static str,
    /// Measures it and writes ours beside theirs, as Markdown.
    run: fn(&mut Bench) -> Result<String>,
    /// Where ours differs and why, a sentence or more.
    deviation: &'static str,
}

/// What is told while reproductions are measured.
pub enum Step<'a> {
    /// Share done, 0 to 1, and which is at work.
    Working(f32, &'a str),
    /// What stands at the head of the document.
    Head(String),
    /// One of them, complete.
    Measured(String),
}

/// All of them, in the order of the document.
pub static ALL: &[Reproduction] = &[
    Reproduction {
        id: "morais-4",
        title: "Morais 2015, table 4: pixel states of Side-Trees, ray traced",
        run: |b| morais::pixel_states(b, 0),
        deviation: "The models are ours, built to the thesis' cameras, light and triangle count, so that shares agree in \
                    size, not pixel by pixel; at 16:9 ours is 3.5 points brighter. (The thesis prints 63.38 / 36.62 at \
                    1920 × 1080; its own counts give 63.68 / 36.32, used here.)",
    },
    Reproduction {
        id: "morais-5",
        title: "Morais 2015, table 5: pixel states of Against-Flowers, ray traced",
        run: |b| morais::pixel_states(b, 1),
        deviation: "All shares lie within 1.5 points of his; our flower box and trees are other models than his.",
    },
    Reproduction {
        id: "morais-6",
        title: "Morais 2015, table 6: pixel states of Against-Bench, ray traced",
        run: |b| morais::pixel_states(b, 2),
        deviation: "With our models one pixel in a hundred more turns away from the light; shares lie within 2.1 points of \
                    his.",
    },
    Reproduction {
        id: "morais-7",
        title: "Morais 2015, table 7: wrong pixels of the standard shadow map, Side-Trees at 1920 × 1080",
        run: |b| morais::shadow_map(b, 0),
        deviation: FIT,
    },
    Reproduction {
        id: "morais-8",
        title: "Morais 2015, table 8: wrong pixels of the standard shadow map, Against-Flowers at 1920 × 1080",
        run: |b| morais::shadow_map(b, 1),
        deviation: "Ours is smaller, as in table 7, and by more, since ours nearly halves with each doubling while his falls \
                    more slowly here than in his other two cases; the thesis gives no reason for that.",
    },
    Reproduction {
        id: "morais-9",
        title: "Morais 2015, table 9: wrong pixels of the standard shadow map, Against-Bench at 1920 × 1080",
        run: |b| morais::shadow_map(b, 2),
        deviation: "Ours is smaller, as in table 7, for the same reasons.",
    },
    Reproduction {
        id: "morais-10-22",
        title: "Morais 2015, tables 10, 13, 16, 19 and 22: conservative maps of Side-Trees at 1920 × 1080",
        run: |b| conservative::certainty(b, 0),
        deviation: CERTAINTY,
    },
    Reproduction {
        id: "morais-11-23",
        title: "Morais 2015, tables 11, 14, 17, 20 and 23: conservative maps of Against-Flowers at 1920 × 1080",
        run: |b| conservative::certainty(b, 1),
        deviation: CERTAINTY,
    },
    Reproduction {
        id: "morais-12-24",
        title: "Morais 2015, tables 12, 15, 18, 21 and 24: conservative maps of Against-Bench at 1920 × 1080",
        run: |b| conservative::certainty(b, 2),
        deviation: CERTAINTY,
    },
    Reproduction {
        id: "morais-25-30",
        title: "Morais 2015, tables 25 to 30: times of maps and of rays at 1920 × 1080",
        run: conservative::times,
        deviation: "Milliseconds of his graphics card and of a software adapter have nothing in common; ratios within one run are \
                    compared. On a software adapter a map of 4096² costs as much as many rays, as each texel is cleared and \
                    drawn by the processor.",
    },
    Reproduction {
        id: "morais-11-15",
        title: "Morais 2015, figures 11 to 15: the trapezoid around Side-Trees' view",
        run: trapezoid::run,
        deviation: "The thesis gives drawings without numbers; \"naive\" is our reading of its figure 15 (a): the trapezoid of \
                    least area between the same two lines. What the figure warns of shows where the view is long and the \
                    light stands across it, as over the floor: the naive trapezoid gives nearly all of the map to the part \
                    in focus. Seen aslant, as in Side-Trees, it gives that part less than the rule does.",
    },
    Reproduction {
        id: "kenzel-1.5-1.6",
        title: "Kenzel 2013, figures 1.5 and 1.6, and Navratil 2015, figure 2.16: acne and peter-panning",
        run: kenzel::bias,
        deviation: "Both theses show pictures without numbers, of other scenes than ours; Navratil's drawing of the \
                    cause (2.16, left) is not drawn again. With 24 bits of depth or more it is the cause that \
                    Navratil names, a texel's one depth for all that it covers, and not precision, as Kenzel has it: \
                    the acne of 16 bits is the same. With 16 bits of hyperbolic depth precision makes acne too, \
                    which a slope bias alone does not cure. The rasteriser's slope bias, which Kenzel means, \
                    detaches more than the best constant; but that is another one in each scene ([biases \
                    compared](bias.md)).",
    },
    Reproduction {
        id: "kenzel-1.7",
        title: "Kenzel 2013, figure 1.7: a shadow map's stairs beside exact edges",
        run: kenzel::stairs,
        deviation: "He shows two pictures without numbers, the exact one drawn with shadow volumes; ours is ray \
                    traced, which shadow volumes agree with but for ties. From 512² to 4096² m falls to an eighth, the wrong pixels at \
                    edges to a fifth, the contour's distance to a half only.",
    },
    Reproduction {
        id: "kenzel-5.5",
        title: "Kenzel 2013, figure 5.5: percentage-closer filtering and edge distances in a map that is far too coarse",
        run: kenzel::coarse,
        deviation: "He shows pictures without numbers. In the coarsest map the \
                    wide filter errs more than one comparison, since it blurs the shadows away. Where texels are \
                    smaller than pixels the narrow one has less than a pixel to average, and nears the error of a \
                    single ray.",
    },
    Reproduction {
        id: "kenzel-5.2-5.4",
        title: "Kenzel 2013, figures 5.2 to 5.4: time, primitives and fragments of methods that know the silhouette",
        run: kenzel::cost,
        deviation: "His figures are bar charts without numbers. He finds silhouettes in a geometry shader, which sees every \
                    triangle of the scene a second time; ours are listed by a compute pass once a frame and drawn by two \
                    triangles each, so that primitives grow by what the silhouette has. On a software adapter the quads' \
                    fragments, each with nine reads of the map, weigh more than on his card.",
    },
    Reproduction {
        id: "kenzel-artefacts",
        title: "Kenzel 2013, figures 3.6, 3.7 and 5.6 to 5.8: what goes wrong with edge distances",
        run: kenzel::artefacts,
        deviation: "He shows pictures without numbers, of other scenes than ours, and proposes two of the remedies without \
                    building them: quads after the projection, and a test for each edge by itself.",
    },
    Reproduction {
        id: "navratil-2.17",
        title: "Navratil 2015, figure 2.17, and Azri 2020, figure 2.12: 1, 4, 9 and 16 samples of percentage-closer filtering",
        run: pcf::samples,
        deviation: "Neither thesis gives numbers. Filters of 2 × 2 and 4 × 4 single texels are not there; disks take \
                    their places. So coarse a map is blurred over many pixels, which errs more than one comparison; \
                    where texels are smaller than pixels the filter errs less (figure 5.5 of Kenzel).",
    },
    Reproduction {
        id: "azri-2.13",
        title: "Azri 2020, figure 2.13: averaged depths beside averaged comparisons",
        run: pcf::order,
        deviation: "Her text does not give the nine depths of the figure. By her own rule a texel \
                    of smaller depth casts a shadow: 73 is more than 54, so that her result 1 is full light and her \
                    44 % are lit, where her text says in shadow. Ours are shares of light.",
    },
    Reproduction {
        id: "azri-3.1",
        title: "Azri 2020, table 3.1 and figures 3.9 to 3.14: cascaded soft shadow maps beside uniform samples",
        run: azri::table,
        deviation: "Her models are not given; ours are trefoil knots in the cubes' places, of as many triangles. Her errors are those of shaded pictures against pictures of 36, 81 or 256 samples whose maps are all of 1024². Without cascades such maps have texels of centimetres here, and lie farther from the rays than cascades do: most of what parts the two is wrong in the reference. Against as many samples as that, in cascades with maps of the same sizes, stands what fewer samples get wrong. Times on a software adapter are ratios of drawing and looking up maps by the processor.",
    },
    Reproduction {
        id: "navratil-3.5",
        title: "Navratil 2015, figures 3.4 to 3.6: lights after the camera's perspective",
        run: navratil::post_perspective,
        deviation: "His figures are drawings.",
    },
    Reproduction {
        id: "navratil-3.7",
        title: "Navratil 2015, figure 3.7, and Morais 2015, figure 18: aliasing error of split schemes",
        run: axis::splits,
        deviation: "Both figures are drawings without numbers. Their claims hold: the logarithmic scheme (λ = 1) has the \
                    same worst error in each part, the even one (λ = 0) has the largest of all next to the camera.",
    },
    Reproduction {
        id: "navratil-3.8",
        title: "Navratil 2015, figure 3.8: cascades fitted with and without a look at the scene",
        run: cascades::fits,
        deviation: "He shows two drawings. The table of the blocks casts and receives all over each part, so that \
                    next to nothing can be cut away there. Independent maps clamp casters before them to their near \
                    plane, dependent ones reach back to them; neither loses one.",
    },
    Reproduction {
        id: "navratil-3.9",
        title: "Navratil 2015, figure 3.9: the seam between two cascades",
        run: cascades::seam,
        deviation: "He shows a picture without numbers. A filter of as many texels in either map makes the step smaller, but the \
                    edge changes its width there instead. One width in metres does better, the wider the more; its greys \
                    differ by less, over more pixels than the stairs did. To blend the cascades is another way \
                    ([`pssm`](techniques/pssm.md)).",
    },
    Reproduction {
        id: "navratil-3.1-3.2",
        title: "Navratil 2015, tables 3.1 and 3.2: cube and dual-paraboloid maps, unoptimised and culled",
        run: lamps::rates,
        deviation: "His scenes are not given; ours are halls of balls with as many vertices, seen along an aisle, with the light once behind the camera and once in its view. He culls whole objects on the CPU; we cull boxes of 64 triangles on the GPU, and the triangles of those that are left. On a software adapter culling takes back about half of what it saves, and the G-buffer, which draws all triangles, takes as long as six maps: what is gained is smaller than his, in the same order.",
    },
    Reproduction {
        id: "navratil-3.16-3.18",
        title: "Navratil 2015, figures 3.16 to 3.19: a light wanders in and out of view",
        run: wandering::walk,
        deviation: "He walks through a scene that he does not name, with the light still, and draws times without numbers; in our hall and arches the camera stands still and the light goes round. On a software adapter about half of the time of our maps goes into culling, however few of them are drawn. Where he says that a cube of one or two faces is as quick as paraboloids, ours takes longer to draw.",
    },
    Reproduction {
        id: "psv-crossing",
        title: "Gerhards et al. 2015, Mora et al. 2016: a tree of shadow volumes beside rays, over the number of triangles",
        run: trees::crossing,
        deviation: "Their figures are of GPUs of their time, without a hierarchy of boxes beside the tree; ours are of the adapter \
                    named above. Ours builds the tree on the CPU, with the shader's own ray test at its leaves, and \
                    visits both sides of a plane where rounding leaves the side open.",
    },
    Reproduction {
        id: "navratil-3.20",
        title: "Navratil 2015, figure 3.20: the quality of cubes and paraboloids over resolutions",
        run: paraboloids::resolutions,
        deviation: "He shows pictures without numbers, of a scene that he does not name. With corners moved a part of the error stays at any resolution, as the large triangles of walls and table tops bend; met exactly they do not, and paraboloids stay behind the cube by a factor that hardly changes: one side has to serve three times as many directions as a face.",
    },
    Reproduction {
        id: "navratil-3.21",
        title: "Navratil 2015, figure 3.21: times of maps where all lies on one side of the light",
        run: paraboloids::one_side,
        deviation: "He draws points, 100 thousand and 3 million, and shows charts without numbers; ours are triangles. Unculled, a cube draws three times as many of them as two paraboloids, but those outside a face's pyramid fall away before they are rastered; culled, it looks at each of them for six maps and not for two. With few of them what does not depend on their number weighs most.",
    },
    Reproduction {
        id: "navratil-4.1",
        title: "Navratil 2015, figure 4.1: a paraboloid magnified to what is seen",
        run: paraboloids::improved,
        deviation: "He shows two pictures without numbers.",
    },
    Reproduction {
        id: "navratil-4.4-4.6",
        title: "Navratil 2015, figures 4.4 to 4.6: the skewed cut of a paraboloid",
        run: paraboloids::skewed,
        deviation: "He draws curves and grids without numbers.",
    },
    Reproduction {
        id: "wimmer-n",
        title: "Wimmer 2004, Scherzer 2005: the free parameter n of light space perspective",
        run: axis::free_parameter,
        deviation: "The claim holds: n_opt has the smallest maximum, with equal errors at both ends.",
    },
    Reproduction {
        id: "navratil-4.11-4.12",
        title: "Navratil 2015, figures 4.11 and 4.12: view samples before, between and after the warps of NoTW",
        run: navratil::steps,
        deviation: "He shows pictures without numbers.",
    },
    Reproduction {
        id: "navratil-5.2-5.4",
        title: "Navratil 2015, figures 5.2 to 5.4: wrong pixels of the warping techniques",
        run: navratil::quality,
        deviation: "He shows red pixels and counts none. Of his figure 5.4 our arches stand in for Sponza and our hall for \
                    the conference room; bench and terrain are ours beside them. His truth are shadow volumes, \
                    ours is ray traced; the row SV tells how far they are apart.",
    },
    Reproduction {
        id: "navratil-5.1",
        title: "Navratil 2015, table 5.1: times of the techniques' own passes",
        run: navratil::own_times,
        deviation: "Our hall and arches stand in for his conference room and Sponza, with as many triangles. Our row SV \
                    tests its depth exactly, in a fragment shader. His NoTW takes 1.07 to 1.16 times as long as his RTW, ours \
                    much longer: he moves the corners of subdivided triangles, which costs both the same; ours meets casters \
                    with a ray for each texel that is looked up, and NoTW spreads the same view samples over several times \
                    as many texels (see figure 5.11 for the observatory). That step is the largest of NoTW's (see figure \
                    5.6). Ratios to SM are smaller than his as our SM, on a software adapter, spends most of its time in a \
                    look-up that all methods share.",
    },
    Reproduction {
        id: "navratil-5.3",
        title: "Navratil 2015, table 5.3: frame times",
        run: navratil::frame_times,
        deviation: "His scene for this table is not named; ours is the observatory. Our row SV tests its depth exactly, \
                    in a fragment shader. NoTW is dearer than his for the reason given at table 5.1. NoTW-DV is \
                    cheaper: to a plain map it adds one reduction over the picture, and his text does not say what else his \
                    took 0.9 ms for.",
    },
    Reproduction {
        id: "navratil-5.6",
        title: "Navratil 2015, figure 5.6: shares of the passes",
        run: navratil::shares,
        deviation: "His figure is a chart without numbers; the text gives 15 % of NoTW's time for the DV crop. Ours, the \
                    passes \"fit\", takes a few per cent: the reduction is as short as beside a plain map, but the rest of \
                    NoTW, the exact raster above all, takes far longer than his. His charts show three scenes; hall and arches \
                    stand in for two of them.",
    },
    Reproduction {
        id: "navratil-5.7-5.9",
        title: "Navratil 2015, table 5.2 and figures 5.7 to 5.9: cubes and paraboloids with warps",
        run: warped_lamps::warped,
        deviation: "He names neither his scene nor the side of his maps. His row SV (4.8 ms, at worst 16) is missing in this walk. On a software adapter warping costs more than his: view samples are counted, summed up and smoothed in storage buffers, which such an adapter reads one lane at a time, and the look-up reads its offsets there too. Corners alone go astray in warps where triangles are as large as in our hall; his way needs finer meshes than ours.",
    },
    Reproduction {
        id: "navratil-5.10",
        title: "Navratil 2015, figure 5.10: crops beside warps",
        run: navratil::crops,
        deviation: "He shows pictures without numbers, of a scene that he does not name.",
    },
    Reproduction {
        id: "navratil-5.11",
        title: "Navratil 2015, figure 5.11: the shadow maps of four approaches",
        run: navratil::maps,
        deviation: "He shows pictures without numbers.",
    },
    Reproduction {
        id: "navratil-5.12",
        title: "Navratil 2015, figure 5.12: the malformed grid of finite elements",
        run: navratil::grids,
        deviation: "He shows one grid, of a scene that he does not name, and no picture of its shadow; ours is of the \
                    bench. He gives no stiffness matrix; ours are springs between nodes whose rest lengths follow the error. The \
                    grid of least energy, which he left open, is ours.",
    },
    Reproduction {
        id: "chong-4.1",
        title: "Chong 2003, chapter 4: films of the light in flatland",
        run: chong::run,
        deviation: "He printed no coordinates: the scenes were found by search so that his rows for his own method and the \
                    common map come out, and angles need not agree. His rows for the perspective map follow from his \
                    reading of it. Our films are exact: in the parameter that turns them each metric is a sum of exponentials and so \
                    has one minimum, where he looks among eight critical points and restarts Newton's method.",
    },
    Reproduction {
        id: "chong-4.2",
        title: "Chong 2003, section 4.2.1: the light's film plane in three dimensions",
        run: planes::run,
        deviation: "He left three dimensions open, so that there is nothing of his to hold ours against; the plane is chosen by his \
                    L1 metric as the mean longest extent of a texel, or by the geometric stretch that he suggests. Texels of the \
                    shadow map and of psm and lispsm lie on planes too: psm's is that of a perspective seen from the camera, the \
                    shadow map's stands across the lamp's axis.",
    },
];

const FIT: &str = "Ours is smaller: our map is fitted to the receivers that the camera sees and biased by the receiver's \
                   slope; his light frustum is fitted to the objects seen, and his bias is not given. Unfitted, the same \
                   map makes several times the errors of either.";

const CERTAINTY: &str = "His depths are those at texels' middles, so that certain answers are wrong in a few pixels; ours are conservative and \
                         none is. Lit surfaces of bodies that are not closed ask rays in ours (leaves, petals); his maps leave out \
                         what faces the light. How much adjacency takes away depends on the models: a leaf of our trees is two \
                         triangles, with one shared edge to four that stay outlines, so that there the factor is near 1.7 with any map. \
                         Plain shrinking leaves less uncertain in ours, as it cuts no corner that need not be cut and lets both \
                         sides cast. His counts of uncertain pixels that end lit differ from the wrong pixels of his \
                         grown map, to which they should be equal; ours are.";

/// Measures reproductions (all, if none is named) and joins them into a document. `folder`: where their pictures are
/// written, which the document then shows. `tick` is given the document part by part, told the share done and which is at work, and
/// stops the work between two of them by an error.
///
/// # Errors
/// An unknown name, or what the device or the file system reports.
pub fn run(
    gpu: Arc<Gpu>,
    ids: &[String],
    folder: Option<&Path>,
    tick: &mut dyn FnMut(Step) -> Result<()>,
) -> Result<()> {
    check(ids)?;
    let wanted: Vec<&Reproduction> = ALL.iter().filter(|r| ids.is_empty() || ids.iter().any(|i| i == r.id)).collect();
    let info = &gpu.info;
    let head = format!(
        "# Reproductions\n\n\
         Published tables and figures measured again, ours beside theirs: `shadowscope reproduce [ID…] [-o FOLDER]` writes\n\
         this page, and its pictures into the folder.\n\
         Measured on {}, {}. Counts do not depend on speed, but rasterisers round differently:\n\
         another adapter may move a few pixels.\n\n\
         Morais 2015 gives wrong pixels as shares of those that the technique calls lit and of those it calls shadowed;\n\
         \"all wrong\" is their share of the pixels that face the light.\n",
        info.name, info.driver_info
    );
    let parts = wanted.len();
    let mut bench = Bench { gpu, open: None, folder, part: (0, parts, ""), tick };
    (bench.tick)(Step::Head(head))?;
    for (i, r) in wanted.iter().enumerate() {
        bench.part = (i, parts, r.id);
        (bench.tick)(Step::Working(i as f32 / parts as f32, r.id))?;
        let measured = (r.run)(&mut bench).with_context(|| format!("reproducing {}", r.id))?;
        let text = format!("\n## {}\n\n`shadowscope reproduce {}`\n\n{measured}\n{}\n", r.title, r.id, r.deviation);
        (bench.tick)(Step::Measured(text))?;
    }
    Ok(())
}

/// Refuses names that are not those of reproductions.
pub fn check(ids: &[String]) -> Result<()> {
    for id in ids {
        let names: Vec<&str> = ALL.iter().map(|r| r.id).collect();
        ensure!(names.contains(&id.as_str()), "{id} is no reproduction; there are {}", names.join(", "));
    }
    Ok(())
}

/// What reproductions are measured with.
struct Bench<'a> {
    gpu: Arc<Gpu>,
    /// The scene opened last, and the set-up that it starts with.
    open: Option<(Renderer, Setup)>,
    folder: Option<&'a Path>,
    /// Which of how many reproductions is at work, and its name.
    part: (usize, usize, &'static str),
    tick: &'a mut dyn FnMut(Step) -> Result<()>,
}

impl Bench<'_> {
    /// Tells that step i of n of this reproduction starts.
    fn done(&mut self, i: usize, n: usize) {
        let (part, parts, id) = self.part;
        // Within one it is the device that gives up.
        let _ = (self.tick)(Step::Working((part as f32 + i as f32 / n as f32) / parts as f32, id));
    }

    /// A built-in scene, and the set-up that it starts with.
    fn open(&mut self, scene: &str) -> Result<(&mut Renderer, Setup)> {
        let held = self.open.take().filter(|(_, setup)| setup.scene == scene);
        let made = match held {
            Some(made) => made,
            None => {
                let built = builtin::build(scene).with_context(|| format!("{scene} is no built-in scene"))?;
                let setup = Setup::new(scene, &built)?;
                (Renderer::new(self.gpu.clone(), Arc::new(built))?, setup)
            }
        };
        let (renderer, setup) = self.open.insert(made);
        Ok((renderer, setup.clone()))
    }

    /// As [`Bench::capture`], of several set-ups that differ in their techniques alone: panes of the first one's size, two
    /// beside each other.
    fn panes(&mut self, name: &str, says: &str, setups: &[Setup]) -> Result<String> {
        let mut whole = setups[0].clone();
        for setup in &setups[1..] {
            whole.against.push(setup.kept(&setup.technique)?);
        }
        whole.arrange = Arrange::SideBySide;
        whole.size = [2 * whole.size[0], setups.len().div_ceil(2) as u32 * whole.size[1]];
        self.capture(name, says, &whole)
    }

    /// As [`picture`], of a set-up of a built-in scene.
    fn capture(&mut self, name: &str, says: &str, setup: &Setup) -> Result<String> {
        let folder = self.folder;
        let (renderer, _) = self.open(&setup.scene)?;
        picture(folder, name, says, |path| capture::capture(renderer, setup, path).map(|_| ()))
    }

    fn chart(&self, name: &str, lines: &Lines) -> Result<String> {
        let svg = chart::lines_svg(lines)?;
        picture(self.folder, &format!("{name}.svg"), &lines.title, |path| files::save(path, svg.as_bytes()))
    }
}

/// The set-up with another technique, and of its parameters those named `key=value`.
fn with(start: &Setup, technique: &str, sets: &[&str]) -> Result<Setup> {
    let mut setup = start.clone();
    setup.select(technique)?;
    for set in sets {
        setup.set(set, &[technique.into()])?;
    }
    Ok(setup)
}

/// Writes a picture if there is a folder for it; Markdown that shows it.
fn picture(folder: Option<&Path>, name: &str, says: &str, write: impl FnOnce(&Path) -> Result<()>) -> Result<String> {
    let Some(folder) = folder else { return Ok(String::new()) };
    let path = folder.join(name);
    write(&path)?;
    Ok(format!("![{says}]({})\n", path.display()))
}

/// What is said of a claim once it is measured.
fn holds(claim: bool) -> &'static str {
    if claim { "holds" } else { "**does not hold**" }
}

/// Three digits that count, without exponent.
pub(crate) fn short(x: f64) -> String {
    let places = if x == 0.0 { 2 } else { (2 - x.abs().log10().floor() as i32).clamp(0, 4) };
    format!("{x:.*}", places as usize)
}

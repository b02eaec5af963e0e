//! WGSL: found, put together from includes, checked by naga, and reflected.

use super::{Gpu, Table, locked, traffic};
use crate::files;
use crate::palette;
use crate::params::Group;
use crate::techniques;
use anyhow::{Context, Result, anyhow, bail, ensure};
use include_dir::{Dir, include_dir};
use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};
use std::time::SystemTime;
use wgpu::naga;

/// What shaders may use beside WebGPU's guarantee; passes that do are made only where the adapter can.
const CAPABILITIES: naga::valid::Capabilities = naga::valid::Capabilities::STORAGE_TEXTURE_16BIT_NORM_FORMATS;

static EMBEDDED: Dir = include_dir!("$CARGO_MANIFEST_DIR/shaders");

/// Where shader text comes from: the binary, and before it a folder, whose files take the place of those of the same name.
pub struct Shaders {
    folder: Option<PathBuf>,
    /// Of the texels in a row of a [`Table`] the logarithm, base 2.
    pub(super) table_bits: u32,
}

static FOLDER: OnceLock<PathBuf> = OnceLock::new();

/// Has all that is made from now on read its shaders from a folder.
///
/// # Errors
/// It is none, or holds no shader that there is.
pub fn read_from(folder: &Path) -> Result<()> {
    let told = folder.display();
    ensure!(folder.is_dir(), "--shaders {told}: there is no such folder; `shadowscope shaders -o {told}` makes one");
    ensure!(
        names().iter().any(|f| folder.join(f).is_file()),
        "--shaders {told}: no shader in it has the name of one of ours, such as map/filter/pcf.wgsl"
    );
    FOLDER.get_or_init(|| folder.into());
    Ok(())
}

impl Default for Shaders {
    fn default() -> Self {
        let folder = FOLDER.get().cloned().or_else(|| std::env::var_os("SHADOWSCOPE_SHADERS").map(PathBuf::from));
        Shaders { folder, table_bits: Table::bits(&wgpu::Limits::default()) }
    }
}

/// What is wrong with a shader, and where.
#[derive(Debug)]
pub struct Fault {
    /// The file, and its line, from 1; 0: it is generated.
    pub file: String,
    pub line: usize,
    pub message: String,
    /// The lines around it, with their numbers.
    pub lines: Vec<(usize, String)>,
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let text = self.lines.iter().find(|l| l.0 == self.line).map_or("", |l| l.1.trim());
        write!(f, "{}:{}: {text}: {}", self.file, self.line, self.message)
    }
}

impl std::error::Error for Fault {}

/// Lines shown before and behind a faulty one.
const AROUND: usize = 3;

/// A module put together and checked, with what it binds.
pub struct Program {
    pub module: naga::Module,
    pub info: naga::valid::ModuleInfo,
}

/// One resource of a pass as WGSL declares it.
pub struct Binding {
    pub name: String,
    /// The declared type's name; a parameter group is bound by it.
    pub type_name: String,
    pub entry: wgpu::BindGroupLayoutEntry,
}

/// What a shader depends on: the files, the parameter structs, and the newest change of any file.
pub type Key = (String, Vec<&'static str>, Option<SystemTime>);

/// A shader that a device has taken in, for the passes that come of it one after the other.
pub struct Loaded {
    key: Key,
    pub program: Program,
    pub on_device: wgpu::ShaderModule,
}

impl Gpu {
    pub(super) fn shader_key(&self, file: &str, groups: &[Group]) -> Key {
        (file.to_string(), groups.iter().map(|g| g.name).collect(), self.shaders.changed())
    }

    /// A shader with the parameter structs that it uses, parsed and checked once for all passes made of it in a row.
    ///
    /// # Errors
    /// As [`Shaders::load`].
    pub fn shader(&self, file: &str, groups: &[Group]) -> Result<Arc<Loaded>> {
        let key = self.shader_key(file, groups);
        let mut last = locked(&self.loaded);
        if let Some(held) = last.as_ref().filter(|held| held.key == key) {
            return Ok(held.clone());
        }
        let mut program = self.shaders.load(file, groups)?;
        if self.traffic.is_some() {
            program = traffic::counted(&program, CAPABILITIES).with_context(|| file.to_string())?;
        }
        let on_device = self.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(file),
            source: wgpu::ShaderSource::Naga(Cow::Owned(program.module.clone())),
        });
        Ok(last.insert(Arc::new(Loaded { key, program, on_device })).clone())
    }
}

/// Every shader file of the binary, relative to `shaders/`.
pub fn names() -> Vec<String> {
    fn walk(dir: &Dir, out: &mut Vec<String>) {
        out.extend(dir.files().map(|f| f.path().to_string_lossy().replace('\\', "/")));
        dir.dirs().for_each(|d| walk(d, out));
    }
    let mut out = Vec::new();
    walk(&EMBEDDED, &mut out);
    out.sort();
    out
}

/// Writes every shader file of the binary into a folder. Files that are there and differ are somebody's work: they stay, and
/// their names are returned.
///
/// # Errors
/// A file that cannot be written.
pub fn write_files(folder: &Path) -> Result<Vec<String>> {
    let mut kept = Vec::new();
    for name in names() {
        let path = folder.join(&name);
        let text = EMBEDDED.get_file(&name).map(|f| f.contents()).unwrap_or_default();
        match path.exists().then(|| files::read_text(&path)).transpose()? {
            Some(there) if there.as_bytes() != text => kept.push(name),
            Some(_) => {}
            None => files::save(&path, text)?,
        }
    }
    Ok(kept)
}

impl Shaders {
    /// Shaders of which a folder holds some or all.
    pub fn from_folder(folder: &Path) -> Shaders {
        Shaders { folder: Some(folder.into()), ..Shaders::default() }
    }

    /// The newest change of any file in the folder, where there is one.
    pub fn changed(&self) -> Option<SystemTime> {
        let folder = self.folder.as_ref()?;
        let own = techniques::own().iter().flat_map(|own| own.shaders).map(|(name, _)| name.to_string());
        names().into_iter().chain(own).filter_map(|f| folder.join(f).metadata().ok()?.modified().ok()).max()
    }

    fn read(&self, file: &str) -> Result<String> {
        match file {
            "palettes.wgsl" => return Ok(palette::wgsl()),
            "constants.wgsl" => return Ok(techniques::wgsl()),
            "table.wgsl" => return Ok(format!("const table_bits = {}u;\n", self.table_bits)),
            _ if file.starts_with("store/") => {
                let format = file.trim_start_matches("store/").trim_end_matches(".wgsl");
                return Ok(format!("var moments_out: texture_storage_2d<{format}, write>;\n"));
            }
            _ => {}
        }
        if let Some(path) = self.folder.as_ref().map(|folder| folder.join(file)).filter(|path| path.exists()) {
            return files::read_text(&path);
        }
        let own = techniques::own().iter().flat_map(|own| own.shaders).find(|(name, _)| *name == file);
        let ours = || EMBEDDED.get_file(file)?.contents_utf8();
        let text = own.map(|(_, text)| *text).or_else(ours).with_context(|| format!("there is no shader {file}"))?;
        Ok(text.into())
    }

    /// Puts files with spaces between them, what they include (`//!include lib/frame.wgsl`, each once) and the parameter
    /// structs together, numbers the resources that they declare (`var<uniform> frame: Frame;`), and checks the whole.
    ///
    /// # Errors
    /// What naga finds, with the file and line it was written on.
    pub fn load(&self, files: &str, groups: &[Group]) -> Result<Program> {
        let mut lines = Vec::new();
        for group in groups {
            let text = group.wgsl();
            lines.extend(text.lines().map(|l| (format!("params {}", group.name), 0, l.to_string())));
        }
        let mut seen = Vec::new();
        for file in files.split(' ') {
            self.include(file, &mut seen, &mut lines)?;
        }
        // Parameters come first. Mesa 22.3's software driver notes which uniforms alone decide a branch, and writes past the end of
        // its list for those of any uniform buffer of a compute shader after the seventh.
        let mut resources: Vec<&mut String> =
            lines.iter_mut().map(|(_, _, line)| line).filter(|line| is_resource(line)).collect();
        resources.sort_by_key(|line| !groups.iter().any(|g| line.ends_with(&format!(": {};", g.name))));
        resources
            .into_iter()
            .enumerate()
            .for_each(|(i, line)| line.insert_str(0, &format!("@group(0) @binding({i}) ")));
        let source: String = lines.iter().flat_map(|(_, _, l)| [l.as_str(), "\n"]).collect();
        let fault = |at: Option<naga::SourceLocation>, message: String| {
            let Some((file, line, _)) = at.and_then(|l| lines.get(l.line_number as usize - 1)) else {
                return anyhow!("{files}: {message}");
            };
            let near = |l: &&(String, usize, String)| l.0 == *file && l.1.abs_diff(*line) <= AROUND;
            // Numbers of bindings are not the author's.
            let written = |text: &str| {
                text.split_once("@binding(")
                    .and_then(|(_, rest)| rest.split_once(") "))
                    .map(|(_, rest)| rest.to_string())
            };
            let around =
                lines.iter().filter(near).map(|(_, n, text)| (*n, written(text).unwrap_or_else(|| text.clone())));
            anyhow!(Fault { file: file.clone(), line: *line, message, lines: around.collect() })
        };
        let module =
            naga::front::wgsl::parse_str(&source).map_err(|e| fault(e.location(&source), e.message().to_string()))?;
        let mut validator = naga::valid::Validator::new(naga::valid::ValidationFlags::all(), CAPABILITIES);
        let info = validator.validate(&module).map_err(|e| {
            let detail = std::iter::successors(Some(e.as_inner() as &dyn std::error::Error), |e| e.source());
            let detail: Vec<String> = detail.map(|e| e.to_string()).collect();
            fault(e.location(&source), detail.join(": "))
        })?;
        Ok(Program { module, info })
    }

    fn include(&self, file: &str, seen: &mut Vec<String>, lines: &mut Vec<(String, usize, String)>) -> Result<()> {
        if seen.iter().any(|s| s == file) {
            return Ok(());
        }
        seen.push(file.into());
        for (i, line) in self.read(file)?.lines().enumerate() {
            match line.strip_prefix("//!include ") {
                Some(other) => self.include(other.trim(), seen, lines).with_context(|| format!("{file}:{}", i + 1))?,
                None => lines.push((file.into(), i + 1, line.into())),
            }
        }
        Ok(())
    }
}

/// Whether a line declares something to be bound.
fn is_resource(line: &str) -> bool {
    ["var ", "var<uniform>", "var<storage"].iter().any(|start| line.starts_with(start))
}

impl Program {
    /// Threads of a workgroup of an entry point; 0 where that is no compute shader.
    pub fn group(&self, entry: &str) -> u64 {
        let found = self.module.entry_points.iter().find(|e| e.name == entry);
        found.map_or(0, |e| e.workgroup_size.iter().map(|n| u64::from(*n)).product())
    }

    /// What the named entry points bind, in the order of the bindings' numbers.
    pub fn bindings(&self, entry_points: &[&str]) -> Result<Vec<Binding>> {
        let mut found: Vec<Binding> = Vec::new();
        let mut sampled = Vec::new();
        for name in entry_points {
            let Some(i) = self.module.entry_points.iter().position(|e| e.name == *name) else {
                bail!("the shader has no entry point {name}");
            };
            sampled.extend(self.info.get_entry_point(i).sampling_set.iter().map(|k| k.image));
        }
        for name in entry_points {
            let i = self.module.entry_points.iter().position(|e| e.name == *name).unwrap_or(0);
            let stage = match self.module.entry_points[i].stage {
                naga::ShaderStage::Vertex => wgpu::ShaderStages::VERTEX,
                naga::ShaderStage::Fragment => wgpu::ShaderStages::FRAGMENT,
                _ => wgpu::ShaderStages::COMPUTE,
            };
            for (handle, global) in self.module.global_variables.iter() {
                let Some(at) = &global.binding else { continue };
                if self.info.get_entry_point(i)[handle].is_empty() {
                    continue;
                }
                if let Some(b) = found.iter_mut().find(|b| b.entry.binding == at.binding) {
                    b.entry.visibility |= stage;
                    continue;
                }
                let ty = &self.module.types[global.ty];
                found.push(Binding {
                    name: global.name.clone().unwrap_or_default(),
                    type_name: ty.name.clone().unwrap_or_default(),
                    entry: wgpu::BindGroupLayoutEntry {
                        binding: at.binding,
                        visibility: stage,
                        ty: binding_type(global.space, &ty.inner, sampled.contains(&handle))?,
                        count: None,
                    },
                });
            }
        }
        found.sort_by_key(|b| b.entry.binding);
        Ok(found)
    }
}

fn binding_type(space: naga::AddressSpace, ty: &naga::TypeInner, sampled: bool) -> Result<wgpu::BindingType> {
    let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    Ok(match (space, ty) {
        (naga::AddressSpace::Uniform, _) => buffer(wgpu::BufferBindingType::Uniform),
        (naga::AddressSpace::Storage { access }, _) => {
            buffer(wgpu::BufferBindingType::Storage { read_only: !access.contains(naga::StorageAccess::STORE) })
        }
        (_, naga::TypeInner::Sampler { comparison }) => wgpu::BindingType::Sampler(if *comparison {
            wgpu::SamplerBindingType::Comparison
        } else {
            wgpu::SamplerBindingType::Filtering
        }),
        (_, naga::TypeInner::Image { dim, arrayed, class }) => {
            let view_dimension = match (dim, arrayed) {
                (naga::ImageDimension::D2, false) => wgpu::TextureViewDimension::D2,
                (naga::ImageDimension::D2, true) => wgpu::TextureViewDimension::D2Array,
                (naga::ImageDimension::Cube, false) => wgpu::TextureViewDimension::Cube,
                _ => bail!("a texture of this dimension cannot be bound"),
            };
            match class {
                naga::ImageClass::Sampled { kind, multi } => wgpu::BindingType::Texture {
                    sample_type: match kind {
                        naga::ScalarKind::Uint => wgpu::TextureSampleType::Uint,
                        naga::ScalarKind::Sint => wgpu::TextureSampleType::Sint,
                        _ => wgpu::TextureSampleType::Float { filterable: sampled },
                    },
                    view_dimension,
                    multisampled: *multi,
                },
                naga::ImageClass::Depth { multi } => wgpu::BindingType::Texture {
                    sample_type: wgpu::TextureSampleType::Depth,
                    view_dimension,
                    multisampled: *multi,
                },
                naga::ImageClass::Storage { format, access } => wgpu::BindingType::StorageTexture {
                    access: if *access == naga::StorageAccess::STORE {
                        wgpu::StorageTextureAccess::WriteOnly
                    } else if *access == naga::StorageAccess::LOAD {
                        wgpu::StorageTextureAccess::ReadOnly
                    } else {
                        wgpu::StorageTextureAccess::ReadWrite
                    },
                    format: storage_format(*format)?,
                    view_dimension,
                },
                naga::ImageClass::External => bail!("external textures cannot be bound"),
            }
        }
        _ => bail!("a global of this kind cannot be bound"),
    })
}

fn storage_format(format: naga::StorageFormat) -> Result<wgpu::TextureFormat> {
    Ok(match format {
        naga::StorageFormat::R16Float => wgpu::TextureFormat::R16Float,
        naga::StorageFormat::Rg16Float => wgpu::TextureFormat::Rg16Float,
        naga::StorageFormat::R32Float => wgpu::TextureFormat::R32Float,
        naga::StorageFormat::Rg32Float => wgpu::TextureFormat::Rg32Float,
        naga::StorageFormat::Rgba16Unorm => wgpu::TextureFormat::Rgba16Unorm,
        naga::StorageFormat::R32Uint => wgpu::TextureFormat::R32Uint,
        naga::StorageFormat::Rg32Uint => wgpu::TextureFormat::Rg32Uint,
        naga::StorageFormat::Rgba32Uint => wgpu::TextureFormat::Rgba32Uint,
        naga::StorageFormat::Rgba8Unorm => wgpu::TextureFormat::Rgba8Unorm,
        naga::StorageFormat::Rgba16Float => wgpu::TextureFormat::Rgba16Float,
        naga::StorageFormat::Rgba32Float => wgpu::TextureFormat::Rgba32Float,
        other => bail!("storage textures of format {other:?} are not used here"),
    })
}

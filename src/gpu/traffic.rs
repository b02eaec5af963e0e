//! Bytes that passes move between memory and processor, counted by the shaders themselves.

use super::pass::Resource;
use super::shader::{Binding, Program};
use anyhow::{Context, Result, anyhow, ensure};
use wgpu::naga::{
    self, AddressSpace, Arena, AtomicFunction, Block, Expression, Function, GlobalVariable, Handle, Literal, Module,
    Scalar, Span, Statement, StorageAccess, Type, TypeInner, valid::FunctionInfo,
};

/// The name of the buffer that shaders count in.
pub(super) const NAME: &str = "traffic";
/// Most resources of a shader.
const MOST: u32 = 64;
/// Bytes of the buffer: of each resource, by the number of its binding, how much is read and written.
pub(super) const BYTES: u64 = MOST as u64 * 8;

/// What passes move, in bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Traffic {
    /// Threads of compute passes.
    pub threads: u64,
    /// What shaders ask for and hand over, a filtered sample as one texel.
    pub read: u64,
    pub written: u64,
    /// The same, but in each dispatch or draw of each resource no more than it holds: what a cache without bounds leaves at the most. With
    /// what draws clear, each texel of it once. Depth and colours that are drawn over others, and fetched vertices, are not counted.
    pub least: u64,
}

impl Traffic {
    /// Of a draw that clears the views first.
    pub(super) fn cleared<'a>(views: impl Iterator<Item = &'a wgpu::TextureView>) -> Traffic {
        let layer = |view: &wgpu::TextureView| {
            let texture = view.texture();
            u64::from(texture.width()) * u64::from(texture.height()) * texel(texture)
        };
        let written = views.map(layer).sum();
        Traffic { written, least: written, ..Traffic::default() }
    }

    /// With what a pass has counted of what it binds.
    pub(super) fn with<'a>(
        mut self,
        counts: &[u32],
        bound: impl Iterator<Item = (&'a Binding, &'a Resource)>,
    ) -> Traffic {
        for (binding, resource) in bound.filter(|(b, _)| b.name != NAME) {
            let (unit, all) = match resource {
                Resource::Buffer(buffer) => (4, buffer.size()),
                Resource::Texture(view) => (texel(view.texture()), size(binding, view.texture())),
                Resource::Sampler(_) => continue,
            };
            let at = binding.entry.binding as usize * 2;
            let [read, written] = [at, at + 1].map(|i| counts.get(i).map_or(0, |n| u64::from(*n) * unit));
            self.read += read;
            self.written += written;
            self.least += read.min(all) + written.min(all);
        }
        self
    }

    /// Both together.
    pub fn and(self, other: Traffic) -> Traffic {
        Traffic {
            threads: self.threads + other.threads,
            read: self.read + other.read,
            written: self.written + other.written,
            least: self.least + other.least,
        }
    }
}

/// Bytes of a texel. Formats of depth and stencil keep theirs to themselves: 4, and 1 for a stencil.
fn texel(texture: &wgpu::Texture) -> u64 {
    let format = texture.format();
    format.block_copy_size(None).map_or(4 + u64::from(format.has_stencil_aspect()), u64::from)
}

/// Bytes of the largest level of a texture, of all its layers where the binding takes more than one.
fn size(binding: &Binding, texture: &wgpu::Texture) -> u64 {
    use wgpu::TextureViewDimension::{D1, D2};
    let size = texture.size();
    let layers = match binding.entry.ty {
        wgpu::BindingType::Texture { view_dimension: D1 | D2, .. }
        | wgpu::BindingType::StorageTexture { view_dimension: D1 | D2, .. } => 1,
        _ => u64::from(size.depth_or_array_layers),
    };
    u64::from(size.width) * u64::from(size.height) * layers * texel(texture)
}

/// The program with a count behind each of its reads and writes of textures and storage buffers: of texels, and of words.
///
/// # Errors
/// Too many resources, or a program that is refused with its counts.
pub(super) fn counted(program: &Program, capabilities: naga::valid::Capabilities) -> Result<Program> {
    let from = &program.module;
    let mut module = from.clone();
    let mut add = |inner| module.types.insert(Type { name: None, inner }, Span::default());
    let word = add(TypeInner::Scalar(Scalar::U32));
    let atomic = add(TypeInner::Atomic(Scalar::U32));
    let length = (MOST * 2).try_into().context("no counts")?;
    let array = add(TypeInner::Array { base: atomic, size: naga::ArraySize::Constant(length), stride: 4 });
    let next = from.global_variables.iter().filter_map(|(_, g)| Some(g.binding?.binding + 1)).max().unwrap_or(0);
    ensure!(next < MOST, "the shader binds more than {MOST} resources");
    let counts = module.global_variables.append(
        GlobalVariable {
            name: Some(NAME.into()),
            space: AddressSpace::Storage { access: StorageAccess::LOAD | StorageAccess::STORE },
            binding: Some(naga::ResourceBinding { group: 0, binding: next }),
            ty: array,
            init: None,
            memory_decorations: naga::MemoryDecorations::empty(),
        },
        Span::default(),
    );
    let counter = Counter { from, counts, word };
    for (handle, function) in module.functions.iter_mut() {
        counter.count(function, &program.info[handle]);
    }
    for (i, entry) in module.entry_points.iter_mut().enumerate() {
        counter.count(&mut entry.function, program.info.get_entry_point(i));
    }
    let info = naga::valid::Validator::new(naga::valid::ValidationFlags::all(), capabilities).validate(&module);
    let info = info.map_err(|e| anyhow!("counting its traffic: {}", e.emit_to_string("")))?;
    Ok(Program { module, info })
}

/// Puts counts into functions.
struct Counter<'a> {
    from: &'a Module,
    counts: Handle<GlobalVariable>,
    word: Handle<Type>,
}

impl Counter<'_> {
    fn count(&self, function: &mut Function, info: &FunctionInfo) {
        let body = std::mem::take(&mut function.body);
        function.body = self.block(body, &mut function.expressions, info);
    }

    fn block(&self, block: Block, all: &mut Arena<Expression>, info: &FunctionInfo) -> Block {
        let mut out = Block::with_capacity(block.len());
        for (statement, span) in block.span_into_iter() {
            let mut told = Vec::new();
            let statement = match statement {
                Statement::Emit(range) => {
                    for handle in range.clone() {
                        told.extend(self.read(handle, all, info));
                    }
                    Statement::Emit(range)
                }
                Statement::Block(inner) => Statement::Block(self.block(inner, all, info)),
                Statement::If { condition, accept, reject } => {
                    let [accept, reject] = [accept, reject].map(|b| self.block(b, all, info));
                    Statement::If { condition, accept, reject }
                }
                Statement::Switch { selector, mut cases } => {
                    for case in &mut cases {
                        case.body = self.block(std::mem::take(&mut case.body), all, info);
                    }
                    Statement::Switch { selector, cases }
                }
                Statement::Loop { body, continuing, break_if } => {
                    let [body, continuing] = [body, continuing].map(|b| self.block(b, all, info));
                    Statement::Loop { body, continuing, break_if }
                }
                Statement::Store { pointer, value } => {
                    told.extend(self.stored(pointer, all).map(|at| (at + 1, self.words(value, info))));
                    Statement::Store { pointer, value }
                }
                Statement::ImageStore { image, coordinate, array_index, value } => {
                    told.extend(self.at(image, all).map(|at| (at + 1, 1)));
                    Statement::ImageStore { image, coordinate, array_index, value }
                }
                Statement::Atomic { pointer, fun, value, result } => {
                    if let Some(at) = self.stored(pointer, all) {
                        told.extend([(at, 1), (at + 1, 1)]);
                    }
                    Statement::Atomic { pointer, fun, value, result }
                }
                Statement::ImageAtomic { image, coordinate, array_index, fun, value } => {
                    if let Some(at) = self.at(image, all) {
                        told.extend([(at, 1), (at + 1, 1)]);
                    }
                    Statement::ImageAtomic { image, coordinate, array_index, fun, value }
                }
                other => other,
            };
            out.push(statement, span);
            for (index, units) in told {
                self.tell(index, units, all, &mut out);
            }
        }
        out
    }

    /// What an expression reads: the place of its count, and how much.
    fn read(&self, handle: Handle<Expression>, all: &Arena<Expression>, info: &FunctionInfo) -> Option<(u32, u32)> {
        match all[handle] {
            Expression::Load { pointer } => Some((self.stored(pointer, all)?, self.words(handle, info))),
            Expression::ImageLoad { image, .. } => Some((self.at(image, all)?, 1)),
            Expression::ImageSample { image, gather, .. } => {
                Some((self.at(image, all)?, if gather.is_some() { 4 } else { 1 }))
            }
            _ => None,
        }
    }

    /// The words of a value.
    fn words(&self, value: Handle<Expression>, info: &FunctionInfo) -> u32 {
        info[value].ty.inner_with(&self.from.types).size(self.from.to_ctx()).div_ceil(4)
    }

    /// The place of the count of a storage buffer that is pointed into.
    fn stored(&self, pointer: Handle<Expression>, all: &Arena<Expression>) -> Option<u32> {
        let base = std::iter::successors(Some(pointer), |p| match all[*p] {
            Expression::Access { base, .. } | Expression::AccessIndex { base, .. } => Some(base),
            _ => None,
        });
        let Expression::GlobalVariable(global) = all[base.last()?] else { return None };
        matches!(self.from.global_variables[global].space, AddressSpace::Storage { .. }).then(|| self.place(global))?
    }

    /// The place of the count of a texture.
    fn at(&self, image: Handle<Expression>, all: &Arena<Expression>) -> Option<u32> {
        let Expression::GlobalVariable(global) = all[image] else { return None };
        self.place(global)
    }

    fn place(&self, global: Handle<GlobalVariable>) -> Option<u32> {
        Some(self.from.global_variables[global].binding?.binding * 2)
    }

    /// Adds to a count.
    fn tell(&self, index: u32, units: u32, all: &mut Arena<Expression>, out: &mut Block) {
        let span = Span::default();
        let base = all.append(Expression::GlobalVariable(self.counts), span);
        let value = all.append(Expression::Literal(Literal::U32(units)), span);
        let before = all.len();
        let pointer = all.append(Expression::AccessIndex { base, index }, span);
        out.push(Statement::Emit(all.range_from(before)), span);
        let result = all.append(Expression::AtomicResult { ty: self.word, comparison: false }, span);
        out.push(Statement::Atomic { pointer, fun: AtomicFunction::Add, value, result: Some(result) }, span);
    }
}

//! Bounds-checked reading of a file's buffers: every count, offset and stride is checked against
//! the bytes that are there before anything is allocated.

use super::packed::{self, Primitives, Views};
use super::{broken, get, uri};
use crate::files;
use ::gltf::json::accessor::{ComponentType, Type};
use ::gltf::json::validation::Checked;
use ::gltf::json::{Accessor, Index, Root, buffer::View};
use anyhow::{Result, ensure};
use glam::Vec4;
use std::borrow::Cow;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

/// Accessors without data of their own are all zeros, so the file's size does not limit them.
const MAX_ZEROS: u64 = 1 << 22;

/// Most elements that are read of all accessors together, about what the largest scene holds: any number of meshes may share
/// one accessor, each with a copy of its own.
const MAX_READ: u64 = 1 << 29;

/// A file's buffers, read whole.
pub struct Accessors<'a> {
    root: &'a Root,
    buffers: Vec<Cow<'a, [u8]>>,
    views: Views,
    primitives: Primitives,
    /// Elements read so far.
    read: AtomicU64,
}

impl<'a> Accessors<'a> {
    /// Reads all buffers and unpacks what is compressed; `bin` is the .glb file's binary chunk.
    pub fn new(root: &'a Root, bin: Option<&'a [u8]>, folder: &Path) -> Result<Self> {
        let mut buffers = Vec::with_capacity(root.buffers.len());
        let mut held = 0;
        for (index, buffer) in root.buffers.iter().enumerate() {
            let owner = format!("buffer {index}");
            let data: Cow<[u8]> = match (&buffer.uri, bin) {
                (Some(uri), _) => uri::fetch(uri, folder, &owner)?.into(),
                (None, Some(bin)) if index == 0 => bin.into(),
                (None, _) if packed::is_fallback(buffer) => {
                    buffers.push(Cow::default());
                    continue;
                }
                (None, _) => return Err(broken(format!("{owner} has no data"))),
            };
            if buffer.byte_length.0 > data.len() as u64 {
                return Err(broken(format!(
                    "{owner} should have {} bytes but has {}",
                    buffer.byte_length.0,
                    data.len()
                )));
            }
            // Any number of them may be the same file.
            held += data.len() as u64;
            ensure!(
                held <= files::MOST_DATA,
                "its buffers have more than {} MiB together; export it with fewer",
                files::MOST_DATA >> 20
            );
            buffers.push(data);
        }
        let views = packed::views(root, &buffers);
        let mut accessors = Self { root, buffers, views, primitives: Primitives::new(), read: AtomicU64::new(0) };
        accessors.primitives = packed::primitives(root, &accessors);
        Ok(accessors)
    }

    /// The bytes of a buffer view.
    pub fn view(&self, index: Index<View>, owner: &str) -> Result<&[u8]> {
        let view = get(&self.root.buffer_views, index, "buffer view", owner)?;
        match self.views.get(&index.value()) {
            Some(Ok(bytes)) => return Ok(bytes),
            Some(Err(reason)) => return Err(broken(format!("buffer view {index} cannot be unpacked: {reason}"))),
            None => {}
        }
        get(&self.root.buffers, view.buffer, "buffer", owner)?;
        let buffer = &self.buffers[view.buffer.value()];
        let start = view.byte_offset.unwrap_or_default().0;
        let end = start.saturating_add(view.byte_length.0);
        if end > buffer.len() as u64 {
            return Err(broken(format!(
                "buffer view {index} ends at byte {end} of buffer {}, which has {}",
                view.buffer,
                buffer.len()
            )));
        }
        Ok(&buffer[start as usize..end as usize])
    }

    /// `N` floats an element, integers normalised if the accessor says so.
    pub fn floats<const N: usize>(&self, index: Index<Accessor>, role: &str) -> Result<Vec<[f32; N]>> {
        self.read(index, role, |component, normalized| Some(as_float(component, normalized)))
    }

    /// Linear colours, opaque where the accessor has no alpha. Integers are shares, whether it says so or not.
    pub fn colors(&self, index: Index<Accessor>, role: &str) -> Result<Vec<Vec4>> {
        let accessor = get(&self.root.accessors, index, "accessor", role)?;
        let reader = |component, _| Some(as_float(component, true));
        if accessor.type_ == Checked::Valid(Type::Vec3) {
            let colors = self.read::<f32, 3>(index, role, reader)?;
            return Ok(colors.into_iter().map(|[r, g, b]| Vec4::new(r, g, b, 1.0)).collect());
        }
        Ok(self.read::<f32, 4>(index, role, reader)?.into_iter().map(Vec4::from_array).collect())
    }

    /// `N` unsigned integers an element.
    pub fn integers<const N: usize>(&self, index: Index<Accessor>, role: &str) -> Result<Vec<[u32; N]>> {
        self.read(index, role, |component, _| match component {
            ComponentType::U8 => Some(|b| u32::from(b[0])),
            ComponentType::U16 => Some(|b| u32::from(u16::from_le_bytes([b[0], b[1]]))),
            ComponentType::U32 => Some(u32_at),
            _ => None,
        })
    }

    /// Reads all elements with the component reader that `reader` gives for the component type and
    /// whether it is normalised.
    fn read<T: Copy + Default, const N: usize>(
        &self,
        index: Index<Accessor>,
        role: &str,
        reader: impl Fn(ComponentType, bool) -> Option<fn(&[u8]) -> T>,
    ) -> Result<Vec<[T; N]>> {
        let accessor = get(&self.root.accessors, index, "accessor", role)?;
        let owner = format!("accessor {index} ({role})");
        match self.primitives.get(&index.value()) {
            Some(Ok(unpacked)) => {
                let (component, width) = (unpacked.component, unpacked.width);
                let convert = reader(component, accessor.normalized).filter(|_| width == N);
                let convert = convert
                    .ok_or_else(|| broken(format!("{owner} unpacks to {width} {component:?} components an element")))?;
                let stride = size(component) * N;
                let count = unpacked.bytes.len() / stride;
                return self.elements(&unpacked.bytes, 0, stride, size(component), count as u64, convert, &owner);
            }
            Some(Err(reason)) => return Err(broken(format!("{owner} cannot be unpacked: {reason}"))),
            None => {}
        }
        let (Checked::Valid(kind), Checked::Valid(component)) = (&accessor.type_, &accessor.component_type) else {
            return Err(broken(format!("{owner} has an unknown type")));
        };
        if width(*kind) != N {
            return Err(broken(format!("{owner} has {} components an element where {N} belong", width(*kind))));
        }
        let component = component.0;
        let Some(convert) = reader(component, accessor.normalized) else {
            return Err(broken(format!("{owner} has {component:?} components where unsigned integers belong")));
        };
        let count = accessor.count.0;
        let size = size(component);

        let mut elements = match accessor.buffer_view {
            Some(view) => {
                // `view` has checked the index.
                let bytes = self.view(view, &owner)?;
                let stride = self.root.buffer_views[view.value()].byte_stride;
                let stride = stride.map_or(size * N, |stride| stride.0);
                let offset = accessor.byte_offset.unwrap_or_default().0;
                self.elements(bytes, offset, stride, size, count, convert, &owner)?
            }
            None if count <= MAX_ZEROS => {
                // No bytes are needed to ask for them.
                self.count(8 * count)?;
                vec![[T::default(); N]; count as usize]
            }
            None => {
                return Err(broken(format!("{owner} claims {count} elements without data")));
            }
        };

        if let Some(sparse) = &accessor.sparse {
            let changed = sparse.count.0;
            let Checked::Valid(component) = &sparse.indices.component_type else {
                return Err(broken(format!("{owner} has sparse indices of unknown type")));
            };
            let bytes = self.view(sparse.indices.buffer_view, &owner)?;
            let offset = sparse.indices.byte_offset.0;
            let (index_size, read_index): (usize, fn(&[u8]) -> u32) = match component.0 {
                ComponentType::U8 => (1, |b| u32::from(b[0])),
                ComponentType::U16 => (2, |b| u32::from(u16::from_le_bytes([b[0], b[1]]))),
                _ => (4, u32_at),
            };
            let places: Vec<[u32; 1]> =
                self.elements(bytes, offset, index_size, index_size, changed, read_index, &owner)?;
            let bytes = self.view(sparse.values.buffer_view, &owner)?;
            let offset = sparse.values.byte_offset.0;
            let values = self.elements(bytes, offset, size * N, size, changed, convert, &owner)?;
            for ([place], value) in places.into_iter().zip(values) {
                let Some(element) = elements.get_mut(place as usize) else {
                    return Err(broken(format!("{owner} replaces element {place} of its {count}")));
                };
                *element = value;
            }
        }
        Ok(elements)
    }

    /// Counts elements that are about to be read, and refuses too many.
    fn count(&self, elements: u64) -> Result<()> {
        let read = self.read.fetch_add(elements, Ordering::Relaxed).saturating_add(elements);
        ensure!(
            read <= MAX_READ,
            "its meshes and animations read more than {MAX_READ} elements of its accessors, each as often as it is shared; \
             export it with fewer"
        );
        Ok(())
    }

    /// Elements of `N` components of `size` bytes, `stride` bytes apart.
    #[expect(clippy::too_many_arguments)]
    fn elements<T, const N: usize>(
        &self,
        bytes: &[u8],
        offset: u64,
        stride: usize,
        size: usize,
        count: u64,
        convert: fn(&[u8]) -> T,
        owner: &str,
    ) -> Result<Vec<[T; N]>> {
        let Some(last) = count.checked_sub(1) else {
            return Ok(Vec::new());
        };
        if stride < size * N {
            return Err(broken(format!("{owner} has elements of {} bytes only {stride} bytes apart", size * N)));
        }
        let end = last.saturating_mul(stride as u64).saturating_add(offset).saturating_add((size * N) as u64);
        if end > bytes.len() as u64 {
            return Err(broken(format!("{owner} needs {end} bytes of a buffer view that has {}", bytes.len())));
        }
        self.count(count)?;
        let bytes = &bytes[offset as usize..];
        Ok((0..count as usize).map(|i| std::array::from_fn(|c| convert(&bytes[i * stride + c * size..]))).collect())
    }
}

fn as_float(component: ComponentType, normalized: bool) -> fn(&[u8]) -> f32 {
    match (component, normalized) {
        (ComponentType::F32, _) => |b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]),
        (ComponentType::U32, _) => |b| u32_at(b) as f32,
        (ComponentType::I8, false) => |b| f32::from(b[0] as i8),
        (ComponentType::U8, false) => |b| f32::from(b[0]),
        (ComponentType::I16, false) => |b| f32::from(i16::from_le_bytes([b[0], b[1]])),
        (ComponentType::U16, false) => |b| f32::from(u16::from_le_bytes([b[0], b[1]])),
        (ComponentType::I8, true) => |b| (f32::from(b[0] as i8) / 127.0).max(-1.0),
        (ComponentType::U8, true) => |b| f32::from(b[0]) / 255.0,
        (ComponentType::I16, true) => |b| (f32::from(i16::from_le_bytes([b[0], b[1]])) / 32767.0).max(-1.0),
        (ComponentType::U16, true) => |b| f32::from(u16::from_le_bytes([b[0], b[1]])) / 65535.0,
    }
}

fn u32_at(bytes: &[u8]) -> u32 {
    u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
}

fn size(component: ComponentType) -> usize {
    match component {
        ComponentType::I8 | ComponentType::U8 => 1,
        ComponentType::I16 | ComponentType::U16 => 2,
        ComponentType::U32 | ComponentType::F32 => 4,
    }
}

fn width(kind: Type) -> usize {
    match kind {
        Type::Scalar => 1,
        Type::Vec2 => 2,
        Type::Vec3 => 3,
        Type::Vec4 | Type::Mat2 => 4,
        Type::Mat3 => 9,
        Type::Mat4 => 16,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_read_of_shared_accessors_is_counted() {
        let accessor = r#"{ "componentType": 5126, "type": "VEC3", "count": 3 }"#;
        let root: Root = ::gltf::json::deserialize::from_str(&format!(
            r#"{{"asset":{{"version":"2.0"}},"accessors":[{accessor}]}}"#
        ))
        .unwrap();
        let accessors = Accessors::new(&root, None, Path::new("")).unwrap();
        accessors.read.store(MAX_READ - 40, Ordering::Relaxed);
        let read = || accessors.floats::<3>(Index::new(0), "POSITION");
        assert_eq!(read().unwrap(), [[0.0; 3]; 3]);
        let error = read().unwrap_err().to_string();
        assert!(error.contains("more than 536870912 elements") && error.contains("export it with fewer"), "{error}");
    }
}

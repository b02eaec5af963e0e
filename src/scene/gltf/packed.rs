//! Compressed geometry: KHR_draco_mesh_compression, and buffer views of EXT_meshopt_compression and KHR_meshopt_compression.

use super::MAX_TRIANGLES;
use super::accessors::Accessors;
use ::gltf::json::accessor::ComponentType;
use ::gltf::json::mesh::Primitive;
use ::gltf::json::{Index, Root, buffer};
use anyhow::{Context, Result, anyhow, bail, ensure};
use bytemuck::{cast_slice, pod_collect_to_vec};
use draco_core::{DataType, DecodeLimits, DecoderBuffer, Mesh, MeshDecoder, PointAttribute, PointIndex};
use rayon::prelude::*;
use serde_json::Value;
use std::collections::{BTreeMap, HashMap};
use std::sync::atomic::{AtomicU64, Ordering};

/// What an accessor of a compressed primitive stands for.
pub struct Unpacked {
    pub component: ComponentType,
    /// Components an element.
    pub width: usize,
    /// Elements without gaps.
    pub bytes: Vec<u8>,
}

/// By accessor, or why there is nothing.
pub type Primitives = HashMap<usize, Result<Unpacked, String>>;

/// Unpacks all primitives that KHR_draco_mesh_compression holds, in parallel.
pub fn primitives(root: &Root, accessors: &Accessors) -> Primitives {
    let mut jobs = BTreeMap::new();
    for primitive in root.meshes.iter().flat_map(|mesh| &mesh.primitives) {
        let extension = primitive.extensions.as_ref().and_then(|e| e.others.get("KHR_draco_mesh_compression"));
        if let (Some(extension), Some(first)) = (extension, primitive.attributes.values().next()) {
            // Primitives that share their accessors share their data.
            jobs.entry((primitive.indices.map(|i| i.value()), first.value())).or_insert((primitive, extension));
        }
    }
    let jobs: Vec<_> = jobs.into_values().collect();
    // Many may be of the same few bytes.
    let left = AtomicU64::new(MAX_TRIANGLES);
    let unpacked = jobs.par_iter().map(|(primitive, extension)| match draco(accessors, primitive, extension, &left) {
        Ok(all) => all.into_iter().map(|(index, unpacked)| (index, Ok(unpacked))).collect::<Vec<_>>(),
        Err(error) => {
            let named = primitive.indices.iter().chain(primitive.attributes.values());
            named.map(|index| (index.value(), Err(format!("{error:#}")))).collect()
        }
    });
    unpacked.flatten().collect()
}

/// `left`: how many more triangles may be unpacked, or three times as many points.
fn draco(
    accessors: &Accessors,
    primitive: &Primitive,
    extension: &Value,
    left: &AtomicU64,
) -> Result<Vec<(usize, Unpacked)>> {
    let view = number(extension, "bufferView")?;
    let view = Index::new(u32::try_from(view).context("its bufferView is no index")?);
    let data = accessors.view(view, "Draco data")?;
    let most = left.load(Ordering::Relaxed);
    let limits = DecodeLimits::default().with_max_points(3 * most).with_max_faces(most);
    let mut mesh = Mesh::new();
    let decoded = MeshDecoder::new().decode(&mut DecoderBuffer::new(data).with_limits(limits), &mut mesh);
    decoded.map_err(|error| anyhow!("Draco: {error}"))?;
    let taken = (mesh.num_points() as u64).div_ceil(3).max(mesh.num_faces() as u64);
    _ = left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| Some(left.saturating_sub(taken)));

    let indices = primitive.indices.context("Draco data without an accessor for its indices")?;
    let bytes = mesh.faces().iter().flatten().flat_map(|point| point.0.to_le_bytes()).collect();
    let mut all = vec![(indices.value(), Unpacked { component: ComponentType::U32, width: 1, bytes })];
    for (semantic, accessor) in &primitive.attributes {
        let name = semantic.to_string();
        let Some(id) = extension.get("attributes").and_then(|list| list.get(&name)) else { continue };
        let id = id.as_u64().and_then(|id| u32::try_from(id).ok());
        let attribute = id.and_then(|id| mesh.attribute_by_unique_id(id));
        let attribute = attribute.with_context(|| format!("its Draco data has no attribute for {name}"))?;
        all.push((accessor.value(), elements(attribute, mesh.num_points())?));
    }
    Ok(all)
}

/// An attribute of a Draco mesh, point by point.
fn elements(attribute: &PointAttribute, points: usize) -> Result<Unpacked> {
    let width = usize::from(attribute.num_components());
    let component = match attribute.data_type() {
        DataType::Int8 => ComponentType::I8,
        DataType::Uint8 | DataType::Bool => ComponentType::U8,
        DataType::Int16 => ComponentType::I16,
        DataType::Uint16 => ComponentType::U16,
        DataType::Int32 | DataType::Uint32 => ComponentType::U32,
        DataType::Float32 => ComponentType::F32,
        _ => {
            let floats = attribute.read_f32s(points, width);
            let bytes = floats.into_iter().flat_map(f32::to_le_bytes).collect();
            return Ok(Unpacked { component: ComponentType::F32, width, bytes });
        }
    };
    let size = width * attribute.data_type().byte_length();
    let stride = usize::try_from(attribute.byte_stride()).unwrap_or(size);
    let data = attribute.buffer().data();
    let mut bytes = Vec::with_capacity(points * size);
    for point in 0..points {
        let start = (attribute.mapped_index(PointIndex(point as u32)).0 as usize).saturating_mul(stride);
        let value = data.get(start..start.saturating_add(size));
        bytes.extend_from_slice(value.context("Draco data that refers to values which are not there")?);
    }
    Ok(Unpacked { component, width, bytes })
}

/// By buffer view, or why there is nothing.
pub type Views = HashMap<usize, Result<Vec<u8>, String>>;

/// What the extension says of a buffer view.
fn meshopt_of(view: &buffer::View) -> Option<&Value> {
    let others = &view.extensions.as_ref()?.others;
    others.get("EXT_meshopt_compression").or_else(|| others.get("KHR_meshopt_compression"))
}

/// Whether a buffer stands only for what compressed buffer views unpack to, and need not be there.
pub fn is_fallback(buffer: &buffer::Buffer) -> bool {
    let Some(extensions) = &buffer.extensions else { return false };
    ["EXT_meshopt_compression", "KHR_meshopt_compression"]
        .iter()
        .any(|name| extensions.others.get(*name).and_then(|e| e.get("fallback")?.as_bool()).unwrap_or(false))
}

/// What a byte stands for at most, where all of a block is the same, bytes.
const MOST_OF_A_BYTE: u64 = 1024;

/// Most bytes that all compressed buffer views unpack to together; many may be of the same few bytes.
const MAX_UNPACKED: u64 = 1 << 31;

/// Unpacks all compressed buffer views, in parallel.
pub fn views(root: &Root, buffers: &[impl AsRef<[u8]> + Sync]) -> Views {
    let mut claimed = 0u64;
    let mut jobs = Vec::new();
    for (index, extension) in root.buffer_views.iter().map(meshopt_of).enumerate() {
        let Some(extension) = extension else { continue };
        let bytes = |key: &str| number(extension, key).unwrap_or(0) as u64;
        let most = bytes("byteLength").saturating_mul(MOST_OF_A_BYTE);
        claimed = claimed.saturating_add(bytes("count").saturating_mul(bytes("byteStride")).min(most));
        jobs.push((index, extension, claimed));
    }
    let unpacked = jobs.into_par_iter().map(|(index, extension, claimed)| {
        let unpacked = match claimed <= MAX_UNPACKED {
            true => meshopt(extension, buffers),
            false => Err(anyhow!(
                "the compressed buffer views up to it claim {} MiB, of {} that are unpacked",
                claimed >> 20,
                MAX_UNPACKED >> 20
            )),
        };
        (index, unpacked.map_err(|error| format!("{error:#}")))
    });
    unpacked.collect()
}

fn meshopt(extension: &Value, buffers: &[impl AsRef<[u8]>]) -> Result<Vec<u8>> {
    let buffer = buffers.get(number(extension, "buffer")?).context("its buffer is not there")?.as_ref();
    let start = if extension.get("byteOffset").is_some() { number(extension, "byteOffset")? } else { 0 };
    let end = start.saturating_add(number(extension, "byteLength")?);
    let data = buffer.get(start..end);
    let data = data.with_context(|| format!("it ends at byte {end} of a buffer that has {}", buffer.len()))?;
    let (count, stride) = (number(extension, "count")?, number(extension, "byteStride")?);
    let most = (data.len() as u64).saturating_mul(MOST_OF_A_BYTE);
    ensure!(
        count.checked_mul(stride).is_some_and(|bytes| bytes as u64 <= most),
        "it claims {count} elements of {stride} bytes in {} bytes",
        data.len()
    );
    let text = |key: &str| extension.get(key).and_then(Value::as_str);
    let damaged = |_| anyhow!("its data is damaged");
    let mut bytes = match (text("mode").unwrap_or_default(), stride) {
        ("ATTRIBUTES", _) => vertices(data, count, stride)?,
        ("TRIANGLES", _) if count % 3 != 0 => bail!("it has {count} corners of triangles"),
        ("TRIANGLES", 2) => cast_slice(&meshopt::decode_index_buffer::<u16>(data, count).map_err(damaged)?).to_vec(),
        ("TRIANGLES", 4) => cast_slice(&meshopt::decode_index_buffer::<u32>(data, count).map_err(damaged)?).to_vec(),
        ("INDICES", 2) => cast_slice(&meshopt::decode_index_sequence::<u16>(data, count).map_err(damaged)?).to_vec(),
        ("INDICES", 4) => cast_slice(&meshopt::decode_index_sequence::<u32>(data, count).map_err(damaged)?).to_vec(),
        ("TRIANGLES" | "INDICES", _) => bail!("it has indices of {stride} bytes"),
        (mode, _) => bail!("its mode is {mode:?}"),
    };
    /// The bytes as a filter leaves them.
    fn filtered<T: bytemuck::Pod>(bytes: &[u8], filter: impl Fn(&mut [T])) -> Vec<u8> {
        let mut values = pod_collect_to_vec::<u8, T>(bytes);
        filter(&mut values);
        cast_slice(&values).to_vec()
    }
    bytes = match (text("filter").unwrap_or("NONE"), stride) {
        ("NONE", _) => bytes,
        ("OCTAHEDRAL", 4) => filtered::<[i8; 4]>(&bytes, meshopt::decode_filter_oct),
        ("OCTAHEDRAL", 8) => filtered::<[i16; 4]>(&bytes, meshopt::decode_filter_oct),
        ("QUATERNION", 8) => filtered::<[i16; 4]>(&bytes, meshopt::decode_filter_quat),
        ("EXPONENTIAL", _) => filtered::<[u32; 1]>(&bytes, meshopt::decode_filter_exp),
        ("COLOR", 4) => filtered::<[u8; 4]>(&bytes, meshopt::decode_filter_color),
        ("COLOR", 8) => filtered::<[u16; 4]>(&bytes, meshopt::decode_filter_color),
        (filter, _) => bail!("its filter is {filter:?} of {stride} bytes"),
    };
    Ok(bytes)
}

/// An element of so many bytes, as the decoder asks for a type.
#[derive(Clone, Copy)]
struct Element<const N: usize>([u8; N]);

impl<const N: usize> Default for Element<N> {
    fn default() -> Self {
        Self([0; N])
    }
}

fn vertices(data: &[u8], count: usize, stride: usize) -> Result<Vec<u8>> {
    fn decoded<const N: usize>(data: &[u8], count: usize) -> Result<Vec<u8>> {
        let elements = meshopt::decode_vertex_buffer::<Element<N>>(data, count);
        Ok(elements.map_err(|_| anyhow!("its data is damaged"))?.into_iter().flat_map(|element| element.0).collect())
    }
    macro_rules! of_stride {
        ($($n:literal)*) => {
            match stride {
                $($n => decoded::<$n>(data, count),)*
                _ => bail!("it has elements of {stride} bytes, which is no multiple of 4 up to 256"),
            }
        };
    }
    of_stride!(4 8 12 16 20 24 28 32 36 40 44 48 52 56 60 64 68 72 76 80 84 88 92 96 100 104 108 112 116 120 124 128
        132 136 140 144 148 152 156 160 164 168 172 176 180 184 188 192 196 200 204 208 212 216 220 224 228 232 236 240
        244 248 252 256)
}

fn number(extension: &Value, key: &str) -> Result<usize> {
    let value = extension.get(key).and_then(Value::as_u64).and_then(|value| usize::try_from(value).ok());
    value.with_context(|| format!("its {key} is no whole number"))
}

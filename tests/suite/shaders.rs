//! Every WGSL module is put together and checked, and structs shared with Rust agree field by field.

use shadowscope::frame::{Counting, FrameUniform, Looked, Segment, ShotUniform, Style, ViewUniform};
use shadowscope::gpu::{Shaders, shader_files};
use shadowscope::light::LightView;
use shadowscope::map::cascades::Fitting;
use shadowscope::map::faces::FacesUniform;
use shadowscope::map::filter::{Filter, shader};
use shadowscope::map::fit::diagram::Stroke;
use shadowscope::map::places::Batch;
use shadowscope::params::{Group, Values};
use shadowscope::scene::edges::Edge;
use shadowscope::scene::geometry::{GpuMaterial, Vertex};
use shadowscope::{contact, techniques, view};
use std::mem::{offset_of, size_of};
use wgpu::naga;

/// The parameter groups that Rust gives a file: its technique's, or the views'.
fn groups(file: &str) -> &'static [Group] {
    if file.starts_with("shade.wgsl") {
        return &[view::GROUP];
    }
    if file == "contact.wgsl" {
        return &[contact::GROUP];
    }
    if ["map/peel.wgsl", "map/accumulate.wgsl"].contains(&file) {
        return techniques::find("pcf").map_or(&[], |i| i.params);
    }
    if ["map/faces.wgsl", "map/paraboloid.wgsl", "map/moved.wgsl"].contains(&file) {
        return techniques::find("dual-paraboloid").map_or(&[], |i| i.params);
    }
    if file == "map/edge_draws.wgsl" {
        return techniques::find("edsm").map_or(&[], |i| i.params);
    }
    if file == "map/light_tree.wgsl" {
        return techniques::find("area-adaptive").map_or(&[], |i| i.params);
    }
    if file == "map/conservative.wgsl" {
        return techniques::find("csm-conservative").map_or(&[], |i| i.params);
    }
    let file = file.split(' ').next().unwrap();
    let stem = file.trim_start_matches("techniques/").trim_end_matches(".wgsl").replace('_', "-");
    techniques::find(&stem).map_or(&[], |i| i.params)
}

/// Every shader as passes are made of it, with the parameter groups that it is given: files that stand alone, and what looks maps
/// up with each filter that a technique may choose.
fn whole() -> Vec<(String, &'static [Group])> {
    let part = |f: &str| {
        ["map/choose/", "map/place/", "map/filter/", "map/warp/", "techniques/"].iter().any(|p| f.starts_with(p))
    };
    let parts = [
        "lib/analysis.wgsl",
        "lib/light_dots.wgsl",
        "map/look_up.wgsl",
        "map/places.wgsl",
        "map/ray_cells.wgsl",
        "map/analysis.wgsl",
        "map/single.wgsl",
        "map/around.wgsl",
        "map/edge_quads.wgsl",
        "map/edge_zoom.wgsl",
        "map/prefilter.wgsl",
        "map/story.wgsl",
        "map/sums.wgsl",
        "map/tiles.wgsl",
        "map/narrow_to.wgsl",
    ];
    let alone = shader_files().into_iter().filter(|f| !part(f) && !parts.contains(&f.as_str()));
    let mut all: Vec<_> = alone.map(|f| (f.clone(), groups(&f))).collect();
    for info in techniques::ALL.iter() {
        let own = format!("techniques/{}.wgsl", info.id.replace('-', "_"));
        // Warps have one file for one map, and one for maps in all directions, whatever these are.
        let stem = info.id.split('-').next().unwrap_or_default();
        let around = format!("techniques/{stem}_around.wgsl");
        let held = |file: &String| shader_files().contains(file);
        let file = match info.family {
            "All directions" if info.id == "omni-atlas" => own.as_str(),
            "All directions" if held(&around) => around.as_str(),
            "All directions" => "map/around.wgsl",
            _ if held(&own) => own.as_str(),
            _ => "map/single.wgsl",
        };
        // What maps in all directions have of their own looks nothing up.
        if held(&own) && file != own {
            all.push((own.clone(), info.params));
        }
        let filters: Vec<&Filter> = info.filter.into_iter().chain(info.choosable()).collect();
        all.extend(
            filters
                .iter()
                .map(|filter| (shader(file, filter, filter.moments.map(|of| of(&Values::new()))), info.params)),
        );
        // Maps of the sides of the view have a file beside that of a single one.
        let sides = format!("techniques/{}/sides.wgsl", info.id);
        let with_sides = filters.iter().filter(|_| held(&sides));
        all.extend(with_sides.map(|filter| (shader(&sides, filter, None), info.params)));
        // And what fits maps to some of the receivers.
        let fit = format!("techniques/{}/fit.wgsl", info.id.replace('-', "_"));
        all.extend(held(&fit).then_some((fit, info.params)));
        // Those with a single map and maps around a lamp have the latter's in a folder of their own.
        let folder = format!("techniques/{}/around.wgsl", info.id.replace('-', "_"));
        let in_folder = filters.iter().filter(|_| held(&folder));
        all.extend(in_folder.map(|filter| (shader(&folder, filter, None), info.params)));
        // What looks maps up by the common functions also tells of single pixels.
        let told: Vec<_> = all.iter().filter(|(file, _)| file.contains("map/filter/")).cloned().collect();
        for (file, groups) in told {
            let story = format!("{file} map/story.wgsl");
            if !file.contains("story") && !all.iter().any(|(held, _)| *held == story) {
                all.push((story, groups));
            }
        }
        if filters.is_empty() {
            all.push((own, info.params));
        }
    }
    all
}

#[test]
fn every_module_compiles() {
    let files = shader_files();
    assert!(files.len() >= 12, "shaders are missing from the binary: {files:?}");
    let (mut entries, mut beyond) = (0, Vec::new());
    for (file, groups) in &whole() {
        let program = Shaders::default().load(file, groups).unwrap_or_else(|e| panic!("{file}: {e:#}"));
        for entry in &program.module.entry_points {
            let bindings = program.bindings(&[&entry.name]).unwrap_or_else(|e| panic!("{file} {}: {e:#}", entry.name));
            let limits = wgpu::Limits::default();
            let many = |of: fn(&wgpu::BindingType) -> bool| bindings.iter().filter(|b| of(&b.entry.ty)).count() as u32;
            use wgpu::{BindingType as Type, BufferBindingType as Buffer};
            let kinds = [
                (
                    "storage buffers",
                    many(|t| matches!(t, Type::Buffer { ty: Buffer::Storage { .. }, .. })),
                    limits.max_storage_buffers_per_shader_stage,
                ),
                (
                    "uniform buffers",
                    many(|t| matches!(t, Type::Buffer { ty: Buffer::Uniform, .. })),
                    limits.max_uniform_buffers_per_shader_stage,
                ),
                (
                    "storage textures",
                    many(|t| matches!(t, Type::StorageTexture { .. })),
                    limits.max_storage_textures_per_shader_stage,
                ),
                ("textures", many(|t| matches!(t, Type::Texture { .. })), limits.max_sampled_textures_per_shader_stage),
                ("samplers", many(|t| matches!(t, Type::Sampler(_))), limits.max_samplers_per_shader_stage),
            ];
            for (kind, count, most) in kinds {
                if count > most {
                    beyond.push(format!("{file} {}: {count} {kind}, {most} guaranteed", entry.name));
                }
            }
            let [x, y, z] = entry.workgroup_size;
            if x * y * z > limits.max_compute_invocations_per_workgroup
                || x.max(y) > limits.max_compute_workgroup_size_x
            {
                beyond.push(format!("{file} {}: workgroups of {x} × {y} × {z}", entry.name));
            }
            entries += 1;
        }
    }
    assert!(beyond.is_empty(), "not every adapter can do this:\n{}", beyond.join("\n"));
    assert!(entries >= 10, "only {entries} entry points were found");
}

/// Uniforms that decide branches, as parameters and the frame do, lie in the first seven uniform buffers of each compute shader: of
/// later ones Mesa 22.3's software driver notes them past the end of a list.
#[test]
fn what_decides_branches_comes_first() {
    for (file, groups) in &whole() {
        let program = Shaders::default().load(file, groups).unwrap();
        for entry in program.module.entry_points.iter().filter(|e| e.stage == wgpu::naga::ShaderStage::Compute) {
            let bindings = program.bindings(&[&entry.name]).unwrap();
            let uniform = wgpu::BufferBindingType::Uniform;
            let is_uniform =
                |t: &wgpu::BindingType| matches!(t, wgpu::BindingType::Buffer { ty, .. } if *ty == uniform);
            for late in bindings.iter().filter(|b| is_uniform(&b.entry.ty)).skip(7) {
                let decides = groups.iter().any(|g| g.name == late.type_name) || late.type_name == "Frame";
                assert!(!decides, "{file} {}: {}", entry.name, late.name);
            }
        }
    }
}

#[test]
fn a_shader_error_names_file_and_line() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("lib")).unwrap();
    std::fs::write(folder.path().join("lib/a.wgsl"), "fn f() -> f32 {\n    return 1u;\n}\n").unwrap();
    std::fs::write(folder.path().join("b.wgsl"), "// first\n//!include lib/a.wgsl\n").unwrap();
    let shaders = Shaders::from_folder(folder.path());
    let error = shaders.load("b.wgsl", &[]).err().expect("an error").to_string();
    assert!(error.starts_with("lib/a.wgsl:2:") || error.starts_with("lib/a.wgsl:1:"), "{error}");
}

/// Offset and size of a WGSL struct's fields, and its own size.
fn layout(file: &str, name: &str) -> (Vec<(String, usize, usize)>, usize) {
    let program = Shaders::default().load(file, groups(file)).unwrap_or_else(|e| panic!("{e:#}"));
    let (_, ty) = program.module.types.iter().find(|(_, t)| t.name.as_deref() == Some(name)).expect(name);
    let naga::TypeInner::Struct { members, span } = &ty.inner else { panic!("{name} is no struct") };
    let size = |m: &naga::StructMember| program.module.types[m.ty].inner.size(program.module.to_ctx()) as usize;
    let fields = members.iter().map(|m| (m.name.clone().unwrap(), m.offset as usize, size(m))).collect();
    (fields, *span as usize)
}

macro_rules! same {
    ($file:literal, $wgsl:literal, $Rust:ty, $($field:ident $as:literal),* $(,)?) => {{
        fn field_size<T, F>(_: fn(&T) -> &F) -> usize { size_of::<F>() }
        let rust = vec![$(($as.to_string(), offset_of!($Rust, $field), field_size(|r: &$Rust| &r.$field))),*];
        let (wgsl, span) = layout($file, $wgsl);
        assert_eq!(wgsl, rust, "{} differs from {}", $wgsl, stringify!($Rust));
        assert_eq!(span, size_of::<$Rust>(), "{}'s size", $wgsl);
    }};
}

#[test]
fn shared_structs_agree() {
    same!("shade.wgsl", "Frame", FrameUniform,
        view_proj "view_proj", eye_proj "eye_proj", rays "rays", eye "eye", near "near", forward "forward",
        far "far", bounds_min "bounds_min", seed "seed", bounds_max "bounds_max", light_radius "light_radius",
        light_position "light_position", light_kind "light_kind", light_axis "light_axis", light_range "light_range",
        light_color "light_color", light_cosine "light_cosine", light_half_u "light_half_u", view "view",
        light_half_v "light_half_v", map "map", size "size", band "band", shadow_eye "shadow_eye", frozen "frozen",
        shadow_forward "shadow_forward", shadow_far "shadow_far", shadow_up "shadow_up", probe "probe",
        orthographic "orthographic", shadow_orthographic "shadow_orthographic", reach "reach", beyond "beyond",
        padding "padding", triangle_count "triangle_count");
    same!("shot.wgsl", "Shot", ShotUniform, size "size", whole "whole", channels "channels", stretched "stretched",
        layers "layers", columns "columns");
    same!("lines.wgsl", "Segment", Segment, start "start", color "color", end "end", weight "weight");
    same!("lines.wgsl", "Style", Style, half "half", labels "labels", inset "inset", padding "padding");
    same!("shade.wgsl", "View", ViewUniform, range "range", channel "channel", rows "rows", opacity "opacity",
        dilation "dilation", light_base "light_base", direct "direct", ambient "ambient", log "log", transparent "transparent",
        padding "padding");
    same!("counts.wgsl", "Counting", Counting,
        size "size", layers "layers", first "first", count "count", padding "padding", spare "spare", sides "sides");
    same!("map/cascades.wgsl", "Fitting", Fitting,
        count "count", blend "blend", narrow "narrow", margin "margin", reach "reach", least "least",
        smoothing "smoothing", opaque "opaque", triangles "triangles", culled "culled", padding "padding", sides "sides");
    same!("techniques/area_uniform.wgsl map/filter/nearest.wgsl", "Batch", Batch,
        steps "steps", half_u "half_u", half_v "half_v", depths "depths", count "count", agreeing "agreeing", nearest "nearest");
    same!("techniques/hybrid_pcf.wgsl map/filter/nearest.wgsl map/story.wgsl", "Looked", Looked,
        position "position", lit "lit", normal "normal", lit_next "lit_next", texel "texel", before "before", looked "looked",
        layer "layer", next "next", share "share", side "side", radius "radius", texel_size "texel_size", depth "depth",
        compared "compared", held "held", stored "stored", bias "bias", slope "slope", near "near", far "far",
        perspective "perspective", outside "outside", fall "fall", spread "spread", corners "corners", taps "taps");
    same!("map/faces.wgsl", "Faces", FacesUniform,
        count "count", triangles "triangles", opaque "opaque", listed "listed", met "met", vertices "vertices",
        angle "angle", metres "metres", axes "axes", regions "regions", frustum "frustum");
    same!("contact.wgsl", "Sweep", contact::Sweep,
        light "light", light_depth "light_depth", towards "towards", bands "bands");
    same!("map/silhouettes.wgsl", "Edge", Edge, ends "ends", first "first", count "count");
    same!("diagram.wgsl", "Stroke", Stroke, from "start", to "end", value "value", padding "padding");
    same!("gbuffer.wgsl", "Vertex", Vertex,
        position "position", normal "normal", uv "uv", material "material", color "color");
    same!("gbuffer.wgsl", "Material", GpuMaterial,
        base_color "base_color", texture "texture", cutoff "cutoff", double_sided "double_sided", wrap "wrap",
        texels "texels", nearest "nearest", padding "padding");
    same!("map/casters.wgsl", "LightView", LightView,
        row_x "row_x", row_y "row_y", row_z "row_z", row_w "row_w", axis "axis", near "near", far "far",
        perspective "perspective", texel "texel", resolution "resolution", margin "margin", reach "reach", ahead "ahead", layer "layer",
        idle "idle", padding "padding");
}

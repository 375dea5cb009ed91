//! Compares the draw shaders with the draw table and with the layouts of the Rust structs. The tests need no GPU: they
//! parse the shaders with naga, as wgpu does.

use std::mem::{offset_of, size_of};

use cagework_gpu::render::colormap;
use cagework_gpu::render::layout::{
    Camera, GizmoView, HIDDEN_STATE, STATE_SHIFT, SliceView, Style, Surface, surface_mode,
};
use cagework_gpu::render::model::DrawVertex;
use cagework_gpu::render::shaders::{self, ALL, DrawBinding, DrawShader};
use cagework_gpu::table::Entry;
use naga::valid::{Capabilities, ValidationFlags, Validator};
use naga::{AddressSpace, ImageClass, Literal, Scalar, ScalarKind, ShaderStage, TypeInner};

/// Limit on storage buffers per shader stage in WebGPU's baseline.
const MAX_STORAGE_BUFFERS: usize = 8;
/// Limit on the size of a uniform binding in WebGPU's baseline, bytes.
const MAX_UNIFORM_BYTES: usize = 65_536;

fn parse(shader: &DrawShader) -> naga::Module {
    naga::front::wgsl::parse_str(shader.wgsl)
        .unwrap_or_else(|e| panic!("{}", e.emit_to_string_with_path(shader.wgsl, shader.name)))
}

#[test]
fn draw_shaders_are_baseline_webgpu() {
    for shader in ALL {
        let module = parse(shader);
        Validator::new(ValidationFlags::all(), Capabilities::empty())
            .validate(&module)
            .unwrap_or_else(|e| panic!("{}", e.emit_to_string_with_path(shader.wgsl, shader.name)));
        let stages: Vec<_> = module.entry_points.iter().map(|e| (e.name.as_str(), e.stage)).collect();
        let wanted = [("vertex", ShaderStage::Vertex), ("fragment", ShaderStage::Fragment)];
        assert_eq!(stages, wanted, "{}", shader.name);
        let n_storage =
            shader.groups.iter().copied().flatten().filter(|b| matches!(b, DrawBinding::Table(_))).count();
        assert!(n_storage <= MAX_STORAGE_BUFFERS, "{}: {n_storage} storage buffers", shader.name);
    }
}

/// Type of a buffer's entries.
fn entry(inner: &TypeInner) -> Entry {
    use naga::VectorSize::{Bi, Quad};
    match inner {
        TypeInner::Vector { size: Quad, scalar: Scalar { kind: ScalarKind::Float, width: 4 } } => {
            Entry::Point
        }
        TypeInner::Vector { size: Bi, scalar: Scalar { kind: ScalarKind::Uint, width: 4 } } => Entry::Pair,
        TypeInner::Scalar(Scalar { kind: ScalarKind::Float, width: 4 }) => Entry::Value,
        other => panic!("a table of {other:?}"),
    }
}

#[test]
fn bindings_equal_the_draw_table() {
    for shader in ALL {
        let module = parse(shader);
        let mut found: Vec<_> = module
            .global_variables
            .iter()
            .filter_map(|(_, variable)| {
                let binding = variable.binding?;
                let kind = match (variable.space, &module.types[variable.ty].inner) {
                    (AddressSpace::Uniform, _) => DrawBinding::Uniform,
                    (AddressSpace::Storage { access }, TypeInner::Array { base, .. }) => {
                        assert_eq!(
                            access,
                            naga::StorageAccess::LOAD,
                            "{}: storage buffers are read-only",
                            shader.name
                        );
                        DrawBinding::Table(entry(&module.types[*base].inner))
                    }
                    (_, TypeInner::Image { class: ImageClass::Sampled { .. }, .. }) => DrawBinding::Texture,
                    (_, TypeInner::Sampler { comparison: false }) => DrawBinding::Sampler,
                    other => panic!("{}: a binding of {other:?}", shader.name),
                };
                Some((binding.group, binding.binding, kind))
            })
            .collect();
        found.sort_by_key(|(group, binding, _)| (*group, *binding));
        let mut wanted = Vec::new();
        if shader.name != shaders::PART.name {
            wanted.push((0, 0, DrawBinding::Uniform));
        }
        for (group, bindings) in (1u32..).zip(shader.groups) {
            wanted.extend((0u32..).zip(*bindings).map(|(binding, kind)| (group, binding, *kind)));
        }
        assert_eq!(found, wanted, "{}", shader.name);
    }
}

/// Names and offsets of the members of a WGSL struct, and its size.
fn members(shader: &DrawShader, name: &str) -> (Vec<(String, usize)>, usize) {
    let module = parse(shader);
    module
        .types
        .iter()
        .find_map(|(_, t)| match &t.inner {
            TypeInner::Struct { members, span } if t.name.as_deref() == Some(name) => {
                let members =
                    members.iter().map(|m| (m.name.clone().unwrap_or_default(), m.offset as usize)).collect();
                Some((members, *span as usize))
            }
            _ => None,
        })
        .unwrap_or_else(|| panic!("{} has no struct {name}", shader.name))
}

#[test]
fn uniforms_mirror_their_wgsl_structs() {
    macro_rules! same {
        ($shader:expr, $type:ident, $($field:ident),+) => {
            let mirror = vec![$((stringify!($field).to_owned(), offset_of!($type, $field))),+];
            let (wgsl, span) = members($shader, stringify!($type));
            assert_eq!(wgsl, mirror, "{} in {}", stringify!($type), $shader.name);
            assert_eq!(span, size_of::<$type>(), "{} in {}", stringify!($type), $shader.name);
            assert!(span <= MAX_UNIFORM_BYTES);
        };
    }
    for shader in ALL.iter().filter(|s| s.name != shaders::PART.name) {
        same!(
            shader,
            Camera,
            clip_from_world,
            view_from_world,
            eye,
            perspective,
            viewport,
            scale,
            encode,
            background_top,
            background_bottom,
            floor_color,
            floor_center,
            floor_radius,
            floor_spacing,
            lift,
            pixel
        );
    }
    for shader in [&shaders::LINES, &shaders::POINTS, &shaders::FACES] {
        same!(shader, Style, colors, widths, rim_color, rim, lift, opacity, size);
    }
    same!(&shaders::MESH, Surface, base_color, mode, alpha_cutoff, low, high);
    same!(&shaders::SLICE, SliceView, corner, high, u, n_u, v, n_v, kinds, line_color);
    same!(&shaders::GIZMO, GizmoView, world_from_gizmo);
    assert_eq!(size_of::<DrawVertex>(), 20, "u32, two f32, four u16");
}

fn constant(shader: &DrawShader, name: &str) -> f64 {
    let module = parse(shader);
    let (_, constant) = module
        .constants
        .iter()
        .find(|(_, c)| c.name.as_deref() == Some(name))
        .unwrap_or_else(|| panic!("{} has no constant {name}", shader.name));
    match module.global_expressions[constant.init] {
        naga::Expression::Literal(Literal::U32(x)) => f64::from(x),
        naga::Expression::Literal(Literal::F32(x)) => f64::from(x),
        naga::Expression::Literal(Literal::AbstractFloat(x)) => x,
        ref other => panic!("{name} is {other:?}"),
    }
}

#[test]
fn constants_equal_those_of_rust() {
    let same = |shader: &DrawShader, name: &str, value: f64| {
        assert_eq!(constant(shader, name), value, "{name} in {}", shader.name);
    };
    same(&shaders::MESH, "MATERIAL", f64::from(surface_mode::MATERIAL));
    same(&shaders::MESH, "WEIGHTS", f64::from(surface_mode::WEIGHTS));
    same(&shaders::MESH, "ERRORS", f64::from(surface_mode::ERRORS));
    same(&shaders::MESH, "CLAY", f64::from(surface_mode::CLAY));
    same(&shaders::MESH, "ALPHA_BLENDING", f64::from(surface_mode::ALPHA_BLENDING));
    same(&shaders::LINES, "STATE_SHIFT", f64::from(STATE_SHIFT));
    same(&shaders::LINES, "HIDDEN_STATE", f64::from(HIDDEN_STATE));
    // Compare as f32, because the shader's constant is parsed as f64.
    assert_eq!(constant(&shaders::MESH, "NEGATIVE_THRESHOLD") as f32, colormap::NEGATIVE_THRESHOLD);
}

/// The WGSL source contains each stop of [`colormap::STOPS`].
#[test]
fn colour_map_is_the_same_in_wgsl() {
    let text: String = shaders::MESH.wgsl.split_whitespace().collect();
    for [r, g, b] in colormap::STOPS {
        let stop = format!("vec3f({r}.0,{g}.0,{b}.0)");
        assert!(text.contains(&stop), "{stop} is missing");
    }
}

/// Shaders for WebGL2 have no buffers except uniforms, and naga translates them to GLSL ES 3.00.
#[cfg(feature = "webgl")]
#[test]
fn draw_shaders_are_webgl2() {
    use naga::back::glsl::{Options, PipelineOptions, Version, Writer};
    for shader in ALL {
        let wgsl = shader.wgsl_textures;
        let module = naga::front::wgsl::parse_str(wgsl)
            .unwrap_or_else(|e| panic!("{}", e.emit_to_string_with_path(wgsl, shader.name)));
        let info = Validator::new(ValidationFlags::all(), Capabilities::empty())
            .validate(&module)
            .unwrap_or_else(|e| panic!("{}", e.emit_to_string_with_path(wgsl, shader.name)));
        for (_, variable) in module.global_variables.iter() {
            assert!(
                !matches!(variable.space, AddressSpace::Storage { .. }),
                "{}: {:?} is in a buffer",
                shader.name,
                variable.name
            );
        }
        for (entry_point, shader_stage) in
            [("vertex", ShaderStage::Vertex), ("fragment", ShaderStage::Fragment)]
        {
            let options =
                Options { version: Version::Embedded { version: 300, is_webgl: true }, ..Options::default() };
            let pipeline =
                PipelineOptions { shader_stage, entry_point: entry_point.to_owned(), multiview: None };
            let mut glsl = String::new();
            Writer::new(
                &mut glsl,
                &module,
                &info,
                &options,
                &pipeline,
                naga::proc::BoundsCheckPolicies::default(),
            )
            .and_then(|mut writer| writer.write().map(drop))
            .unwrap_or_else(|e| panic!("{}, {entry_point}: {e}", shader.name));
            assert!(glsl.starts_with("#version 300 es"), "{}", shader.name);
        }
    }
}

/// The width of texture rows is the same in shaders and in Rust.
#[cfg(feature = "webgl")]
#[test]
fn texture_row_width_is_the_same_in_wgsl() {
    let shift = cagework_gpu::table::ENTRIES_PER_ROW.trailing_zeros();
    assert!(shaders::MESH.wgsl_textures.contains(&format!("const ROW_SHIFT = {shift}u;")));
}

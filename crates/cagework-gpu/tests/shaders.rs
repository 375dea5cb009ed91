//! Compares the kernels with the kernel table and with Rust's layouts. The tests need no GPU: they parse the kernels
//! with naga, as wgpu does.

use std::mem::{offset_of, size_of};

use cagework_core::stencil;
use cagework_gpu::kernels::{self, ALL, BindingType, Kernel};
use cagework_gpu::layout::{Work, mode};
use cagework_gpu::render::shaders::ALL as DRAWN;
use cagework_gpu::splats::{BINS, Depths, FLOATER, MIRROR};
use naga::valid::{Capabilities, ValidationFlags, Validator};
use naga::{AddressSpace, Literal, StorageAccess, TypeInner};

/// Limits of baseline WebGPU: storage buffers of a shader stage, and invocations of a workgroup.
const MAX_STORAGE_BUFFERS: usize = 8;
const MAX_INVOCATIONS: u32 = 256;

/// Maximum number of lines of a shader file.
const MAX_LINES: usize = 120;

fn parse(kernel: &Kernel) -> naga::Module {
    naga::front::wgsl::parse_str(kernel.wgsl)
        .unwrap_or_else(|e| panic!("{}", e.emit_to_string_with_path(kernel.wgsl, kernel.name)))
}

#[test]
fn shaders_are_baseline_webgpu() {
    for kernel in ALL {
        let module = parse(kernel);
        Validator::new(ValidationFlags::all(), Capabilities::empty())
            .validate(&module)
            .unwrap_or_else(|e| panic!("{}", e.emit_to_string_with_path(kernel.wgsl, kernel.name)));
        let n_storage = kernel.bindings.iter().filter(|b| **b != BindingType::Uniform).count();
        assert!(n_storage <= MAX_STORAGE_BUFFERS, "{}: {n_storage} storage buffers", kernel.name);
        assert!(kernel.workgroup <= MAX_INVOCATIONS, "{}: {} invocations", kernel.name, kernel.workgroup);
    }
}

#[test]
fn bindings_and_workgroups_equal_the_table() {
    for kernel in ALL {
        let module = parse(kernel);
        assert_eq!(module.entry_points.len(), 1, "{}", kernel.name);
        let entry = &module.entry_points[0];
        assert_eq!(entry.name, kernel.name, "the entry point has the file's name");
        assert_eq!(entry.workgroup_size, [kernel.workgroup, 1, 1], "{}", kernel.name);
        let mut found: Vec<_> = module
            .global_variables
            .iter()
            .filter_map(|(_, variable)| {
                let binding = variable.binding?;
                let kind = match variable.space {
                    AddressSpace::Uniform => BindingType::Uniform,
                    AddressSpace::Storage { access } if access.contains(StorageAccess::STORE) => {
                        BindingType::ReadWrite
                    }
                    AddressSpace::Storage { .. } => BindingType::Read,
                    space => panic!("{}: a binding in {space:?}", kernel.name),
                };
                Some((binding.group, binding.binding, kind))
            })
            .collect();
        found.sort_by_key(|(group, binding, _)| (*group, *binding));
        let wanted: Vec<_> = (0u32..).zip(kernel.bindings).map(|(i, kind)| (0, i, *kind)).collect();
        assert_eq!(found, wanted, "{}", kernel.name);
    }
}

#[test]
fn structs_mirror_their_wgsl() {
    macro_rules! same {
        ($kernel:expr, $type:ident, $($field:ident),+) => {
            let mirror = vec![$((stringify!($field).to_owned(), offset_of!($type, $field))),+];
            let (wgsl, span) = members($kernel, stringify!($type));
            assert_eq!(wgsl, mirror, "{} in {}", stringify!($type), $kernel.name);
            assert_eq!(span, size_of::<$type>(), "{} in {}", stringify!($type), $kernel.name);
        };
    }
    for kernel in ALL {
        same!(kernel, Work, first, count, stride, n_quads, first_row, first_quad, mode, n_sources, omega);
    }
    for kernel in [&kernels::COUNT_SPLATS, &kernels::SCAN_SPLATS, &kernels::SCATTER_SPLATS] {
        same!(
            kernel, Depths, axis, offset, viewer, n_splats, per_block, n_blocks, hides, degree, unit, unused
        );
    }
}

/// Names and byte offsets of the members of a WGSL struct, and the size of the struct in bytes.
fn members(kernel: &Kernel, name: &str) -> (Vec<(String, usize)>, usize) {
    let module = parse(kernel);
    let found = module.types.iter().find_map(|(_, t)| match &t.inner {
        TypeInner::Struct { members, span } if t.name.as_deref() == Some(name) => {
            let of = |m: &naga::StructMember| (m.name.clone().unwrap_or_default(), m.offset as usize);
            Some((members.iter().map(of).collect(), *span as usize))
        }
        _ => None,
    });
    found.unwrap_or_else(|| panic!("{} has no struct {name}", kernel.name))
}

/// Value of a constant in the shader.
fn constant(kernel: &Kernel, name: &str) -> f64 {
    let module = parse(kernel);
    let (_, constant) = module
        .constants
        .iter()
        .find(|(_, c)| c.name.as_deref() == Some(name))
        .unwrap_or_else(|| panic!("{} has no constant {name}", kernel.name));
    match module.global_expressions[constant.init] {
        naga::Expression::Literal(Literal::U32(x)) => f64::from(x),
        naga::Expression::Literal(Literal::F32(x)) => f64::from(x),
        naga::Expression::Literal(Literal::AbstractFloat(x)) => x,
        naga::Expression::Literal(Literal::AbstractInt(x)) => x as f64,
        ref other => panic!("{name} is {other:?}"),
    }
}

#[test]
fn constants_equal_those_of_rust() {
    let same = |kernel: &Kernel, name: &str, value: f64| {
        assert_eq!(constant(kernel, name), value, "{name} in {}", kernel.name);
    };
    same(&kernels::CHANGE_NORMS, "CHANGE_FIRST", f64::from(mode::CHANGE_FIRST));
    same(&kernels::PROLONG_CORRECTION, "PROLONG_REPLACE", f64::from(mode::PROLONG_REPLACE));
    same(&kernels::PROLONG_CORRECTION, "ENTRY_HEAD", stencil::tables::ENTRY_HEAD as f64);
    same(&kernels::DEFORM_VERTICES, "BUNDLE", stencil::tables::BUNDLE as f64);
    same(&kernels::DEFORM_VERTICES, "SLICE", stencil::tables::SLICE as f64);
    same(&kernels::SUM_SQUARES, "REDUCE_LANES", stencil::REDUCE_LANES as f64);
    same(&kernels::SUM_SQUARES, "REDUCE_VALUES", stencil::REDUCE_VALUES as f64);
    same(&kernels::COUNT_SPLATS, "BINS", f64::from(BINS));
    same(&kernels::DEFORM_SPLATS, "ROTATIONS", f64::from(mode::ROTATIONS));
    same(&kernels::SCATTER_SPLATS, "FLOATER", f64::from(FLOATER));
    same(&kernels::DEFORM_SPLATS, "MIRROR", f64::from(MIRROR));
    same(&kernels::SCATTER_SPLATS, "MIRROR", f64::from(MIRROR));
    same(&kernels::COUNT_SPLATS, "LOWER_DIGIT", f64::from(mode::LOWER_DIGIT));
    let centre = f64::from(cagework_core::transfer::RESTRICT_CENTRE);
    same(&kernels::RESTRICT_RESIDUAL, "RESTRICT_CENTRE", centre);
    same(&kernels::RESTRICT_RESIDUAL, "RESTRICT_EDGE", f64::from(cagework_core::transfer::RESTRICT_EDGE));
}

#[test]
fn every_shader_file_is_used_and_short() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shaders");
    for file in std::fs::read_dir(folder).unwrap().map(|f| f.unwrap().path()) {
        let text = std::fs::read_to_string(&file).unwrap();
        let name = file.file_stem().unwrap().to_str().unwrap();
        assert!(text.lines().count() <= MAX_LINES, "{name} has more than {MAX_LINES} lines");
        assert!(text.starts_with("// "), "{name} has no description in its first line");
        let used = ALL.iter().any(|k| k.wgsl.contains(&text)) || DRAWN.iter().any(|d| d.wgsl.contains(&text));
        // Shaders that read textures instead of storage buffers are built only with the feature `webgl`, which tests of
        // the whole workspace enable.
        #[cfg(feature = "webgl")]
        let used = used || DRAWN.iter().any(|d| d.wgsl_textures.contains(&text));
        #[cfg(not(feature = "webgl"))]
        let used = used || name == "rows" || name.ends_with("_textures");
        assert!(used, "{name} is used by no kernel or draw shader");
    }
}

//! Every registered shader is valid within WebGPU's default limits and agrees with the Rust side
//! about bindings and parameter structs.
use mte_slam_core::{
    kernels::{self, Access, FieldKind, Kernel},
    shader,
};
use naga::{AddressSpace, ScalarKind, StorageAccess, TypeInner, VectorSize};

fn parse(kernel: &Kernel, unroll: u32) -> naga::Module {
    let source = shader::compose(kernel, &[("UNROLL", unroll)]).unwrap();
    let module = naga::front::wgsl::parse_str(&source)
        .unwrap_or_else(|error| panic!("{}: {}", kernel.name, error.emit_to_string(&source)));
    naga::valid::Validator::new(
        naga::valid::ValidationFlags::all(),
        naga::valid::Capabilities::empty(),
    )
    .validate(&module)
    .unwrap_or_else(|error| panic!("{}: {}", kernel.name, error.emit_to_string(&source)));
    module
}

#[test]
fn shaders_are_valid_within_the_default_limits() {
    for kernel in kernels::all() {
        for unroll in [0, 1] {
            let module = parse(kernel, unroll);
            let [entry] = &module.entry_points[..] else { panic!("{}: entries", kernel.name) };
            assert_eq!(entry.name, "main", "{}", kernel.name);
            assert_eq!(entry.workgroup_size, [kernel.workgroup_size, 1, 1], "{}", kernel.name);
            assert!(kernel.workgroup_size <= 256 && kernel.bindings.len() <= 8, "{}", kernel.name);
            let workgroup_bytes: u32 = module
                .global_variables
                .iter()
                .filter(|(_, variable)| variable.space == AddressSpace::WorkGroup)
                .map(|(_, variable)| {
                    module.types[variable.ty].inner.size(module.to_ctx()).next_multiple_of(16)
                })
                .sum();
            assert!(workgroup_bytes <= 16_384, "{}: {workgroup_bytes}", kernel.name);
        }
    }
}

#[test]
fn bindings_agree_with_the_registry() {
    for kernel in kernels::all() {
        let module = parse(kernel, 1);
        let mut found = Vec::new();
        for (_, variable) in module.global_variables.iter() {
            let Some(binding) = variable.binding else { continue };
            assert_eq!(binding.group, 0, "{}", kernel.name);
            let name = variable.name.clone().unwrap_or_default();
            match variable.space {
                AddressSpace::Uniform => {
                    assert_eq!((binding.binding, name.as_str()), (0, "params"), "{}", kernel.name);
                }
                AddressSpace::Storage { access } => {
                    let access = if access.contains(StorageAccess::STORE) {
                        Access::ReadWrite
                    } else {
                        Access::Read
                    };
                    found.push((binding.binding, name, access));
                }
                other => panic!("{}: {name} is in {other:?}", kernel.name),
            }
        }
        found.sort_by_key(|(number, ..)| *number);
        let expected: Vec<_> = (1..)
            .zip(kernel.bindings)
            .map(|(number, binding)| (number, binding.name.to_string(), binding.access))
            .collect();
        assert_eq!(found, expected, "{}", kernel.name);
    }
}

fn kind(inner: &TypeInner) -> Option<FieldKind> {
    Some(match inner {
        TypeInner::Scalar(scalar) => match scalar.kind {
            ScalarKind::Uint => FieldKind::U32,
            ScalarKind::Sint => FieldKind::I32,
            ScalarKind::Float => FieldKind::F32,
            _ => return None,
        },
        TypeInner::Vector { size: VectorSize::Quad, scalar } => match scalar.kind {
            ScalarKind::Uint => FieldKind::U32x4,
            ScalarKind::Sint => FieldKind::I32x4,
            ScalarKind::Float => FieldKind::F32x4,
            _ => return None,
        },
        _ => return None,
    })
}

#[test]
fn parameter_structs_have_equal_layouts() {
    for kernel in kernels::all() {
        let module = parse(kernel, 1);
        let variable = module
            .global_variables
            .iter()
            .find(|(_, variable)| variable.space == AddressSpace::Uniform)
            .map(|(_, variable)| variable)
            .unwrap_or_else(|| panic!("{}: no params", kernel.name));
        let ty = &module.types[variable.ty];
        assert_eq!(ty.name.as_deref(), Some("Params"), "{}", kernel.name);
        let TypeInner::Struct { members, span } = &ty.inner else {
            panic!("{}: params is not a struct", kernel.name)
        };
        let wgsl: Vec<_> = members
            .iter()
            .map(|member| {
                let name = member.name.clone().unwrap_or_default();
                let kind = kind(&module.types[member.ty].inner);
                (name, member.offset as usize, kind)
            })
            .collect();
        let rust: Vec<_> = kernel
            .params
            .fields
            .iter()
            .map(|field| (field.name.to_string(), field.offset, Some(field.kind)))
            .collect();
        assert_eq!(wgsl, rust, "{}", kernel.name);
        let rounded = kernel.params.size.next_multiple_of(16);
        assert_eq!(span.next_multiple_of(16) as usize, rounded, "{}", kernel.name);
    }
}

#[test]
fn kernel_names_are_unique() {
    let mut names: Vec<_> = kernels::all().iter().map(|kernel| kernel.name).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), kernels::all().len());
}

//! Every registered shader is valid within WebGPU's default limits and agrees with the Rust side
//! about bindings and parameter structs.
use mte_slam_core::{
    kernel::Kernel,
    kernels, shader,
    shaders::{
        self,
        interface::{Access, ElementType},
        structs::{FieldKind, StructLayout},
    },
};
use naga::{AddressSpace, Handle, ScalarKind, StorageAccess, Type, TypeInner, VectorSize};

fn parse(kernel: &Kernel) -> naga::Module {
    let source = shader::compose(kernel.interface, &[]).unwrap();
    let module = naga::front::wgsl::parse_str(&source).unwrap_or_else(|error| {
        panic!("{}: {}", kernel.interface.name, error.emit_to_string(&source))
    });
    naga::valid::Validator::new(
        naga::valid::ValidationFlags::all(),
        naga::valid::Capabilities::empty(),
    )
    .validate(&module)
    .unwrap_or_else(|error| panic!("{}: {}", kernel.interface.name, error.emit_to_string(&source)));
    module
}

#[test]
fn shaders_are_valid_within_the_default_limits() {
    for kernel in kernels::all() {
        {
            let module = parse(kernel);
            let [entry] = &module.entry_points[..] else {
                panic!("{}: entries", kernel.interface.name)
            };
            assert_eq!(entry.name, "main", "{}", kernel.interface.name);
            assert_eq!(
                entry.workgroup_size,
                [kernel.interface.workgroup_size, 1, 1],
                "{}",
                kernel.interface.name
            );
            let (size, bindings) =
                (kernel.interface.workgroup_size, kernel.interface.bindings.len());
            assert!(size <= 256 && bindings <= 8, "{}", kernel.interface.name);
            let workgroup_bytes: u32 = module
                .global_variables
                .iter()
                .filter(|(_, variable)| variable.space == AddressSpace::WorkGroup)
                .map(|(_, variable)| {
                    module.types[variable.ty].inner.size(module.to_ctx()).next_multiple_of(16)
                })
                .sum();
            assert!(workgroup_bytes <= 16_384, "{}: {workgroup_bytes}", kernel.interface.name);
        }
    }
}

#[test]
fn bindings_agree_with_the_registry() {
    for kernel in kernels::all() {
        let module = parse(kernel);
        let mut found = Vec::new();
        for (_, variable) in module.global_variables.iter() {
            let Some(binding) = variable.binding else { continue };
            assert_eq!(binding.group, 0, "{}", kernel.interface.name);
            let name = variable.name.clone().unwrap_or_default();
            match variable.space {
                AddressSpace::Uniform => {
                    assert_eq!(
                        (binding.binding, name.as_str()),
                        (0, "params"),
                        "{}",
                        kernel.interface.name
                    );
                }
                AddressSpace::Storage { access } => {
                    let TypeInner::Array { base, stride, .. } = module.types[variable.ty].inner
                    else {
                        panic!("{}: {name} is no array", kernel.interface.name)
                    };
                    let (element, size) = element(&module, base);
                    // What a host's slice of elements has between them.
                    assert_eq!(stride as usize, size, "{}: {name}", kernel.interface.name);
                    let atomic = matches!(module.types[base].inner, TypeInner::Atomic(_));
                    let access = match (access.contains(StorageAccess::STORE), atomic) {
                        (false, _) => Access::Read,
                        (true, false) => Access::ReadWrite,
                        (true, true) => Access::Atomic,
                    };
                    found.push((binding.binding, name, access, element));
                }
                other => panic!("{}: {name} is in {other:?}", kernel.interface.name),
            }
        }
        found.sort_by_key(|(number, ..)| *number);
        let expected: Vec<_> = (1..)
            .zip(kernel.interface.bindings)
            .map(|(number, b)| (number, b.name.to_string(), b.access, Some(b.element)))
            .collect();
        assert_eq!(found, expected, "{}", kernel.interface.name);
    }
}

/// The element of a buffer as its declaration should have it, and its size \[bytes\].
fn element(module: &naga::Module, ty: Handle<Type>) -> (Option<ElementType>, usize) {
    let ty = &module.types[ty];
    let size = ty.inner.size(module.to_ctx()) as usize;
    if let TypeInner::Struct { .. } = ty.inner {
        let layout = structs().into_iter().find(|layout| Some(layout.name) == ty.name.as_deref());
        if let Some(layout) = layout {
            assert_eq!(members(module, &ty.inner), fields(layout), "{}", layout.name);
            assert_eq!(size, layout.size, "{}", layout.name);
        }
        return (layout.map(ElementType::Struct), size);
    }
    (kind(&ty.inner).map(ElementType::Value), size)
}

/// Layouts of all structs that buffers hold.
fn structs() -> Vec<&'static StructLayout> {
    let bindings = kernels::all().iter().flat_map(|kernel| kernel.interface.bindings);
    bindings
        .filter_map(|binding| match binding.element {
            ElementType::Struct(layout) => Some(layout),
            ElementType::Value(_) => None,
        })
        .collect()
}

type Member = (String, usize, Option<FieldKind>);

/// Fields of a struct as the shader has them.
fn members(module: &naga::Module, inner: &TypeInner) -> Vec<Member> {
    let TypeInner::Struct { members, .. } = inner else { return Vec::new() };
    members
        .iter()
        .map(|member| {
            let name = member.name.clone().unwrap_or_default();
            (name, member.offset as usize, kind(&module.types[member.ty].inner))
        })
        .collect()
}

/// Fields of a struct as Rust has them.
fn fields(layout: &StructLayout) -> Vec<Member> {
    layout.fields.iter().map(|f| (f.name.to_string(), f.offset, Some(f.kind))).collect()
}

fn kind(inner: &TypeInner) -> Option<FieldKind> {
    Some(match inner {
        TypeInner::Scalar(scalar) | TypeInner::Atomic(scalar) => match scalar.kind {
            ScalarKind::Uint => FieldKind::U32,
            ScalarKind::Sint => FieldKind::I32,
            ScalarKind::Float => FieldKind::F32,
            _ => return None,
        },
        TypeInner::Vector { size: VectorSize::Bi, scalar } => match scalar.kind {
            ScalarKind::Float => FieldKind::F32x2,
            _ => return None,
        },
        TypeInner::Vector { size: VectorSize::Tri, scalar } => match scalar.kind {
            ScalarKind::Float => FieldKind::F32x3,
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
        let module = parse(kernel);
        let variable = module
            .global_variables
            .iter()
            .find(|(_, variable)| variable.space == AddressSpace::Uniform)
            .map(|(_, variable)| variable)
            .unwrap_or_else(|| panic!("{}: no params", kernel.interface.name));
        let ty = &module.types[variable.ty];
        assert_eq!(ty.name.as_deref(), Some("Params"), "{}", kernel.interface.name);
        let TypeInner::Struct { span, .. } = &ty.inner else {
            panic!("{}: params is not a struct", kernel.interface.name)
        };
        let (wgsl, rust) = (members(&module, &ty.inner), fields(kernel.interface.params));
        assert_eq!(wgsl, rust, "{}", kernel.interface.name);
        let rounded = kernel.interface.params.size.next_multiple_of(16);
        assert_eq!(span.next_multiple_of(16) as usize, rounded, "{}", kernel.interface.name);
    }
}

#[test]
fn kernel_names_are_unique() {
    let mut names: Vec<_> = kernels::all().iter().map(|kernel| kernel.interface.name).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), kernels::all().len());
}

/// Every declared kernel has its twin.
#[test]
fn declarations_and_twins_are_the_same_kernels() {
    let declared: Vec<_> = shaders::kernels::ALL.iter().map(|interface| interface.name).collect();
    let twins: Vec<_> = kernels::all().iter().map(|kernel| kernel.interface.name).collect();
    assert_eq!(declared, twins);
}

//! The declarations that a shader's header makes of its interface.
use crate::{
    interface::{Access, ElementType, Interface},
    structs::StructLayout,
};
use alloc::{format, string::String};

/// Number of the first storage binding; 0 is that of the parameters.
const FIRST_BINDING: usize = 1;

/// Parameters, structs and bindings of `interface`, one declaration per line.
pub(crate) fn header(interface: &Interface) -> String {
    let mut out = String::new();
    if !interface.params.fields.is_empty() {
        declare(&mut out, "Params", interface.params);
        out.push_str("@group(0) @binding(0) var<uniform> params: Params;\n");
    }
    for (i, binding) in interface.bindings.iter().enumerate() {
        if let ElementType::Struct(layout) = binding.element {
            let earlier = interface.bindings[..i].iter().any(|b| b.element == binding.element);
            if !earlier {
                declare(&mut out, layout.name, layout);
            }
        }
    }
    for (binding, number) in interface.bindings.iter().zip(FIRST_BINDING..) {
        let (name, element) = (binding.name, binding.element.wgsl());
        let (access, before, behind) = match binding.access {
            Access::Read => ("read", "", ""),
            Access::ReadWrite => ("read_write", "", ""),
            Access::Atomic => ("read_write", "atomic<", ">"),
        };
        out.push_str(&format!(
            "@group(0) @binding({number}) var<storage, {access}> {name}: array<{before}{element}{behind}>;\n"
        ));
    }
    out
}

fn declare(out: &mut String, name: &str, layout: &StructLayout) {
    out.push_str(&format!("struct {name} {{\n"));
    for field in layout.fields {
        out.push_str(&format!("    {}: {},\n", field.name, field.kind.wgsl()));
    }
    out.push_str("}\n");
}

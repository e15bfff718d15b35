//! Structs that Rust and WGSL share, and their layouts.

/// Type of a field of a shared struct.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub enum FieldKind {
    /// `u32`.
    U32,
    /// `i32`.
    I32,
    /// `f32`.
    F32,
    /// `vec2<f32>`.
    F32x2,
    /// `vec3<f32>`.
    F32x3,
    /// `vec4<u32>`.
    U32x4,
    /// `vec4<i32>`.
    I32x4,
    /// `vec4<f32>`.
    F32x4,
}

impl FieldKind {
    /// The type's name in WGSL.
    pub const fn wgsl(self) -> &'static str {
        match self {
            FieldKind::U32 => "u32",
            FieldKind::I32 => "i32",
            FieldKind::F32 => "f32",
            FieldKind::F32x2 => "vec2<f32>",
            FieldKind::F32x3 => "vec3<f32>",
            FieldKind::U32x4 => "vec4<u32>",
            FieldKind::I32x4 => "vec4<i32>",
            FieldKind::F32x4 => "vec4<f32>",
        }
    }

    /// The type's alignment in WGSL \[bytes\].
    pub const fn alignment(self) -> usize {
        match self {
            FieldKind::U32 | FieldKind::I32 | FieldKind::F32 => 4,
            FieldKind::F32x2 => 8,
            FieldKind::F32x3 | FieldKind::U32x4 | FieldKind::I32x4 | FieldKind::F32x4 => 16,
        }
    }
}

/// A field of a shared struct.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub struct Field {
    /// Name on both sides.
    pub name: &'static str,
    /// Offset \[bytes\].
    pub offset: usize,
    /// Type on both sides.
    pub kind: FieldKind,
}

impl Field {
    /// A field; refuses at compile time an offset that WGSL would not give it.
    pub const fn new(name: &'static str, offset: usize, kind: FieldKind) -> Self {
        assert!(offset.is_multiple_of(kind.alignment()), "vectors go at multiples of their size");
        Self { name, offset, kind }
    }
}

/// Layout of a shared struct.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub struct StructLayout {
    /// Name of the Rust struct. WGSL calls a parameter struct `Params`, others by this name.
    pub name: &'static str,
    /// Fields in order.
    pub fields: &'static [Field],
    /// Size of the Rust struct \[bytes\]. The WGSL size is this rounded up to 16 when there is a
    /// 4-vector among the fields, otherwise this.
    pub size: usize,
}

/// A struct made by [`shared_struct!`](crate::shared_struct).
pub trait SharedStruct: bytemuck::Pod {
    /// Names, offsets and types of the fields.
    const LAYOUT: StructLayout;
}

/// A Rust type that a shared struct may contain.
pub trait FieldType {
    /// The type's counterpart in WGSL.
    const KIND: FieldKind;
}

macro_rules! field_type {
    ($($rust:ty => $kind:ident),*) => {
        $(impl FieldType for $rust {
            const KIND: FieldKind = FieldKind::$kind;
        })*
    };
}
field_type!(u32 => U32, i32 => I32, f32 => F32, [f32; 2] => F32x2, [f32; 3] => F32x3,
    [u32; 4] => U32x4, [i32; 4] => I32x4, [f32; 4] => F32x4);

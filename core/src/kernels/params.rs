//! Uniform parameter structs and their layouts.

/// Type of a field of a parameter struct.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub enum FieldKind {
    /// `u32`.
    U32,
    /// `i32`.
    I32,
    /// `f32`.
    F32,
    /// `vec4<u32>`.
    U32x4,
    /// `vec4<i32>`.
    I32x4,
    /// `vec4<f32>`.
    F32x4,
}

/// A field of a parameter struct.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub struct ParamsField {
    /// Name on both sides.
    pub name: &'static str,
    /// Offset \[bytes\].
    pub offset: usize,
    /// Type on both sides.
    pub kind: FieldKind,
}

/// Layout of a parameter struct.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub struct ParamsLayout {
    /// Name of the Rust struct (the WGSL side calls it `Params`).
    pub name: &'static str,
    /// Fields in order.
    pub fields: &'static [ParamsField],
    /// Size of the Rust struct \[bytes\]. The WGSL size is this rounded up to 16 when there is a
    /// 4-vector among the fields, otherwise this.
    pub size: usize,
}

/// A Rust type that a parameter struct may contain.
pub trait ParamsFieldType {
    /// The type's counterpart in WGSL.
    const KIND: FieldKind;
}

macro_rules! field_type {
    ($($rust:ty => $kind:ident),*) => {
        $(impl ParamsFieldType for $rust {
            const KIND: FieldKind = FieldKind::$kind;
        })*
    };
}
field_type!(u32 => U32, i32 => I32, f32 => F32,
    [u32; 4] => U32x4, [i32; 4] => I32x4, [f32; 4] => F32x4);

impl ParamsField {
    /// A field; refuses at compile time a 4-vector that is not at a multiple of 16 bytes.
    pub const fn new(name: &'static str, offset: usize, kind: FieldKind) -> Self {
        let vector = matches!(kind, FieldKind::U32x4 | FieldKind::I32x4 | FieldKind::F32x4);
        assert!(!vector || offset.is_multiple_of(16), "4-vectors go at multiples of 16 bytes");
        Self { name, offset, kind }
    }
}

/// Makes a `#[repr(C)]` struct of 4-byte scalars and 16-byte-aligned 4-vectors, and its `LAYOUT`:
/// ```ignore
/// params! {
///     /// What the kernel needs.
///     pub struct AdamParams {
///         /// Number of parameters.
///         count: u32,
///     }
/// }
/// ```
/// Fields are public. The engines pad the struct to a multiple of 16 bytes.
#[macro_export]
macro_rules! params {
    (
        $(#[$doc:meta])*
        pub struct $name:ident {
            $($(#[$field_doc:meta])* $field:ident: $type:ty),* $(,)?
        }
    ) => {
        $(#[$doc])*
        #[repr(C)]
        #[derive(Copy, Clone, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
        pub struct $name {
            $($(#[$field_doc])* pub $field: $type,)*
        }

        impl $name {
            /// Names, offsets and types of the fields, as the shader must declare them.
            pub const LAYOUT: $crate::kernels::ParamsLayout = $crate::kernels::ParamsLayout {
                name: stringify!($name),
                fields: &[$($crate::kernels::ParamsField::new(
                    stringify!($field),
                    core::mem::offset_of!($name, $field),
                    <$type as $crate::kernels::ParamsFieldType>::KIND,
                )),*],
                size: size_of::<$name>(),
            };
        }
    };
}

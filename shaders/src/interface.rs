//! What a kernel looks like from outside: the declaration that shader, call and twin share.
use crate::structs::{FieldKind, StructLayout};
use bytemuck::Pod;

/// How a kernel uses a storage buffer.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub enum Access {
    /// `var<storage, read>`.
    Read,
    /// `var<storage, read_write>`.
    ReadWrite,
    /// `var<storage, read_write>` of atomic elements.
    Atomic,
}

/// Type of a buffer's elements in WGSL.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub enum ElementType {
    /// A scalar or vector.
    Value(FieldKind),
    /// A struct, which the shader's header declares.
    Struct(&'static StructLayout),
}

impl ElementType {
    /// The type's name in WGSL.
    pub const fn wgsl(self) -> &'static str {
        match self {
            ElementType::Value(kind) => kind.wgsl(),
            ElementType::Struct(layout) => layout.name,
        }
    }
}

/// A Rust type that buffers may hold: scalars, vectors of floats, and structs of
/// [`shared_struct!`](crate::shared_struct).
pub trait Element: Pod {
    /// The type's counterpart in WGSL.
    const TYPE: ElementType;
    /// What code on the processor indexes: the scalars of a vector, otherwise the type itself.
    type Host: Pod;
}

macro_rules! element {
    ($($rust:ty => $kind:ident, $host:ty;)*) => {
        $(impl Element for $rust {
            const TYPE: ElementType = ElementType::Value(FieldKind::$kind);
            type Host = $host;
        })*
    };
}
element! {
    u32 => U32, u32;
    i32 => I32, i32;
    f32 => F32, f32;
    [f32; 2] => F32x2, f32;
    [f32; 4] => F32x4, f32;
}

/// Makes a `#[repr(C)]` struct of 4-byte scalars and vectors that a shader declares alike: as the
/// parameters of a kernel or as the element of a buffer. Vectors must lie where WGSL puts them
/// (of 4 and of 3 components at multiples of 16 bytes), which is checked at compile time.
/// ```
/// mte_slam_shaders::shared_struct! {
///     /// What the kernel needs.
///     pub struct ScaleParams {
///         /// Number of values.
///         count: u32,
///         /// What they are multiplied by.
///         factor: f32,
///     }
/// }
/// # fn main() {}
/// ```
/// Fields are public. Engines pad parameters to a multiple of 16 bytes. The caller's crate needs
/// `bytemuck` with its derive macros.
#[macro_export]
macro_rules! shared_struct {
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

        impl $crate::structs::SharedStruct for $name {
            const LAYOUT: $crate::structs::StructLayout = $crate::structs::StructLayout {
                name: stringify!($name),
                fields: &[$($crate::structs::Field::new(
                    stringify!($field),
                    core::mem::offset_of!($name, $field),
                    <$type as $crate::structs::FieldType>::KIND,
                )),*],
                size: size_of::<$name>(),
            };
        }

        impl $crate::interface::Element for $name {
            const TYPE: $crate::interface::ElementType = $crate::interface::ElementType::Struct(
                &<$name as $crate::structs::SharedStruct>::LAYOUT,
            );
            type Host = $name;
        }
    };
}

/// One storage buffer of a kernel.
#[derive(Copy, Clone, PartialEq, Eq, Debug)]
pub struct Binding {
    /// Name of the variable in the shader.
    pub name: &'static str,
    /// How it is used.
    pub access: Access,
    /// Type of its elements.
    pub element: ElementType,
}

/// A kernel without what runs it.
#[derive(Debug)]
pub struct Interface {
    /// Name, for messages.
    pub name: &'static str,
    /// Source before the preprocessor ([`crate::shader::compose`]).
    pub wgsl: &'static str,
    /// Invocations per workgroup (along x).
    pub workgroup_size: u32,
    /// Storage buffers at binding 1, 2, ... of group 0.
    pub bindings: &'static [Binding],
    /// Layout of the uniform struct at binding 0.
    pub params: &'static StructLayout,
}

impl Interface {
    /// Paths of the files that the source imports itself.
    pub fn imports(&self) -> impl Iterator<Item = &'static str> {
        self.wgsl.lines().filter_map(|line| line.trim().strip_prefix("#import ")).map(str::trim)
    }
}

/// What stands for a binding of a kernel in some use of it, such as the handle of a buffer in a
/// call.
pub trait Role {
    /// Stands for a buffer that the kernel only reads.
    type Read<T: Element>;
    /// Stands for a buffer that the kernel reads and writes.
    type ReadWrite<T: Element>;
    /// Stands for a buffer of atomic elements.
    type Atomic<T: Element>;
}

/// Gives what stands for the bindings of a kernel, in order.
pub trait Source<R: Role> {
    /// The next binding, which the kernel only reads.
    fn read<T: Element>(&mut self) -> R::Read<T>;
    /// The next binding, which the kernel reads and writes.
    fn read_write<T: Element>(&mut self) -> R::ReadWrite<T>;
    /// The next binding, of atomic elements.
    fn atomic<T: Element>(&mut self) -> R::Atomic<T>;
}

/// Takes what stands for the bindings of a kernel, in order.
pub trait Sink<R: Role> {
    /// Takes a binding that the kernel only reads.
    fn read<T: Element>(&mut self, binding: R::Read<T>);
    /// Takes a binding that the kernel reads and writes.
    fn read_write<T: Element>(&mut self, binding: R::ReadWrite<T>);
    /// Takes a binding of atomic elements.
    fn atomic<T: Element>(&mut self, binding: R::Atomic<T>);
}

/// The bindings of a kernel by name, as [`interface!`](crate::interface!) makes them.
pub trait BindingSet<R: Role>: Sized {
    /// The kernel.
    const INTERFACE: &'static Interface;
    /// The kernel's parameters.
    type Params: Pod;
    /// Takes every binding from `source`.
    fn take(source: &mut impl Source<R>) -> Self;
    /// Gives every binding to `sink`.
    fn give(self, sink: &mut impl Sink<R>);
}

/// Declares a kernel, in a module of its own:
/// ```
/// mod scale {
///     mte_slam_shaders::shared_struct! {
///         /// Parameters of `scale`.
///         pub struct ScaleParams {
///             /// Number of values.
///             count: u32,
///             /// What they are multiplied by.
///             factor: f32,
///         }
///     }
///
///     mte_slam_shaders::interface! {
///         /// Multiplies every value by a factor.
///         pub scale {
///             wgsl: "
///                 #import shared/dispatch.wgsl
///                 #bindings
///                 @compute @workgroup_size(WORKGROUP_SIZE)
///                 fn main(
///                     @builtin(workgroup_id) workgroup: vec3<u32>,
///                     @builtin(num_workgroups) workgroups: vec3<u32>,
///                     @builtin(local_invocation_index) local: u32,
///                 ) {
///                     let i = linear_invocation(workgroup, workgroups, local);
///                     if (i < params.count) {
///                         scaled[i] = params.factor * values[i];
///                     }
///                 }",
///             workgroup_size: 64,
///             params: ScaleParams,
///             bindings: {
///                 /// What is read.
///                 values: Read<f32>,
///                 /// What is written.
///                 scaled: ReadWrite<f32>,
///             }
///         }
///     }
/// }
/// # fn main() {
/// let wgsl = mte_slam_shaders::shader::compose(&scale::INTERFACE, &[]).unwrap();
/// assert!(wgsl.contains("var<storage, read_write> scaled: array<f32>;"));
/// # }
/// ```
/// The module gets a static `INTERFACE` and a struct `Bindings` with a field for each binding. The
/// entry point of the source is `main`; `#bindings` stands where the header goes, which declares
/// the parameters as `params`, the bindings, and the structs that they hold.
#[macro_export]
macro_rules! interface {
    (
        $(#[$doc:meta])*
        pub $name:ident {
            wgsl: $wgsl:expr,
            workgroup_size: $size:expr,
            params: $params:ty,
            bindings: {
                $($(#[$binding_doc:meta])* $binding:ident: $access:ident<$element:ty>),* $(,)?
            }
        }
    ) => {
        $(#[$doc])*
        pub static INTERFACE: $crate::interface::Interface = $crate::interface::Interface {
            name: stringify!($name),
            wgsl: $wgsl,
            workgroup_size: $size,
            bindings: &[$($crate::interface::Binding {
                name: stringify!($binding),
                access: $crate::interface::Access::$access,
                element: <$element as $crate::interface::Element>::TYPE,
            }),*],
            params: &<$params as $crate::structs::SharedStruct>::LAYOUT,
        };

        #[doc = concat!("What stands for the bindings of `", stringify!($name), "`.")]
        pub struct Bindings<R: $crate::interface::Role> {
            $($(#[$binding_doc])* pub $binding: R::$access<$element>,)*
        }

        impl<R: $crate::interface::Role> $crate::interface::BindingSet<R> for Bindings<R> {
            const INTERFACE: &'static $crate::interface::Interface = &INTERFACE;
            type Params = $params;

            fn take(source: &mut impl $crate::interface::Source<R>) -> Self {
                Self { $($binding: $crate::interface!(@take $access, source, $element)),* }
            }

            fn give(self, sink: &mut impl $crate::interface::Sink<R>) {
                $($crate::interface!(@give $access, sink, $element, self.$binding);)*
            }
        }
    };
    (@take Read, $source:ident, $element:ty) => { $source.read::<$element>() };
    (@take ReadWrite, $source:ident, $element:ty) => { $source.read_write::<$element>() };
    (@take Atomic, $source:ident, $element:ty) => { $source.atomic::<$element>() };
    (@give Read, $sink:ident, $element:ty, $binding:expr) => { $sink.read::<$element>($binding) };
    (@give ReadWrite, $sink:ident, $element:ty, $binding:expr) => {
        $sink.read_write::<$element>($binding)
    };
    (@give Atomic, $sink:ident, $element:ty, $binding:expr) => {
        $sink.atomic::<$element>($binding)
    };
}

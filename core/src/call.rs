//! Typed calls of kernels: buffers by the names of bindings.
use crate::{
    commands::{Buffer, BufferId, Command, Commands, to_words, workgroups_1d},
    kernel::Kernel,
};
use alloc::vec::Vec;
use mte_slam_shaders::interface::{BindingSet, Element, Role, Sink};

/// Stands for bindings in a call: handles of buffers.
pub struct Handles;

impl Role for Handles {
    type Read<T: Element> = Buffer<T>;
    type ReadWrite<T: Element> = Buffer<T>;
    type Atomic<T: Element> = Buffer<T>;
}

/// The buffers of a call in binding order.
struct Ids(Vec<BufferId>);

impl Ids {
    /// Not inlined: calls have up to 8 buffers.
    #[inline(never)]
    fn push(&mut self, id: BufferId) {
        self.0.push(id);
    }
}

impl Sink<Handles> for Ids {
    fn read<T: Element>(&mut self, binding: Buffer<T>) {
        self.push(binding.id());
    }
    fn read_write<T: Element>(&mut self, binding: Buffer<T>) {
        self.push(binding.id());
    }
    fn atomic<T: Element>(&mut self, binding: Buffer<T>) {
        self.push(binding.id());
    }
}

/// The buffers of a kernel's call, by binding: what [`kernel!`](crate::kernel!) calls `Buffers`.
/// ```
/// use mte_slam_core::{
///     call::Call,
///     commands::{Buffer, Commands},
///     engine::Engine,
///     kernels::reduce_partials::{Buffers, ReducePartialsParams},
/// };
///
/// let mut engine = Engine::cpu();
/// let partials: Buffer<f32> = engine.create("partials", 6)?;
/// let gradient: Buffer<f32> = engine.create("gradient", 3)?;
/// let mut commands = Commands::new();
/// commands.upload(partials, 0, &[1.0_f32, 2.0, 3.0, 10.0, 20.0, 30.0]);
/// let params = ReducePartialsParams { rows: 2, columns: 3, row: 3, offset: 0 };
/// Buffers { partials, gradient }.record(&mut commands, &params, 3);
/// engine.submit(&commands)?;
/// assert_eq!(pollster::block_on(engine.read_as::<f32>(gradient, 0, 3))?, [11.0, 22.0, 33.0]);
/// # Ok::<(), mte_slam_core::engine::EngineError>(())
/// ```
/// A buffer of other elements does not compile:
/// ```compile_fail,E0308
/// # use mte_slam_core::{call::Call, commands::{Buffer, Commands}, engine::Engine};
/// # use mte_slam_core::kernels::reduce_partials::{Buffers, ReducePartialsParams};
/// # let mut engine = Engine::cpu();
/// let rays: Buffer<mte_slam_core::shaders::rays::Ray> = engine.create("rays", 12)?;
/// let gradient: Buffer<f32> = engine.create("gradient", 3)?;
/// Buffers { partials: rays, gradient }.record(
///     &mut Commands::new(),
///     &ReducePartialsParams::default(),
///     3,
/// );
/// # Ok::<(), mte_slam_core::engine::EngineError>(())
/// ```
pub trait Call: BindingSet<Handles> {
    /// The kernel that is called.
    const KERNEL: &'static Kernel;

    /// Records a call of at least `invocations` invocations, in whole workgroups spread over x and y
    /// (see [`workgroups_1d`]). The kernel must check its linear id against a count of its own.
    fn record(self, commands: &mut Commands, params: &Self::Params, invocations: usize) {
        let workgroups = workgroups_1d(invocations, Self::INTERFACE.workgroup_size);
        self.record_workgroups(commands, params, workgroups);
    }

    /// Records a call of `workgroups` workgroups; nothing when any count is 0.
    fn record_workgroups(
        self,
        commands: &mut Commands,
        params: &Self::Params,
        workgroups: [u32; 3],
    ) {
        if workgroups.contains(&0) {
            return;
        }
        let mut ids = Ids(Vec::with_capacity(Self::INTERFACE.bindings.len()));
        self.give(&mut ids);
        commands.list.push(Command::Dispatch {
            kernel: Self::KERNEL,
            bindings: ids.0,
            params: to_words(core::slice::from_ref(params)),
            workgroups,
        });
    }
}

/// Joins the interface of a kernel (a module with an
/// [`interface!`](mte_slam_shaders::interface!)) with its twin:
/// ```text
/// kernel! { pub static COMPOSITE = mte_slam_shaders::kernels::composite, twin }
/// ```
/// `twin` is a `fn(&CpuDispatch<'_>)`. Beside the static stand `Buffers`, the buffers of a call, which
/// [`Call::record`] records, and `Views`, what the twin sees of them
/// ([`CpuDispatch::views`](crate::kernel::CpuDispatch::views)).
#[macro_export]
macro_rules! kernel {
    (pub static $id:ident = $($interface:ident)::+, $twin:path) => {
        #[doc = concat!("`", stringify!($($interface)::+), "` with its twin.")]
        pub static $id: $crate::kernel::Kernel = $crate::kernel::Kernel {
            interface: &$($interface)::+::INTERFACE,
            twin: $twin,
        };

        /// Buffers of a call.
        pub type Buffers = $($interface)::+::Bindings<$crate::call::Handles>;

        /// What the twin sees of the buffers.
        pub type Views<'a> = $($interface)::+::Bindings<$crate::kernel::Slices<'a>>;

        impl $crate::call::Call for Buffers {
            const KERNEL: &'static $crate::kernel::Kernel = &$id;
        }
    };
}

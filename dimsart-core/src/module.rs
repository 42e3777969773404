//! The module template: what a control engineer writes.

use crate::cost::{Cost, Costs};
use crate::data::Data;
use crate::device::DeviceDescriptor;
use crate::engine::Calls;
use crate::parameter::{ParameterError, Parameters, Value};
use crate::port::Ports;

/// A control element with a life of `init`, `activate`, `compute`, `command` and `reset`.
///
/// A control law needs its parameters, its ports and `compute`; the rest has defaults. This is all
/// of a proportional controller with velocity damping:
///
/// ```
/// use dimsart_core::{types, Data, Input, Module, Output, Parameters, PerAxis, Ports, Unit};
///
/// /// `F = K (x_d - x) - B v`
/// #[derive(Debug, Default)]
/// pub struct DampedSpring {
///     stiffness: PerAxis,
///     damping: PerAxis,
///     position: Input,
///     velocity: Input,
///     desired_position: Input,
///     force: Output,
/// }
///
/// impl Module for DampedSpring {
///     const NAME: &'static str = "DAMPED_SPRING_MOD";
///     const SUMMARY: &'static str = "Spring to the desired position with damping to ground.";
///
///     fn parameters(&mut self, visit: &mut Parameters<'_>) {
///         visit.per_axis(&mut self.stiffness, "K_PARAM", Unit::Stiffness, 0.0..=1e6, 0.0, "Stiffness.");
///         visit.per_axis(&mut self.damping, "B_PARAM", Unit::Damping, 0.0..=1e4, 0.0, "Damping.");
///     }
///
///     fn activate(&mut self, ports: &mut Ports<'_>) {
///         ports.input(&mut self.position, "POSITION", types::POSITION);
///         ports.input(&mut self.velocity, "VELOCITY", types::VELOCITY);
///         ports.input(&mut self.desired_position, "DES_POSITION", types::DES_POSITION);
///         ports.output(&mut self.force, "DES_FORCE", types::DES_FORCE);
///     }
///
///     fn compute(&mut self, data: &Data<'_>) {
///         let inputs = [self.position, self.velocity, self.desired_position];
///         let gains = self.stiffness.iter().zip(&self.damping);
///         data.map_axes(gains, inputs, [self.force], |(k, b), [x, v, x_d]| [k * (x_d - x) - b * v]);
///     }
/// }
///
/// dimsart_core::module_list! {
///     /// The modules of this firmware.
///     pub enum MyModules { DampedSpring(DampedSpring) }
/// }
/// ```
///
/// The last line registers it. In this crate the list is [`Standard`](crate::modules::Standard).
///
/// `Default` makes it, `init` gives its parameters their defaults, `activate` connects it,
/// `compute` runs in every tick until it is unplugged.
#[doc(alias = "Module Template")]
pub trait Module: Default {
    /// Name in schemes, `UPPER_CASE_MOD`.
    const NAME: &'static str;
    /// One sentence for help texts.
    const SUMMARY: &'static str;

    /// Lists the parameters, one call of `visit` for each. The list must not depend on values.
    fn parameters(&mut self, visit: &mut Parameters<'_>) {
        let _ = visit;
    }

    /// Declares the ports and memory, one call for each. May depend on structural parameters, and
    /// must declare the same when called twice in a row.
    fn activate(&mut self, ports: &mut Ports<'_>);

    /// Works out what `compute` needs from the parameters, such as `gain / period`. Called after
    /// `init`, after every change of a parameter and before the first `compute`.
    fn prepare(&mut self, device: &DeviceDescriptor) {
        let _ = device;
    }

    /// One tick: reads inputs, computes, writes outputs. Cannot fail and never waits.
    #[doc(alias = "Compute")]
    fn compute(&mut self, data: &Data<'_>);

    /// The second half of the tick, for a module with ports of the late stage.
    fn compute_late(&mut self, data: &Data<'_>) {
        let _ = data;
    }

    /// Forgets all state and keeps the parameters. Called before the first `compute` too.
    fn reset(&mut self) {}

    /// Sets all parameters to their defaults.
    fn init(&mut self) {
        self.parameters(&mut Parameters::defaults());
    }

    /// Sets a parameter, of one axis or of all. On an error the old value stays.
    ///
    /// # Errors
    /// [`ParameterError`] when the value does not fit the parameter's description.
    fn command(
        &mut self,
        parameter: u8,
        axis: Option<u8>,
        value: Value,
        may_restructure: bool,
    ) -> Result<(), ParameterError> {
        let mut result = Ok(());
        self.parameters(&mut Parameters::set(parameter, axis, value, may_restructure, &mut result));
        result
    }
}

/// Calls a module that is of one kind; does nothing to others.
///
/// The engine asks for it when a module is plugged in: a tick then jumps right there, whatever number of kinds there is.
pub type Compute<M> = fn(&mut M, &Data<'_>);

/// Every module of an image: an enum with one variant per kind, made by
/// [`module_list!`](crate::module_list).
#[doc(alias = "List of Modules")]
pub trait ModuleList: Sized + 'static {
    /// Names and summaries, by kind.
    const KINDS: &'static [Kind];
    /// What they cost; the first table that knows a kind counts.
    const COSTS: &'static [&'static Costs] = &[];

    /// Makes a module of kind number `kind`, with default parameters.
    fn create(kind: u8) -> Option<Self>;
    /// See [`Module::parameters`].
    fn parameters(&mut self, visit: &mut Parameters<'_>);
    /// See [`Module::activate`].
    fn activate(&mut self, ports: &mut Ports<'_>);
    /// See [`Module::prepare`].
    fn prepare(&mut self, device: &DeviceDescriptor);
    /// What calls [`Module::compute`] of modules of this kind.
    fn compute(&self) -> Compute<Self>;
    /// What calls [`Module::compute_late`] of modules of this kind.
    fn compute_late(&self) -> Compute<Self>;
    /// [Runs](Calls::run) the calls of a tick. Part of the list, so that it is compiled where the list is, for speed or
    /// for size as the modules are.
    fn step(calls: Calls<'_, Self>, data: &Data<'_>);
    /// See [`Module::reset`].
    fn reset(&mut self);
    /// See [`Module::init`].
    fn init(&mut self);
    /// See [`Module::command`].
    ///
    /// # Errors
    /// As [`Module::command`].
    fn command(
        &mut self,
        parameter: u8,
        axis: Option<u8>,
        value: Value,
        may_restructure: bool,
    ) -> Result<(), ParameterError>;
}

/// What there is to say of a kind of module.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Kind {
    /// [`Module::NAME`].
    pub name: &'static str,
    /// [`Module::SUMMARY`].
    pub summary: &'static str,
    /// What it adds to a tick; none as long as that is not known. Where a tick may take so long only, such a module is
    /// refused.
    pub cost: Option<Cost>,
}

/// Makes a [`ModuleList`] of the modules of an image; one line registers a module.
///
/// Behind the list there can be tables of what modules cost, `costs [COSTS, MY_COSTS]`, each a
/// [`&Costs`](crate::Costs); the library's is [`COSTS`](crate::modules::COSTS). The cost of a kind that none of them
/// has is not known.
#[macro_export]
macro_rules! module_list {
    (
        $(#[$meta:meta])* $visibility:vis enum $list:ident { $($kind:ident($module:ty)),+ $(,)? }
        $(costs [$($costs:expr),+])?
    ) => {
        $(#[$meta])*
        #[derive(Debug)]
        // A plain tag: read and jumped through faster than one packed into a module's spare bits.
        #[repr(u8)]
        #[allow(missing_docs, clippy::large_enum_variant)]
        $visibility enum $list { $($kind($module)),+ }

        impl $crate::ModuleList for $list {
            $(const COSTS: &'static [&'static $crate::Costs] = &[$($costs),+];)?
            const KINDS: &'static [$crate::Kind] = &[$($crate::Kind {
                name: <$module as $crate::Module>::NAME,
                summary: <$module as $crate::Module>::SUMMARY,
                cost: $crate::cost_of(<$module as $crate::Module>::NAME, Self::COSTS),
            }),+];

            fn create(kind: u8) -> Option<Self> {
                let makers: &[fn() -> Self] = &[$(|| Self::$kind(<$module>::default())),+];
                let mut module = makers.get(usize::from(kind))?();
                module.init();
                Some(module)
            }
            fn parameters(&mut self, visit: &mut $crate::Parameters<'_>) {
                match self { $(Self::$kind(module) => $crate::Module::parameters(module, visit)),+ }
            }
            fn activate(&mut self, ports: &mut $crate::Ports<'_>) {
                match self { $(Self::$kind(module) => $crate::Module::activate(module, ports)),+ }
            }
            fn prepare(&mut self, device: &$crate::DeviceDescriptor) {
                match self { $(Self::$kind(module) => $crate::Module::prepare(module, device)),+ }
            }
            fn compute(&self) -> $crate::Compute<Self> {
                match self { $(Self::$kind(_) => {
                    fn call(any: &mut $list, data: &$crate::Data<'_>) {
                        if let $list::$kind(module) = any {
                            $crate::Module::compute(module, data);
                        }
                    }
                    call
                }),+ }
            }
            fn compute_late(&self) -> $crate::Compute<Self> {
                match self { $(Self::$kind(_) => {
                    fn call(any: &mut $list, data: &$crate::Data<'_>) {
                        if let $list::$kind(module) = any {
                            $crate::Module::compute_late(module, data);
                        }
                    }
                    call
                }),+ }
            }
            fn step(calls: $crate::Calls<'_, Self>, data: &$crate::Data<'_>) {
                calls.run(data);
            }
            fn reset(&mut self) {
                match self { $(Self::$kind(module) => $crate::Module::reset(module)),+ }
            }
            fn init(&mut self) {
                match self { $(Self::$kind(module) => $crate::Module::init(module)),+ }
            }
            fn command(
                &mut self,
                parameter: u8,
                axis: Option<u8>,
                value: $crate::Value,
                may_restructure: bool,
            ) -> Result<(), $crate::ParameterError> {
                match self { $(Self::$kind(module) =>
                    $crate::Module::command(module, parameter, axis, value, may_restructure)),+ }
            }
        }
    };
}

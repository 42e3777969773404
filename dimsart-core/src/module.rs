//! Module template: the trait that a control law implements.

pub(crate) mod binding;
pub(crate) mod context;
pub(crate) mod cost;
pub(crate) mod declare;
pub(crate) mod kind;
pub(crate) mod kind_id;
pub(crate) mod module_ref;
pub(crate) mod port;
pub(crate) mod port_set;
pub(crate) mod rate;

pub(crate) use binding::{Binding, ModuleBindings};
pub(crate) use cost::{BoundReport, Cost, Costs};
pub(crate) use declare::Declarations;
pub(crate) use kind::{Begin, Compute, MAX_HANDLES, MAX_SETTINGS_WORDS, ModuleKind};
pub(crate) use kind_id::KindId;
pub(crate) use module_ref::ModuleRef;
pub(crate) use port::{Direction, LinkEnd, PortSpec, PortSpecs, Stage, TypeMismatch};
pub(crate) use rate::{EVERY_TICKS, Load, Rate};

use crate::device::DeviceDescriptor;
use crate::module::context::Context;
use crate::module::port_set::PortSet;
use crate::parameter::{ParameterError, ParameterSet, Parameters};
use crate::signal::Words;

/// A control element with the phases `init`, `activate`, `compute`, `command` and `reset`.
///
/// A module consists of its configuration ([`Settings`](Self::Settings) and [`Gains`](Self::Gains):
/// parameters and values derived from them between ticks), its [`Ports`](Self::Ports), and its state
/// ([`State`](Self::State) and [`AxisState`](Self::AxisState)). All of them are stored in the Data Base, in as many
/// words as the kind needs. A complete proportional controller with velocity damping:
///
/// ```
/// use dimsart_core::{Context, Input, ModuleKinds, Module, Output, Unit, types, words};
///
/// words! {
///     pub parameters Gains {
///         /// Stiffness.
///         stiffness: f32 = per_axis("K_PARAM", Unit::Stiffness, 0.0..=1e6, 0.0),
///         /// Damping.
///         damping: f32 = per_axis("B_PARAM", Unit::Damping, 0.0..=1e4, 0.0),
///     }
///     pub ports Ports {
///         position: Input = input("POSITION", types::POSITION),
///         velocity: Input = input("VELOCITY", types::VELOCITY),
///         desired_position: Input = input("DES_POSITION", types::DES_POSITION),
///         force: Output = output("DES_FORCE", types::DES_FORCE),
///     }
/// }
///
/// /// `F = K (x_d - x) - B v`
/// #[derive(Debug)]
/// pub struct DampedSpring;
///
/// impl Module for DampedSpring {
///     const NAME: &'static str = "DAMPED_SPRING_MOD";
///     const SUMMARY: &'static str = "Spring to the desired position with damping to ground.";
///     type Settings = ();
///     type Gains = Gains;
///     type State = ();
///     type AxisState = ();
///     type Ports = Ports;
///
///     fn compute(context: &Context<'_, Self>) {
///         let Ports { position, velocity, desired_position, force } = context.ports();
///         context.map_axes([position, velocity, desired_position], [force], |gains, (), [x, v, x_d]| {
///             [gains.stiffness * (x_d - x) - gains.damping * v]
///         });
///     }
/// }
///
/// /// The modules of this firmware.
/// pub const MY_MODULES: ModuleKinds = dimsart_core::kinds![DampedSpring];
/// ```
///
/// The last line registers the module. The whole library is `dimsart_modules::ALL`.
///
/// A module with a state initialises it in [`begin`](Self::begin), for example from the joint's position. If
/// it [takes over](crate::Context::takes_over) from another module in a running scheme, it can read that
/// module's [last](crate::Output::last) command and continue without a step.
#[doc(alias = "Module Template")]
pub trait Module: Sized + 'static {
    /// Name in schemes, `UPPER_CASE_MOD`.
    const NAME: &'static str;
    /// One sentence for help texts.
    const SUMMARY: &'static str;
    /// Whether it keeps its state when motion is allowed again, while other modules are reset: for a module
    /// whose state is independent of the device, such as a link or a recorder.
    const KEEPS_STATE_ON_ARMING: bool = false;
    /// Whether it runs a [program](crate::online), whose number is the first word of its settings.
    const RUNS_PROGRAM: bool = false;
    /// Parameters for all axes, and values derived from them.
    type Settings: ParameterSet;
    /// Parameters per axis, and values derived from them.
    type Gains: ParameterSet;
    /// State that is kept from tick to tick.
    type State: Words;
    /// State of each axis.
    type AxisState: Words;
    /// The handles that [`ports`](Self::ports) declares.
    type Ports: PortSet;

    /// Lists the parameters, one call of `visit` for each; by default those that `gains` and `settings`
    /// declare. The list must not depend on values. `gains` belong to one axis.
    fn parameters(settings: &mut Self::Settings, gains: &mut Self::Gains, visit: &mut Parameters<'_>) {
        gains.visit(visit);
        settings.visit(visit);
    }

    /// Checks that parameters, each in range, are valid in combination. Otherwise the change is refused and
    /// the old values are kept.
    ///
    /// # Errors
    /// [`ParameterError`] gives the reason.
    fn validate(settings: &Self::Settings) -> Result<(), ParameterError> {
        let _ = settings;
        Ok(())
    }

    /// Computes values for `compute` from the parameters of all axes. Called when an instance is created,
    /// after every change of a parameter, and before the first `compute`. The device's sample period is that
    /// of the module: n ticks for a module that runs every n ticks.
    fn prepare(settings: &mut Self::Settings, device: &DeviceDescriptor) {
        let _ = (settings, device);
    }

    /// Computes values for `compute` from the parameters of one axis, such as `gain / period`; called after
    /// [`prepare`](Self::prepare).
    fn prepare_axis(settings: &Self::Settings, gains: &mut Self::Gains, device: &DeviceDescriptor) {
        let _ = (settings, gains, device);
    }

    /// Declares the ports and memory, one call of `declare` for each; by default the ports in
    /// [`Ports`](Self::Ports). They may depend on structural parameters.
    #[doc(alias = "activate")]
    fn ports(settings: &Self::Settings, declare: &mut Declarations<'_>) -> Self::Ports {
        let _ = settings;
        Self::Ports::declare(declare)
    }

    /// Initialises the state: called in a tick right before the first `compute`, and before the next one
    /// after a reset. Measurements and outputs of earlier modules in this tick are available. The default is
    /// all zero.
    #[doc(alias = "reset")]
    fn begin(context: &Context<'_, Self>) {
        context.clear();
    }

    /// Runs one tick: reads inputs, computes, writes outputs. Cannot fail and never waits.
    #[doc(alias = "Compute")]
    fn compute(context: &Context<'_, Self>);

    /// Runs the second half of the tick, for a module with ports of the late stage.
    fn compute_late(context: &Context<'_, Self>) {
        let _ = context;
    }
}

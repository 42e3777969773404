//! Passivity observer and controller of one port (Hannaford and Ryu, *IEEE T-RA* 18(1), 2002).
//!
//! The observer adds up the energy that the port has taken in; what it gave out too much, the controller takes back by a
//! damper, as soon as something moves:
//!
//! ```text
//! IMPEDANCE   E += -F[k-1] (x[k] - x[k-1])         α = min(-E / (h v²), DAMPER) if E < 0     F = F_in - α v
//! ADMITTANCE  E += -F[k] (x_d[k] - x_d[k-1])       β = min(-E / (h F²), 1/DAMPER) if E < 0     x_d += Δx_in - h β F
//! ```
//!
//! A force is held until the next tick, so the energy that the device gets is the held force times the way it then went:
//! with the force of the same tick, what the hold leaks would have the wrong sign (Stramigioli and others, *IEEE T-RO*
//! 21(4), 2005). What the damper's bound or the force limit leaves unpaid stays in `E`, and is paid later.
//! A damper acts a tick late: in series it is to stay below `m/h` of the mass `m` that moves, in parallel above `h K` of the
//! stiffness `K` behind it, or it swings by itself.
//! `E` is held below `ENERGY_LIMIT`, or what was taken in an hour ago would pay for a port that is active now.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! // A spring that pulls harder on the way back, 1 N instead of 0: the port gave out 1 mJ.
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::POSITION, types::FEED_FORCE],
//!     "all PASSIVITY_MOD PORT_FORCE_IN FEED_FORCE\nall MOD_ENG MOD_ON PASSIVITY_MOD\nall MOD_ENG MATCHING_CHECK",
//! )?;
//! bench.tick(&[0.0, 1.0], "DES_FORCE");
//! let force_n = bench.tick(&[1e-3, 0.0], "DES_FORCE");
//! assert_eq!(force_n, Some(-1.0)); // as much against the motion: 1 mJ over the next millimetre
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use crate::damper::{Causality, Damper, damping};
use dimsart_core::math::{self, CompensatedSum};
use dimsart_core::{Context, Declare, DeviceDescriptor, Input, Module, Output, Parameters, types, words};

words! {
    /// Of all axes.
    pub parameters Settings { causality: Causality, period_s: f32, rate_hz: f32 }
    /// Of an axis.
    pub struct Axis {
        energy: CompensatedSum,
        /// Position of the last tick; under `ADMITTANCE` of what comes in.
        previous: f32,
        /// Force that is held since the last tick.
        force: f32,
        desired: CompensatedSum,
        /// What the desired position moved by in this tick.
        step: f32,
    }
    /// Signals.
    pub ports Ports { position: Input, wanted: Input, out: Output, force: Input, energy: Output }
}

impl Axis {
    /// Adds what went in and gives what is missing, `J`.
    fn observe(&mut self, energy_in_j: f32, limit_j: f32) -> f32 {
        self.energy.add_up_to(energy_in_j, limit_j);
        self.energy.value()
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct PassivityController;

impl Module for PassivityController {
    const NAME: &'static str = "PASSIVITY_MOD";
    const SUMMARY: &'static str =
        "Passivity observer and controller: takes back what a port gave out too much.";
    type Settings = Settings;
    type Gains = Damper;
    type State = ();
    type Axis = Axis;
    type Ports = Ports;

    fn parameters(settings: &mut Settings, gains: &mut Damper, visit: &mut Parameters<'_>) {
        settings.causality.parameter(visit);
        gains.parameters(visit, "Most of what was taken in that is kept.");
    }

    fn prepare(settings: &mut Settings, device: &DeviceDescriptor) {
        settings.period_s = device.sample_period_s();
        settings.rate_hz = 1.0 / settings.period_s;
    }

    fn prepare_axis(settings: &Settings, gains: &mut Damper, _: &DeviceDescriptor) {
        gains.prepare(settings.causality);
    }

    fn ports(settings: &Settings, declare: &mut Declare<'_>) -> Ports {
        let position = declare.input("POSITION", types::POSITION);
        if settings.causality == Causality::Impedance {
            let wanted = types::DES_FORCE.copy(2);
            return Ports {
                position,
                wanted: declare.of_signal(wanted).input("FORCE_IN", types::DES_FORCE),
                out: declare.output("DES_FORCE", types::DES_FORCE),
                energy: declare.output("PORT_ENERGY", types::PORT_ENERGY),
                ..Ports::default()
            };
        }
        let wanted = types::DES_POSITION.copy(2);
        Ports {
            position,
            wanted: declare.of_signal(wanted).input("POSITION_IN", types::DES_POSITION),
            out: declare.output("DES_POSITION", types::DES_POSITION),
            force: declare.late().input("DES_FORCE", types::DES_FORCE),
            energy: declare.late().output("PORT_ENERGY", types::PORT_ENERGY),
        }
    }

    fn begin(context: &Context<'_, Self>) {
        let Ports { position, wanted, out, .. } = context.ports();
        let is_impedance = context.settings().causality == Causality::Impedance;
        let takes_over = context.takes_over();
        context.begin_axes([position, wanted, out.last()], |_, [x, wanted, last]| {
            if is_impedance {
                return Axis { previous: x, ..Axis::default() };
            }
            let desired = CompensatedSum::new(if takes_over { last } else { x });
            Axis { previous: wanted, desired, ..Axis::default() }
        });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { position, wanted, out, energy, .. } = context.ports();
        let Settings { causality, period_s, rate_hz } = context.settings();
        if causality == Causality::Admittance {
            context.map_axes([wanted], [out], |gains, axis, [wanted]| {
                let mobility = damping(-axis.energy.value(), axis.force, period_s, gains.cap);
                axis.step = wanted - axis.previous - period_s * mobility * axis.force;
                axis.previous = wanted;
                [axis.desired.add(axis.step)]
            });
            return;
        }
        context.map_axes([position, wanted], [out, energy], |gains, axis, [x, wanted]| {
            let step = x - axis.previous;
            axis.previous = x;
            let energy_j = axis.observe(-axis.force * step, gains.energy_limit_j);
            let velocity = step * rate_hz;
            let damper = damping(-energy_j, velocity, period_s, gains.cap);
            axis.force = math::limit(wanted - damper * velocity, gains.limit);
            [axis.force, energy_j]
        });
    }

    #[inline(always)]
    fn compute_late(context: &Context<'_, Self>) {
        let Ports { force, energy, .. } = context.ports();
        context.map_axes([force], [energy], |gains, axis, [force]| {
            axis.force = force;
            [axis.observe(-force * axis.step, gains.energy_limit_j)]
        });
    }
}

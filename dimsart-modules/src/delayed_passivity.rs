//! Time-domain passivity of a link with delay: one port of the two-port that the link is.
//!
//! Each side counts the energy that goes into the link there and sends the count along (`LINE_ENERGY`). What a side gives
//! out is what the other one has reported (`FAR_ENERGY`), or less; a damper takes back the rest (Ryu, Artigas and Preusche,
//! *Mechatronics* 20(7), 2010; Artigas, Ryu, Preusche and Hirzinger, *IROS* 2011). It holds for any delay, jitter or loss,
//! as counts only grow: what a packet did not bring, the next one does. `W` is `PORT_ENERGY`, with `E` the energy that has
//! come out here and `E'` the count of the other side:
//!
//! ```text
//! IMPEDANCE   W = E' - E,  P h = -F[k-1] (x[k] - x[k-1])       α = min(-W / (h v²), DAMPER) if W < 0        F = F_in - α v
//! ADMITTANCE  W = E' - E,  P h = -F[k] (x_d[k] - x_d[k-1])     β = min((F Δ - W) / (h F²), 1/DAMPER) if W < F Δ   x_d += Δ - h β F
//! ```
//!
//! `P h > 0` goes into the link: it pays for `W < 0`, and the rest is counted for the other side; `P h < 0` came out. The motion side pays for its step
//! `Δ` before, at the force of the last tick. The step then makes a force of its own: with `K + D/h` behind it at most
//! `DAMPER / h` times what it moves the reference away from the joint. With that force it may cost no more than
//! `W + CREDIT`, or it is shortened, such as after an outage, when the far position jumps: so `W` never falls below
//! `-CREDIT`, whatever is lost. Without credit nothing could begin to move. The force side commands no force that
//! would cost more than `W + CREDIT` over another step as long as the last one, and, while `W` is below 0, over what the
//! force itself moves a mass of `h DAMPER`.
//! As in [`PASSIVITY_MOD`](crate::passivity_controller), `DAMPER` is to stay below `m/h`, under `ADMITTANCE` above `h K + D`.
//! The damper would leave a drift, so `Δ = Δx + DRIFT_RATE h (x - x_d)` leads back, as far as `W` pays for it (idea:
//! Chawda, Van Quang, O'Malley and Ryu, *IROS* 2014).
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::POSITION, types::FAR_FORCE, types::FAR_ENERGY],
//!     "all TDPA_MOD PORT_FORCE_IN FAR_FORCE\nall MOD_ENG MOD_ON TDPA_MOD\nall MOD_ENG MATCHING_CHECK",
//! )?;
//! bench.tick(&[0.0, 1.0, 0.0], "DES_FORCE");
//! // 1 N pushed over 1 mm, and nobody has put 1 mJ into the other end.
//! assert_eq!(bench.tick(&[1e-3, 1.0, 0.0], "PORT_ENERGY"), Some(-1e-3));
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use crate::damper::{Causality, Damper, damping};
use crate::energy_ledger::Ledger;
use dimsart_core::math::CompensatedSum;
use dimsart_core::{
    Context, Declare, DeviceDescriptor, Input, Module, Output, Parameters, PortSet, Unit, Vector, math,
    types, words,
};

words! {
    /// Of all axes.
    pub parameters Settings {
        causality: Causality,
        drift_rate_hz: f32,
        credit_j: f32,
        period_s: f32,
        rate_hz: f32,
        /// Share of the drift that a tick takes off, at most 1.
        drift_share: f32,
    }
    /// Of an axis.
    pub struct Axis {
        ledger: Ledger,
        /// Position of the last tick; under `ADMITTANCE` of the other side.
        previous: f32,
        /// Of the joint, under `ADMITTANCE`.
        previous_own: f32,
        /// Force that is held since the last tick.
        force: f32,
        desired: CompensatedSum,
        /// What the desired position moved by in this tick.
        step: f32,
        /// The same, less what the joint moved by.
        stretch: f32,
    }
    /// Signals.
    pub ports Ports {
        position: Input = input("POSITION", types::POSITION),
        wanted: Input,
        far_energy: Input<Vector<u32>>,
        out: Output,
        force: Input,
        line_energy: Output<Vector<u32>>,
        energy: Output,
    }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct DelayedPassivity;

impl Module for DelayedPassivity {
    const NAME: &'static str = "TDPA_MOD";
    const SUMMARY: &'static str =
        "Time-domain passivity of a link with delay: gives out no more than went in.";
    type Settings = Settings;
    type Gains = Damper;
    type State = ();
    type Axis = Axis;
    type Ports = Ports;

    fn parameters(settings: &mut Settings, gains: &mut Damper, visit: &mut Parameters<'_>) {
        settings.causality.parameter(visit);
        let summary = "How fast drift is made up for under ADMITTANCE; 0: it stays.";
        visit.real(&mut settings.drift_rate_hz, "DRIFT_RATE", Unit::Hertz, 0.0..=1e3, 10.0, summary);
        gains.parameters(visit, "Most of what the other side took in that is kept.");
        let summary = "Energy given out before the other side reports it, of each axis.";
        visit.real(&mut settings.credit_j, "CREDIT", Unit::Energy, 0.0..=100.0, 0.1, summary);
    }

    fn prepare(settings: &mut Settings, device: &DeviceDescriptor) {
        settings.period_s = device.sample_period_s();
        settings.rate_hz = 1.0 / settings.period_s;
        settings.drift_share = (settings.drift_rate_hz * settings.period_s).min(1.0);
    }

    fn prepare_axis(settings: &Settings, gains: &mut Damper, _: &DeviceDescriptor) {
        gains.prepare(settings.causality);
    }

    fn ports(settings: &Settings, declare: &mut Declare<'_>) -> Ports {
        let mut ports = Ports::declare(declare);
        ports.far_energy = declare.input("FAR_ENERGY", types::FAR_ENERGY);
        if settings.causality == Causality::Impedance {
            let wanted = types::DES_FORCE.copy(2);
            ports.wanted = declare.of_signal(wanted).input("FORCE_IN", types::DES_FORCE);
            ports.out = declare.output("DES_FORCE", types::DES_FORCE);
            ports.line_energy = declare.output("LINE_ENERGY", types::LINE_ENERGY);
            ports.energy = declare.output("PORT_ENERGY", types::PORT_ENERGY);
        } else {
            ports.wanted = declare.input("POSITION_IN", types::FAR_POSITION);
            ports.out = declare.output("DES_POSITION", types::DES_POSITION);
            ports.force = declare.late().input("DES_FORCE", types::DES_FORCE);
            ports.line_energy = declare.late().output("LINE_ENERGY", types::LINE_ENERGY);
            ports.energy = declare.late().output("PORT_ENERGY", types::PORT_ENERGY);
        }
        ports
    }

    fn begin(context: &Context<'_, Self>) {
        let Ports { position, wanted, far_energy, out, .. } = context.ports();
        let is_impedance = context.settings().causality == Causality::Impedance;
        let takes_over = context.takes_over();
        let inputs = (position, wanted, far_energy, out.last());
        context.begin_axes(inputs, |_, (x, wanted, far_energy, last)| Axis {
            ledger: Ledger::new(far_energy),
            previous: if is_impedance { x } else { wanted },
            previous_own: x,
            desired: CompensatedSum::new(if takes_over { last } else { x }),
            ..Axis::default()
        });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { position, wanted, far_energy, out, line_energy, energy, .. } = context.ports();
        let Settings { causality, credit_j, period_s, rate_hz, drift_share, .. } = context.settings();
        if causality == Causality::Admittance {
            let inputs = (position, wanted, far_energy);
            context.map_axes(inputs, (out,), |gains, axis, (x, wanted, far_energy)| {
                axis.ledger.receive(far_energy, gains.energy_limit_j);
                let drift = axis.previous - axis.desired.value();
                let step = wanted - axis.previous + drift_share * drift;
                let own_step = x - axis.previous_own;
                (axis.previous, axis.previous_own) = (wanted, x);
                let balance_j = axis.ledger.balance_j();
                let mobility = damping(axis.force * step - balance_j, axis.force, period_s, gains.cap);
                let step = step - period_s * mobility * axis.force;
                let budget_j = (balance_j + credit_j).max(0.0);
                // A damper lets go of what it pushed against in the last tick.
                let moved = own_step + if axis.stretch * step < 0.0 { axis.stretch } else { 0.0 };
                axis.step = affordable(step, axis.force, moved, budget_j, rate_hz / gains.cap);
                axis.stretch = axis.step - own_step;
                (axis.desired.add(axis.step),)
            });
            return;
        }
        let (inputs, outputs) = ((position, wanted, far_energy), (out, line_energy, energy));
        context.map_axes(inputs, outputs, |gains, axis, (x, wanted, far_energy)| {
            let step = x - axis.previous;
            axis.previous = x;
            axis.ledger.receive(far_energy, gains.energy_limit_j);
            axis.ledger.pass(-axis.force * step, gains.energy_limit_j);
            let energy_j = axis.ledger.balance_j();
            let velocity = step * rate_hz;
            let damper = damping(-energy_j, velocity, period_s, gains.cap);
            let force = math::limit(wanted - damper * velocity, gains.limit);
            let budget_j = (energy_j + credit_j).max(0.0);
            // In debt it counts, too, what the force itself moves: no mass is below what the damper is for.
            let compliance = if energy_j < 0.0 { period_s / gains.cap.max(1e-3) } else { 0.0 };
            axis.force = affordable(force, step, 0.0, budget_j, compliance);
            (axis.force, axis.ledger.sent(), energy_j)
        });
    }

    #[inline(always)]
    fn compute_late(context: &Context<'_, Self>) {
        let Ports { force, line_energy, energy, .. } = context.ports();
        context.map_axes((force,), (line_energy, energy), |gains, axis, (force,)| {
            axis.force = force;
            axis.ledger.pass(-force * axis.step, gains.energy_limit_j);
            (axis.ledger.sent(), axis.ledger.balance_j())
        });
    }
}

/// The step of the reference, or as much of it as costs the budget at most: with the force before it, and what the step
/// adds to that beyond the way that the joint has `moved`, at this stiffness. Or a force, with the step before it, and what
/// the force adds to that, at this compliance.
#[inline(always)]
fn affordable(step: f32, force: f32, moved: f32, budget_j: f32, stiffness: f32) -> f32 {
    let (way, force, moved) = (step.abs(), force * step.signum(), moved * step.signum());
    let added = stiffness * (way - moved).max(0.0);
    if (force + added) * way <= budget_j {
        return step;
    }
    // Where the force alone costs too much, and where the stiffness does.
    let by_force = if force > 0.0 { budget_j / force } else { f32::MAX };
    let half = 0.5 * (force - stiffness * moved);
    let root = math::sqrt(half * half + stiffness * budget_j);
    let by_stiffness =
        if half > 0.0 { budget_j / (half + root) } else { (root - half) / stiffness.max(1e-12) };
    by_force.min(by_stiffness).min(way) * step.signum()
}

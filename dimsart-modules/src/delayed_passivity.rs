//! Time-domain passivity approach (TDPA) for a link with delay: passivity observer and controller of one port of the
//! link.
//!
//! Each side counts the energy that enters the link at its port and sends the count (`LINE_ENERGY`). A side may output
//! at most the energy that the peer has reported (`FAR_ENERGY`); a damper dissipates the excess (Ryu, Artigas and
//! Preusche, *Mechatronics* 20(7), 2010; Artigas, Ryu, Preusche and Hirzinger, *IROS* 2011). This holds for any delay,
//! jitter or loss, because counts only grow: a later packet contains the count of a lost one. `W` is `PORT_ENERGY`, `E`
//! the energy output here, `E'` the peer's count:
//!
//! ```text
//! IMPEDANCE   W = E' - E,  P h = -F[k-1] (x[k] - x[k-1])       α = min(-W / (h v²), DAMPER) if W < 0        F = F_in - α v
//! ADMITTANCE  W = E' - E,  P h = -F[k] (x_d[k] - x_d[k-1])     β = min((F Δ - W) / (h F²), 1/DAMPER) if W < F Δ   x_d += Δ - h β F
//! ```
//!
//! `P h > 0` enters the link: it first covers `W < 0`, the rest is counted for the peer. `P h < 0` leaves the link.
//!
//! The admittance side pays for its step `Δ` in advance, at the force of the last tick. The step itself then adds a
//! force: with a coupling `K + D/h`, at most `DAMPER / h` times the distance by which the reference moves away from the
//! joint. With that force, the step may cost at most `W + CREDIT`; otherwise it is shortened, for example when the far
//! position jumps after an outage. So `W` never falls below `-CREDIT`, whatever is lost. Without credit, no motion
//! could start. The impedance side limits its force to a cost of `W + CREDIT` over another step as long as the last one
//! and, while `W < 0`, over the displacement that the force causes on a mass of `h DAMPER`.
//!
//! As in [`PASSIVITY_MOD`](crate::passivity_controller), keep `DAMPER` below `m/h`; for `ADMITTANCE`, above `h K + D`.
//! The damper causes position drift, which `Δ = Δx + DRIFT_RATE h (x - x_d)` removes as far as `W` allows (idea:
//! Chawda, Van Quang, O'Malley and Ryu, *IROS* 2014).
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::POSITION, types::FAR_FORCE, types::FAR_ENERGY],
//!     "all TDPA_MOD PORT_FORCE_IN FAR_FORCE\nall MOD_ENG MOD_ON TDPA_MOD\nall MOD_ENG MATCHING_CHECK",
//! )?;
//! bench.tick(&[0.0, 1.0, 0.0], "DES_FORCE");
//! // 1 N over 1 mm is output, but the peer has reported no energy.
//! assert_eq!(bench.tick(&[1e-3, 1.0, 0.0], "PORT_ENERGY"), Some(-1e-3));
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use crate::damper::{Causality, Damper, damping};
use crate::energy_ledger::Ledger;
use dimsart_core::math::CompensatedSum;
use dimsart_core::{
    Context, Declarations, DeviceDescriptor, Input, Module, Output, Parameters, PortSet, Unit, Vector, math,
    types, words,
};

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        causality: Causality,
        drift_rate_hz: f32,
        credit_j: f32,
        period_s: f32,
        rate_hz: f32,
        /// Share of the drift removed per tick, at most 1.
        drift_share: f32,
    }
    /// State of one axis.
    pub struct AxisState {
        ledger: Ledger,
        /// Position of the last tick; for `ADMITTANCE`, of the peer.
        previous: f32,
        /// Position of the joint, for `ADMITTANCE`.
        previous_own: f32,
        /// Force held since the last tick.
        force: f32,
        desired: CompensatedSum,
        /// Step of the desired position in this tick.
        step: f32,
        /// The step minus the motion of the joint.
        stretch: f32,
    }
    /// Ports.
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
    const SUMMARY: &'static str = "Time-domain passivity control (TDPA) of a link with delay.";
    type Settings = Settings;
    type Gains = Damper;
    type State = ();
    type AxisState = AxisState;
    type Ports = Ports;

    fn parameters(settings: &mut Settings, gains: &mut Damper, visit: &mut Parameters<'_>) {
        settings.causality.parameter(visit);
        let summary = "Rate of drift correction for ADMITTANCE; 0: none.";
        visit.real(&mut settings.drift_rate_hz, "DRIFT_RATE", Unit::Hertz, 0.0..=1e3, 10.0, summary);
        gains.parameters(visit, "Maximum energy that the port stores from the peer's reports.");
        let summary = "Energy per axis that the port may output before the peer reports it.";
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

    fn ports(settings: &Settings, declare: &mut Declarations<'_>) -> Ports {
        let mut ports = Ports::declare(declare);
        ports.far_energy = declare.input("FAR_ENERGY", types::FAR_ENERGY);
        if settings.causality == Causality::Impedance {
            let wanted = types::DES_FORCE.instance(2);
            ports.wanted = declare.default_signal(wanted).input("FORCE_IN", types::DES_FORCE);
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
        context.begin_axes(inputs, |_, (x, wanted, far_energy, last)| AxisState {
            ledger: Ledger::new(far_energy),
            previous: if is_impedance { x } else { wanted },
            previous_own: x,
            desired: CompensatedSum::new(if takes_over { last } else { x }),
            ..AxisState::default()
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
                // A damper releases its stretch of the last tick.
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
            // In debt, count also the motion caused by the force, at the minimum mass allowed for DAMPER.
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

/// Limits a step of the reference to the energy budget: its cost is at the last `force` plus the force that the step
/// adds, at this stiffness, beyond the distance `moved` by the joint. Also limits a force, with the roles of step and
/// force and of stiffness and compliance exchanged.
#[inline(always)]
fn affordable(step: f32, force: f32, moved: f32, budget_j: f32, stiffness: f32) -> f32 {
    let (way, force, moved) = (step.abs(), force * step.signum(), moved * step.signum());
    let added = stiffness * (way - moved).max(0.0);
    if (force + added) * way <= budget_j {
        return step;
    }
    // Limits by the force alone and by the stiffness.
    let by_force = if force > 0.0 { budget_j / force } else { f32::MAX };
    let half = 0.5 * (force - stiffness * moved);
    let root = math::sqrt(half * half + stiffness * budget_j);
    let by_stiffness =
        if half > 0.0 { budget_j / (half + root) } else { (root - half) / stiffness.max(1e-12) };
    by_force.min(by_stiffness).min(way) * step.signum()
}

//! Simulates a drive with its firmware code and the simulator's motor.

use std::error::Error;

use drive::{
    Angle, Configuration, Drive, Duties, Identification, IdentificationError, IdentificationStep,
    MotorEstimate, Rotor, Sample,
};
use hil_sim::plant::{BridgeMotor, ThreePhaseParameters};

/// Periods of a step response: 5 ms at 20 kHz.
const PERIODS: usize = 100;
/// Maximum number of periods of the start with alignment.
const LONGEST_START: usize = 10_000;
/// Relative settling band of a current.
const SETTLED: f64 = 0.1;
/// Initial voltage of the step, relative to the available voltage.
const STEP_SHARE: f64 = 0.5;
/// Maximum permitted overshoot.
const MAX_OVERSHOOT: f64 = 0.2;
/// Counts of the simulated encoder.
const COUNTS: u32 = 1 << 14;
/// Timeout of an identification.
const LONGEST_S: f64 = 60.0;

/// Step response of a current at standstill.
#[derive(Debug, Clone, PartialEq)]
pub struct CurrentStepResponse {
    /// Current after each period, relative to the step.
    pub response: Vec<f64>,
    /// Overshoot, relative to the step.
    pub overshoot: f64,
    /// Settling time to 10 %, `s`; `None` if it does not settle.
    pub settled_s: Option<f64>,
}

impl CurrentStepResponse {
    /// Returns whether it settles with at most 20 % overshoot.
    #[must_use]
    pub fn is_well_damped(&self) -> bool {
        self.settled_s.is_some() && self.overshoot <= MAX_OVERSHOOT
    }
}

/// Creates the motor of a configuration with this rotor inertia, `kg m²`.
fn motor(told: &Configuration, inertia_kg_m2: f64) -> ThreePhaseParameters {
    ThreePhaseParameters {
        rotor_inertia_kg_m2: inertia_kg_m2,
        supply_v: (f64::from(told.limits.min_bus_v) + f64::from(told.limits.max_bus_v)) / 2.0,
        ..told.into()
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a turn has few counts")]
fn sample(motor: &BridgeMotor, told: &Configuration, supply_v: f64) -> Sample {
    let shown_rad = motor.state().angle_rad + f64::from(told.motor.encoder_offset_rad);
    let shown_rad = if told.motor.is_encoder_reversed { -shown_rad } else { shown_rad };
    let turn = (shown_rad / std::f64::consts::TAU).rem_euclid(1.0);
    Sample {
        phase_a: motor.phase_a().map(|phase_a| phase_a as f32),
        bus_v: supply_v as f32,
        temperature_c: told.limits.derating_c.min(25.0),
        rotor: Rotor::Angle(Angle::from_counts((turn * f64::from(COUNTS)) as u32, COUNTS)),
    }
}

fn wide(duties: Duties) -> [f64; 3] {
    duties.map(f64::from)
}

/// Simulates the step response of the q-axis current, with resistance and inductances scaled relative to the configuration.
///
/// # Errors
/// A motor that cannot be simulated; an invalid configuration.
pub fn simulate_current_step(
    told: &Configuration,
    resistance: f64,
    inductance: f64,
) -> Result<CurrentStepResponse, Box<dyn Error>> {
    // No external torque.
    let mut truth = motor(told, 1e9);
    truth.resistance_ohm *= resistance;
    truth.direct_inductance_h *= inductance;
    truth.quadrature_inductance_h *= inductance;
    let mut bridge = BridgeMotor::new(&truth)?;
    let mut drive = Drive::new(told)?;
    let at_once_v =
        f64::from(told.bandwidth_rad_per_s) * truth.quadrature_inductance_h + truth.resistance_ohm;
    let step_a = (STEP_SHARE * 0.5 * truth.supply_v / at_once_v).min(told.limits.current_a.into());
    #[expect(clippy::cast_possible_truncation, reason = "a torque is f32")]
    let torque_nm = (step_a * f64::from(told.motor.torque_constant_nm_per_a())) as f32;
    let (mut duties, mut response) = (None, Vec::with_capacity(PERIODS));
    // Start with alignment.
    for _ in 0..LONGEST_START {
        duties = drive.step(&sample(&bridge, told, truth.supply_v), Some(0.0));
        if duties.is_some() {
            break;
        }
    }
    for _ in 0..PERIODS {
        let next = drive.step(&sample(&bridge, told, truth.supply_v), Some(torque_nm));
        bridge.advance(duties.map(wide), told.inverter.period_s.into());
        duties = next;
        response.push(bridge.state().quadrature_a / step_a);
    }
    let overshoot = response.iter().copied().fold(1.0, f64::max) - 1.0;
    let rough = response.iter().rposition(|share| (share - 1.0).abs() > SETTLED).map_or(0, |last| last + 1);
    #[expect(clippy::cast_precision_loss, reason = "a few periods")]
    let settled_s = (rough < PERIODS).then(|| rough as f64 * f64::from(told.inverter.period_s));
    Ok(CurrentStepResponse { response, overshoot, settled_s })
}

/// Identifies a simulated motor and returns the result.
///
/// # Errors
/// A motor that cannot be simulated; an invalid configuration or current.
pub fn identify(
    told: &Configuration,
    current_a: f32,
    inertia_kg_m2: f64,
    friction_nm: f64,
) -> Result<Result<MotorEstimate, IdentificationError>, Box<dyn Error>> {
    let mut truth = motor(told, inertia_kg_m2);
    // The current holds the rotor like a spring; bearing friction damps it with 20 % of critical damping.
    let stiffness = 1.5 * f64::from(truth.pole_pairs).powi(2) * truth.flux_linkage_vs * f64::from(current_a);
    truth.viscous_nms_per_rad = 0.2 * 2.0 * (stiffness.max(0.0) * inertia_kg_m2).sqrt();
    truth.coulomb_nm = friction_nm;
    let mut bridge = BridgeMotor::new(&truth)?;
    let mut identification = Identification::new(told, current_a)?;
    let mut duties: Option<Duties> = None;
    let mut time_s = 0.0;
    while time_s < LONGEST_S {
        match identification.step(&sample(&bridge, told, truth.supply_v)) {
            IdentificationStep::Running(next) => {
                bridge.advance(duties.map(wide), told.inverter.period_s.into());
                duties = Some(next);
            }
            IdentificationStep::Finished(end) => return Ok(end),
        }
        time_s += f64::from(told.inverter.period_s);
    }
    Ok(Err(IdentificationError::DidNotMove))
}

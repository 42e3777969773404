//! One side of the experiment: its device, its scheme with the scenario's settings, its plant.

use dimsart_core::{AxisKind, DescriptorError, DeviceDescriptor, limits, types};

use super::{ExperimentError, Side};
use crate::plant::{
    Axis, AxisWise, Environment, HandParameters, ParameterError, Plant, WallParameters, WallSide,
};
use crate::rig::{SimulatedDimsart, Station};
use crate::scenario::{Phases, Scenario, SideSection, Stale, WaveForm};
use crate::schemes::{self, SchemeText, Setting};

/// The side's controller and plant, joined.
pub(super) fn station(scenario: &Scenario, phases: &Phases, side: Side) -> Result<Station, ExperimentError> {
    let section = match side {
        Side::Master => &scenario.master,
        Side::Slave => &scenario.slave,
    };
    let dimsart = dimsart(scenario, section, side)?;
    let plant = plant(scenario, phases, section, side);
    let plant = plant.map_err(|error| ExperimentError::Plant { side: side.name(), error })?;
    Ok(Station::new(side.name(), dimsart, plant))
}

fn dimsart(
    scenario: &Scenario,
    section: &SideSection,
    side: Side,
) -> Result<Box<SimulatedDimsart>, ExperimentError> {
    let device = device(side.name(), scenario.dof, scenario.sample_period_s)?;
    let mut dimsart = Box::new(SimulatedDimsart::new(device).map_err(ExperimentError::Storage)?);
    let scheme = SchemeText::read(&section.scheme)?;
    let loaded = schemes::load(&scheme, side.name(), &settings(scenario, section, side), &mut dimsart);
    if !loaded.is_sound() {
        return Err(ExperimentError::Scheme { name: scheme.name, side: side.name(), loaded });
    }
    Ok(dimsart)
}

/// The simulated devices: positions out, forces in, linear axes.
///
/// # Errors
/// [`DescriptorError`] for an impossible number of axes or period.
pub fn device(
    name: &'static str,
    dof: usize,
    sample_period_s: f64,
) -> Result<DeviceDescriptor, DescriptorError> {
    let axes = [AxisKind::Linear; limits::MAX_DOF];
    let axes = axes.get(..dof).ok_or(DescriptorError::Dof { wanted: dof })?;
    #[expect(clippy::cast_possible_truncation, reason = "controllers count in f32")]
    let sample_period_s = sample_period_s as f32;
    DeviceDescriptor::new(name, axes, sample_period_s, &[types::POSITION], &[types::DES_FORCE])
}

/// What the scenario says about the schemes' parameters.
fn settings(scenario: &Scenario, section: &SideSection, side: Side) -> Vec<Setting> {
    let form = match scenario.wave.form {
        WaveForm::Split => "SPLIT",
        WaveForm::Implicit => "IMPLICIT",
        WaveForm::Printed => "PRINTED",
    };
    let law = if scenario.wave.form == WaveForm::Implicit { "ON" } else { "OFF" };
    let stale = match scenario.link.stale {
        Stale::Zero => "ZERO",
        Stale::Hold => "HOLD",
        Stale::Limited => "LIMITED",
        Stale::Integral => "INTEGRAL",
    };
    let setting = |module, command, value: &dyn ToString, key: &str| Setting {
        module,
        command,
        value: value.to_string(),
        key: key.to_owned(),
    };
    let of_side = |key| format!("{}.{key}", side.name());
    vec![
        setting("COMM_RXMOD", "STALE", &stale, "link.stale"),
        setting("WTRANSF_MOD", "B_PARAM", &scenario.wave.impedance_ns_per_m, "wave.impedance_ns_per_m"),
        setting("WTRANSF_MOD", "FORM", &form, "wave.form"),
        setting("PDCTRL_MOD", "K_PARAM", &section.stiffness_n_per_m, &of_side("stiffness_n_per_m")),
        setting("PDCTRL_MOD", "D_PARAM", &section.damping_ns_per_m, &of_side("damping_ns_per_m")),
        setting("PDCTRL_MOD", "LAW_OUTPUT", &law, "wave.form"),
        setting("TIMEDELAY_MOD", "TD_PARAM", &section.time_delay_ticks, &of_side("time_delay_ticks")),
    ]
}

fn plant(
    scenario: &Scenario,
    phases: &Phases,
    section: &SideSection,
    side: Side,
) -> Result<Box<dyn Plant>, ParameterError> {
    let axis = |axis| {
        let environment: Box<dyn Environment> = match side {
            Side::Master => Box::new(
                HandParameters {
                    mass_kg: scenario.hand.mass_kg,
                    damping_ns_per_m: scenario.hand.damping_ns_per_m,
                    stiffness_n_per_m: scenario.hand.stiffness_n_per_m,
                    phases: phases.hand(scenario, axis),
                }
                .build()?,
            ),
            Side::Slave => Box::new(
                WallParameters {
                    position_m: scenario.wall.position_m,
                    stiffness_n_per_m: scenario.wall.stiffness_n_per_m,
                    damping_ns_per_m: scenario.wall.damping_ns_per_m,
                    solid: WallSide::Above,
                }
                .build()?,
            ),
        };
        Axis::new(&section.device, section.motor.as_ref(), vec![environment])
    };
    Ok(Box::new(AxisWise::new((0..scenario.dof).map(axis).collect::<Result<_, _>>()?)))
}

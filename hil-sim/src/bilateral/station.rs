//! One side of the experiment: its device, its scheme with the scenario's settings, its plant.

use dimsart_core::{AxisKind, DescriptorError, DeviceDescriptor, limits, types};
use dimsart_modules::ALL;

use super::Side;
use crate::bilateral::phases::Phases;
use crate::experiment::ExperimentError;
use crate::plant::{Axis, AxisWise, Environment, HandParameters, HandPhase, ParameterError, Plant};
use crate::rig::{SimulatedDimsart, Station};
use crate::scenario::{Scenario, Stale, WaveForm};
use crate::schemes::{self, SchemeText, Setting};

/// The side's plant, joined to its controller.
pub(super) fn station(
    scenario: &Scenario,
    phases: &Phases,
    side: Side,
    dimsart: Box<SimulatedDimsart>,
) -> Result<Station, ExperimentError> {
    joined(side, dimsart, plant(scenario, side, |axis| phases.hand(scenario, axis)))
}

/// The same with a hand that does one thing on every axis.
pub(super) fn station_held(
    scenario: &Scenario,
    hand: &[HandPhase],
    side: Side,
    dimsart: Box<SimulatedDimsart>,
) -> Result<Station, ExperimentError> {
    joined(side, dimsart, plant(scenario, side, |_| hand.to_vec()))
}

fn joined(
    side: Side,
    dimsart: Box<SimulatedDimsart>,
    plant: Result<Box<dyn Plant>, ParameterError>,
) -> Result<Station, ExperimentError> {
    let plant = plant.map_err(|error| ExperimentError::Plant { place: side.name().to_owned(), error })?;
    Ok(Station::new(side.name(), dimsart, plant))
}

/// The side's controller, with its scheme loaded.
pub(super) fn controller(scenario: &Scenario, side: Side) -> Result<Box<SimulatedDimsart>, ExperimentError> {
    let device = device(side.name(), scenario.dof, scenario.sample_period_s)?;
    // In its place: it is large, and there is one for each loop that is worked out.
    let mut dimsart = Box::new(SimulatedDimsart::unconnected());
    dimsart.connect(device, ALL).map_err(ExperimentError::Storage)?;
    let scheme = SchemeText::read(&side.section(scenario).scheme)?;
    let loaded = schemes::load(&scheme, side.name(), &settings(scenario, side), &mut dimsart);
    if !loaded.is_sound() {
        let controller = format!("the {}", side.name());
        return Err(ExperimentError::Scheme { name: scheme.name, controller, loaded });
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

/// What the scenario was given to put over the schemes' parameters.
#[must_use]
pub fn settings(scenario: &Scenario, side: Side) -> Vec<Setting> {
    let Scenario { link, wave, .. } = scenario;
    let section = side.section(scenario);
    let form = wave.form.map(|form| match form {
        WaveForm::Split => "SPLIT",
        WaveForm::Implicit => "IMPLICIT",
        WaveForm::Printed => "PRINTED",
    });
    let law = (wave.form == Some(WaveForm::Implicit)).then_some("ON");
    let stale = link.stale.map(|stale| match stale {
        Stale::Zero => "ZERO",
        Stale::Hold => "HOLD",
        Stale::Limited => "LIMITED",
        Stale::Integral => "INTEGRAL",
    });
    let of_side = |key| format!("{}.{key}", side.name());
    [
        setting("COMM_RXMOD", "STALE", stale, "link.stale".to_owned()),
        setting("COMM_RXMOD", "TIMEOUT_TICKS", link.timeout_ticks, "link.timeout_ticks".to_owned()),
        setting("COMM_RXMOD", "PLAYOUT_TICKS", link.playout_ticks, "link.playout_ticks".to_owned()),
        setting("COMM_RXMOD", "CRX_EVERY", link.every_ticks, "link.every_ticks".to_owned()),
        setting("COMM_TXMOD", "CTX_EVERY", link.every_ticks, "link.every_ticks".to_owned()),
        setting("WTRANSF_MOD", "B_PARAM", wave.impedance_ns_per_m, "wave.impedance_ns_per_m".to_owned()),
        setting("WTRANSF_MOD", "FORM", form, "wave.form".to_owned()),
        setting("PDCTRL_MOD", "LAW_OUTPUT", law, "wave.form".to_owned()),
        setting("PDCTRL_MOD", "K_PARAM", section.stiffness_n_per_m, of_side("stiffness_n_per_m")),
        setting("PDCTRL_MOD", "D_PARAM", section.damping_ns_per_m, of_side("damping_ns_per_m")),
        setting("TIMEDELAY_MOD", "TD_PARAM", section.time_delay_ticks, of_side("time_delay_ticks")),
    ]
    .into_iter()
    .flatten()
    .collect()
}

fn setting(
    module: &'static str,
    command: &'static str,
    value: Option<impl ToString>,
    key: String,
) -> Option<Setting> {
    value.map(|value| Setting {
        module: module.to_owned(),
        command: command.to_owned(),
        value: value.to_string(),
        key,
    })
}

fn plant(
    scenario: &Scenario,
    side: Side,
    hand: impl Fn(usize) -> Vec<HandPhase>,
) -> Result<Box<dyn Plant>, ParameterError> {
    let section = side.section(scenario);
    let axis = |axis| {
        let environment: Option<Box<dyn Environment>> = match side {
            Side::Master => Some(Box::new(
                HandParameters {
                    mass_kg: scenario.hand.mass_kg,
                    damping_ns_per_m: scenario.hand.damping_ns_per_m,
                    stiffness_n_per_m: scenario.hand.stiffness_n_per_m,
                    phases: hand(axis),
                }
                .build()?,
            )),
            Side::Slave => scenario.environments.build(scenario.environment)?,
        };
        Axis::new(&section.device, section.motor.as_ref(), environment.into_iter().collect())
    };
    Ok(Box::new(AxisWise::new((0..scenario.dof).map(axis).collect::<Result<_, _>>()?)))
}

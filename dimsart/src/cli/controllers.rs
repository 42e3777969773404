//! The controllers of a scheme or rig on the command line.

use std::error::Error;

use dimsart_core::{CommandError, ModuleKinds};

use super::UsageError;
use crate::connect::ALL_DESTINATIONS;
use hil_sim::response::{LoadedController, loaded_controllers};
use hil_sim::rig::SimulatedDimsart;
use hil_sim::rig_file::RigFile;
use hil_sim::schemes::{self, SchemeText, device};

/// Default number of axes.
pub(super) const DOF: usize = 3;
/// Default sample period, s.
pub(super) const PERIOD_S: f64 = 1e-3;

/// Builds and starts a controller for one side of a scheme, for a device with `dof` axes.
pub(super) fn side_of_scheme(
    scheme: &SchemeText,
    side: &'static str,
    dof: Option<usize>,
    kinds: ModuleKinds,
) -> Result<Box<SimulatedDimsart>, Box<dyn Error>> {
    let device = device(side, dof.unwrap_or(DOF), PERIOD_S)?;
    let mut dimsart = Box::new(SimulatedDimsart::new(device, kinds).map_err(CommandError::from)?);
    let loaded = schemes::load(scheme, side, &[], &mut dimsart);
    match loaded.problems().next() {
        None => Ok(dimsart),
        Some(problem) => Err(format!("{problem}; `dimsart check {}` lists all faults", scheme.name).into()),
    }
}

/// Builds and starts the controllers of a rig, or only the controller `wanted`.
pub(super) fn controllers(
    file: &RigFile,
    rig: &str,
    wanted: Option<&str>,
) -> Result<Vec<LoadedController>, Box<dyn Error>> {
    if let Some(wanted) = wanted.filter(|wanted| file.controllers.iter().all(|found| found.name() != *wanted))
    {
        let names = names(file);
        return Err(UsageError(format!(
            "{rig} has no controller {wanted}: select one with --controller: {names}"
        ))
        .into());
    }
    let mut found = loaded_controllers(file)?;
    found.retain(|controller| wanted.is_none_or(|wanted| controller.name == wanted));
    match found
        .iter()
        .find_map(|controller| controller.loaded.problems().next().map(|first| (controller, first)))
    {
        None => Ok(found),
        Some((controller, problem)) => {
            let name = &controller.name;
            Err(format!("controller {name}: {problem}; `dimsart check {rig}` lists all faults").into())
        }
    }
}

/// Builds the only controller of a rig, or the controller `wanted`; also returns the side of its rows.
pub(super) fn one_controller(
    file: &RigFile,
    rig: &str,
    wanted: Option<&str>,
) -> Result<(LoadedController, String), Box<dyn Error>> {
    let is_one = file.controllers.len() == 1;
    if wanted.is_none() && !is_one {
        let names = names(file);
        return Err(UsageError(format!(
            "{rig} has several controllers: select one with --controller: {names}"
        ))
        .into());
    }
    let found = controllers(file, rig, wanted)?.into_iter().next();
    let found = found.ok_or_else(|| format!("rig {rig} has no controller: add one to the rig file"))?;
    let section = file.controllers.iter().find(|section| section.name() == found.name);
    let side = section.filter(|_| !is_one).map_or(ALL_DESTINATIONS, |section| section.side()).to_owned();
    Ok((found, side))
}

/// Error for an argument that applies to schemes only.
pub(super) fn rig_says_itself(arguments: &str) -> UsageError {
    UsageError(format!(
        "{arguments} apply to schemes only: omit them, because a rig defines its controllers and axes"
    ))
}

/// Error for `--controller` with a scheme.
pub(super) fn no_rig(name: &str) -> UsageError {
    UsageError(format!("--controller applies to rigs only, {name} is a scheme: select rows with --side"))
}

fn names(file: &RigFile) -> String {
    file.controllers.iter().map(|controller| controller.name()).collect::<Vec<_>>().join(", ")
}

//! Every module kind against its bound, with random parameters and inputs.

use cycles::timing::{Column, Profile, Timing};
use dimsart_core::{Command, ModuleRef, Parameter, ParameterType, Value};
use dimsart_link::saved_scheme;
use dimsart_modules::ALL;
use hil_sim::experiment::Experiment;
use hil_sim::rig::SimulatedDimsart;
use hil_sim::rig_file::RigFile;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::bounds::{hold, run};
use crate::common::{firmware_for_every_module, kinds};
use test_requirements::length;

pub(crate) const EVERY_MODULE: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/tests/emulated/every_module.scheme");

/// Maximum counts, so that the memory of a board suffices.
const MAX: u32 = 100;
/// Larger factors would cause infinities, and a module with an infinite output is stopped.
const LARGEST: f32 = 1e3;

#[test]
fn every_kind_of_module_on_the_master() {
    every_kind("master");
}

#[test]
fn every_kind_of_module_on_the_slave() {
    every_kind("slave");
}

/// In total 10^4 ticks with random inputs, or 10^6.
fn every_kind(side: &'static str) {
    let Some(firmware) = firmware_for_every_module() else { return };
    let schemes = length(1, 10);
    let ticks = length(5_000, 500_000) / schemes;
    let mut random = Pcg64Mcg::seed_from_u64(2 + u64::from(side == "slave"));
    // The scheme has a row for the second axis.
    for dof in [2, 3].into_iter().cycle().take(usize::try_from(schemes).unwrap()) {
        let both = ["master", "slave"].map(|side| format!("{side}.scheme={EVERY_MODULE}"));
        let settings = both.into_iter().chain(["duration_s=0.2".to_owned(), format!("dof={dof}")]);
        let scenario = RigFile::from_shipped("bilateral", &settings.collect::<Vec<_>>()).unwrap();
        let commands = with_random_parameters(&scenario, side, &mut random);
        let timing = Timing::new(Profile::ZeroWait, Column::Upper);
        let figures = run(&firmware, &scenario, side, Some(&commands), timing, ticks);
        hold(&figures);
        assert_eq!(figures.modules.len(), kinds());
        assert!(figures.modules.iter().all(|row| row.random_max > 0), "{:?}", figures.modules);
    }
}

/// Returns the side's scheme as commands, with random values for as many parameters as possible.
fn with_random_parameters(scenario: &RigFile, side: &'static str, random: &mut Pcg64Mcg) -> Vec<Command> {
    let mut experiment = Experiment::new(scenario).unwrap();
    let mut stations = experiment.rig_mut().stations_mut().iter_mut();
    let dimsart = &mut stations.find(|station| station.name == side).unwrap().dimsart;
    let modules: Vec<ModuleRef> = dimsart.engine().steps().map(|step| step.module).collect();
    let described = |module: ModuleRef| {
        let describe = move |index| ALL.describe_parameter(module.kind, index);
        (0..).map_while(move |index| Some((module, index, describe(index)?)))
    };
    let mut parameters: Vec<(ModuleRef, u8, Parameter)> = modules.into_iter().flat_map(described).collect();
    // A saved scheme cannot contain all of them.
    parameters.sort_by_cached_key(|_| random.next_u32());
    let mut commands: Vec<Command> = dimsart.engine_mut().rebuild_commands().collect();
    let given = commands.len();
    for (module, index, parameter) in parameters {
        let Some(value) = random_value(&parameter, random) else { continue };
        let plug_in = Command::PlugIn(module);
        let place = commands.iter().position(|command| *command == plug_in).unwrap();
        commands.insert(place, Command::set(module, index, value));
        if !runs(dimsart, &commands) {
            commands.remove(place);
        }
    }
    assert!(commands.len() >= given + 10, "{} parameters", commands.len() - given);
    commands
}

/// `None` for a parameter that both sides must share.
fn random_value(parameter: &Parameter, random: &mut Pcg64Mcg) -> Option<Value> {
    if parameter.name.ends_with("_LINK") || parameter.name.ends_with("_CHANNEL") {
        return None;
    }
    let number = random.next_u32();
    Some(match parameter.accepts {
        ParameterType::Real { min, max, .. } => {
            let (min, max) = (min.max(-LARGEST), max.min(LARGEST));
            Value::Real(min + (max - min) * (number as f32 / u32::MAX as f32))
        }
        ParameterType::Count { min, max } => Value::Count(min + number % (max.min(MAX) - min + 1)),
        ParameterType::Integer { min, max } => {
            // `None` if the range has all numbers.
            let count = max.abs_diff(min).checked_add(1);
            Value::Integer(min.wrapping_add_unsigned(count.map_or(number, |count| number % count)))
        }
        ParameterType::Flag => Value::Flag(number.is_multiple_of(2)),
        ParameterType::Choice(names) => Value::Choice(u8::try_from(number as usize % names.len()).unwrap()),
        ParameterType::Types => return None,
    })
}

/// Returns whether a controller starts a scheme of these commands, and can save it.
fn runs(dimsart: &mut SimulatedDimsart, commands: &[Command]) -> bool {
    [&Command::Close]
        .into_iter()
        .chain(commands)
        .chain([&Command::Check])
        .all(|command| dimsart.command(*command).is_ok())
        && saved_scheme::save(dimsart.engine_mut()).is_ok()
}

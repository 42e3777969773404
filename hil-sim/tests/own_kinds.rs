//! A rig runs control laws of its caller, and no others.
#![expect(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

use dimsart_core::{Context, Input, Module, ModuleKinds, Output, Unit, join_kinds, kinds, types, words};
use hil_sim::experiment;
use hil_sim::rig_file::RigFile;

words! {
    /// Of an axis.
    pub parameters Gains {
        /// Damping.
        damping: f32 = per_axis("D_PARAM", Unit::Damping, 0.0..=1e3, 1.0),
    }
    /// Signals.
    pub ports Ports {
        velocity: Input = input("VELOCITY", types::VELOCITY),
        force: Output = output("DES_FORCE", types::DES_FORCE),
    }
}

/// `F = -D v`.
#[derive(Debug)]
pub struct Brake;

impl Module for Brake {
    const NAME: &'static str = "BRAKE_MOD";
    const SUMMARY: &'static str = "Brake.";
    type Settings = ();
    type Gains = Gains;
    type State = ();
    type AxisState = ();
    type Ports = Ports;

    fn compute(context: &Context<'_, Self>) {
        let Ports { velocity, force } = context.ports();
        context.map_axes([velocity], [force], |gains, (), [v]| [-gains.damping * v]);
    }
}

/// A wheel under a constant load, and what brakes it.
const RIG: &str = r#"
    duration_s = 2.0
    device = [{ name = "wheel", measures = ["VELOCITY"], axis = [{ plant.load.inertia = 0.01 }] }]
    controller = [{ device = "wheel", scheme = "SCHEME", set.BRAKE_MOD.D_PARAM = 0.1 }]
    experiment.move = [{ device = "wheel", on = "load", step = { at_s = 0.0, amplitude = 0.2 } }]
"#;
const SCHEME: &str = "all MOD_ENG MOD_ON BRAKE_MOD\nall MOD_ENG MATCHING_CHECK\n";

fn last_velocity(kinds: ModuleKinds) -> Result<f64, String> {
    let scheme = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(scheme.path(), SCHEME).unwrap();
    let text = RIG.replace("SCHEME", &scheme.path().display().to_string());
    let mut rig = RigFile::read(&text, "wheel", "".into(), &[]).unwrap();
    rig.kinds = kinds;
    let run = experiment::run(&rig).map_err(|error| error.to_string())?;
    let velocity = run.recording.find("wheel", "VELOCITY", Some(0)).unwrap();
    Ok(run.recording.column(velocity).last().unwrap())
}

/// Torque and braking torque are equal at `v = M / D`: 20 time constants after the step.
#[test]
fn a_law_of_the_caller_brakes_a_wheel_with_its_setting() {
    for kinds in [kinds![Brake], join_kinds![dimsart_modules::ALL, kinds![Brake]]] {
        let velocity = last_velocity(kinds).unwrap();
        assert!((velocity - 2.0).abs() < 1e-5, "{velocity} rad/s");
    }
}

#[test]
fn without_it_the_scheme_is_refused() {
    let refused = last_velocity(dimsart_modules::ALL).unwrap_err();
    assert!(refused.contains("'BRAKE_MOD' is not a module"), "{refused}");
}

//! A module that fails when it is told to, and the modules of the shipped scheme beside it.

use dimsart_core::{
    Context, Cost, Declare, Input, Module, Output, Parameters, Unit, choice, limits, modules, types, words,
};

choice! {
    /// What it writes.
    pub(super) enum Writes {
        /// What it reads.
        Sound = "SOUND",
        /// No number.
        Nan = "NAN",
        /// A number without bound.
        Infinity = "INFINITY",
        /// A finite number that no signal of a scheme can be.
        Large = "LARGE",
    }
}

words! {
    /// Of all axes.
    pub(super) struct Settings { writes: Writes, axis: u32 }
    /// Signals.
    pub(super) struct Ports { input: Input, output: Output }
}

/// Passes a signal on, bit by bit, until it is told to spoil an axis of it.
#[derive(Debug)]
pub(super) struct Failing;

impl Module for Failing {
    const NAME: &'static str = "FAILING_MOD";
    const SUMMARY: &'static str = "Passes a signal on, or spoils an axis of it.";
    type Settings = Settings;
    type Gains = ();
    type State = ();
    type Axis = ();
    type Ports = Ports;

    fn parameters(settings: &mut Settings, (): &mut (), visit: &mut Parameters<'_>) {
        visit.choice(&mut settings.writes, "WRITES", "What it writes.");
        let axes = 0..=u32::try_from(limits::MAX_DOF).map_or(0, |dof| dof - 1);
        visit.count(&mut settings.axis, "AXIS", Unit::One, axes, 0, "The axis that it spoils.");
    }

    fn ports(_: &Settings, declare: &mut Declare<'_>) -> Ports {
        Ports { input: declare.input("IN", types::SIGNAL), output: declare.output("OUT", types::SIGNAL_OUT) }
    }

    fn compute(context: &Context<'_, Self>) {
        let Ports { input, output } = context.ports();
        let Settings { writes, axis } = context.settings();
        let wrong = match writes {
            Writes::Sound => None,
            Writes::Nan => Some(f32::NAN),
            Writes::Infinity => Some(f32::INFINITY),
            Writes::Large => Some(1e38),
        };
        context.data().map_axes([input], [output], |place, [sound]| {
            [wrong.filter(|_| u32::try_from(place) == Ok(axis)).unwrap_or(sound)]
        });
    }
}

dimsart_core::module_list! {
    /// The modules of the shipped scheme, and the one that fails.
    pub(super) enum Kinds {
        CommRx(modules::CommRx),
        WaveTransformer(modules::WaveTransformer),
        Pd(modules::Pd),
        TimeDelay(modules::TimeDelay),
        CommTx(modules::CommTx),
        Failing(Failing),
    }
}

/// What a tick costs without modules, then each kind of the list: the bounds of nucleo-g474re for three axes
/// (`boards/budgets/nucleo-g474re.toml`), and something for the module that no board has.
pub(super) static COSTS: [Cost; 7] = [
    Cost::new(3605, 0),
    Cost::new(968, 0),
    Cost::new(528, 0),
    Cost::new(178, 0),
    Cost::new(245, 0),
    Cost::new(386, 0),
    Cost::new(100, 0),
];

/// The shipped scheme with a module that can fail behind the receiver (1), before the device (2) and before the
/// sender (3).
pub(super) fn with_failing_modules(scheme: &str) -> String {
    let mut text = String::new();
    for row in scheme.lines() {
        let words: Vec<&str> = row.split_whitespace().collect();
        let (before, behind): (&[&str], &[&str]) = match words.as_slice() {
            [_, "MOD_ENG", "MOD_ON", "WTRANSF_MOD"] => (
                &[
                    "FAILING_MOD PORT_IN CH2_WAVES",
                    "FAILING_MOD PORT_OUT CH2_WAVES.2",
                    "MOD_ENG MOD_ON FAILING_MOD",
                    "WTRANSF_MOD PORT_WAVES_IN CH2_WAVES.2",
                ],
                &[],
            ),
            [_, "MOD_ENG", "MOD_ON", "PDCTRL_MOD"] => (
                &["PDCTRL_MOD PORT_DES_FORCE DES_FORCE.2"],
                &[
                    "FAILING_MOD.2 PORT_IN DES_FORCE.2",
                    "FAILING_MOD.2 PORT_OUT DES_FORCE",
                    "MOD_ENG MOD_ON FAILING_MOD.2",
                ],
            ),
            [_, "MOD_ENG", "MOD_ON", "TIMEDELAY_MOD"] => (
                &[
                    "FAILING_MOD.3 PORT_IN CH1_WAVES",
                    "FAILING_MOD.3 PORT_OUT CH1_WAVES.2",
                    "MOD_ENG MOD_ON FAILING_MOD.3",
                    "TIMEDELAY_MOD PORT_SIGNAL_IN CH1_WAVES.2",
                ],
                &[],
            ),
            _ => (&[], &[]),
        };
        let own = before.iter().map(|row| format!("m&s {row}")).chain([row.to_owned()]);
        for row in own.chain(behind.iter().map(|row| format!("m&s {row}"))) {
            text.push_str(&row);
            text.push('\n');
        }
    }
    text
}

//! A module that fails on command, and the modules of the shipped scheme.

use std::cell::Cell;

use dimsart_core::{Context, Cost, Input, KindId, Module, ModuleKinds, Output, Unit, types, words};
use dimsart_modules as modules;

use super::fault::{Fault, Writes, Wrong};

/// Places of modules that can fail, from 1.
const PLACES: usize = 3;

thread_local! {
    /// What is wrong at each place: a thread ticks one controller after the other. It is no parameter, because it must
    /// not wait for anybody's transaction.
    static WRONG: Cell<[Option<(Writes, usize)>; PLACES]> = const { Cell::new([None; PLACES]) };
}

/// Has the modules of the next tick write what these faults say.
pub(crate) fn let_write(wrong: &[Wrong]) {
    let mut places = [None; PLACES];
    for Wrong { fault, axis, .. } in wrong {
        if let Fault::Writes(place, writes) = fault
            && let Some(place) = places.get_mut(usize::from(*place).wrapping_sub(1))
        {
            *place = Some((*writes, *axis));
        }
    }
    WRONG.set(places);
}

words! {
    /// Of all axes.
    pub(crate) parameters Settings {
        /// Where it is, from 1; 0 never fails.
        place: u32 = count("PLACE", Unit::One, 0..=3, 0),
    }
    /// Signals.
    pub(crate) ports Ports {
        input: Input = input("IN", types::SIGNAL),
        output: Output = output("OUT", types::SIGNAL_OUT),
    }
}

/// Passes a signal on, bit by bit, or spoils an axis of it while something is wrong at its place.
#[derive(Debug)]
pub(crate) struct Failing;

impl Module for Failing {
    const NAME: &'static str = "FAILING_MOD";
    const SUMMARY: &'static str = "Passes a signal on, or spoils an axis of it.";
    type Settings = Settings;
    type Gains = ();
    type State = ();
    type AxisState = ();
    type Ports = Ports;

    fn compute(context: &Context<'_, Self>) {
        let Ports { input, output } = context.ports();
        let place = usize::try_from(context.settings().place).unwrap_or_default();
        let wrong = place.checked_sub(1).and_then(|place| WRONG.get().get(place).copied().flatten());
        let wrong = wrong.map(|(writes, axis)| {
            let written = match writes {
                Writes::Nan => f32::NAN,
                Writes::Infinity => f32::INFINITY,
                Writes::Large => 1e38,
            };
            (written, axis)
        });
        context.data().map_axes([input], [output], |axis, [sound]| {
            [wrong.filter(|(_, wrong_axis)| axis == *wrong_axis).map_or(sound, |(written, _)| written)]
        });
    }
}

/// The modules of the shipped scheme, and the failing module.
pub(crate) const KINDS: ModuleKinds = dimsart_core::kinds![
    modules::CommRx,
    modules::WaveTransformer,
    modules::Pd,
    modules::TimeDelay,
    modules::CommTx,
    Failing
];
pub(crate) static IDS: [KindId; 6] = KINDS.ids();

/// What a tick costs without modules, then each kind of the list: the bounds of nucleo-g474re for three axes
/// (`boards/budgets/nucleo-g474re.toml`), and something for the module that no board has.
pub(crate) static COSTS: [Cost; 7] = [
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
pub(crate) fn with_failing_modules(scheme: &str) -> String {
    let mut text = String::new();
    for row in scheme.lines() {
        let words: Vec<&str> = row.split_whitespace().collect();
        let (before, behind): (&[&str], &[&str]) = match words.as_slice() {
            [_, "MOD_ENG", "MOD_ON", "WTRANSF_MOD"] => (
                &[
                    "FAILING_MOD PLACE 1",
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
                    "FAILING_MOD.2 PLACE 2",
                    "FAILING_MOD.2 PORT_IN DES_FORCE.2",
                    "FAILING_MOD.2 PORT_OUT DES_FORCE",
                    "MOD_ENG MOD_ON FAILING_MOD.2",
                ],
            ),
            [_, "MOD_ENG", "MOD_ON", "TIMEDELAY_MOD"] => (
                &[
                    "FAILING_MOD.3 PLACE 3",
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

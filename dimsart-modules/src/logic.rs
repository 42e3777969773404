//! Logic of conditions: gates, latch, edge detection and delays.
//!
//! `A` and `B` are true above 0.5; `INVERT` inverts `A`. The output is 1 if:
//!
//! | `FUNCTION` | |
//! |---|---|
//! | `AND`, `OR`, `XOR` | both are true, at least one, exactly one |
//! | `NOT` | `A` is false |
//! | `LATCH` | `A` has been true since `B` was last true; `B` resets and has priority |
//! | `EDGE` | `A` is true and was false in the last tick |
//! | `ON_DELAY` | `A` has been true for `DELAY` |
//! | `OFF_DELAY` | `A` is true, or was true within the last `DELAY` |
//!
//! Initial state: as if `A` had always had its present value; the latch is reset.
//!
//! ```
//! use dimsart_core::{Bench, types};
//!
//! let rows = "all LOGIC_MOD FUNCTION EDGE\nall LOGIC_MOD INVERT ON\nall MOD_ENG MOD_ON LOGIC_MOD\nall MOD_ENG MATCHING_CHECK";
//! let mut bench = Bench::new(dimsart_modules::ALL, &[types::CONDITION], rows)?;
//! assert_eq!([0.0, 1.0, 0.0, 0.0].map(|x| bench.tick(&[x], "CONDITION.3")), [0.0, 0.0, 1.0, 0.0].map(Some));
//! # Ok::<(), dimsart_core::BenchError>(())
//! ```

use dimsart_core::{
    Context, Declarations, DeviceDescriptor, Input, Module, Output, Unit, choice, types, words,
};

choice! {
    /// Logic function.
    pub enum Function {
        And = "AND", Or = "OR", Xor = "XOR", Not = "NOT", Latch = "LATCH", Edge = "EDGE",
        OnDelay = "ON_DELAY", OffDelay = "OFF_DELAY",
    }
}

words! {
    /// Parameters common to all axes.
    pub parameters Settings {
        /// Logic function of the inputs A and B.
        function: Function = structural_choice("FUNCTION"),
        /// Invert the input A.
        is_inverted: bool = flag("INVERT", false),
        /// Delay time of the functions ON_DELAY and OFF_DELAY.
        delay_s: f32 = real("DELAY", Unit::Second, 0.0..=1e4, 0.1),
        delay_ticks: u32,
    }
    /// State of one axis.
    pub struct AxisState {
        held: bool,
        latched: bool,
        /// Ticks since `A` changed.
        ticks: u32,
    }
    /// Ports.
    pub ports Ports { a: Input, b: Input, output: Output }
}

/// See the [module docs](self).
#[derive(Debug)]
pub struct Logic;

impl Module for Logic {
    const NAME: &'static str = "LOGIC_MOD";
    const SUMMARY: &'static str = "Logic of conditions: gates, latch, edge detection and delays.";
    type Settings = Settings;
    type Gains = ();
    type State = ();
    type AxisState = AxisState;
    type Ports = Ports;

    fn prepare(settings: &mut Settings, device: &DeviceDescriptor) {
        settings.delay_ticks = device.time_to_ticks(settings.delay_s);
    }

    fn ports(settings: &Settings, declare: &mut Declarations<'_>) -> Ports {
        let [second, third] = [2, 3].map(|number| types::CONDITION.instance(number));
        let a = declare.input("A", types::CONDITION);
        let b = match settings.function {
            Function::And | Function::Or | Function::Xor | Function::Latch => {
                declare.default_signal(second).input("B", types::CONDITION)
            }
            _ => Input::default(),
        };
        Ports { a, b, output: declare.default_signal(third).output("CONDITION", types::CONDITION) }
    }

    fn begin(context: &Context<'_, Self>) {
        let Settings { is_inverted, .. } = context.settings();
        context.begin_axes([context.ports().a], |(), [a]| AxisState {
            held: (a > 0.5) != is_inverted,
            latched: false,
            ticks: u32::MAX,
        });
    }

    #[inline(always)]
    fn compute(context: &Context<'_, Self>) {
        let Ports { a, b, output } = context.ports();
        let Settings { function, is_inverted, delay_ticks, .. } = context.settings();
        context.map_axis_contexts([a], [output], |number, lane, [a]| {
            let (a, b) = ((a > 0.5) != is_inverted, context.axis(b, number) > 0.5);
            let mut axis = lane.axis();
            let held = axis.held;
            axis.held = a;
            axis.latched = (axis.latched || a) && !b;
            axis.ticks = if a == held { axis.ticks.saturating_add(1) } else { 0 };
            lane.set_axis(axis);
            let holds = match function {
                Function::And => a && b,
                Function::Or => a || b,
                Function::Xor => a != b,
                Function::Not => !a,
                Function::Latch => axis.latched,
                Function::Edge => a && !held,
                Function::OnDelay => a && axis.ticks >= delay_ticks,
                Function::OffDelay => a || axis.ticks < delay_ticks,
            };
            [f32::from(u8::from(holds))]
        });
    }
}

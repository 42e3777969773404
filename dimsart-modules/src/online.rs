//! Online module: runs a [program](dimsart_core::online), a control law uploaded to a running controller.
//!
//! `PROGRAM` is the number of the program; 0 runs none. Ports and parameters are those of the program. `P_1` is its
//! first parameter, with the range and default that the law defines; parameters beyond its last one have no effect.

use core::cell::Cell;

use dimsart_core::online::{
    CURRENT_AXIS, Environment, MAX_INPUTS, MAX_OUTPUTS, MAX_PARAMETERS, MAX_STATES, REGISTER_COUNT, Section,
    run,
};
use dimsart_core::{
    Context, Declarations, DeviceDescriptor, Input, Module, Output, Parameters, Unit, types, words,
};

words! {
    /// Parameters common to all axes; the program number must be first.
    pub parameters Settings {
        program: u32,
        /// Program to which the values belong; for a new program, the engine sets the defaults.
        valued_program: u32,
        period_s: f32,
    }
    /// Parameters of one axis.
    pub parameters Gains { values: [f32; MAX_PARAMETERS] }
    /// State of one axis.
    pub struct AxisState { values: [f32; MAX_STATES] }
    /// Ports.
    pub ports Ports { inputs: [Input; MAX_INPUTS], outputs: [Output; MAX_OUTPUTS] }
}

const INPUTS: [&str; MAX_INPUTS] = ["IN_1", "IN_2", "IN_3", "IN_4", "IN_5", "IN_6"];
const OUTPUTS: [&str; MAX_OUTPUTS] = ["OUT_1", "OUT_2", "OUT_3", "OUT_4"];
const PARAMETERS: [&str; MAX_PARAMETERS] = ["P_1", "P_2", "P_3", "P_4", "P_5", "P_6", "P_7", "P_8"];

/// Maximum program number, the same on every controller so that schemes are portable.
const MAX: u32 = u8::MAX as u32;

/// See the [module docs](self).
#[derive(Debug)]
pub struct Online;

impl Module for Online {
    const NAME: &'static str = "ONLINE_MOD";
    const SUMMARY: &'static str = "Runs a control law uploaded to the running controller.";
    const RUNS_PROGRAM: bool = true;
    type Settings = Settings;
    type Gains = Gains;
    type State = ();
    type AxisState = AxisState;
    type Ports = Ports;

    fn parameters(settings: &mut Settings, gains: &mut Gains, visit: &mut Parameters<'_>) {
        let summary = "Number of the uploaded law; 0: none.";
        visit.structural_count(&mut settings.program, "PROGRAM", Unit::One, 0..=MAX, 0, summary);
        for (name, value) in PARAMETERS.into_iter().zip(&mut gains.values) {
            visit.of_program(value, name, "Parameter of the law.");
        }
    }

    fn prepare(settings: &mut Settings, device: &DeviceDescriptor) {
        settings.period_s = device.sample_period_s();
    }

    fn ports(settings: &Settings, declare: &mut Declarations<'_>) -> Ports {
        let mut ports = Ports::default();
        // Without a program there are no ports.
        let Some(program) = declare.program(settings.program) else { return ports };
        let (header, dof) = (program.header(), declare.device().dof());
        let axes = usize::from(header.axes);
        declare.requires_axis(if header.is_coupled { axes == dof } else { axes <= dof });
        let mut signals = program.ports();
        for (name, input) in INPUTS.into_iter().zip(&mut ports.inputs).take(header.inputs.into()) {
            let Some(signal) = signals.next() else { break };
            let Some(data_type) = types::find_by_id(signal.id) else { break };
            *input = declare.default_signal(signal).input(name, data_type);
        }
        for (name, output) in OUTPUTS.into_iter().zip(&mut ports.outputs).take(header.outputs.into()) {
            let Some(signal) = signals.next() else { break };
            let Some(data_type) = types::find_by_id(signal.id) else { break };
            *output = declare.default_signal(signal).output(name, data_type);
        }
        ports
    }

    fn begin(context: &Context<'_, Self>) {
        context.clear();
        run_section(context, Section::Begin);
    }

    fn compute(context: &Context<'_, Self>) {
        run_section(context, Section::Tick);
    }
}

/// Runs the common section, then the section of each axis with its parameters and states preloaded into registers:
/// loading them by instructions would take four times as long. A single loop inlines the interpreter only once.
#[inline(never)]
fn run_section(context: &Context<'_, Online>, section: Section) {
    let Settings { program, period_s, .. } = context.settings();
    let Some(code) = context.programs().code(program, section) else { return };
    let mut registers = [0.0; REGISTER_COUNT];
    let mut lane = AxisContext { context, period_s, axis: 0, states: &[] };
    let mut instructions = code.once;
    let mut left = if code.is_coupled { 1 } else { context.dof() };
    loop {
        run(instructions, code.constants, &mut registers, &lane);
        let Some(others) = left.checked_sub(1) else { return };
        (lane.axis, lane.states) = (others, context.axis_words(others));
        let parameters = context.gain_words(others).iter().take(code.parameters.into());
        let there = parameters.chain(lane.states.iter().take(code.states.into()));
        let mut free = registers.iter_mut();
        there.for_each(|word| {
            if let Some(register) = free.next() {
                *register = f32::from_bits(word.get());
            }
        });
        (instructions, left) = (code.section, others);
    }
}

/// Access of a program to the ports, parameters and states of an axis.
struct AxisContext<'a> {
    context: &'a Context<'a, Online>,
    period_s: f32,
    axis: usize,
    /// States of the axis.
    states: &'a [Cell<u32>],
}

impl AxisContext<'_> {
    #[inline(always)]
    fn axis(&self, axis: u32) -> usize {
        if axis == u32::from(CURRENT_AXIS) { self.axis } else { axis as usize }
    }
}

impl Environment for AxisContext<'_> {
    #[inline(always)]
    fn period_s(&self) -> f32 {
        self.period_s
    }

    #[inline(always)]
    fn input(&self, port: u32, axis: u32) -> f32 {
        let input: Input = self.context.port(port as usize);
        self.context.axis(input, self.axis(axis))
    }

    #[inline(always)]
    fn last_output(&self, port: u32, axis: u32) -> f32 {
        let output: Output = self.context.port(MAX_INPUTS + port as usize);
        if self.context.takes_over() { self.context.axis(output.last(), self.axis(axis)) } else { 0.0 }
    }

    #[inline(always)]
    fn parameter(&self, number: u32, axis: u32) -> f32 {
        self.context
            .gain_words(self.axis(axis))
            .get(number as usize)
            .map_or(0.0, |word| f32::from_bits(word.get()))
    }

    #[inline(always)]
    fn set_state(&self, number: u32, value: f32) {
        if let Some(word) = self.states.get(number as usize) {
            word.set(value.to_bits());
        }
    }

    #[inline(always)]
    fn write(&self, port: u32, axis: u32, value: f32) {
        let output: Output = self.context.port(MAX_INPUTS + port as usize);
        self.context.set_axis(output, self.axis(axis), value);
    }
}

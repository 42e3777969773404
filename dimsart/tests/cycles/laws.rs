//! Laws as text on the processor: bit-identical to the same law in Rust, and the ratio of their cycles.

use cycles::timing::{Column, Profile, Timing};
use dimsart::cycles::Controller;
use dimsart_core::{Dimsart, ProvidedMemory, Word, scheme};
use dimsart_link::saved_scheme;
use dimsart_modules::ALL;
use hil_sim::law::Law;
use hil_sim::schemes::device;

use crate::common::variant;

/// Maximum ratio of the cycles of a law and of the same law in Rust.
const MAX_TIMES: u64 = 15;
const TICKS: u16 = 300;

const P: &str = "law P
in position: POSITION
in desired: DES_POSITION
out force: DES_FORCE
param stiffness: Stiffness = 0 in 0..1e6
force = stiffness * (desired - position)";

/// Values that the Rust module computes between ticks, such as a gain over the period, are parameters here.
const PID: &str = "law PID
in position: POSITION
in desired: DES_POSITION
out force: DES_FORCE
param stiffness: Stiffness = 0 in 0..1e6
param integral_gain_per_tick = 0 in 0..1e7
param damping_per_tick = 0 in 0..1e9
param limit: Force = 1e4 in 0..1e4
param tracking = 0.01 in 0..1
param smoothing = 1 in 0..1
state integral = 0
state previous = desired - position
state before = 0
let error = desired - position
let filtered = before + smoothing * (error - previous - before)
let sum = integral + integral_gain_per_tick * error
let wanted = stiffness * error + sum + damping_per_tick * filtered
force = clamp(wanted, -limit, limit)
integral = sum + tracking * (force - wanted)
previous = error
before = filtered";

/// Straightforward form: values that the Rust module computes between ticks are computed in each tick here.
const PID_OF_GAINS: &str = "law PID
in position: POSITION
in desired: DES_POSITION
out force: DES_FORCE
param stiffness: Stiffness = 0 in 0..1e6
param integral_gain: IntegralGain = 0 in 0..1e7
param damping: Damping = 0 in 0..1e4
param limit: Force = 1e4 in 0..1e4
param tracking_time: Second = 0.1 in 0.001..100
param filter_time: Second = 0 in 0..10
state integral = 0
state previous = desired - position
state before = 0
let error = desired - position
let filtered = before + period / (period + filter_time) * (error - previous - before)
let sum = integral + integral_gain * period * error
let wanted = stiffness * error + sum + damping / period * filtered
force = clamp(wanted, -limit, limit)
integral = sum + min(period / tracking_time, 1) * (force - wanted)
previous = error
before = filtered";

/// A controller with this number of axes, a generator of desired positions, and these rows.
fn controller(dof: usize, law: Option<&Law>, rows: &str) -> Dimsart {
    let mut dimsart =
        Dimsart::new(ProvidedMemory::leak_default(), device("master", dof, 1e-3).unwrap(), ALL).unwrap();
    for command in law.iter().flat_map(|law| law.commands(1)) {
        dimsart.command(command).unwrap();
    }
    let text = format!(
        "all SIGGEN_MOD FORM SINE\nall SIGGEN_MOD AMPLITUDE 0.3\nall SIGGEN_MOD PORT_SIGNAL_OUT DES_POSITION\n\
         all MOD_ENG MOD_ON SIGGEN_MOD\n{rows}\nall MOD_ENG MATCHING_CHECK"
    );
    let failed = scheme::load(&text, "master", &[], &mut dimsart, |error| eprintln!("{error:?}"));
    assert_eq!(failed, 0);
    dimsart
}

/// Returns the commands of each tick, and the cycles of the module's calls in all ticks but the first.
fn run(dimsart: &mut Dimsart, dof: usize) -> Option<(Vec<Vec<u32>>, u64)> {
    let firmware = variant("online")?;
    let timing = Timing::new(Profile::ZeroWait, Column::Likely);
    let mut controller = Controller::new(&firmware, timing, dof).unwrap();
    controller.load(&saved_scheme::save(dimsart.engine_mut()).unwrap()).unwrap();
    let (mut commanded, mut cycles) = (Vec::new(), 0);
    for tick in 0..TICKS {
        let position = (f32::from(tick) * 0.013).sin();
        let measured: Vec<Word> = (0..dof).map(|_| Word::from(position)).collect();
        let run = controller.tick(&measured).unwrap();
        if tick > 0 {
            // The generator's call, then the law's.
            cycles += run.calls.get(1).unwrap().cycles;
        }
        let words: Vec<u32> = controller.commands().into_iter().map(|word| word.0).collect();
        let mut host = vec![Word(0); dof];
        dimsart.tick(&measured, &mut host);
        let host: Vec<u32> = host.into_iter().map(|word| word.0).collect();
        assert_eq!(words.get(..dof), Some(&host[..]), "tick {tick}: processor and simulator differ");
        commanded.push(host);
    }
    Some((commanded, cycles))
}

#[test]
fn a_law_has_the_bits_of_the_one_in_rust_and_takes_at_most_15_times_its_cycles() {
    let of_law = "all ONLINE_MOD PROGRAM 1\nall ONLINE_MOD P_1 150\n";
    let [period_s, filter_time_s, tracking_time_s] = [1e-3_f32, 0.002, 0.1];
    let per_tick = [900.0 * period_s, 4.0 / period_s, 20.0, period_s / tracking_time_s];
    let smoothing = period_s / (period_s + filter_time_s);
    let per_tick: Vec<f32> = per_tick.into_iter().chain([smoothing]).collect();
    let gains = [900.0, 4.0, 20.0, tracking_time_s, filter_time_s];
    let rows = |values: &[f32]| -> String {
        let rows = (2..).zip(values).map(|(number, value)| format!("all ONLINE_MOD P_{number} {value}\n"));
        rows.collect()
    };
    let pid = "all PIDCTRL_MOD K_PARAM 150\nall PIDCTRL_MOD I_PARAM 900\nall PIDCTRL_MOD D_PARAM 4\n\
               all PIDCTRL_MOD LIMIT 20\nall PIDCTRL_MOD FILTER_TIME 0.002\nall MOD_ENG MOD_ON PIDCTRL_MOD";
    for (name, text, rows, in_rust) in [
        ("P", P, String::new(), "all PCTRL_MOD K_PARAM 150\nall MOD_ENG MOD_ON PCTRL_MOD"),
        ("PID with precomputed gains as parameters", PID, rows(&per_tick), pid),
        ("PID", PID_OF_GAINS, rows(&gains), pid),
    ] {
        let law = Law::compile(text, name).unwrap();
        for dof in [1, 3] {
            let rows = format!("{of_law}{rows}all MOD_ENG MOD_ON ONLINE_MOD");
            let Some((as_text, cycles)) = run(&mut controller(dof, Some(&law), &rows), dof) else { return };
            let Some((in_rust, cycles_in_rust)) = run(&mut controller(dof, None, in_rust), dof) else {
                return;
            };
            assert_eq!(as_text, in_rust, "{name}, {dof} axes");
            let ticks = u64::from(TICKS - 1);
            println!(
                "{name} on {dof} axes: {} cycles as text, {} in Rust, {:.1} times",
                cycles / ticks,
                cycles_in_rust / ticks,
                cycles as f64 / cycles_in_rust as f64
            );
            assert!(cycles <= MAX_TIMES * cycles_in_rust, "{name}: {cycles} and {cycles_in_rust}");
        }
    }
}

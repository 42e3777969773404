//! Fault latency: ticks until the device no longer gets the scheme's command, and its commands in the
//! meantime: the table in docs/faults.md, row by row.
#![expect(clippy::unwrap_used, clippy::indexing_slicing, reason = "in helpers of tests as in tests")]

use std::cell::Cell;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

use dimsart_core::{
    AxisKind, Context, Cost, Costs, Counter, DeviceDescriptor, Dimsart, Input, InputLimits, KindId, Module,
    ModuleKinds, Output, OutputLimits, Packet, Parameters, ProvidedMemory, SafeValue, TickResult, Word,
    scheme, types, words,
};
use dimsart_modules as modules;
use dimsart_modules::ALL;

const H_S: f32 = 1e-3;
/// 10 mm per tick.
const SENSOR_LIMITS: OutputLimits = OutputLimits { min: -100.0, max: 100.0, rate_per_s: 10.0 };
const LIMITS: InputLimits =
    InputLimits { min: -50.0, max: 50.0, rate_per_s: 5_000.0, safe_value: SafeValue::Zero };
/// Cost of a call of the module that fails.
const COST: u32 = 1_000;
static COSTS: [Cost; 4] = [Cost::new(100, 0), Cost::new(9_000, 0), Cost::new(1_000, 0), Cost::new(9_000, 0)];
/// Ticks before a fault, plus the following ones: all phases of the motion.
const BEFORE: u32 = 200;
const PHASES: u32 = 60;
/// Ticks after the fault.
const AFTER: u32 = 1_000;

thread_local! {
    static COUNTER: &'static AtomicU32 = Box::leak(Box::new(AtomicU32::new(0)));
    /// Fault of the module.
    static DEED: Cell<(f32, u32)> = const { Cell::new((0.0, 0)) };
}

words! {
    ports Ports {
        law: Input = input("LAW", types::DES_FORCE),
        force: Output = output("FORCE", types::DES_FORCE),
    }
}

/// Passes a force on, adds an offset, and takes a set time.
#[derive(Debug)]
struct Failing;

impl Module for Failing {
    const NAME: &'static str = "FAILING_MOD";
    const SUMMARY: &'static str = "Fails on request.";
    type Settings = ();
    type Gains = ();
    type State = ();
    type AxisState = ();
    type Ports = Ports;

    fn parameters((): &mut (), (): &mut (), _: &mut Parameters<'_>) {}

    fn compute(context: &Context<'_, Self>) {
        let Ports { law, force } = context.ports();
        let (adds, cycles) = DEED.get();
        COUNTER.with(|counter| counter.fetch_add(cycles, Relaxed));
        context.map_axis_contexts([law], [force], |_, _, [law]| [law + adds]);
    }
}

const KINDS: ModuleKinds = dimsart_core::kinds![modules::Pd, Failing, modules::CommRx];
static IDS: [KindId; 3] = KINDS.ids();

fn load(dimsart: &mut Dimsart, rows: &str) {
    let text: String = rows.lines().map(|row| format!("joint {row}\n")).collect();
    assert_eq!(scheme::load(&text, "joint", &["joint"], dimsart, |error| eprintln!("{error:?}")), 0);
}

/// The fault from a tick on.
#[derive(Default)]
struct Wrong {
    /// The sensor's reading, as a function of the position and the ticks since the fault.
    sensor: Option<fn(now_m: f32, then_m: f32, ticks: u32) -> f32>,
    /// The actuator is stuck at its last value.
    is_actuator_stuck: bool,
    module: (f32, u32),
    /// The link receives nothing or damaged bytes.
    link: Option<bool>,
    /// The commanding engine has stopped.
    is_commander_silent: bool,
}

/// A mass on a slide that follows a sine.
struct Joint {
    dimsart: Dimsart,
    sender: Dimsart,
    position_m: f32,
    velocity_m_per_s: f32,
    force_n: f32,
    tick: u32,
    silent_ticks: u32,
}

impl Joint {
    fn new() -> Self {
        DEED.set((0.0, 0));
        let outputs = &[types::POSITION, types::DES_POSITION];
        let device = DeviceDescriptor::new("joint", &[AxisKind::Linear], H_S, outputs, &[types::DES_FORCE]);
        let device = device.unwrap().with_limits(&[&[LIMITS]]).unwrap();
        let device = device.with_output_limits(&[SENSOR_LIMITS]).unwrap();
        let mut dimsart = Dimsart::new(ProvidedMemory::leak_default(), device, KINDS).unwrap();
        dimsart.engine_mut().set_costs(Some(Costs::new(&COSTS, &IDS)));
        dimsart.engine_mut().set_call_timer(Counter::counting_up(COUNTER.with(|counter| *counter)), 0);
        load(
            &mut dimsart,
            "PDCTRL_MOD K_PARAM 400\nPDCTRL_MOD D_PARAM 40\nPDCTRL_MOD PORT_DES_FORCE DES_FORCE.2\n\
             FAILING_MOD PORT_LAW DES_FORCE.2\nCOMM_RXMOD CRX_ADD_DATA VELOCITY.2\nMOD_ENG MOD_ON COMM_RXMOD\n\
             MOD_ENG MOD_ON PDCTRL_MOD\nMOD_ENG MOD_ON FAILING_MOD\nMOD_ENG MATCHING_CHECK",
        );
        let sender = DeviceDescriptor::new("joint", &[AxisKind::Linear], H_S, &[types::VELOCITY], &[]);
        let mut sender = Dimsart::new(ProvidedMemory::leak_default(), sender.unwrap(), ALL).unwrap();
        load(
            &mut sender,
            "COMM_TXMOD CTX_ADD_DATA VELOCITY\nMOD_ENG MOD_ON COMM_TXMOD\nMOD_ENG MATCHING_CHECK",
        );
        Self {
            dimsart,
            sender,
            position_m: 0.0,
            velocity_m_per_s: 0.0,
            force_n: 0.0,
            tick: 0,
            silent_ticks: 0,
        }
    }

    fn packet(&mut self) -> Packet {
        self.sender.tick(&[Word(0)], &mut []);
        self.sender.take_outgoing(0).unwrap()
    }

    fn step(&mut self, wrong: Option<(&Wrong, f32, u32)>) -> TickResult {
        let healthy = Wrong::default();
        let (fault, then_m, ticks) = wrong.unwrap_or((&healthy, 0.0, 0));
        DEED.set(fault.module);
        let packet = self.packet();
        match fault.link {
            None => self.dimsart.receive_parsed(0, &Ok(packet)).unwrap(),
            Some(is_damaged) => {
                if is_damaged {
                    self.dimsart.receive(0, &[0xA5; 24]).unwrap_err();
                }
            }
        }
        // The timeout of the coupling to the commanding engine.
        self.silent_ticks = if fault.is_commander_silent { self.silent_ticks + 1 } else { 0 };
        self.dimsart.set_commands_stale(self.silent_ticks >= dimsart_core::TIMEOUT_TICKS);
        let sensed_m = fault.sensor.map_or(self.position_m, |sensor| sensor(self.position_m, then_m, ticks));
        let wanted_m = 0.05 * (f64::from(self.tick) * 0.01).sin();
        #[expect(clippy::cast_possible_truncation, reason = "small by construction")]
        let measured = [Word::from(sensed_m), Word::from(wanted_m as f32)];
        let mut commanded = [Word(0)];
        let came = self.dimsart.tick(&measured, &mut commanded);
        let last_n = self.force_n;
        self.force_n = f32::from_bits(commanded[0].0);
        assert!((LIMITS.min..=LIMITS.max).contains(&self.force_n), "{}", self.force_n);
        let step_n = (self.force_n - last_n).abs();
        assert!(step_n <= LIMITS.rate_per_s * H_S * 1.000_001 + 1e-5, "{last_n} {}", self.force_n);
        let driven_n = if fault.is_actuator_stuck { last_n } else { self.force_n };
        self.velocity_m_per_s += H_S * driven_n;
        self.position_m += H_S * self.velocity_m_per_s;
        self.tick += 1;
        came
    }
}

/// Returns the minimum and maximum ticks over all phases from the first faulty tick until the scheme's
/// commands end, and the reason's number; none if the fault is not detected. Checks range and rate in every
/// tick.
fn latency(wrong: &Wrong) -> Option<(u32, u32, u8)> {
    let found = (0..PHASES).map(|phase| {
        let mut joint = Joint::new();
        for _ in 0..BEFORE + phase {
            assert_eq!(joint.step(None), TickResult::Ran);
        }
        let then_m = joint.position_m;
        let noticed = (0..AFTER).find(|ticks| joint.step(Some((wrong, then_m, *ticks))) != TickResult::Ran);
        noticed.map(|ticks| (ticks, joint.dimsart.safety().reason().number()))
    });
    let found: Vec<_> = found.collect();
    let noticed: Vec<_> = found.iter().flatten().collect();
    assert!(noticed.is_empty() || noticed.len() == found.len(), "only at some phases: {found:?}");
    let least = noticed.iter().map(|(ticks, _)| *ticks).min()?;
    let most = noticed.iter().map(|(ticks, _)| *ticks).max()?;
    assert!(noticed.iter().all(|(_, reason)| *reason == noticed[0].1), "{noticed:?}");
    Some((least, most, noticed[0].1))
}

#[test]
fn the_page_of_faults_has_every_latency_as_it_is() {
    let sensor = |sensor| Wrong { sensor: Some(sensor), ..Wrong::default() };
    let module = |adds, percent| Wrong { module: (adds, COST * percent / 100), ..Wrong::default() };
    let rows = [
        ("a sensor outputs NaN", sensor(|_, _, _| f32::NAN)),
        ("a sensor outputs infinity", sensor(|_, _, _| f32::INFINITY)),
        ("a sensor jumps by 5 mm", sensor(|now_m, _, _| now_m + 5e-3)),
        ("a sensor jumps by 1 m", sensor(|now_m, _, _| now_m + 1.0)),
        ("a sensor is stuck", sensor(|_, then_m, _| then_m)),
        (
            "a sensor drifts by 1 m/s",
            sensor(|now_m, _, ticks| now_m + f32::from(u16::try_from(ticks).unwrap()) * H_S),
        ),
        ("an actuator is stuck", Wrong { is_actuator_stuck: true, ..Wrong::default() }),
        ("a module writes NaN", module(f32::NAN, 0)),
        ("a module writes infinity", module(f32::INFINITY, 0)),
        ("a module writes 1e38", module(1e38, 0)),
        ("a call exceeds its cost by 10 %", module(0.0, 110)),
        ("a call exceeds its cost by 25 %", module(0.0, 125)),
        ("a call exceeds its cost by 26 %", module(0.0, 126)),
        ("a call exceeds its cost by 100 %", module(0.0, 200)),
        ("a call exceeds its cost by 500 %", module(0.0, 600)),
        ("no packets arrive on a link", Wrong { link: Some(false), ..Wrong::default() }),
        ("damaged packets arrive on a link", Wrong { link: Some(true), ..Wrong::default() }),
        ("the commanding engine stops", Wrong { is_commander_silent: true, ..Wrong::default() }),
    ];
    let page = include_str!("../../../docs/faults.md");
    let mut missing = Vec::new();
    for (name, wrong) in rows {
        let row = match latency(&wrong) {
            None => format!("| {name} | never | |"),
            Some((least, most, reason)) if least == most => format!("| {name} | {most} | {reason} |"),
            Some((least, most, reason)) => format!("| {name} | {least} to {most} | {reason} |"),
        };
        if !page.contains(&row) {
            missing.push(row);
        }
    }
    assert!(missing.is_empty(), "docs/faults.md lacks:\n{}", missing.join("\n"));
}

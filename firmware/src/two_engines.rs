//! Two engines on one processor: a joint's in an interrupt, and a planner's at lower priority, which it can
//! interrupt anywhere.
//!
//! An example of joining two [`Dimsart`]s by a [`Coupling`], which also checks its guarantees: transferred
//! words are complete and never older than earlier ones, the interrupt never waits, and a stopped planner
//! removes the force. `cargo xtask step two-engines` runs it on the emulated board with interrupts at random
//! times.
#![no_std]
#![no_main]

mod stopping;

use core::cell::RefCell;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering::Relaxed};

// For its interrupt table and log transport.
use boards as _;
use cortex_m::Peripherals;
use cortex_m::interrupt::Mutex;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{SCB, SYST};
use cortex_m_rt::{entry, exception};
use dimsart_core::{
    AxisKind, Command, Coupling, DataType, DeviceDescriptor, Dimsart, ModuleKinds, ModuleRef, Snapshot,
    TIMEOUT_TICKS, TickResult, Value, Word, join_kinds, limits::Capacities, memory, types,
};
use dimsart_modules::{CONTROL, SIGNALS};
use semihosting::process::exit;
use static_cell::{ConstStaticCell, StaticCell};

const MODULES: ModuleKinds = join_kinds![CONTROL, SIGNALS];

const DOF: usize = 3;
const AXES: [AxisKind; DOF] = [AxisKind::Rotary; DOF];
/// Ticks of the joint while the planner runs.
const TICKS: u32 = 30_000;
/// Gain of the planner.
const GAIN: f32 = 0.5;
/// Ticks of the joint after the planner has stopped: until its commands are late, plus some.
const TICKS_ALONE: u32 = TIMEOUT_TICKS + 10;
/// Maximum timer counts between two ticks, less than a tick of the planner takes.
const MAX_BETWEEN: u32 = 1 << 15;
const LONGEST: u32 = 0x00FF_FFFF;

/// Memory of each engine.
type ControllerMemory = memory!(Capacities { programs: 0, words: 512, ..Capacities::DEFAULT });
type Between = Coupling<'static, DOF, DOF>;

/// State of the interrupt.
struct Joint {
    dimsart: &'static mut Dimsart,
    between: Between,
    /// Position of all axes in ticks, and the planner's commands.
    measured: [Word; 2 * DOF],
    /// Position on which the planner's command is based, in ticks.
    planned: u32,
    /// Duration of a transfer, timer counts.
    showing: Option<u32>,
    random: u32,
}

static JOINT: Mutex<RefCell<Option<Joint>>> = Mutex::new(RefCell::new(None));
/// Tick of the joint.
static TICK: AtomicU32 = AtomicU32::new(0);
/// First tick with late commands.
static LATE_AT: AtomicU32 = AtomicU32::new(0);
/// Set while the planner transfers words.
static PLANNER_CROSSES: AtomicBool = AtomicBool::new(false);
/// Ticks of the joint during a transfer.
static INTERRUPTED: AtomicU32 = AtomicU32::new(0);

#[entry]
fn main() -> ! {
    static JOINT_MEMORY: ConstStaticCell<ControllerMemory> = ConstStaticCell::new(ControllerMemory::new());
    static PLANNER_MEMORY: ConstStaticCell<ControllerMemory> = ConstStaticCell::new(ControllerMemory::new());
    static JOINTS: StaticCell<Dimsart> = StaticCell::new();
    static PLANNERS: StaticCell<Dimsart> = StaticCell::new();
    static THERE: ConstStaticCell<Snapshot<DOF>> = ConstStaticCell::new(Snapshot::new());
    static BACK: ConstStaticCell<Snapshot<DOF>> = ConstStaticCell::new(Snapshot::new());
    let joint = JOINTS.init_with(|| Dimsart::without_device(JOINT_MEMORY.take()));
    let planner = PLANNERS.init_with(|| Dimsart::without_device(PLANNER_MEMORY.take()));
    connect(joint, "joint", &[types::POSITION, types::DES_POSITION], &[types::DES_FORCE]);
    connect(planner, "planner", &[types::POSITION], &[types::DES_POSITION]);
    follow(joint);
    plan(planner);
    let (of_joint, of_planner) = Coupling::pair(THERE.take(), BACK.take());
    let joint = Joint {
        dimsart: joint,
        between: of_joint,
        measured: [Word(0); 2 * DOF],
        planned: 0,
        showing: None,
        random: 1,
    };
    cortex_m::interrupt::free(|free| JOINT.borrow(free).replace(Some(joint)));

    let Some(mut peripherals) = Peripherals::take() else { exit(1) };
    peripherals.SYST.set_clock_source(SystClkSource::Core);
    peripherals.SYST.set_reload(MAX_BETWEEN);
    peripherals.SYST.clear_current();
    peripherals.SYST.enable_counter();
    peripherals.SYST.enable_interrupt();
    let planner_ticks = run_planner(planner, of_planner);
    let stopped_at = TICK.load(Relaxed);
    while TICK.load(Relaxed) < TICKS + TICKS_ALONE {
        cortex_m::asm::nop();
    }
    let (interrupted, late_after) =
        (INTERRUPTED.load(Relaxed), LATE_AT.load(Relaxed).wrapping_sub(stopped_at));
    defmt::println!(
        "{=u32} ticks of the joint, {=u32} of the planner at lower priority",
        TICKS,
        planner_ticks
    );
    defmt::println!(
        "{=u32} ticks interrupted a transfer; all words arrived complete and in order",
        interrupted
    );
    defmt::println!("planner stopped: commands late after {=u32} ticks", late_after);
    must("many ticks interrupt transfers", interrupted > TICKS / 100);
    // One less if a tick interrupted the last transfer.
    must("late commands are detected in time", [TIMEOUT_TICKS, TIMEOUT_TICKS + 1].contains(&late_after));
    exit(0)
}

/// Follows a position commanded by another engine.
fn follow(joint: &mut Dimsart) {
    let Some(pd) = MODULES.module("PDCTRL_MOD") else { exit(1) };
    done(joint.command(Command::set(pd, 0, Value::Real(1.0))));
    run(joint, pd);
}

/// Commands half of the received position.
fn plan(planner: &mut Dimsart) {
    let Some(sum) = MODULES.module("SUM_MOD") else { exit(1) };
    for (port, signal) in (0..).zip([types::POSITION, types::POSITION, types::DES_POSITION]) {
        done(planner.command(Command::bind(sum, port, signal.first())));
    }
    for (parameter, gain) in (0..).zip([GAIN, 0.0]) {
        done(planner.command(Command::set(sum, parameter, Value::Real(gain))));
    }
    run(planner, sum);
}

fn connect(
    dimsart: &mut Dimsart,
    name: &'static str,
    gets: &'static [&'static DataType],
    commands: &'static [&'static DataType],
) {
    let period_s = 1e-3;
    match DeviceDescriptor::new(name, &AXES, period_s, gets, commands) {
        Ok(device) => done(dimsart.connect(device, MODULES)),
        Err(error) => done(Err(error)),
    }
}

/// Runs the planner, interrupted anywhere by the joint; returns its ticks.
fn run_planner(dimsart: &mut Dimsart, mut between: Between) -> u32 {
    let mut measured = [Word(0); DOF];
    let mut commanded = [Word(0); DOF];
    let (mut ticks, mut seen) = (0, 0);
    while TICK.load(Relaxed) < TICKS {
        let shown = TICK.load(Relaxed);
        PLANNER_CROSSES.store(true, Relaxed);
        between.receive(&mut measured);
        PLANNER_CROSSES.store(false, Relaxed);
        let tick = ticks_of(&measured, 1.0);
        must("the planner receives the latest position", tick >= shown && tick >= seen);
        seen = tick;
        dimsart.set_commands_stale(between.is_stale());
        dimsart.tick(&measured, &mut commanded);
        PLANNER_CROSSES.store(true, Relaxed);
        between.send(commanded);
        PLANNER_CROSSES.store(false, Relaxed);
        ticks += 1;
    }
    ticks
}

#[exception]
fn SysTick() {
    static mut OWN: Option<Joint> = None;
    set_timer(LONGEST);
    if OWN.is_none() {
        *OWN = cortex_m::interrupt::free(|free| JOINT.borrow(free).take());
    }
    if let Some(joint) = OWN {
        joint.tick();
        // Marsaglia's xorshift.
        joint.random ^= joint.random << 13;
        joint.random ^= joint.random >> 17;
        joint.random ^= joint.random << 5;
        set_timer(joint.random % MAX_BETWEEN + 1);
    }
}

impl Joint {
    fn tick(&mut self) {
        let Self { dimsart, between, measured, planned, showing, .. } = self;
        INTERRUPTED.fetch_add(u32::from(PLANNER_CROSSES.load(Relaxed)), Relaxed);
        let tick = TICK.load(Relaxed) + 1;
        let (position, desired) = measured.split_at_mut(DOF);
        for (axis, word) in position.iter_mut().enumerate() {
            *word = Word::from(at(tick, axis));
        }
        between.receive(desired);
        dimsart.set_commands_stale(between.is_stale());
        let now_planned = ticks_of(desired, 1.0 / GAIN);
        must("planner commands are never older than before", now_planned >= *planned && now_planned < tick);
        let mut force = [Word(0); DOF];
        let outcome = dimsart.tick(measured, &mut force);
        match outcome {
            TickResult::Ran => *planned = now_planned,
            // No command has arrived yet.
            TickResult::CommandsLate if *planned == 0 => {}
            _ => {
                must("late commands are the only error", outcome == TickResult::CommandsLate);
                let _ = LATE_AT.compare_exchange(0, tick, Relaxed, Relaxed);
            }
        }
        for (axis, word) in force.into_iter().enumerate() {
            let follows =
                if outcome == TickResult::Ran { GAIN * at(now_planned, axis) - at(tick, axis) } else { 0.0 };
            must("the force follows the law, or is 0", word == Word::from(follows));
        }

        let before = SYST::get_current();
        between.send(dimsart.signals(&[types::POSITION.first()]));
        let taken = before.wrapping_sub(SYST::get_current()) & LONGEST;
        // A count is less than an instruction of the emulated board.
        must("the duration of a transfer is constant", taken.abs_diff(*showing.get_or_insert(taken)) <= 1);
        TICK.store(tick, Relaxed);
    }
}

/// Encodes the tick of a measurement as a position, exactly representable as `f32`.
fn at(tick: u32, axis: usize) -> f32 {
    tick as f32 * (axis + 1) as f32 / 1024.0
}

/// Decodes the tick from words and a factor; all words must agree.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "an inexact value fails the comparison"
)]
fn ticks_of(words: &[Word], factor: f32) -> u32 {
    let positions = words.iter().map(|word| f32::from_bits(word.0) * factor);
    let tick = (positions.clone().next().unwrap_or_default() * 1024.0) as u32;
    let are_of_one =
        positions.zip(0..).all(|(position, axis)| Word::from(position) == Word::from(at(tick, axis)));
    must("transferred words are of one tick", are_of_one);
    tick
}

/// Restarts the timer.
#[expect(unsafe_code, reason = "only this interrupt uses the timer after its first call")]
fn set_timer(counts: u32) {
    // SAFETY: `main` does not use it after enabling the interrupt.
    let mut timer = unsafe { Peripherals::steal() }.SYST;
    timer.set_reload(counts);
    timer.clear_current();
    SCB::clear_pendst();
}

fn run(dimsart: &mut Dimsart, module: ModuleRef) {
    done(dimsart.command(Command::PlugIn(module)));
    done(dimsart.command(Command::Check));
}

fn done<E>(result: Result<(), E>) {
    must("set-up succeeds", result.is_ok());
}

fn must(hold: &str, holds: bool) {
    if !holds {
        defmt::println!("failed: {=str}", hold);
        exit(1)
    }
}

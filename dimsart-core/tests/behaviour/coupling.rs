//! Two coupled engines of different rates: data arrive complete and in time, or the device gets its safe
//! value.
#![expect(clippy::cast_precision_loss, reason = "small by construction")]

use dimsart_core::{
    Command, Coupling, DriveState, SafetyReason, Snapshot, TIMEOUT_TICKS, TickResult, Word, types,
};

use crate::common::Bench;

const DOF: usize = 2;
/// Period of the slow engine in ticks of the fast engine.
const EVERY: u32 = 10;
const STIFFNESS: f32 = 100.0;
const GAIN: f32 = 0.5;

/// Follows a position that another engine commands.
fn fast() -> Bench {
    let mut bench = Bench::of(DOF, &[types::POSITION, types::DES_POSITION], &[types::DES_FORCE]);
    bench.rows(&format!("PDCTRL_MOD K_PARAM {STIFFNESS}"));
    bench.run("MOD_ENG MOD_ON PDCTRL_MOD");
    bench
}

/// Commands half of the received position.
fn slow() -> Bench {
    let mut bench = Bench::of(DOF, &[types::POSITION], &[types::DES_POSITION]);
    bench.rows("SUM_MOD PORT_A POSITION\nSUM_MOD PORT_B POSITION\nSUM_MOD PORT_SIGNAL_OUT DES_POSITION");
    bench.run(&format!("SUM_MOD A_GAIN {GAIN}\nSUM_MOD B_GAIN 0\nMOD_ENG MOD_ON SUM_MOD"));
    bench
}

/// Both engines and their coupling.
struct Pair<'a> {
    fast: Bench,
    slow: Bench,
    of_fast: Coupling<'a, DOF, DOF>,
    of_slow: Coupling<'a, DOF, DOF>,
    desired: [Word; DOF],
}

impl<'a> Pair<'a> {
    fn new([there, back]: &'a mut [Snapshot<DOF>; 2]) -> Self {
        let (of_fast, of_slow) = Coupling::pair(there, back);
        Self { fast: fast(), slow: slow(), of_fast, of_slow, desired: [Word(0); DOF] }
    }

    fn fast_tick(&mut self, position: [f32; DOF]) -> (TickResult, Vec<f32>) {
        self.of_fast.receive(&mut self.desired);
        self.fast.dimsart.set_commands_stale(self.of_fast.is_stale());
        let measured: Vec<Word> = position.map(Word::from).into_iter().chain(self.desired).collect();
        let (tick, commanded) = self.fast.try_tick(&measured);
        self.of_fast.send(self.fast.dimsart.signals(&[types::POSITION.first()]));
        (tick, commanded.into_iter().map(|word| f32::from_bits(word.0)).collect())
    }

    fn slow_tick(&mut self) -> TickResult {
        let mut measured = [Word(0); DOF];
        self.of_slow.receive(&mut measured);
        self.slow.dimsart.set_commands_stale(self.of_slow.is_stale());
        let (tick, commanded) = self.slow.try_tick(&measured);
        self.of_slow.send(commanded);
        tick
    }
}

fn position(tick: u32) -> [f32; DOF] {
    let time = tick as f32;
    [(0.01 * time).sin(), (0.003 * time).cos()]
}

#[test]
fn a_cascade_over_two_engines_is_the_law_with_the_slow_one_held_between_its_ticks() {
    let mut between = [const { Snapshot::new() }; 2];
    let mut pair = Pair::new(&mut between);
    let mut commanded_from = None;
    for tick in 0..1_000 {
        let (came, force) = pair.fast_tick(position(tick));
        match commanded_from {
            None => assert_eq!(came, TickResult::CommandsLate, "tick {tick}: no data yet"),
            Some(then) => {
                assert_eq!(came, TickResult::Ran, "tick {tick}");
                for (axis, force) in force.iter().enumerate() {
                    let expected = STIFFNESS * (GAIN * position(then)[axis] - position(tick)[axis]);
                    assert!((force - expected).abs() <= 1e-5 * STIFFNESS, "tick {tick}: {force} {expected}");
                }
            }
        }
        if tick % EVERY == 3 {
            assert_eq!(pair.slow_tick(), TickResult::Ran);
            commanded_from = Some(tick);
        }
    }
    assert_eq!(pair.fast.dimsart.safety().state(), DriveState::OperationEnabled);
}

#[test]
fn commands_are_late_after_twenty_ticks_and_never_after_nineteen() {
    for silent in [1, EVERY, TIMEOUT_TICKS - 1, TIMEOUT_TICKS, TIMEOUT_TICKS + 1, 1_000] {
        let mut between = [const { Snapshot::new() }; 2];
        let mut pair = Pair::new(&mut between);
        for tick in 0..100 {
            pair.fast_tick(position(tick));
            pair.slow_tick();
        }
        // The first late tick still delivers the data of the tick before.
        let ticks: Vec<TickResult> =
            (0..=silent).map(|tick| pair.fast_tick(position(100 + tick)).0).collect();
        let late = ticks.iter().position(|tick| *tick == TickResult::CommandsLate);
        let expected = (silent >= TIMEOUT_TICKS).then_some(TIMEOUT_TICKS as usize);
        assert_eq!(late, expected, "silent for {silent}");
        pair.slow_tick();
        let (tick, force) = pair.fast_tick([1.0; DOF]);
        if late.is_none() {
            assert_eq!(tick, TickResult::Ran);
            continue;
        }
        // The fault latches, even if commands resume.
        assert_eq!(
            (tick, pair.fast.dimsart.safety().reason()),
            (TickResult::CommandsLate, SafetyReason::CommandsLate)
        );
        assert_eq!(force, [0.0; DOF]);
        pair.fast.dimsart.command(Command::Reset).unwrap();
        pair.slow_tick();
        assert_eq!(pair.fast_tick([1.0; DOF]).0, TickResult::Ran);
    }
}

#[test]
fn while_nothing_moves_late_commands_are_no_fault() {
    let mut between = [const { Snapshot::new() }; 2];
    let mut pair = Pair::new(&mut between);
    pair.fast.dimsart.set_motion_allowed(false);
    for tick in 0..100 {
        assert_eq!(pair.fast_tick(position(tick)).0, TickResult::CommandsLate);
    }
    pair.slow_tick();
    assert_eq!(pair.fast_tick(position(100)).0, TickResult::Disarmed);
    pair.fast.dimsart.set_motion_allowed(true);
    assert_eq!(pair.fast_tick(position(101)).0, TickResult::Ran);
}

#[test]
fn a_timeout_can_be_longer_for_an_engine_that_is_slower() {
    let mut between = [const { Snapshot::new() }; 2];
    let mut pair = Pair::new(&mut between);
    pair.of_fast = pair.of_fast.with_timeout_ticks(100);
    pair.fast_tick(position(0));
    pair.slow_tick();
    let ticks: Vec<TickResult> = (0..110).map(|tick| pair.fast_tick(position(tick)).0).collect();
    assert_eq!(ticks.iter().position(|tick| *tick == TickResult::CommandsLate), Some(100));
}

#[test]
fn a_signal_that_is_not_there_is_refused_by_who_gets_it() {
    let mut between = [const { Snapshot::new() }; 2];
    let mut pair = Pair::new(&mut between);
    pair.fast_tick(position(0));
    let lacking = [types::DES_VELOCITY.first()];
    let words: Vec<Word> = pair.fast.dimsart.signals(&lacking).collect();
    assert_eq!(words.len(), DOF);
    pair.of_fast.send(words);
    assert!(matches!(pair.slow_tick(), TickResult::MeasurementRefused(_)));
}

/// Two threads, as a loop and an interrupt: the words include a checksum.
#[test]
fn words_that_cross_threads_are_whole_and_never_old() {
    const WORDS: usize = 32;
    const WRITES: u32 = 200_000;
    let mut snapshot = Snapshot::<WORDS>::new();
    let (mut writer, mut reader) = snapshot.split();
    std::thread::scope(|scope| {
        scope.spawn(move || (1..=WRITES).for_each(|count| writer.write([count; WORDS])));
        let mut last = 0;
        while last < WRITES {
            let is_new = reader.update();
            let words: Vec<u32> = reader.words().collect();
            assert!(words.iter().all(|word| *word == words[0]), "{words:?}");
            assert_eq!(is_new, words[0] > last);
            last = words[0];
        }
    });
}

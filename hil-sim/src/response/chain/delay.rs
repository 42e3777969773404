//! Delays added to a round trip by the delay modules and packets of a scheme.
//!
//! The receiver outputs a wave `PLAYOUT_TICKS` after the fastest packet. A wave sent every `n` ticks as a mean, and
//! output for `n` ticks, is delayed by `n - 1` ticks on average.
//!
//! Only delay modules in the signal path count, independent of their number and bindings: from the source of the
//! signal sent on link 0 to its packet, and from the received packet to the user of its signal. The first wave of a
//! packet is followed, or its first signal if it has no waves.

use dimsart_core::{Direction, Engine, KindId, ModuleRef, TypeRef, Unit};

use super::scheme_values::{choice, count};
use crate::rig::SimulatedDimsart;

/// A delay module between two signals.
struct Delay {
    from: TypeRef,
    to: TypeRef,
    ticks: u32,
}

/// Samples between link and signals, both directions together.
pub(super) fn delay_ticks(dimsart: &mut SimulatedDimsart) -> u32 {
    let engine = dimsart.engine_mut();
    let sent = carried(engine, "COMM_TXMOD", "CTX_LINK", Direction::Read);
    let received = carried(engine, "COMM_RXMOD", "CRX_LINK", Direction::Write);
    let line = DelayLine { delays: delays(engine), used: used(engine) };
    let before = sent.map_or(0, |signal| line.ticks_before(signal));
    let behind = received.and_then(|signal| line.ticks_behind(signal, line.delays.len()));
    let every = every_ticks(engine);
    let playout = playout_ticks(engine);
    [behind.unwrap_or(0), every.saturating_sub(1), playout].into_iter().fold(before, u32::saturating_add)
}

/// Ticks per packet sent on link 0.
pub(super) fn every_ticks(engine: &mut Engine) -> u32 {
    let sender = on_link_0(engine, "COMM_TXMOD", "CTX_LINK");
    sender.and_then(|module| count(engine, module, "CTX_EVERY")).unwrap_or(1)
}

/// Policy of the receiver of link 0 for missing packets; `None` without a receiver.
pub(super) fn policy(engine: &mut Engine) -> Option<&'static str> {
    let receiver = on_link_0(engine, "COMM_RXMOD", "CRX_LINK")?;
    choice(engine, receiver, "STALE")
}

/// Play-out of the receiver of link 0; 0 if not used by its policy.
pub(super) fn playout_ticks(engine: &mut Engine) -> u32 {
    let Some(receiver) = on_link_0(engine, "COMM_RXMOD", "CRX_LINK") else { return 0 };
    let policy = choice(engine, receiver, "STALE");
    let makes_up = policy.is_some_and(|policy| matches!(policy, "LIMITED" | "INTEGRAL"));
    count(engine, receiver, "PLAYOUT_TICKS").filter(|_| makes_up).unwrap_or(0)
}

/// Delay modules of a scheme, and signals used by other modules.
struct DelayLine {
    delays: Vec<Delay>,
    used: Vec<TypeRef>,
}

impl DelayLine {
    /// Samples from the source of `signal`, which has one provider.
    fn ticks_before(&self, mut signal: TypeRef) -> u32 {
        let mut ticks = 0_u32;
        // At most one step per delay module, as bindings can form a loop.
        for _ in &self.delays {
            let Some(delay) = self.delays.iter().find(|delay| delay.to == signal) else { break };
            ticks = ticks.saturating_add(delay.ticks);
            signal = delay.from;
        }
        ticks
    }

    /// Samples to the nearest user of `signal`, through at most `most` delay modules; `None` if unused.
    fn ticks_behind(&self, signal: TypeRef, most: usize) -> Option<u32> {
        if self.used.contains(&signal) {
            return Some(0);
        }
        let most = most.checked_sub(1)?;
        let ways = self.delays.iter().filter(|delay| delay.from == signal);
        ways.filter_map(|delay| Some(delay.ticks.saturating_add(self.ticks_behind(delay.to, most)?))).min()
    }
}

/// Returns the followed signal of a comm module on link 0.
fn carried(engine: &mut Engine, kind: &str, link: &str, direction: Direction) -> Option<TypeRef> {
    let module = on_link_0(engine, kind, link)?;
    let signals = signals(engine, module, direction);
    let is_wave = |signal: &&TypeRef| {
        engine.device().data_type(signal.id).is_some_and(|data_type| data_type.unit == Unit::Wave)
    };
    signals.iter().find(is_wave).or(signals.first()).copied()
}

/// Finds the comm module of this kind on link 0.
fn on_link_0(engine: &mut Engine, kind: &str, link: &str) -> Option<ModuleRef> {
    let modules: Vec<ModuleRef> = engine.instances().filter(|module| is_of(*module, kind)).collect();
    modules.into_iter().find(|module| count(engine, *module, link) == Some(0))
}

fn delays(engine: &mut Engine) -> Vec<Delay> {
    let modules: Vec<ModuleRef> =
        engine.instances().filter(|module| is_of(*module, "TIMEDELAY_MOD")).collect();
    let delay = |module| {
        Some(Delay {
            ticks: count(engine, module, "TD_PARAM")?,
            from: *signals(engine, module, Direction::Read).first()?,
            to: *signals(engine, module, Direction::Write).first()?,
        })
    };
    modules.into_iter().filter_map(delay).collect()
}

/// Signals read by the device, or by a module other than delays and recorders.
fn used(engine: &Engine) -> Vec<TypeRef> {
    let uses = |module: &ModuleRef| !is_of(*module, "TIMEDELAY_MOD") && !is_of(*module, "RECORDER_MOD");
    let modules = engine.instances().filter(uses);
    let read = modules.flat_map(|module| signals(engine, module, Direction::Read));
    read.chain(engine.device().inputs.iter().map(|data_type| data_type.first())).collect()
}

fn is_of(module: ModuleRef, kind: &str) -> bool {
    module.kind == KindId::from_name(kind)
}

/// Returns the signals of a module in the order of its ports; `None` if not plugged in.
fn signals(engine: &Engine, module: ModuleRef, direction: Direction) -> Vec<TypeRef> {
    let steps = engine.steps().filter(|step| step.module == module);
    let signals = steps.flat_map(|step| engine.step_signals(step));
    signals.filter(|(_, found)| *found == direction).map(|(signal, _)| signal).collect()
}

#[cfg(test)]
mod tests {
    use dimsart_modules::ALL;

    use super::*;
    use crate::schemes::{SchemeText, device, load};

    /// Delay of the shipped scheme on the master with rows, named by their words, replaced.
    fn delay_of(replaced: &[(&str, &str)]) -> u32 {
        let mut scheme = SchemeText::read("builtin:bilateral").unwrap();
        for (row, by) in replaced {
            let words = |line: &str| line.split_whitespace().collect::<Vec<_>>().join(" ");
            assert!(scheme.text.lines().any(|line| words(line).contains(row)), "no row {row}");
            let lines = scheme.text.lines().map(|line| if words(line).contains(row) { by } else { line });
            scheme.text = lines.collect::<Vec<_>>().join("\n");
        }
        let mut dimsart = Box::new(SimulatedDimsart::new(device("master", 2, 1e-3).unwrap(), ALL).unwrap());
        let loaded = load(&scheme, "master", &[], &mut dimsart);
        assert!(loaded.is_valid(), "{loaded:?}");
        delay_ticks(&mut dimsart)
    }

    #[test]
    fn every_delay_on_the_way_counts_whatever_its_number() {
        assert_eq!(delay_of(&[]), 10);
        let no_delay = [("TIMEDELAY_MOD", ""), ("CTX_ADD_DATA", "all COMM_TXMOD CTX_ADD_DATA CH1_WAVES")];
        assert_eq!(delay_of(&no_delay), 0);
        let incoming = "all TIMEDELAY_MOD.3 PORT_SIGNAL_IN CH2_WAVES
            all TIMEDELAY_MOD.3 PORT_SIGNAL_OUT CH2_TD_WAVES
            all TIMEDELAY_MOD.3 TD_PARAM 4
            all MOD_ENG MOD_ON TIMEDELAY_MOD.3
            all WTRANSF_MOD PORT_WAVES_IN CH2_TD_WAVES
            all MOD_ENG MOD_ON WTRANSF_MOD";
        assert_eq!(delay_of(&[("MOD_ON WTRANSF_MOD", incoming)]), 14);
        let second = "all MOD_ENG MOD_ON TIMEDELAY_MOD
            all TIMEDELAY_MOD.2 PORT_SIGNAL_IN CH1_TD_WAVES
            all TIMEDELAY_MOD.2 PORT_SIGNAL_OUT CH1_TD_WAVES.2
            all TIMEDELAY_MOD.2 TD_PARAM 7
            all MOD_ENG MOD_ON TIMEDELAY_MOD.2";
        let sent = "all COMM_TXMOD CTX_ADD_DATA CH1_TD_WAVES.2";
        assert_eq!(delay_of(&[("MOD_ON TIMEDELAY_MOD", second), ("CTX_ADD_DATA", sent)]), 17);
    }

    #[test]
    fn play_out_counts_where_the_policy_uses_it() {
        let of = |policy| {
            let rows = format!(
                "all COMM_RXMOD STALE {policy}
                all COMM_RXMOD PLAYOUT_TICKS 6
                all MOD_ENG MOD_ON COMM_RXMOD"
            );
            delay_of(&[("MOD_ON COMM_RXMOD", &rows)])
        };
        assert_eq!(["ZERO", "HOLD", "LIMITED", "INTEGRAL"].map(of), [10, 10, 16, 16]);
    }

    #[test]
    fn a_delay_beside_the_way_does_not_count() {
        let beside = "all TIMEDELAY_MOD.2 PORT_SIGNAL_IN CH2_WAVES
            all TIMEDELAY_MOD.2 PORT_SIGNAL_OUT SIGNAL
            all TIMEDELAY_MOD.2 TD_PARAM 30
            all MOD_ENG MOD_ON TIMEDELAY_MOD.2
            all MOD_ENG MOD_ON RECORDER_MOD
            all MOD_ENG MOD_ON WTRANSF_MOD";
        assert_eq!(delay_of(&[("MOD_ON WTRANSF_MOD", beside)]), 10);
    }

    /// The wave is followed, not the position that goes with it.
    #[test]
    fn of_several_signals_the_wave_is_followed() {
        let both = "all TIMEDELAY_MOD.2 PORT_SIGNAL_IN POSITION
            all TIMEDELAY_MOD.2 PORT_SIGNAL_OUT POSITION.2
            all TIMEDELAY_MOD.2 TD_PARAM 3
            all MOD_ENG MOD_ON TIMEDELAY_MOD.2
            all COMM_TXMOD CTX_ADD_DATA POSITION.2
            all COMM_TXMOD CTX_ADD_DATA CH1_TD_WAVES";
        assert_eq!(delay_of(&[("CTX_ADD_DATA", both)]), 10);
    }
}

//! Play-out: waves over a line with jitter and loss are output evenly. No energy is generated, no
//! displacement is lost.

use std::collections::VecDeque;

use crate::common::H;
use crate::common::way::{Way, chance, energy};
use dimsart_core::Packet;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

/// Maximum difference of delay between two packets, ticks.
const JITTER_TICKS: u32 = 6;

/// A link with jitter and loss that carries waves one way.
struct JitteryLink {
    random: Pcg32,
    way: Way,
    loss: f64,
    on_its_way: VecDeque<(u32, Packet)>,
    last_arrival: u32,
}

impl JitteryLink {
    fn new(seed: u64, policy: &str, every: u32, loss: f64, playout_ticks: u32) -> Self {
        let rows = format!(
            "COMM_RXMOD TIMEOUT_TICKS 0\nCOMM_RXMOD STALE {policy}\nCOMM_RXMOD PLAYOUT_TICKS {playout_ticks}"
        );
        Self {
            random: Pcg32::seed_from_u64(seed),
            way: Way::every(&rows, every),
            loss,
            on_its_way: VecDeque::new(),
            last_arrival: 0,
        }
    }

    /// Runs a tick of both ends; returns the output wave.
    fn pass(&mut self, tick: u32, wave: f32) -> f32 {
        if let Some(packet) = self.way.try_send(wave)
            && chance(&mut self.random) >= self.loss
        {
            // The first packet is fast, so that the time base is known from the start.
            let late = if tick < 100 { 0 } else { self.random.next_u32() % (JITTER_TICKS + 1) };
            self.last_arrival = (tick + late).max(self.last_arrival);
            self.on_its_way.push_back((self.last_arrival, packet));
        }
        let mut arrived = Vec::new();
        while self.on_its_way.front().is_some_and(|(arrival, _)| *arrival <= tick) {
            arrived.extend(self.on_its_way.pop_front().map(|(_, packet)| packet));
        }
        self.way.receive(&arrived)
    }
}

/// A constant wave results from a constant force: only even output carries its displacement with its energy.
#[test]
fn a_constant_wave_stays_constant_over_jitter_and_loss() {
    for (every, loss) in [(1, 0.0), (1, 0.05), (2, 0.0), (3, 0.02)] {
        for policy in ["LIMITED", "INTEGRAL"] {
            let playout_ticks = JITTER_TICKS + 6 * every;
            let mut link = JitteryLink::new(90, policy, every, loss, playout_ticks);
            let waves: Vec<f32> = (0..20_000).map(|tick| link.pass(tick, 0.5)).collect();
            for (tick, wave) in waves.iter().enumerate().skip(500) {
                assert!((wave - 0.5).abs() < 5e-3, "{policy}, {every}, {loss}, {tick}: {wave}");
            }
            let given: f64 = waves.iter().map(|wave| f64::from(*wave)).sum();
            let late_ticks = 20_000.0 - given / 0.5;
            // The wave of the very first packet is output for one tick.
            let expected_ticks = f64::from(playout_ticks + 2 * (every - 1));
            assert!((late_ticks - expected_ticks).abs() < 0.1, "{policy}, {every}, {loss}: {late_ticks}");
        }
    }
}

/// Without play-out, the same jitter retains half of the displacement, or generates energy.
#[test]
fn jitter_without_play_out_loses_displacement_or_makes_energy() {
    let run = |policy| {
        let mut link = JitteryLink::new(91, policy, 1, 0.0, 0);
        let waves: Vec<f32> = (0..20_000).map(|tick| link.pass(tick, 0.5)).collect();
        let displacement: f64 = waves.iter().map(|wave| f64::from(*wave) * f64::from(H)).sum();
        (displacement / (10_000.0 * f64::from(H)), waves.iter().map(|wave| energy(*wave)).sum::<f64>())
    };
    let sent_j = 20_000.0 * energy(0.5);
    let (limited, integral) = (run("LIMITED"), run("INTEGRAL"));
    assert!(limited.0 < 0.9 && limited.1 <= sent_j * (1.0 + 1e-6), "{limited:?} of {sent_j} J");
    assert!(integral.0 > 0.99 && integral.1 > 1.2 * sent_j, "{integral:?} of {sent_j} J");
}

#[test]
fn waves_of_any_form_gain_no_energy_and_arrive_in_full() {
    for (every, loss) in [(1, 0.0), (1, 0.1), (2, 0.1), (5, 0.02)] {
        let playout_ticks = JITTER_TICKS + 3 * every;
        let mut link = JitteryLink::new(92, "LIMITED", every, loss, playout_ticks);
        let (mut sent, mut given, mut slow) = ([0.0; 2], [0.0; 2], 0.0);
        for tick in 0..20_000 {
            slow = 0.999 * slow + 0.05 * (chance(&mut link.random) - 0.5);
            #[expect(clippy::cast_possible_truncation, reason = "waves are f32")]
            // At rest at the end, so that the whole debt is paid.
            let wave = if tick < 19_000 { slow as f32 } else { 0.0 };
            let out = link.pass(tick, wave);
            for (sums, wave) in [(&mut sent, wave), (&mut given, out)] {
                *sums = [sums[0] + energy(wave), sums[1] + f64::from(wave) * f64::from(H)];
            }
            assert!(given[0] <= sent[0] * (1.0 + 1e-6), "{every}, {loss}, {tick}: {given:?} of {sent:?}");
        }
        assert!((sent[1] - given[1]).abs() < 1e-4 && sent[0] > 0.0, "{every}, {loss}: {given:?} of {sent:?}");
    }
}

/// An outage longer than the delay leaves some displacement unpaid under a constant wave, for lack of energy,
/// and none afterwards.
#[test]
fn an_outage_costs_its_own_displacement_and_none_later() {
    let mut link = JitteryLink::new(94, "LIMITED", 1, 0.0, 10);
    let waves: Vec<f32> = (0..20_000)
        .map(|tick| {
            link.loss = if (5_000..5_050).contains(&tick) { 1.0 } else { 0.0 };
            link.pass(tick, 0.5)
        })
        .collect();
    let given = |from: usize| waves.iter().skip(from).map(|wave| f64::from(*wave) / 0.5).sum::<f64>();
    assert!(waves.iter().any(|wave| wave.abs() < 1e-6), "no outage");
    let missing_ticks = 20_000.0 - 10.0 - given(0);
    assert!((0.0..50.0).contains(&missing_ticks), "{missing_ticks} ticks' worth");
    assert!((given(5_100) / 14_900.0 - 1.0).abs() < 1e-3, "{}", given(5_100));
}

#[test]
fn play_out_can_be_turned_on_and_off_while_waves_pass() {
    let mut link = JitteryLink::new(93, "INTEGRAL", 1, 0.0, 0);
    let mut given = 0.0;
    for tick in 0..6_000 {
        match tick {
            2_000 => link.way.receiver.run("COMM_RXMOD PLAYOUT_TICKS 10"),
            4_000 => link.way.receiver.run("COMM_RXMOD PLAYOUT_TICKS 0"),
            _ => {}
        }
        let wave = link.pass(tick, 0.5);
        assert!(wave.is_finite() && (0.0..5.0).contains(&wave), "{tick}: {wave}");
        if (3_000..4_000).contains(&tick) {
            assert!((wave - 0.5).abs() < 5e-3, "{tick}: {wave}");
        }
        given += f64::from(wave);
    }
    assert!(given > 0.0);
}

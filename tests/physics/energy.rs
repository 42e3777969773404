//! The energy in the line is that of the waves in flight.
#![expect(clippy::unwrap_used, reason = "in helpers of tests as in tests")]

use std::collections::VecDeque;
use std::f64::consts::PI;
use std::sync::atomic::AtomicBool;

use dimsart_core::types;
use hil_sim::experiment::Experiment;
use hil_sim::observer::channel_energy::ChannelEnergy;
use hil_sim::plant::Joints;
use hil_sim::rig::Rig;

use crate::loops::{MASTER, Met, SLAVE, TICK_S, axis, bilateral, delays, push, rig, signal};

/// One direction of the line: waves in flight.
struct InFlight(VecDeque<f64>);

impl InFlight {
    fn new(delay_ticks: u32) -> Self {
        Self((0..delay_ticks).map(|_| 0.0).collect())
    }

    /// Adds the wave sent in this tick; returns the one that arrives.
    fn pass(&mut self, wave: f64) -> f64 {
        self.0.push_back(wave);
        self.0.pop_front().unwrap()
    }

    fn energy_j(&self) -> f64 {
        0.5 * TICK_S * self.0.iter().map(|wave| wave * wave).sum::<f64>()
    }
}

/// Half a unit in the last place of an `f32`, relative to the number.
const ROUNDING: f64 = 0.5 * f32::EPSILON as f64;

/// Returns the energy from a port to the line in this tick, by force and velocity, and by waves, `J`.
fn passed_j(rig: &Rig, side: usize) -> (f64, f64) {
    let at = |data_type| signal(rig, side, data_type);
    let waves = at(types::CH1_WAVES).powi(2) + at(types::CH2_WAVES).powi(2);
    (TICK_S * at(types::LINE_FORCE) * at(types::LINE_VELOCITY), 0.5 * TICK_S * waves)
}

/// Lossless for any constant delay (Niemeyer and Slotine, 1991): on every tick
///
/// `sum h (F_m v_m - F_s v_s) = h/2 (sum of squares of the waves in flight, both ways) >= 0`
///
/// and a wave arrives unchanged after the delay. The simulator's account, computed from waves only, equals
/// the right side exactly; the left side contains forces and velocities rounded by up to [`ROUNDING`] each,
/// hence a tolerance of 4 times that, relative to the transferred energy.
#[test]
fn the_line_holds_the_energy_of_the_waves_in_flight() {
    for form in ["split", "implicit"] {
        for (forward_ticks, backward_ticks) in [(0, 1), (1, 1), (10, 1), (3, 17), (40, 4), (100, 100)] {
            let settings = format!("wave.form={form} {}", delays(forward_ticks, backward_ticks));
            let hand = push(|t| 2.0 * libm::sin(9.0 * t) + if t < 0.5 { 1.0 } else { 0.0 });
            let mut rig =
                rig(&settings, axis(0.1, 8.0, Met::Nothing, hand), axis(0.5, 8.0, Met::Nothing, None));
            let mut account = ChannelEnergy::new(&rig);
            let (mut forward, mut backward) = (InFlight::new(forward_ticks), InFlight::new(backward_ticks));
            let (mut through_ports_j, mut carried_j, mut largest_error) = (0.0, 0.0, 0.0_f64);
            for _ in 0..5000 {
                rig.tick();
                for (line, from, to) in [(&mut forward, MASTER, SLAVE), (&mut backward, SLAVE, MASTER)] {
                    let due = line.pass(signal(&rig, from, types::CH1_WAVES));
                    let arrived = signal(&rig, to, types::CH2_WAVES);
                    assert_eq!(due.to_bits(), arrived.to_bits(), "{arrived} arrived instead of {due}");
                }
                let [master_j, slave_j] = [MASTER, SLAVE].map(|side| passed_j(&rig, side));
                through_ports_j += master_j.0 - slave_j.0;
                carried_j += master_j.1 + slave_j.1;
                let in_flight_j = forward.energy_j() + backward.energy_j();
                account.add(&rig);
                let account_j = account.energy_j()[0];
                assert!((account_j - in_flight_j).abs() <= 1e-14, "the account has {account_j} J");
                let error = (through_ports_j - in_flight_j).abs() / carried_j.max(f64::MIN_POSITIVE);
                largest_error = largest_error.max(error);
                rig.advance();
            }
            println!(
                "{form:8} {forward_ticks:3} + {backward_ticks:3} ticks: {largest_error:.1e} of {carried_j:.3} J"
            );
            assert!(
                largest_error < 4.0 * ROUNDING,
                "{largest_error:e} of the energy carried is not in the books"
            );
        }
    }
}

/// Axis 0 pushes the slave into a spring and keeps energy in flight; axis 1 oscillates over a link that
/// repeats lost packets, and extracts more energy than was put in. Their sum is positive, but axis 1 is not
/// passive.
#[test]
fn an_axis_that_gives_energy_away_does_not_hide_behind_another() {
    let swing = |t: f64| if t > 2.0 && t % 2.0 < 1.0 { 2.0 * libm::sin(2.0 * PI * 3.0 * t) } else { 0.0 };
    let (master, slave) = (|hand| axis(0.1, 8.0, Met::Nothing, hand), |met| axis(0.5, 8.0, met, None));
    let settings = format!("dof=2 seed=2 link.stale=hold link.loss=0.2 {}", delays(10, 10));
    let mut rig = rig(&settings, master(push(|_| 0.0)), slave(Met::Nothing));
    let axes = [
        vec![master(push(|_| 8.0)), master(push(swing))],
        vec![slave(Met::Spring(1e3)), slave(Met::Nothing)],
    ];
    for (station, axes) in rig.stations_mut().iter_mut().zip(axes) {
        station.plant = Box::new(Joints::new(axes));
    }
    let mut account = ChannelEnergy::new(&rig);
    let (mut smallest_j, mut smallest_of_both_j) = ([0.0_f64; 2], f64::INFINITY);
    for _ in 0..20_000 {
        rig.tick();
        account.add(&rig);
        let [energy_j, swung_j] = account.energy_j()[..] else { panic!("two axes") };
        smallest_j = [smallest_j[0].min(energy_j), smallest_j[1].min(swung_j)];
        if rig.time_s() > 2.0 {
            smallest_of_both_j = smallest_of_both_j.min(energy_j + swung_j);
        }
        rig.advance();
    }
    println!("smallest by axis {smallest_j:?} J, of both {smallest_of_both_j} J");
    assert!(smallest_j[1] < -1e-9 && smallest_j[0] > smallest_j[1] && smallest_of_both_j > 0.0);
    assert_eq!(account.min_j(), Some(smallest_j[1]));
}

#[test]
fn what_sends_no_waves_or_never_runs_has_no_channel_energy() {
    let energy_min_j = |settings: &str, is_stopped: bool| {
        let experiment = Experiment::new(&bilateral(settings)).unwrap();
        experiment.run(&AtomicBool::new(is_stopped), |_| ()).outcome.energy_min_j
    };
    let without_waves =
        "master.scheme=builtin:position_position slave.scheme=builtin:position_position duration_s=0.1";
    assert_eq!(energy_min_j(without_waves, false), None);
    assert_eq!(energy_min_j("", true), None);
    assert_eq!(energy_min_j("duration_s=0.1", false), Some(0.0));
}

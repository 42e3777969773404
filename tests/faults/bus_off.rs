//! Unstable links and CAN bus-off: no motion until it is enabled again.

use std::f64::consts::PI;

use dimsart_core::TickResult;
use hil_sim::plant::ExternalForce;
use hil_sim::rig::Station;

use crate::line::Loop;
use crate::loops::{Met, SLAVE, axis, push, rig};
use test_requirements::length;

/// A hand that never releases the device.
fn swing() -> Option<ExternalForce> {
    push(|t| 2.0 * libm::sin(2.0 * PI * 0.7 * t))
}

/// Returns how far the slave moves in these ticks, `m`.
fn slave_goes_m(both: &mut Loop, ticks: u64, what: &str) -> f64 {
    let mut range_m = [f64::INFINITY, f64::NEG_INFINITY];
    for _ in 0..ticks {
        both.tick(what);
        both.rig.advance();
        let now_m = both.positions_m()[SLAVE];
        range_m = [range_m[0].min(now_m), range_m[1].max(now_m)];
    }
    range_m[1] - range_m[0]
}

/// 100 repetitions in the long run.
#[test]
fn a_link_that_comes_back_moves_nothing_until_it_is_enabled_again() {
    const CYCLE_TICKS: u64 = 4000;
    let is_down = |tick| (1500..1600).contains(&(tick % CYCLE_TICKS));
    let mut both = Loop::new("", swing(), [is_down, is_down]);
    for flap in 1..=length(3, 100) {
        let what = format!("flap {flap}");
        let moved_m = slave_goes_m(&mut both, 1500, &what);
        assert!(moved_m > 0.01, "{what}: {moved_m} m while the link is there");
        // Link down, link lost, and a second in which friction stops the motion.
        slave_goes_m(&mut both, 1100, &what);
        let moved_m = slave_goes_m(&mut both, CYCLE_TICKS - 2600, &what);
        assert!(moved_m < 1e-6, "{what}: {moved_m} m without being enabled");
        both.reset();
    }
}

/// Bit errors cause repeated bus-off. At first nodes rejoin before the link is lost; then one stays off, the
/// link is lost on both sides, and the slave stays at rest although the hand moves on.
#[test]
fn a_node_that_stays_off_the_bus_leaves_both_sides_at_rest() {
    for seed in 0..length(3, 100) {
        // Destroys about one frame in four; more than one in nine leads to bus-off.
        for (carrier, bit_error_rate) in [("can link.every_ticks=2", 2e-3), ("can_fd", 1e-3)] {
            for rejoins in [0, 3] {
                let what = format!("{carrier}, {rejoins} rejoins, seed {seed}");
                let bus = format!(
                    "can.bits_per_s=1000000 can.bit_error_rate={bit_error_rate} can.rejoins={rejoins}"
                );
                let settings = format!("wave.form=implicit link.carrier={carrier} {bus} seed={seed}");
                let (master, slave) =
                    (axis(0.1, 8.0, Met::Nothing, swing()), axis(0.5, 8.0, Met::Nothing, None));
                let mut rig = rig(&settings, master, slave);
                let mut at_rest_m = None::<f32>;
                let mut farthest_m = 0.0_f32;
                for tick in 0..20_000 {
                    rig.tick();
                    let now_m = rig.stations()[SLAVE].position()[0];
                    farthest_m = farthest_m.max(now_m.abs());
                    if tick >= 15_000 {
                        let is_lost =
                            |station: &Station| station.last_tick == TickResult::LinkLost { link: 0 };
                        assert!(rig.stations().iter().all(is_lost), "{what}, tick {tick}");
                        let moved_m = (now_m - *at_rest_m.get_or_insert(now_m)).abs();
                        assert!(moved_m < 1e-6, "{what}: the slave moved by {moved_m} m");
                    }
                    rig.advance();
                }
                let media = rig.media();
                let bus = media.first().unwrap();
                let bus_offs = bus.traffic.bus_offs;
                println!("{what}: {bus_offs} times bus-off, the slave went {farthest_m} m, {:?}", bus.faults);
                assert!(bus_offs > rejoins && bus_offs <= 2 * (rejoins + 1), "{what}: {bus_offs}");
                assert!(
                    bus.faults.iter().any(|fault| fault.contains("is still bus-off at the end")),
                    "{:?}",
                    bus.faults
                );
                assert!(farthest_m > 1e-4, "{what}: it moved while the bus was there");
            }
        }
    }
}

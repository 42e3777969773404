//! A day of the shipped experiment with continuous motion, packet loss, jitter and different clocks: no
//! faults, no growth, and nothing lost except packets.
//!
//! Short in `cargo test`; `cargo xtask long` runs 24 hours.
//! Short as `cargo test` runs it; `cargo xtask long` runs all 24 hours.
#![expect(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    reason = "in helpers of tests as in tests"
)]

mod line;
mod side;

use line::Line;
use side::{DOF, Side};

/// Maximum difference of two cheap oscillators: 500 ppm fast and 500 ppm slow.
const PERIODS_NS: [u64; 2] = [999_500, 1_000_500];
const NS_PER_S: u64 = 1_000_000_000;
/// Length of an evaluated interval.
const SPELL_S: u64 = 60;
/// Resolution of the energy account in packets, J.
const COUNT_J: f64 = 1e-9;

/// Maximum values of an interval, over both sides.
#[derive(Debug, Clone, Copy, Default)]
struct Largest {
    force_n: f64,
    position_m: f64,
    /// Position difference of the devices, on axes without contact.
    apart_m: f64,
}

#[test]
fn a_day_without_rest_leaves_nothing_behind() {
    let duration_s = test_requirements::length(240, 24 * 3600);
    let mut sides = [Side::master(PERIODS_NS[0]), Side::slave(PERIODS_NS[1])];
    let mut lines = [Line::new(1), Line::new(2)];
    let (mut first, mut spell, mut most) = (None, Largest::default(), Largest::default());
    let mut spell_end_ns = SPELL_S * NS_PER_S;
    let mut smallest_j = f64::INFINITY;
    loop {
        let at = usize::from(sides[0].next_ns > sides[1].next_ns);
        let now_ns = sides[at].next_ns;
        if now_ns >= spell_end_ns {
            check_counters(&sides, &lines);
            let before = *first.get_or_insert(spell);
            assert!(spell.force_n < 1.05 * before.force_n, "{spell:?} after {before:?}, {now_ns} ns");
            assert!(spell.position_m < 1.05 * before.position_m, "{spell:?} after {before:?}, {now_ns} ns");
            (most.force_n, most.position_m) =
                (most.force_n.max(spell.force_n), most.position_m.max(spell.position_m));
            most.apart_m = most.apart_m.max(spell.apart_m);
            spell = Largest::default();
            spell_end_ns += SPELL_S * NS_PER_S;
        }
        if now_ns >= duration_s * NS_PER_S {
            break;
        }
        let side = &mut sides[at];
        lines[1 - at].deliver(now_ns, |packet| side.receive(packet));
        let packet = side.tick();
        lines[at].send(now_ns, packet);
        for axis in 0..DOF {
            let in_line_j = sides[0].energy_j(axis) + sides[1].energy_j(axis);
            smallest_j = smallest_j.min(in_line_j);
            assert!(in_line_j > -COUNT_J, "axis {axis}: {in_line_j} J, {now_ns} ns");
            spell.force_n = spell.force_n.max(f64::from(sides[at].force_n[axis].abs()));
            spell.position_m = spell.position_m.max(f64::from(sides[at].position_m[axis].abs()));
            let apart_m = f64::from(sides[0].position_m[axis] - sides[1].position_m[axis]).abs();
            spell.apart_m = spell.apart_m.max(if axis == 0 { 0.0 } else { apart_m });
        }
    }
    println!("{duration_s} s: first spell {first:?}, most {most:?}, least energy in the line {smallest_j} J");
    for (side, line) in sides.iter().zip(&lines) {
        println!(
            "{}: {} ticks, sent {}, lost by the line {}; took {}, missed {}, replaced {}; its packets' counter went \
             round {} times, its energy's {} times",
            side.name(),
            side.ticks,
            line.sent,
            line.lost,
            side.taken,
            side.count("LINK_LOST"),
            side.count("LINK_REFUSED"),
            side.rounds,
            side.energy_rounds,
        );
        assert!(side.rounds >= duration_s / 70, "no counter went round");
    }
    assert!(sides.iter().any(|side| side.energy_rounds > 0), "no counter of energy went round");
}

/// Checks that every packet is accounted for, without other counts.
fn check_counters(sides: &[Side; 2], lines: &[Line; 2]) {
    for (at, side) in sides.iter().enumerate() {
        let line = &lines[1 - at];
        assert_eq!(side.refused_ticks(), 0);
        assert_eq!(side.reasons(), [], "no command is cut, and no device is held back");
        // Of two packets in one tick the older one is superseded; packets in flight are not counted.
        let delivered = line.sent - line.lost - line.in_flight();
        assert_eq!(u64::from(side.count("LINK_REFUSED")), delivered - side.taken);
        let missed = u64::from(side.count("LINK_LOST"));
        let not_taken = line.sent - side.taken;
        assert!((missed..=missed + 20).contains(&not_taken), "{missed} missed of {not_taken} not taken");
        assert!(line.in_flight() < 10);
    }
}

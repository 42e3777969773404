//! How long a tick of the plants takes: `cargo run --release -p hil-sim --example plant_speed`.

use hil_sim::plant::{
    Axis, AxisWise, DeviceParameters, HandParameters, HandPhase, MotorParameters, ParameterError, Plant,
    WallParameters,
};
use std::hint::black_box;
use std::time::Instant;

const TICKS: u32 = 1_000_000;

/// Three axes whose hand moves, pushes and lets go, over and over.
fn master(motor: Option<&MotorParameters>) -> Result<AxisWise, ParameterError> {
    let phases = (0..250_u32).flat_map(|cycle| {
        let start_s = f64::from(cycle) * 4.0;
        [
            HandPhase::Move { start_s, end_s: start_s + 1.0, from_m: 0.0, to_m: 0.05 },
            HandPhase::Push { start_s: start_s + 1.0, end_s: start_s + 3.0, force_n: 2.0 },
            HandPhase::Release { start_s: start_s + 3.0, end_s: start_s + 4.0 },
        ]
    });
    let hand = HandParameters { phases: phases.collect(), ..HandParameters::default() };
    let axis = |_| Axis::new(&DeviceParameters::default(), motor, vec![Box::new(hand.build()?)]);
    Ok(AxisWise::new((0..3).map(axis).collect::<Result<_, _>>()?))
}

/// Three axes before a wall.
fn slave(
    wall: &WallParameters,
    coulomb_friction_n: f64,
    motor: Option<&MotorParameters>,
) -> Result<AxisWise, ParameterError> {
    let device = DeviceParameters {
        mass_kg: 0.5,
        damping_ns_per_m: 8.0,
        coulomb_friction_n,
        ..DeviceParameters::default()
    };
    let axis = |_| Axis::new(&device, motor, vec![Box::new(wall.build()?)]);
    Ok(AxisWise::new((0..3).map(axis).collect::<Result<_, _>>()?))
}

/// Nanoseconds per tick of master and slave axes that a spring of 300 N/m couples, and the ticks in contact.
fn measure(mut master: AxisWise, mut slave: AxisWise) -> (f64, u32) {
    let (mut here, mut there, mut contacts) = ([0.0_f32; 3], [0.0_f32; 3], 0);
    let start = Instant::now();
    for tick in 0..TICKS {
        let start_s = f64::from(tick) * 1e-3;
        master.sense(&mut here);
        slave.sense(&mut there);
        let mut pull = [0.0_f32; 3];
        for (pull, (here, there)) in pull.iter_mut().zip(here.iter().zip(&there)) {
            *pull = 300.0 * (here - there);
        }
        master.advance(start_s, 1e-3, &pull.map(|pull| -pull));
        slave.advance(start_s, 1e-3, black_box(&pull));
        contacts += u32::from(slave.truth(0).is_some_and(|truth| truth.is_in_contact));
    }
    (start.elapsed().as_secs_f64() * 1e9 / f64::from(TICKS), contacts)
}

fn main() -> Result<(), ParameterError> {
    let motor = MotorParameters::default();
    let soft = WallParameters { position_m: 0.02, ..WallParameters::default() };
    let rigid = WallParameters { stiffness_n_per_m: f64::INFINITY, ..soft.clone() };
    let damped = WallParameters { damping_ns_per_m: 1e4, ..rigid.clone() };
    println!("3 + 3 axes, hand and wall, 20 sub-steps per tick");
    for (name, wall, coulomb_friction_n, motor) in [
        ("wall 1e4 N/m", &soft, 0.0, None),
        ("wall 1e4 N/m, Coulomb friction", &soft, 0.05, None),
        ("wall 1e4 N/m, motors", &soft, 0.0, Some(&motor)),
        ("rigid wall, 1e4 N s/m", &damped, 0.0, None),
        ("rigid wall, undamped: it rattles", &rigid, 0.0, None),
    ] {
        let (nanoseconds, contacts) = measure(master(motor)?, slave(wall, coulomb_friction_n, motor)?);
        println!(
            "{name:<32} {nanoseconds:7.0} ns per tick, {:4.1} % in contact",
            100.0 * f64::from(contacts) / f64::from(TICKS)
        );
    }
    Ok(())
}

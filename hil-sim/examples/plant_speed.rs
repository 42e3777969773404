//! How long a tick of the plants takes: `cargo run --release -p hil-sim --example plant_speed`.

use hil_sim::plant::{
    BrushedParameters, ExternalForce, GearParameters, JointMotorParameters, JointParameters, Joints,
    ParameterError, Plant, StopsParameters,
};
use hil_sim::rig_file::RIGID_STIFFNESS;
use std::hint::black_box;
use std::time::Instant;

const TICKS: u32 = 1_000_000;

/// A motor like that of a `PHANToM`, with its gear.
fn drive(joint: &mut JointParameters) {
    joint.motor = JointMotorParameters::Brushed(BrushedParameters::default());
    joint.gear = GearParameters { ratio: 52.09, ..GearParameters::default() };
}

/// Three axes whose hand pushes and lets go, over and over.
fn master(has_motor: bool) -> Result<Joints, ParameterError> {
    let mut joint = JointParameters::of_inertia(0.6);
    (joint.load.damping, joint.load.stiffness) = (8.01, 300.0);
    if has_motor {
        drive(&mut joint);
    }
    let push = |t: f64| if t % 4.0 < 2.0 { 15.0 * (t % 4.0).min(1.0) } else { 0.0 };
    let axis = |_| Ok((joint.build()?, Some(Box::new(push) as ExternalForce)));
    Ok(Joints::new((0..3).map(axis).collect::<Result<_, _>>()?))
}

/// Three axes before a wall.
fn slave(wall: &StopsParameters, coulomb_friction_n: f64, has_motor: bool) -> Result<Joints, ParameterError> {
    let mut joint = JointParameters::of_inertia(0.5);
    joint.load.damping = 8.0;
    joint.friction.coulomb = coulomb_friction_n;
    joint.stops = Some(wall.clone());
    if has_motor {
        drive(&mut joint);
    }
    let axis = |_| Ok((joint.build()?, None));
    Ok(Joints::new((0..3).map(axis).collect::<Result<_, _>>()?))
}

/// Nanoseconds per tick of master and slave axes that a spring of 300 N/m couples, and the ticks in contact.
fn measure(mut master: Joints, mut slave: Joints) -> (f64, u32) {
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
        contacts += u32::from(slave.is_touching(0));
    }
    (start.elapsed().as_secs_f64() * 1e9 / f64::from(TICKS), contacts)
}

fn main() -> Result<(), ParameterError> {
    let soft = StopsParameters { max: 0.02, stiffness: 1e4, ..StopsParameters::default() };
    let rigid = StopsParameters { stiffness: RIGID_STIFFNESS, ..soft.clone() };
    let damped = StopsParameters { damping: 1e4, ..rigid.clone() };
    println!("3 + 3 axes, hand and wall, 20 sub-steps per tick");
    for (name, wall, coulomb_friction_n, motor) in [
        ("wall 1e4 N/m", &soft, 0.0, false),
        ("wall 1e4 N/m, Coulomb friction", &soft, 0.05, false),
        ("wall 1e4 N/m, motors", &soft, 0.0, true),
        ("rigid wall, 1e4 N s/m", &damped, 0.0, false),
        ("rigid wall, undamped: it rattles", &rigid, 0.0, false),
    ] {
        let (nanoseconds, contacts) = measure(master(motor)?, slave(wall, coulomb_friction_n, motor)?);
        println!(
            "{name:<32} {nanoseconds:7.0} ns per tick, {:4.1} % in contact",
            100.0 * f64::from(contacts) / f64::from(TICKS)
        );
    }
    Ok(())
}

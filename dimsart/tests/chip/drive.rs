//! The current loop of b-g431b-esc1, as it is flashed, with a motor at its bridge.

use std::sync::LazyLock;

use dimsart_core::{Reason, types};

use crate::client::Client;
use crate::common::violations;
use crate::motor::Powered;

/// A board that has aligned its rotor and makes no torque; none without images. It is done once, for all tests.
fn aligned() -> Option<(Powered, Client)> {
    static ALIGNED: LazyLock<Option<(Powered, Client)>> = LazyLock::new(|| {
        let mut powered = Powered::new()?;
        powered.motor.set_rotor(0.3, 0.0);
        let mut client = ready(&mut powered);
        client.take_lease(&mut powered);
        for _ in 0..100 {
            client.run_for(&mut powered, 0.1);
            eprintln!(
                "{:.2} s {:?} {:?} {}",
                powered.time_s(),
                powered.motor.state(),
                client.reason(&mut powered),
                powered.is_on()
            );
        }
        Some((powered, client))
    });
    ALIGNED.clone()
}

/// Boots a board and gives it its scheme.
fn ready(powered: &mut Powered) -> Client {
    powered.run_for(0.3);
    Client::new(powered)
}

#[test]
fn explore() {
    let Some((mut powered, mut client)) = aligned() else { return };
    eprintln!("{:?}", violations(&powered.bench));
    eprintln!("{:?}", powered.chip().take_answer_cycles());
    eprintln!("{:?} {}", client.reason(&mut powered), client.signal(&mut powered, types::SUPPLY_VOLTAGE.id));
    let _ = Reason::Overcurrent;
}

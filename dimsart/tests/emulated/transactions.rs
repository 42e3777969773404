//! Random transactions on a running scheme, on the board and here: same answers, bit-identical ticks.

use dimsart_core::{Command, CommandError, ModuleRef, TickResult, Value};
use dimsart_link::protocol::{
    MAX_FRAME_BYTES, Receiver, Request, Response, decode_response, encode_request, request_id,
};
use dimsart_modules::ALL;
use hil_sim::experiment::Experiment;
use hil_sim::rig_file::RigFile;
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg32;

use crate::common::image;
use crate::same_bits::signals;
use test_requirements::length;

/// The client that holds the board's lease: the host that simulates the device.
const CLIENT: u8 = 1;
const CONTROLLERS: [&str; 3] = ["PDCTRL_MOD", "PIDCTRL_MOD", "PCTRL_MOD"];

fn below(random: &mut Pcg32, bound: u32) -> u32 {
    random.next_u32() % bound
}

fn module(name: &str) -> ModuleRef {
    ALL.module(name).unwrap()
}

/// A transaction of random commands, partly invalid, without new signals, and its end.
fn any_transaction(random: &mut Pcg32) -> Vec<Command> {
    let controllers = CONTROLLERS.map(module);
    let mut commands = vec![Command::Begin];
    for _ in 0..below(random, 3) {
        let any = controllers[below(random, 3) as usize];
        commands.push(match below(random, 6) {
            0 => Command::Unplug(any),
            1 => Command::PlugIn(any),
            2 => Command::CloseModule(any),
            3 => Command::set(any, 0, Value::Real(f32::NAN)),
            4 => Command::ResetModule(any),
            _ => Command::Check,
        });
    }
    let next = controllers[below(random, 3) as usize];
    commands.extend(controllers.map(Command::Unplug));
    for parameter in 0..2 {
        let gain = [500.0, 0.5][usize::from(parameter)] * (1 + below(random, 4)) as f32;
        commands.push(Command::set(next, parameter, Value::Real(gain)));
    }
    commands.extend([Command::PlaceBefore(module("TIMEDELAY_MOD")), Command::PlugIn(next)]);
    if below(random, 8) == 0 {
        // A missing link end, or a second controller.
        commands.push(match below(random, 2) {
            0 => Command::Unplug(module("WTRANSF_MOD")),
            _ => Command::PlugIn(controllers[below(random, 3) as usize]),
        });
    }
    // No transaction is open after the commit, refused or not.
    commands.extend([Command::Commit, Command::Abort]);
    commands
}

#[test]
fn random_transactions_come_to_the_same_bits_and_answers_on_the_board() {
    let Some(image) = image() else { return };
    let scenario = RigFile::from_shipped("bilateral", &[]).unwrap();
    let [mut here, mut there] = [(); 2].map(|()| Experiment::new(&scenario).unwrap());
    there.emulate("master", &image, None).unwrap();
    let (here, there) = (here.rig_mut(), there.rig_mut());
    // The lease is requested in the first tick.
    for rig in [&mut *here, &mut *there] {
        rig.step();
    }
    let mut random = Pcg32::seed_from_u64(12);
    let (mut receiver, mut number) = (Receiver::new(), 0_u8);
    let (mut taken, mut refused, mut commits) = (0, 0, 0);
    let transactions = length(500, 10_000);
    for transaction in 0..transactions {
        for command in any_transaction(&mut random) {
            let expected = here.stations_mut()[0].dimsart.command(command).err();
            // The copy of the board's Data Base has the same modules.
            assert_eq!(there.stations_mut()[0].dimsart.command(command).err(), expected);
            number = number.wrapping_add(1);
            let id = request_id(CLIENT, number);
            let mut buffer = [0; MAX_FRAME_BYTES];
            let frame = encode_request(&Request::Command(command), id, &mut buffer).unwrap();
            there.stations_mut()[0].board_mut().unwrap().send_command_bytes(frame);
            let mut answer = None;
            // A tick handles one request, a second one waits: no request is sent in the tick after the answer.
            let mut has_session = false;
            for _ in 0..8 {
                [&mut *here, &mut *there].into_iter().for_each(|rig| rig.tick());
                assert!(
                    there.take_board_error().is_none(),
                    "{transaction} {command:?}: {:?}",
                    there.take_board_error()
                );
                let [expected, found] = [&*here, &*there].map(|rig| signals(&rig.stations()[0]));
                assert_eq!(found, expected, "{transaction} {command:?}");
                assert_eq!(there.stations()[0].last_tick, TickResult::Ran, "{transaction} {command:?}");
                here.advance();
                there.advance();
                for bytes in there.stations_mut()[0].board_mut().unwrap().command_bytes() {
                    receiver.push_all(bytes, |content| match decode_response(content) {
                        Ok((found, Response::Effect(effect))) if found == id => answer = Some(effect),
                        _ => {}
                    });
                }
                if has_session {
                    break;
                }
                has_session = answer.is_some();
            }
            let found = answer.unwrap_or_else(|| panic!("{transaction} {command:?}: no answer")).refused;
            assert_eq!(format!("{found:?}"), format!("{expected:?}"), "{transaction} {command:?}");
            *if found.is_some() { &mut refused } else { &mut taken } += 1;
            commits += u32::from(command == Command::Commit && found.is_none());
            let is_wrong = matches!(found, Some(CommandError::NoTransaction)) && command == Command::Commit;
            assert!(!is_wrong, "{transaction}");
        }
    }
    println!("{commits} commits, {taken} commands taken, {refused} refused");
    assert!(2 * commits > transactions && 4 * refused > 3 * transactions, "{commits} {taken} {refused}");
}

//! Joints with moteus drives on FDCAN 1.

use dimsart_core::{
    DataType, DriveFault, InputLimits, MAX_DEVICE_TYPES, OutputLimits, Scalar as _, TickResult, Word, types,
};
use drive::{MoteusAddress, MoteusFrame, MoteusJoint, MoteusReading};
use embassy_stm32::can::{CanConfigurator, IT0InterruptHandler, IT1InterruptHandler};
use embassy_stm32::peripherals::{FDCAN1, PA11, PA12};
use embassy_stm32::{Peri, bind_interrupts};

use super::AXES;
use crate::board::needs_power_stage;
use crate::catalogue::nucleo_g474re::MOTEUS;
use crate::stm32g4;
use crate::stm32g4::moteus_bus::{MoteusBus, send_at_last};

bind_interrupts!(struct Interrupts {
    FDCAN1_IT0 => IT0InterruptHandler<FDCAN1>;
    FDCAN1_IT1 => IT1InterruptHandler<FDCAN1>;
});

/// Measurements of each drive, in the order of [`words`].
const SAID: [&DataType; 6] = [
    types::POSITION,
    types::VELOCITY,
    types::MEASURED_TORQUE,
    types::BUS_VOLTAGE,
    types::TEMPERATURE,
    types::DRIVE_FAULT,
];

/// Without the timing of the board's ticks, for lack of words.
pub(super) const OUTPUTS: &[&DataType] = &{
    let [position, velocity, torque, voltage, temperature, fault] = SAID;
    [position, velocity, torque, voltage, temperature, fault, types::CAN_REJOINS]
};
const _: () = assert!(OUTPUTS.len() <= MAX_DEVICE_TYPES);
pub(super) const LIMITS: &[&[InputLimits]] = &[&[MOTEUS.limits()]];
pub(super) const OUTPUT_LIMITS: &[OutputLimits] = &[MOTEUS.position_limits()];

const ADDRESSES: [MoteusAddress; AXES] = {
    let [first, second, third] = MOTEUS.ids;
    [address(first), address(second), address(third)]
};

#[expect(clippy::panic, reason = "evaluated at compile time")]
const fn address(id: u8) -> MoteusAddress {
    match MoteusAddress::new(MOTEUS.host, id) {
        Some(address) => address,
        None => panic!("invalid drive id"),
    }
}

/// Moteus drives.
pub struct Joints {
    bus: MoteusBus,
    joints: [MoteusJoint; AXES],
    /// Last measurements of each drive; frozen if the drive is gone.
    shown: [[Word; SAID.len()]; AXES],
    gone: Option<DriveFault>,
}

pub(super) fn start(
    can: Peri<'static, FDCAN1>,
    receive: Peri<'static, PA11>,
    send: Peri<'static, PA12>,
) -> Joints {
    let can = CanConfigurator::new(can, receive, send, Interrupts);
    Joints {
        bus: MoteusBus::start(can, ADDRESSES.into_iter().map(MoteusAddress::reply_id)),
        joints: ADDRESSES.map(|address| MoteusJoint::new(address, MOTEUS.timeout_s, MOTEUS.missing_ticks)),
        shown: [[f32::NAN.into_word(); SAID.len()]; AXES],
        gone: None,
    }
}

/// Stops each drive. If the bus accepts no frame, the drives' timeout does.
pub(super) fn disarm() {
    let stop = MoteusFrame::stop();
    send_at_last(ADDRESSES.iter().map(|address| (address.command_id(), stop.bytes())));
}

impl crate::board::Joints for Joints {
    fn read(&mut self, measured: &mut [Word]) {
        let Self { bus, joints, shown, gone } = self;
        bus.receive(|identifier, data| {
            for joint in joints.iter_mut() {
                // An invalid reply counts as missing.
                let _ = joint.receive(identifier, data);
            }
        });
        *gone = None;
        for ((axis, joint), shown) in (0..).zip(joints.iter_mut()).zip(shown) {
            let reading = joint.read();
            if reading.position_rad.is_nan() {
                gone.get_or_insert(DriveFault::NoResponse { axis });
            } else {
                *shown = words(&reading);
            }
            let (place, said) = (usize::from(axis), measured.chunks_exact_mut(AXES).zip(*shown));
            for (of_type, word) in said {
                of_type.iter_mut().skip(place).take(1).for_each(|measured| *measured = word);
            }
        }
        stm32g4::measure(measured.get_mut(SAID.len() * AXES..));
    }

    fn fault(&self) -> Option<DriveFault> {
        self.gone
    }

    fn write(&mut self, tick: TickResult, commanded: &[Word]) {
        let is_on = needs_power_stage(tick, commanded);
        let torques = commanded.iter().map(|word| is_on.then_some(f32::from_word(*word)));
        let mut frames = [const { (0, None) }; AXES];
        for ((joint, torque_nm), frame) in self.joints.iter_mut().zip(torques).zip(&mut frames) {
            *frame = (joint.address().command_id(), Some(joint.frame(torque_nm)));
        }
        let frames = frames.iter().filter_map(|(id, frame)| Some((*id, frame.as_ref()?.bytes())));
        self.bus.send(frames);
    }
}

fn words(reading: &MoteusReading) -> [Word; SAID.len()] {
    let MoteusReading { position_rad, velocity_rad_per_s, torque_nm, voltage_v, temperature_c, .. } =
        *reading;
    let fault = reading.fault();
    [position_rad, velocity_rad_per_s, torque_nm, voltage_v, temperature_c, fault].map(f32::into_word)
}

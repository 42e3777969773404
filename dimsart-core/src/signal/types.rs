//! Catalogue of standard data types. A new type is one line here.

use crate::signal::data_type::{DataType, Shape};
use crate::signal::summary::Summary;
use crate::signal::unit::Unit;
use crate::signal::word::Format;

macro_rules! catalogue {
    ($($id:literal $name:ident $unit:ident $format:ident $shape:ident $summary:literal;)*) => {
        /// Index of each type in the catalogue.
        #[expect(non_camel_case_types, clippy::upper_case_acronyms, reason = "named as the types are")]
        enum Place { $($name),* }

        $(#[doc = $summary]
        #[expect(clippy::indexing_slicing, reason = "a constant: out of bounds is a build error")]
        pub const $name: &DataType = &ALL[Place::$name as usize];)*

        /// All standard types, in order of id.
        pub static ALL: [DataType; [$($id),*].len()] = [$(DataType {
            id: $id, name: stringify!($name), unit: Unit::$unit,
            format: Format::$format, shape: Shape::$shape, summary: Summary::new($summary),
        }),*];
    };
}

catalogue! {
     1 POSITION           Position  F32 Vector "Measured position.";
     2 VELOCITY           Velocity  F32 Vector "Measured or observed velocity.";
     3 FORCE              Force     F32 Vector "Measured force between device and environment.";
     4 MOTOR_CURRENT      Ampere    F32 Vector "Measured motor current; on a three-phase motor the torque-producing current.";
     5 MOTOR_VOLTAGE      Volt      F32 Vector "Measured motor voltage.";
     6 WINDING_TEMPERATURE Celsius  F32 Vector "Measured winding temperature.";
     7 ACCELERATION       Acceleration F32 Vector "Measured or observed acceleration.";
     8 DES_POSITION       Position  F32 Vector "Desired position.";
     9 DES_VELOCITY       Velocity  F32 Vector "Desired velocity.";
    10 DES_FORCE          Force     F32 Vector "Force command to the device.";
    11 MEASURED_TORQUE    Force     F32 Vector "Output torque, computed from the measured motor currents.";
    12 BUS_VOLTAGE        Volt      F32 Vector "Measured supply voltage of a drive.";
    13 TEMPERATURE        Celsius   F32 Vector "Measured board temperature of a drive.";
    14 DRIVE_FAULT        One       F32 Vector "Reason number of a drive's fault or limit; 0 for none.";
    15 DES_ACCELERATION   Acceleration F32 Vector "Desired acceleration.";
    16 CH1_WAVES          Wave      F32 Vector "Outgoing wave of channel 1.";
    17 CH2_WAVES          Wave      F32 Vector "Incoming wave of channel 2.";
    18 CH1_TD_WAVES       Wave      F32 Vector "Wave of channel 1 after the time delay.";
    19 CH2_TD_WAVES       Wave      F32 Vector "Wave of channel 2 after the time delay.";
    20 FEED_FORCE         Force     F32 Vector "Force added to a controller's command.";
    21 EXTERNAL_FORCE     Force     F32 Vector "Estimated force of the environment on the device.";
    22 PORT_ENERGY        Energy    F32 Vector "Energy that has entered a port.";
    23 CONDITION          One       F32 Vector "1 while a condition is true, else 0.";
    24 LINE_FORCE         Force     F32 Vector "Force at the wave port, positive from master to slave.";
    25 LINE_VELOCITY      Velocity  F32 Vector "Velocity at the wave port.";
    26 CONTROL_STIFFNESS  Stiffness F32 Vector "Slope of the control law: change of force per desired position.";
    27 CONTROL_MEMORY     Force     F32 Vector "Force that the control law's state subtracts in the next tick.";
    32 LINK_AGE           Tick      U32 Scalar "Ticks since the last new packet.";
    33 LINK_LOST          One       U32 Scalar "Packets missing in the sequence: lost, or superseded by a newer one in the same tick.";
    34 LINK_ROUND_TRIP    Tick      U32 Scalar "Ticks from sending a packet to receiving its echo; 0 until known.";
    35 LINK_REFUSED       One       U32 Scalar "Discarded packets: superseded, old, duplicate, damaged, not finite or of wrong content.";
    36 LINK_STATE         One       U32 Scalar "Packet status: 0 no new packet, 1 ok, 2 some lost, 3 repeated, 4 wrong sequence, 5 error, 6 timeout.";
    37 LINK_JITTER        Tick      F32 Scalar "Jitter of the packets, smoothed (RFC 3550).";
    40 SIGNAL             Any       F32 Vector "A signal of any unit.";
    41 SIGNAL_OUT         Any       F32 Vector "Output computed from a signal of any unit.";
    42 RECORDED_ROWS      One       U32 Scalar "Rows recorded since the recorder's reset.";
    48 TICK_CYCLES        One       U32 Scalar "Processor cycles of the last tick.";
    49 TICK_CYCLES_MEAN   One       U32 Scalar "Mean processor cycles per tick.";
    50 TICK_CYCLES_MAX    One       U32 Scalar "Processor cycles of the longest tick.";
    51 LATE_TICKS         Tick      U32 Scalar "Ticks that began late.";
    52 OVERRUN_TICKS      Tick      U32 Scalar "Ticks that ran past the start of the next tick.";
    53 CAN_REJOINS        One       U32 Scalar "Number of times the board rejoined the CAN bus.";
    54 SUPPLY_VOLTAGE     Volt      F32 Scalar "Measured supply voltage of the motor bridge.";
    55 BRIDGE_TEMPERATURE Celsius   F32 Scalar "Measured temperature of the motor bridge.";
    56 TICK_PERIOD        One       U32 Scalar "Processor cycles between the last two ticks.";
    80 STATE              One       F32 Vector "Current state of a sequence.";
    90 TIP_POSITION       Metre     F32 Vector "Tip position: x, y, z on the first three axes.";
    91 TIP_VELOCITY       MetrePerSecond F32 Vector "Tip velocity along x, y, z.";
    92 TIP_FORCE          Newton    F32 Vector "Force of the environment on the tip along x, y, z.";
    93 DES_TIP_POSITION   Metre     F32 Vector "Desired tip position.";
    94 DES_TIP_FORCE      Newton    F32 Vector "Desired tip force along x, y, z.";
   120 FAR_POSITION       Position  F32 Vector "Position of a link's peer.";
   121 FAR_FORCE          Force     F32 Vector "Force of a link's peer.";
   122 LINE_ENERGY        One       U32 Vector "Energy that has entered a link at this end, in counts of 2^-24 J; the counter wraps.";
   123 FAR_ENERGY         One       U32 Vector "Energy that has entered a link at the peer's end, in counts of 2^-24 J; the counter wraps.";
}

/// Timing of a device's own ticks. A device's outputs end with all of them, with the last ones, or with none.
pub const TIMING: [&DataType; 6] =
    [TICK_CYCLES, TICK_CYCLES_MEAN, TICK_CYCLES_MAX, LATE_TICKS, OVERRUN_TICKS, TICK_PERIOD];

/// Finds a standard type by number.
#[must_use]
pub fn find_by_id(id: u16) -> Option<&'static DataType> {
    ALL.iter().find(|data_type| data_type.id == id)
}

/// Finds a standard type by name.
#[must_use]
pub fn find_by_name(name: &str) -> Option<&'static DataType> {
    ALL.iter().find(|data_type| data_type.name == name)
}

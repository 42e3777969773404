//! Reasons why a device does not get the scheme's command: number, name, meaning and remedy.

macro_rules! reasons {
    ($($number:literal $reason:ident $name:literal $meaning:literal $remedy:literal;)*) => {
        /// Reason why a device does not get the scheme's command.
        ///
        /// The numbers are used in logs and on the wire, have gaps for new reasons, and are never reused. 0
        /// to 31 are no faults, 32 to 95 are faults, 96 and above are limits.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[non_exhaustive]
        #[repr(u8)]
        pub enum SafetyReason {
            /// The device gets the scheme's command.
            #[default]
            None = 0,
            $(#[doc = $meaning] $reason = $number,)*
        }

        impl SafetyReason {
            /// All reasons but [`None`](Self::None), in order of number.
            pub const ALL: &[Self] = &[$(Self::$reason),*];

            /// Returns the name, for reports.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    Self::None => "none",
                    $(Self::$reason => $name,)*
                }
            }

            /// Returns the meaning.
            #[must_use]
            pub const fn meaning(self) -> &'static str {
                match self {
                    Self::None => "The device gets what the scheme commands.",
                    $(Self::$reason => $meaning,)*
                }
            }

            /// Returns the remedy; empty if there is nothing to do.
            #[must_use]
            pub const fn remedy(self) -> &'static str {
                match self {
                    Self::None => "",
                    $(Self::$reason => $remedy,)*
                }
            }
        }
    };
}

reasons! {
    8 Stopped "stopped"
        "The scheme does not run: it is empty, does not match, or was stopped."
        "`faults` lists what does not match; `check` starts the scheme.";
    16 Disarmed "disarmed"
        "The scheme runs, but no client holds the lease."
        "Run `arm`.";
    32 MeasurementRefused "measurement refused"
        "A measured value is NaN, infinite or outside its sensor's range, or it changed faster than its sensor allows, \
         or the frame has a wrong length. The scheme did not run in this tick."
        "`faults` names the signal and the word: check that sensor and its cable, then `reset`.";
    36 CommandRefused "command refused"
        "The caller's frame for the device has a wrong length."
        "Correct the program that calls the tick, then `reset`.";
    40 ModuleFailed "module failed"
        "A module wrote a value out of its signal's range, or ran too long, and an input of the device depends on it."
        "`faults` names module, signal, word and value: lower its gains, check its inputs, or replace the module; \
         then `reset`.";
    44 CommandsLate "commands late"
        "Another engine that commands this one has sent nothing new for too long (`dimsart-core/src/coupling.rs`)."
        "Find out why that engine stopped, then `reset`.";
    46 LinkDown "link down"
        "No packet has arrived on a link since the scheme started or was reset, for more than `TIMEOUT_TICKS`."
        "Start the peer; check the line, the channel and the bit rate. Motion starts with the first packet. To run without a \
         peer, set `TIMEOUT_TICKS` of COMM_RXMOD to 0.";
    48 LinkLost "link lost"
        "No packet has arrived on a link for `TIMEOUT_TICKS`, after earlier ones."
        "Check the peer and the line, then `reset` and `arm`.";
    56 Overcurrent "overcurrent"
        "A phase current exceeded the trip current. The bridge is off."
        "Check for a short circuit, and identify the motor again: its inductance may be wrong. Then `reset`.";
    57 CurrentSensors "current sensors"
        "The phase currents do not sum to zero, or current flows while the bridge is off. The bridge is off."
        "Unplug the motor and check the phase wires and the current amplifiers; then `reset`.";
    58 Undervoltage "undervoltage"
        "The supply voltage is below its minimum. The bridge is off."
        "Check supply, fuse and wires at the board's terminals, under load; then `reset`.";
    59 Overvoltage "overvoltage"
        "The supply voltage is above its maximum. The bridge is off."
        "Add a brake resistor, or brake less; then `reset`.";
    60 Overtemperature "overtemperature"
        "The bridge is too hot, or its temperature sensor is disconnected. The bridge is off."
        "Let the bridge cool, lower the commands, or check the sensor's wires; then `reset`.";
    61 EncoderLost "encoder lost"
        "The rotor's encoder does not answer, or reports standstill while the rotor turns. The bridge is off."
        "Check the encoder's wires and supply, then `reset`.";
    62 EncoderJumped "encoder jumped"
        "The encoder reports angles that the rotor cannot have reached. The bridge is off."
        "Check its wires for interference from the motor, its magnet or wheel for a loose fit, and its counts per \
         turn; then `reset`.";
    63 EncoderMagnet "encoder magnet"
        "The encoder's magnet is missing or too far away or too close. The bridge is off."
        "Correct the magnet gap as specified in the encoder's data sheet, then `reset`.";
    64 Stalled "stalled"
        "The rotor did not move under current for too long. The bridge is off."
        "Free the joint, lower the command at standstill, or raise `limits.stall_s`; then `reset`.";
    65 Overspeed "overspeed"
        "The rotor exceeds its speed limit, or the speed that the supply voltage can control. The bridge is off."
        "Lower the commands, check what drives the joint, or raise `limits.speed_rad_per_s` or the supply; then \
         `reset`.";
    66 NotAligned "rotor not aligned"
        "During alignment the rotor did not turn as expected for these pole pairs and this encoder. The bridge is \
         off."
        "Free the joint, check the wires of motor and encoder and the motor's pole pairs; then `reset` and `arm`.";
    67 DriveSilent "drive silent"
        "The current loop does not run, or misses its period. The bridge is off."
        "Restart the board, and report the fault.";
    68 DriveGone "drive gone"
        "A drive on the bus does not answer, or does not follow its commands."
        "Check the drive's supply and the bus. `DRIVE_FAULT` of the axis contains the drive's last reported fault. Then \
         `reset`.";
    69 EncoderSlipped "encoder slipped"
        "The encoder's angle does not match the rotor's magnets: counts are lost, or a wheel or magnet slips. The \
         bridge is off."
        "Check the encoder's coupling, wires, counts per turn and offset; then `reset`.";
    70 CurrentLoop "current loop"
        "The controlled currents oscillate: the motor's inductance is much lower than configured. The bridge is off."
        "Identify the motor again, or lower `bandwidth_rad_per_s`; then `reset`.";
    96 RangeLimited "range limited"
        "The scheme runs; a command was out of its input's range and was limited."
        "Lower the gains, or declare the actuator's actual range.";
    100 RateLimited "rate limited"
        "An input changes at its rate limit: it follows the scheme, or moves to or from its safe value."
        "None if it lasts for a few ticks. Otherwise as for 96.";
}

/// Prints name, number, meaning and remedy on one line.
impl core::fmt::Display for SafetyReason {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let [name, meaning, remedy] = [self.name(), self.meaning(), self.remedy()];
        write!(f, "{name} (reason {}): {meaning} {remedy}", self.number())
    }
}

impl SafetyReason {
    /// Returns the number.
    #[must_use]
    pub const fn number(self) -> u8 {
        self as u8
    }

    /// Finds a reason by number.
    #[must_use]
    pub fn from_number(number: u8) -> Option<Self> {
        let mut all = core::iter::once(&Self::None).chain(Self::ALL);
        all.find(|reason| reason.number() == number).copied()
    }

    /// Returns whether it is a fault: the device gets its safe value.
    #[must_use]
    pub const fn is_fault(self) -> bool {
        32 <= self.number() && self.number() < 96
    }

    /// Returns whether the scheme commands the device within a limit that has reduced its command.
    #[must_use]
    pub const fn is_limit(self) -> bool {
        96 <= self.number()
    }
}

/// Index of each reason in [`SafetyReason::ALL`], by number; `u8::MAX` for an unused number.
#[expect(clippy::indexing_slicing, clippy::cast_possible_truncation, reason = "evaluated at compile time")]
const PLACES: [u8; 128] = {
    let mut places = [u8::MAX; 128];
    let mut place = 0;
    while place < SafetyReason::ALL.len() {
        places[SafetyReason::ALL[place].number() as usize] = place as u8;
        place += 1;
    }
    places
};

/// Number of ticks by reason since the device was connected. A tick counts for each of its reasons.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReasonCounts([u32; SafetyReason::ALL.len()]);

impl ReasonCounts {
    pub(crate) const fn new() -> Self {
        Self([0; SafetyReason::ALL.len()])
    }

    /// Takes the same time for each reason.
    pub(crate) fn count(&mut self, reason: SafetyReason) {
        let place = PLACES.get(usize::from(reason.number())).copied().map_or(usize::MAX, usize::from);
        if let Some(ticks) = self.0.get_mut(place) {
            *ticks = ticks.saturating_add(1);
        }
    }

    /// Returns every reason with its ticks, in order of number.
    pub fn iter(&self) -> impl Iterator<Item = (SafetyReason, u32)> + '_ {
        SafetyReason::ALL.iter().copied().zip(self.0)
    }

    /// Returns the ticks of a reason; [`SafetyReason::None`] is not counted.
    #[must_use]
    pub fn tick_count(&self, reason: SafetyReason) -> u32 {
        self.iter().find(|(found, _)| *found == reason).map_or(0, |(_, ticks)| ticks)
    }
}

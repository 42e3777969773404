//! Why a device does not get what the scheme commands: every reason has a number, a name, a meaning and a next step.

macro_rules! reasons {
    ($($number:literal $reason:ident $name:literal $meaning:literal $next_step:literal;)*) => {
        /// Why a device does not get what the scheme commands.
        ///
        /// The numbers stand in logs and on the wire: they have gaps for further ones and are never reused. Up to 31
        /// nothing is wrong, 32 to 95 are faults, from 96 on the scheme's command was limited.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[non_exhaustive]
        #[repr(u8)]
        pub enum Reason {
            /// None: it gets what the scheme commands.
            #[default]
            None = 0,
            $(#[doc = $meaning] $reason = $number,)*
        }

        impl Reason {
            /// Every reason but [`None`](Self::None), by rising number.
            pub const ALL: &[Self] = &[$(Self::$reason),*];

            /// Its name, for reports.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self {
                    Self::None => "none",
                    $(Self::$reason => $name,)*
                }
            }

            /// What it means, in sentences.
            #[must_use]
            pub const fn meaning(self) -> &'static str {
                match self {
                    Self::None => "The device gets what the scheme commands.",
                    $(Self::$reason => $meaning,)*
                }
            }

            /// What to do next, in sentences; empty where nothing is to be done.
            #[must_use]
            pub const fn next_step(self) -> &'static str {
                match self {
                    Self::None => "",
                    $(Self::$reason => $next_step,)*
                }
            }
        }
    };
}

reasons! {
    8 Stopped "stopped"
        "The scheme does not run: nothing is plugged in, it does not match, or it was stopped."
        "`faults` says what does not match; `check` starts it.";
    16 Disarmed "disarmed"
        "The scheme runs, and nobody holds the lease that motion needs."
        "`arm` takes and holds it.";
    32 MeasurementRefused "measurement refused"
        "A measured number is not finite, is beyond what its sensor can show, or changed faster than that; \
         or the frame has another length. Nothing was computed."
        "`faults` names signal and word: see to that sensor and its cable, then `reset`.";
    36 CommandRefused "command refused"
        "The caller's frame for the device has another length."
        "Mend the program that calls the tick, then `reset`.";
    40 ModuleFailed "module failed"
        "A module wrote what its signal cannot be, or took too long, and an input of the device depends on \
         it."
        "`faults` names module, signal, word and value: lower its gains, see to what it reads, or put \
         another one in its place; then `reset`.";
    44 CommandsLate "commands late"
        "Nothing new has come for too long from another engine that commands this one \
         (`dimsart-core/src/coupling.rs`)."
        "See why that one stands still, then `reset`.";
    48 LinkLost "link lost"
        "Nothing has come over a link for `TIMEOUT_TICKS`."
        "See to the other side and the line, then `reset`.";
    96 RangeLimited "range limited"
        "The scheme runs; a command was outside its input's range and was cut."
        "Lower the gains, or declare the range that the actuator really has.";
    100 RateLimited "rate limited"
        "An input changes as fast as it may: it follows the scheme, or is on its way to or from its safe \
         value."
        "Nothing, if it lasts for a few ticks. Otherwise as 96.";
}

impl Reason {
    /// Its number.
    #[must_use]
    pub const fn number(self) -> u8 {
        self as u8
    }

    /// The reason with this number.
    #[must_use]
    pub fn by_number(number: u8) -> Option<Self> {
        let mut all = core::iter::once(&Self::None).chain(Self::ALL);
        all.find(|reason| reason.number() == number).copied()
    }

    /// Whether something is wrong: the device gets its safe value.
    #[must_use]
    pub const fn is_fault(self) -> bool {
        32 <= self.number() && self.number() < 96
    }

    /// Whether the scheme commands the device, and a limit of the input cut the command.
    #[must_use]
    pub const fn is_limit(self) -> bool {
        96 <= self.number()
    }
}

/// Ticks by reason, since the device was connected. A tick counts for each reason that it had.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReasonCounts([u32; Reason::ALL.len()]);

impl ReasonCounts {
    pub(crate) const fn new() -> Self {
        Self([0; Reason::ALL.len()])
    }

    pub(crate) fn count(&mut self, reason: Reason) {
        if let Some((_, ticks)) = Reason::ALL.iter().zip(&mut self.0).find(|(found, _)| **found == reason) {
            *ticks = ticks.saturating_add(1);
        }
    }

    /// Every reason with its ticks, by rising number.
    pub fn iter(&self) -> impl Iterator<Item = (Reason, u32)> + '_ {
        Reason::ALL.iter().copied().zip(self.0)
    }

    /// Ticks of a reason; those of [`Reason::None`] are not counted.
    #[must_use]
    pub fn of(&self, reason: Reason) -> u32 {
        self.iter().find(|(found, _)| *found == reason).map_or(0, |(_, ticks)| ticks)
    }
}

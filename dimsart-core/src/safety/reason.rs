//! Why a device does not get what the scheme commands: every reason has a number and a name.

macro_rules! reasons {
    ($($number:literal $reason:ident $name:literal $meaning:literal;)*) => {
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
        }
    };
}

reasons! {
     8 Stopped            "stopped"             "The scheme does not run.";
    16 Disarmed           "disarmed"            "Motion is not allowed: nobody holds the lease.";
    32 MeasurementRefused "measurement refused" "The measured frame was refused, and nothing was computed.";
    36 CommandRefused     "command refused"     "The frame for the device has another length.";
    40 ModuleFailed       "module failed"       "A module wrote what its signal cannot be; the device depends on it.";
    44 CommandsLate       "commands late"       "What the scheme is commanded by from outside is too old.";
    48 LinkLost           "link lost"           "Nothing has come over a link for too long.";
    96 RangeLimited       "range limited"       "The scheme's command is outside the range of the input.";
   100 RateLimited        "rate limited"        "The input changes as fast as it may.";
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

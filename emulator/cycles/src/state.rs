//! The programmer's model of the processor: registers and memory, generic over the domain of values.

use crate::domain::Domain;
use crate::instruction::{FloatRegister, Register, Width};

/// Registers of the core and of the floating-point unit.
#[derive(Debug)]
pub struct Registers<D: Domain> {
    /// R0 to R14; the entry of R15 is unused, because each instruction has its own address.
    pub core: [D::Word; 16],
    /// S0 to S31.
    pub float: [D::Word; 32],
    /// N, Z, C, V.
    pub flags: D::Flags,
    /// N, Z, C, V of FPSCR, from the last float comparison. The other bits keep their reset value 0 (round to
    /// nearest, no flush to zero), except for the sticky exception bits, which are not modelled.
    pub float_flags: D::Flags,
    /// PRIMASK, bit 0.
    pub primask: D::Word,
    /// FAULTMASK, bit 0.
    pub faultmask: D::Word,
    /// BASEPRI.
    pub basepri: D::Word,
    /// Q of APSR in bit 27 and GE in bits 19 to 16; all other bits are zero.
    pub dsp_flags: D::Word,
    /// Whether an exclusive load is pending.
    pub exclusive: D::Bit,
}

// Manual implementation, because a derived one would require the trait of the domain too.
impl<D: Domain> Clone for Registers<D> {
    fn clone(&self) -> Self {
        Self { ..*self }
    }
}

impl<D: Domain> PartialEq for Registers<D> {
    fn eq(&self, other: &Self) -> bool {
        let words = |of: &Self| [of.primask, of.faultmask, of.basepri, of.dsp_flags];
        self.core == other.core
            && self.float == other.float
            && (self.flags, self.float_flags) == (other.flags, other.float_flags)
            && words(self) == words(other)
            && self.exclusive == other.exclusive
    }
}

impl<D: Domain> Registers<D> {
    /// All registers zero.
    pub fn new(domain: &mut D) -> Self {
        let zero = domain.constant(0);
        let flags = domain.flags_from(zero);
        Self {
            core: [zero; 16],
            float: [zero; 32],
            flags,
            float_flags: flags,

            primask: zero,
            faultmask: zero,
            basepri: zero,
            dsp_flags: zero,
            exclusive: domain.bit(false),
        }
    }

    /// Reads a core register except R15.
    #[expect(clippy::indexing_slicing, reason = "four bits")]
    pub fn read(&self, register: Register) -> D::Word {
        self.core[usize::from(register & 15)]
    }

    /// Sets a core register to any word. The caller must keep SP divisible by 4.
    #[expect(clippy::indexing_slicing, reason = "four bits")]
    pub fn write(&mut self, register: Register, value: D::Word) {
        self.core[usize::from(register & 15)] = value;
    }

    /// Reads a float register.
    #[expect(clippy::indexing_slicing, reason = "five bits")]
    pub fn read_float(&self, register: FloatRegister) -> D::Word {
        self.float[usize::from(register & 31)]
    }

    /// Sets a float register.
    #[expect(clippy::indexing_slicing, reason = "five bits")]
    pub fn write_float(&mut self, register: FloatRegister, value: D::Word) {
        self.float[usize::from(register & 31)] = value;
    }
}

/// Reason that a memory access failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum AccessError {
    /// No memory is mapped there.
    #[error("no memory at {address:#010x}")]
    Unmapped {
        /// Address of the first byte.
        address: u32,
    },
    /// The memory is read-only.
    #[error("write to read-only memory at {address:#010x}")]
    ReadOnly {
        /// Address of the first byte.
        address: u32,
    },
    /// The memory protection unit denies access.
    #[error("access to protected memory at {address:#010x}")]
    Protected {
        /// Address of the first byte.
        address: u32,
    },
    /// The access requires an address divisible by its width.
    #[error("unaligned access at {address:#010x}")]
    Unaligned {
        /// Address of the first byte.
        address: u32,
    },
    /// The address is not known precisely enough.
    #[error(
        "unknown address between {lowest:#010x} and {highest:#010x}: range too wide or not fully accessible"
    )]
    Unknown {
        /// Minimum address.
        lowest: u32,
        /// Maximum address.
        highest: u32,
    },
}

/// Memory. Little-endian; unaligned words and halfwords are allowed, as on the processor.
pub(crate) trait Memory<D: Domain> {
    /// Reads; the upper bits are zero.
    ///
    /// # Errors
    /// [`AccessError`].
    fn load(&mut self, domain: &mut D, address: D::Word, width: Width) -> Result<D::Word, AccessError>;

    /// Writes the lower bits.
    ///
    /// # Errors
    /// [`AccessError`]; memory is then unchanged.
    fn store(
        &mut self,
        domain: &mut D,
        address: D::Word,
        width: Width,
        value: D::Word,
    ) -> Result<(), AccessError>;
}

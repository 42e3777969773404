//! What a program sees of the processor: registers and memory, over any domain of values.

use crate::domain::Domain;
use crate::instruction::{FloatRegister, Register, Width};

/// Registers of the core and of the floating-point unit.
#[derive(Debug)]
pub struct Registers<D: Domain> {
    /// R0 to R14; the place of R15 is not used: an instruction knows its address.
    pub core: [D::Word; 16],
    /// S0 to S31.
    pub float: [D::Word; 32],
    /// N, Z, C, V.
    pub flags: D::Flags,
    /// N, Z, C, V of FPSCR, from the last float comparison; its other bits keep their reset value 0 (to nearest, no
    /// flush to zero), but sticky exceptions, which are not modelled.
    pub float_flags: D::Flags,
    /// PRIMASK, bit 0.
    pub primask: D::Word,
    /// FAULTMASK, bit 0.
    pub faultmask: D::Word,
    /// BASEPRI.
    pub basepri: D::Word,
    /// APSR's Q in bit 27 and GE in bits 19 to 16, all else zero.
    pub dsp_flags: D::Word,
    /// Whether an exclusive load still waits for its store.
    pub exclusive: D::Bit,
}

// By hand, because a derived one would ask it of the domain too.
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
    /// All zero.
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

    /// A core register, but R15: an instruction knows its own address.
    #[expect(clippy::indexing_slicing, reason = "four bits")]
    pub fn read(&self, register: Register) -> D::Word {
        self.core[usize::from(register & 15)]
    }

    /// Sets a core register to any word (a program's SP stays divisible by 4, which is not seen to here).
    #[expect(clippy::indexing_slicing, reason = "four bits")]
    pub fn write(&mut self, register: Register, value: D::Word) {
        self.core[usize::from(register & 15)] = value;
    }

    /// A float register.
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

/// Why an access to memory has no result.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum AccessError {
    /// Nothing is there.
    #[error("no memory at {address:#010x}")]
    Unmapped {
        /// The first byte.
        address: u32,
    },
    /// It must not be written.
    #[error("write to read-only memory at {address:#010x}")]
    ReadOnly {
        /// The first byte.
        address: u32,
    },
    /// The memory protection unit keeps everybody out.
    #[error("access to protected memory at {address:#010x}")]
    Protected {
        /// The first byte.
        address: u32,
    },
    /// The access needs an address divisible by its width.
    #[error("unaligned access at {address:#010x}")]
    Unaligned {
        /// The first byte.
        address: u32,
    },
    /// The address is not known well enough.
    #[error("an address between {lowest:#010x} and {highest:#010x} that is not known well enough")]
    Unknown {
        /// The smallest it can be.
        lowest: u32,
        /// The greatest it can be.
        highest: u32,
    },
}

/// Memory. Little-endian; unaligned words and halves are allowed, as on the processor.
pub(crate) trait Memory<D: Domain> {
    /// Reads, the upper bits zero.
    ///
    /// # Errors
    /// [`AccessError`].
    fn load(&mut self, domain: &mut D, address: D::Word, width: Width) -> Result<D::Word, AccessError>;

    /// Writes the lower bits.
    ///
    /// # Errors
    /// [`AccessError`]; nothing is written then.
    fn store(
        &mut self,
        domain: &mut D,
        address: D::Word,
        width: Width,
        value: D::Word,
    ) -> Result<(), AccessError>;
}

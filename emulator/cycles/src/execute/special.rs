//! Special registers.

use super::bits::Q;
use super::{ExecuteError, Execution};
use crate::domain::Domain;
use crate::instruction::{PC, Register, SP};

// Numbers of special registers (SYSm, DDI 0403E B5.1.1).
const APSR: u8 = 0;
const MSP: u8 = 8;
const PRIMASK: u8 = 16;
const BASEPRI: u8 = 17;
const BASEPRI_MAX: u8 = 18;
const FAULTMASK: u8 = 19;

impl<D: Domain, M> Execution<'_, D, M> {
    pub(super) fn change_state(&mut self, disables: bool, faults: bool) {
        let value = self.domain.constant(u32::from(disables));
        if faults {
            self.registers.faultmask = value;
        } else {
            self.registers.primask = value;
        }
    }

    pub(super) fn read_special(&mut self, d: Register, special: u8) -> Result<(), ExecuteError> {
        let value = match special {
            APSR => {
                let flags = self.domain.flags_word(self.registers.flags);
                self.domain.or(flags, self.registers.dsp_flags)
            }
            // Of the two stack pointers, only MSP is used.
            MSP => self.read(SP),
            PRIMASK => self.registers.primask,
            BASEPRI | BASEPRI_MAX => self.registers.basepri,
            FAULTMASK => self.registers.faultmask,
            _ => return Err(ExecuteError::Unmodelled),
        };
        self.write(d, value);
        Ok(())
    }

    pub(super) fn write_special(&mut self, n: Register, special: u8) -> Result<(), ExecuteError> {
        let value = self.read(n);
        match special {
            APSR => {
                self.registers.flags = self.domain.flags_from(value);
                // Writes Q with the flags, but not GE.
                let lanes = self.mask(self.registers.dsp_flags, !Q);
                let q = self.mask(value, Q);
                self.registers.dsp_flags = self.domain.or(lanes, q);
            }
            MSP => self.write(SP, value),
            PRIMASK => self.registers.primask = self.mask(value, 1),
            FAULTMASK => self.registers.faultmask = self.mask(value, 1),
            BASEPRI => self.registers.basepri = self.mask(value, 0xFF),
            BASEPRI_MAX => {
                let zero = self.domain.constant(0);
                let priority = self.mask(value, 0xFF);
                let words = [priority, self.registers.basepri, zero];
                let raises = self.domain.test(words, |[new, old, _]| new != 0 && (old == 0 || new < old));
                self.registers.basepri = self.domain.select(raises, priority, self.registers.basepri);
            }
            _ => return Err(ExecuteError::Unmodelled),
        }
        Ok(())
    }

    /// Reads only the flags: sticky exception bits are not kept.
    pub(super) fn float_status_read(&mut self, t: Register) -> Result<(), ExecuteError> {
        if t != PC {
            return Err(ExecuteError::Unmodelled);
        }
        self.registers.flags = self.registers.float_flags;
        Ok(())
    }

    /// Supports only rounding to nearest, without flush to zero and default NaN.
    pub(super) fn float_status_write(&mut self, t: Register) -> Result<(), ExecuteError> {
        let value = self.read(t);
        let modes = self.mask(value, 0x07C0_0000);
        if self.domain.known(modes) != Some(0) {
            return Err(ExecuteError::Unmodelled);
        }
        self.registers.float_flags = self.domain.flags_from(value);
        Ok(())
    }
}

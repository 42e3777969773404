//! Branches that compute a target or set LR.

use super::{ExecuteError, Execution, Flow};
use crate::domain::Domain;
use crate::instruction::{Condition, LR, Register, Shift, Width};
use crate::state::Memory;

impl<D: Domain, M: Memory<D>> Execution<'_, D, M> {
    pub(super) fn branch_link(&mut self, target: u32) -> Flow<D> {
        self.link();
        Flow::Jump(target)
    }

    pub(super) fn branch_link_register(&mut self, m: Register) -> Flow<D> {
        let target = self.read(m);
        self.link();
        Flow::Indirect(target)
    }

    fn link(&mut self) {
        let behind = self.domain.constant(self.instruction.next() | 1);
        self.registers.write(LR, behind);
    }

    pub(super) fn compare_branch(&mut self, n: Register, on_nonzero: bool, target: u32) -> Flow<D> {
        let (n, zero, carry) = (self.read(n), self.domain.constant(0), self.domain.bit(true));
        // As a comparison, so that a domain derives a fact about the register from the branch taken.
        let (_, flags) = self.domain.subtract(n, zero, carry);
        let condition = if on_nonzero { Condition::NotEqual } else { Condition::Equal };
        Flow::Branch { target, taken: self.domain.holds(condition, flags) }
    }

    pub(super) fn table_branch(
        &mut self,
        n: Register,
        m: Register,
        half: bool,
    ) -> Result<Flow<D>, ExecuteError> {
        let (table, index) = (self.read(n), self.read(m));
        let (width, index) =
            if half { (Width::Half, self.shifted(index, Shift::Left, 1)) } else { (Width::Byte, index) };
        let address = self.sum(table, index);
        let halfwords = self.memory.load(self.domain, address, width)?;
        let distance = self.shifted(halfwords, Shift::Left, 1);
        let start = self.domain.constant(self.instruction.address.wrapping_add(4) | 1);
        Ok(Flow::Indirect(self.sum(start, distance)))
    }
}

//! Small hand-made programs: every instruction is four bytes long.
#![expect(dead_code, reason = "each test uses only some of these")]
#![expect(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

use std::collections::BTreeMap;
use std::sync::Arc;

use cycles::image::{Function, Image, Segment};
use cycles::instruction::{
    Address, AddressMode, Arithmetic, Condition, Instruction, LR, Offset, Operand, Operation, PC, Register,
};
use cycles::machine::Machine;
use cycles::timing::{Column, Profile, Timing};

pub(crate) const CODE: u32 = 0x0800_0000;
pub(crate) const RAM: u32 = 0x2000_0000;
const STACK: u32 = 0x2000_1000;
pub(crate) const STACK_TOP: u32 = 0x2000_2000;

/// Address of the instruction with this number.
pub(crate) fn at(number: u32) -> u32 {
    CODE + 4 * number
}

pub(crate) fn timing() -> Timing {
    Timing::new(Profile::ZeroWait, Column::Upper)
}

pub(crate) fn arithmetic(operator: Arithmetic, d: Option<Register>, n: Register, number: u32) -> Operation {
    let operand = Operand::Immediate { value: number, carry: None };
    // Sums with the stack pointer do not set flags.
    Operation::Arithmetic { operator, d, n, operand, sets_flags: d != Some(13) }
}

pub(crate) fn number(d: Register, value: u32) -> Operation {
    let operand = Operand::Immediate { value, carry: None };
    Operation::Move { d, operand, inverted: false, sets_flags: false }
}

pub(crate) fn address(base: Register, offset: Offset) -> Address {
    Address { base, offset, mode: AddressMode::Offset }
}

/// A sequence of instructions, with the tables of table branches in between.
#[derive(Debug, Clone, Default)]
pub(crate) struct Program {
    instructions: BTreeMap<u32, Instruction>,
    tables: BTreeMap<u32, [u8; 4]>,
    /// Start addresses of all functions except the first.
    functions: Vec<u32>,
    next: u32,
}

impl Program {
    pub(crate) fn new(operations: impl IntoIterator<Item = Operation>) -> Self {
        Self::default().then(operations)
    }

    /// Number of the next instruction.
    pub(crate) fn here(&self) -> u32 {
        self.next
    }

    fn add(&mut self, condition: Condition, in_it_block: bool, operation: Operation) {
        let address = at(self.next);
        let instruction = Instruction { address, bytes: 4, condition, in_it_block, operation };
        self.instructions.insert(self.next, instruction);
        self.next += 1;
    }

    pub(crate) fn then(mut self, operations: impl IntoIterator<Item = Operation>) -> Self {
        for operation in operations {
            self.add(Condition::Always, false, operation);
        }
        self
    }

    pub(crate) fn in_it(mut self, condition: Condition, operation: Operation) -> Self {
        self.add(condition, true, operation);
        self
    }

    /// A conditional branch to the instruction with this number.
    pub(crate) fn when(mut self, condition: Condition, target: u32) -> Self {
        self.add(condition, false, Operation::Branch { target: at(target) });
        self
    }

    /// A table branch to the instructions with these numbers.
    pub(crate) fn table(mut self, m: Register, targets: [u32; 4]) -> Self {
        self.add(Condition::Always, false, Operation::TableBranch { n: PC, m, half: false });
        self.tables.insert(self.next, [0; 4]);
        self.next += 1;
        let table = self.next - 1;
        self.set_table(table, targets);
        self
    }

    /// Replaces the targets of the table with this number.
    pub(crate) fn set_table(&mut self, table: u32, targets: [u32; 4]) {
        let entry = |target: u32| u8::try_from((4 * target).saturating_sub(4 * table) / 2).unwrap();
        self.tables.insert(table, targets.map(entry));
    }

    /// Replaces the target of a branch.
    pub(crate) fn set_target(&mut self, number: u32, target: u32) {
        let instruction = self.instructions.get_mut(&number).unwrap();
        instruction.operation = Operation::Branch { target: at(target) };
    }

    pub(crate) fn returns(self) -> Self {
        self.then([Operation::BranchRegister { m: LR }])
    }

    /// Starts a new function at the next instruction.
    pub(crate) fn function(mut self) -> Self {
        self.functions.push(self.next);
        self
    }

    /// Addresses of all functions except the first.
    pub(crate) fn functions(&self) -> impl Iterator<Item = u32> {
        self.functions.iter().map(|number| at(*number))
    }

    pub(crate) fn image(&self) -> Image {
        let begins: Vec<u32> = [0].into_iter().chain(self.functions.iter().copied()).collect();
        let ends = begins.iter().skip(1).copied().chain([self.next]);
        let functions = begins.iter().zip(ends).map(|(begin, end)| {
            let name = if *begin == 0 { "main".to_owned() } else { format!("function_{begin}") };
            let address = at(*begin);
            (address, Function { address, bytes: 4 * (end - begin), names: vec![name] })
        });
        let bytes = (0..self.next).flat_map(|number| self.tables.get(&number).copied().unwrap_or_default());
        let flash = Segment { address: CODE, load_address: CODE, bytes: bytes.collect(), is_writable: false };
        let marks =
            [("_stack_end", STACK), ("_stack_start", STACK_TOP), ("__sdata", RAM), ("__euninit", STACK)];
        Image {
            segments: vec![flash],
            functions: functions.collect(),
            symbols: marks.into_iter().map(|(name, address)| (name.to_owned(), address)).collect(),
            code: self.instructions.values().map(|instruction| (instruction.address, *instruction)).collect(),
            ..Image::default()
        }
    }

    pub(crate) fn machine(&self) -> Machine {
        Machine::new(Arc::new(self.image()), timing()).unwrap()
    }
}

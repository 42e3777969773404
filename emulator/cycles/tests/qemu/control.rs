//! Jumps of every kind, forward over a few instructions.

use crate::program::Writer;

impl Writer {
    /// Any kind of jump.
    pub(crate) fn control(&mut self) {
        match self.below(9) {
            0 => self.skip_narrow(),
            1 => self.skip_wide(),
            2 => self.skip_by_register(),
            3 => self.skip_in_block(),
            4 => self.table_of_bytes(),
            5 => self.table_of_halves(),
            6 | 7 => self.subroutine(),
            _ => self.stack(),
        }
    }

    fn some(&mut self, most: u32) {
        for _ in 0..1 + self.below(most) {
            self.simple();
        }
    }

    /// Bytes from the base of a branch at an address to the current position.
    fn distance_from(&self, branch: u32) -> u16 {
        (self.address() - branch - 4) as u16
    }

    /// `B`, with and without condition, in 16 bits.
    fn skip_narrow(&mut self) {
        let condition = self.below(15) as u16;
        let branch = self.hole();
        // The distance counts from the second instruction after the branch.
        self.put(&[0xBF00]);
        self.some(4);
        let halves = self.distance_from(branch) / 2;
        let branches = if condition == 14 { 0xE000 } else { 0xD000 | condition << 8 };
        self.patch(branch, branches | halves);
    }

    /// The same with a 32-bit encoding.
    fn skip_wide(&mut self) {
        let condition = self.below(15) as u16;
        let (branch, rest) = (self.hole(), self.hole());
        self.some(4);
        let halves = self.distance_from(branch) / 2;
        self.patch(branch, if condition == 14 { 0xF000 } else { 0xF000 | condition << 6 });
        self.patch(rest, if condition == 14 { 0xB800 | halves } else { 0x8000 | halves });
    }

    /// `CBZ`, `CBNZ`.
    fn skip_by_register(&mut self) {
        let (register, on_nonzero) = (self.low_register(), self.below(2) as u16);
        if self.below(2) == 0 {
            // Makes zero likely.
            self.put(&[0xF000 | register, register << 8 | 1]); // and register, register, #1
        }
        let branch = self.hole();
        self.put(&[0xBF00]);
        self.some(3);
        let halves = self.distance_from(branch) / 2;
        self.patch(branch, 0xB100 | on_nonzero << 11 | (halves >> 5) << 9 | (halves & 0x1F) << 3 | register);
    }

    /// `B` as the last instruction of an IT block.
    fn skip_in_block(&mut self) {
        let condition = self.below(14) as u16;
        self.put(&[0xBF08 | condition << 4]);
        let branch = self.hole();
        self.put(&[0xBF00]);
        self.some(4);
        let halves = self.distance_from(branch) / 2;
        self.patch(branch, 0xE000 | halves);
    }

    /// `TBB` over four snippets.
    fn table_of_bytes(&mut self) {
        let register = self.low_register();
        self.put(&[0xF3C0 | register, register << 8 | 1]); // ubfx register, register, #0, #2
        let branch = self.address();
        self.put(&[0xE8DF, 0xF000 | register]); // tbb [pc, register]
        let table = self.table(2);
        let targets = [0; 4].map(|_| {
            let target = self.distance_from(branch) / 2;
            self.some(1);
            target
        });
        self.patch(table, targets[0] | targets[1] << 8);
        self.patch(table + 2, targets[2] | targets[3] << 8);
    }

    /// `TBH` over four snippets, with a table that does not directly follow it.
    fn table_of_halves(&mut self) {
        let register = self.low_register();
        let base = 12;
        let over = self.hole();
        let table = self.table(4);
        self.patch(over, 0xE000 | (self.distance_from(over) / 2));
        self.load_constant(base, table);
        self.put(&[0xF3C0 | register, register << 8 | 1]); // ubfx register, register, #0, #2
        let branch = self.address();
        self.put(&[0xE8D0 | base, 0xF010 | register]); // tbh [base, register, lsl #1]
        for place in 0..4 {
            let target = self.distance_from(branch) / 2;
            self.patch(table + 2 * place, target);
            self.some(1);
        }
    }

    /// A function and a call to it.
    fn subroutine(&mut self) {
        let over = self.hole();
        let function = self.address();
        let ending = self.below(6);
        self.put(&[0xB510]); // push {r4, lr}
        self.plain();
        self.plain();
        match ending {
            0 => self.put(&[0xBD10]),                         // pop {r4, pc}
            1 => self.put(&[0xE8BD, 0x4010, 0x4770]),         // pop {r4, lr}; bx lr
            2 => self.put(&[0xE8BD, 0x4010, 0x46F7]),         // pop {r4, lr}; mov pc, lr
            3 => self.put(&[0xBC10, 0xF85D, 0xFB04]),         // pop {r4}; ldr pc, [sp], #4
            4 => self.put(&[0xE8BD, 0x8010]),                 // ldmia.w sp!, {r4, pc}
            _ => self.put(&[0x9901, 0xB002, 0x4708, 0xBF00]), // ldr r1, [sp, #4]; add sp, #8; bx r1
        }
        self.patch(over, 0xE000 | (self.distance_from(over) / 2));
        match self.below(3) {
            0 => {
                let halves = function.wrapping_sub(self.address() + 4) >> 1;
                self.put(&[0xF400 | (halves >> 11 & 0x3FF) as u16, 0xF800 | (halves & 0x7FF) as u16]); // bl
            }
            1 => {
                let register = self.low_register();
                self.load_constant(register, function | 1);
                self.put(&[0x4780 | register << 3]); // blx register
            }
            _ => {
                // A jump with a manually set return address: add lr, pc, #9 is the address after the bx.
                let register = self.low_register();
                self.load_constant(register, function | 1);
                if !self.address().is_multiple_of(4) {
                    self.put(&[0xBF00]);
                }
                let behind = 3;
                self.put(&[0xF20F, 0x0E00 | behind, 0x4700 | register << 3]); // adr lr, behind | 1; bx register
            }
        }
    }

    /// Pushes and pops words and floats, and moves SP.
    fn stack(&mut self) {
        let pushed = self.below(0x100) as u16 | 1;
        let popped = {
            let turned = self.below(8);
            (pushed << turned | pushed >> (8 - turned)) & 0xFF
        };
        let (first, count) = (self.below(24) as u16, 1 + self.below(8) as u16);
        let floats = |first: u16| (first >> 1) << 12 | 0x0A00 | count;
        let words = 1 + self.below(30) as u16;
        self.put(&[0xB400 | pushed]);
        self.put(&[0xED2D | (first & 1) << 6, floats(first)]); // vpush
        match self.below(4) {
            // sub sp; add r3, sp; str r3, [sp, #4]; add sp
            0 => self.put(&[0xB080 | words, 0xAB00 | words, 0x9301, 0xB000 | words]),
            // sub.w sp; add.w sp
            1 => self.put(&[0xF1AD, 0x0D00 | (words * 4), 0xF10D, 0x0D00 | (words * 4)]),
            // subw sp; addw sp
            2 => self.put(&[0xF2AD, 0x0D00 | (words * 4), 0xF20D, 0x0D00 | (words * 4)]),
            // mov r3, sp; orr r3, #3; mov sp, r3, which drops the lowest bits
            _ => self.put(&[0x466B, 0xF043, 0x0303, 0x469D]),
        }
        self.some(2);
        let first = self.below(24) as u16;
        self.put(&[0xECBD | (first & 1) << 6, floats(first)]); // vpop
        self.put(&[0xBC00 | popped]);
    }

    /// `B` to existing code.
    pub(crate) fn branch_back(&mut self, target: u32) {
        let halves = target.wrapping_sub(self.address() + 4) >> 1;
        self.put(&[0xF400 | (halves >> 11 & 0x3FF) as u16, 0xB800 | (halves & 0x7FF) as u16]);
    }
}

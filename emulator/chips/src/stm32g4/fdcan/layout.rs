//! Registers and bits (ST's header; RM0440, "FDCAN registers").

pub(super) const DBTP: u32 = 0x0C;
pub(super) const TEST: u32 = 0x10;
pub(super) const RWD: u32 = 0x14;
pub(super) const CCCR: u32 = 0x18;
pub(super) const NBTP: u32 = 0x1C;
pub(super) const TSCC: u32 = 0x20;
pub(super) const TSCV: u32 = 0x24;
pub(super) const TOCC: u32 = 0x28;
pub(super) const ECR: u32 = 0x40;
pub(super) const PSR: u32 = 0x44;
pub(super) const TDCR: u32 = 0x48;
pub(super) const IR: u32 = 0x50;
pub(super) const IE: u32 = 0x54;
pub(super) const ILS: u32 = 0x58;
pub(super) const ILE: u32 = 0x5C;
pub(super) const RXGFC: u32 = 0x80;
pub(super) const XIDAM: u32 = 0x84;
pub(super) const HPMS: u32 = 0x88;
pub(super) const RXF0S: u32 = 0x90;
pub(super) const RXF0A: u32 = 0x94;
pub(super) const RXF1S: u32 = 0x98;
pub(super) const RXF1A: u32 = 0x9C;
pub(super) const TXBC: u32 = 0xC0;
pub(super) const TXFQS: u32 = 0xC4;
pub(super) const TXBRP: u32 = 0xC8;
pub(super) const TXBAR: u32 = 0xCC;
pub(super) const TXBCR: u32 = 0xD0;
pub(super) const TXBTO: u32 = 0xD4;
pub(super) const TXBCF: u32 = 0xD8;
pub(super) const TXBTIE: u32 = 0xDC;
pub(super) const TXBCIE: u32 = 0xE0;
pub(super) const TXEFS: u32 = 0xE4;
pub(super) const TXEFA: u32 = 0xE8;
pub(super) const CKDIV: u32 = 0x100;

// Bits of CCCR.
pub(super) const INIT: u32 = 0;
pub(super) const CCE: u32 = 1;
pub(super) const ASM: u32 = 2;
pub(super) const CSA: u32 = 3;
pub(super) const CSR: u32 = 4;
pub(super) const MON: u32 = 5;
pub(super) const DAR: u32 = 6;
pub(super) const FDOE: u32 = 8;
pub(super) const BRSE: u32 = 9;
pub(super) const PXHD: u32 = 12;
/// Bits that a program changes only while INIT and CCE are set: DAR, FDOE, BRSE, PXHD, EFBI, TXP, NISO.
pub(super) const PROTECTED: u32 = 0xF340;
/// Bits that a program sets only while INIT and CCE are set, and clears at any time: ASM, MON, TEST.
pub(super) const PROTECTED_FROM_SETTING: u32 = 0xA4;
pub(super) const TEST_MODE: u32 = 7;
/// Bit of DBTP.
pub(super) const TDC: u32 = 23;
/// Bit of TXBC: queue instead of FIFO.
pub(super) const TFQM: u32 = 24;
/// Bit of RXGFC: overwrite mode of FIFO 1; the next bit is for FIFO 0.
pub(super) const F1OM: u32 = 8;

// Bits of IR and IE.
pub(super) const RF0N: u32 = 0;
pub(super) const RF0L: u32 = 2;
pub(super) const RF1N: u32 = 3;
pub(super) const HPM: u32 = 6;
pub(super) const TC: u32 = 7;
pub(super) const TCF: u32 = 8;
pub(super) const TFE: u32 = 9;
pub(super) const TEFN: u32 = 10;
pub(super) const TEFF: u32 = 11;
pub(super) const TEFL: u32 = 12;
pub(super) const TSW: u32 = 13;
pub(super) const EP: u32 = 17;
pub(super) const EW: u32 = 18;
pub(super) const BO: u32 = 19;
pub(super) const PEA: u32 = 21;
pub(super) const PED: u32 = 22;
/// Bits of IR that each bit of ILS assigns to an interrupt line.
pub(super) const GROUPS: [u32; 7] =
    [0b111, 0b111 << RF1N, 0b111 << HPM, 0b1111 << TFE, 0b111 << TSW, 0b11 << 16, 0b11_1111 << EW];

/// No error since the program's last read.
pub(super) const NO_CHANGE: u32 = 7;
/// Number of recessive bits after which a controller takes part.
pub(super) const IDLE_BITS: f64 = 11.0;
/// Number of idle sequences after bus-off. ISO 11898-1 requires 128; the controller adds one.
pub(super) const SEQUENCES_AFTER_BUS_OFF: u32 = 129;
/// Maximum prescaler field of DBTP with delay compensation: a prescaler of 2.
pub(super) const LONGEST_COMPENSATED_PRESCALER: u32 = 1;

//! Instructions as text in the manual's syntax: `ldreq r0, [r1, #4]`.

use core::fmt::{self, Debug, Display, Formatter};

use super::operand_text::{address, at, core, cores, floats, half, list, operand, run, shifted};
use super::{
    Arithmetic, Condition, FloatConvert, FloatRegister, FloatUnary, Instruction, Operand, Operation, PC,
    Register, SP, Shift,
};

impl Display for Instruction {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Syntax { name, types, operands } = syntax(&self.operation);
        let condition = match self.operation {
            Operation::IfThen { .. } | Operation::Breakpoint(_) => "",
            _ => self.condition.name(),
        };
        write!(f, "{name}{condition}{types}")?;
        if operands.is_empty() { Ok(()) } else { write!(f, " {operands}") }
    }
}

impl Condition {
    /// The manual's two letters; empty for `Always`.
    fn name(self) -> &'static str {
        match self {
            Self::Equal => "eq",
            Self::NotEqual => "ne",
            Self::CarrySet => "hs",
            Self::CarryClear => "lo",
            Self::Minus => "mi",
            Self::Plus => "pl",
            Self::Overflow => "vs",
            Self::NoOverflow => "vc",
            Self::Higher => "hi",
            Self::LowerOrSame => "ls",
            Self::GreaterOrEqual => "ge",
            Self::Less => "lt",
            Self::Greater => "gt",
            Self::LessOrEqual => "le",
            Self::Always => "",
        }
    }
}

impl Arithmetic {
    fn name(self, has_destination: bool) -> &'static str {
        match (self, has_destination) {
            (Self::And, true) => "and",
            (Self::And, false) => "tst",
            (Self::BitClear, _) => "bic",
            (Self::Or, _) => "orr",
            (Self::OrNot, _) => "orn",
            (Self::ExclusiveOr, true) => "eor",
            (Self::ExclusiveOr, false) => "teq",
            (Self::Add, true) => "add",
            (Self::Add, false) => "cmn",
            (Self::AddWithCarry, _) => "adc",
            (Self::Subtract, true) => "sub",
            (Self::Subtract, false) => "cmp",
            (Self::SubtractWithCarry, _) => "sbc",
            (Self::ReverseSubtract, _) => "rsb",
        }
    }
}

/// A line of assembly: the condition is between name and types.
struct Syntax {
    name: String,
    types: &'static str,
    operands: String,
}

fn plain(name: impl Into<String>, operands: impl Into<String>) -> Syntax {
    Syntax { name: name.into(), types: "", operands: operands.into() }
}

fn single(name: impl Into<String>, operands: impl Into<String>) -> Syntax {
    Syntax { name: name.into(), types: ".f32", operands: operands.into() }
}

/// The lower-case name of a variant, which is the manual's name.
fn lower(variant: impl Debug) -> String {
    format!("{variant:?}").to_lowercase()
}

/// Special registers by number (B5.1.1).
fn special_register(number: u8) -> &'static str {
    match number {
        0 => "apsr",
        1 => "iapsr",
        2 => "eapsr",
        3 => "xpsr",
        5 => "ipsr",
        6 => "epsr",
        7 => "iepsr",
        8 => "msp",
        9 => "psp",
        16 => "primask",
        17 => "basepri",
        18 => "basepri_max",
        19 => "faultmask",
        20 => "control",
        _ => "?",
    }
}

fn target(address: u32) -> String {
    format!("{address:#x}")
}

/// A float register in single or double precision.
fn of_size(d: FloatRegister, is_double: bool) -> String {
    if is_double { format!("d{}", d / 2) } else { floats(&[d]) }
}

/// Name, types and fraction bits of a conversion.
fn conversion(kind: FloatConvert) -> (&'static str, &'static str, Option<u8>) {
    match kind {
        FloatConvert::FromUnsigned => ("vcvt", ".f32.u32", None),
        FloatConvert::FromSigned => ("vcvt", ".f32.s32", None),
        FloatConvert::ToUnsigned => ("vcvt", ".u32.f32", None),
        FloatConvert::ToSigned => ("vcvt", ".s32.f32", None),
        FloatConvert::ToUnsignedRounded => ("vcvtr", ".u32.f32", None),
        FloatConvert::ToSignedRounded => ("vcvtr", ".s32.f32", None),
        FloatConvert::FromFixedUnsigned(bits) => ("vcvt", ".f32.u32", Some(bits)),
        FloatConvert::FromFixedSigned(bits) => ("vcvt", ".f32.s32", Some(bits)),
        FloatConvert::ToFixedUnsigned(bits) => ("vcvt", ".u32.f32", Some(bits)),
        FloatConvert::ToFixedSigned(bits) => ("vcvt", ".s32.f32", Some(bits)),
    }
}

fn syntax(operation: &Operation) -> Syntax {
    use Operation as O;
    let flags = |sets_flags| if sets_flags { "s" } else { "" };
    let back = |writes_back| if writes_back { "!" } else { "" };
    let with = |registers: &[Register], a: Option<Register>| match a {
        Some(a) => cores(registers) + ", " + core(a),
        None => cores(registers),
    };
    match *operation {
        O::Move { d, operand: of, inverted, sets_flags } => {
            let (name, of) = match of {
                Operand::Register { register, shift, amount }
                    if !inverted && (shift, amount) != (Shift::Left, 0) =>
                {
                    let amount =
                        if shift == Shift::RotateExtended { String::new() } else { format!(", #{amount}") };
                    (shift.name(), format!("{}{amount}", core(register)))
                }
                Operand::ShiftedBy { register, shift, amount } => (shift.name(), cores(&[register, amount])),
                of => (if inverted { "mvn" } else { "mov" }, operand(of)),
            };
            plain(format!("{name}{}", flags(sets_flags)), format!("{}, {of}", core(d)))
        }
        O::MoveTop { d, value } => plain("movt", format!("{}, #{value}", core(d))),
        O::Arithmetic { operator, d, n, operand: of, sets_flags } => {
            let name = operator.name(d.is_some());
            match d {
                Some(d) => plain(
                    format!("{name}{}", flags(sets_flags)),
                    format!("{}, {}", cores(&[d, n]), operand(of)),
                ),
                None => plain(name, format!("{}, {}", core(n), operand(of))),
            }
        }
        O::Multiply { d, n, m, a, subtracts, sets_flags } => {
            let name = match a {
                _ if subtracts => "mls",
                Some(_) => "mla",
                None => "mul",
            };
            plain(format!("{name}{}", flags(sets_flags)), with(&[d, n, m], a))
        }
        O::MultiplyLong { kind, low, high, n, m } => plain(lower(kind), cores(&[low, high, n, m])),
        O::MultiplyHalves { d, n, m, a } => {
            let name = if a.is_some() { "smla" } else { "smul" };
            plain(format!("{name}{}{}", half(n.1), half(m.1)), with(&[d, n.0, m.0], a))
        }
        O::MultiplyWide { d, n, m, a } => {
            let name = if a.is_some() { "smlaw" } else { "smulw" };
            plain(format!("{name}{}", half(m.1)), with(&[d, n, m.0], a))
        }
        O::MultiplyTop { d, n, m, a, subtracts, rounds } => {
            let name = match a {
                _ if subtracts => "smmls",
                Some(_) => "smmla",
                None => "smmul",
            };
            plain(format!("{name}{}", if rounds { "r" } else { "" }), with(&[d, n, m], a))
        }
        O::Divide { d, n, m, is_signed } => plain(if is_signed { "sdiv" } else { "udiv" }, cores(&[d, n, m])),
        O::Extend { kind, d, n, m, rotation } => {
            let rotation = if rotation == 0 { String::new() } else { format!(", ror #{rotation}") };
            let name = lower(kind);
            match n {
                Some(n) => plain(name.replace("xt", "xta"), cores(&[d, n, m]) + &rotation),
                None => plain(name, cores(&[d, m]) + &rotation),
            }
        }
        O::ExtractField { d, n, min_bit, width, is_signed } => plain(
            if is_signed { "sbfx" } else { "ubfx" },
            format!("{}, #{min_bit}, #{width}", cores(&[d, n])),
        ),
        O::InsertField { d, n: Some(n), min_bit, width } => {
            plain("bfi", format!("{}, #{min_bit}, #{width}", cores(&[d, n])))
        }
        O::InsertField { d, n: None, min_bit, width } => {
            plain("bfc", format!("{}, #{min_bit}, #{width}", core(d)))
        }
        O::Bits { kind, d, m } => plain(lower(kind), cores(&[d, m])),
        O::Saturate { d, bits, is_signed, n, shift, amount } => plain(
            if is_signed { "ssat" } else { "usat" },
            format!("{}, #{bits}, {}", core(d), shifted(n, shift, amount)),
        ),
        O::Pack { d, n, m, amount, top_first } => {
            let (name, shift) =
                if top_first { ("pkhtb", Shift::ArithmeticRight) } else { ("pkhbt", Shift::Left) };
            plain(name, format!("{}, {}", cores(&[d, n]), shifted(m, shift, amount)))
        }
        O::Parallel { kind, d, n, m } => {
            let name = lower(kind);
            // The saturating sums have the reverse operand order.
            let turned = matches!(name.as_str(), "qadd" | "qsub" | "qdadd" | "qdsub");
            plain(name, if turned { cores(&[d, m, n]) } else { cores(&[d, n, m]) })
        }
        O::Load { t, address: of, width, is_signed } => {
            let sign = if is_signed { "s" } else { "" };
            plain(format!("ldr{sign}{}", width.name()), format!("{}, {}", core(t), address(of)))
        }
        O::Store { t, address: of, width } => {
            plain(format!("str{}", width.name()), format!("{}, {}", core(t), address(of)))
        }
        O::LoadPair { t, t2, address: of } => plain("ldrd", format!("{}, {}", cores(&[t, t2]), address(of))),
        O::StorePair { t, t2, address: of } => plain("strd", format!("{}, {}", cores(&[t, t2]), address(of))),
        O::LoadMultiple { n: SP, registers, writes_back: true, down: false } => plain("pop", list(registers)),
        O::StoreMultiple { n: SP, registers, writes_back: true, down: true } => {
            plain("push", list(registers))
        }
        O::LoadMultiple { n, registers, writes_back, down } => plain(
            if down { "ldmdb" } else { "ldm" },
            format!("{}{}, {}", core(n), back(writes_back), list(registers)),
        ),
        O::StoreMultiple { n, registers, writes_back, down } => plain(
            if down { "stmdb" } else { "stm" },
            format!("{}{}, {}", core(n), back(writes_back), list(registers)),
        ),
        O::LoadExclusive { t, n, offset, width } => {
            plain(format!("ldrex{}", width.name()), format!("{}, {}", core(t), at(n, offset.into())))
        }
        O::StoreExclusive { d, t, n, offset, width } => {
            plain(format!("strex{}", width.name()), format!("{}, {}", cores(&[d, t]), at(n, offset.into())))
        }
        O::ClearExclusive => plain("clrex", ""),
        O::Branch { target: to } => plain("b", target(to)),
        O::BranchLink { target: to } => plain("bl", target(to)),
        O::BranchRegister { m } => plain("bx", core(m)),
        O::BranchLinkRegister { m } => plain("blx", core(m)),
        O::CompareBranch { n, on_nonzero, target: to } => {
            plain(if on_nonzero { "cbnz" } else { "cbz" }, format!("{}, {}", core(n), target(to)))
        }
        O::TableBranch { n, m, half: false } => plain("tbb", format!("[{}]", cores(&[n, m]))),
        O::TableBranch { n, m, half: true } => plain("tbh", format!("[{}, lsl #1]", cores(&[n, m]))),
        O::IfThen { length } => plain("it", format!("({length})")),
        O::Hint => plain("nop", ""),
        O::Wait => plain("wfi", ""),
        O::Barrier => plain("dmb", ""),
        O::ChangeState { disables, faults } => {
            plain(if disables { "cpsid" } else { "cpsie" }, if faults { "f" } else { "i" })
        }
        O::ReadSpecial { d, special } => plain("mrs", format!("{}, {}", core(d), special_register(special))),
        O::WriteSpecial { n, special } => plain("msr", format!("{}, {}", special_register(special), core(n))),
        O::SupervisorCall(number) => plain("svc", format!("#{number}")),
        O::Breakpoint(number) => plain("bkpt", format!("#{number}")),
        O::Undefined(number) => plain("udf", format!("#{number}")),
        O::Float { operator, d, n, m } => single(lower(operator), floats(&[d, n, m])),
        O::FloatUnary { operator: FloatUnary::Vmov, d, m } => single("vmov", floats(&[d, m])),
        O::FloatUnary { operator, d, m } => single(lower(operator), floats(&[d, m])),
        O::FloatImmediate { d, bits } => {
            single("vmov", format!("{}, #{}", floats(&[d]), f32::from_bits(bits)))
        }
        O::FloatCompare { d, m, quiet_signals } => {
            let m = m.map_or("#0".to_owned(), |m| floats(&[m]));
            single(if quiet_signals { "vcmpe" } else { "vcmp" }, format!("{}, {m}", floats(&[d])))
        }
        O::FloatConvert { kind, d, m } => {
            let (name, types, bits) = conversion(kind);
            let bits = bits.map_or(String::new(), |bits| format!(", #{bits}"));
            Syntax { name: name.to_owned(), types, operands: floats(&[d, m]) + &bits }
        }
        O::FloatLoad { d, is_double, base, offset } => {
            plain("vldr", format!("{}, {}", of_size(d, is_double), at(base, offset.into())))
        }
        O::FloatStore { d, is_double, base, offset } => {
            plain("vstr", format!("{}, {}", of_size(d, is_double), at(base, offset.into())))
        }
        O::FloatLoadMultiple { n: SP, d, count, writes_back: true, down: false } => {
            plain("vpop", run(d, count))
        }
        O::FloatStoreMultiple { n: SP, d, count, writes_back: true, down: true } => {
            plain("vpush", run(d, count))
        }
        O::FloatLoadMultiple { n, d, count, writes_back, down } => plain(
            if down { "vldmdb" } else { "vldmia" },
            format!("{}{}, {}", core(n), back(writes_back), run(d, count)),
        ),
        O::FloatStoreMultiple { n, d, count, writes_back, down } => plain(
            if down { "vstmdb" } else { "vstmia" },
            format!("{}{}, {}", core(n), back(writes_back), run(d, count)),
        ),
        O::FloatFromCore { d, t } => plain("vmov", format!("{}, {}", floats(&[d]), core(t))),
        O::FloatToCore { t, m } => plain("vmov", format!("{}, {}", core(t), floats(&[m]))),
        O::FloatPairFromCore { d, t, t2 } => {
            plain("vmov", format!("{}, {}", floats(&[d, d + 1]), cores(&[t, t2])))
        }
        O::FloatPairToCore { t, t2, m } => {
            plain("vmov", format!("{}, {}", cores(&[t, t2]), floats(&[m, m + 1])))
        }
        O::FloatStatusRead { t: PC } => plain("vmrs", "APSR_nzcv, fpscr"),
        O::FloatStatusRead { t } => plain("vmrs", format!("{}, fpscr", core(t))),
        O::FloatStatusWrite { t } => plain("vmsr", format!("fpscr, {}", core(t))),
    }
}

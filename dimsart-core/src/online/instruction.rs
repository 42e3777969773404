//! Instructions of a program: a word each.

/// Registers of a program, a number in each.
pub const REGISTERS: usize = 32;
/// The axis of an instruction that means the one that is computed.
pub const OWN_AXIS: u8 = FIELD;

const FIELD: u8 = 0x3F;

macro_rules! opcodes {
    ($($(#[$doc:meta])* $name:ident [$($field:ident)*]),* $(,)?) => {
        /// What an instruction does, with its fields in order.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
        #[repr(u8)]
        pub enum Opcode { $($(#[$doc])* $name),* }

        impl Opcode {
            /// Every one, by its number.
            pub const ALL: &'static [Self] = &[$(Self::$name),*];

            /// The one of a number; none for a number that no opcode has.
            #[inline(always)]
            #[must_use]
            pub const fn of(number: u8) -> Option<Self> {
                // A comparison and no more in machine code.
                match number {
                    $(number if number == Self::$name as u8 => Some(Self::$name),)*
                    _ => None,
                }
            }

            /// That of an instruction that was verified; for a number that no opcode has, the first one.
            #[inline(always)]
            pub(super) const fn of_word(word: u32) -> Self {
                // As few bits as all numbers take: a jump table needs no comparison before it.
                match word & NUMBERS {
                    $(number if number == Self::$name as u32 => Self::$name,)*
                    _ => Self::FIRST,
                }
            }

            /// Its name.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Self::$name => stringify!($name)),* }
            }

            /// What its fields are.
            #[must_use]
            pub const fn fields(self) -> &'static [Field] {
                match self { $(Self::$name => &[$(Field::$field),*]),* }
            }
        }
    };
}

/// What a field of an instruction names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Field {
    /// A register that is written.
    To,
    /// A register that is read.
    From,
    /// A constant.
    Constant,
    /// An input.
    Input,
    /// An output.
    Output,
    /// A parameter.
    Parameter,
    /// What is remembered from tick to tick.
    State,
    /// An axis, or [`OWN_AXIS`].
    Axis,
}

opcodes! {
    /// A constant.
    Constant [To Constant],
    /// The sample period, `s`.
    Period [To],
    /// An input on an axis.
    Input [To Input Axis],
    /// A parameter of an axis; those of the axis that is computed are in registers.
    Parameter [To Parameter Axis],
    /// What was written to an output last, where the law takes over from another one; else 0.
    Last [To Output Axis],
    /// Remembers a number for the next tick.
    Remember [State From],
    /// Writes an output on an axis.
    Output [Output From Axis],
    /// `a + b`.
    Add [To From From],
    /// `a - b`.
    Subtract [To From From],
    /// `a * b`.
    Multiply [To From From],
    /// `a / b`.
    Divide [To From From],
    /// `a * b + c`, rounded twice.
    MultiplyAdd [To From From From],
    /// `-a`.
    Negate [To From],
    /// `a` without its sign.
    Absolute [To From],
    /// The smaller one.
    Minimum [To From From],
    /// The larger one.
    Maximum [To From From],
    /// `a`, not below `b`, not above `c`.
    Clamp [To From From From],
    /// 1 if `a < b`, else 0.
    Less [To From From],
    /// 1 if `a <= b`, else 0.
    LessOrEqual [To From From],
    /// 1 if `a` and `b` are the same number, else 0.
    Equal [To From From],
    /// `b` if `a` is not 0, else `c`.
    Select [To From From From],
    /// [`math::sqrt`](crate::math::sqrt).
    SquareRoot [To From],
    /// [`math::sin`](crate::math::sin).
    Sine [To From],
    /// [`math::cos`](crate::math::cos).
    Cosine [To From],
    /// [`math::atan2`](crate::math::atan2).
    Arctangent [To From From],
}

impl Opcode {
    const FIRST: Self = Self::Constant;
}

/// As many as all numbers take.
const NUMBERS: u32 = 0x1F;
const _: () = assert!(OPCODES <= 0x20, "as many as fit");

/// Where the fields of an instruction begin, 6 bits each.
pub(super) const PLACES: [u32; 4] = [8, 14, 20, 26];

/// Number of opcodes.
pub const OPCODES: usize = Opcode::ALL.len();

/// An instruction: opcode in the low 8 bits, then four fields of 6.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Instruction(pub u32);

impl Instruction {
    /// One with these fields, of which 6 bits each are taken; those that are missing are 0.
    #[must_use]
    pub fn new(opcode: Opcode, fields: &[u8]) -> Self {
        let bits = fields.iter().zip(PLACES).map(|(field, place)| u32::from(field & FIELD) << place);
        Self(bits.fold(opcode as u32, |word, bits| word | bits))
    }

    /// What it does; none for a number that no opcode has.
    #[inline(always)]
    #[must_use]
    pub fn opcode(self) -> Option<Opcode> {
        let [number, ..] = self.0.to_le_bytes();
        Opcode::of(number)
    }

    /// Its fields.
    #[inline(always)]
    #[must_use]
    pub const fn fields(self) -> [u8; 4] {
        let [a, b, c, d] = PLACES;
        [self.field(a), self.field(b), self.field(c), self.field(d)]
    }

    #[expect(clippy::cast_possible_truncation, reason = "6 bits")]
    #[inline(always)]
    const fn field(self, place: u32) -> u8 {
        (self.0 >> place) as u8 & FIELD
    }
}

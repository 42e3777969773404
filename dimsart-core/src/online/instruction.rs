//! Instructions of a program, one word each.

/// Number of registers.
pub const REGISTERS: usize = 32;
/// Axis field that means the current axis.
pub const OWN_AXIS: u8 = FIELD;

const FIELD: u8 = 0x3F;

macro_rules! opcodes {
    ($($(#[$doc:meta])* $name:ident [$($field:ident)*]),* $(,)?) => {
        /// Operation of an instruction, with its fields in order.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
        #[repr(u8)]
        pub enum Opcode { $($(#[$doc])* $name),* }

        impl Opcode {
            /// All opcodes, by number.
            pub const ALL: &'static [Self] = &[$(Self::$name),*];

            /// Returns the opcode of a number, if there is one.
            #[inline(always)]
            #[must_use]
            pub const fn of(number: u8) -> Option<Self> {
                // Compiles to one comparison.
                match number {
                    $(number if number == Self::$name as u8 => Some(Self::$name),)*
                    _ => None,
                }
            }

            /// Returns the opcode of a verified instruction; the first opcode for an invalid number.
            #[inline(always)]
            pub(super) const fn of_word(word: u32) -> Self {
                // Masked to the bits of the opcodes, so that a jump table needs no range check.
                match word & NUMBERS {
                    $(number if number == Self::$name as u32 => Self::$name,)*
                    _ => Self::FIRST,
                }
            }

            /// Returns the name.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Self::$name => stringify!($name)),* }
            }

            /// Returns the fields.
            #[must_use]
            pub const fn fields(self) -> &'static [Field] {
                match self { $(Self::$name => &[$(Field::$field),*]),* }
            }
        }
    };
}

/// Meaning of an instruction's field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Field {
    /// Register to write.
    To,
    /// Register to read.
    From,
    /// Constant.
    Constant,
    /// Input.
    Input,
    /// Output.
    Output,
    /// Parameter.
    Parameter,
    /// State.
    State,
    /// Axis, or [`OWN_AXIS`].
    Axis,
}

opcodes! {
    /// Loads a constant.
    Constant [To Constant],
    /// Loads the sample period, `s`.
    Period [To],
    /// Loads an input of an axis.
    Input [To Input Axis],
    /// Loads a parameter of an axis; the current axis' parameters are already in registers.
    Parameter [To Parameter Axis],
    /// Loads the last value of an output if the law takes over from another one; otherwise 0.
    Last [To Output Axis],
    /// Stores a state for the next tick.
    Remember [State From],
    /// Writes an output of an axis.
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
    /// Absolute value of `a`.
    Absolute [To From],
    /// Minimum.
    Minimum [To From From],
    /// Maximum.
    Maximum [To From From],
    /// Limits `a` to at least `b`, then to at most `c`.
    Clamp [To From From From],
    /// 1 if `a < b`, else 0.
    Less [To From From],
    /// 1 if `a <= b`, else 0.
    LessOrEqual [To From From],
    /// 1 if `a == b`, else 0.
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

/// Bit mask of the opcodes.
const NUMBERS: u32 = 0x1F;
const _: () = assert!(OPCODES <= 0x20, "too many opcodes");

/// First bits of an instruction's fields, 6 bits each.
pub(super) const PLACES: [u32; 4] = [8, 14, 20, 26];

/// Number of opcodes.
pub const OPCODES: usize = Opcode::ALL.len();

/// An instruction: opcode in the low 8 bits, then four fields of 6 bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Instruction(pub u32);

impl Instruction {
    /// Creates an instruction; fields are cut to 6 bits, missing fields are 0.
    #[must_use]
    pub fn new(opcode: Opcode, fields: &[u8]) -> Self {
        let bits = fields.iter().zip(PLACES).map(|(field, place)| u32::from(field & FIELD) << place);
        Self(bits.fold(opcode as u32, |word, bits| word | bits))
    }

    /// Returns the opcode; none for an invalid number.
    #[inline(always)]
    #[must_use]
    pub fn opcode(self) -> Option<Opcode> {
        let [number, ..] = self.0.to_le_bytes();
        Opcode::of(number)
    }

    /// Returns the fields.
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

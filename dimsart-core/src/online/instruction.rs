//! Instructions of a program, one word each.

/// Number of registers.
pub const REGISTER_COUNT: usize = 32;
/// Axis field that means the current axis.
pub const CURRENT_AXIS: u8 = FIELD;

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
            pub const fn from_number(number: u8) -> Option<Self> {
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
    Destination,
    /// Register to read.
    Source,
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
    /// Axis, or [`CURRENT_AXIS`].
    Axis,
}

opcodes! {
    /// Loads a constant.
    Constant [Destination Constant],
    /// Loads the sample period, `s`.
    Period [Destination],
    /// Loads an input of an axis.
    Input [Destination Input Axis],
    /// Loads a parameter of an axis; the current axis' parameters are already in registers.
    Parameter [Destination Parameter Axis],
    /// Loads the last value of an output if the law takes over from another one; otherwise 0.
    Last [Destination Output Axis],
    /// Stores a state for the next tick.
    Remember [State Source],
    /// Writes an output of an axis.
    Output [Output Source Axis],
    /// `a + b`.
    Add [Destination Source Source],
    /// `a - b`.
    Subtract [Destination Source Source],
    /// `a * b`.
    Multiply [Destination Source Source],
    /// `a / b`.
    Divide [Destination Source Source],
    /// `a * b + c`, rounded twice.
    MultiplyAdd [Destination Source Source Source],
    /// `-a`.
    Negate [Destination Source],
    /// Absolute value of `a`.
    Absolute [Destination Source],
    /// Minimum.
    Minimum [Destination Source Source],
    /// Maximum.
    Maximum [Destination Source Source],
    /// Limits `a` to at least `b`, then to at most `c`.
    Clamp [Destination Source Source Source],
    /// 1 if `a < b`, else 0.
    Less [Destination Source Source],
    /// 1 if `a <= b`, else 0.
    LessOrEqual [Destination Source Source],
    /// 1 if `a == b`, else 0.
    Equal [Destination Source Source],
    /// `b` if `a` is not 0, else `c`.
    Select [Destination Source Source Source],
    /// [`math::sqrt`](crate::math::sqrt).
    SquareRoot [Destination Source],
    /// [`math::sin`](crate::math::sin).
    Sine [Destination Source],
    /// [`math::cos`](crate::math::cos).
    Cosine [Destination Source],
    /// [`math::atan2`](crate::math::atan2).
    Arctangent [Destination Source Source],
}

impl Opcode {
    const FIRST: Self = Self::Constant;
}

/// Bit mask of the opcodes.
const NUMBERS: u32 = 0x1F;
const _: () = assert!(OPCODE_COUNT <= 0x20, "too many opcodes");

/// First bits of an instruction's fields, 6 bits each.
pub(super) const PLACES: [u32; 4] = [8, 14, 20, 26];

/// Number of opcodes.
pub const OPCODE_COUNT: usize = Opcode::ALL.len();

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
        Opcode::from_number(number)
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

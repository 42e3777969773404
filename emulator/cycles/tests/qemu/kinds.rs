//! Kinds of instructions, to check that each was executed.

use cycles::instruction::Instruction;

/// Operations without a kind field. Excludes operations that wait or trap, which programs do not contain.
const PLAIN: &str = "\
    Barrier Branch BranchLink BranchLinkRegister BranchRegister ChangeState ClearExclusive CompareBranch \
    Divide ExtractField FloatCompare FloatFromCore FloatImmediate FloatLoad FloatLoadMultiple \
    FloatPairFromCore FloatPairToCore FloatStatusRead FloatStatusWrite FloatStore FloatStoreMultiple \
    FloatToCore Hint IfThen InsertField Load LoadExclusive LoadMultiple LoadPair Move MoveTop Multiply \
    MultiplyHalves MultiplyTop MultiplyWide Pack ReadSpecial Saturate Store StoreExclusive StoreMultiple \
    StorePair TableBranch WriteSpecial";
/// Operations with their kinds.
const WITH_KIND: &[(&str, &str)] = &[
    (
        "Arithmetic",
        "Add AddWithCarry And BitClear ExclusiveOr Or OrNot ReverseSubtract Subtract \
        SubtractWithCarry",
    ),
    ("Bits", "Clz Rbit Rev Rev16 Revsh"),
    ("Extend", "Sxtb Sxtb16 Sxth Uxtb Uxtb16 Uxth"),
    ("Float", "Vadd Vdiv Vfma Vfms Vfnma Vfnms Vmla Vmls Vmul Vnmla Vnmls Vnmul Vsub"),
    (
        "FloatConvert",
        "FromFixedSigned FromFixedUnsigned FromSigned FromUnsigned ToFixedSigned \
        ToFixedUnsigned ToSigned ToSignedRounded ToUnsigned ToUnsignedRounded",
    ),
    ("FloatUnary", "Vabs Vmov Vneg Vsqrt"),
    ("MultiplyLong", "Smlal Smull Umaal Umlal Umull"),
    (
        "Parallel",
        "Qadd Qadd16 Qadd8 Qdadd Qdsub Qsub Qsub16 Qsub8 Sadd16 Sadd8 Sel Ssub16 Ssub8 \
        Uadd16 Uadd8 Uqadd16 Uqadd8 Uqsub16 Uqsub8 Usub16 Usub8",
    ),
];

/// Every kind.
pub(crate) fn all() -> impl Iterator<Item = String> {
    let with_kind = WITH_KIND.iter().flat_map(|(operation, kinds)| {
        kinds.split_whitespace().map(move |kind| format!("{operation} {kind}"))
    });
    PLAIN.split_whitespace().map(str::to_owned).chain(with_kind)
}

/// An operation without operands: its variant and, if it has one, its kind.
pub(crate) fn kind(instruction: &Instruction) -> String {
    let text = format!("{:?}", instruction.operation);
    let word =
        |text: &str| -> String { text.chars().take_while(|letter| letter.is_alphanumeric()).collect() };
    let field = ["operator: ", "kind: "].iter().find_map(|name| text.split_once(name));
    let kind = field.map_or(String::new(), |(_, behind)| word(behind));
    format!("{} {kind}", word(&text)).trim_end().to_owned()
}

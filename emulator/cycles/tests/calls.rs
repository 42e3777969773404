//! Stack use and reachability of functions, in hand-made images.

#[path = "calls/code.rs"]
mod code;

use code::{Code, address, call, image, jump};
use cycles::GraphError;
use cycles::declarations::{CallDeclarations, NamePattern};
use cycles::frame::{Call, Frame, FrameError, Frames};
use cycles::image::Image;
use cycles::reachability::{self, ReachError};
use cycles::stack::{self, StackBound, StackError};

const PUSH_R4_LR: u16 = 0xB510;
const POP_R4_PC: u16 = 0xBD10;
const PUSH_R7_LR: u16 = 0xB580;
const POP_R7_PC: u16 = 0xBD80;
const RETURN: u16 = 0x4770;
const TRAP: u16 = 0xDEFE;
const CALL_R0: u16 = 0x4780;
const LOOP: u16 = 0xE7FE;
/// `SUB SP, #64` and `ADD SP, #64`.
const TAKE_64: u16 = 0xB090;
const GIVE_64: u16 = 0xB010;
/// `VSQRT.F32 S0, S0`.
const SQUARE_ROOT: [u16; 2] = [0xEEB1, 0x0AC0];
const NONE: usize = usize::MAX;

fn followed(functions: &[Code]) -> Result<Frame, FrameError> {
    let image = image(functions, &[]);
    let frame = Frames::new(&image).of(address(0))?;
    Ok(Frame::clone(&frame))
}

fn one(code: &[u16]) -> Result<Frame, FrameError> {
    followed(&[("f", code.to_vec())])
}

/// `PUSH {R7, LR}`, a call, `POP {R7, PC}`.
fn calling(from: usize, to: usize) -> Vec<u16> {
    let [high, low] = call(from, 1, to);
    vec![PUSH_R7_LR, high, low, POP_R7_PC]
}

fn bound(image: &Image, declared: &str) -> Result<StackBound, StackError> {
    let priorities = [("low", 6), ("high", 2), ("same", 2)];
    stack::bound(image, &CallDeclarations::read(declared).unwrap_or_default(), &priorities)
}

#[test]
fn a_frame_is_as_deep_as_its_deepest_path() {
    // The stack space is reserved after CBZ R0.
    let frame = one(&[PUSH_R4_LR, 0xB110, TAKE_64, 0xBF00, GIVE_64, POP_R4_PC]).unwrap();
    assert_eq!((frame.bytes, frame.own_bytes), (72, 72));
    assert!(frame.returns && !frame.uses_floats);
    assert_eq!(one(&[RETURN]).unwrap().bytes, 0);
    // STR R8, [SP, #-4]!; VPUSH {D8}; VPOP {D8}; LDR R8, [SP], #4
    let frame = one(&[0xF84D, 0x8D04, 0xED2D, 0x8B02, 0xECBD, 0x8B02, 0xF85D, 0x8B04, RETURN]).unwrap();
    assert_eq!(frame.bytes, 12);
    assert!(frame.uses_floats);
}

#[test]
fn a_missing_push_is_detected() {
    let whole = [PUSH_R4_LR, TAKE_64, GIVE_64, POP_R4_PC];
    assert!(one(&whole).is_ok());
    for dropped in 0..3 {
        let rest: Vec<u16> =
            whole.iter().enumerate().filter(|(at, _)| *at != dropped).map(|(_, code)| *code).collect();
        assert!(one(&rest).is_err(), "without instruction {dropped}");
    }
    // One register fewer: PUSH {R4} instead of PUSH {R4, LR}.
    assert!(one(&[0xB410, TAKE_64, GIVE_64, POP_R4_PC]).is_err());
    // The value of R4 is restored to R5: POP {R5, PC}.
    let error = one(&[PUSH_R4_LR, 0xBD20]).unwrap_err();
    assert!(matches!(error, FrameError::NotRestored { register: 5, .. }), "{error}");
}

#[test]
fn an_unknown_stack_pointer_is_reported_with_its_location() {
    // MOV SP, R0
    let error = one(&[0x4685, RETURN]).unwrap_err();
    assert_eq!(error.to_string(), "f: unknown stack pointer");
    // CBZ R0 over the PUSH
    let error = one(&[0xB100, PUSH_R4_LR, 0xBF00, RETURN]).unwrap_err();
    assert!(matches!(error, FrameError::DepthMismatch { .. }), "{error}");
    let error = one(&[0xBF00, 0xBF00]).unwrap_err();
    assert!(matches!(error, FrameError::NoCode { .. }), "{error}");
}

#[test]
fn a_stack_pointer_saved_in_another_register_is_tracked() {
    // PUSH {R7, LR}; MOV R7, SP; SUB SP, #64; MOV SP, R7; POP {R7, PC}
    assert_eq!(one(&[PUSH_R7_LR, 0x466F, TAKE_64, 0x46BD, POP_R7_PC]).unwrap().bytes, 72);
}

#[test]
fn calls_are_found_with_their_depths() {
    let frame = followed(&[("f", calling(0, 1)), ("g", vec![RETURN])]).unwrap();
    let [(at, called)] = &frame.calls.iter().collect::<Vec<_>>()[..] else { panic!("one call") };
    assert_eq!((**at, **called), (address(0) + 2, Call { depth_bytes: 8, callee: Some(address(1)) }));
}

#[test]
fn a_call_through_a_loaded_address_is_resolved() {
    // LDR R0, [PC, #4]; BLX R0: alignment padding lies before the constant pool.
    let [low, high] = [0x0141, 0x0800];
    let code = vec![PUSH_R7_LR, 0x4801, CALL_R0, POP_R7_PC, low, high];
    let mut image = image(&[("f", code), ("g", vec![RETURN])], &[]);
    // Constants follow the code.
    image.code.retain(|at, _| !(address(0) + 8..address(1)).contains(at));
    let frame = Frames::new(&image).of(address(0)).unwrap();
    assert_eq!(frame.calls[&(address(0) + 4)].callee, Some(address(1)));
}

#[test]
fn analysis_stops_after_a_call_that_never_returns() {
    let panics = [&[PUSH_R7_LR][..], &call(0, 1, 1)].concat();
    let frame = followed(&[("f", panics), ("panic", vec![LOOP])]).unwrap();
    assert!(!frame.returns);
    // The same applies if both call each other.
    let panics = [&[PUSH_R7_LR][..], &call(1, 1, 0)].concat();
    let frame = followed(&[("f", [&[PUSH_R7_LR][..], &call(0, 1, 1)].concat()), ("g", panics)]).unwrap();
    assert!(!frame.returns);
}

#[test]
fn outlined_pieces_are_part_of_their_function() {
    // The piece is the function's end: POP {R4, PC}.
    let ends = [&[PUSH_R4_LR, TAKE_64, GIVE_64][..], &jump(0, 3, 1)].concat();
    let frame = followed(&[("f", ends), ("OUTLINED_FUNCTION_0", vec![POP_R4_PC])]).unwrap();
    assert!(frame.returns);
    assert_eq!(frame.bytes, 72);
    assert!(frame.outlined_pieces.iter().eq(&[address(1)]), "{:?}", frame.outlined_pieces);
    // The piece is called, and itself calls: B.W g.
    let calls = [&[PUSH_R7_LR][..], &call(0, 1, 1), &[POP_R7_PC]].concat();
    let piece = ("OUTLINED_FUNCTION_1", jump(1, 0, 2).to_vec());
    let frame = followed(&[("f", calls), piece, ("g", vec![RETURN])]).unwrap();
    assert_eq!(frame.calls[&address(1)], Call { depth_bytes: 8, callee: Some(address(2)) });
    assert!(frame.outlined_pieces.iter().eq(&[address(1)]), "{:?}", frame.outlined_pieces);
}

#[test]
fn an_out_of_range_call_goes_through_the_linker_thunk() {
    // MOVW R12, #0x0181; MOVT R12, #0x0800; BX R12: to g.
    let thunk = ("__Thumbv7ABSLongThunk_g", vec![0xF240, 0x1C81, 0xF6C0, 0x0C00, 0x4760]);
    let calls = [&[PUSH_R7_LR][..], &call(0, 1, 1), &[POP_R7_PC]].concat();
    let image = image(&[("f", calls), thunk, ("g", vec![RETURN])], &[]);
    let frames = Frames::new(&image);
    let (caller, thunk) = (frames.of(address(0)).unwrap(), frames.of(address(1)).unwrap());
    assert!(caller.returns && thunk.returns);
    assert_eq!((caller.bytes, thunk.bytes), (8, 0));
    assert!(
        thunk.calls.values().eq(&[Call { depth_bytes: 0, callee: Some(address(2)) }]),
        "{:?}",
        thunk.calls
    );
}

#[test]
fn an_outlined_piece_behind_a_thunk_is_part_of_its_function() {
    // MOVW R12, #0x0181; MOVT R12, #0x0800; BX R12: to a piece that reserves and releases 64 bytes.
    let thunk = ("__Thumbv7ABSLongThunk_OUTLINED_FUNCTION_0", vec![0xF240, 0x1C81, 0xF6C0, 0x0C00, 0x4760]);
    let calls = [&[PUSH_R7_LR][..], &call(0, 1, 1), &[POP_R7_PC]].concat();
    let piece = ("OUTLINED_FUNCTION_0", vec![TAKE_64, GIVE_64, RETURN]);
    let frame = followed(&[("f", calls), thunk, piece]).unwrap();
    assert!(frame.returns && frame.calls.is_empty(), "{:?}", frame.calls);
    assert_eq!((frame.bytes, frame.own_bytes), (72, 8));
    assert!(frame.outlined_pieces.iter().eq(&[address(1), address(2)]), "{:?}", frame.outlined_pieces);
}

#[test]
fn jump_tables_are_followed() {
    // TBB [PC, R0] to a return, or to a return after 64 bytes on the stack.
    let mut image = image(&[("f", vec![0xE8DF, 0xF000, 0x0201, RETURN, TAKE_64, GIVE_64, RETURN])], &[]);
    image.code.remove(&(address(0) + 4));
    assert_eq!(Frames::new(&image).of(address(0)).unwrap().bytes, 64);
    // First the branch with the 64 bytes starts with an instruction that is not modelled, then both branches
    // do.
    for unmodelled in [address(0) + 8, address(0) + 6] {
        image.code.remove(&unmodelled);
        let error = Frames::new(&image).of(address(0)).unwrap_err();
        assert!(matches!(error, FrameError::NoCode { .. }), "{error}");
    }
}

#[test]
fn a_table_ends_at_its_padding_and_at_constants() {
    let bytes = |code: &[u16], table: std::ops::Range<u32>| {
        let mut image = image(&[("f", code.to_vec())], &[]);
        image.code.retain(|at, _| !table.contains(&(at - address(0))));
        Frames::new(&image).of(address(0)).map(|frame| frame.bytes)
    };
    // Three byte entries, and one padding byte.
    let three = [0xE8DF, 0xF000, 0x0302, 0x0004, RETURN, RETURN, TAKE_64, GIVE_64, RETURN];
    assert_eq!(bytes(&three, 4..8), Ok(64));
    // One halfword entry, and a NOP as padding.
    let half = [0xE8DF, 0xF010, 0x0002, 0xBF00, TAKE_64, GIVE_64, RETURN];
    assert_eq!(bytes(&half, 4..8), Ok(64));
    // Only the last byte can be padding.
    let first = [&three[..2], &[0x0300, 0x0004], &three[4..]].concat();
    assert!(matches!(bytes(&first, 4..8), Err(FrameError::NoCode { .. })));
    // LDR R1, [PC, #4] loads the constant after the table.
    let constant = [0x4901, 0xE8DF, 0xF000, 0x0403, 0x0001, 0x0800, RETURN, TAKE_64, GIVE_64, RETURN];
    assert_eq!(bytes(&constant, 6..12), Ok(64));
    // The table of TBB [R1, R0] does not directly follow the branch: ADR R1 locates it, ADR R2 does not.
    let pointed = |adr| [adr, 0xE8D1, 0xF000, 0xBF00, 0x0302, RETURN, TAKE_64, GIVE_64, RETURN];
    assert_eq!(bytes(&pointed(0xA101), 6..10), Ok(64));
    assert!(matches!(bytes(&pointed(0xA201), 6..10), Err(FrameError::InvalidReturn { .. })));
    // MOV R2, R3 in between changes nothing; MOV R1, R3 does, and MOV PC, R3 jumps elsewhere.
    let moved = |mov| [0xA101, mov, 0xE8D1, 0xF000, 0x0201, RETURN, TAKE_64, GIVE_64, RETURN];
    assert_eq!(bytes(&moved(0x461A), 8..10), Ok(64));
    assert!(matches!(bytes(&moved(0x4619), 8..10), Err(FrameError::InvalidReturn { .. })));
    assert!(bytes(&moved(0x469F), 8..10).is_err());
    // STR R3, [R2] changes nothing either; STR R3, [R1], #4 updates R1.
    assert_eq!(bytes(&moved(0x6013), 8..10), Ok(64));
    let moving = [0xA101, 0xF841, 0x3B04, 0xE8D1, 0xF000, 0x0201, RETURN, TAKE_64, GIVE_64, RETURN];
    assert!(matches!(bytes(&moving, 10..12), Err(FrameError::InvalidReturn { .. })));
    // The table of TBB [R1, R0] can be anywhere; TBB [PC, R0] without a table has no target.
    let elsewhere = [0xE8D1, 0xF000, 0x0302, 0x0004, RETURN, RETURN, RETURN];
    assert!(matches!(bytes(&elsewhere, 4..8), Err(FrameError::InvalidReturn { .. })));
    assert!(matches!(bytes(&[0xE8DF, 0xF000, RETURN], 0..0), Err(FrameError::InvalidReturn { .. })));
}

#[test]
fn a_call_target_without_a_function_symbol_is_rejected() {
    // From assembly, after a function without a size.
    let mut image = image(&[("start", calling(0, 1)), ("label", vec![TAKE_64, LOOP])], &[0]);
    image.functions.remove(&address(1));
    image.functions.get_mut(&address(0)).unwrap().bytes = address(2) - address(0);
    let error = GraphError::NoFunction { place: "start+0x2".into(), target: address(1) };
    assert_eq!(bound(&image, ""), Err(StackError::Graph(error.clone())));
    assert_eq!(
        reachability::check_reachable(&image, &CallDeclarations::default(), "start", &[]),
        Err(ReachError::Graph(error))
    );
}

#[test]
fn levels_nest_with_the_frames_that_interrupts_save() {
    let program = [&[TAKE_64][..], &SQUARE_ROOT, &[LOOP]].concat();
    let functions = [
        ("start", program),
        ("low", vec![PUSH_R7_LR, POP_R7_PC]),
        ("high", vec![RETURN]),
        ("same", vec![PUSH_R4_LR, POP_R4_PC]),
        ("DefaultHandler", vec![PUSH_R4_LR, LOOP]),
    ];
    let image = image(&functions, &[0, 4, 4, 4, NONE, 1, 2, 3]);
    let bound = bound(&image, "").unwrap();
    let levels: Vec<_> =
        bound.levels.iter().map(|level| (level.priority, level.context_bytes, level.bytes)).collect();
    // The code below the low level uses floats: 26 words; the low level does not: 8 words; 4 bytes of
    // alignment each.
    assert_eq!(levels, [(None, 0, 64), (Some(6), 108, 8), (Some(2), 36, 8)]);
    assert_eq!((bound.bytes, bound.available_bytes), (64 + 108 + 8 + 36 + 8, 0x400));
    assert_eq!(bound.levels[2].handler, "same");
}

#[test]
fn an_interrupt_without_a_priority_is_rejected() {
    let image = image(&[("start", vec![LOOP]), ("unheard", vec![RETURN])], &[0, NONE, NONE, 1]);
    let error = bound(&image, "").unwrap_err();
    assert_eq!(error, StackError::NoPriority { handler: "unheard".into() });
}

#[test]
fn a_stack_larger_than_the_linkers_is_detected() {
    // SUB.W SP, SP, #1024 uses the whole stack.
    let fits = [("start", vec![0xF5AD, 0x6D80, LOOP])];
    let bound_of = |functions: &[Code]| bound(&image(functions, &[0]), "").unwrap();
    let bound = bound_of(&fits);
    assert_eq!(bound.bytes, bound.available_bytes);
    let bound = bound_of(&[("start", vec![PUSH_R7_LR, 0xF5AD, 0x6D80, LOOP])]);
    assert!(bound.bytes > bound.available_bytes);
}

#[test]
fn recursion_is_rejected_with_its_chain_and_allowed_if_declared() {
    let functions = [("start", calling(0, 1)), ("f", calling(1, 2)), ("g", calling(2, 1))];
    // The functions return only because CBZ can skip the call.
    let functions = functions.map(|(name, mut code)| {
        code.insert(0, 0xB110);
        let number = usize::from(name == "f") + 2 * usize::from(name == "g");
        let [high, low] = call(number, 2, if number == 1 { 2 } else { 1 });
        (name, vec![code[0], PUSH_R7_LR, high, low, POP_R7_PC, RETURN])
    });
    // CBZ R0 to the RETURN.
    let functions = functions.map(|(name, mut code)| {
        code[0] = 0xB118;
        (name, code)
    });
    let image = image(&functions, &[0]);
    let error = bound(&image, "").unwrap_err();
    assert_eq!(error, StackError::Recursion { chain: ["f", "g", "f"].map(String::from).to_vec() });
    // start, f, g, f, g, f: 8 bytes each.
    assert_eq!(bound(&image, "at most 2 g").unwrap().bytes, 48);
    // start, f, g, f, g: each line counts its own functions.
    assert_eq!(bound(&image, "at most 2 f\nat most 2 g").unwrap().bytes, 40);
}

#[test]
fn a_call_through_a_pointer_must_be_declared() {
    let through = vec![PUSH_R7_LR, CALL_R0, POP_R7_PC];
    let functions = [
        ("start", calling(0, 1)),
        ("f", through),
        ("a::g", calling(2, 3)),
        ("tick", vec![RETURN]),
        ("a::h", vec![TAKE_64, LOOP]),
    ];
    let image = image(&functions, &[0]);
    let error = bound(&image, "").unwrap_err();
    let StackError::Graph(GraphError::Undeclared { place, .. }) = error else { panic!("{error}") };
    assert_eq!(place, "f+0x2");
    assert_eq!(bound(&image, "f\n    a::*").unwrap().bytes, 8 + 8 + 64);
    assert_eq!(bound(&image, "f\n    a::* reaching tick").unwrap().bytes, 8 + 8 + 8);
    assert_eq!(bound(&image, "f\n    a::* not reaching tick").unwrap().bytes, 8 + 8 + 64);
    assert_eq!(bound(&image, "f from start\n    tick\nf\n    a::*").unwrap().bytes, 8 + 8);
    let error = bound(&image, "f\n    b::*").unwrap_err();
    assert!(matches!(error, StackError::Graph(GraphError::Unmatched { .. })), "{error}");
}

#[test]
fn last_functions_are_on_top_and_early_functions_exclude_late_interrupts() {
    let functions = [
        ("start", calling(0, 3)),
        ("low", calling(1, 4)),
        ("high", vec![RETURN]),
        ("early", vec![TAKE_64, GIVE_64, RETURN]),
        ("last", calling(4, 5)),
        ("deep", vec![TAKE_64, LOOP]),
    ];
    let vectors = [0, NONE, NONE, 1, 2];
    let image = code::image(&functions, &vectors);
    let bytes = |declared| bound(&image, declared).unwrap().bytes;
    assert_eq!(bytes(""), 8 + 64 + 36 + 8 + 8 + 64 + 36);
    assert_eq!(bytes("last last"), 8 + 64 + 36 + 8 + 8 + 64);
    assert_eq!(bytes("late low\nearly early"), 8 + 36 + 8 + 8 + 64 + 36);
    assert_eq!(bytes("late low\nearly early\nlast last"), 8 + 36 + 8 + 8 + 64);
    // Before it masks interrupts, it can be interrupted itself.
    let own = [&functions[..4], &[("last", vec![TAKE_64, LOOP])]].concat();
    let own = bound(&code::image(&own, &vectors), "last last").unwrap();
    assert_eq!(own.bytes, 8 + 64 + 36 + 8 + 64 + 36);
    let error = bound(&image, "last missing").unwrap_err();
    assert!(matches!(error, StackError::Unmatched { .. }), "{error}");
}

#[test]
fn a_fault_handler_restarts_the_stack() {
    // LDR R0, [PC, #0]; MOV SP, R0; B.N to itself; the top of the stack.
    let fault = vec![0x4801, 0x4685, TAKE_64, LOOP, 0x0400, 0x2000];
    let mut image = image(&[("start", vec![LOOP]), ("fault", fault)], &[0, NONE, 1]);
    image.code.retain(|at, _| *at < address(1) + 8);
    let bound = bound(&image, "").unwrap();
    assert!(bound.levels[1].restarts_stack);
    assert_eq!((bound.levels[1].priority, bound.bytes), (Some(-1), 64));
}

#[test]
fn a_reached_panic_is_reported_with_its_path() {
    let root = [&SQUARE_ROOT[..], &jump(0, 2, 1)].concat();
    let functions = [("tick", root), ("core::f", calling(1, 2)), ("core::panicking::panic", vec![LOOP])];
    let image = image(&functions, &[]);
    let only = |allowed: &[&str]| {
        let allowed: Vec<NamePattern> = allowed.iter().map(|name| NamePattern::new(name)).collect();
        reachability::check_reachable(&image, &CallDeclarations::default(), "tick", &allowed)
    };
    let path = ["tick+0x4", "core::f+0x2", "core::panicking::panic"].map(String::from).to_vec();
    assert_eq!(only(&["core::f"]), Err(ReachError::Forbidden { path }));
    let reached = only(&["core::*"]).unwrap();
    assert_eq!((reached.functions.len(), reached.square_roots), (3, 1));
    assert!(matches!(
        reachability::check_reachable(&image, &CallDeclarations::default(), "tock", &[]),
        Err(ReachError::NoRoot { .. })
    ));
}

#[test]
fn traps_and_undeclared_pointer_calls_are_reported_too() {
    let only = |code: Vec<u16>| {
        reachability::check_reachable(
            &image(&[("tick", code)], &[]),
            &CallDeclarations::default(),
            "tick",
            &[],
        )
    };
    let error = only(vec![0xB100, RETURN, TRAP]).unwrap_err();
    assert_eq!(error, ReachError::Trap { path: ["tick", "tick+0x4"].map(String::from).to_vec() });
    let error = only(vec![PUSH_R7_LR, CALL_R0, POP_R7_PC]).unwrap_err();
    assert!(matches!(error, ReachError::Graph(GraphError::Undeclared { .. })), "{error}");
}

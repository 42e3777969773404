//! Cost of encoding and decoding a packet and overhead of each carrier, compared with other systems.

use super::PROFILE;
use super::count::instructions;
use crate::shell::{cargo, run, target};
use crate::table::table;

/// Packets of the short and the long run; their difference excludes the start-up.
const PACKETS: [u16; 2] = [200, 1200];
/// Maximum instructions for encoding or decoding without a tag.
const PLAIN_BUDGET: f64 = 3000.0;
/// Maximum instructions with a tag.
const AUTH_BUDGET: f64 = 6000.0;

const CARRIERS: [(&str, &str, &str); 7] = [
    ("datagram", "crc", "UDP"),
    ("uart", "crc", "UART"),
    ("can_fd", "crc", "CAN FD"),
    ("can", "crc", "classic CAN"),
    ("datagram", "auth", "UDP, with a tag"),
    ("uart", "auth", "UART, with a tag"),
    ("can_fd", "auth", "CAN FD, with a tag"),
];

const HEAD: &str = "
A packet of Table 1 at 3 DoF has 9 words of 32 bits. Bytes are those given to the carrier: on UART with COBS and the zeros around
a frame, on CAN FD with the length and padding, on classic CAN all frames of the packet. Start and stop bits, identifiers and
CAN's own CRC are not included. Instructions are for x86-64, with its AES instructions for the tag: a Cortex-M4F has none and
takes far more. This table has no tag on classic CAN.
";

/// From public documents; not checked by a test.
const PEERS: &str = "
Overhead of other protocols for the same 36 bytes, from their public documents. Their instructions are not counted.

| System | Overhead, bytes | Check of content | Counter | Source |
|---|---:|---|---|---|
| moteus, CAN FD | 2 per group of registers of one type and adjacent numbers | CAN's own | none | moteus documentation, CAN protocol |
| ODrive CANSimple, classic CAN | 0; 8 data bytes a frame, of one kind | CAN's own | none | ODrive documentation, CAN protocol |
| VESC, UART | 6: start, length, command, CRC-16, stop | CRC-16 | none | VESC documentation, UART protocol |
| CANopen PDO, classic CAN | 0; at most 8 data bytes | CAN's own | none | CiA 301 |

DIMSART's larger overhead contains a counter (detects old, duplicate and lost packets), an echo (round-trip time), the content's
number (prevents mix-ups) and a CRC-32 from end to end (on classic CAN a CRC-8 and a counter in each frame).
";

/// A row of the table.
pub(super) struct Frame {
    name: &'static str,
    has_tag: bool,
    word_bytes: f64,
    wire_bytes: f64,
    encode: f64,
    decode: f64,
}

/// Builds and counts the programs.
pub(super) fn count() -> Result<Vec<Frame>, String> {
    let example = ["build", "--profile", PROFILE, "--package", "dimsart-core", "--example", "frame_cost"];
    run(&mut cargo(&example))?;
    CARRIERS.into_iter().map(|(carrier, protection, name)| frame(carrier, protection, name)).collect()
}

fn frame(carrier: &str, protection: &str, name: &'static str) -> Result<Frame, String> {
    let program = target().join(PROFILE).join("examples/frame_cost");
    let total = |function: &str, packets: u16| {
        let arguments = [carrier, protection, &packets.to_string()].map(str::to_owned);
        instructions(&program, &[&format!("--toggle-collect=*{function}*")], &arguments)
    };
    let per_packet = |function: &str| {
        let [few, many] = PACKETS;
        let ((few_count, _), (many_count, out)) = (total(function, few)?, total(function, many)?);
        Ok::<_, String>(((many_count - few_count) / f64::from(many - few), out))
    };
    let (encode, out) = per_packet("counted_encode")?;
    let (decode, _) = per_packet("counted_decode")?;
    let mut bytes = out.split_whitespace().map_while(|number| number.parse().ok());
    match (bytes.next(), bytes.next()) {
        (Some(word_bytes), Some(wire_bytes)) => {
            Ok(Frame { name, has_tag: protection == "auth", word_bytes, wire_bytes, encode, decode })
        }
        _ => Err(format!("frame_cost {carrier} printed no bytes: {out}")),
    }
}

/// Returns the most expensive encoding or decoding without and with a tag, with their budgets.
pub(super) fn budgets(frames: &[Frame]) -> [(&'static str, f64, f64); 2] {
    let dearest = |has_tag: bool| {
        let frames = frames.iter().filter(|frame| frame.has_tag == has_tag);
        frames.flat_map(|frame| [frame.encode, frame.decode]).fold(0.0, f64::max)
    };
    [
        ("encoding or decoding a packet", dearest(false), PLAIN_BUDGET),
        ("the same with a tag", dearest(true), AUTH_BUDGET),
    ]
}

/// Returns the section of the page.
pub(super) fn text(frames: &[Frame]) -> String {
    let row = |frame: &Frame| {
        let Frame { word_bytes, wire_bytes, encode, decode, .. } = frame;
        let numbers = [*wire_bytes, wire_bytes - word_bytes, encode.round(), decode.round()];
        let [wire, overhead, encode, decode] = numbers.map(|number| format!("{number:.0}"));
        [frame.name.to_owned(), wire, overhead, encode, decode]
    };
    let rows: Vec<_> = frames.iter().map(row).collect();
    let head = ["Carrier", "Bytes", "Overhead", "Encode", "Decode"];
    format!("{HEAD}\n{}{PEERS}", table(head, &rows).trim_start())
}
